//! Shapes of colliders, and what can be wrong with their numbers.
//!
//! Lengths in metres. All of a shape's numbers are binary64, whatever the precision of the state.

/// How far from 1 or 0 the products of unit directions at right angles may be.
const SQUARE: f64 = 1e-9;

/// A shape at time 0; it moves with a constant velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// The half-space on the other side of `normal` from a plane through `point`.
    Plane {
        /// A point of the plane (m).
        point: [f64; 3],
        /// Unit normal, towards the side where particles are.
        normal: [f64; 3],
    },
    /// A ball.
    Sphere {
        /// Centre (m).
        center: [f64; 3],
        /// Radius (m).
        radius: f64,
    },
    /// All points within `radius` of a segment.
    Capsule {
        /// One end of the segment (m).
        start: [f64; 3],
        /// The other end (m).
        end: [f64; 3],
        /// Radius (m).
        radius: f64,
    },
    /// A box.
    Box {
        /// Centre (m).
        center: [f64; 3],
        /// Half of its extent along its own axes (m), above 0.
        half_extent: [f64; 3],
        /// Its own axes in the world: orthonormal, right-handed, one a row.
        axes: [[f64; 3]; 3],
    },
    /// A solid cylinder with flat ends.
    Cylinder {
        /// Centre of one end (m).
        start: [f64; 3],
        /// Centre of the other end (m).
        end: [f64; 3],
        /// Radius (m).
        radius: f64,
    },
    /// The ground below a trough: outside of a tube, below its axis; endless along the axis.
    HalfPipe {
        /// A point of the axis (m).
        point: [f64; 3],
        /// Unit direction of the axis.
        axis: [f64; 3],
        /// Unit direction of the opening, at right angles to the axis.
        up: [f64; 3],
        /// Inner radius (m).
        radius: f64,
    },
}

impl Shape {
    /// Says what is wrong with the shape's numbers, if anything.
    pub(super) fn fault(&self) -> Option<String> {
        match *self {
            Self::Plane { point, normal } => (!finite(&point) || !unit(normal)).then(|| {
                format!("point {point:?}, normal {normal:?}: a finite point and a unit normal are needed")
            }),
            Self::Sphere { center, radius } => (!finite(&center) || !length(radius)).then(|| {
                format!("centre {center:?}, radius {radius}: a finite centre and a radius above 0 are needed")
            }),
            Self::Capsule { start, end, radius } | Self::Cylinder { start, end, radius } => {
                let between = dot(minus(end, start), minus(end, start)).sqrt();
                // The second also refuses ends so close that the square of their distance is lost.
                let apart = length(between) && length(between * between);
                (!finite(&start) || !finite(&end) || !apart || !length(radius)).then(|| {
                    format!(
                        "start {start:?}, end {end:?}, radius {radius}: two finite ends apart from each \
                         other and a radius above 0 are needed"
                    )
                })
            }
            Self::Box { center, half_extent, axes } => {
                if !finite(&center) || !half_extent.into_iter().all(length) {
                    return Some(format!(
                        "centre {center:?}, half extent {half_extent:?}: a finite centre and half extents \
                         above 0 are needed"
                    ));
                }
                (!right_handed(&axes)).then(|| {
                    format!("axes {axes:?}: three unit directions at right angles, right-handed, are needed")
                })
            }
            Self::HalfPipe { point, axis, up, radius } => {
                if !finite(&point) || !length(radius) {
                    return Some(format!(
                        "point {point:?}, radius {radius}: a finite point and a radius above 0 are needed"
                    ));
                }
                let square = unit(axis) && unit(up) && dot(axis, up).abs() < SQUARE;
                (!square).then(|| {
                    format!("axis {axis:?}, up {up:?}: two unit directions at right angles are needed")
                })
            }
        }
    }
}

fn finite(v: &[f64; 3]) -> bool {
    v.iter().all(|c| c.is_finite())
}

