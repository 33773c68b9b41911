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
        /// Half of its extent along its own axes (m).
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

/// What happens to the velocity of snow at a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Contact {
    /// It moves with the surface.
    Sticky,
    /// It neither leaves nor enters the surface; Coulomb friction along it.
    Slip,
    /// It may leave the surface; Coulomb friction along it while pressed on.
    #[default]
    Separating,
}

impl Contact {
    /// Every contact.
    pub const ALL: [Self; 3] = [Self::Sticky, Self::Slip, Self::Separating];

    /// Its name in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sticky => "sticky",
            Self::Slip => "slip",
            Self::Separating => "separating",
        }
    }
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
    /// How snow meets it; cloth always separates.
    pub contact: Contact,
}

impl Collider {
    /// Signed distance (m) of a point from the surface at `time` (s), negative inside, and the
    /// unit outward normal there. At a sphere's centre, where there is none, the normal is +y.
    pub fn distance(&self, point: [f64; 3], time: f64) -> (f64, [f64; 3]) {
        let moved = |start: [f64; 3]| [0, 1, 2].map(|c| point[c] - start[c] - self.velocity[c] * time);
        match self.shape {
            Shape::Plane { point: start, normal } => (dot(moved(start), normal), normal),
            Shape::Sphere { center, radius } => {
                let way = moved(center);
                let length = dot(way, way).sqrt();
                let normal = if length > 0.0 { way.map(|c| c / length) } else { [0.0, 1.0, 0.0] };
                (length - radius, normal)
            }
            Shape::Capsule { .. } | Shape::Box { .. } | Shape::Cylinder { .. } | Shape::HalfPipe { .. } => {
                (f64::INFINITY, [0.0, 1.0, 0.0])
            }
        }
    }

    /// Says what is wrong with the collider's numbers, if anything.
    pub fn fault(&self) -> Option<String> {
        let finite = |v: &[f64; 3]| v.iter().all(|c| c.is_finite());
        if !finite(&self.velocity) {
            return Some(format!("its velocity is not finite: {:?}", self.velocity));
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
        match self.shape {
            Shape::Plane { point, normal } => {
                let unit = finite(&normal) && (dot(normal, normal) - 1.0).abs() < 1e-9;
                (!finite(&point) || !unit).then(|| {
                    format!("point {point:?}, normal {normal:?}: a finite point and a unit normal are needed")
                })
            }
            Shape::Sphere { center, radius } => (!finite(&center) || !radius.is_finite() || radius <= 0.0)
                .then(|| {
                    format!(
                        "centre {center:?}, radius {radius}: a finite centre and a radius above 0 are needed"
                    )
                }),
            Shape::Capsule { .. } | Shape::Box { .. } | Shape::Cylinder { .. } | Shape::HalfPipe { .. } => {
                None
            }
        }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
