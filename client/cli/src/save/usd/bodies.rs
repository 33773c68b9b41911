//! Bodies as prims of USD: cloth as a mesh, snow as points, springs of a body without triangles as curves.
//!
//! Enters: bodies, then frames. Leaves: lines of text that stay, and arrays by time.

use std::ops::Range;

use nappe_client::{Body, Field, Fields, Frame, Scalars, Vectors};
use nappe_scene::mesh::{usda_numbers, usda_vectors};

use crate::save::solids::bounds;

/// Width of a curve over the extent of its body.
const CURVE: f32 = 0.004;
/// Width (m) of a point where all are at one place.
const ALONE: f64 = 0.01;

/// An array that frames bring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Array {
    /// Positions (m).
    Points,
    /// Velocities (m/s).
    Velocities,
    /// The box around the points and their width (m).
    Extent,
    /// Plastic ratio J_P of snow.
    PlasticRatio,
    /// Norm of the stress of snow (Pa).
    StressNorm,
    /// Forces (N).
    Force,
    /// Accelerations (m/s²).
    Acceleration,
}

impl Array {
    /// Type and name of its attribute.
    pub(super) const fn declared(self) -> &'static str {
        match self {
            Self::Points => "point3f[] points",
            Self::Velocities => "vector3f[] velocities",
            Self::Extent => "float3[] extent",
            Self::PlasticRatio => "float[] primvars:plasticRatio",
            Self::StressNorm => "float[] primvars:stressNorm",
            Self::Force => "vector3f[] primvars:force",
            Self::Acceleration => "vector3f[] primvars:acceleration",
        }
    }

    /// Whether its attribute has to say that it has a number of each point.
    pub(super) const fn is_primvar(self) -> bool {
        matches!(self, Self::PlasticRatio | Self::StressNorm | Self::Force | Self::Acceleration)
    }
}

/// A body as it is drawn.
pub(super) struct Prim {
    /// Its name in the scene.
    pub(super) name: String,
    /// The type of its prim.
    pub(super) kind: &'static str,
    /// Attributes that stay, a line each.
    pub(super) lines: Vec<String>,
    /// What frames bring of it.
    pub(super) arrays: Vec<Array>,
    particles: Range<usize>,
    /// The particles whose numbers it has, where they are not its own in their order: the ends of springs.
    ends: Vec<u32>,
    /// Half of the width of a point or a curve (m).
    reach: f32,
}

impl Prim {
    /// A body, as the first frame shows it, with these arrays, some of which are of snow alone.
    pub(super) fn of(body: &Body, frame: &Frame, fields: Fields) -> Self {
        let mut prim = Self {
            name: body.name.clone(),
            kind: "Points",
            lines: Vec::new(),
            arrays: vec![Array::Points, Array::Velocities, Array::Extent],
            particles: body.first_particle..body.first_particle + body.particle_count,
            ends: Vec::new(),
            reach: 0.0,
        };
        match (body.triangles.is_empty(), body.springs.is_empty()) {
            (false, _) => prim.mesh(body),
            (true, false) => prim.curves(body, frame),
            (true, true) => prim.points(frame, fields),
        }
        let kept = [(Field::Forces, Array::Force), (Field::Accelerations, Array::Acceleration)];
        let kept = kept.into_iter().filter(|(field, _)| fields.contains(*field));
        prim.arrays.extend(kept.map(|(_, array)| array));
        if let Some(color) = body.color {
            let color = color.map(|part| linear(f64::from(part) / 255.0) as f32);
            prim.lines.push(format!("color3f[] primvars:displayColor = {}", usda_vectors(&[color])));
        }
        prim
    }

