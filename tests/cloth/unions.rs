//! Solids of several closed parts: sides and distances are those of the union, and parts that are turned are holes or turned round
//! as winding numbers say.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    collide::{
        Shape,
        shape::{Cuboid, MeshSolid, Shell, Shells},
    },
};
use nappe_tests::{
    Method, NEWTON, Random,
    meshes::{Surface, axes, box12, icosphere, torus, turned_box12},
    scene::max_distance,
};

use crate::{
    mannequin::Fall,
    random_unions::{Counts, distances_are_those_of_unions},
    solids::falls_on,
};

#[test]
fn the_distance_from_parts_that_overlap_is_that_from_their_union() {
    let counts = distances_are_those_of_unions(60, 6, 60);
    let Counts { inside, outside, shared } = counts;
    assert!(inside > 200 && outside > 500 && shared > 20, "{counts:?}");
}

/// A box cut across its first axis: at so great a share of its length begins the second part, and ends the first.
pub(crate) fn in_two(center: [f64; 3], half: [f64; 3], axes: [[f64; 3]; 3], [from, to]: [f64; 2]) -> Surface {
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

/// A surface with its turned parts turned round, and without those that are no surface of the solid.
fn put_right(given: &Surface, shells: &Shells) -> Surface {
    let mut put = given.clone();
    for (corners, shell) in put.triangles.iter_mut().zip(&shells.of_triangle) {
        if shells.list[*shell as usize].is_turned {
            corners.swap(1, 2);
        }
    }
    let mut of_triangle = shells.of_triangle.iter();
    put.triangles.retain(|_| of_triangle.next().is_some_and(|shell| !shells.list[*shell as usize].is_inner));
    put
}

/// How many parts are of a kind: holes, solids that are turned, holes that are turned.
fn kinds(shells: &Shells) -> [usize; 3] {
    let count = |is_of: fn(&Shell) -> bool| shells.list.iter().filter(|shell| is_of(shell)).count();
    [
        count(|shell| shell.hole_in.is_some()),
        count(|shell| shell.hole_in.is_none() && shell.is_turned),
        count(|shell| shell.hole_in.is_some() && shell.is_turned),
    ]
}

#[test]
fn parts_within_parts_are_holes_or_turned_as_winding_numbers_say() {
    let mut random = Random::seeded(79);
    let mut found = [0; 3];
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
        let here = kinds(&shells);
        found = [0, 1, 2].map(|kind| found[kind] + here[kind]);

        let collider = put_right(&given, &shells).collider(0.0, 0.0);
        for x in [-1.5, 1.5] {
            for level in 0..5 {
                let p = [x + 0.03, 0.9 - 0.2 * f64::from(level), -0.02];
                let is_inside = given.winding(p).abs() > 0.5;
                let (distance, _) = collider.distance(p, 0.0);
                assert_eq!(distance < 0.0, is_inside, "case {case} at {p:?}: {distance}");
            }
        }
    }
    assert!(found.iter().all(|count| *count > 30), "holes, solids turned, holes turned: {found:?}");
}

/// A box, a ball or a ring, and by chance one of half its size within it, or half as thick; each turned inside out by chance.
fn one_within_another(x: f64, random: &mut Random) -> Vec<Surface> {
    let center = [x, 0.0, 0.0].map(|c| c + 0.02 * random.number());
    let (kind, size) = (random.whole(0, 2), random.between(0.35, 0.5));
    let half = [0; 3].map(|_| size * random.between(0.6, 1.0));
    let axes = axes(random.number(), random.number());
    let body = |share: f64| match kind {
        0 => turned_box12(center, half.map(|c| share * c), axes),
        1 => icosphere(center, share * size, 1),
        _ => torus(center, size, 0.4 * share * size, [9, 6]),
    };
    let shares: &[f64] = if random.chance(0.7) { &[1.0, 0.5] } else { &[1.0] };
    let turned =
        |body: Surface, random: &mut Random| if random.chance(0.5) { body } else { body.inside_out() };
    shares.iter().map(|share| turned(body(*share), random)).collect()
}

#[test]
fn parts_that_reach_into_others_are_holes_or_turned_as_winding_numbers_say() {
    let mut random = Random::seeded(81);
    let mut found = [0; 3];
    let is_in = |part: &Surface, p: [f64; 3]| part.winding(p).abs() > 0.5;
    let turn = |part: &Surface| part.volume().signum();
    for case in 0..200 {
        let parts = [-0.35, 0.35].map(|x| one_within_another(x, &mut random)).concat();
        let given = Surface::joined(&parts);
        let shells = Shells::new(&given.points, &given.triangles).expect("it is closed");
        assert_eq!(shells.list.len(), parts.len(), "case {case}");
        for (number, (part, shell)) in parts.iter().zip(&shells.list).enumerate() {
            let is_around =
                |other: usize| other != number && part.points.iter().all(|p| is_in(&parts[other], *p));
            let around = (0..parts.len()).filter(|other| is_around(*other));
            let goes_round: f64 = around.map(|other| turn(&parts[other])).sum();
            let is_hole = goes_round != 0.0 && goes_round + turn(part) == 0.0;
            let is_turned = (turn(part) < 0.0) != is_hole;
            let told = (shell.hole_in.is_some(), shell.is_turned);
            assert_eq!(told, (is_hole, is_turned), "case {case}, part {number}");
        }
        let here = kinds(&shells);
        found = [0, 1, 2].map(|kind| found[kind] + here[kind]);

        let collider = put_right(&given, &shells).collider(0.0, 0.0);
        let all = || (0_u32..).zip(parts.iter().zip(&shells.list));
        for _ in 0..20 {
            let p = random.vector().map(|c| 0.9 * c);
            let is_in_hole_of =
                |solid: u32| all().any(|(_, (part, it))| it.hole_in == Some(solid) && is_in(part, p));
            let is_inside = all().any(|(solid, (part, it))| {
                it.hole_in.is_none() && !it.is_inner && is_in(part, p) && !is_in_hole_of(solid)
            });
            let (distance, _) = collider.distance(p, 0.0);
            assert_eq!(distance < 0.0, is_inside, "case {case} at {p:?}: {distance}");
        }
    }
    assert!(found.iter().all(|count| *count > 20), "holes, solids turned, holes turned: {found:?}");
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

#[test]
fn a_sheet_rests_on_a_mesh_of_thirty_capsules_as_on_the_capsules() {
    let [_, middle] = Fall { side: 14, spacing: 0.04, steps: 200 }.rests_on_a_mesh_as_on_capsules();
    assert!(middle < 1e-3, "the middle of the sheet is {middle:e} m from where the capsules leave it");
}
