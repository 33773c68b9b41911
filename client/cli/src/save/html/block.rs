//! Blocks of an HTML recording: some frames, the first packed alone, each other as what it differs by from the one before.
//!
//! Enters: frames. Leaves: blocks in JSON, as `docs/frames.md` describes them.

use base64::{Engine as _, engine::general_purpose::STANDARD};
use nappe_client::{
    ColliderPose, Frame, Scalars, Vectors,
    packed::{Effort, OutOfRange, Step, pack},
    v1,
};
use serde_json::{Value, json};

use crate::{options::fields::ColorName, words::diagnostics};

/// Frames of a whole block.
pub(super) const FRAMES: usize = 32;
/// Below this, stress has the colour of none (Pa): its logarithm is packed.
const LEAST_STRESS: f32 = 1.0;

/// A block in the making.
#[derive(Debug)]
pub(super) struct Block {
    step: Step,
    color: Option<ColorName>,
    frames: Vec<Value>,
    /// Whole numbers of the frame before, positions and scalars.
    before: Option<(Vec<i32>, Option<Vec<i32>>)>,
}

impl Block {
    /// A block without frames, of positions in multiples of a step (m), and of the numbers that a colour shows.
    pub(super) fn new(step: Step, color: Option<ColorName>) -> Self {
        Self { step, color, frames: Vec::new(), before: None }
    }

    /// The distance of neighbouring positions (m).
    pub(super) fn step(&self) -> Step {
        self.step
    }

    /// Whether it holds no frame.
    pub(super) fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Whether it holds as many frames as a block has.
    pub(super) fn is_whole(&self) -> bool {
        self.frames.len() >= FRAMES
    }

    /// Packs a frame.
    ///
    /// # Errors
    /// When a position is too far from the origin for the step; nothing is added then.
    pub(super) fn add(&mut self, frame: &Frame) -> Result<(), OutOfRange> {
        let positions = match &frame.positions {
            Vectors::F32(numbers) => self.step.quantize(numbers)?,
            Vectors::F64(numbers) => self.step.quantize(numbers)?,
        };
        let scalars = self.color.and_then(|color| scalars(color, frame));
        let scalars = scalars.map(|numbers| quantized(&numbers, scalar_step(self.color)));

        let (base, scalar_base) = match &self.before {
            Some((positions, scalars)) => (Some(positions.as_slice()), scalars.as_deref()),
            None => (None, None),
        };
        let text = |numbers: &[i32], components, base: Option<&[i32]>| {
            STANDARD.encode(pack(numbers, components, base, Effort::Small))
        };
        let mut value = json!({
            "frame": frame.frame,
            "step": frame.step,
            "time": frame.time,
            "positions": text(&positions, 3, base),
            "scalar": scalars.as_deref().map(|numbers| text(numbers, 1, scalar_base)),
            "poses": poses(frame),
        });
        if let Some(members) = value.as_object_mut() {
            members.extend(plotted(frame.diagnostics.as_ref()));
        }
        self.frames.push(value);
        self.before = Some((positions, scalars));
        Ok(())
    }

    /// The block as the file has it.
    pub(super) fn json(&self) -> Value {
        json!({
            "step": self.step.size(),
            "bound": self.step.bound(),
            "scalar_step": self.color.map(|color| scalar_step(Some(color)).size()),
            "frames": self.frames,
        })
    }
}

/// Where colliders are that keys or calls move; nothing where there are none.
fn poses(frame: &Frame) -> Option<Vec<Value>> {
    let pose =
        |pose: &ColliderPose| json!({ "name": pose.name, "position": pose.position, "turn": pose.turn });
    (!frame.poses.is_empty()).then(|| frame.poses.iter().map(pose).collect())
}

/// What the page plots; `null` for what there is not.
fn plotted(step: Option<&v1::Diagnostics>) -> serde_json::Map<String, Value> {
    let of = |number: fn(&v1::Diagnostics) -> Option<f64>| step.and_then(number);
    let numbers = [
        ("kinetic", of(|step| Some(step.kinetic_energy))),
        ("elastic", of(|step| Some(step.elastic_energy))),
        ("gravitational", of(|step| Some(step.gravitational_energy))),
        ("stretch", of(|step| Some(step.max_stretch).filter(|stretch| *stretch > 0.0))),
        ("dt", of(diagnostics::dt_seconds)),
    ];
    numbers.into_iter().map(|(name, number)| (name.to_owned(), json!(number))).collect()
}

/// The numbers that a colour shows: J_P, m/s, or the logarithm of stress in Pa; none if the frame lacks them.
fn scalars(color: ColorName, frame: &Frame) -> Option<Vec<f32>> {
    let flat = |scalars: &Option<Scalars>| scalars.as_ref().map(|scalars| scalars.to_f32().into_owned());
    match color {
        ColorName::PlasticRatio => flat(&frame.plastic_ratios),
        ColorName::Stress => {
            let numbers = flat(&frame.stress_norms)?;
            Some(numbers.into_iter().map(|stress| stress.max(LEAST_STRESS).log10()).collect())
        }
        ColorName::Speed => {
            let velocities = frame.velocities.as_ref()?.to_f32();
            let (vectors, _) = velocities.as_chunks::<3>();
            let speed = |[x, y, z]: &[f32; 3]| (x * x + y * y + z * z).sqrt();
            Some(vectors.iter().map(speed).collect())
        }
        ColorName::Body => None,
    }
}

/// Whole numbers of steps; what is beyond their reach has the colour of the farthest, and what is no number that of 0.
fn quantized(numbers: &[f32], step: Step) -> Vec<i32> {
    let farthest = (step.size() * f64::from(1 << 22)) as f32;
    let within = |number: f32| if number.is_nan() { 0.0 } else { number.clamp(-farthest, farthest) };
    let near: Vec<f32> = numbers.iter().map(|&number| within(number)).collect();
    step.quantize(&near).unwrap_or_default()
}

/// How finely what a colour shows is kept: finer than the eye tells colours apart.
fn scalar_step(color: Option<ColorName>) -> Step {
    let exponent = match color {
        // Of J_P, whose colours change from 0.8 to 1.5, and of decades.
        Some(ColorName::PlasticRatio | ColorName::Stress) => -9,
        // 8 mm/s, up to 65 km/s.
        _ => -7,
    };
    Step::new(exponent).expect("the exponents above lie between the least and the greatest")
}
