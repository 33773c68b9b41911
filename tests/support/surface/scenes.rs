//! What scenes of surfaces that keep apart share: settings, colliders, and the cases that they run in.

use nappe_sim::{
    cloth::{Network, SurfaceCheck, SurfaceSettings},
    collide::{
        Collider, Contact, Shape, StartInside,
        shape::{Plane, Sphere},
    },
    linalg::Stop,
    math::Precision,
};

use crate::{Scene, numbering::Numbering};

/// Time step (s).
pub const DT: f64 = 5e-3;

/// Acceleration of gravity (m/s²).
pub const GRAVITY: f64 = 9.81;

/// Where linear solves end: what a scene for pictures asks.
pub const LOOSE: Stop = Stop::Residual { tolerance: 1e-3, max_iterations: 200 };

/// What a scene is run with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// Of positions and velocities.
    pub precision: Precision,
    /// Coefficient of friction of cloth on cloth.
    pub friction: f64,
    /// How its particles are called.
    pub numbering: Numbering,
}

impl Case {
    /// Without friction, in both precisions, each with another numbering.
    pub const SMOOTH: [Self; 2] = [
        Self { precision: Precision::F32, friction: 0.0, numbering: Numbering::AsBuilt },
        Self { precision: Precision::F64, friction: 0.0, numbering: Numbering::Shuffled },
    ];

    /// With friction, likewise.
    pub const ROUGH: [Self; 2] = [
        Self { precision: Precision::F32, friction: 0.3, numbering: Numbering::Reversed },
        Self { precision: Precision::F64, friction: 0.3, numbering: Numbering::AsBuilt },
    ];

    /// Both precisions, without friction and with it, in each numbering.
    pub fn all() -> Vec<Self> {
        let of = |precision| {
            let rubbing =
                move |friction| Numbering::ALL.map(move |numbering| Self { precision, friction, numbering });
            [0.0, 0.3].into_iter().flat_map(rubbing)
        };
        Precision::ALL.into_iter().flat_map(of).collect()
    }
}

/// A scene of a network that keeps a thickness (m), or none, in steps that are accepted or taken again; crossings are counted.
pub fn scene(network: Network, thickness: f64, friction: f64) -> Scene {
    let mut scene = Scene::new(network, DT).under([0.0, -GRAVITY, 0.0]).certified();
    scene.network.thickness = thickness;
    scene.settings.solver.stop = LOOSE;
    scene.settings.contact =
        SurfaceSettings { friction, surface: SurfaceCheck::Count, ..SurfaceSettings::default() };
    scene
}

/// A collider that stands.
fn solid(name: &str, shape: Shape, friction: f64, margin: f64) -> Collider {
    Collider {
        name: name.to_owned(),
        shape,
        velocity: [0.0; 3],
        way: None,
        friction,
        restitution: 0.0,
        margin,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    }
}

/// A level floor at a height (m).
pub fn floor(height: f64, friction: f64, margin: f64) -> Collider {
    wall("floor", [0.0, height, 0.0], [0.0, 1.0, 0.0], friction, margin)
}

/// A plane through a point (m), with its unit normal towards the cloth.
pub fn wall(name: &str, point: [f64; 3], normal: [f64; 3], friction: f64, margin: f64) -> Collider {
    solid(name, Shape::Plane(Plane { point, normal }), friction, margin)
}

/// A ball about a centre, of a radius (m).
pub fn ball(center: [f64; 3], radius: f64, friction: f64, margin: f64) -> Collider {
    solid("ball", Shape::Sphere(Sphere { center, radius }), friction, margin)
}
