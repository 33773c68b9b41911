//! The force on each collider to Rerun: an arrow that pushes the collider, with its newtons beside it.
//!
//! Enters: colliders, the radius of the scene (m), then frames. Leaves: an arrow for each collider that feels a force.
//! Its line goes through the reference point, and its tip is where the collider begins. The scale grows with the greatest
//! force that was seen so far in the recording, so that frames can be compared.

use std::collections::BTreeMap;

use nappe_client::{Frame, v1};

use crate::{
    collider::ColliderView,
    error::{RerunError, refused},
    plots::AMBER,
    sdk::{Arrows3D, Color, Radius, RecordingStream},
};

/// Length of the arrow of the greatest force so far over the radius of the scene.
const LENGTH: f64 = 0.2;
/// Radius of the heads of arrows over the radius of the scene.
const RADIUS: f32 = 0.01;

/// The arrows of a recording.
#[derive(Debug)]
pub(crate) struct ForceArrows {
    /// Of each collider.
    arrows: Vec<Arrow>,
    /// The radius of the scene (m).
    scene_radius: f32,
    /// The greatest force so far (N).
    greatest: f64,
}

#[derive(Debug)]
struct Arrow {
    path: String,
    /// It was drawn: a frame without a force must clear it.
    is_shown: bool,
}

impl ForceArrows {
    /// The arrows of colliders, in a scene of a radius (m).
    pub(crate) fn new(colliders: &[ColliderView], scene_radius: f32) -> Self {
        let arrow = |collider: &ColliderView| Arrow {
            path: format!("world/forces/{}", collider.entity()),
            is_shown: false,
        };
        Self { arrows: colliders.iter().map(arrow).collect(), scene_radius, greatest: 0.0 }
    }

    /// Logs what is the same in all frames.
    pub(crate) fn describe(&self, stream: &RecordingStream) -> Result<(), RerunError> {
        let [red, green, blue] = AMBER;
        let looks = Arrows3D::update_fields()
            .with_radii([Radius::new_scene_units(RADIUS * self.scene_radius)])
            .with_colors([Color::from_rgb(red, green, blue)]);
        for Arrow { path, .. } in &self.arrows {
            stream.log_static(&**path, &looks).map_err(refused(path))?;
        }
        Ok(())
    }

    /// Logs the forces of a frame, on the colliders of [`ForceArrows::new`], at the stream's current time. A force that
    /// is zero, unknown or not finite has no arrow.
    pub(crate) fn log(
        &mut self,
        stream: &RecordingStream,
        colliders: &[ColliderView],
        frame: &Frame,
    ) -> Result<(), RerunError> {
        let loads = frame.diagnostics.iter().flat_map(|diagnostics| &diagnostics.loads);
        let forces: BTreeMap<&str, Force> =
            loads.filter_map(|load| Some((load.name.as_str(), Force::of(load)?))).collect();
        self.greatest = forces.values().map(|force| force.newtons).fold(self.greatest, f64::max);
        let longest = LENGTH * f64::from(self.scene_radius);

        for (arrow, collider) in self.arrows.iter_mut().zip(colliders) {
            let force = forces.get(collider.name());
            if force.is_none() && !arrow.is_shown {
                continue;
            }
            arrow.is_shown = force.is_some();
            let drawn = force.map(|force| {
                let length = force.newtons / self.greatest * longest;
                let vector = force.direction.map(|component| length * component);
                (vector, collider.pushed_at(frame, force.direction))
            });
            let start =
                |(vector, tip): ([f64; 3], [f64; 3])| [0, 1, 2].map(|axis| (tip[axis] - vector[axis]) as f32);
            let shown = Arrows3D::update_fields()
                .with_vectors(drawn.map(|(vector, _)| vector.map(|component| component as f32)))
                .with_origins(drawn.map(start))
                .with_labels(force.map(|force| label(collider.name(), force.newtons)));
            stream.log(&*arrow.path, &shown).map_err(refused(&arrow.path))?;
        }
        Ok(())
    }
}

/// A force that can be drawn.
#[derive(Debug)]
struct Force {
    /// Above 0 (N).
    newtons: f64,
    /// A unit vector.
    direction: [f64; 3],
}

impl Force {
    /// The force of a load; none if it is zero or not finite.
    fn of(load: &v1::ColliderLoad) -> Option<Self> {
        let v1::Vector3 { x, y, z } = load.force?;
        let newtons = x.hypot(y).hypot(z);
        let is_drawn = newtons.is_finite() && newtons > 0.0;
        is_drawn.then(|| Self { newtons, direction: [x, y, z].map(|component| component / newtons) })
    }
}

/// Who feels how much, in three digits.
fn label(name: &str, newtons: f64) -> String {
    if !(1e-3..1e6).contains(&newtons) {
        return format!("{name} {newtons:.2e} N");
    }
    let decimals = (2.0 - newtons.log10().floor()).max(0.0) as usize;
    format!("{name} {newtons:.decimals$} N")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_has_three_digits() {
        for (newtons, expected) in [
            (0.012_34, "box 0.0123 N"),
            (1.5, "box 1.50 N"),
            (98.1, "box 98.1 N"),
            (1234.4, "box 1234 N"),
            (2.5e-7, "box 2.50e-7 N"),
            (3e9, "box 3.00e9 N"),
        ] {
            assert_eq!(label("box", newtons), expected);
        }
    }

    #[test]
    fn what_is_no_force_is_not_drawn() {
        let load = |x| v1::ColliderLoad {
            force: Some(v1::Vector3 { x, y: 0.0, z: 0.0 }),
            ..v1::ColliderLoad::default()
        };
        for x in [0.0, f64::NAN, f64::INFINITY] {
            assert!(Force::of(&load(x)).is_none(), "{x}");
        }
        assert!(Force::of(&v1::ColliderLoad::default()).is_none());
        let force = Force::of(&load(-2.0)).expect("it is one");
        assert_eq!((force.newtons, force.direction), (2.0, [-1.0, 0.0, 0.0]));
    }
}
