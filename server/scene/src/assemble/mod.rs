//! A scene to a world: checks, meshes, bodies, snow, colliders, first changes.
//!
//! Reads a [`Scene`] and what a [`MeshSource`] gives; writes a [`WorldSetup`] for the simulation.

mod size;
mod transform;
mod body;
mod mass;
mod pins;
mod collider;
mod snow;

use std::{collections::BTreeMap, sync::Arc};

use nappe_sim::{
    mesh::TriangleMesh,
    world::{Change, WorldSetup},
};

use crate::{
    error::{Fault, SceneError},
    scene::Scene,
    source::Path,
};

/// What a caller lets one scene hold, checked before memory is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneLimits {
    /// Particles of all bodies and of snow.
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
        let snow = match &self.snow {
            Some(text) => {
                let (snow, odd) = snow::build(text, &self.source, meshes, &mut size)?;
                remarks.extend(odd);
                Some(snow)
            }
            None => None,
        };
        if snow.is_some() && !bodies.is_empty() {
            remarks.push("cloth and snow pass through each other: they are not coupled yet".to_owned());
        }
        let collider = |(i, text)| collider::build(text, &root.key("collider").index(i), &self.source);
        let colliders = self.colliders.iter().enumerate().map(collider).collect::<Result<_, _>>()?;
        let setup =
            WorldSetup { dt: self.dt, gravity: self.gravity, wind: self.wind, colliders, bodies, snow };
        Ok(Built { setup, initial_changes, remarks })
    }

    /// Names are unique among bodies and objects of snow, and among colliders.
    fn check_names(&self) -> Result<(), SceneError> {
        let root = Path::default();
        let name = |list: &Path, i: usize| list.index(i).key("name");
        let bodies = self.bodies.iter().enumerate();
        let bodies = bodies.map(|(i, b)| (name(&root.key("body"), i), "body", b.name.as_str()));
        let objects = self.snow.iter().flat_map(|snow| &snow.objects).enumerate();
        let list = root.key("snow").key("object");
        let objects = objects.map(|(i, o)| (name(&list, i), "object of snow", o.name.as_str()));
        let colliders = self.colliders.iter().enumerate();
        let colliders = colliders.map(|(i, c)| (name(&root.key("collider"), i), "collider", c.name.as_str()));
        self.check_unique(bodies.chain(objects))?;
        self.check_unique(colliders)
    }

    fn check_unique<'a>(
        &self,
        names: impl Iterator<Item = (Path, &'static str, &'a str)>,
    ) -> Result<(), SceneError> {
        let mut seen = BTreeMap::new();
        for (path, what, name) in names {
            if name.trim().is_empty() {
                return Err(self.source.error(Fault::OutOfRange, &path, "is empty: a name is needed"));
            }
            if let Some(owner) = seen.insert(name, what) {
                let owner = if owner == what { format!("another {owner}") } else { format!("a {owner}") };
                let message = format!("'{name}' is the name of {owner}: names are unique");
                return Err(self.source.error(Fault::Inconsistent, &path, message));
            }
        }
        Ok(())
    }
}
