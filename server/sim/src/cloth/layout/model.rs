//! A cloth laid out for computing: what never changes during a run, and the parameters that may.
//!
//! Reads a [`Network`]; writes arrays in Hilbert order, cut into blocks, with springs gathered by
//! row. Users see their own numbering everywhere; only this folder knows the other.

use serde::{Deserialize, Serialize};

use std::{collections::BTreeSet, ops::Range};

use super::{
    check::check_network,
    elements::Elements,
    figures::Figure,
    parts::Parts,
    rows::{Joint, Springs, sort_rows},
    surface::Surface,
    triangles::Triangles,
};
use crate::{
    cloth::{
        laws::Air,
        network::{
            Colours, Components, Joined, Loose, Network, Spring, SpringKind, SpringLaw, spacing, spread,
            warnings,
        },
        settings::ClothSettings,
    },
    interrupt,
    linalg::{CoarseLayout, PatchLayout},
    math::{LANES, Padded, Real, Sixteen, Vec3, vec3},
    parallel::{Ranks, Share, hilbert_order},
};

/// What never changes during a run.
#[derive(Clone, Debug)]
pub struct Model<R: Real> {
    /// Number of particles.
    pub count: usize,
    /// Particles per block: the unit of parallel work and of sums.
    pub block_size: usize,
    /// The blocks that are computed here.
    pub share: Share,
    /// Mass (kg); of a pinned particle: what it would weigh, or 0. A multiple of sixteen numbers, 0 beyond `count`.
    pub m: Vec<R>,
    /// 1 / mass (1/kg), 0 pins and corners of figures; as many as masses.
    pub inv_m: Vec<R>,
    /// The same, but for corners that give way; empty where none does.
    with_corners: Vec<R>,
    /// `user[particle]`: the user's number.
    pub user: Vec<u32>,
    /// `place[user's number]`: the particle.
    pub place: Vec<u32>,
    /// Springs, as rows of a matrix in sliced ELLPACK.
    pub springs: Springs<R>,
    /// Number of springs.
    pub spring_count: usize,
    /// Number of springs of each law.
    pub(crate) springs_of_laws: Vec<u32>,
    /// Which laws the springs of each of its networks have.
    pub(crate) laws_of_parts: Vec<Range<usize>>,
    /// Number of particles that are not pinned.
    pub(crate) free_count: usize,
    /// Mass of these (kg).
    pub(crate) free_mass: f64,
    /// Elements, a list per law.
    pub(crate) elements: Vec<Elements<R>>,
    /// Triangles, where the air acts on them.
    pub(crate) triangles: Option<Triangles>,
    /// The coarse space of the preconditioner, where the settings ask for one.
    pub(crate) coarse: Option<CoarseLayout>,
    /// The patches of the preconditioner, where the settings ask for them or solves may come to them.
    pub(crate) patches: Option<PatchLayout>,
    /// Which particles may move at once, where the settings have them move one by one.
    pub(crate) colours: Option<Colours>,
    /// What moves as a whole, likewise, and where the settings have pieces watched.
    pub(crate) components: Option<Components>,
    /// Its surface, where parts of it keep a distance or crossings are counted.
    pub(crate) surface: Option<Surface>,
    /// What of it frames lead.
    pub(crate) figures: Vec<Figure>,
    /// What moves by itself.
    pub(crate) parts: Parts,
    /// What no pin holds, where the settings have steps solve linear systems.
    pub(crate) loose: Option<Loose<R>>,
}

/// Stiffness and damping of the springs of one entry of a model's table of laws.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LawEntry {
    /// Kind of the springs.
    pub kind: SpringKind,
    /// Their stiffness and damping.
    pub law: SpringLaw,
}

/// What may change between two steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// Laws of springs: springs name them by index.
    pub laws: Vec<LawEntry>,
    /// Stiffness and damping of each list of elements.
    pub elements: Vec<SpringLaw>,
    /// Linear drag of the medium on each particle (N s/m).
    pub drag: f64,
    /// The air that acts on its triangles, of a cloth that feels it.
    pub air: Option<Air>,
}

