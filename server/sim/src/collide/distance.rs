//! Signed distances of shapes: exact inside and outside, and their gradients.
//!
//! Reads a point (m) and how far (m) a shape has moved; writes the distance (m) from its surface,
//! negative inside, and the unit outward normal. Where several points of the surface are nearest
//! the normal is that of one of them.

use super::{
    Shape,
    shape::{cross, dot, minus},
};

type Nearest = (f64, [f64; 3]);

impl Shape {
    /// Distance and normal of the shape, moved by `shift`.
    pub(super) fn distance(&self, point: [f64; 3], shift: [f64; 3]) -> Nearest {
        let from = |start: [f64; 3]| [0, 1, 2].map(|c| point[c] - start[c] - shift[c]);
        match *self {
            Self::Plane { point: start, normal } => (dot(from(start), normal), normal),
            Self::Sphere { center, radius } => {
                let (length, normal) = length_and_way(from(center), [0.0, 1.0, 0.0]);
                (length - radius, normal)
            }
            Self::Capsule { start, end, radius } => capsule(from(start), minus(end, start), radius),
            Self::Box { center, half_extent, axes } => brick(from(center), half_extent, &axes),
            Self::Cylinder { start, end, radius } => cylinder(from(start), minus(end, start), radius),
            Self::HalfPipe { point: start, axis, up, radius } => half_pipe(from(start), axis, up, radius),
        }
    }
}

/// Length and direction of a vector; `none` is the direction of one without length.
fn length_and_way(v: [f64; 3], none: [f64; 3]) -> Nearest {
    let length = dot(v, v).sqrt();
    (length, if length > 0.0 { v.map(|c| c / length) } else { none })
}

/// A unit direction at right angles to another.
fn across(axis: [f64; 3]) -> [f64; 3] {
    let least = if axis[0].abs() <= axis[1].abs().min(axis[2].abs()) {
        [1.0, 0.0, 0.0]
    } else if axis[1].abs() <= axis[2].abs() {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    length_and_way(cross(axis, least), least).1
}

/// `p` from the start of the segment, `along` from its start to its end.
fn capsule(p: [f64; 3], along: [f64; 3], radius: f64) -> Nearest {
    let share = (dot(p, along) / dot(along, along)).clamp(0.0, 1.0);
    let (length, normal) = length_and_way([0, 1, 2].map(|c| p[c] - share * along[c]), across(along));
    (length - radius, normal)
}

/// `p` from the centre.
fn brick(p: [f64; 3], half_extent: [f64; 3], axes: &[[f64; 3]; 3]) -> Nearest {
    let own = axes.map(|axis| dot(p, axis));
    let beyond = [0, 1, 2].map(|k| own[k].abs() - half_extent[k]);
    let outward = |k: usize| axes[k].map(|c| c * own[k].signum());
    convex(beyond, [outward(0), outward(1), outward(2)])
}

/// `p` from the centre of an end, `along` to that of the other.
fn cylinder(p: [f64; 3], along: [f64; 3], radius: f64) -> Nearest {
    let (length, axis) = length_and_way(along, along);
    let height = dot(p, axis);
    let flat = [0, 1, 2].map(|c| p[c] - height * axis[c]);
    let (r, radial) = length_and_way(flat, across(axis));
    let middle = height - 0.5 * length;
    let end = axis.map(|c| c * middle.signum());
    // Two faces at right angles; the third is never the nearest.
    convex([r - radius, middle.abs() - 0.5 * length, f64::NEG_INFINITY], [radial, end, end])
}

/// Distance from a solid between faces at right angles, from that of each: beyond several, it is
/// that of their common edge or corner; beyond none, that of the nearest face.
fn convex(beyond: [f64; 3], outward: [[f64; 3]; 3]) -> Nearest {
    let outside = beyond.map(|b| b.max(0.0));
    let length = dot(outside, outside).sqrt();
    if length > 0.0 {
        let way = outside.map(|b| b / length);
        return (length, [0, 1, 2].map(|c| (0..3).map(|k| way[k] * outward[k][c]).sum()));
    }
    let nearest = (1..3).fold(0, |best, k| if beyond[k] > beyond[best] { k } else { best });
    (beyond[nearest], outward[nearest])
}

/// `p` from a point of the axis. The ground is what is below the axis and outside of the tube: its
/// surface is half a tube and a flat on either side.
fn half_pipe(p: [f64; 3], axis: [f64; 3], up: [f64; 3], radius: f64) -> Nearest {
    let lateral = cross(up, axis);
    let (side, height) = (dot(p, lateral), dot(p, up));
    let across = side.abs();
    let toward = |a: f64, b: f64| [0, 1, 2].map(|c| a * side.signum() * lateral[c] + b * up[c]);
    if across >= radius && height >= 0.0 {
        return (height, up);
    }
    if height > 0.0 {
        // Between the rims and above the axis: the nearer rim is the nearest point.
        let gap = across - radius;
        let length = (gap * gap + height * height).sqrt();
        return (length, if length > 0.0 { toward(gap / length, height / length) } else { up });
    }
    let r = (across * across + height * height).sqrt();
    let wall = radius - r;
    if across >= radius && height > wall {
        return (height, up);
    }
    (wall, if r > 0.0 { toward(-across / r, -height / r) } else { up })
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "points of the tests, not of a step")]
mod tests {
    use std::f64::consts::TAU;

