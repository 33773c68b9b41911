//! A scene as it is written: the serde types, from text and back to text.
//!
//! Ranges, units and defaults stand in the schema, which checks a text before serde sees it.

use nappe_sim::{collide::Contact, math::Precision};
use serde::{Deserialize, Serialize};
use toml::de::DeTable;

use crate::{
    body::{Body, Mesh, Rotate},
    error::{Fault, SceneError},
    keys::ROOT,
    names, schema,
    snow::{Snow, SnowBody},
    source::{Path, Source},
};

/// The version of the format that this program reads and writes.
pub const VERSION: u32 = 1;

/// A scene: a world, and how long and how it is shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Scene {
    /// Version of the format.
    pub version: u32,
    /// Title, for people.
    pub title: String,
    /// Time step (s).
    pub dt: f64,
    /// Ends after so many steps; 0: never by itself.
    #[serde(serialize_with = "names::whole")]
    pub steps: u64,
    /// Steps between two frames.
    pub frame_interval: u32,
    /// Precision of the state.
    #[serde(with = "names::precision")]
    pub precision: Precision,
    /// Gravity (m/s²).
    pub gravity: [f64; 3],
    /// Velocity of the medium (m/s).
    pub wind: [f64; 3],
    /// A frame carries a state hash every so many frames.
    pub hash_interval: u32,
    /// Bodies.
    #[serde(rename = "body", skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<Body>,
    /// Snow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub snow: Option<Snow>,
    /// Colliders.
    #[serde(rename = "collider", skip_serializing_if = "Vec::is_empty")]
    pub colliders: Vec<ColliderText>,
    /// The text that it was read from, for messages.
    #[serde(skip)]
    pub source: Source,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            version: VERSION,
            title: String::new(),
            dt: 0.005,
            steps: 0,
            frame_interval: 1,
            precision: Precision::F32,
            gravity: [0.0, -9.81, 0.0],
            wind: [0.0; 3],
            hash_interval: 10,
            bodies: Vec::new(),
            snow: None,
            colliders: Vec::new(),
            source: Source::default(),
        }
    }
}

/// Something that particles collide with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColliderText {
    /// Name, unique among colliders.
    pub name: String,
    /// Its shape at time 0.
    #[serde(flatten)]
    pub shape: ShapeText,
    /// Velocity (m/s).
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Coulomb's friction coefficient.
    #[serde(default)]
    pub friction: f64,
    /// Share of the normal approach speed that comes back.
    #[serde(default)]
    pub restitution: f64,
    /// Distance from the surface at which a particle touches (m).
    #[serde(default)]
    pub margin: f64,
    /// How snow meets it; cloth always separates.
    #[serde(default, with = "names::contact")]
    pub contact: Contact,
}

/// Shape of a collider.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ShapeText {
    /// The half-space behind a plane.
    Plane {
        /// A point of it (m).
        point: [f64; 3],
        /// Direction towards the particles, of any length but 0.
        normal: [f64; 3],
    },
    /// A ball.
    Sphere {
        /// Centre (m).
        center: [f64; 3],
        /// Radius (m).
        radius: f64,
    },
    /// All points within a distance of a segment.
    Capsule {
        /// One end of the segment (m).
        start: [f64; 3],
        /// The other (m).
        end: [f64; 3],
        /// Distance (m).
        radius: f64,
    },
    /// A box.
    Box {
        /// Centre (m).
        center: [f64; 3],
        /// Edges (m).
        size: [f64; 3],
        /// Rotation about its centre.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rotate: Option<Rotate>,
    },
    /// A cylinder with flat ends.
    Cylinder {
        /// Centre of one end (m).
        start: [f64; 3],
        /// Centre of the other (m).
        end: [f64; 3],
        /// Radius (m).
        radius: f64,
    },
    /// The ground below a trough, endless along its axis.
    HalfPipe {
        /// A point of the axis (m).
        point: [f64; 3],
        /// Direction of the axis, of any length but 0.
        axis: [f64; 3],
        /// Direction of the opening, across the axis.
        up: [f64; 3],
        /// Inner radius (m).
        radius: f64,
    },
}

impl Scene {
    /// Reads a scene. `file` is its name in messages.
    ///
    /// # Errors
    /// The first fault, with line, column and field.
    pub fn parse(text: &str, file: &str) -> Result<Self, SceneError> {
        let source = Source::new(file, text);
        let root = Path::default();
        let syntax = |error: &toml::de::Error| {
            let span = error.span().unwrap_or_default();
            source.error_at(Fault::Syntax, &root, &span, format!("is not TOML: {}", error.message()))
        };
        let table = DeTable::parse(text).map_err(|error| syntax(&error))?;
        schema::check(&ROOT, table.get_ref(), &(0..0), &root, &source)?;
        let mut scene: Self = toml::from_str(text).map_err(|error| syntax(&error))?;
        scene.source = source;
        scene.check_holds_something()?;
        Ok(scene)
    }

    /// The meshes of its bodies and of its snow.
    pub fn meshes(&self) -> impl Iterator<Item = &Mesh> {
        let snow = self.snow.iter().flat_map(|snow| &snow.objects);
        self.bodies.iter().map(|body| &body.mesh).chain(snow.filter_map(SnowBody::mesh))
    }

    /// The same, to be changed.
    pub fn meshes_mut(&mut self) -> impl Iterator<Item = &mut Mesh> {
        let snow = self.snow.iter_mut().flat_map(|snow| &mut snow.objects);
        self.bodies.iter_mut().map(|body| &mut body.mesh).chain(snow.filter_map(SnowBody::mesh_mut))
    }

    /// Writes the scene; [`Scene::parse`] gives it back.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a scene holds only numbers, texts, arrays and tables")
    }

    /// Holds the fields as they are now against the schema: a program may have changed them.
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        let text = self.to_toml();
        let table = DeTable::parse(&text).map_err(|error| {
            SceneError::new(Fault::Syntax, "", format!("the scene cannot be written: {}", error.message()))
        })?;
        let named = self.source.without_text();
        schema::check(&ROOT, table.get_ref(), &(0..0), &Path::default(), &named)?;
        self.check_holds_something()
    }

    fn check_holds_something(&self) -> Result<(), SceneError> {
        if self.bodies.is_empty() && self.snow.is_none() {
            let message = "is missing, and so is snow: a scene has a body, `[[body]]`, or snow, `[snow]` with `[[snow.object]]`";
            return Err(self.source.error(Fault::Missing, &Path::default().key("body"), message));
        }
        Ok(())
    }
}
