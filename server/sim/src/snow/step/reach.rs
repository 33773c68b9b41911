//! The box that the particles are in, for colliders that move: which of them may come near, and how fast their points are there.
//!
//! Reads the blocks of the grid, of all ranks; writes coordinates (m). Without a collider that moves nobody is asked.

use crate::{
    collide::Collider,
    math::Real,
    snow::{
        bound::Around,
        grid::{SIDE, block_of},
        model::SnowModel,
        state::SnowWorkspace,
    },
};

/// Cells between the first node of a particle and the particle, at most.
const WIDTH: i32 = 2;

/// Colliders from one time (s) to another, around the particles.
pub(super) fn around<'a, R: Real>(
    model: &SnowModel<R>,
    work: &SnowWorkspace<R>,
    colliders: &'a [Collider],
    times: [f64; 2],
) -> Around<'a> {
    let moves = colliders.iter().any(|collider| collider.moves(times));
    let reach = if moves { reach(work, model.settings.cell) } else { [[0.0; 3]; 2] };
    Around { colliders, times, reach }
}

/// Least and greatest coordinates (m) of the particles' blocks, with sides of `cell` (m) of the grid.
fn reach<R: Real>(work: &SnowWorkspace<R>, cell: f64) -> [[f64; 3]; 2] {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let mut take = |[a, b, c, d, e, f]: [f64; 6]| {
        let (least, greatest) = ([a, b, c], [d, e, f]);
        for axis in 0..3 {
            low[axis] = low[axis].min(least[axis]);
            high[axis] = high[axis].max(greatest[axis]);
        }
    };
    for key in &work.grid.blocks {
        let [x, y, z] = block_of(*key).map(|c| c * SIDE as i32);
        let end = SIDE as i32 + WIDTH;
        take([x, y, z, x + end, y + end, z + end].map(|c| f64::from(c) * cell));
    }
    if let Some(ranks) = work.divided() {
        let ([a, b, c], [d, e, f]) = (low, high);
        ranks.blocks.tell([a, b, c, d, e, f], |others: [f64; 6]| {
            for axis in 0..3 {
                low[axis] = low[axis].min(others[axis]);
                high[axis] = high[axis].max(others[3 + axis]);
            }
        });
    }
    [low, high]
}