    use super::Shape;
    use crate::collide::shape::{cross, dot, minus};

    const TURNED: [[f64; 3]; 3] = [
        [2.0 / 3.0, 2.0 / 3.0, -1.0 / 3.0],
        [-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0],
        [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0],
    ];
    const MIDDLE: [f64; 3] = [0.3, -0.2, 0.1];

    fn shapes() -> [Shape; 6] {
        let [x, y, z] = TURNED;
        let (start, end) = (along(&[(-0.7, x), (0.1, y)]), along(&[(0.9, x), (0.1, y)]));
        [
            Shape::Plane { point: MIDDLE, normal: x },
            Shape::Sphere { center: MIDDLE, radius: 0.8 },
            Shape::Capsule { start, end, radius: 0.5 },
            Shape::Box { center: MIDDLE, half_extent: [0.9, 0.4, 0.6], axes: TURNED },
            Shape::Cylinder { start, end, radius: 0.6 },
            Shape::HalfPipe { point: MIDDLE, axis: z, up: y, radius: 0.9 },
        ]
    }

    /// The middle and a sum of lengths along directions.
    fn along(parts: &[(f64, [f64; 3])]) -> [f64; 3] {
        parts.iter().fold(MIDDLE, |sum, (length, way)| [0, 1, 2].map(|c| sum[c] + length * way[c]))
    }

    fn norm(v: [f64; 3]) -> f64 {
        dot(v, v).sqrt()
    }

    fn at(shape: &Shape, point: [f64; 3]) -> (f64, [f64; 3]) {
        shape.distance(point, [0.0; 3])
    }

