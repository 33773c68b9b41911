//! Solids of several closed parts: sides and distances are those of the union, and parts that are turned are holes or turned round
//! as winding numbers say.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    collide::{
        Shape,
        shape::{Cuboid, MeshSolid, Shells},
    },
};
use nappe_tests::{
    Method, NEWTON, Random,
    meshes::{Surface, box12, icosphere, torus, turned_box12},
    scene::{max_distance, norm},
};

use crate::solids::{axes, falls_on};

/// A box, a ball or a ring somewhere within a cube of 2 m.
fn part(random: &mut Random) -> Surface {
    let center = random.vector().map(|c| 0.5 * c);
    let size = random.between(0.15, 0.5);
    match random.whole(0, 2) {
        0 => {
            let half = [0, 1, 2].map(|_| random.between(0.1, 0.5));
            turned_box12(center, half, axes(random.number(), random.number()))
        }
        1 => icosphere(center, size, 1),
        _ => torus(center, size, 0.4 * size, [9, 6]),
    }
}

/// A point anywhere, or near a corner of a surface.
fn point_about(surface: &Surface, random: &mut Random) -> [f64; 3] {
    let corner = surface.points[random.whole(0, surface.points.len() as u32 - 1) as usize];
    let away = random.vector();
    if random.chance(0.5) { away } else { [0, 1, 2].map(|c| corner[c] + 0.05 * away[c]) }
}

#[test]
fn the_distance_from_parts_that_overlap_is_that_from_their_union() {
    let mut random = Random::seeded(77);
    let (mut inside, mut outside, mut shared) = (0, 0, 0);
    for case in 0..60 {
        let parts: Vec<Surface> = (0..random.whole(2, 6)).map(|_| part(&mut random)).collect();
        let whole = Surface::joined(&parts);
        let collider = whole.collider(0.0, 0.0);
        let depth =
            |p: [f64; 3]| parts.iter().map(|part| -part.distance(p)).fold(f64::NEG_INFINITY, f64::max);
        for _ in 0..60 {
            let p = point_about(&whole, &mut random);
            let (distance, normal) = collider.distance(p, 0.0);
            let deepest = depth(p);
            assert!((norm(normal) - 1.0).abs() < 1e-12, "case {case} at {p:?}: {normal:?}");
            if deepest.abs() < 1e-9 {
                continue;
            }
            if deepest < 0.0 {
                outside += 1;
                assert!(
                    (distance + deepest).abs() < 1e-12,
                    "case {case} at {p:?}: {distance}, not {}",
                    -deepest
                );
                continue;
            }
            inside += 1;
            shared += usize::from(parts.iter().filter(|part| part.distance(p) < 0.0).count() > 1);
            assert!(
                distance <= -deepest + 1e-12,
                "case {case} at {p:?}: {distance} in a part {deepest} deep"
            );
            // What is no deeper than that in the union is within it.
            let away = random.vector();
            let size = 0.999 * distance / norm(away);
            let near = [0, 1, 2].map(|c| p[c] + size * away[c]);
            assert!(depth(near) > -1e-9, "case {case} at {p:?}: {distance}, and {near:?} is outside");
        }
    }
    assert!(
        inside > 200 && outside > 500 && shared > 20,
        "{inside} inside, {outside} outside, {shared} in several"
    );
}

/// A box cut across its first axis: at so great a share of its length begins the second part, and ends the first.
fn in_two(center: [f64; 3], half: [f64; 3], axes: [[f64; 3]; 3], [from, to]: [f64; 2]) -> Surface {
    let piece = |[low, high]: [f64; 2]| {
        let along = half[0] * (low + high);
        let center = [0, 1, 2].map(|c| center[c] + along * axes[0][c]);
        turned_box12(center, [half[0] * (high - low), half[1], half[2]], axes)
    };
    // In shares of half of the length, from the middle.
    let [from, to] = [from, to].map(|share| share - 0.5);
    Surface::joined(&[piece([-0.5, to]), piece([from, 0.5])])
}

#[test]
fn cloth_does_on_a_box_of_two_parts_what_it_does_on_the_box_by_formula() {
    let newton = Method { minimizer: NEWTON, ..Method::new(Integrator::Bdf2, Hessian::Absolute) };
    let one_step = Integrator::ALL.map(|integrator| Method::new(integrator, Hessian::Absolute));
    // Without air no step of explicit Euler is stable.
    let methods = one_step.into_iter().filter(|method| method.integrator != Integrator::ExplicitEuler);
    let (center, half_extent) = ([0.013, -0.1, -0.007], [0.15, 0.1, 0.15]);
    for method in methods.chain([newton]) {
        for axes in [axes(0.0, 0.0), axes(0.35, -0.2)] {
            let (expected, _) = falls_on(Shape::Box(Cuboid { center, half_extent, axes }), method);
            for shares in [[0.3, 0.63], [0.41, 0.41]] {
                let whole = in_two(center, half_extent, axes, shares);
                let (found, [touched, _, pinched]) = falls_on(whole.shape(), method);
                let (off, label) = (max_distance(&found, &expected), method.name());
                assert!(off < 1e-9, "{label}, axes {axes:?}, cut at {shares:?}: {off:e} m off after 1 s");
                assert!(touched > 100 && pinched == 0, "{label}: {touched} contacts, {pinched} pinched");
            }
        }
    }
}

