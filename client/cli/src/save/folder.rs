//! A folder with PLY files: per frame one of the particles, and one of the snow's grid if it is kept.
//!
//! Particles: x, y, z (m) and, where they are kept, vx, vy, vz (m/s), plastic_ratio (1), stress_norm (Pa), fx, fy, fz (N)
//! and ax, ay, az (m/s²), in the precision of the session: binary64 holds its exact state. Nodes of the grid, in binary32:
//! x, y, z (m), mass (kg), vx, vy, vz (m/s) and, where forces are kept, fx, fy, fz (N). The surfaces of all mesh colliders
//! at time 0 stand once in colliders.ply, if there are any.
//!
//! Each file is whole. Where frames of another run are to be replaced, the new ones stand in a folder within until the end; those of a
//! run that is kept take their place at once. Where a run goes on that was saved there, its frames follow those that are there.

use std::{
    io::{BufWriter, Write as _},
    path::{Path, PathBuf},
};

use nappe_client::{Frame, GridFrame, Scalars, Topology, Vectors, WatchOptions, v1};
use nappe_scene::mesh::{PlyFrame, PlyNumbers, PlyProperty, write_ply_frame};

use super::{
    room::{COLLIDERS, Room},
    surfaces::Surfaces,
};
use crate::{
    files::{
        frame_notes,
        write::{self, Existing},
    },
    options::fields::FieldsArgs,
    words::error::{CliError, Result},
};

/// Properties of a PLY file that hold a velocity (m/s).
const VELOCITY: [&str; 3] = ["vx", "vy", "vz"];
/// Those that hold a force (N), and an acceleration (m/s²).
const FORCE: [&str; 3] = ["fx", "fy", "fz"];
const ACCELERATION: [&str; 3] = ["ax", "ay", "az"];

/// How far the run has come that was saved in a folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Reached {
    /// The frame that it goes on from: the last whole one.
    pub(crate) frame: u64,
    /// How many steps were taken before that frame.
    pub(crate) step: u64,
    /// What the scene is known by.
    pub(crate) scene: String,
}

/// PLY files: frame-000000.ply, frame-000001.ply ... and grid-000000.ply ...
pub(crate) struct Folder {
    room: Room,
    fields: FieldsArgs,
    /// What the scene is known by, if that is at hand.
    scene: Option<String>,
    /// Where it goes on from; none: the run begins here.
    reached: Option<Reached>,
    /// Whether the session itself goes on whose frames are there: their numbers go on.
    is_same: bool,
    /// What is added to the number of a frame of the session.
    offset: u64,
    triangles: Vec<[u32; 3]>,
    surfaces: Surfaces,
    frame_count: u64,
    /// Whether a file is missing.
    is_torn: bool,
}

impl Folder {
    /// Makes the folder, or takes one that holds no frames that stay.
    pub(super) fn create(
        path: &Path,
        existing: Existing,
        fields: &FieldsArgs,
        scene: Option<String>,
    ) -> Result<Self> {
        Ok(Self::new(Room::create(path, existing)?, fields, scene))
    }

    /// A folder in which the run goes on that was saved there.
    ///
    /// # Errors
    /// As [`Room::going_on`].
    pub(super) fn going_on(path: &Path, fields: &FieldsArgs, reached: Reached) -> Result<Self> {
        let mut folder = Self::new(Room::going_on(path)?, fields, Some(reached.scene.clone()));
        folder.reached = Some(reached);
        Ok(folder)
    }

    /// Makes the folder, or takes one, for the frames of a run that is kept: those of another one go before the first comes.
    pub(super) fn cleared(
        path: &Path,
        existing: Existing,
        fields: &FieldsArgs,
        scene: Option<String>,
    ) -> Result<Self> {
        Ok(Self::new(Room::cleared(path, existing)?, fields, scene))
    }

    /// A folder in which the session goes on that was kept.
    ///
    /// # Errors
    /// As [`Room::going_on`].
    pub(super) fn of_same(path: &Path, fields: &FieldsArgs, scene: Option<String>) -> Result<Self> {
        let mut folder = Self::new(Room::going_on(path)?, fields, scene);
        folder.is_same = true;
        Ok(folder)
    }

    /// Checks that the frames are there which a session that goes on had made, as it stands now.
    ///
    /// # Errors
    /// When one is missing.
    pub(super) fn check(&self, session: &v1::Session) -> Result<()> {
        if !self.is_same {
            return Ok(());
        }
        match (0..=session.frame).map(|frame| self.place("frame", frame)).find(|file| !file.is_file()) {
            None => Ok(()),
            Some(file) => Err(CliError::failure(format!(
                "{} is missing, which was saved before step {}, and the run goes on from there",
                file.display(),
                session.step
            ))
            .hint("--save names the folder that has it; or --fresh begins anew")),
        }
    }

    fn new(room: Room, fields: &FieldsArgs, scene: Option<String>) -> Self {
        Self {
            room,
            fields: fields.clone(),
            scene,
            reached: None,
            is_same: false,
            offset: 0,
            triangles: Vec::new(),
            surfaces: Surfaces::default(),
            frame_count: 0,
            is_torn: false,
        }
    }

    /// Whether a run can go on from its frames: they have velocities, and say of which scene they are.
    pub(super) fn is_resumable(&self) -> bool {
        self.fields.keep_velocities() && self.scene.is_some()
    }

    /// These watch options with what is kept, in the precision of a session. Where a run goes on, its first frame is there already.
    pub(super) fn watch(&mut self, mut options: WatchOptions, session: &v1::Session) -> WatchOptions {
        if let Some(Reached { frame, step, .. }) = &self.reached {
            options.from_frame = Some(1);
            // A frame that is there since a run ended within an interval gives way to the one that ends the interval.
            let is_due = step.is_multiple_of(session.frame_interval_steps.max(1).into());
            self.offset = if is_due { *frame } else { frame.saturating_sub(1) };
        }
        if self.is_same {
            options.from_frame = Some(session.frame + 1);
        }
        self.fields.watch_exactly(options, session)
    }

