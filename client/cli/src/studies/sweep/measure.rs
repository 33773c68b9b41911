//! What `--measure` asks of a run: heights, centres, speeds, single particles, forces on colliders.
//!
//! Enters: a measure as it is typed, a simulation at its end, what colliders felt. Leaves: numbers, in m, m/s and N.

use std::ops::Range;

use nappe_scene::{Layout, suggestion};
use nappe_sim::{
    field::Field,
    world::{Simulation, WorldSetup},
};

use super::felt::{Felt, Force};
use crate::{
    options::particles::{self, Particle},
    words::error::{CliError, Result},
};

/// Quantities as they are typed, with N for the number or the name of a particle.
const QUANTITIES: [&str; 9] = [
    "lowest",
    "highest",
    "centre.x",
    "centre.y",
    "centre.z",
    "fastest",
    "particle.N.x",
    "particle.N.y",
    "particle.N.z",
];
/// The same of a collider.
const FORCES: [&str; 5] = ["force.x", "force.y", "force.z", "force.mean", "force.greatest"];
const AXES: [&str; 3] = ["x", "y", "z"];

/// What is measured, by the first part of measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Cloth,
    Snow,
    Collider,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Cloth, Self::Snow, Self::Collider];

    const fn name(self) -> &'static str {
        match self {
            Self::Cloth => "body",
            Self::Snow => "snow",
            Self::Collider => "collider",
        }
    }

    /// The same for people.
    const fn words(self) -> &'static str {
        match self {
            Self::Cloth => "body",
            Self::Snow => "object of snow",
            Self::Collider => "collider",
        }
    }

    /// What is measured of it, as it is typed; the first is an example.
    const fn quantities(self) -> &'static [&'static str] {
        match self {
            Self::Cloth | Self::Snow => &QUANTITIES,
            Self::Collider => &FORCES,
        }
    }
}

/// What is measured of a body or of a collider.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Quantity {
    /// y of its lowest particle (m).
    Lowest,
    /// y of its highest particle (m).
    Highest,
    /// The centre of its mass along an axis (m).
    Centre(usize),
    /// The largest speed of its particles (m/s).
    Fastest,
    /// Where a particle is along an axis (m), in the user's numbering of the body, or by its name.
    Particle(Particle, usize),
    /// The force on a collider (N).
    Force(Force),
}

/// A quantity of a body, of an object of snow or of a collider.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Measure {
    /// As it was typed, which is the name of its column.
    pub(crate) name: String,
    kind: Kind,
    /// Name of the body or of the collider.
    body: String,
    quantity: Quantity,
}

impl Measure {
    /// `body.NAME.QUANTITY`, `snow.NAME.QUANTITY` or `collider.NAME.QUANTITY`.
    pub(crate) fn parse(text: &str) -> std::result::Result<Self, String> {
        let text = text.trim();
        let (kind, rest) = text.split_once('.').unwrap_or((text, ""));
        let Some(kind) = Kind::ALL.into_iter().find(|known| known.name() == kind) else {
            let near = suggestion(kind, Kind::ALL.map(Kind::name));
            return Err(format!("'{text}' begins with '{kind}'; {near}"));
        };
        let parts: Vec<&str> = rest.split('.').collect();
        let read = match kind {
            Kind::Cloth | Kind::Snow => of_body(text, &parts)?,
            Kind::Collider => of_collider(&parts),
        };
        let Some((body, quantity)) = read else {
            let asked = parts.get(1..).unwrap_or_default().join(".");
            let near = suggestion(&asked, kind.quantities().iter().copied());
            return Err(format!("'{text}': '{asked}' is nothing that is measured; {near}"));
        };
        let body = body.join(".");
        if body.is_empty() {
            let (words, name, example) = (kind.words(), kind.name(), kind.quantities()[0]);
            return Err(format!("'{text}' names no {words}: {name}.NAME.{example}"));
        }
        Ok(Self { name: text.to_owned(), kind, body, quantity })
    }

    /// Refuses what a world does not have.
    ///
    /// # Errors
    /// What it has.
    pub(crate) fn check(&self, bodies: &Bodies) -> std::result::Result<(), String> {
        let Self { name, kind, body, quantity } = self;
        if bodies.collider(self).is_some() {
            return Ok(());
        }
        let Some(found) = bodies.find(self) else {
            let others: Vec<&str> = bodies.names(*kind).collect();
            let missing = format!("--measure {name}: the scene has no {}", kind.words());
            return Err(if others.is_empty() {
                missing
            } else {
                format!("{missing} '{body}'; {}", suggestion(body, others))
            });
        };
        match quantity {
            Quantity::Particle(particle, _) => match particle.among(found.layout, found.particles.len()) {
                Ok(one) if one.len() == 1 => Ok(()),
                Ok(several) => Err(format!(
                    "--measure {name}: '{particle}' means {} particles; one is measured",
                    several.len()
                )),
                Err(message) => {
                    Err(format!("--measure {name}: the particle of {} '{body}' {message}", kind.words()))
                }
            },
            _ => Ok(()),
        }
    }

