//! How many particles fill a solid and where: a rule for arrangement, and a number of them.

use nappe_sim::interrupt;

use super::{
    hash::{Stream, hash},
    lattice::{self, Jitter, Looks, TooMuch},
    poisson,
    solid::Solid,
};

/// Where particles go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Arrangement {
    /// On a lattice.
    Lattice(Jitter),
    /// At random positions, none too near to another.
    Poisson {
        /// Seed of the positions.
        seed: u32,
    },
}

/// How many there are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Count {
    /// One for each cube of this edge (m).
    Spacing(f64),
    /// Exactly so many.
    Exactly(u64),
}

/// Positions tried for each particle in one turn, at most: more, and most of the space around the solid is empty.
const LOOKS: u64 = 64;
/// Positions that may always be tried.
const FREE_LOOKS: u64 = 200_000;
/// Triangles tested for a solid, at most: a minute or so.
const TESTS: f64 = 1e10;
/// Triangles tested for each particle, at most, and those that may be tested besides.
const TESTS_PER_PARTICLE: f64 = 1e4;
const FREE_TESTS: f64 = 1e8;
/// Share of particles too many that is taken away rather than sought again.
const EXCESS: f64 = 0.03;
/// Particles in a cube whose edge is their distance, in the mean, as they come (measured: 0.67 in
/// large solids, 0.70 in small ones, where more lie at the surface).
const PACKING: f64 = 0.655;

/// Particles (estimated; exact for boxes on a lattice) before any is made.
pub(crate) fn estimate(solid: &Solid, arrangement: Arrangement, count: Count) -> u64 {
    match (solid, arrangement, count) {
        (_, _, Count::Exactly(count)) => count,
        (Solid::Box { half, .. }, Arrangement::Lattice(_), Count::Spacing(spacing)) => {
            let cells = lattice::divided(half.map(|h| 2.0 * h), spacing);
            cells.iter().fold(1, |product: u64, n| product.saturating_mul(*n))
        }
        (_, _, Count::Spacing(spacing)) => {
            (solid.volume() / (spacing * spacing * spacing)).round().max(1.0) as u64
        }
    }
}

/// Fills a solid; particles as they stand in the world (m).
///
/// `expected` is the estimate, which the caller has checked against its limits.
pub(crate) fn fill(
    solid: &Solid,
    arrangement: Arrangement,
    count: Count,
    expected: u64,
) -> Result<Vec<[f64; 3]>, TooMuch> {
    let mut looks = Looks::new(LOOKS.saturating_mul(expected).saturating_add(FREE_LOOKS));
    let particles = expected as f64;
    if solid.cost() * particles > TESTS.min(TESTS_PER_PARTICLE * particles + FREE_TESTS) {
        return Err(TooMuch);
    }
    let points = match (arrangement, count, solid) {
        (Arrangement::Lattice(jitter), Count::Spacing(spacing), Solid::Box { half, .. }) => {
            lattice::in_box(*half, lattice::divided(half.map(|h| 2.0 * h), spacing), jitter)
        }
        (Arrangement::Lattice(jitter), Count::Exactly(count), Solid::Box { half, .. }) => {
            let cells = lattice::divided_for(half.map(|h| 2.0 * h), count);
            thin(lattice::in_box(*half, cells, jitter), count, jitter.seed)
        }
        (Arrangement::Lattice(jitter), Count::Spacing(spacing), _) => {
            lattice::in_solid(solid, spacing, jitter, &mut looks)?
        }
        (Arrangement::Lattice(jitter), Count::Exactly(count), _) => {
            let first = libm::cbrt(solid.volume() / count as f64);
            let points =
                search(first, count, |spacing| lattice::in_solid(solid, spacing, jitter, &mut looks))?;
            thin(points, count, jitter.seed)
        }
        (Arrangement::Poisson { seed }, _, _) => {
            let first = libm::cbrt(PACKING * solid.volume() / expected as f64);
            let points = search(first, expected, |radius| poisson::sample(solid, radius, seed, &mut looks))?;
            thin(points, expected, seed)
        }
    };

    Ok(points.into_iter().map(|point| solid.to_world(point)).collect())
}

/// Makes particles at a distance such that there are `count` or a few more.
fn search(
    first: f64,
    count: u64,
    mut make: impl FnMut(f64) -> Result<Vec<[f64; 3]>, TooMuch>,
) -> Result<Vec<[f64; 3]>, TooMuch> {
    let wanted = count as f64;
    let most = wanted * (1.0 + EXCESS) + 2.0;
    let mut distance = first;
    let mut best: Option<Vec<[f64; 3]>> = None;
    // A count follows the distance's cube nearly: two or three turns do. Small solids have counts
    // that jump, and take the fewest too many.
    for turn in 0..40 {
        let points = make(distance)?;
        let found = points.len() as f64;
        if found >= wanted && best.as_ref().is_none_or(|b| points.len() < b.len()) {
            best = Some(points);
        }
        if best.as_ref().is_some_and(|b| b.len() as f64 <= most || turn >= 8) {
            break;
        }
        // Aims a third into the excess that is taken away.
        let ratio = libm::cbrt(found.max(1.0) / (wanted * (1.0 + EXCESS / 3.0) + 0.5));
        distance *= if turn < 8 { ratio.clamp(0.5, 2.0) } else { 0.9 };
    }

    best.ok_or(TooMuch)
}

/// Takes particles away at random until `count` are left; the others keep their order.
fn thin(points: Vec<[f64; 3]>, count: u64, seed: u32) -> Vec<[f64; 3]> {
    let excess = points.len().saturating_sub(count as usize);
    if excess == 0 {
        return points;
    }
    let key = |i: usize| {
        interrupt::point();
        (hash(seed, Stream::Thin, [i as i64, 0, 0]), i)
    };
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_unstable_by_key(|i| key(*i));
    let mut kept = vec![true; points.len()];
    for i in &order[..excess] {
        kept[*i] = false;
    }
    points.into_iter().zip(kept).filter_map(|(point, kept)| kept.then_some(point)).collect()
}
