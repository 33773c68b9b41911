//! Colliders as triangles: their surfaces at time 0, and of endless ones as much as the scene needs.
//!
//! Enters: shapes that the client has checked, and where the particles are at first (m). Leaves: points (m), and triangles over them,
//! turned outwards.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nappe_client::{Shape, Vectors, components, mesh_points, mesh_triangles, v1};

/// Corners of a circle.
const CORNERS: u32 = 48;
/// Rings of half a ball.
const RINGS: u32 = 12;
/// Half the side of what is shown of an endless surface, over the radius of the scene.
const REACH: f64 = 1.4;
/// How far a camera is from the middle of the scene, over its radius: a lens of 35 mm has all of it then.
const VIEW: f64 = 5.5;
/// The corners of each side of a box, as bits of x, y and z.
const SIDES: [[u32; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// A point or a direction (m or 1).
type Vector = [f64; 3];

/// A ball around the particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scene {
    /// Its centre (m).
    center: Vector,
    /// Its radius (m), above 0.
    radius: f64,
}

impl Scene {
    /// Around these positions (m).
    pub(super) fn around(positions: &Vectors) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in (0..positions.len()).filter_map(|index| positions.get(index)) {
            for axis in 0..3 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        let center = [0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis]));
        let radius = 0.5 * length(minus(high, low));
        if positions.is_empty() {
            Self { center: [0.0; 3], radius: 1.0 }
        } else {
            Self { center, radius: if radius > 0.0 { radius } else { 1.0 } }
        }
    }

    /// A camera that has all of it in view, from above its side.
    pub(super) fn view(&self) -> View {
        let toward: Vector = [0.5, 0.4, 1.0];
        let back = toward.map(|component| component / length(toward));
        let right = cross([0.0, 1.0, 0.0], back);
        let right = right.map(|component| component / length(right));
        let far = VIEW * self.radius;
        View { axes: [right, cross(back, right), back], at: along(self.center, far, back), far }
    }
}

/// Where a camera is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    /// Where its right, its top and its back are.
    pub(super) axes: [Vector; 3],
    /// Its own place (m).
    pub(super) at: Vector,
    /// How far it is from the middle of the scene (m).
    pub(super) far: f64,
}

/// A surface of triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Solid {
    /// Its points at time 0 (m).
    pub(super) points: Vec<Vector>,
    /// Three indices of points each.
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Solid {
    /// The surface of a shape.
    pub(super) fn of(shape: &Shape, scene: &Scene) -> Self {
        match shape {
            Shape::Plane(s) => plane(components(s.point), components(s.normal), scene),
            Shape::Sphere(s) => {
                let center = components(s.center);
                capsule([center, center], s.radius)
            }
            Shape::Capsule(s) => capsule([s.start, s.end].map(components), s.radius),
            Shape::Box(s) => cuboid(s),
            Shape::Cylinder(s) => cylinder([s.start, s.end].map(components), s.radius),
            Shape::HalfPipe(s) => half_pipe(s, scene),
            Shape::Mesh(s) => Self {
                points: mesh_points(s).into_iter().map(|point| point.map(f64::from)).collect(),
                triangles: mesh_triangles(s),
            },
        }
    }

    /// A surface around an axis, from rings with their place along it and their radius (m); closed by a point at either end.
    fn revolved(base: Vector, axis: Vector, ends: [f64; 2], rings: &[[f64; 2]]) -> Self {
        let [first, second] = tangents(axis);
        let mut solid = Self { points: vec![along(base, ends[0], axis)], triangles: Vec::new() };
        for [place, radius] in rings {
            let center = along(base, *place, axis);
            solid.points.extend((0..CORNERS).map(|corner| {
                let (sin, cos) = (TAU * f64::from(corner) / f64::from(CORNERS)).sin_cos();
                along(along(center, radius * cos, first), radius * sin, second)
            }));
        }
        let last = solid.points.len() as u32;
        solid.points.push(along(base, ends[1], axis));

        let at = |ring: u32, corner: u32| 1 + ring * CORNERS + corner % CORNERS;
        let count = rings.len() as u32;
        for corner in 0..CORNERS {
            solid.triangles.push([0, at(0, corner + 1), at(0, corner)]);
            for ring in 1..count {
                let [a, b] = [0, 1].map(|step| at(ring - 1, corner + step));
                let [c, d] = [0, 1].map(|step| at(ring, corner + step));
                solid.triangles.extend([[a, b, c], [b, d, c]]);
            }
            solid.triangles.push([last, at(count - 1, corner), at(count - 1, corner + 1)]);
        }
        solid
    }
}

