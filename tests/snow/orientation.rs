//! Which way matrices lie: one shear by hand, its polar parts, its stress, and its numbers in the order in which they are kept.

use nappe_sim::{
    math::{Mat3, Precision},
    snow::{Kernel, Transfer, constitutive_scalar::return_map},
};
use nappe_tests::{
    scene::advance,
    snow::{SnowScene, Variant, elastic, lattice, object, rework},
};

use crate::reference::{matrix, relative, rows};

/// Side of a cell (m), and the volume of a particle at rest (m³).
const H: f64 = 0.1;
const VOLUME: f64 = 1.25e-4;
/// Planes across y slide along x: x = X + 0.1 Y. The first index is that of the place, the second that of the rest.
const SHEAR: [[f64; 3]; 3] = [[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A cube of three cells, with mu = 10 kPa.
fn cube() -> SnowScene {
    let x = lattice([0.0; 3], [6; 3], [0.5 * H; 3]);
    let body = object("cube", x, VOLUME, 400.0, elastic(2.4e4, 0.2));
    let variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };
    SnowScene::new(vec![body], H, 1e-3).by(variant)
}

/// Cosine and sine of the angle by which the shear turns: its tangent is half the shear.
fn turn() -> [f64; 2] {
    let root = (4.0_f64 + 0.1 * 0.1).sqrt();
    [2.0 / root, 0.1 / root]
}

/// The rotation R of F = R S, and S: an axis along y is turned towards x.
fn polar() -> [[[f64; 3]; 3]; 2] {
    let [c, s] = turn();
    let rotation = [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]];
    let stretch = [[c, s, 0.0], [s, c + 0.1 * s, 0.0], [0.0, 0.0, 1.0]];
    [rotation, stretch]
}

/// Kirchhoff stress (Pa) xx, yy, xy: 2 mu (F - R) Fᵀ, since the volume stays.
fn stress() -> [f64; 3] {
    let [c, s] = turn();
    [1.0 - c + 0.1 * (0.1 - s), 1.0 - c, 0.1 - s].map(|strain| 2e4 * strain)
}

#[test]
fn a_shear_along_x_of_planes_across_y_has_the_parts_and_the_stress_that_are_worked_by_hand() {
    let [rotation, stretch] = polar().map(|rows| matrix(&rows));
    let f = matrix(&SHEAR);
    assert!(relative(&(rotation * stretch), &f, 1.0) < 1e-14);
    let of = return_map(&elastic(2.4e4, 0.2), &f, 1.0);
    assert!(relative(&of.rotation, &rotation, 1.0) < 1e-14, "{:?}", rows(&of.rotation));
    assert_eq!(of.elastic, f);
    let values = [1.051_249_219_725_039_3, 1.0, 0.951_249_219_725_039_3];
    let mut found = of.singular_values;
    found.sort_by(|a, b| b.total_cmp(a));
    for (found, value) in found.into_iter().zip(values) {
        assert!((found - value).abs() < 1e-14, "{found}, not {value}");
    }
    let [xx, yy, xy] = stress();
    // As the page has them.
    for (found, told) in [xx, yy, xy].into_iter().zip([125.078, 24.953, 1001.248]) {
        assert!((found - told).abs() < 6e-4, "{found}, not {told}");
    }
    let expected = matrix(&[[xx, xy, 0.0], [xy, yy, 0.0], [0.0; 3]]);
    assert!(relative(&of.kirchhoff, &expected, 1.0) < 1e-12, "{:?}", rows(&of.kirchhoff));
}

#[test]
fn a_particle_keeps_matrices_by_rows_and_its_stress_as_six_numbers() {
    let mut simulation = cube().simulate(Precision::F64);
    rework(&mut simulation, |_, p| p.elastic = SHEAR);
    let [xx, yy, xy] = stress();
    for p in simulation.snow_particles() {
        // The shear is the second of nine numbers: the second column of the first row.
        let bytes: Vec<u8> =
            p.elastic.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect();
        assert_eq!(bytes[8..16], 0.1_f64.to_le_bytes());
        assert_eq!(bytes[24..32], 0.0_f64.to_le_bytes(), "the first column of the second row");
        assert_eq!(p.elastic, SHEAR);
        let found = p.volume_stress.expect("a particle tells its stress");
        for (found, of) in found.into_iter().zip([xx, yy, 0.0, xy, 0.0, 0.0]) {
            assert!((found / VOLUME - of).abs() < 1e-9, "{found} J, not {of} Pa times the volume");
        }
    }
    // A matrix of the library has the same indices, and its numbers lie by columns.
    let f: Mat3<f64> = matrix(&SHEAR);
    assert_eq!((f[(0, 1)], f.as_slice()[3]), (0.1, 0.1));

    // Planes that were slid along x are pulled back.
    advance(&mut simulation, 1);
    let (mut above, mut below) = (0.0, 0.0);
    for p in simulation.snow_particles() {
        *(if p.x[1] > 1.5 * H { &mut above } else { &mut below }) += p.v[0];
    }
    assert!(above < -1e-4 && below > 1e-4, "{above} m/s above, {below} m/s below");
}

#[test]
fn an_affine_velocity_has_the_velocity_first_and_shears_what_it_moves() {
    let mut simulation = cube().simulate(Precision::F64);
    // Planes across y slide along x at 2 m/s per metre: C d is the velocity around a particle.
    rework(&mut simulation, |_, p| {
        p.affine = [[0.0, 2.0, 0.0], [0.0; 3], [0.0; 3]];
        p.v = [2.0 * p.x[1], 0.0, 0.0];
    });
    advance(&mut simulation, 1);
    for p in simulation.snow_particles() {
        for (row, expected) in p.affine.iter().zip([[0.0, 2.0, 0.0], [0.0; 3], [0.0; 3]]) {
            for (found, of) in row.iter().zip(expected) {
                assert!((found - of).abs() < 1e-11, "{:?} 1/s", p.affine);
            }
        }
        // (I + dt grad v) F, after 1 ms.
        let off = [p.elastic[0][1] - 2e-3, p.elastic[1][0], p.elastic[0][0] - 1.0];
        assert!(off.iter().all(|off| off.abs() < 1e-13), "{:?}", p.elastic);
    }
}
