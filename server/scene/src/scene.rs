//! A scene as it is written: the serde types, from text and back to text.
//!
//! Ranges, units and defaults stand in `keys`, against which a text is checked before serde sees it.

use std::iter;

use nappe_sim::{cloth::SurfaceSettings, math::Precision};
use serde::{Deserialize, Serialize};
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use crate::{
    body::{Body, Mesh, Springs},
    collider::ColliderText,
    contact,
    error::{ErrorKind, Found, SceneError, SceneErrors},
    figure::{Figure, FramesSource},
    keys::ROOT,
    location::Location,
    names,
    rest::Rest,
    schema,
    snow::{Snow, SnowBody},
    source::{OldKey, Path, Source},
};

/// The version of the format that this program reads and writes.
pub const VERSION: u32 = 1;

/// A scene: a world, and how long and how it is shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Scene {
    /// Version of the format: [`VERSION`].
    pub version: u32,
    /// A title for people; may be empty.
    pub title: String,
    /// Time step of the scene's clock (s), 1e-9 to 1.
    pub dt: f64,
    /// Steps after which the simulation ends; 0: it never ends by itself.
    #[serde(serialize_with = "names::whole")]
    pub steps: u64,
    /// Steps between frames, 1 or more.
    pub frame_interval: u32,
    /// Precision of positions and velocities; default: f32.
    #[serde(with = "names::precision")]
    pub precision: Precision,
    /// Acceleration of gravity (m/s²).
    pub gravity: [f64; 3],
    /// Velocity of the medium (m/s), which bodies feel through their drag and their air, snow through its drag.
    pub wind: [f64; 3],
    /// In its place the velocity of the medium over time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub wind_at: Vec<WindKey>,
    /// Frames between frames that carry the hash of the state, 1 or more.
    pub hash_interval: u32,
    /// How surfaces of cloth meet each other; none: by the defaults.
    #[serde(with = "contact", skip_serializing_if = "Option::is_none")]
    pub contact: Option<SurfaceSettings>,
    /// When cloth counts as calm; none: nothing is watched.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rest: Option<Rest>,
    /// Bodies, in the order of their particles.
    #[serde(rename = "body", skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<Body>,
    /// Figures, in the order of their corners, behind the particles of bodies.
    #[serde(rename = "figure", skip_serializing_if = "Vec::is_empty")]
    pub figures: Vec<Figure>,
    /// Snow; none: there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub snow: Option<Snow>,
    /// Colliders, in the order in which cloth meets them.
    #[serde(rename = "collider", skip_serializing_if = "Vec::is_empty")]
    pub colliders: Vec<ColliderText>,
    /// The text that it was read from, for messages.
    #[serde(skip)]
    pub source: Source,
}

/// What the medium does at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindKey {
    /// Time (s).
    pub time: f64,
    /// Velocity of the medium then (m/s).
    pub velocity: [f64; 3],
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
            wind_at: Vec::new(),
            hash_interval: 10,
            contact: None,
            rest: None,
            bodies: Vec::new(),
            figures: Vec::new(),
            snow: None,
            colliders: Vec::new(),
            source: Source::default(),
        }
    }
}

impl Scene {
    /// Reads a scene. `file` is its name in messages.
    ///
    /// # Errors
    /// Everything that is wrong with the text, each with line, column and key.
    pub fn parse(text: &str, file: &str) -> Result<Self, SceneErrors> {
        // Some editors put a mark at the beginning of a text in UTF-8.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let source = Source::new(file, text);
        let syntax = |error: &toml::de::Error| {
            let span = error.span().unwrap_or_default();
            let hint = hint(error.message(), text, span.start);
            let message = format!("is not TOML: {}{hint}", error.message());
            source.error_at(ErrorKind::Syntax, &Path::default(), &span, message)
        };

        let table = DeTable::parse(text).map_err(|error| syntax(&error))?;
        let old_keys = check(&table, &source)?;
        let mut scene: Self = toml::from_str(text).map_err(|error| syntax(&error))?;
        scene.source = source.with_old_keys(old_keys);
        scene.check_tables()?;
        Ok(scene)
    }

    /// What is odd about its text: a warning, with its place, for each key that stands under an old name.
    pub fn warnings(&self) -> Vec<String> {
        self.source.warnings()
    }

    /// The meshes of its bodies, of its figures, of its snow and of its colliders.
    pub fn meshes(&self) -> impl Iterator<Item = &Mesh> {
        let snow = self.snow.iter().flat_map(|snow| &snow.objects).filter_map(SnowBody::mesh);
        let colliders = self.colliders.iter().filter_map(ColliderText::mesh).map(|mesh| &mesh.mesh);
        let figures = self.figures.iter().map(|figure| &figure.mesh);
        self.bodies.iter().map(|body| &body.mesh).chain(figures).chain(snow).chain(colliders)
    }

