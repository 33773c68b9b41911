//! Colliders: closed shapes given by their signed distance.

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
}

/// Something that particles collide with.
#[derive(Clone, Debug, PartialEq)]
pub struct Collider {
    /// Name, for messages and for drawing.
    pub name: String,
    /// Shape at time 0.
    pub shape: Shape,
    /// Velocity (m/s).
    pub velocity: [f64; 3],
    /// Coulomb friction coefficient, 0 or more.
    pub friction: f64,
    /// Share of the normal approach speed that comes back, 0 to 1.
    pub restitution: f64,
    /// Distance (m) from the surface at which a particle touches: half the cloth's thickness.
    pub margin: f64,
}
