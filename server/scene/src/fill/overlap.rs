//! Space that two solids share, or two parts of one mesh: measured by looking at points of a lattice over the box that both share.

use nappe_sim::interrupt;

use super::{inside::Inside, lattice::divided_for, solid::Solid};
use crate::mesh::Part;

/// Share of the smaller of two solids from which on their overlap is told.
pub(crate) const TOLD: f64 = 0.01;
/// Points that are looked at in all boxes of a mesh together, nearly, and in each of them at least and at most.
const POINTS: u64 = 1 << 20;
const POINTS_OF_PAIR: [u64; 2] = [1 << 8, 1 << 15];
/// Triangles that are tested for all pairs together, nearly.
const TESTS: f64 = 2e8;
/// Points that are looked at in a box, however many triangles a test takes.
const FEWEST_POINTS: u64 = 64;
/// Pairs of parts whose boxes are compared, at most, and pairs that are measured.
const COMPARED: usize = 1 << 24;
const MEASURED: usize = 1 << 14;

/// Space that parts of a mesh share, which its volume counts more than once. A hole in a part is no such space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SharedByParts {
    /// How much the volume counts too often (m³).
    pub(crate) volume: f64,
    /// Its first moment (m⁴).
    pub(super) moment: [f64; 3],
    /// Pairs of parts that share more than [`TOLD`] of the smaller one.
    pub(crate) pairs: usize,
    /// The first triangles of the two parts that share most.
    pub(crate) most: [u32; 2],
    /// Whether there were too many pairs to look at all of them.
    pub(crate) is_cut_off: bool,
}

/// The box that two boxes share, each given by its lower and its upper corner (m); none where they at most touch.
pub(crate) fn shared_box(a: [[f64; 3]; 2], b: [[f64; 3]; 2]) -> Option<[[f64; 3]; 2]> {
    let low = [0, 1, 2].map(|c| a[0][c].max(b[0][c]));
    let high = [0, 1, 2].map(|c| a[1][c].min(b[1][c]));
    (0..3).all(|c| low[c] < high[c]).then_some([low, high])
}

/// The volume (m³) that two solids share within a box, from about so many points.
pub(crate) fn shared_volume([a, b]: [&Solid; 2], bounds: [[f64; 3]; 2], points: u64) -> f64 {
    let points = affordable(points, 1, a.cost() + b.cost());
    let mut found = 0_u64;
    let cell = for_each_point(bounds, points, |point| found += u64::from(a.holds(point) && b.holds(point)));
    found as f64 * cell
}

/// What the parts of a solid share; none where it is no mesh, or its parts are apart.
pub(crate) fn shared_by_parts(solid: &Solid) -> Option<SharedByParts> {
    let Solid::Mesh { mesh, inside } = solid else { return None };
    let (pairs, is_cut_off) = near_pairs(&mesh.parts);
    if pairs.is_empty() && !is_cut_off {
        return None;
    }

    let [fewest, most] = POINTS_OF_PAIR;
    let points = (POINTS / pairs.len().max(1) as u64).clamp(fewest, most);
    let points = affordable(points, pairs.len(), solid.cost());
    let mut found = SharedByParts { volume: 0.0, moment: [0.0; 3], pairs: 0, most: [0; 2], is_cut_off };
    let mut largest = 0.0;
    for (pair, bounds) in pairs {
        let [a, b] = pair.map(|part| &mesh.parts[part as usize]);
        let (volume, moment) = shared_by_pair(inside, pair, bounds, points);
        found.volume += volume;
        found.moment = [0, 1, 2].map(|c| found.moment[c] + moment[c]);
        found.pairs += usize::from(volume > TOLD * a.volume.min(b.volume));
        if volume > largest {
            (largest, found.most) = (volume, [a.first, b.first]);
        }
    }
    Some(found)
}

/// Volume (m³) and first moment (m⁴) of what two parts share and the volume of the mesh counts too often. Where more than two
/// parts are, each pair has its share of that.
fn shared_by_pair(inside: &Inside, pair: [u32; 2], bounds: [[f64; 3]; 2], points: u64) -> (f64, [f64; 3]) {
    let (mut volume, mut moment) = (0.0, [0.0; 3]);
    let cell = for_each_point(bounds, points, |point| {
        let [a, b, all] = inside.windings(point, pair);
        if a != 0 && b != 0 && all.abs() >= 2 {
            // Of n parts, n (n - 1) / 2 pairs share what is counted n - 1 times too often.
            let share = 2.0 / f64::from(all.abs());
            volume += share;
            moment = [0, 1, 2].map(|c| moment[c] + share * point[c]);
        }
    });
    (cell * volume, moment.map(|c| cell * c))
}

/// Counts once what the parts of a solid share.
pub(crate) fn count_once(solid: &mut Solid, shared: &SharedByParts) {
    if let Solid::Mesh { mesh, .. } = solid {
        mesh.take_off(shared.volume, shared.moment);
    }
}

/// So many points, or as many as can be looked at in a reasonable time where a test takes `cost` triangles.
fn affordable(points: u64, pairs: usize, cost: f64) -> u64 {
    points.min((TESTS / (cost * pairs.max(1) as f64)) as u64).max(FEWEST_POINTS)
}

/// Looks at the middles of about so many equal cells of a box; the volume of one of them (m³).
fn for_each_point([low, high]: [[f64; 3]; 2], points: u64, mut look: impl FnMut([f64; 3])) -> f64 {
    let size = [0, 1, 2].map(|c| high[c] - low[c]);
    let cells = divided_for(size, points);
    let edge = [0, 1, 2].map(|c| size[c] / cells[c] as f64);
    for i in 0..cells[0] {
        for j in 0..cells[1] {
            interrupt::point();
            for k in 0..cells[2] {
                let index = [i, j, k];
                look([0, 1, 2].map(|c| low[c] + (index[c] as f64 + 0.5) * edge[c]));
            }
        }
    }
    edge.iter().product()
}

/// Solid parts and the box that they share.
type NearPair = ([u32; 2], [[f64; 3]; 2]);

/// Pairs of solid parts whose boxes share space, and whether the search was cut off.
fn near_pairs(parts: &[Part]) -> (Vec<NearPair>, bool) {
    let part = |index: u32| &parts[index as usize];
    let mut order: Vec<u32> = (0..parts.len() as u32).filter(|index| part(*index).volume > 0.0).collect();
    order.sort_by(|a, b| part(*a).bounds[0][0].total_cmp(&part(*b).bounds[0][0]));

    let (mut pairs, mut left) = (Vec::new(), COMPARED);
    for (place, &a) in order.iter().enumerate() {
        interrupt::point();
        let end = part(a).bounds[1][0];
        for &b in order[place + 1..].iter().take_while(|b| part(**b).bounds[0][0] < end) {
            if left == 0 || pairs.len() == MEASURED {
                return (pairs, true);
            }
            left -= 1;
            let shared = shared_box(part(a).bounds, part(b).bounds);
            pairs.extend(shared.map(|bounds| ([a.min(b), a.max(b)], bounds)));
        }
    }
    (pairs, false)
}