/// The largest number of different laws in one body: indices are 16 bits.
const MAX_LAWS: usize = u16::MAX as usize - 1;

impl<R: Real> Model<R> {
    /// Lays out a network. The strings are warnings that do not stop a simulation.
    ///
    /// # Errors
    /// What is wrong with the network, as a sentence.
    pub fn new(
        network: &Network,
        settings: &ClothSettings,
    ) -> Result<(Self, Parameters, Vec<String>), String> {
        check_network(network, settings)?;
        let (model, parameters) = Self::over(&Joined::of(vec![network]), settings, None)?;
        Ok((model, parameters, Self::warnings(network)))
    }

    /// What is odd about a network that is sound, but does not stop a simulation.
    pub(crate) fn warnings(network: &Network) -> Vec<String> {
        warnings::<R>(network, spacing(network))
    }

    /// Lays out networks that are sound, as one cloth, for one of several ranks or for all of it.
    pub(crate) fn over(
        joined: &Joined<'_>,
        settings: &ClothSettings,
        ranks: Option<&Ranks>,
    ) -> Result<(Self, Parameters), String> {
        let network = &*joined.whole;
        let count = network.x.len();
        let Laws { table: laws, of_springs: law_of, of_parts: laws_of_parts } = Laws::of(joined)?;
        let numbering = hilbert_order(&network.x, spacing(network));
        let first = inverse(&numbering);
        let mut order = sort_rows(count, settings.block_size, &joints(network, &law_of, &first));
        if settings.has_sweeps() {
            order = spread(&order, settings.block_size, network.pairs(&first));
        }
        let user: Vec<u32> = order.iter().map(|&row| numbering[row as usize]).collect();
        let place = inverse(&user);
        let joints = joints(network, &law_of, &place);

        let padded = count.next_multiple_of(LANES);
        let mut inv_m: Vec<R> = user
            .iter()
            .map(|&old| network.masses[old as usize])
            .map(|m| if m > 0.0 { R::of(1.0 / m) } else { R::zero() })
            .collect();
        network.pins.iter().for_each(|&pin| inv_m[place[pin as usize] as usize] = R::zero());
        inv_m.resize(padded, R::zero());
        let mut m: Vec<R> = user.iter().map(|&old| R::of(network.masses[old as usize])).collect();
        m.resize(padded, R::zero());
        let figures = Figure::all_of(joined, &place);
        let with_corners = with_corners(&figures, &mut m, &inv_m);

        let mut model = Self {
            count,
            block_size: settings.block_size,
            share: match ranks {
                None => Share::whole(count, settings.block_size),
                Some(ranks) => {
                    let pairs = network.pairs(&place).chain(network.pairs_in_air(&place));
                    Share::of(count, settings.block_size, pairs, ranks)
                }
            },
            springs: Springs::new(count, settings.block_size, &joints),
            spring_count: joints.len(),
            springs_of_laws: count_laws(laws.len(), &joints),
            laws_of_parts,
            free_count: inv_m.iter().filter(|inv_m| **inv_m > R::zero()).count(),
            free_mass: free_mass(&m, &inv_m),
            elements: network
                .elements
                .iter()
                .map(|list| Elements::new(list, settings.block_size, &place))
                .collect(),
            triangles: network
                .air
                .map(|_| Triangles::new(&joined.triangles_of_cloth(), settings.block_size, &place)),
            surface: Surface::of(joined, settings, &place, &user),
            figures,
            m,
            inv_m,
            with_corners,
            user,
            place,
            coarse: None,
            patches: None,
            colours: None,
            components: None,
            parts: Parts::default(),
            loose: None,
        };
        model.lay_out(network, settings)?;
        let elements = network.elements.iter().map(|list| list.law).collect();
        let Network { drag, air, .. } = *network;
        Ok((model, Parameters { laws, elements, drag, air }))
    }