    /// What it is (m, m/s or N) for particles at places with velocities, and for what colliders felt; not a number of what the
    /// world does not have.
    fn value(&self, bodies: &Bodies, felt: &Felt, x: &[[f64; 3]], v: &[[f64; 3]]) -> f64 {
        if let (Quantity::Force(force), Some(collider)) = (&self.quantity, bodies.collider(self)) {
            return felt.force(collider, *force);
        }
        let Some(body) = bodies.find(self) else { return f64::NAN };
        let range = body.particles.clone();
        let (x, v, masses) = (&x[range.clone()], &v[range.clone()], &bodies.masses[range]);
        let heights = x.iter().map(|[_, y, _]| *y);
        match &self.quantity {
            Quantity::Lowest => heights.fold(f64::INFINITY, f64::min),
            Quantity::Highest => heights.fold(f64::NEG_INFINITY, f64::max),
            Quantity::Centre(axis) => centre(x, masses, *axis),
            Quantity::Fastest => {
                let squares = v.iter().map(|[x, y, z]| x * x + y * y + z * z);
                squares.fold(0.0, f64::max).sqrt()
            }
            Quantity::Particle(particle, axis) => match particle.among(body.layout, x.len()).as_deref() {
                Ok([one]) => x[*one as usize][*axis],
                _ => f64::NAN,
            },
            // It is no body's.
            Quantity::Force(_) => f64::NAN,
        }
    }
}