    /// Points spread evenly over a cube of edge 4 about the middle (R3 sequence of Roberts).
    fn points(count: u32) -> impl Iterator<Item = [f64; 3]> {
        let steps = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_2];
        (1..=count).map(move |i| [0, 1, 2].map(|c| MIDDLE[c] + 4.0 * (f64::from(i) * steps[c]).fract() - 2.0))
    }

    /// Whether a point is inside, from the definition of the solid alone.
    fn is_inside(shape: &Shape, p: [f64; 3]) -> bool {
        match *shape {
            Shape::Plane { point, normal } => dot(minus(p, point), normal) < 0.0,
            Shape::Sphere { center, radius } => norm(minus(p, center)) < radius,
            Shape::Capsule { start, end, radius } => (0..=4000).any(|i| {
                let share = f64::from(i) / 4000.0;
                let axis = [0, 1, 2].map(|c| start[c] + share * (end[c] - start[c]));
                norm(minus(p, axis)) < radius
            }),
            Shape::Box { center, half_extent, axes } => {
                (0..3).all(|k| dot(minus(p, center), axes[k]).abs() < half_extent[k])
            }
            Shape::Cylinder { start, end, radius } => {
                let (way, from) = (minus(end, start), minus(p, start));
                let share = dot(from, way) / dot(way, way);
                (0.0..1.0).contains(&share) && norm(cross(from, way)) / norm(way) < radius
            }
            Shape::HalfPipe { point, axis, up, radius } => {
                let from = minus(p, point);
                norm(cross(from, axis)) > radius && dot(from, up) < 0.0
            }
        }
    }

    /// The point of a surface of revolution about x: `height` along it, `radius` away from it.
    fn turned(height: f64, radius: f64, angle: f64) -> [f64; 3] {
        let [x, y, z] = TURNED;
        along(&[(height, x), (radius * angle.cos(), y), (radius * angle.sin(), z)])
    }

    /// Points of the surface from its definition, no further than 0.02 from each other.
    fn surface(shape: &Shape) -> Vec<[f64; 3]> {
        let [x, y, z] = TURNED;
        let even = |count: i32| (0..=count).map(move |i| f64::from(i) / f64::from(count));
        let pairs = |a, b| even(a).flat_map(move |s| even(b).map(move |t| (s, t)));
        match *shape {
            Shape::Plane { .. } => {
                pairs(500, 500).map(|(s, t)| along(&[(10.0 * s - 5.0, y), (10.0 * t - 5.0, z)])).collect()
            }
            Shape::Sphere { radius, .. } => {
                let polar = |s: f64| (radius * (0.5 * TAU * s).cos(), radius * (0.5 * TAU * s).sin());
                pairs(200, 400).map(|(s, t)| turned(polar(s).0, polar(s).1, TAU * t)).collect()
            }
            Shape::Capsule { .. } | Shape::Cylinder { .. } => {
                let (capsule, radius) =
                    if matches!(shape, Shape::Capsule { .. }) { (true, 0.5) } else { (false, 0.6) };
                let side = pairs(120, 300).map(|(s, t)| (1.6 * s - 0.7, radius, TAU * t));
                let ends = pairs(120, 300).flat_map(|(s, t)| {
                    let (bulge, ring) = if capsule { (0.25 * TAU * s).sin_cos() } else { (0.0, s) };
                    let ends = [0.9 + radius * bulge, -0.7 - radius * bulge];
                    ends.map(|height| (height, radius * ring, TAU * t))
                });
                let aside = 0.1;
                side.chain(ends)
                    .map(|(height, ring, angle)| {
                        minus(turned(height, ring, angle), [0, 1, 2].map(|c| -aside * y[c]))
                    })
                    .collect()
            }
            Shape::Box { half_extent, axes, .. } => pairs(100, 100)
                .flat_map(|(s, t)| {
                    let (s, t) = (2.0 * s - 1.0, 2.0 * t - 1.0);
                    [[1.0, s, t], [-1.0, s, t], [s, 1.0, t], [s, -1.0, t], [s, t, 1.0], [s, t, -1.0]]
                })
                .map(|share| along(&[0, 1, 2].map(|k| (share[k] * half_extent[k], axes[k]))))
                .collect(),
            Shape::HalfPipe { radius, .. } => pairs(200, 500)
                .flat_map(|(s, t)| {
                    let (out, down) = ((0.5 * TAU * s).cos() * radius, -(0.5 * TAU * s).sin() * radius);
                    let flat = radius + 4.0 * s;
                    [(out, down), (flat, 0.0), (-flat, 0.0)]
                        .map(|(side, up)| along(&[(side, x), (up, y), (10.0 * t - 5.0, z)]))
                })
                .collect(),
        }
    }

    #[test]
    fn a_distance_is_that_of_the_nearest_point_of_the_surface() {
        for shape in shapes() {
            let surface = surface(&shape);
            for point in &surface {
                assert!(
                    at(&shape, *point).0.abs() < 1e-12,
                    "{shape:?} at {point:?}: {}",
                    at(&shape, *point).0
                );
            }
            for point in points(80) {
                let distance = at(&shape, point).0;
                let nearest = surface.iter().map(|s| norm(minus(point, *s))).fold(f64::INFINITY, f64::min);
                let off = nearest - distance.abs();
                // A sample lies within 0.015 of every point of the surface.
                assert!((-1e-12..0.015).contains(&off), "{shape:?} at {point:?}: {distance}, not {nearest}");
                let hidden = distance.abs() < 1e-6;
                assert!(hidden || is_inside(&shape, point) == (distance < 0.0), "{shape:?} at {point:?}");
            }
        }
    }

    #[test]
    fn a_normal_is_the_gradient_of_its_distance() {
        let step = 1e-6;
        for shape in shapes() {
            let mut kinks = 0;
            for point in points(3000) {
                let normal = at(&shape, point).1;
                assert!((norm(normal) - 1.0).abs() < 1e-14, "{shape:?} at {point:?}: {normal:?}");
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
                let error = norm(minus(slope, normal));
                assert!(error < 1e-6, "{shape:?} at {point:?}: {slope:?}, not {normal:?}");
            }
            assert!(kinks < 3, "{shape:?}: {kinks} of 3000 points on a ridge");
        }
    }

    #[test]
    fn a_distance_changes_by_no_more_than_the_way_gone() {
        for shape in shapes() {
            let all: Vec<_> = points(600).map(|point| (point, at(&shape, point).0)).collect();
            for (i, (a, at_a)) in all.iter().enumerate() {
                for (b, at_b) in &all[..i] {
                    let way = norm(minus(*a, *b));
                    assert!((at_a - at_b).abs() <= way + 1e-12, "{shape:?} from {a:?} to {b:?}");
                }
            }
        }
    }

    #[test]
    fn a_half_pipe_is_continuous_over_its_rims_and_its_axis_plane() {
        let pipe = &shapes()[5];
        let [x, y, z] = TURNED;
        for side in [-2.0, -0.9, -0.5, 0.0, 0.3, 0.9, 1.7] {
            let near = |height: f64| at(pipe, along(&[(side, x), (height, y), (0.4, z)])).0;
            let [below, on, above] = [near(-1e-9), near(0.0), near(1e-9)];
            assert!(
                (above - on).abs() < 1.1e-9 && (on - below).abs() < 1.1e-9,
                "{side}: {below} {on} {above}"
            );
        }
        // At the rim the flat and the wall meet.
        let rim = at(pipe, along(&[(0.9, x)]));
        assert!(rim.0.abs() < 1e-15, "{rim:?}");
    }

    #[test]
    fn points_with_several_nearest_ones_have_a_finite_distance_and_a_unit_normal() {
        let [x, y, z] = TURNED;
        for shape in shapes() {
            for parts in
                [[(0.0, x), (0.0, y)], [(0.2, x), (0.1, y)], [(0.5, z), (0.0, y)], [(0.0, z), (0.7, y)]]
            {
                let (distance, normal) = at(&shape, along(&parts));
                assert!(distance.is_finite() && (norm(normal) - 1.0).abs() < 1e-14, "{shape:?} {parts:?}");
            }
        }
    }
}