    /// Lays out what the settings ask for.
    fn lay_out(&mut self, network: &Network, settings: &ClothSettings) -> Result<(), String> {
        if settings.has_coarse_space() {
            self.coarse = Some(self.coarse_layout(network)?);
        }
        if settings.has_patches() {
            let made = self.patch_layout(network);
            // What is too entangled for them goes without, where nobody asked for them by name.
            self.patches = if settings.may_switch() { made.ok() } else { Some(made?) };
        }
        let components = Components::new(self.count, &self.inv_m, network.pairs(&self.place));
        let mut led = vec![None; self.count];
        for (number, figure) in self.figures.iter().enumerate() {
            for row in figure.rows() {
                led[row] = Some(number);
            }
        }
        self.parts = Parts::new(&components, [&self.m, &self.inv_m], self.block_size, &led);
        if settings.has_sweeps() {
            self.colours = Some(Colours::new(self.count, self.block_size, network.pairs(&self.place)));
        } else if settings.solves() {
            self.loose = Loose::new(&self.m, &components);
        }
        if settings.has_sweeps() || settings.rest.is_some() {
            self.components = Some(components);
        }
        Ok(())
    }

    /// Particles and their rings, and the order in which they are eliminated.
    fn patch_layout(&self, network: &Network) -> Result<PatchLayout, String> {
        if self.share.ranks().is_some() {
            return Err("the preconditioner patches is not divided over ranks".to_owned());
        }
        let rest: Vec<_> = self.user.iter().map(|&old| network.x[old as usize]).collect();
        let is_free: Vec<_> = self.inv_m[..self.count].iter().map(|inv_m| *inv_m > R::zero()).collect();
        let [rings, pairs] = [network.rings(&self.place), network.pairs(&self.place).collect()];
        let joined = network.elements.iter().filter(|list| list.corner_count() > 0);
        let joined = joined.map(|list| list.kind.particles()).max().unwrap_or(2);
        PatchLayout::new(&rest, &is_free, self.block_size, [&rings, &pairs], joined)
    }

    /// Affine functions on the parts of each block, and which parts are joined.
    fn coarse_layout(&self, network: &Network) -> Result<CoarseLayout, String> {
        let rest: Vec<_> = self.user.iter().map(|&old| network.x[old as usize]).collect();
        let is_free: Vec<_> = self.inv_m[..self.count].iter().map(|inv_m| *inv_m > R::zero()).collect();
        let layout = CoarseLayout::new(&rest, &is_free, self.block_size, network.pairs(&self.place))?;
        Ok(layout.over(&self.share))
    }

    /// Whether all of it is one part that no pin holds.
    pub(crate) fn is_loose(&self) -> bool {
        matches!(self.parts.all(), [part] if !part.is_held)
    }

    /// 1 / mass (1/kg) of all that a solve of contact moves, 0 pins: free particles, and corners of figures that give way. Gravity, the medium and
    /// colliders know the free ones alone.
    pub(crate) fn movable(&self) -> &[R] {
        if self.with_corners.is_empty() { &self.inv_m } else { &self.with_corners }
    }

    /// Whether a change of velocity (m/s) takes any corner of a figure off its way.
    pub(crate) fn gives_way(&self, dv: &[Sixteen<R>]) -> bool {
        let mut giving = self.figures.iter().flat_map(Figure::giving);
        giving.any(|(row, _)| dv[row / LANES].get(row % LANES) != Vec3::zeros())
    }

    /// Whether any corner of a figure may give way.
    pub(crate) fn has_giving_corners(&self) -> bool {
        !self.with_corners.is_empty()
    }

    /// Its surface, where parts of it keep a distance.
    pub(crate) fn thick_surface(&self) -> Option<&Surface> {
        self.surface.as_ref().filter(|surface| surface.thickness > 0.0)
    }

    /// Records that a block copies for its springs or elements, at most.
    pub(crate) fn room(&self) -> usize {
        let lists =
            self.elements.iter().map(Elements::room).chain(self.triangles.as_ref().map(Triangles::room));
        lists.fold(self.springs.room(), usize::max)
    }