/// All points within a radius of a segment, which may be a point.
fn capsule([start, end]: [Vector; 2], radius: f64) -> Solid {
    let between = minus(end, start);
    let far = length(between);
    let axis = if far > 0.0 { between.map(|component| component / far) } else { [0.0, 1.0, 0.0] };
    let quarter = |ring: u32| (FRAC_PI_2 * f64::from(ring) / f64::from(RINGS)).sin_cos();
    let mut rings: Vec<[f64; 2]> = Vec::new();
    for ring in 1..=RINGS {
        let (sin, cos) = quarter(ring);
        rings.push([-radius * cos, radius * sin]);
    }
    // The ring in the middle of a ball is one.
    let first = u32::from(far == 0.0);
    for ring in first..RINGS {
        let (sin, cos) = quarter(ring);
        rings.push([far + radius * sin, radius * cos]);
    }
    Solid::revolved(start, axis, [-radius, far + radius], &rings)
}

/// A cylinder with flat ends.
fn cylinder([start, end]: [Vector; 2], radius: f64) -> Solid {
    let between = minus(end, start);
    let far = length(between);
    let axis = between.map(|component| component / far);
    Solid::revolved(start, axis, [0.0, far], &[[0.0, radius], [far, radius]])
}

fn cuboid(shape: &v1::BoxShape) -> Solid {
    let (center, half) = (components(shape.center), components(shape.half_extent));
    let [x, y] = [shape.axis_x, shape.axis_y].map(components);
    let axes = [x, y, cross(x, y)];
    let corner = |bits: u32| {
        (0..3).fold(center, |point, axis| {
            let side = if bits >> axis & 1 == 1 { half[axis] } else { -half[axis] };
            along(point, side, axes[axis])
        })
    };
    Solid {
        points: (0..8).map(corner).collect(),
        triangles: SIDES.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
    }
}

