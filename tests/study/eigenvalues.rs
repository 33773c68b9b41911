//! Limits of explicit steps at rest against eigenvalues of a step, of cloths in which dampings differ: its matrix is put
//! together here from springs, masses and drag, and what it multiplies motions by is seen in its powers.

use nalgebra::DMatrix;
use nappe_sim::{
    cloth::{Hessian, Integrator, Network},
    math::array::{length, minus},
};
use nappe_study::{Budget, Case, Method, Over, StabilityRequest, Verdict, probe_at_rest, stability};
use nappe_tests::networks::{particles, scatter, sheet, sheet_rules, spring};
use rayon::prelude::*;

use crate::support::case;

const EXPLICIT: [Integrator; 4] = [
    Integrator::ExplicitEuler,
    Integrator::SymplecticEuler,
    Integrator::VelocityVerlet,
    Integrator::VelocityVerletPredicted,
];

/// Numbers that look random, the same for a cloth of a number.
struct Draw(usize);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 += 1;
        low + (high - low) * 0.5 * (1.0 + scatter(self.0))
    }
}

/// Places and pairs of a sheet with both diagonals of its cells: flat, or rough.
fn uneven_sheet(number: usize, draw: &mut Draw) -> (Vec<[f64; 3]>, Vec<[usize; 2]>) {
    let (columns, rows) = (3 + number / 4 % 2, 2 + number / 8);
    let rough = if number.is_multiple_of(4) { 0.0 } else { 0.02 };
    let (mut x, mut pairs) = (Vec::new(), Vec::new());
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let [dx, dz, dy] = [0.015, 0.015, 1.0].map(|most| draw.between(-most, most));
        x.push([0.1 * column as f64 + dx, rough * dy, 0.1 * row as f64 + dz]);
        let at = row * columns + column;
        let (has_next, has_below) = (column + 1 < columns, row + 1 < rows);
        let others = [
            (has_next, at + 1),
            (has_below, at + columns),
            (has_next && has_below, at + columns + 1),
            (column > 0 && has_below, at + columns - 1),
        ];
        pairs.extend(others.into_iter().filter(|(is_there, _)| *is_there).map(|(_, other)| [at, other]));
    }
    (x, pairs)
}

/// Places and pairs of a chain in zigzag, each particle joined to the next two.
fn zigzag(number: usize, draw: &mut Draw) -> (Vec<[f64; 3]>, Vec<[usize; 2]>) {
    let count = 6 + number / 2;
    let x = (0..count).map(|i| [0.08 * i as f64, 0.03 * (i % 2) as f64, draw.between(-0.02, 0.02)]).collect();
    let pairs = (0..count).flat_map(|i| [[i, i + 1], [i, i + 2]]).filter(|[_, other]| *other < count);
    (x, pairs.collect())
}

/// A cloth of a number: a sheet or a chain whose springs, masses and damping times all differ, some with drag or a pin.
fn cloth(number: usize) -> Network {
    let mut draw = Draw(1000 * number);
    let (x, pairs) =
        if number.is_multiple_of(2) { uneven_sheet(number, &mut draw) } else { zigzag(number, &mut draw) };
    let mut network = particles(&x, 1.0);
    let damped = [0.4, 0.1, 0.03][number / 2 % 3];
    for [a, b] in pairs {
        let [stiffness, time] = [draw.between(50.0, 500.0), damped * draw.between(2e-3, 1e-2)];
        let rest_length = length(minus(x[b], x[a]));
        network.springs.push(spring([a as u32, b as u32], rest_length, stiffness, stiffness * time));
    }
    network.masses.fill_with(|| draw.between(0.005, 0.015));
    network.drag = [0.0, 0.005, 0.02][number % 3];
    network.pins = if number % 4 < 2 { vec![0] } else { Vec::new() };
    network
}

/// Stiffness (1/s²) and damping (1/s) over mass of the free particles: K = sum of k d dᵀ, C = sum of nu d dᵀ, and drag.
fn matrices(network: &Network) -> [DMatrix<f64>; 2] {
    let size = 3 * network.x.len();
    let [mut stiffness, mut damping] = [0, 1].map(|_| DMatrix::<f64>::zeros(size, size));
    for spring in &network.springs {
        let [a, b] = spring.particles.map(|i| i as usize);
        let way = minus(network.x[b], network.x[a]);
        let way = way.map(|c| c / length(way));
        for (p, q, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
            for (c, d) in (0..9).map(|i| (i / 3, i % 3)) {
                let share = sign * way[c] * way[d] / network.masses[p];
                stiffness[(3 * p + c, 3 * q + d)] += spring.law.stiffness * share;
                damping[(3 * p + c, 3 * q + d)] += spring.law.damping * share;
            }
        }
    }
    for (i, mass) in network.masses.iter().enumerate() {
        (3 * i..3 * i + 3).for_each(|c| damping[(c, c)] += network.drag / mass);
    }
    let free: Vec<usize> = (0..size).filter(|c| !network.pins.contains(&(*c as u32 / 3))).collect();
    [stiffness, damping].map(|m| DMatrix::from_fn(free.len(), free.len(), |i, j| m[(free[i], free[j])]))
}