    /// Positions or velocities of the user in the model's order: a multiple of sixteen, 0 beyond `count`.
    pub fn arrange(&self, values: &[[f64; 3]]) -> Vec<Padded<R>> {
        let mut vectors: Vec<_> =
            self.user.iter().map(|&old| Padded::new(&vec3(values[old as usize]))).collect();
        vectors.resize(self.m.len(), Padded::default());
        vectors
    }
}

/// How many springs each law has.
fn count_laws(laws: usize, joints: &[Joint]) -> Vec<u32> {
    let mut counts = vec![0; laws];
    for joint in joints {
        counts[joint.law as usize] += 1;
    }
    counts
}

/// Mass of the particles that are not pinned (kg).
fn free_mass<R: Real>(m: &[R], inv_m: &[R]) -> f64 {
    m.iter().zip(inv_m).filter(|(_, inv_m)| **inv_m > R::zero()).map(|(m, _)| m.to_f64()).sum()
}

/// Inverse masses (1/kg) that those of corners which give way are added to, whose masses (kg) are written into `m`; none where no corner gives way.
fn with_corners<R: Real>(figures: &[Figure], m: &mut [R], inv_m: &[R]) -> Vec<R> {
    let mut all = Vec::new();
    for (row, mass) in figures.iter().flat_map(Figure::giving) {
        if all.is_empty() {
            all.extend_from_slice(inv_m);
        }
        (m[row], all[row]) = (R::of(mass), R::of(1.0 / mass));
    }
    all
}

/// The inverse of a permutation.
fn inverse(order: &[u32]) -> Vec<u32> {
    interrupt::point();
    let mut places = vec![0; order.len()];
    order.iter().enumerate().for_each(|(new, &old)| places[old as usize] = new as u32);
    places
}

/// Springs between different particles, in the numbering that `place` gives.
fn joints(network: &Network, law_of: &[u16], place: &[u32]) -> Vec<Joint> {
    network
        .springs
        .iter()
        .zip(law_of)
        .inspect(|_| interrupt::point())
        .map(|(spring, &law)| Joint {
            ends: spring.particles.map(|p| place[p as usize]),
            rest_length: spring.rest_length,
            law,
        })
        .filter(|joint| joint.ends[0] != joint.ends[1])
        .collect()
}

/// Laws of springs: those of each network by themselves, so that they can change by themselves.
struct Laws {
    table: Vec<LawEntry>,
    /// The law of each spring.
    of_springs: Vec<u16>,
    /// Which laws the springs of each network have.
    of_parts: Vec<Range<usize>>,
}

impl Laws {
    fn of(joined: &Joined<'_>) -> Result<Self, String> {
        let mut laws = Self { table: Vec::new(), of_springs: Vec::new(), of_parts: Vec::new() };
        for part in &joined.parts {
            let first = laws.table.len();
            laws.add(part)?;
            laws.of_parts.push(first..laws.table.len());
        }
        Ok(laws)
    }

    /// Adds the different laws of a network, ordered by kind and value, and the law of each spring.
    fn add(&mut self, network: &Network) -> Result<(), String> {
        let key = |s: &Spring| (s.kind, s.law.stiffness.to_bits(), s.law.damping.to_bits());
        let runs = || network.springs.chunk_by(|a, b| key(a) == key(b)).inspect(|_| interrupt::point());
        let keys: BTreeSet<_> = runs().map(|run| key(&run[0])).collect();
        let keys: Vec<_> = keys.into_iter().collect();

        let first = self.table.len();
        let count = first + keys.len();
        if count > MAX_LAWS {
            return Err(format!(
                "{count} different pairs of stiffness and damping: at most {MAX_LAWS} are allowed"
            ));
        }

        self.table.extend(keys.iter().map(|&(kind, stiffness, damping)| LawEntry {
            kind,
            law: SpringLaw { stiffness: f64::from_bits(stiffness), damping: f64::from_bits(damping) },
        }));

        self.of_springs.reserve(network.springs.len());
        for run in runs() {
            let law = keys.binary_search(&key(&run[0])).expect("the table holds every spring's law");
            self.of_springs.extend(run.iter().map(|_| (first + law) as u16));
        }
        Ok(())
    }
}
