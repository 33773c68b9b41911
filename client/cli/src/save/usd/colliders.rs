//! Colliders as prims of USD: what each is around its own origin, and a matrix that says where it is.
//!
//! Enters: colliders, then frames. Leaves: lines of text, and matrices by time (m).

use nappe_client::{Collider, ColliderPose, Frame, Shape, components};
use nappe_scene::mesh::{usda_numbers, usda_vectors};

use crate::save::solids::{Scene, Solid, bounds};

/// The axes of what is not turned.
const WORLD: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// The turn of what is not turned.
const NO_TURN: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// A collider as it is drawn.
pub(super) struct Drawn {
    /// Its name in the scene.
    pub(super) name: String,
    /// The type of its prim.
    pub(super) kind: &'static str,
    /// Its attributes around its reference point, a line each.
    pub(super) lines: Vec<String>,
    /// Its reference point at time 0 (m).
    reference: [f64; 3],
    /// Its velocity (m/s), unless frames have a pose of it.
    velocity: [f64; 3],
    /// Where its own axes point at time 0, with the length of its unit.
    axes: [[f64; 3]; 3],
}

impl Drawn {
    /// A collider, unless its shape is newer than this program.
    pub(super) fn of(collider: &Collider, scene: &Scene) -> Option<Self> {
        let (shape, reference) = (collider.shape.as_ref()?, collider.reference()?);
        let mut drawn = Self {
            name: collider.name.clone(),
            kind: "Mesh",
            lines: Vec::new(),
            reference,
            velocity: collider.velocity,
            axes: WORLD,
        };
        match shape {
            Shape::Sphere(s) => drawn.round("Sphere", s.radius, None),
            Shape::Capsule(s) => drawn.round("Capsule", s.radius, Some([s.start, s.end].map(components))),
            Shape::Cylinder(s) => drawn.round("Cylinder", s.radius, Some([s.start, s.end].map(components))),
            Shape::Box(s) => {
                let [half, x, y] = [s.half_extent, s.axis_x, s.axis_y].map(components);
                let axes = [x, y, cross(x, y)];
                drawn.kind = "Cube";
                drawn.axes = [0, 1, 2].map(|axis| axes[axis].map(|component| half[axis] * component));
                drawn.lines = vec!["double size = 2".to_owned(), extent([1.0; 3])];
            }
            Shape::Plane(_) | Shape::HalfPipe(_) | Shape::Mesh(_) => drawn.mesh(&Solid::of(shape, scene)),
        }
        Some(drawn)
    }

    /// A round solid, along a segment if there is one.
    fn round(&mut self, kind: &'static str, radius: f64, segment: Option<[[f64; 3]; 2]>) {
        self.kind = kind;
        self.lines = vec![format!("double radius = {radius:?}")];
        let Some([start, end]) = segment else {
            self.lines.push(extent([radius; 3]));
            return;
        };
        let between = [0, 1, 2].map(|axis| end[axis] - start[axis]);
        let height = between.iter().map(|component| component * component).sum::<f64>().sqrt();
        if height > 0.0 {
            self.axes = along_y(between.map(|component| component / height));
        }
        let cap = if kind == "Capsule" { radius } else { 0.0 };
        self.lines.push(format!("double height = {height:?}"));
        self.lines.push("uniform token axis = \"Y\"".to_owned());
        self.lines.push(extent([radius, 0.5 * height + cap, radius]));
    }

    /// A surface of triangles, around the reference point.
    fn mesh(&mut self, solid: &Solid) {
        let own = |point: &[f64; 3]| [0, 1, 2].map(|axis| (point[axis] - self.reference[axis]) as f32);
        let points: Vec<[f32; 3]> = solid.points.iter().map(own).collect();
        self.lines = vec![
            "uniform bool doubleSided = 1".to_owned(),
            "uniform token subdivisionScheme = \"none\"".to_owned(),
            format!("int[] faceVertexCounts = {}", usda_numbers(&vec![3; solid.triangles.len()])),
            format!("int[] faceVertexIndices = {}", usda_numbers(solid.triangles.as_flattened())),
            format!("point3f[] points = {}", usda_vectors(&points)),
            format!("float3[] extent = {}", usda_vectors(&bounds(&points))),
        ];
    }

    /// Its matrix in a frame: where its axes point, a row each, and where its reference point is (m).
    pub(super) fn matrix(&self, frame: &Frame) -> String {
        let still = || ColliderPose {
            name: String::new(),
            position: [0, 1, 2].map(|axis| self.reference[axis] + frame.time * self.velocity[axis]),
            turn: NO_TURN,
        };
        let pose = frame.pose(&self.name).cloned().unwrap_or_else(still);
        let [x, y, z] = self.axes.map(|axis| pose.turned(axis));
        matrix([x, y, z], pose.position)
    }
}

/// A matrix as USD has it: the axes of what it places, a row each, and where that is.
pub(super) fn matrix([x, y, z]: [[f64; 3]; 3], at: [f64; 3]) -> String {
    let row = |[a, b, c]: [f64; 3], last: f64| [a, b, c, last];
    let rows = usda_vectors(&[row(x, 0.0), row(y, 0.0), row(z, 0.0), row(at, 1.0)]);
    // A matrix is a tuple of tuples.
    format!("({})", &rows[1..rows.len() - 1])
}

/// The extent of what reaches so far from its origin along each axis.
fn extent(half: [f64; 3]) -> String {
    let half = half.map(|reach| reach as f32);
    format!("float3[] extent = {}", usda_vectors(&[half.map(|reach| -reach), half]))
}

/// Axes that make a right-handed frame, the second along a unit vector.
fn along_y(y: [f64; 3]) -> [[f64; 3]; 3] {
    // The axis farthest from it, so that the cross product is not small.
    let helper = if y[1].abs() < 0.9 { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
    let x = cross(y, helper);
    let far = x.iter().map(|component| component * component).sum::<f64>().sqrt();
    let x = x.map(|component| component / far);
    [x, y, cross(x, y)]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
