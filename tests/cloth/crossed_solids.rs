//! Solids whose surface passes through itself: inside is what it goes round, once or twice or the other way round, and
//! distances outside are those of all triangles.

use std::f64::consts::TAU;

use nappe_sim::{
    collide::{
        Collider, Shape,
        shape::{MeshSolid, SelfCrossings},
    },
    interrupt::Interrupt,
    math::vec3,
    surface::{Crossings, Faces},
};
use nappe_tests::{
    Random,
    meshes::{Surface, box12, icosphere, torus, tray},
    scene::norm,
};

/// Prism over a star of five points that is drawn in one line: it goes round its middle twice.
fn star() -> Surface {
    let rim = |z: f64| {
        (0..5_u32).map(move |k| f64::from(k) * TAU / 5.0).map(move |t| [0.8 * t.cos(), z, -0.8 * t.sin()])
    };
    let points = rim(-0.3).chain(rim(0.3)).chain([[0.0, -0.3, 0.0], [0.0, 0.3, 0.0]]).collect();
    let lines = [[0, 2], [2, 4], [4, 1], [1, 3], [3, 0]];
    let triangles =
        lines.iter().flat_map(|&[a, b]| [[a, b, b + 5], [a, b + 5, a + 5], [10, b, a], [11, a + 5, b + 5]]);
    Surface { points, triangles: triangles.collect() }
}

/// A closed tube of so many rings of so many points that is bent to a figure of eight; the first ring stands at so great a share of
/// a ring.
fn eight([around, across]: [u32; 2], first: f64) -> Surface {
    let mut tube = torus([0.0; 3], 1.0, 0.1, [around, across]);
    for (i, j) in (0..around).flat_map(|i| (0..across).map(move |j| (i, j))) {
        let t = TAU * (f64::from(i) + first) / f64::from(around);
        let v = TAU * f64::from(j) / f64::from(across);
        let way = [0.6 * t.cos(), 0.6 * (2.0 * t).cos()];
        let length = way[0].hypot(way[1]);
        // Across the tube, in the plane of the eight.
        let side = [way[1] / length, -way[0] / length];
        let [out, up] = [0.1 * v.cos(), 0.1 * v.sin()];
        tube.points[(i * across + j) as usize] =
            [0.6 * t.sin() + out * side[0], up, 0.3 * (2.0 * t).sin() + out * side[1]];
    }
    tube
}

/// A ball whose top is pushed down through its bottom: beyond, the surface is inside out.
fn pushed_through() -> Surface {
    icosphere([0.0; 3], 0.6, 4).mapped(|[x, y, z]| {
        let share = 1.0 - (x * x + z * z) / 0.09;
        if y > 0.0 && share > 0.0 { [x, y - 1.5 * share, z] } else { [x, y, z] }
    })
}

fn figures() -> Vec<(&'static str, Surface)> {
    vec![
        ("star", star()),
        ("eight", eight([96, 12], 0.37)),
        ("eight with corners upon each other", eight([96, 12], 0.0)),
        ("ball pushed through itself", pushed_through()),
    ]
}

fn crossings(collider: &Collider) -> SelfCrossings {
    let Shape::Mesh(solid) = &collider.shape else { panic!("it is a mesh") };
    solid.crossings()
}

/// A point anywhere, near a corner of a surface, or near the middle.
fn point_about(surface: &Surface, random: &mut Random) -> [f64; 3] {
    let corner = surface.points[random.whole(0, surface.points.len() as u32 - 1) as usize];
    let (from, size) = random.pick(&[([0.0; 3], 1.0), (corner, 0.15), ([0.0; 3], 0.2)]);
    let away = random.vector();
    [0, 1, 2].map(|c| from[c] + size * away[c])
}

#[test]
fn sides_are_those_of_winding_numbers_and_distances_those_of_all_triangles() {
    let mut random = Random::seeded(771);
    for (name, surface) in figures() {
        let collider = surface.collider(0.0, 0.0);
        assert!(surface.open_sides().is_empty() && surface.volume() > 0.0, "{name}");
        let goes_round = |p: [f64; 3]| surface.winding(p).abs() > 0.5;
        let (mut inside, mut outside, mut more) = (0, 0, 0);
        for _ in 0..600 {
            let p = point_about(&surface, &mut random);
            let (distance, normal) = collider.distance(p, 0.0);
            let nearest = surface.distance(p).abs();
            assert!((norm(normal) - 1.0).abs() < 1e-12, "{name} at {p:?}: {normal:?}");
            if nearest < 1e-9 {
                continue;
            }
            if !goes_round(p) {
                outside += 1;
                assert!((distance - nearest).abs() < 1e-12, "{name} at {p:?}: {distance}, not {nearest}");
                continue;
            }
            inside += 1;
            more += usize::from(surface.winding(p).abs() > 1.5);
            assert!(distance <= 1e-12 - nearest, "{name} at {p:?}: {distance}, not -{nearest} or less");
            // What is no deeper than that is inside.
            let away = random.vector();
            let size = 0.999 * distance / norm(away);
            let near = [0, 1, 2].map(|c| p[c] + size * away[c]);
            assert!(goes_round(near), "{name} at {p:?}: {distance}, and {near:?} is outside");
        }
        assert!(inside > 50 && outside > 50, "{name}: {inside} inside, {outside} outside");
        assert!(more > 5 || name.starts_with("ball"), "{name}: {more} where it goes round twice");
    }
}