/// What a step of h (s) makes of positions and velocities.
fn step_matrix(integrator: Integrator, [k, c]: &[DMatrix<f64>; 2], h: f64) -> DMatrix<f64> {
    let count = k.nrows();
    let one =
        |from: usize| DMatrix::from_fn(count, 2 * count, move |i, j| if j == from + i { 1.0 } else { 0.0 });
    let (x, v) = (one(0), one(count));
    let force = |x: &DMatrix<f64>, v: &DMatrix<f64>| -(k * x + c * v);
    let a = force(&x, &v);
    let half = &v + &a * (0.5 * h);
    let (x, v) = match integrator {
        Integrator::ExplicitEuler => (x + &v * h, v + a * h),
        Integrator::SymplecticEuler => {
            let v = v + a * h;
            (x + &v * h, v)
        }
        Integrator::VelocityVerlet => {
            let x = x + &half * h;
            let a = force(&x, &half);
            (x, half + a * (0.5 * h))
        }
        Integrator::VelocityVerletPredicted => {
            let x = x + &half * h;
            let predicted = &half + a * (0.5 * h);
            let a = force(&x, &predicted);
            (x, half + a * (0.5 * h))
        }
        Integrator::ImplicitEuler | Integrator::ImplicitMidpoint | Integrator::Bdf2 => {
            panic!("an explicit method")
        }
    };
    DMatrix::from_fn(2 * count, 2 * count, |i, j| if i < count { x[(i, j)] } else { v[(i - count, j)] })
}

/// Logarithm of what steps multiply a motion by, per step, from the norm of so high a power: 2 to the number of doublings.
fn growth(mut power: DMatrix<f64>, doublings: u32) -> f64 {
    let (mut next, mut log) = (power.clone(), 0.0_f64);
    for doubling in 1..=doublings {
        power.mul_to(&power, &mut next);
        std::mem::swap(&mut power, &mut next);
        log *= 2.0;
        // Between, no number leaves its range.
        if doubling % 4 == 0 || doubling == doublings {
            let largest = power.as_slice().iter().fold(0.0_f64, |most, c| most.max(c.abs()));
            log += largest.ln();
            power.scale_mut(1.0 / largest);
            if log.abs() > 40.0 {
                return log / f64::from(doubling).exp2();
            }
        }
    }
    log / f64::from(doublings).exp2()
}

/// Whether no motion grows in steps of h (s). A mode of explicit Euler may grow by a millionth per step half a percent beyond
/// its limit; drift alone comes to less than 2e-8 in so many steps.
fn is_bounded(integrator: Integrator, matrices: &[DMatrix<f64>; 2], h: f64) -> bool {
    let (doublings, most) = if integrator == Integrator::ExplicitEuler { (30, 1e-7) } else { (16, 1e-3) };
    growth(step_matrix(integrator, matrices, h), doublings) <= most
}

/// The longest step (s) in which no motion grows, to 0.03 %.
fn limit(integrator: Integrator, matrices: &[DMatrix<f64>; 2]) -> f64 {
    let [mut below, mut above] = [1e-5_f64, 0.1];
    for _ in 0..15 {
        let middle = (below * above).sqrt();
        *(if is_bounded(integrator, matrices, middle) { &mut below } else { &mut above }) = middle;
    }
    below
}

fn verdict(case: &Case, integrator: Integrator, dt: f64) -> Verdict {
    let method = Method::new(integrator, Hessian::Absolute);
    probe_at_rest(case, method, dt, &Budget::new(None)).verdict
}

#[test]
fn sixteen_cloths_whose_dampings_differ_bear_at_rest_what_eigenvalues_say_to_half_a_percent() {
    let all: Vec<_> = (0..16).flat_map(|number| EXPLICIT.map(|integrator| (number, integrator))).collect();
    all.into_par_iter().for_each(|(number, integrator)| {
        let network = cloth(number);
        let limit = limit(integrator, &matrices(&network));
        let case = case(network, [0.0; 3], 1e-3);
        for (share, expected) in [(0.995, Verdict::Stable), (1.005, Verdict::Grows)] {
            let found = verdict(&case, integrator, share * limit);
            assert_eq!(found, expected, "cloth {number}, {integrator:?}: {share} of {limit:e} s");
        }
    });
}

#[test]
fn a_study_finds_the_limit_of_explicit_euler_where_dampings_differ() {
    let network = cloth(2);
    let expected = limit(Integrator::ExplicitEuler, &matrices(&network));
    let request = StabilityRequest {
        tolerance: 1e-3,
        end: 0.02,
        methods: vec!["explicit_euler".to_owned()],
        maps: Vec::new(),
        cells: 4,
        effort: None,
    };
    let found = stability(&case(network, [0.0; 3], 1e-3), &request, &Budget::new(None), &|_| {});
    let found = found.limits(Over::Rest).next().and_then(|row| row.limit).expect("a limit");
    assert!((found / expected - 1.0).abs() < 0.005, "{found:e} s, by eigenvalues {expected:e} s");
}

#[test]
fn a_cloth_without_damping_grows_at_any_step_however_large_it_is_and_a_damped_one_says_what_is_not_known() {
    let probe = |damping: f64| {
        let mut network = sheet(13, 0.1, &sheet_rules(100.0, damping), 0.01);
        // A spring without stiffness has no damping over stiffness.
        network.springs[0].law.stiffness = 0.0;
        let method = Method::new(Integrator::ExplicitEuler, Hessian::Absolute);
        probe_at_rest(&case(network, [0.0; 3], 1e-3), method, 1e-5, &Budget::new(None))
    };
    assert_eq!(probe(0.0).verdict, Verdict::Grows);
    let row = probe(0.01);
    assert_eq!(row.verdict, Verdict::NotKnown);
    assert!(row.cause.expect("why").contains("too large for eigenvalues"));
}
