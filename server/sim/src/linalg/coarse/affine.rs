//! Affine functions on clouds of points: 1, u and v, uncorrelated and of variance 1, where u and v go along two of the
//! axes x, y and z; and how functions of one cloud look on a part of it.

use crate::math::{Mat3, Vec3};

/// How many points a cloud has, where, and how they are spread.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    count: f64,
    mean: Vec3<f64>,
    /// Sum of (x - mean)(x - mean)ᵀ.
    scatter: Mat3<f64>,
}

/// u and v of a cloud: (x - mean) times a direction each; 0 where it does not extend.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes {
    mean: Vec3<f64>,
    directions: [Vec3<f64>; 2],
}

/// A function of three is one of the part's three: `[m][q]` is how much of the part's function m the whole's q has.
pub(super) type Interpolation = [[f64; 3]; 3];

/// A second axis is none where it adds less than this to the variance of the first.
const FLAT: f64 = 1e-9;

impl Moments {
    /// Those of points.
    pub(super) fn of(points: impl Iterator<Item = Vec3<f64>> + Clone) -> Self {
        let (mut count, mut mean, mut scatter) = (0.0, Vec3::zeros(), Mat3::zeros());
        for x in points.clone() {
            count += 1.0;
            mean += x;
        }
        if count > 0.0 {
            mean /= count;
        }
        for x in points {
            scatter += (x - mean) * (x - mean).transpose();
        }
        Self { count, mean, scatter }
    }

    /// Those of two clouds together.
    pub(super) fn and(self, other: Self) -> Self {
        let count = self.count + other.count;
        if count == 0.0 {
            return self;
        }
        let apart = other.mean - self.mean;
        let share = other.count / count;
        let scatter = self.scatter + other.scatter + apart * apart.transpose() * (self.count * share);
        Self { count, mean: self.mean + apart * share, scatter }
    }

    /// Whether there are no points.
    pub(super) fn is_empty(&self) -> bool {
        self.count == 0.0
    }

    fn covariance(&self) -> Mat3<f64> {
        if self.count > 0.0 { self.scatter / self.count } else { Mat3::zeros() }
    }

    /// The two axes in whose plane the cloud is widest.
    pub(super) fn axes(&self) -> Axes {
        let spread = self.covariance();
        let area = |[a, b]: [usize; 2]| spread[(a, a)] * spread[(b, b)] - spread[(a, b)] * spread[(a, b)];
        let mut widest = [0, 1];
        for pair in [[0, 2], [1, 2]] {
            if area(pair) > area(widest) {
                widest = pair;
            }
        }
        let longest = |a: usize, b: usize| if spread[(b, b)] > spread[(a, a)] { [b, a] } else { [a, b] };
        // On a line no two axes make an area: the first is the one that goes along it most.
        let is_line = area(widest) <= FLAT * spread.trace() * spread.trace();
        let [a, b] = if is_line { longest(longest(0, 1)[0], 2) } else { longest(widest[0], widest[1]) };

        let mut directions = [Vec3::zeros(); 2];
        let along = spread[(a, a)];
        if along > 0.0 {
            directions[0][a] = 1.0 / along.sqrt();
            let slope = spread[(a, b)] / along;
            let across = spread[(b, b)] - slope * spread[(a, b)];
            if across > FLAT * along {
                directions[1][b] = 1.0 / across.sqrt();
                directions[1][a] = -slope / across.sqrt();
            }
        }
        Axes { mean: self.mean, directions }
    }

    /// The functions of a cloud on a part with these moments, by least squares.
    pub(super) fn interpolation(&self, own: &Axes, whole: &Axes) -> Interpolation {
        let spread = self.covariance();
        let mut weights = [[0.0; 3]; 3];
        if self.count > 0.0 {
            weights[0][0] = 1.0;
        }
        for (q, direction) in (1..).zip(&whole.directions) {
            weights[0][q] = if self.count > 0.0 { direction.dot(&(own.mean - whole.mean)) } else { 0.0 };
            for (m, along) in (1..).zip(&own.directions) {
                weights[m][q] = direction.dot(&(spread * along));
            }
        }
        weights
    }
}

impl Axes {
    /// 1, u and v at a point.
    pub(super) fn at(&self, x: Vec3<f64>) -> [f64; 3] {
        let [u, v] = self.directions.map(|direction| direction.dot(&(x - self.mean)));
        [1.0, u, v]
    }
}

#[cfg(test)]
mod tests {
    use super::Moments;
    use crate::math::Vec3;

    fn cloud(seed: u64, count: usize, shape: fn(f64, f64) -> Vec3<f64>) -> Vec<Vec3<f64>> {
        let mut state = seed;
        let mut next = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1_u32 << 31)
        };
        (0..count).map(|_| shape(next(), next())).collect()
    }

    const SHAPES: [fn(f64, f64) -> Vec3<f64>; 5] = [
        |u, v| Vec3::new(u, 0.3, v),
        |u, v| Vec3::new(u + v, u - 2.0 * v, 0.1 * u + 5.0),
        |u, v| Vec3::new(0.0, u, (u - 0.5) * v),
        |u, _| Vec3::new(1.0, 2.0 - u, 3.0 * u),
        |_, _| Vec3::new(1.0, 2.0, 3.0),
    ];

    #[test]
    fn the_three_functions_are_uncorrelated_and_of_one_size() {
        for (shape, extent) in SHAPES.into_iter().zip([2, 2, 2, 1, 0]) {
            let points = cloud(7, 200, shape);
            let axes = Moments::of(points.iter().copied()).axes();
            for m in 0..3 {
                for q in 0..3 {
                    let mean = points.iter().map(|x| axes.at(*x)[m] * axes.at(*x)[q]).sum::<f64>() / 200.0;
                    let expected = if m == q && m <= extent { 1.0 } else { 0.0 };
                    assert!((mean - expected).abs() < 1e-9, "{m} {q}: {mean}");
                }
            }
        }
    }

    #[test]
    fn a_part_of_a_plane_shows_the_functions_of_the_whole_as_they_are() {
        for shape in &SHAPES[..2] {
            let parts = [
                cloud(1, 90, *shape),
                cloud(2, 30, |u, v| Vec3::new(u, v, 0.0))
                    .iter()
                    .map(|p| shape(p.x * 0.1, 3.0 + p.y))
                    .collect(),
            ];
            let moments = parts.each_ref().map(|points| Moments::of(points.iter().copied()));
            let whole = moments[0].and(moments[1]);
            let together = Moments::of(parts.iter().flatten().copied());
            assert!((whole.mean - together.mean).norm() < 1e-12);
            assert!((whole.scatter - together.scatter).norm() < 1e-9);

            let axes = whole.axes();
            for (points, moments) in parts.iter().zip(&moments) {
                let own = moments.axes();
                let weights = moments.interpolation(&own, &axes);
                for x in points {
                    let (functions, expected) = (own.at(*x), axes.at(*x));
                    for q in 0..3 {
                        let found: f64 = (0..3).map(|m| functions[m] * weights[m][q]).sum();
                        assert!((found - expected[q]).abs() < 1e-9, "{found} {}", expected[q]);
                    }
                }
            }
        }
    }
}