#[test]
fn a_wall_of_a_tube_within_another_piece_of_it_is_no_surface() {
    let surface = eight([240, 32], 0.37);
    let collider = surface.collider(0.0, 0.0);
    // Beside the wall of one arm, in the middle of the other one.
    let along = 0.09 * 0.5_f64.sqrt();
    let p = [along, 0.0, -along];
    let (distance, nearest) = (collider.distance(p, 0.0).0, surface.distance(p).abs());
    assert!(nearest < 0.011 && distance < -0.03, "{distance}, and the nearest wall is {nearest} away");
}

#[test]
fn crossings_are_those_that_surfaces_of_cloth_count() {
    for (name, surface) in figures() {
        let faces = Faces::new(&surface.triangles, surface.points.len());
        let place = |point: u32| vec3::<f64>(surface.points[point as usize]);
        let counted = Crossings::new(&faces).count(&faces, &place, &Interrupt::default());
        let (count, first) = counted.expect("nobody gives it up");
        let found = crossings(&surface.collider(0.0, 0.0));
        assert!(count > 0 && first.is_some(), "{name}");
        assert_eq!((found.count, found.is_cut_off), (count, false), "{name}");
        let first = found.first.expect("there is one");
        for t in first.triangles {
            let triangles = vec![surface.triangles[t as usize]];
            let off = Surface { points: surface.points.clone(), triangles }.distance(first.place).abs();
            assert!(off < 1e-12, "{name}: {first:?} is {off} m off triangle {t}");
        }
    }
    for (name, surface) in [
        ("box", box12([0.1, -0.2, 0.3], [0.5, 0.2, 0.1])),
        ("ball", icosphere([0.1, 0.2, -0.1], 0.5, 3)),
        ("ring", torus([0.0, 0.1, 0.0], 0.4, 0.15, [24, 12])),
        ("tray", tray(30.0)),
        ("two boxes that overlap", Surface::joined(&[box12([0.0; 3], [1.0; 3]), box12([0.5; 3], [1.0; 3])])),
    ] {
        assert_eq!(crossings(&surface.collider(0.0, 0.0)), SelfCrossings::default(), "{name}");
    }
}

#[test]
fn a_part_that_passes_through_itself_has_its_sides_beside_others_and_within_them() {
    let mut random = Random::seeded(772);
    let ball = icosphere([0.5, 0.1, 0.2], 0.35, 2);
    let whole = Surface::joined(&[star(), ball.clone()]);
    let collider = whole.collider(0.0, 0.0);
    let mut inside = 0;
    for _ in 0..600 {
        let p = point_about(&whole, &mut random);
        let nearest = whole.distance(p).abs();
        if nearest < 1e-9 {
            continue;
        }
        let is_inside = star().winding(p) > 0.5 || ball.winding(p) > 0.5;
        inside += usize::from(is_inside);
        let (distance, _) = collider.distance(p, 0.0);
        assert_eq!(distance < 0.0, is_inside, "at {p:?}: {distance}");
        assert!(is_inside || (distance - nearest).abs() < 1e-12, "at {p:?}: {distance}, not {nearest}");
    }
    assert!(inside > 100, "{inside} inside");

    // A hole of that form in a block: outside is what it goes round.
    let hollow = Surface::joined(&[box12([0.0; 3], [1.0; 3]), star().inside_out()]);
    let collider = hollow.collider(0.0, 0.0);
    for _ in 0..300 {
        let p = random.vector().map(|c| 0.95 * c);
        if hollow.distance(p).abs() < 1e-9 {
            continue;
        }
        let (distance, _) = collider.distance(p, 0.0);
        assert_eq!(distance > 0.0, star().winding(p) > 0.5, "at {p:?}: {distance}");
    }
}

#[test]
fn two_hundred_thousand_triangles_that_all_overlap_are_told_before_all_of_them_are_looked_at() {
    let mut random = Random::seeded(773);
    let mut tangle = torus([0.0; 3], 1.0, 0.3, [400, 250]);
    for point in &mut tangle.points {
        *point = random.vector();
    }
    let tangle = if tangle.volume() < 0.0 { tangle.inside_out() } else { tangle };
    assert_eq!(tangle.triangles.len(), 200_000);
    let solid = MeshSolid::new(tangle.points.clone(), tangle.triangles.clone()).expect("it is closed");
    let found = solid.crossings();
    assert!(found.is_cut_off && found.count > 1_000, "{found:?}");
    let collider = Collider { shape: Shape::Mesh(solid), ..any_collider() };
    for _ in 0..10 {
        let p = random.vector();
        let (distance, _) = collider.distance(p, 0.0);
        if distance.abs() > 1e-9 {
            assert_eq!(distance < 0.0, tangle.winding(p).abs() > 0.5, "at {p:?}: {distance}");
        }
    }
}

/// A collider of any shape.
fn any_collider() -> Collider {
    box12([0.0; 3], [1.0; 3]).collider(0.0, 0.0)
}
