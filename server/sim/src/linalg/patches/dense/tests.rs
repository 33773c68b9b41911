//! Fronts, against a factorisation in binary64.

use nalgebra::DMatrix;

use super::{Dense, PANEL, height, rest_height};
use crate::{
    linalg::patches::singles::{Singles, flat, flat_mut},
    math::LANES,
    parallel::on_threads,
};

/// A positive definite matrix with a diagonal of ones.
fn matrix(rows: usize) -> DMatrix<f64> {
    let number = |i: usize| ((i * i * 7919 + 13 * i) % 1009) as f64 / 504.5 - 1.0;
    DMatrix::from_fn(rows, rows, |r, c| {
        if r == c { 1.0 } else { 0.95 * number(r.max(c) * rows + r.min(c)) / rows as f64 }
    })
}

/// Panel and rest of a front, factored.
fn factored(a: &DMatrix<f64>, pivots: usize) -> [Vec<Singles>; 2] {
    let rows = a.nrows();
    let (tall, low) = (height(rows), rest_height(rows, pivots));
    let mut panel = vec![Singles::ZERO; tall * pivots];
    let mut rest = vec![Singles::ZERO; low * (rows - pivots)];
    for column in 0..rows {
        for row in column..rows {
            if column < pivots {
                flat_mut(&mut panel)[column * tall * LANES + row] = a[(row, column)] as f32;
            } else {
                let place = (column - pivots) * low * LANES + row - pivots / LANES * LANES;
                flat_mut(&mut rest)[place] = a[(row, column)] as f32;
            }
        }
    }
    let mut packed = vec![Singles([f32::NAN; LANES]); tall * PANEL];
    Dense { rows, pivots, panel: &mut panel, rest: &mut rest, packed: &mut packed }.factor();
    [panel, rest]
}

#[test]
fn a_front_is_factored_and_what_is_left_is_passed_on() {
    let small = [(1, 1), (5, 5), (16, 16), (17, 3), (48, 48), (100, 47), (60, 0)];
    for (rows, pivots) in small.into_iter().chain([(130, 97), (431, 150)]) {
        let a = matrix(rows);
        let [panel, rest] = factored(&a, pivots);
        let l = a.clone().cholesky().expect("positive definite").l();
        let (tall, low) = (height(rows), rest_height(rows, pivots));
        for column in 0..pivots {
            let found = &flat(&panel)[column * tall * LANES..(column + 1) * tall * LANES];
            let from = column / LANES * LANES;
            assert!(found[from..column].iter().all(|entry| *entry == 0.0));
            assert!((f64::from(found[column]) * l[(column, column)] - 1.0).abs() < 2e-5);
            for row in column + 1..rows {
                let error = (f64::from(found[row]) - l[(row, column)]).abs();
                assert!(error < 2e-5, "{rows} {pivots} {row} {column}: {error}");
            }
        }
        let left = l.view((pivots, pivots), (rows - pivots, rows - pivots));
        let left = left * left.transpose();
        for column in pivots..rows {
            for row in column..rows {
                let place = (column - pivots) * low * LANES + row - pivots / LANES * LANES;
                let error = (f64::from(flat(&rest)[place]) - left[(row - pivots, column - pivots)]).abs();
                assert!(error < 2e-5, "{rows} {pivots} {row} {column}: {error}");
            }
        }
    }
}

#[test]
fn the_bits_of_a_front_do_not_depend_on_threads() {
    let a = matrix(520);
    let on = |threads: usize| on_threads(threads, || factored(&a, 210));
    let bits = |found: [Vec<Singles>; 2]| -> Vec<u32> {
        // What stands above the diagonal of the rest means nothing, but is the same too.
        found.iter().flat_map(|part| flat(part).iter().map(|entry| entry.to_bits())).collect()
    };
    let one = bits(on(1));
    for threads in [2, 3, 8] {
        assert_eq!(bits(on(threads)), one, "{threads} threads");
    }
}

#[test]
fn an_unknown_without_a_pivot_is_left_out() {
    let mut a = matrix(20);
    for i in 0..20 {
        (a[(7, i)], a[(i, 7)]) = (0.0, 0.0);
    }
    let [panel, rest] = factored(&a, 12);
    assert!(flat(&panel).iter().chain(flat(&rest)).all(|entry| entry.is_finite()));
    let column = &flat(&panel)[7 * 32..8 * 32];
    assert!(column.iter().all(|entry| *entry == 0.0));
}
