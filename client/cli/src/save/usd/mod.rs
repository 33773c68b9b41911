//! A scene of USD in its text form, for Blender, Houdini and Omniverse: bodies and colliders with their motion.
//!
//! Metres, y up, a time code per frame. Numbers of particles are of binary32. Samples are gathered in a file beside as frames come,
//! and joined at the end, so that memory does not grow.

mod names;
mod spool;
mod colliders;
mod bodies;

use std::path::Path;

use nappe_client::{Field, Frame, Topology, WatchOptions, v1};

use self::{
    bodies::{Array, Prim, of_each},
    colliders::{Drawn, matrix},
    names::{Names, quoted},
    spool::{Attribute, Spool},
};
use super::solids::{Scene, View};
use crate::{
    files::{
        aside::Growing,
        write::{self, Existing},
    },
    options::fields::FieldsArgs,
    words::{
        error::{CliError, Result},
        output,
    },
};

/// A file larger than this is told how it gets smaller (bytes).
const LARGE: u64 = 500_000_000;
/// How far from a frame a time code may be that is meant to be on it.
const ON_A_FRAME: f64 = 1e-6;

/// A scene in the making.
pub(crate) struct Usd {
    file: Growing,
    spool: Spool,
    fields: FieldsArgs,
    title: String,
    /// Frames per second of simulated time.
    rate: f64,
    /// Until the first frame, which tells how large the scene is.
    topology: Option<Topology>,
    bodies: Vec<(Prim, Vec<(Array, Attribute)>)>,
    colliders: Vec<(Drawn, Attribute)>,
    scene: Option<Scene>,
    /// The time codes of the first and of the last frame.
    codes: Option<[f64; 2]>,
    /// Whether a sample is missing.
    is_torn: bool,
}

impl Usd {
    /// Opens the file, beside one that is there, and one for samples beside it.
    ///
    /// # Errors
    /// When one cannot be opened, or the file is there and stays.
    pub(super) fn create(path: &Path, existing: Existing, fields: &FieldsArgs) -> Result<Self> {
        if write::is_special(path) {
            return Err(CliError::failure(format!(
                "{} is no plain file: beside a .usda file, samples are gathered until the end",
                path.display()
            )));
        }
        let file = Growing::open(path, existing)?;
        let mut samples = write::beside(&write::place(path)).into_os_string();
        samples.push(".samples");
        Ok(Self {
            file,
            spool: Spool::create(Path::new(&samples))?,
            fields: fields.clone(),
            title: String::new(),
            rate: 1.0,
            topology: None,
            bodies: Vec::new(),
            colliders: Vec::new(),
            scene: None,
            codes: None,
            is_torn: false,
        })
    }

    /// These watch options with what is kept, velocities always; notes what the session is.
    pub(super) fn watch(&mut self, options: WatchOptions, session: &v1::Session) -> WatchOptions {
        self.title.clone_from(&session.title);
        let interval = session.dt_seconds * f64::from(session.frame_interval_steps.max(1));
        if interval > 0.0 {
            self.rate = on_a_frame(1.0 / interval);
        }
        let mut options = self.fields.watch(options);
        options.fields = options.fields.with(Field::Velocities);
        options
    }

    /// Keeps the topology until the first frame.
    pub(super) fn topology(&mut self, topology: Topology) {
        self.topology = Some(topology);
    }

    /// Keeps the samples of a frame.
    ///
    /// # Errors
    /// When they cannot be written.
    pub(super) fn frame(&mut self, frame: &Frame) -> Result<()> {
        if let Some(topology) = self.topology.take() {
            self.begin(&topology, frame);
        }
        let was_large = self.spool.bytes() > LARGE;
        let code = on_a_frame(frame.time * self.rate);
        let added = self.add(code, frame);
        self.is_torn |= added.is_err();
        added?;
        self.codes = Some([self.codes.map_or(code, |[first, _]| first), code]);
        if self.spool.bytes() > LARGE && !was_large {
            output::note(&format!(
                "nappe: {} gets more than {} MB: a longer --frame-interval makes it smaller, and in Python, Usd.Stage.Open(\"FILE.usda\").Export(\"FILE.usdc\") makes a binary copy",
                self.file.path().display(),
                LARGE / 1_000_000
            ));
        }
        Ok(())
    }

    /// Joins what came, and gives the file its name. Nothing came: nothing is left.
    ///
    /// # Errors
    /// When a sample is missing, or the file cannot be written.
    pub(super) fn finish(mut self) -> Result<()> {
        if self.is_torn {
            return Err(CliError::failure(format!(
                "{}: a sample of a frame could not be kept",
                self.file.path().display()
            )));
        }
        if let Some(codes) = self.codes {
            self.write_all(codes)?;
        }
        self.file.finish()
    }

