//! The fastest mode of the springs of a cloth at rest, by the method of Lanczos without a stored matrix.

use nappe_sim::cloth::Network;

/// Iterations at most.
const MOST: usize = 4000;
/// After so many the largest eigenvalue is looked at again.
const STRIDE: usize = 50;
/// It is found when so many iterations more raise it by no more than this share.
const RISE: f64 = 1e-10;
const SEED: u64 = 7;

/// The largest frequency (rad/s) of the springs of a cloth that are all at rest as it lies; 0 where nothing moves. Elements are
/// left out. Relative error 1e-6 or less.
pub fn largest_frequency(network: &Network) -> f64 {
    let springs = Springs::of(network);
    let mut rng = fastrand::Rng::with_seed(SEED);
    let mut now: Vec<f64> =
        springs.weights.iter().map(|w| if *w > 0.0 { rng.f64() - 0.5 } else { 0.0 }).collect();
    let length = norm(&now);
    if length == 0.0 {
        return 0.0;
    }
    for c in &mut now {
        *c /= length;
    }

    let mut before = vec![0.0; now.len()];
    let mut next = vec![0.0; now.len()];
    // The matrix of three diagonals: its middle one, and the squares of those beside it.
    let [mut middle, mut beside] = [Vec::new(), Vec::new()];
    let [mut last, mut largest] = [0.0; 2];
    while middle.len() < MOST {
        springs.apply(&now, &mut next);
        let alpha = dot(&now, &next);
        for (next, (now, before)) in next.iter_mut().zip(now.iter().zip(&before)) {
            *next -= alpha * now + last * before;
        }
        middle.push(alpha);
        let beta = norm(&next);
        let is_whole = beta <= 1e-14 * middle.iter().fold(0.0_f64, |most, a| most.max(a.abs()));
        if is_whole || middle.len() % STRIDE == 0 {
            let found = largest_eigenvalue(&middle, &beside);
            if is_whole || found <= largest * (1.0 + RISE) {
                return found.max(largest).max(0.0).sqrt();
            }
            largest = found;
        }
        beside.push(beta * beta);
        last = beta;
        std::mem::swap(&mut before, &mut now);
        for (now, next) in now.iter_mut().zip(&next) {
            *now = next / beta;
        }
    }
    largest.max(0.0).sqrt()
}

/// Springs as they act on what each particle moves by times the root of its mass.
struct Springs {
    /// Ends, direction, stiffness (N/m).
    springs: Vec<([usize; 2], [f64; 3], f64)>,
    /// 1 / root of the mass of each component; 0 where it does not move.
    weights: Vec<f64>,
}

impl Springs {
    fn of(network: &Network) -> Self {
        let mut weights: Vec<f64> =
            network.masses.iter().flat_map(|m| [if *m > 0.0 { 1.0 / m.sqrt() } else { 0.0 }; 3]).collect();
        for pin in &network.pins {
            weights[3 * *pin as usize..][..3].fill(0.0);
        }
        let springs = network.springs.iter().filter_map(|spring| {
            let [a, b] = spring.particles.map(|i| i as usize);
            let way: [f64; 3] = std::array::from_fn(|c| network.x[b][c] - network.x[a][c]);
            let length = norm(&way);
            // Ends in one place have no direction, and no force.
            (length > 0.0).then(|| ([a, b], way.map(|c| c / length), spring.law.stiffness))
        });
        Self { springs: springs.collect(), weights }
    }

    fn apply(&self, v: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for ([a, b], way, stiffness) in &self.springs {
            let at = |i: usize, c: usize| v[3 * i + c] * self.weights[3 * i + c];
            let pull = stiffness * (0..3).map(|c| way[c] * (at(*b, c) - at(*a, c))).sum::<f64>();
            for (c, way) in way.iter().enumerate() {
                out[3 * a + c] -= pull * way * self.weights[3 * a + c];
                out[3 * b + c] += pull * way * self.weights[3 * b + c];
            }
        }
    }
}

/// The largest eigenvalue of a matrix of three diagonals, by counting those above a number (Sturm).
fn largest_eigenvalue(middle: &[f64], beside_squared: &[f64]) -> f64 {
    let beside = |i: usize| beside_squared.get(i).copied().unwrap_or(0.0);
    let reach = |i: usize| {
        let before = if i > 0 { beside(i - 1).sqrt() } else { 0.0 };
        middle[i].abs() + before + if i + 1 < middle.len() { beside(i).sqrt() } else { 0.0 }
    };
    let most = (0..middle.len()).map(reach).fold(0.0, f64::max);
    let is_above_all = |x: f64| {
        let mut pivot = 1.0;
        middle.iter().enumerate().all(|(i, a)| {
            let before = if i > 0 { beside(i - 1) / pivot } else { 0.0 };
            pivot = x - a - before;
            pivot > 0.0
        })
    };
    let [mut below, mut above] = [-most, most];
    for _ in 0..80 {
        let x = f64::midpoint(below, above);
        *(if is_above_all(x) { &mut above } else { &mut below }) = x;
    }
    above
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}
