//! What tears by numerics alone: particles that are stretched farther than the cells of the grid can bear.
//!
//! The grid knows nothing of neighbours. Particles hold together as long as there is one of them for each cell along a line, more
//! or less; where a body is stretched beyond that, a gap opens that no force closes, by no law of its material. Measured
//! (docs/laws/snow.md), bodies of s = V0^(1/3) at rest per particle hold up to a stretch of about (4 h / s)^(1/3).
//!
//! Reads F_E, volumes at rest and the sides of cells; counts particles beyond that stretch.

use crate::{
    math::{Pack, Portable, Real, array::dot, svd},
    snow::{model::SnowModel, particles::Particles, state::SnowWorkspace},
};

/// Squares of stretches up to this one are never too great.
const BORNE: f64 = 1.21;

/// Particles that are stretched too far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Torn {
    /// All of them.
    pub(crate) all: u64,
    /// Those of objects that have no law by which they could break.
    pub(crate) elastic: u64,
    /// The first of these, in the user's numbering of the snow.
    pub(crate) first: Option<u64>,
}

/// Counts particles that are stretched too far, at the state as it is.
pub(crate) fn torn<R: Real>(model: &SnowModel<R>, particles: &Particles<R>, work: &SnowWorkspace<R>) -> Torn {
    if work.extremes.stretch2 <= BORNE {
        return Torn::default();
    }
    let mut own = Torn::default();
    for place in work.sorter.order.iter().map(|place| *place as usize) {
        if is_torn(model.settings.cell, particles, place) {
            own.all += 1;
            if model.materials[usize::from(particles.object[place])].is_elastic() {
                own.elastic += 1;
                own.first = own.first.into_iter().chain([u64::from(particles.id[place])]).min();
            }
        }
    }

    let Some(ranks) = work.divided() else { return own };
    let mut sum = Torn::default();
    let told = [own.all as f64, own.elastic as f64, own.first.map_or(f64::INFINITY, |id| id as f64)];
    ranks.blocks.tell(told, |[all, elastic, first]: [f64; 3]| {
        let first = first.is_finite().then_some(first as u64);
        sum = Torn {
            all: sum.all + all as u64,
            elastic: sum.elastic + elastic as u64,
            first: sum.first.into_iter().chain(first).min(),
        };
    });
    sum
}

/// Whether a particle is stretched farther than cells of this side (m) can bear.
fn is_torn<R: Real>(cell: f64, particles: &Particles<R>, place: usize) -> bool {
    let volume = particles.volume(place).to_f64();
    let f = particles.f_e(place);
    // Most particles need no singular values.
    is_too_far(bound(&f), volume, cell) && is_too_far(greatest(&f), volume, cell)
}

/// Whether the cube of a stretch times V0^(1/3) is more than four cells, from the square of the stretch.
fn is_too_far(stretch2: f64, volume: f64, cell: f64) -> bool {
    let sixth = stretch2 * stretch2 * stretch2;
    let cells = 64.0 * cell * cell * cell;
    stretch2 > BORNE && sixth * sixth * sixth * volume * volume > cells * cells
}

/// At least the square of the greatest singular value: the greatest sum of a row of F^T F, without signs.
fn bound<R: Real>(rows: &[[R; 3]; 3]) -> f64 {
    let column = |k: usize| [0, 1, 2].map(|row| rows[row][k].to_f64());
    let columns = [0, 1, 2].map(column);
    let sum = |a: [f64; 3]| columns.iter().map(|b| dot(a, *b).abs()).sum::<f64>();
    columns.iter().map(|a| sum(*a)).fold(0.0, f64::max)
}

/// The square of the greatest singular value.
fn greatest<R: Real>(rows: &[[R; 3]; 3]) -> f64 {
    let columns = [0, 1, 2].map(|k| [0, 1, 2].map(|row| Portable::splat(rows[row][k])));
    let sigma = svd(&columns).sigma.map(|sigma| sigma.store()[0].to_f64());
    sigma.iter().map(|sigma| sigma * sigma).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_particles_along_a_cell_bear_a_stretch_of_two() {
        let (cell, volume) = (0.1, 0.05 * 0.05 * 0.05);
        for (stretch, is_beyond) in [(1.99_f64, false), (2.01, true)] {
            assert_eq!(is_too_far(stretch * stretch, volume, cell), is_beyond, "{stretch}");
        }
        // Of one along a cell 1.587, the cube root of 4; of three 2.289, that of 12.
        for (count, stretch) in [(1.0, 1.587), (3.0, 2.289)] {
            let side: f64 = cell / count;
            let is_beyond = |stretch: f64| is_too_far(stretch * stretch, side * side * side, cell);
            assert!(!is_beyond(stretch) && is_beyond(stretch + 1e-3), "{count} along a cell");
        }
        // However large its particles are, nothing tears that is hardly stretched.
        assert!(!is_too_far(1.2, 1e9, cell));
    }

    #[test]
    fn a_turn_does_not_count_as_a_stretch() {
        let rows: [[f64; 3]; 3] =
            [[0.6 * 1.9, -0.8 * 0.8, 0.0], [0.8 * 1.9, 0.6 * 0.8, 0.0], [0.0, 0.0, 1.1]];
        assert!((greatest(&rows) - 1.9 * 1.9).abs() < 1e-12 && (bound(&rows) - 1.9 * 1.9).abs() < 1e-12);
        // Of a shear the bound is too much, and never too little.
        let shear: [[f64; 3]; 3] = [[1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let exact = f64::midpoint(3.0, 5.0_f64.sqrt());
        assert!((greatest(&shear) - exact).abs() < 1e-12 && bound(&shear) >= exact);
    }
}
