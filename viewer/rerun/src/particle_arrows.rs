//! Forces on particles, and their accelerations, to Rerun: an arrow at each particle, or at every second, third ... of many.
//!
//! Enters: the radius of the scene (m), then frames. Leaves: arrows of what frames hold. Their scale grows with the greatest that
//! was seen so far in the recording, so that frames can be compared.

use nappe_client::{Frame, Vectors};

use crate::{
    error::{RerunError, refused},
    geometry::length,
    sdk::{Arrows3D, Color, Radius, RecordingStream},
};

/// Length of the arrow of the greatest so far over the radius of the scene.
const LENGTH: f32 = 0.2;
/// Radius of arrows over the radius of the scene.
const RADIUS: f32 = 0.002;
/// Arrows of a kind in a frame, at most.
const MOST: usize = 20_000;

/// What is shown as arrows.
struct Kind {
    path: &'static str,
    color: [u8; 3],
    of: fn(&Frame) -> Option<&Vectors>,
}

const KINDS: [Kind; 2] = [
    Kind { path: "world/particles/force", color: [226, 176, 84], of: |frame| frame.forces.as_ref() },
    Kind {
        path: "world/particles/acceleration",
        color: [110, 168, 220],
        of: |frame| frame.accelerations.as_ref(),
    },
];

/// The arrows of a recording.
#[derive(Debug)]
pub(crate) struct ParticleArrows {
    /// The radius of the scene (m).
    scene_radius: f32,
    /// The greatest of each kind so far.
    greatest: [f32; KINDS.len()],
}

impl ParticleArrows {
    /// Arrows in a scene of a radius (m).
    pub(crate) fn new(scene_radius: f32) -> Self {
        Self { scene_radius, greatest: [0.0; KINDS.len()] }
    }

    /// Logs what a frame holds, at the stream's current time, where particles are (m). What is not finite has no arrow.
    pub(crate) fn log(
        &mut self,
        stream: &RecordingStream,
        points: &[[f32; 3]],
        frame: &Frame,
    ) -> Result<(), RerunError> {
        for (kind, greatest) in KINDS.iter().zip(&mut self.greatest) {
            let Some(vectors) = (kind.of)(frame).filter(|vectors| vectors.len() == points.len()) else {
                continue;
            };
            let flat = vectors.to_f32();
            let (vectors, _) = flat.as_chunks::<3>();
            let drawn = arrows(points, vectors);
            *greatest = drawn.iter().map(|(_, vector)| length(*vector)).fold(*greatest, f32::max);
            let scale = if *greatest > 0.0 { LENGTH * self.scene_radius / *greatest } else { 0.0 };

            let [red, green, blue] = kind.color;
            let shown = Arrows3D::from_vectors(drawn.iter().map(|(_, vector)| vector.map(|c| scale * c)))
                .with_origins(drawn.iter().map(|(point, _)| *point))
                .with_radii([Radius::new_scene_units(RADIUS * self.scene_radius)])
                .with_colors([Color::from_rgb(red, green, blue)]);
            stream.log(kind.path, &shown).map_err(refused(kind.path))?;
        }
        Ok(())
    }
}

/// Where arrows begin, and what they show: of so many particles that there are not too many arrows.
fn arrows(points: &[[f32; 3]], vectors: &[[f32; 3]]) -> Vec<([f32; 3], [f32; 3])> {
    let every = points.len().div_ceil(MOST).max(1);
    let all = points.iter().copied().zip(vectors.iter().copied());
    all.step_by(every).filter(|(_, vector)| length(*vector).is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_never_too_many_arrows_and_none_of_what_is_no_number() {
        for (count, expected) in [(0, 0), (5, 5), (MOST, MOST), (MOST + 1, MOST / 2 + 1), (5 * MOST, MOST)] {
            let points = vec![[0.0; 3]; count];
            assert_eq!(arrows(&points, &points).len(), expected, "{count}");
        }
        let vectors = [[0.0, f32::NAN, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, f32::INFINITY]];
        assert_eq!(arrows(&[[2.0; 3]; 3], &vectors), [([2.0; 3], [1.0, 0.0, 0.0])]);
    }
}
