//! Every shape against its definition: distances, normals, and numbers that make none.

use super::{
    Cuboid, HalfPipe, Shape,
    sample::{MIDDLE, TURNED, along},
};
use crate::math::array::{dot, length, minus};

fn at(shape: &Shape, point: [f64; 3]) -> (f64, [f64; 3]) {
    shape.distance(point, [0.0; 3])
}

/// Points spread evenly over a cube of edge 4 about the middle (R3 sequence of Roberts).
fn points(count: u32) -> impl Iterator<Item = [f64; 3]> {
    let steps = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_2];
    (1..=count).map(move |i| [0, 1, 2].map(|c| MIDDLE[c] + 4.0 * (f64::from(i) * steps[c]).fract() - 2.0))
}

#[test]
fn a_distance_is_that_of_the_nearest_point_of_the_surface() {
    for shape in Shape::examples() {
        let surface = shape.surface();
        for point in &surface {
            assert!(at(&shape, *point).0.abs() < 1e-12, "{shape:?} at {point:?}: {}", at(&shape, *point).0);
        }
        for point in points(80) {
            let distance = at(&shape, point).0;
            let nearest = surface.iter().map(|s| length(minus(point, *s))).fold(f64::INFINITY, f64::min);
            let off = nearest - distance.abs();
            // A sample lies within 0.015 of every point of the surface.
            assert!((-1e-12..0.015).contains(&off), "{shape:?} at {point:?}: {distance}, not {nearest}");
            let hidden = distance.abs() < 1e-6;
            assert!(hidden || shape.contains(point) == (distance < 0.0), "{shape:?} at {point:?}");
        }
    }
}

#[test]
fn a_normal_is_the_gradient_of_its_distance() {
    let step = 1e-6;
    for shape in Shape::examples() {
        let mut kinks = 0;
        for point in points(3000) {
            let normal = at(&shape, point).1;
            assert!((length(normal) - 1.0).abs() < 1e-14, "{shape:?} at {point:?}: {normal:?}");
            let beside = |c: usize, step: f64| {
                let mut point = point;
                point[c] += step;
                at(&shape, point)
            };
            let steps = [0, 1, 2].map(|c| [beside(c, step), beside(c, -step)]);
            if steps.iter().flatten().any(|(_, other)| dot(*other, normal) < 0.99) {
                kinks += 1;
                continue;
            }
            let slope = steps.map(|[after, before]| (after.0 - before.0) / (2.0 * step));
            // Rounding leaves 1e-10; curvature, of radius 1e-3 or more in these points, 1e-6.
            let error = length(minus(slope, normal));
            assert!(error < 1e-6, "{shape:?} at {point:?}: {slope:?}, not {normal:?}");
        }
        assert!(kinks < 3, "{shape:?}: {kinks} of 3000 points on a ridge");
    }
}

#[test]
fn a_distance_changes_by_no_more_than_the_way_gone() {
    for shape in Shape::examples() {
        let all: Vec<_> = points(600).map(|point| (point, at(&shape, point).0)).collect();
        for (i, (a, at_a)) in all.iter().enumerate() {
            for (b, at_b) in &all[..i] {
                let way = length(minus(*a, *b));
                assert!((at_a - at_b).abs() <= way + 1e-12, "{shape:?} from {a:?} to {b:?}");
            }
        }
    }
}

#[test]
fn no_point_of_a_shape_is_deeper_than_half_its_thickness() {
    for shape in Shape::examples() {
        let thickness = shape.thickness();
        let far = TURNED.iter().flat_map(|way| [1e3, -1e3].map(|length| along(&[(length, *way)])));
        let deepest_far = far.map(|point| -at(&shape, point).0).fold(f64::NEG_INFINITY, f64::max);
        assert_eq!(thickness.is_infinite(), deepest_far > 900.0, "{shape:?}: {deepest_far} m deep far away");
        if thickness.is_finite() {
            let deepest = points(20_000).map(|point| -at(&shape, point).0).fold(f64::NEG_INFINITY, f64::max);
            let spare = 0.5 * thickness - deepest;
            // One of the points is nearer than 0.15 m to the middle.
            assert!((-1e-12..0.15).contains(&spare), "{shape:?}: {deepest} m deep, {thickness} m thick");
        }
    }
}

#[test]
fn no_point_of_a_surface_is_farther_from_the_reference_point_than_it_reaches() {
    for shape in Shape::examples() {
        let ways = shape.surface().into_iter().map(|point| length(minus(point, shape.reference())));
        let (farthest, reach) = (ways.fold(0.0, f64::max), shape.reach());
        assert_eq!(reach.is_infinite(), shape.thickness().is_infinite(), "{shape:?}");
        // A sample lies within 0.015 of every point of the surface.
        let spare = reach - farthest;
        assert!(
            reach.is_infinite() || (-1e-12..0.015).contains(&spare),
            "{shape:?}: {farthest} m, {reach} m"
        );
    }
}

#[test]
fn points_with_several_nearest_ones_have_a_finite_distance_and_a_unit_normal() {
    let [x, y, z] = TURNED;
    for shape in Shape::examples() {
        for parts in [[(0.0, x), (0.0, y)], [(0.2, x), (0.1, y)], [(0.5, z), (0.0, y)], [(0.0, z), (0.7, y)]]
        {
            let (distance, normal) = at(&shape, along(&parts));
            assert!(distance.is_finite() && (length(normal) - 1.0).abs() < 1e-14, "{shape:?} {parts:?}");
        }
    }
}

#[test]
fn sound_shapes_are_valid() {
    let turned = [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]];
    let thin = Cuboid { center: [-1.0; 3], half_extent: [0.5, 1e-3, 0.5], axes: turned };
    let pipe = HalfPipe { point: [0.0; 3], axis: [0.0, 0.0, 1.0], up: [-0.8, 0.6, 0.0], radius: 4.0 };
    for shape in Shape::examples().into_iter().chain([thin.into(), pipe.into()]) {
        assert_eq!(shape.invalid(), None, "{shape:?}");
    }
}

#[test]
fn numbers_that_make_no_shape_are_named() {
    for (shape, named) in Shape::invalid_examples() {
        let message = shape.invalid().unwrap_or_else(|| panic!("{shape:?} is valid"));
        assert!(message.contains(named), "{shape:?}: {message}");
    }
}