    /// The files of its meshes, each with the table of springs that a body takes it with, if it names one.
    pub fn mesh_files(&self) -> impl Iterator<Item = (&str, Option<&str>)> {
        // Bodies come first among the meshes.
        let tables = self.bodies.iter().map(Body::springs_file).chain(iter::repeat(None));
        self.meshes().zip(tables).filter_map(|(mesh, table)| match mesh {
            Mesh::File { file, .. } => Some((file.as_str(), table)),
            Mesh::Grid { .. } | Mesh::Chain { .. } | Mesh::CourseGrid { .. } | Mesh::Upload { .. } => None,
        })
    }

    /// Its meshes, to be changed.
    pub fn meshes_mut(&mut self) -> impl Iterator<Item = &mut Mesh> {
        let snow = self.snow.iter_mut().flat_map(|snow| &mut snow.objects).filter_map(SnowBody::mesh_mut);
        let colliders =
            self.colliders.iter_mut().filter_map(ColliderText::mesh_mut).map(|mesh| &mut mesh.mesh);
        let figures = self.figures.iter_mut().map(|figure| &mut figure.mesh);
        self.bodies.iter_mut().map(|body| &mut body.mesh).chain(figures).chain(snow).chain(colliders)
    }

    /// The files of frames that its figures name.
    pub fn frame_files(&self) -> impl Iterator<Item = &str> {
        self.figures.iter().filter_map(|figure| match &figure.frames.source {
            FramesSource::File(file) => Some(file.as_str()),
            FramesSource::Upload(_) => None,
        })
    }

    /// Writes the scene; [`Scene::parse`] gives it back.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a scene holds only numbers, texts, arrays and tables")
    }

    /// Checks the values as they are now against the schema: a program may have changed them.
    pub(crate) fn check(&self) -> Result<(), SceneErrors> {
        let text = self.to_toml();
        let table = DeTable::parse(&text).map_err(|error| {
            let message = format!("the scene cannot be written: {}", error.message());
            SceneError::new(ErrorKind::Syntax, "", message)
        })?;
        check(&table, &self.source.without_text())?;
        self.check_tables()?;
        Ok(())
    }

    /// Tables of springs go with mesh files, and with no other springs.
    fn check_tables(&self) -> Result<(), SceneError> {
        let bodies = Location::root(&self.source).key("body");
        for (i, body) in self.bodies.iter().enumerate() {
            let Some(Springs { file: Some(_), pattern, stretch, shear, bend }) = &body.springs else {
                continue;
            };
            let at = bodies.index(i).key("springs");
            let laws = [("stretch", stretch), ("shear", shear), ("bend", bend)].into_iter();
            let given = laws.filter(|(_, law)| law.is_some()).map(|(key, _)| key);
            if let Some(key) = pattern.map(|_| "pattern").into_iter().chain(given).next() {
                let message = "does not go with `file`: a table has all springs, each with a stiffness and a damping of its own";
                return at.key(key).inconsistent(message);
            }
            if !matches!(body.mesh, Mesh::File { .. }) {
                let message = "is a table of springs, which goes with a mesh that is a file too: `nappe mesh grid` writes one; allowed \
                               here: stretch, and with an upload that has springs pattern = \"file\"";
                return at.key("file").inconsistent(message);
            }
        }
        Ok(())
    }
}

/// What helps against an error of TOML at a byte of a text: a table that stands there twice may have been meant as
/// an element of an array.
fn hint(error: &str, text: &str, byte: usize) -> String {
    let before = text.get(..byte).unwrap_or_default();
    let line = &text[before.rfind('\n').map_or(0, |end| end + 1)..];
    let header = line.trim_start().strip_prefix('[').and_then(|rest| rest.split(']').next());
    match header {
        Some(header) if error.starts_with("duplicate key") && ROOT.is_array(header) => {
            format!("; write [[{header}]], in double brackets, for each of several")
        }
        _ => String::new(),
    }
}

/// The keys of a scene's tables that stand under old names, or everything that is wrong with the tables; without
/// bodies and snow it is no scene.
fn check(table: &Spanned<DeTable<'_>>, source: &Source) -> Result<Vec<OldKey>, SceneErrors> {
    let mut found = Found::default();
    let old_keys = schema::check(&ROOT, table.get_ref(), source, &mut found);
    let has_bodies = match table.get_ref().get("body").map(Spanned::get_ref) {
        Some(DeValue::Array(bodies)) => !bodies.is_empty(),
        other => other.is_some(),
    };
    if !has_bodies && !table.get_ref().contains_key("snow") {
        let message = "is missing, and so is snow: a scene has a body, `[[body]]`, or snow, `[snow]` with `[[snow.object]]`";
        found.add(Location::root(source).key("body").error(ErrorKind::Missing, message));
    }
    found.or(old_keys)
}