/// The name of a body or of a collider, in parts, and what is measured of it; none of what is not measured.
type Asked<'a> = Option<(&'a [&'a str], Quantity)>;

/// What is asked of a body.
fn of_body<'a>(text: &str, parts: &'a [&'a str]) -> std::result::Result<Asked<'a>, String> {
    Ok(Some(match parts {
        [body @ .., "lowest"] => (body, Quantity::Lowest),
        [body @ .., "highest"] => (body, Quantity::Highest),
        [body @ .., "fastest"] => (body, Quantity::Fastest),
        [body @ .., "centre", along] => (body, Quantity::Centre(axis(text, along)?)),
        [body @ .., "particle", number, along] => {
            let particle = Particle::parse(number).map_err(|error| format!("'{text}': {error}"))?;
            (body, Quantity::Particle(particle, axis(text, along)?))
        }
        _ => return Ok(None),
    }))
}

/// The same of a collider.
fn of_collider<'a>(parts: &'a [&'a str]) -> Asked<'a> {
    let [collider @ .., "force", which] = parts else { return None };
    let force = match *which {
        "mean" => Force::Mean,
        "greatest" => Force::Greatest,
        along => Force::Along(AXES.iter().position(|axis| *axis == along)?),
    };
    Some((collider, Quantity::Force(force)))
}

/// The number of an axis.
fn axis(text: &str, name: &str) -> std::result::Result<usize, String> {
    let place = AXES.iter().position(|known| *known == name);
    place.ok_or_else(|| format!("'{text}': '{name}' is no axis; allowed: {}", AXES.join(", ")))
}

/// The centre of masses (kg) along an axis (m); of particles without a mass, which are all pinned, their mean.
fn centre(x: &[[f64; 3]], masses: &[f64], axis: usize) -> f64 {
    let mass: f64 = masses.iter().sum();
    if mass > 0.0 {
        x.iter().zip(masses).map(|(x, m)| m * x[axis]).sum::<f64>() / mass
    } else {
        x.iter().map(|x| x[axis]).sum::<f64>() / x.len() as f64
    }
}

/// A body or an object of snow: its name and its particles among all.
#[derive(Clone, Debug)]
struct Body {
    kind: Kind,
    name: String,
    particles: Range<usize>,
    /// How they are numbered.
    layout: Layout,
}

/// The bodies and the objects of snow of a world, in the order of their particles, and its colliders.
#[derive(Clone, Debug)]
pub(crate) struct Bodies {
    all: Vec<Body>,
    /// Names of the colliders, in the order of the scene.
    colliders: Vec<String>,
    /// Masses (kg) of all particles.
    masses: Vec<f64>,
}

impl Bodies {
    pub(crate) fn of(setup: &WorldSetup) -> Self {
        let cloths = setup.bodies.iter().map(|cloth| {
            let network = &cloth.network;
            let springs = network.springs.iter().map(|spring| spring.particles).collect();
            let layout = particles::layout(network.masses.len(), network.triangles.clone(), springs);
            (Kind::Cloth, &cloth.name, &network.masses, layout)
        });
        let objects = setup.snow.iter().flat_map(|snow| &snow.objects);
        let snow = objects.map(|object| (Kind::Snow, &object.name, &object.mass, Layout::Free));
        let (mut bodies, mut masses) = (Vec::new(), Vec::new());
        for (kind, name, own, layout) in cloths.chain(snow) {
            let particles = masses.len()..masses.len() + own.len();
            bodies.push(Body { kind, name: name.clone(), particles, layout });
            masses.extend_from_slice(own);
        }
        let colliders = setup.colliders.iter().map(|collider| collider.name.clone()).collect();
        Self { all: bodies, colliders, masses }
    }

    /// The body that a measure names.
    fn find(&self, measure: &Measure) -> Option<&Body> {
        self.all.iter().find(|body| body.kind == measure.kind && body.name == measure.body)
    }

    /// The place in the scene of the collider that a measure names.
    fn collider(&self, measure: &Measure) -> Option<usize> {
        let is_named = |name: &String| measure.kind == Kind::Collider && *name == measure.body;
        self.colliders.iter().position(is_named)
    }

    fn names(&self, kind: Kind) -> impl Iterator<Item = &str> {
        let bodies = self.all.iter().filter(move |body| body.kind == kind).map(|body| body.name.as_str());
        let colliders = self.colliders.iter().filter(move |_| kind == Kind::Collider);
        bodies.chain(colliders.map(String::as_str))
    }
}

/// What measures are at the present state of a simulation, whose colliders have felt so much.
pub(crate) fn values(
    measures: &[Measure],
    bodies: &Bodies,
    felt: &Felt,
    simulation: &Simulation,
) -> Vec<f64> {
    if measures.is_empty() {
        return Vec::new();
    }
    let mut x = vec![[0.0; 3]; simulation.particle_count()];
    let mut v = x.clone();
    simulation.read::<f64>(Field::Positions, x.as_flattened_mut());
    simulation.read::<f64>(Field::Velocities, v.as_flattened_mut());
    measures.iter().map(|measure| measure.value(bodies, felt, &x, &v)).collect()
}

/// Refuses a measure that is asked for twice.
///
/// # Errors
/// The second of them.
pub(crate) fn check_distinct(measures: &[Measure]) -> Result<()> {
    for (place, measure) in measures.iter().enumerate() {
        if measures[..place].iter().any(|other| other.name == measure.name) {
            return Err(CliError::usage(format!("--measure {}: is asked for twice", measure.name)));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_name_a_body_and_a_quantity() {
        let measure = |text: &str| Measure::parse(text).expect(text);
        assert_eq!(measure("body.sheet.lowest").quantity, Quantity::Lowest);
        assert_eq!(measure("snow.ball.centre.z").quantity, Quantity::Centre(2));
        let dotted = measure("body.a.b.particle.17.y");
        let number = Quantity::Particle(Particle::Number(17), 1);
        assert_eq!((dotted.body.as_str(), dotted.quantity), ("a.b", number));
        let corner = Quantity::Particle(Particle::Name("top_left".to_owned()), 2);
        assert_eq!(measure("body.sheet.particle.top_left.z").quantity, corner);
        let pushed = measure("collider.left.jaw.force.y");
        assert_eq!((pushed.body.as_str(), pushed.quantity), ("left.jaw", Quantity::Force(Force::Along(1))));
        assert_eq!(measure("collider.lid.force.mean").quantity, Quantity::Force(Force::Mean));
    }

    #[test]
    fn what_is_no_measure_says_what_is_near() {
        for (text, part) in [
            ("sheet.lowest", "begins with 'sheet'; allowed: body, snow, collider"),
            ("bodi.sheet.lowest", "did you mean 'body'?"),
            ("body.sheet.lowst", "did you mean 'lowest'?"),
            ("body.sheet", "allowed: lowest, highest"),
            ("body.lowest", "names no body"),
            ("body.sheet.force.x", "'force.x' is nothing that is measured"),
            ("collider.lid.force.greater", "did you mean 'force.greatest'?"),
            (
                "collider.lid.lowest",
                "'lowest' is nothing that is measured; allowed: force.x, force.y, force.z, force.mean, force.greatest",
            ),
            ("collider.force.x", "names no collider: collider.NAME.force.x"),
            ("body.sheet.centre.w", "'w' is no axis; allowed: x, y, z"),
            ("body.sheet.particle.-1.x", "'-1' is not a particle's number"),
            ("body.sheet.particle.topleft.x", "did you mean 'top_left'?"),
        ] {
            let error = Measure::parse(text).expect_err(text);
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn the_centre_is_that_of_masses() {
        let x = [[0.0, 1.0, 0.0], [3.0, 5.0, 0.0]];
        assert_eq!([0, 1].map(|axis| centre(&x, &[1.0, 2.0], axis)), [2.0, 11.0 / 3.0]);
        assert_eq!(centre(&x, &[0.0, 0.0], 1), 3.0);
    }
}
