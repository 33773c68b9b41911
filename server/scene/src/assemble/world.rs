//! The world of a scene: its bodies, its snow and its colliders, with every error that they have.

use nappe_sim::{
    cloth::RestSettings,
    collide::{Bounds, Collider},
    math::{four_digits, number},
    world::{BodySetup, Change, WorldSetup},
};

use super::{
    body::{self, BodyText},
    collider::{self, ColliderSolid},
    figure,
    inside::Solid,
    meshes::MeshSource,
    names,
    size::{SceneLimits, Size},
    snow, thickness,
};
use crate::{
    error::{Found, SceneError, SceneErrors},
    location::Location,
    scene::Scene,
    schema::SPEED,
};

/// A scene ready to be simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct Built {
    /// What the simulation is built from.
    pub setup: WorldSetup,
    /// Changes before the first step: moving pins.
    pub initial_changes: Vec<Change>,
    /// What became of the meshes of colliders, in the order of the scene.
    pub collider_solids: Vec<ColliderSolid>,
    /// What is odd and does not stop a simulation.
    pub warnings: Vec<String>,
}

impl Scene {
    /// Builds the world of the scene.
    ///
    /// # Errors
    /// Every key that does not fit, with its position where the scene was read from a text.
    pub fn build(&self, meshes: &dyn MeshSource, limits: &SceneLimits) -> Result<Built, SceneErrors> {
        self.check()?;
        let root = Location::root(&self.source);
        let (mut found, mut warnings) = (Found::default(), self.warnings());
        names::check(self, &root, &mut found);
        found.take(check_wind(self, &root));

        let contact = self.contact.unwrap_or_default();
        let rest = found.take(rest_settings(self, &root)).flatten();
        let mut size = Size::new(limits);
        let (list, mut solids, mut collider_solids) = (root.key("collider"), Vec::new(), Vec::new());
        for (i, text) in self.colliders.iter().enumerate() {
            let at = list.index(i);
            let Some(made) = found.take(collider::build(text, &at, meshes, &mut size)) else { continue };
            warnings
                .extend(made.warnings.iter().map(|warning| format!("collider '{}': {warning}", text.name)));
            collider_solids.extend(made.solid);
            solids.push(Solid { collider: made.collider, at });
        }

        let (mut bodies, mut initial_changes) = (Vec::new(), Vec::new());
        for (i, body) in self.bodies.iter().enumerate() {
            let at = root.key("body").index(i);
            let text = BodyText { body, at, dt: self.dt, contact, rest, solids: &solids };
            let Some(made) = found.take(body::build(&text, meshes, &mut size)) else { continue };
            initial_changes.extend(made.changes);
            warnings.extend(made.warnings.iter().map(|warning| format!("body '{}': {warning}", body.name)));
            bodies.push(made.setup);
        }
        warnings.extend(thickness::warnings(&bodies, &solids, contact));
        warnings.extend(figure::warnings(self));
        add_figures(self, &root, &mut bodies, (meshes, &mut size), &mut found);

        let at = root.key("snow");
        let snow = self.snow.as_ref().and_then(|text| {
            snow::build(text, &at, &solids, meshes, &mut size, &mut found).map(|(snow, odd)| {
                warnings.extend(odd);
                snow
            })
        });

        if snow.is_some() && !bodies.is_empty() {
            warnings.push("cloth and snow pass through each other: they are not coupled yet".to_owned());
        }

        let (colliders, places): (Vec<_>, Vec<_>) =
            solids.into_iter().map(|solid| (solid.collider, solid.at)).unzip();
        let Self { dt, gravity, wind, .. } = *self;
        let wind_at = self.wind_at.iter().map(|key| (key.time, key.velocity)).collect();
        let setup = WorldSetup { dt, gravity, wind, wind_at, colliders, bodies, snow };
        if let Some(particles) = setup.bounds() {
            for (collider, at) in setup.colliders.iter().zip(&places) {
                found.take(check_surface(collider, at, particles));
            }
        }
        found.or(Built { setup, initial_changes, collider_solids, warnings })
    }
}

/// Builds the figures behind the bodies, stepped as the first of these that has a thickness.
fn add_figures(
    scene: &Scene,
    root: &Location<'_>,
    bodies: &mut Vec<BodySetup>,
    (meshes, size): (&dyn MeshSource, &mut Size<'_>),
    found: &mut Found,
) {
    let list = root.key("figure");
    found.take(figure::check_met(scene, &list.index(0)));
    // Of a body that was refused, an error is there already.
    let Some(like) = bodies.iter().find(|body| body.network.thickness > 0.0) else { return };
    let mut made = Vec::new();
    for (i, text) in scene.figures.iter().enumerate() {
        made.extend(found.take(figure::build(text, &list.index(i), like, meshes, (&mut *size, scene.dt))));
    }
    bodies.extend(made);
}

/// No part of a surface that particles can meet is too fast on its way from key to key.
fn check_surface(collider: &Collider, at: &Location<'_>, particles: Bounds) -> Result<(), SceneError> {
    let Some((key, speed)) = collider.too_fast(particles) else { return Ok(()) };
    let (name, before, speed, most) = (&collider.name, key - 1, four_digits(speed), number(SPEED.1));
    let message = format!(
        "from key {before} to key {key} the surface of collider '{name}' has up to {speed} m/s where particles can meet it; \
         allowed: at most {most} m/s"
    );
    at.key("key").index(key).key("turn").inconsistent(message)
}

/// When cloth counts as calm, if the scene says so.
fn rest_settings(scene: &Scene, root: &Location<'_>) -> Result<Option<RestSettings>, SceneError> {
    let Some(rest) = scene.rest else { return Ok(None) };
    let at = root.key("rest");
    if scene.bodies.is_empty() {
        return at.inconsistent("is for cloth, and the scene has snow alone");
    }
    let lasts = (scene.steps > 0).then_some(scene.steps as f64 * scene.dt);
    rest.settings(lasts, &at).map(Some)
}

/// Keys of the wind grow in time, and stand alone.
fn check_wind(scene: &Scene, root: &Location<'_>) -> Result<(), SceneError> {
    let (keys, at) = (&scene.wind_at, root.key("wind_at"));
    if !keys.is_empty() && scene.wind != [0.0; 3] {
        return root.key("wind").inconsistent("does not go with wind_at, which says the wind at all times");
    }
    match (1..keys.len()).find(|i| keys[*i].time <= keys[i - 1].time) {
        Some(i) => {
            let (time, before) = (keys[i].time, keys[i - 1].time);
            let message = format!("is {time}: times grow, and the key before it is at {before} s");
            at.index(i).key("time").inconsistent(message)
        }
        None => Ok(()),
    }
}
