//! A scene to a world: checks, meshes, bodies, colliders, first changes.
//!
//! Reads a [`Scene`] and what a [`MeshSource`] gives; writes a [`WorldSetup`] for the simulation.

mod body;
mod mass;
mod pins;
mod size;
mod transform;

use std::{collections::BTreeSet, sync::Arc};

use nappe_sim::{
    collide::{Collider, Contact, Shape},
    mesh::TriangleMesh,
    world::{Change, WorldSetup},
};

use crate::{
    error::{Fault, SceneError},
    scene::{ColliderText, Scene, ShapeText},
    source::Path,
};

/// What a caller lets one scene hold, checked before memory is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneLimits {
    /// Particles of all bodies.
    pub max_particles: u64,
    /// Springs of all bodies.
    pub max_springs: u64,
}

impl Default for SceneLimits {
    /// 4 million particles and 32 million springs: about 3 GiB in f64.
    fn default() -> Self {
        Self { max_particles: 4_000_000, max_springs: 32_000_000 }
    }
}

/// Where a scene's meshes come from.
pub trait MeshSource {
    /// The uploaded mesh with this id.
    fn upload(&self, id: &str) -> Option<Arc<TriangleMesh>>;

    /// The mesh in the file that a scene names.
    ///
    /// # Errors
    /// When files are not allowed here, or this one cannot be read as a mesh.
    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError>;
}

/// No uploads and no files: scenes by formula only.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoMeshes;

impl MeshSource for NoMeshes {
    fn upload(&self, _: &str) -> Option<Arc<TriangleMesh>> {
        None
    }

    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError> {
        Err(SceneError::new(Fault::MeshNotFound, path, "scenes may not name files here: upload the mesh"))
    }
}

/// A scene ready to be simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct Built {
    /// The world.
    pub setup: WorldSetup,
    /// Changes before the first step: moving pins.
    pub initial_changes: Vec<Change>,
    /// What is odd and does not stop a simulation.
    pub remarks: Vec<String>,
}

impl Scene {
    /// Builds the world of the scene.
    ///
    /// # Errors
    /// The first field that does not fit, with its place where the scene was read from a text.
    pub fn build(&self, meshes: &dyn MeshSource, limits: &SceneLimits) -> Result<Built, SceneError> {
        self.check()?;
        self.check_names()?;
        let root = Path::default();
        let mut size = size::Size::new(limits);
        let (mut bodies, mut initial_changes, mut remarks) = (Vec::new(), Vec::new(), Vec::new());
        for (i, body) in self.bodies.iter().enumerate() {
            let context = body::Context { body, path: root.key("body").index(i), source: &self.source };
            let first_particle = size.particles();
            let made = body::build(&context, meshes, &mut size)?;
            let changes = pins::moves(&context, &made, first_particle)?;
            initial_changes.extend(changes);
            remarks.extend(made.remarks.iter().map(|remark| format!("body '{}': {remark}", body.name)));
            bodies.push(made.setup);
        }
        let colliders =
            self.colliders.iter().enumerate().map(|(i, c)| self.collider(i, c)).collect::<Result<_, _>>()?;
        let setup = WorldSetup { dt: self.dt, gravity: self.gravity, wind: self.wind, colliders, bodies, snow: None };
        Ok(Built { setup, initial_changes, remarks })
    }

    fn check_names(&self) -> Result<(), SceneError> {
        let bodies: Vec<&str> = self.bodies.iter().map(|b| b.name.as_str()).collect();
        let colliders: Vec<&str> = self.colliders.iter().map(|c| c.name.as_str()).collect();
        for (list, names) in [("body", bodies), ("collider", colliders)] {
            let mut seen = BTreeSet::new();
            for (i, name) in names.into_iter().enumerate() {
                let path = Path::default().key(list).index(i).key("name");
                if name.trim().is_empty() {
                    return Err(self.source.error(Fault::OutOfRange, &path, "is empty: a name is needed"));
                }
                if !seen.insert(name) {
                    let message = format!("'{name}' is the name of another {list}: names are unique");
                    return Err(self.source.error(Fault::Inconsistent, &path, message));
                }
            }
        }
        Ok(())
    }

    fn collider(&self, index: usize, text: &ColliderText) -> Result<Collider, SceneError> {
        let shape = match text.shape {
            ShapeText::Plane { point, normal } => {
                let length = normal.iter().map(|c| c * c).sum::<f64>().sqrt();
                if length == 0.0 {
                    let path = Path::default().key("collider").index(index).key("plane").key("normal");
                    let message = "is zero: a normal needs a direction";
                    return Err(self.source.error(Fault::OutOfRange, &path, message));
                }
                Shape::Plane { point, normal: normal.map(|c| c / length) }
            }
            ShapeText::Sphere { center, radius } => Shape::Sphere { center, radius },
        };
        Ok(Collider {
            name: text.name.clone(),
            shape,
            velocity: text.velocity,
            friction: text.friction,
            restitution: text.restitution,
            margin: text.margin,
            contact: Contact::default(),
        })
    }
}
