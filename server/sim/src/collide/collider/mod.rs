//! Colliders: closed shapes that move, and how particles meet them.

pub(crate) mod moving;

use serde::{Deserialize, Serialize};

use super::{
    motion::{Bounds, Way},
    shape::Shape,
};
use crate::names::names;

/// What happens to the velocity of snow at a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum Contact {
    /// It moves with the surface.
    Sticky,
    /// It neither leaves nor enters the surface; Coulomb friction along it.
    Slip,
    /// It may leave the surface; Coulomb friction along it while pressed on.
    #[default]
    Separating,
}

names!(Contact { Sticky: "sticky", Slip: "slip", Separating: "separating" });

/// What becomes of cloth and snow that begin inside a collider, when a scene is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum StartInside {
    /// They are told in a warning, and begin there.
    #[default]
    Warn,
    /// The scene is refused.
    Refuse,
    /// Cloth is moved out before its springs are made; snow that begins inside is left out.
    Lift,
}

names!(StartInside { Warn: "warn", Refuse: "refuse", Lift: "lift" });

/// Share of a ball's radius that rounding of a distance may take.
const CLEARANCE_ROUNDING: f64 = 1e-9;

/// Something that particles collide with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Collider {
    /// Name, for messages and for drawing.
    pub name: String,
    /// Shape at time 0.
    pub shape: Shape,
    /// Constant velocity of the shape (m/s); 0 of one with a way.
    pub velocity: [f64; 3],
    /// The way that it goes, if it has keys.
    pub way: Option<Way>,
    /// Coulomb friction coefficient, 0 or more.
    pub friction: f64,
    /// Share of the normal approach speed that comes back, 0 to 1.
    pub restitution: f64,
    /// Distance (m) from the surface at which a particle touches: half the cloth's thickness.
    pub margin: f64,
    /// How snow meets it; cloth always separates.
    pub contact: Contact,
    /// Speed (m/s), above 0, at which cloth that is inside at the start of a sub-step is pushed out; it gets no velocity
    /// from that.
    pub recovery: f64,
    /// What becomes of cloth and snow that begin inside. It is read where a scene is built, not by steps.
    pub on_start_inside: StartInside,
}

impl Collider {
    /// Recovery (m/s) of colliders that name none.
    pub const RECOVERY: f64 = 1.0;

    /// Whether no point of a ball comes within the margin of the surface at `time` (s), nor inside.
    pub fn clears(&self, center: [f64; 3], radius: f64, time: f64) -> bool {
        // Distances are exact, so over the ball they change by its radius at most.
        self.distance(center, time).0 > radius * (1.0 + CLEARANCE_ROUNDING) + self.margin
    }

    /// The first key of its way that its surface reaches faster than 1e4 m/s where particles within bounds (m) can meet it,
    /// and that speed (m/s): the speed of the reference point, and that of the turn as far from it as the shape and its margin
    /// reach, but no farther than the corners of those bounds.
    pub fn too_fast(&self, particles: Bounds) -> Option<(usize, f64)> {
        self.way.as_ref()?.too_fast(self.reach(), particles)
    }

    /// How far (m) from its reference point it may meet a particle; infinite of a shape without end.
    pub(crate) fn reach(&self) -> f64 {
        self.shape.reach() + self.margin
    }

    /// Says what is wrong with the collider's numbers, if anything.
    pub fn invalid(&self) -> Option<String> {
        if !self.velocity.iter().all(|v| v.is_finite()) {
            return Some(format!("its velocity is not finite: {:?}", self.velocity));
        }

        if let Some(way) = &self.way {
            if self.velocity != [0.0; 3] {
                return Some("it has both a velocity and a way: one of them is needed".to_owned());
            }
            if let Some(message) = way.invalid() {
                return Some(message);
            }
        }

        for (what, value, high) in [
            ("friction", self.friction, f64::MAX),
            ("restitution", self.restitution, 1.0),
            ("margin", self.margin, f64::MAX),
        ] {
            if !(0.0..=high).contains(&value) {
                let allowed = if high == 1.0 { "from 0 to 1" } else { "from 0" };
                return Some(format!("its {what} is {value}: a finite number {allowed} is needed"));
            }
        }

        if !self.recovery.is_finite() || self.recovery <= 0.0 {
            return Some(format!(
                "its recovery is {}: a finite number of m/s above 0 is needed",
                self.recovery
            ));
        }

        self.shape.invalid()
    }
}