/// A square of a plane, below the middle of the scene.
fn plane(point: Vector, normal: Vector, scene: &Scene) -> Solid {
    let height = dot(minus(scene.center, point), normal);
    let foot = along(scene.center, -height, normal);
    let side = REACH * scene.radius;
    let [first, second] = tangents(normal);
    let corner = |a: f64, b: f64| along(along(foot, a * side, first), b * side, second);
    Solid {
        points: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// The inside of a tube below its axis, along the scene, with a bank on either side.
fn half_pipe(shape: &v1::HalfPipeShape, scene: &Scene) -> Solid {
    let [point, axis, up] = [shape.point, shape.axis, shape.up].map(components);
    let (side, reach, radius) = (cross(up, axis), REACH * scene.radius, shape.radius);
    let middle = along(point, dot(minus(scene.center, point), axis), axis);
    let across = |aside: f64, height: f64| along(along(middle, aside, side), height, up);

    let mut profile = vec![across(radius + reach, 0.0)];
    profile.extend((0..=CORNERS).map(|corner| {
        let (sin, cos) = (PI * f64::from(corner) / f64::from(CORNERS)).sin_cos();
        across(radius * cos, -radius * sin)
    }));
    profile.push(across(-radius - reach, 0.0));

    let last = profile.len() as u32 - 1;
    Solid {
        points: profile
            .into_iter()
            .flat_map(|at| [along(at, -reach, axis), along(at, reach, axis)])
            .collect(),
        triangles: (0..last)
            .flat_map(|part| {
                let [a, b, c, d] = [0, 1, 2, 3].map(|corner| 2 * part + corner);
                [[a, c, b], [c, d, b]]
            })
            .collect(),
    }
}

/// The corners of the box around points (m); of none, the origin twice.
pub(super) fn bounds(points: &[[f32; 3]]) -> [[f32; 3]; 2] {
    let Some(first) = points.first() else { return [[0.0; 3]; 2] };
    points.iter().fold([*first, *first], |[low, high], point| {
        [[0, 1, 2].map(|axis| low[axis].min(point[axis])), [0, 1, 2].map(|axis| high[axis].max(point[axis]))]
    })
}

/// Two unit vectors that make a right-handed frame with a unit vector.
fn tangents(normal: Vector) -> [Vector; 2] {
    // The axis farthest from it, so that the cross product is not small.
    let helper = if normal[1].abs() < 0.9 { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
    let first = cross(helper, normal);
    let far = length(first);
    let first = first.map(|component| component / far);
    [first, cross(normal, first)]
}

/// `a + s b`.
fn along(a: Vector, s: f64, b: Vector) -> Vector {
    [0, 1, 2].map(|axis| a[axis] + s * b[axis])
}

fn minus(a: Vector, b: Vector) -> Vector {
    along(a, -1.0, b)
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn length(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: Scene = Scene { center: [0.5, 1.0, 0.0], radius: 2.0 };

    fn vector([x, y, z]: Vector) -> v1::Vector3 {
        v1::Vector3 { x, y, z }
    }

    /// Volume within a closed surface (m^3), above 0 if it is turned outwards.
    fn volume(solid: &Solid) -> f64 {
        let of = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|point| solid.points[point as usize]);
            dot(a, cross(b, c)) / 6.0
        };
        solid.triangles.iter().map(of).sum()
    }

    #[test]
    fn closed_solids_have_the_volumes_of_their_shapes_and_are_turned_outwards() {
        let radius = 0.5;
        let sphere = Shape::Sphere(v1::SphereShape { center: Some(vector([1.0, 2.0, 3.0])), radius });
        let (start, end) = (Some(vector([0.0, 1.0, 0.0])), Some(vector([2.0, 1.0, 1.0])));
        let capsule = Shape::Capsule(v1::CapsuleShape { start, end, radius });
        let cylinder = Shape::Cylinder(v1::CylinderShape { start, end, radius });
        let cuboid = Shape::Box(v1::BoxShape {
            center: Some(vector([1.0, 0.0, 0.0])),
            half_extent: Some(vector([0.5, 1.0, 1.5])),
            axis_x: Some(vector([0.0, 0.6, 0.8])),
            axis_y: Some(vector([1.0, 0.0, 0.0])),
        });
        let (ball, rod) = (4.0 / 3.0 * PI * radius.powi(3), PI * radius * radius * 5.0_f64.sqrt());
        for (shape, expected) in [(sphere, ball), (capsule, ball + rod), (cylinder, rod), (cuboid, 6.0)] {
            let found = volume(&Solid::of(&shape, &SCENE));
            // A polygon of 48 corners has 0.3 % less area than its circle; 24 rings of a ball lose as much once more.
            assert!(found <= expected * (1.0 + 1e-12) && found > 0.99 * expected, "{shape:?}: {found}");
        }
    }

    #[test]
    fn a_plane_and_a_trough_are_shown_along_the_scene_and_face_what_falls_on_them() {
        let plane = Shape::Plane(v1::PlaneShape {
            point: Some(vector([9.0, -1.0, 9.0])),
            normal: Some(vector([0.0, 1.0, 0.0])),
        });
        let trough = Shape::HalfPipe(v1::HalfPipeShape {
            point: Some(vector([0.0, 0.0, 7.0])),
            axis: Some(vector([0.0, 0.0, 1.0])),
            up: Some(vector([0.0, 1.0, 0.0])),
            radius: 1.0,
        });
        for (shape, low) in [(plane, -1.0), (trough, -1.0)] {
            let Solid { points, triangles } = Solid::of(&shape, &SCENE);
            let least = points.iter().map(|point| point[1]).fold(f64::INFINITY, f64::min);
            assert!((least - low).abs() < 1e-12, "{shape:?}: {least}");
            let along_z = points.iter().map(|point| point[2].abs()).fold(0.0, f64::max);
            assert!((along_z - 2.8).abs() < 1e-12, "{shape:?}: {along_z}");
            for corners in triangles {
                let [a, b, c] = corners.map(|point| points[point as usize]);
                let normal = cross(minus(b, a), minus(c, a));
                // What falls comes from above the plane, and from above the trough's axis.
                let middle = [0, 1, 2].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0);
                let free = [-middle[0], 1.0 - middle[1], 0.0];
                assert!(dot(normal, free) > 0.0, "{shape:?}: {corners:?}");
            }
        }
    }

    #[test]
    fn the_scene_is_around_the_particles_also_around_none() {
        let scene = Scene::around(&Vectors::F64(vec![0.0, 0.0, 0.0, 2.0, 0.0, 0.0]));
        assert_eq!(scene, Scene { center: [1.0, 0.0, 0.0], radius: 1.0 });
        for positions in [vec![], vec![3.0, 4.0, 5.0]] {
            assert_eq!(Scene::around(&Vectors::F32(positions)).radius, 1.0);
        }
    }
}