    /// Keeps the triangles, which every file repeats, and the surfaces of colliders.
    pub(super) fn topology(&mut self, topology: Topology) {
        self.surfaces = Surfaces::of(&topology.colliders);
        self.triangles = topology.bodies.into_iter().flat_map(|body| body.triangles).collect();
    }

    /// Writes the files of a frame; with the first one, that of the mesh colliders.
    ///
    /// # Errors
    /// When one cannot be written.
    pub(super) fn write(&mut self, frame: &Frame) -> Result<()> {
        self.room.begin()?;
        let is_first = self.frame_count == 0 && !self.goes_on();
        let written = if is_first { self.write_surfaces() } else { Ok(()) };
        self.frame_count += 1;
        let written = written.and_then(|()| self.write_files(frame));
        self.is_torn |= written.is_err();
        written.map_err(|error| self.room.told(error))
    }

    /// Has the frames take the place of those of another run. None came: those stay.
    ///
    /// # Errors
    /// When a file is missing, or one cannot be removed or renamed.
    pub(super) fn finish(self) -> Result<()> {
        if self.is_torn && self.room.is_aside() {
            return Err(self.room.told(CliError::failure("a file of a frame could not be written")));
        }
        self.room.finish()
    }

    fn write_files(&self, frame: &Frame) -> Result<()> {
        let properties: Vec<PlyProperty<'_>> = [
            property(&VELOCITY, frame.velocities.as_ref().map(vectors)),
            property(&["plastic_ratio"], frame.plastic_ratios.as_ref().map(scalars)),
            property(&["stress_norm"], frame.stress_norms.as_ref().map(scalars)),
            property(&FORCE, frame.forces.as_ref().map(vectors)),
            property(&ACCELERATION, frame.accelerations.as_ref().map(vectors)),
        ]
        .into_iter()
        .flatten()
        .collect();

        let comments = match &frame.velocities {
            Some(_) => frame_notes::comments(self.scene.as_deref(), frame.carried.as_ref()),
            None => Vec::new(),
        };
        let particles = PlyFrame {
            positions: vectors(&frame.positions),
            properties: &properties,
            triangles: &self.triangles,
            step: frame.step,
            time: frame.time,
            comments: &comments,
        };
        self.write_file("frame", frame.frame, &particles)?;

        match &frame.grid {
            Some(grid) => self.write_grid(frame, grid),
            None => Ok(()),
        }
    }

    fn write_surfaces(&self) -> Result<()> {
        let Surfaces { points, triangles } = &self.surfaces;
        if triangles.is_empty() {
            return Ok(());
        }
        let positions = PlyNumbers::F32(points);
        let surfaces = PlyFrame { positions, properties: &[], triangles, step: 0, time: 0.0, comments: &[] };
        write(&self.room.file(COLLIDERS), &surfaces, Existing::Kept)
    }

    /// Whether earlier frames of the run are there.
    fn goes_on(&self) -> bool {
        self.reached.is_some() || self.is_same
    }

    /// Where the file of a frame of the session is.
    fn place(&self, what: &str, frame: u64) -> PathBuf {
        self.room.file(&format!("{what}-{:06}.ply", frame + self.offset))
    }

    /// Writes the file of a frame of the session.
    fn write_file(&self, what: &str, frame: u64, points: &PlyFrame<'_>) -> Result<()> {
        let existing = if self.goes_on() { Existing::Overwritten } else { Existing::Kept };
        write(&self.place(what, frame), points, existing)
    }

    fn write_grid(&self, frame: &Frame, grid: &GridFrame) -> Result<()> {
        let positions: Vec<f32> = grid.positions().flatten().collect();
        let mut properties = vec![
            PlyProperty { names: &["mass"], values: PlyNumbers::F32(&grid.masses) },
            PlyProperty { names: &VELOCITY, values: PlyNumbers::F32(grid.velocities.as_flattened()) },
        ];
        if frame.forces.is_some() && grid.forces.len() == grid.len() {
            properties
                .push(PlyProperty { names: &FORCE, values: PlyNumbers::F32(grid.forces.as_flattened()) });
        }
        let nodes = PlyFrame {
            positions: PlyNumbers::F32(&positions),
            properties: &properties,
            triangles: &[],
            step: frame.step,
            time: frame.time,
            comments: &[],
        };
        self.write_file("grid", frame.frame, &nodes)
    }
}

/// The properties of an array, if it is kept.
fn property<'a>(names: &'a [&'a str], values: Option<PlyNumbers<'a>>) -> Option<PlyProperty<'a>> {
    values.map(|values| PlyProperty { names, values })
}

fn vectors(vectors: &Vectors) -> PlyNumbers<'_> {
    match vectors {
        Vectors::F32(numbers) => PlyNumbers::F32(numbers),
        Vectors::F64(numbers) => PlyNumbers::F64(numbers),
    }
}

fn scalars(scalars: &Scalars) -> PlyNumbers<'_> {
    match scalars {
        Scalars::F32(numbers) => PlyNumbers::F32(numbers),
        Scalars::F64(numbers) => PlyNumbers::F64(numbers),
    }
}

fn write(path: &Path, points: &PlyFrame<'_>, existing: Existing) -> Result<()> {
    write::write_by(path, existing, |file| {
        let mut out = BufWriter::new(file);
        write_ply_frame(points, &mut out)?;
        out.flush()
    })
}