#[cfg(test)]
mod tests {
    use super::{Collider, Contact, Shape, StartInside, Way};
    use crate::collide::shape::Sphere;

    fn colliders() -> Vec<Collider> {
        let collider = |shape| Collider {
            name: "thing".into(),
            shape,
            velocity: [0.4, -1.5, 0.25],
            way: None,
            friction: 0.0,
            restitution: 0.0,
            margin: 0.03,
            contact: Contact::Separating,
            recovery: Collider::RECOVERY,
            on_start_inside: StartInside::Warn,
        };

        Shape::examples().into_iter().map(collider).collect()
    }

    /// Points of a lattice over a cube of edge `2 half`.
    fn lattice(half: f64, side: i32) -> impl Iterator<Item = [f64; 3]> {
        let step = 2.0 * half / f64::from(side - 1);
        (0..side.pow(3))
            .map(move |i| [i % side, i / side % side, i / side / side].map(|c| f64::from(c) * step - half))
    }

    #[test]
    fn a_shape_takes_its_distances_along() {
        let time = 1.7;
        for collider in colliders() {
            assert_eq!(collider.invalid(), None);
            for point in lattice(1.017, 6) {
                let moved = [0, 1, 2].map(|c| point[c] + collider.velocity[c] * time);
                let [(before, way_before), (after, way_after)] =
                    [collider.distance(point, 0.0), collider.distance(moved, time)];
                assert!((before - after).abs() < 1e-14, "{:?} {point:?}: {before} {after}", collider.shape);
                for c in 0..3 {
                    assert!((way_before[c] - way_after[c]).abs() < 1e-13, "{:?} {point:?}", collider.shape);
                }
            }
        }
    }

    #[test]
    fn a_ball_that_is_clear_has_no_point_within_the_margin() {
        let (time, radius) = (0.3, 0.4);
        for collider in colliders() {
            let (mut clear, mut near) = (0, 0);
            for center in lattice(1.5, 7) {
                let ball =
                    lattice(radius, 9).filter(|p| p.iter().map(|c| c * c).sum::<f64>() <= radius * radius);
                let nearest = ball
                    .map(|p| collider.distance([0, 1, 2].map(|c| center[c] + p[c]), time).0)
                    .fold(f64::INFINITY, f64::min);
                if collider.clears(center, radius, time) {
                    clear += 1;
                    assert!(nearest > collider.margin, "{:?} {center:?}: {nearest}", collider.shape);
                } else {
                    near += 1;

                    // The lattice's spacing is 0.1: a nearer point may be half a cell's diagonal away.
                    assert!(nearest < collider.margin + 0.1, "{:?} {center:?}: {nearest}", collider.shape);
                }
            }

            assert!(clear > 10 && near > 10, "{:?}: {clear} clear, {near} near", collider.shape);
            assert!(!collider.clears([f64::NAN; 3], radius, time), "what is not a place is not clear");
        }
    }

    #[test]
    fn numbers_that_a_collider_cannot_have_are_named() {
        type Spoil = fn(&mut Collider);
        let invalid: [(Spoil, &str); 9] = [
            (|c| c.velocity[1] = f64::NAN, "velocity"),
            (|c| c.way = Some(Way { keys: Vec::new() }), "velocity and a way"),
            (|c| c.friction = -0.1, "friction"),
            (|c| c.restitution = 1.1, "restitution"),
            (|c| c.margin = f64::INFINITY, "margin"),
            (|c| c.recovery = 0.0, "recovery"),
            (|c| c.recovery = f64::INFINITY, "recovery"),
            (|c| c.recovery = f64::NAN, "recovery"),
            (|c| c.shape = Sphere { center: [0.0; 3], radius: 0.0 }.into(), "radius"),
        ];
        for (spoil, named) in invalid {
            let mut collider = colliders().remove(0);
            spoil(&mut collider);
            let message = collider.invalid().expect("it is invalid");
            assert!(message.contains(named), "{message}");
        }
    }
}