    /// Has a prim for each body and each collider.
    fn begin(&mut self, topology: &Topology, frame: &Frame) {
        let scene = Scene::around(&frame.positions);
        let fields = self.fields.watch(WatchOptions::default()).fields;
        for body in &topology.bodies {
            let prim = Prim::of(body, frame, fields);
            let attributes = prim.arrays.iter().map(|array| (*array, self.spool.attribute())).collect();
            self.bodies.push((prim, attributes));
        }
        for collider in &topology.colliders {
            self.colliders.extend(Drawn::of(collider, &scene).map(|drawn| (drawn, self.spool.attribute())));
        }
        self.scene = Some(scene);
    }

    fn add(&mut self, code: f64, frame: &Frame) -> Result<()> {
        for (prim, attributes) in &self.bodies {
            for (array, attribute) in attributes {
                let sample = prim.sample(*array, frame);
                self.spool.add(*attribute, &format!("            {code}: {sample},\n"))?;
            }
        }
        for (drawn, attribute) in &self.colliders {
            let matrix = drawn.matrix(frame);
            self.spool.add(*attribute, &format!("            {code}: {matrix},\n"))?;
        }
        Ok(())
    }

    fn write_all(&mut self, [first, last]: [f64; 2]) -> Result<()> {
        let Self { file, spool, title, rate, bodies, colliders, scene, .. } = self;
        let between = if title.is_empty() { "" } else { ": " };
        let about = quoted(&format!("nappe {}{between}{title}", env!("CARGO_PKG_VERSION")));
        let head = format!(
            "#usda 1.0\n(\n    defaultPrim = \"World\"\n    doc = {about}\n    endTimeCode = {last}\n    framesPerSecond = {rate}\n    metersPerUnit = 1\n    startTimeCode = {first}\n    timeCodesPerSecond = {rate}\n    upAxis = \"Y\"\n)\n\ndef Xform \"World\"\n{{\n"
        );
        file.write(head.as_bytes())?;
        let mut names = Names::with(&["camera", "colliders"]);
        for (prim, attributes) in bodies {
            file.write(opened(prim.kind, &names.next(&prim.name), &prim.name, &prim.lines).as_bytes())?;
            for (array, attribute) in attributes {
                let declared = array.declared();
                if array.is_primvar() {
                    let primvar = format!("        {declared} {}\n", of_each("vertex"));
                    file.write(primvar.as_bytes())?;
                }
                write_samples(file, spool, declared, *attribute)?;
            }
            file.write(b"    }\n\n")?;
        }
        if let Some(scene) = scene {
            file.write(camera(scene).as_bytes())?;
        }
        file.write(b"    def Xform \"colliders\"\n    {\n")?;
        let mut names = Names::default();
        for (drawn, attribute) in colliders {
            file.write(opened(drawn.kind, &names.next(&drawn.name), &drawn.name, &drawn.lines).as_bytes())?;
            write_samples(file, spool, "matrix4d xformOp:transform", *attribute)?;
            file.write(b"        uniform token[] xformOpOrder = [\"xformOp:transform\"]\n    }\n\n")?;
        }
        file.write(b"    }\n}\n")
    }
}

/// Writes an attribute that has times.
fn write_samples(file: &mut Growing, spool: &mut Spool, declared: &str, attribute: Attribute) -> Result<()> {
    file.write(format!("        {declared}.timeSamples = {{\n").as_bytes())?;
    spool.each(attribute, |sample| file.write(sample))?;
    file.write(b"        }\n")
}

/// A prim up to what of it has times.
fn opened(kind: &str, name: &str, called: &str, lines: &[String]) -> String {
    let mut text = format!(
        "    def {kind} \"{name}\" (\n        customData = {{\n            string name = {}\n        }}\n    )\n    {{\n",
        quoted(called)
    );
    for line in lines {
        text.push_str("        ");
        text.push_str(line);
        text.push('\n');
    }
    text
}

/// A camera that looks at the scene from above its side.
fn camera(scene: &Scene) -> String {
    let View { axes, at, far } = scene.view();
    format!(
        "    def Camera \"camera\"\n    {{\n        float2 clippingRange = ({:?}, {:?})\n        float focalLength = 35\n        matrix4d xformOp:transform = {}\n        uniform token[] xformOpOrder = [\"xformOp:transform\"]\n    }}\n\n",
        (0.01 * far) as f32,
        (10.0 * far) as f32,
        matrix(axes, at)
    )
}

/// A time code or a rate; a whole number where it is meant to be one.
fn on_a_frame(code: f64) -> f64 {
    let whole = code.round();
    if (code - whole).abs() < ON_A_FRAME { whole } else { code }
}
