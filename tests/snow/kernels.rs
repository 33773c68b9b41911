//! Weights along an axis: golden values, what they add up to, and their slopes.

use nappe_sim::snow::{Kernel, weights};
use nappe_tests::{Random, golden};
use serde::Deserialize;
use std::collections::BTreeMap;

use crate::reference;

#[derive(Deserialize)]
struct Axis {
    x_over_dx: f64,
    first_node: i32,
    w: Vec<f64>,
    dw_times_dx: Vec<f64>,
    second_moment_over_dx2: f64,
    fraction_of_cell: String,
}

#[derive(Deserialize)]
struct Place {
    kernel: String,
    x: [f64; 3],
    dx: f64,
    first_node: [i32; 3],
    w: Vec<f64>,
    grad_w_per_m: Vec<[f64; 3]>,
}

#[derive(Deserialize)]
struct Golden {
    one_dimensional: BTreeMap<String, Vec<Axis>>,
    three_dimensional: Vec<Place>,
}

fn kernel(name: &str) -> Kernel {
    Kernel::ALL.into_iter().find(|kernel| kernel.name() == name).expect("a kernel of this name")
}

/// Weight and slope of a node; none beyond the kernel.
fn at(kernel: Kernel, x_over_h: f64, node: i32) -> [f64; 2] {
    let (first, w, d) = weights(kernel, x_over_h);
    usize::try_from(node - first).map_or([0.0; 2], |i| if i < 4 { [w[i], d[i]] } else { [0.0; 2] })
}

#[test]
fn golden_weights_of_an_axis() {
    let golden: Golden = golden::document("mpm/kernels.json");
    for kernel in Kernel::ALL {
        let rows = &golden.one_dimensional[kernel.name()];
        assert_eq!(rows.len(), 10);
        for row in rows {
            let mut moment = 0.0;
            for (i, (w, d)) in row.w.iter().zip(&row.dw_times_dx).enumerate() {
                let node = row.first_node + i as i32;
                let [own_w, own_d] = at(kernel, row.x_over_dx, node);
                moment += own_w * (f64::from(node) - row.x_over_dx).powi(2);
                let what = format!("{} at {}, node {node}", kernel.name(), row.x_over_dx);
                assert!((own_w - w).abs() < 1e-14, "{what}: weight {own_w}, not {w}");

                // On a node the slope of the linear kernel is one of two; the table takes neither.
                if kernel != Kernel::Linear || row.fraction_of_cell != "0" {
                    assert!((own_d - d).abs() < 1e-14, "{what}: slope {own_d}, not {d}");
                }
            }

            assert!((moment - row.second_moment_over_dx2).abs() < 1e-14, "{}: {moment}", kernel.name());
        }
    }
}

#[test]
fn golden_weights_in_space() {
    let golden: Golden = golden::document("mpm/kernels.json");
    assert_eq!(golden.three_dimensional.len(), 6);
    for place in &golden.three_dimensional {
        let kernel = kernel(&place.kernel);
        let n = kernel.width();
        for (i, (w, gradient)) in place.w.iter().zip(&place.grad_w_per_m).enumerate() {
            let steps = [i / (n * n), i / n % n, i % n];
            let axes =
                [0, 1, 2].map(|a| at(kernel, place.x[a] / place.dx, place.first_node[a] + steps[a] as i32));
            let own: f64 = axes.iter().map(|axis| axis[0]).product();
            assert!((own - w).abs() < 1e-14, "{} node {i}: {own}, not {w}", place.kernel);

            for a in 0..3 {
                let own = axes[a][1] * axes[(a + 1) % 3][0] * axes[(a + 2) % 3][0] / place.dx;
                let off = (own - gradient[a]).abs() * place.dx;
                assert!(off < 1e-14, "{} node {i} axis {a}: {own}, not {}", place.kernel, gradient[a]);
            }
        }
    }
}

/// Points on nodes, between them, at the middle of cells, on both sides of the origin.
fn points() -> Vec<f64> {
    let mut random = Random::seeded(1);
    let special = (-40..40).map(|i| 0.25 * f64::from(i));
    special.chain((0..10_000).map(|_| 50.0 * random.number())).collect()
}

/// |sum w - 1|, |sum slope|, |sum w (x_i - x_p)|, |sum x_i slope + 1|, in units of the cell.
fn sums(x: f64, first: i32, w: [f64; 4], d: [f64; 4]) -> [f64; 4] {
    let mut sums = [0.0; 4];
    for i in 0..4 {
        let away = f64::from(first + i as i32) - x;
        sums[0] += w[i];
        sums[1] += d[i];
        sums[2] += w[i] * away;
        sums[3] += d[i] * away;
    }
    // A weight falls off as the node is further: the slope is taken with respect to the particle.
    [sums[0] - 1.0, sums[1], sums[2], sums[3] - 1.0].map(f64::abs)
}

#[test]
fn weights_are_a_partition_of_unity_and_reproduce_linear_fields() {
    for kernel in Kernel::ALL {
        for x in points() {
            let (first, w, d) = weights::<f64>(kernel, x);
            for off in sums(x, first, w, d) {
                assert!(off < 1e-14, "{} at {x}: off by {off:e}", kernel.name());
            }
            let single = x as f32;
            let (first, w, d) = weights::<f32>(kernel, single);
            for off in sums(f64::from(single), first, w.map(f64::from), d.map(f64::from)) {
                assert!(off < 2e-6, "{} at {single} in f32: off by {off:e}", kernel.name());
            }
        }
    }
}

#[test]
fn weights_are_those_of_the_recursion_and_never_negative() {
    for kernel in Kernel::ALL {
        for x in points() {
            let (first, w, d) = weights::<f64>(kernel, x);
            for i in 0..4 {
                let away = x - f64::from(first + i as i32);
                let off = (w[i] - reference::weight(kernel, away)).abs();
                assert!(off < 1e-14, "{} at {x}, node {i}: off by {off:e}", kernel.name());
                assert!(w[i] >= 0.0 && (i < kernel.width() || (w[i], d[i]) == (0.0, 0.0)));
            }
        }
    }
}

#[test]
fn slopes_are_the_derivatives_of_weights() {
    let step = 1e-5;
    for kernel in Kernel::ALL {
        for x in points() {
            // Where the slope jumps or bends, differences see both sides.
            let bend = if kernel == Kernel::Quadratic { x - 0.5 } else { x };
            if (bend - bend.round()).abs() < 2.0 * step {
                continue;
            }
            let (first, _, d) = weights::<f64>(kernel, x);

            for i in 0..kernel.width() {
                let node = first + i as i32;
                let [ahead, behind] = [x + step, x - step].map(|x| at(kernel, x, node)[0]);
                let found = (ahead - behind) / (2.0 * step);
                let off = (d[i] - found).abs();
                assert!(off < 1e-8, "{} at {x}, node {i}: {} and {found}", kernel.name(), d[i]);
            }
        }
    }
}