/// Whether a number can be a length: finite and above 0.
fn length(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

fn unit(v: [f64; 3]) -> bool {
    (dot(v, v) - 1.0).abs() < SQUARE
}

fn right_handed(axes: &[[f64; 3]; 3]) -> bool {
    let [x, y, z] = *axes;
    let square = [dot(x, y), dot(y, z), dot(z, x)].iter().all(|product| product.abs() < SQUARE);
    unit(x) && unit(y) && unit(z) && square && dot(cross(x, y), z) > 0.0
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| a[c] - b[c])
}

#[cfg(test)]
mod tests {
    use super::Shape;

    const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn brick(center: f64, half: f64, axes: [[f64; 3]; 3]) -> Shape {
        Shape::Box { center: [center; 3], half_extent: [0.5, half, 0.5], axes }
    }

    fn pipe(point: f64, axis: [f64; 3], up: [f64; 3], radius: f64) -> Shape {
        Shape::HalfPipe { point: [point; 3], axis, up, radius }
    }

    /// A capsule and a cylinder, which take the same numbers.
    fn rods(start: f64, end: f64, radius: f64) -> [Shape; 2] {
        let (start, end) = ([start; 3], [end; 3]);
        [Shape::Capsule { start, end, radius }, Shape::Cylinder { start, end, radius }]
    }

    #[test]
    fn sound_shapes_have_no_fault() {
        let turned = [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]];
        let sound = [
            brick(1.0, 2.0, AXES),
            brick(-1.0, 1e-3, turned),
            pipe(0.0, [0.0, 0.0, 1.0], [-0.8, 0.6, 0.0], 4.0),
        ];
        for shape in sound.into_iter().chain(rods(0.0, 1.0, 0.1)) {
            assert_eq!(shape.fault(), None, "{shape:?}");
        }
    }

    #[test]
    fn numbers_that_make_no_shape_are_named() {
        let [x, y, z] = AXES;
        let beside = 1.0 + 2e-9;
        let brick_faults = [
            (brick(f64::NAN, 1.0, AXES), "centre"),
            (brick(0.0, 0.0, AXES), "half extent"),
            (brick(0.0, f64::INFINITY, AXES), "half extent"),
            (brick(0.0, 1.0, [x, y, [0.0, 0.0, -1.0]]), "right-handed"),
            (brick(0.0, 1.0, [x, y, [0.0, 0.0, beside]]), "axes"),
            (brick(0.0, 1.0, [x, y, [0.0, 2e-9, 1.0]]), "axes"),
            (brick(0.0, 1.0, [x, y, [f64::NAN; 3]]), "axes"),
        ];
        let pipe_faults = [
            (pipe(f64::INFINITY, z, y, 1.0), "point"),
            (pipe(0.0, z, y, 0.0), "radius"),
            (pipe(0.0, z, y, f64::NAN), "radius"),
            (pipe(0.0, z, [0.0, 1.0, 2e-9], 1.0), "up"),
            (pipe(0.0, z, z, 1.0), "up"),
            (pipe(0.0, [0.0; 3], y, 1.0), "axis"),
        ];
        let rod_faults =
            [(f64::NAN, 1.0, 1.0), (0.0, 0.0, 1.0), (0.0, f64::INFINITY, 1.0), (0.0, 1e-170, 1.0)]
                .into_iter()
                .chain([0.0, -1.0, f64::NAN, f64::INFINITY].map(|radius| (0.0, 1.0, radius)))
                .flat_map(|(start, end, radius)| rods(start, end, radius))
                .map(|shape| (shape, "ends apart"));
        for (shape, named) in brick_faults.into_iter().chain(pipe_faults).chain(rod_faults) {
            let fault = shape.fault().unwrap_or_else(|| panic!("no fault in {shape:?}"));
            assert!(fault.contains(named), "{shape:?}: {fault}");
        }
    }
}