    /// The array in a frame.
    pub(super) fn sample(&self, array: Array, frame: &Frame) -> String {
        let vectors = |vectors: Option<&Vectors>| {
            let flat = vectors.map(Vectors::to_f32).unwrap_or_default();
            usda_vectors(&self.own(flat.as_chunks::<3>().0))
        };
        let numbers = |numbers: Option<&Scalars>| {
            let flat = numbers.map(Scalars::to_f32).unwrap_or_default();
            usda_numbers(&self.own(&flat))
        };
        match array {
            Array::Points => vectors(Some(&frame.positions)),
            Array::Velocities => vectors(frame.velocities.as_ref()),
            Array::Extent => {
                let [low, high] = bounds(&self.positions(frame));
                usda_vectors(&[low.map(|low| low - self.reach), high.map(|high| high + self.reach)])
            }
            Array::PlasticRatio => numbers(frame.plastic_ratios.as_ref()),
            Array::StressNorm => numbers(frame.stress_norms.as_ref()),
            Array::Force => vectors(frame.forces.as_ref()),
            Array::Acceleration => vectors(frame.accelerations.as_ref()),
        }
    }

    /// What of an array over all particles is its own.
    fn own<T: Copy>(&self, all: &[T]) -> Vec<T> {
        if self.ends.is_empty() {
            all.get(self.particles.clone()).unwrap_or_default().to_vec()
        } else {
            self.ends.iter().filter_map(|end| all.get(*end as usize).copied()).collect()
        }
    }

    fn positions(&self, frame: &Frame) -> Vec<[f32; 3]> {
        self.own(frame.positions.to_f32().as_chunks::<3>().0)
    }

    fn mesh(&mut self, body: &Body) {
        let first = self.particles.start as u32;
        let corners: Vec<u32> = body.triangles.as_flattened().iter().map(|point| point - first).collect();
        self.kind = "Mesh";
        self.lines = vec![
            "uniform bool doubleSided = 1".to_owned(),
            "uniform token subdivisionScheme = \"none\"".to_owned(),
            format!("int[] faceVertexCounts = {}", usda_numbers(&vec![3; body.triangles.len()])),
            format!("int[] faceVertexIndices = {}", usda_numbers(&corners)),
        ];
        if !body.uv.is_empty() {
            let uv = usda_vectors(&body.uv);
            self.lines.push(format!("texCoord2f[] primvars:st = {uv} {}", of_each("vertex")));
        }
    }

    fn curves(&mut self, body: &Body, frame: &Frame) {
        self.ends = body.springs.as_flattened().to_vec();
        let [low, high] = bounds(&self.positions(frame));
        let far = [0, 1, 2].map(|axis| high[axis] - low[axis]).into_iter().fold(0.0, f32::max);
        self.kind = "BasisCurves";
        self.lines = vec![
            "uniform token type = \"linear\"".to_owned(),
            format!("int[] curveVertexCounts = {}", usda_numbers(&vec![2; body.springs.len()])),
        ];
        self.widen(CURVE * far);
    }

    fn points(&mut self, frame: &Frame, fields: Fields) {
        let points = self.positions(frame);
        let [low, high] = bounds(&points);
        let sides = [0, 1, 2].map(|axis| f64::from(high[axis]) - f64::from(low[axis]));
        // As large as what a particle has of the box around all of them.
        let share = sides.iter().product::<f64>() / points.len().max(1) as f64;
        let ids: Vec<usize> = (0..points.len()).collect();
        self.lines = vec![format!("int64[] ids = {}", usda_numbers(&ids))];
        let far = sides.into_iter().fold(0.0, f64::max);
        // Of particles in one plane, along a line or at one point the box is empty.
        let width = if share > 0.0 { share.cbrt() } else { far / (points.len().max(1) as f64).sqrt() };
        self.widen((if width > 0.0 { width } else { ALONE }) as f32);
        let kept = [(Field::PlasticRatios, Array::PlasticRatio), (Field::StressNorms, Array::StressNorm)];
        let kept = kept.into_iter().filter(|(field, _)| fields.contains(*field));
        self.arrays.extend(kept.map(|(_, array)| array));
    }

    /// Gives points or curves a width (m).
    fn widen(&mut self, width: f32) {
        self.reach = 0.5 * width;
        self.lines.push(format!("float[] widths = {} {}", usda_numbers(&[width]), of_each("constant")));
    }
}

/// What an attribute says of how many numbers it has.
pub(super) fn of_each(interpolation: &str) -> String {
    format!("(interpolation = \"{interpolation}\")")
}

/// A part of a colour of sRGB, as USD has colours: proportional to light.
fn linear(part: f64) -> f64 {
    if part <= 0.040_45 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) }
}