#[test]
fn a_box_of_two_parts_is_as_deep_as_the_box() {
    let (center, half, axes) = ([0.1, 0.2, 0.3], [0.5, 0.2, 0.3], axes(0.3, 0.1));
    let by_formula = turned_box12(center, half, axes).collider(0.0, 0.0);
    let mut random = Random::seeded(78);
    let parts = in_two(center, half, axes, [0.5, 0.5]).collider(0.0, 0.0);
    for _ in 0..2_000 {
        let p = [0, 1, 2].map(|c| center[c] + 0.6 * random.number());
        let [found, expected] = [&parts, &by_formula].map(|collider| collider.distance(p, 0.0).0);
        assert!((found - expected).abs() < 1e-12, "at {p:?}: {found}, not {expected}");
    }
}

#[test]
fn parts_within_parts_are_holes_or_turned_as_winding_numbers_say() {
    let mut random = Random::seeded(79);
    let (mut holes, mut turned) = (0, 0);
    for case in 0..200 {
        // Boxes within boxes, each turned by chance, beside another such heap.
        let mut parts = Vec::new();
        for x in [-1.5, 1.5] {
            for level in 0..random.whole(1, 4) {
                let shell = box12([x, 0.0, 0.0], [1.0 - 0.2 * f64::from(level); 3]);
                parts.push(if random.chance(0.5) { shell } else { shell.inside_out() });
            }
        }
        let given = Surface::joined(&parts);
        let shells = Shells::new(&given.points, &given.triangles).expect("it is closed");
        assert_eq!(shells.list.len(), parts.len(), "case {case}");
        holes += shells.list.iter().filter(|shell| shell.hole_in.is_some()).count();
        turned += shells.list.iter().filter(|shell| shell.is_turned).count();

        let mut put = given.clone();
        for (corners, shell) in put.triangles.iter_mut().zip(&shells.of_triangle) {
            if shells.list[*shell as usize].is_turned {
                corners.swap(1, 2);
            }
        }
        let mut of_triangle = shells.of_triangle.iter();
        put.triangles
            .retain(|_| of_triangle.next().is_some_and(|shell| !shells.list[*shell as usize].is_inner));
        let collider = put.collider(0.0, 0.0);
        for x in [-1.5, 1.5] {
            for level in 0..5 {
                let p = [x + 0.03, 0.9 - 0.2 * f64::from(level), -0.02];
                let is_inside = given.winding(p).abs() > 0.5;
                let (distance, _) = collider.distance(p, 0.0);
                assert_eq!(distance < 0.0, is_inside, "case {case} at {p:?}: {distance}");
            }
        }
    }
    assert!(holes > 50 && turned > 50, "{holes} holes, {turned} turned");
}

#[test]
fn a_part_that_is_turned_is_refused_where_nobody_turns_it_round() {
    let parts = [box12([0.0; 3], [1.0; 3]), box12([3.0, 0.0, 0.0], [0.5; 3]).inside_out()];
    let whole = Surface::joined(&parts);
    let reason = MeshSolid::new(whole.points, whole.triangles).expect_err("one part is turned");
    assert!(reason.contains("its part of triangle 12 is turned the wrong way"), "{reason}");
}

#[test]
fn parts_that_touch_in_a_point_have_their_own_sides_there() {
    // Two corners of two boxes are one point.
    let mut whole = Surface::joined(&[box12([0.0; 3], [1.0; 3]), box12([2.0; 3], [1.0; 3])]);
    let meets = |point: &[f64; 3]| *point == [1.0; 3];
    let first = whole.points.iter().position(meets).expect("a corner") as u32;
    let second = whole.points.iter().rposition(meets).expect("a corner") as u32;
    for corner in whole.triangles.as_flattened_mut() {
        *corner = if *corner == second { first } else { *corner };
    }
    let collider = whole.collider(0.0, 0.0);
    for (p, expected) in
        [([0.9; 3], -0.1), ([1.1; 3], -0.1), ([1.1, 0.9, 0.95], 0.1), ([1.2, 1.2, 0.7], 0.2_f64.hypot(0.2))]
    {
        let (distance, _) = collider.distance(p, 0.0);
        assert!((distance - expected).abs() < 1e-12, "at {p:?}: {distance}, not {expected}");
    }
}

#[test]
fn ten_thousand_parts_are_one_solid() {
    let part = |i: u32| {
        let place = [i % 25, i / 25 % 20, i / 500].map(f64::from);
        icosphere(place, 0.4, 0)
    };
    let whole = Surface::joined(&(0..10_000).map(part).collect::<Vec<_>>());
    let collider = whole.collider(0.0, 0.0);
    let alone = icosphere([0.0; 3], 0.4, 0);
    let mut random = Random::seeded(80);
    for _ in 0..1_000 {
        let about = random.vector().map(|c| 0.499 * c);
        let place = [random.whole(0, 24), random.whole(0, 19), random.whole(0, 19)].map(f64::from);
        let (distance, _) = collider.distance([0, 1, 2].map(|c| place[c] + about[c]), 0.0);
        let expected = alone.distance(about);
        // A neighbour may be as near.
        assert!(
            (distance - expected).abs() < 1e-12 || (0.0..expected).contains(&distance),
            "{distance}, not {expected}"
        );
    }
}
