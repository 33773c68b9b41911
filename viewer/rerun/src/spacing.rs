//! The distance of particles that fill a volume, from their positions alone.
//!
//! Enters: positions (m). Leaves: the side of the cube that each has to itself (m).

/// Particles that are asked for their neighbours.
const SAMPLES: usize = 32;
/// Neighbours that each looks for: they and itself fill the ball that reaches the farthest of them.
const NEIGHBOURS: usize = 8;

/// Side of the cube (m) that a particle has to itself: a ball of radius r around a particle that holds n others
/// gives each 4/3 pi r^3 / n. The median over some particles; `None` for too few, or if they lie on each other.
pub(crate) fn spacing(points: &[[f32; 3]]) -> Option<f32> {
    if points.len() <= NEIGHBOURS {
        return None;
    }
    let step = points.len().div_ceil(SAMPLES);

    let mut squares = vec![0.0_f32; points.len()];
    let mut sides: Vec<f32> = points
        .iter()
        .step_by(step)
        .map(|center| {
            for (square, point) in squares.iter_mut().zip(points) {
                *square = (0..3).map(|axis| (point[axis] - center[axis]).powi(2)).sum();
            }
            // The particle itself comes first, at distance 0.
            let (_, &mut square, _) = squares.select_nth_unstable_by(NEIGHBOURS, f32::total_cmp);
            let volume = 4.0 / 3.0 * std::f32::consts::PI * square.sqrt().powi(3) / NEIGHBOURS as f32;
            volume.cbrt()
        })
        .collect();

    let middle = sides.len() / 2;
    let (_, &mut side, _) = sides.select_nth_unstable_by(middle, f32::total_cmp);
    (side.is_finite() && side > 0.0).then_some(side)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lattice of `n` particles along each axis.
    fn lattice(n: usize, side: f32) -> Vec<[f32; 3]> {
        (0..n * n * n).map(|p| [p % n, p / n % n, p / n / n].map(|index| index as f32 * side)).collect()
    }

    #[test]
    fn a_lattice_has_the_spacing_of_its_particles() {
        for (n, side) in [(6, 0.5), (12, 0.004)] {
            let found = spacing(&lattice(n, side)).expect("enough of them");
            // The eighth neighbour of a point of a lattice lies at sqrt(2), which makes 1.14; less full at a face.
            assert!((1.0..1.5).contains(&(found / side)), "{found} for {side}");
        }
    }

    #[test]
    fn few_particles_or_particles_in_one_place_have_none() {
        assert_eq!(spacing(&lattice(2, 1.0)), None);
        assert_eq!(spacing(&[[1.0; 3]; 100]), None);
        assert_eq!(spacing(&[]), None);
    }
}
