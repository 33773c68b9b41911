//! A sheet between two plates of one figure that close on it, go into each other, aside, and part.

use nappe_sim::{
    cloth::{Network, Repeat},
    math::Precision,
    mesh::TriangleMesh,
    world::WorldSetup,
};

use super::{
    bodies::of_bodies,
    figures::{figure, giving_way, off_frames},
    scenes::{DT, scene},
    tally::{Tally, Watched},
};
use crate::{
    scene::{norm, positions},
    sheets::Sheet,
};

/// Width of the plates (m), thickness of plates and sheet (m), and edges of the sheet (m).
const WIDTH: f64 = 0.3;
const THICK: f64 = 4e-3;
const EDGE: f64 = 0.02;
/// Frames in a second (1/s).
const RATE: f64 = 20.0;
/// When the plates begin to part, and the end (s).
const PART: f64 = 1.1;
const END: f64 = 1.35;
/// How far (m) the plates go aside.
const ASIDE: f64 = 0.1;

/// What a run came to.
#[derive(Clone, Copy, Debug)]
pub struct Pinched {
    /// What its steps told.
    pub tally: Tally,
    /// How far (m) each plate gave way, before they part: the mean of the corners that did by more than half of the most.
    pub yields: [f64; 2],
    /// By how much (m) a particle of the sheet missed the way of the plates at most, then; those of its rim curl, and slip farther.
    pub missed: f64,
    /// How far (m) the corner that is farthest from its frame is off it at the end, as its steps told.
    pub left: f64,
    /// How far (m) the highest particle of the sheet has fallen at the end, from where it was as the plates parted.
    pub fallen: f64,
}

/// Heights (m) of the lower and of the upper plate at a time (s), and how far aside (m) both are.
fn plates_at(time: f64) -> [f64; 3] {
    let share = |from: f64, to: f64| ((time - from) / (to - from)).clamp(0.0, 1.0);
    let (close, aside, away) = (share(0.1, 0.5), share(0.5, 1.0), 0.5 * share(PART, END));
    [-0.006 + 0.021 * close - away, 0.05 - 0.065 * close + away, ASIDE * aside]
}

/// A sheet of so many particles in a row between plates of so many corners in a row.
fn world(particles: usize, corners: usize) -> WorldSetup {
    let plate = TriangleMesh::grid(corners, corners, WIDTH / (corners - 1) as f64);
    let count = plate.points.len() as u32;
    let upper = plate.triangles.iter().map(|corners| corners.map(|corner| count + corner));
    let triangles: Vec<[u32; 3]> = plate.triangles.iter().copied().chain(upper).collect();
    let frame = |number: u32| {
        let [lower, upper, aside] = plates_at(f64::from(number) / RATE);
        let at = |height: f64| {
            let place = move |[x, _, z]: &[f64; 3]| [x - 0.5 * WIDTH + aside, height, z - 0.5 * WIDTH];
            plate.points.iter().map(place)
        };
        at(lower).chain(at(upper)).collect::<Vec<[f64; 3]>>()
    };
    let frames: Vec<Vec<[f64; 3]>> = (0..=(END * RATE).round() as u32).map(frame).collect();
    let plates = figure(&triangles, &frames, RATE, Repeat::Hold);
    let sheet = Sheet::level(particles, EDGE, [0.003, 0.0, 0.005], 0.2).network();
    let empty = scene(Network::default(), 0.0, 0.3);
    giving_way(of_bodies(&empty, vec![("sheet", sheet, THICK), ("plates", plates, THICK)]), 1e6)
}

/// Runs a sheet of so many particles in a row between plates of so many corners in a row.
///
/// # Panics
/// Where a step fails.
pub fn pinched(particles: usize, corners: usize, precision: Precision) -> Pinched {
    let setup = world(particles, corners);
    let sheet = particles * particles;
    let mut watched = Watched::of_world(&setup, precision);
    let before = positions(&watched.simulation);
    watched.go((PART / DT).round() as u64);

    let pressed = positions(&watched.simulation);
    let off: Vec<f64> =
        off_frames(&setup, &pressed, watched.simulation.time()).into_iter().map(norm).collect();
    let (lower, upper) = off.split_at(off.len() / 2);
    let yields = [lower, upper].map(|plate| {
        let most = plate.iter().copied().fold(0.0, f64::max);
        let pressed: Vec<f64> = plate.iter().copied().filter(|off| *off > 0.5 * most).collect();
        pressed.iter().sum::<f64>() / pressed.len() as f64
    });
    let inner = 1..particles - 1;
    let ways = before[..sheet].iter().zip(&pressed).map(|(from, to)| (to[0] - from[0] - ASIDE).abs());
    let is_inner =
        |place: usize| inner.contains(&(place / particles)) && inner.contains(&(place % particles));
    let missed =
        ways.enumerate().filter(|(place, _)| is_inner(*place)).map(|(_, way)| way).fold(0.0, f64::max);

    let mut left = f64::INFINITY;
    for _ in 0..((END - PART) / DT).round() as u64 {
        let report = watched.step().unwrap_or_else(|error| panic!("{error}; so far {:?}", watched.tally));
        left = report.surface.map_or(f64::INFINITY, |surface| surface.yield_m);
    }
    let highest = |x: &[[f64; 3]]| x[..sheet].iter().map(|x| x[1]).fold(f64::MIN, f64::max);
    let fallen = highest(&pressed) - highest(&positions(&watched.simulation));
    Pinched { tally: watched.tally, yields, missed, left, fallen }
}

impl Pinched {
    /// What is wrong with it: crossings, plates that do not give way by 15 to 19 mm, a sheet that does not go along within 8 mm and then falls, or
    /// corners that do not come back to their frames.
    pub fn complaint(&self, precision: Precision) -> Option<String> {
        let Self { tally, yields, missed, left, fallen } = self;
        let rounding = match precision {
            Precision::F64 => 1e-12,
            Precision::F32 => 1e-6,
        };
        let is_kept =
            [tally.crossings, tally.seen] == [0, 0] && tally.told == tally.steps && tally.active > 0;
        let gives_way = yields.iter().all(|yielded| (0.015..=0.019).contains(yielded));
        let is_let_go = *left < rounding && *fallen > 0.2;
        (!(is_kept && gives_way && *missed < 8e-3 && is_let_go)).then(|| format!("{precision}: {self:?}"))
    }
}
