//! Files for ParaView and whatever else reads VTK: one of the particles per frame, and an index of their times.
//!
//! `run.pvd` is the index, and the folder `run` holds `frame-000000.vtp` and so on, in the precision of the session;
//! `colliders-000000.vtp` of the first frame, and of each in which a collider has moved; `grid-000000.vtp` if nodes of the grid are
//! kept. Each file is whole. The index is written again after some frames, so that a run which was cut off has it up to there.

mod bodies;
mod facts;
mod colliders;
mod index;

use std::{
    io::{BufWriter, Write as _},
    path::{Path, PathBuf},
};

use nappe_client::{Frame, GridFrame, Scalars, Topology, Vectors, WatchOptions, v1};
use nappe_scene::mesh::{VtpArray, VtpCells, VtpFile, VtpNumbers, write_vtp};

use self::{
    bodies::Bodies,
    colliders::Colliders,
    index::{Index, Part},
};
use super::room::Room;
use crate::{
    files::write::{self, Existing},
    options::fields::FieldsArgs,
    words::error::{CliError, Result},
};

/// The index is written again after so many frames.
const RENEWED: u64 = 32;

/// Files of a run for ParaView.
pub(crate) struct Vtk {
    /// Where the index goes.
    path: PathBuf,
    existing: Existing,
    /// The name of the folder with all other files.
    folder: String,
    room: Room,
    fields: FieldsArgs,
    bodies: Bodies,
    colliders: Colliders,
    index: Index,
    /// Whether the index has its place.
    is_indexed: bool,
    /// Frames whose files are all there.
    frame_count: u64,
    /// Whether a file is missing.
    is_torn: bool,
}

impl Vtk {
    /// Makes the folder beside the index, or takes one that holds no frames that stay.
    ///
    /// # Errors
    /// When the index is there and stays or its name cannot be written into a file, and as [`Room::create`].
    pub(super) fn create(path: &Path, existing: Existing, fields: &FieldsArgs) -> Result<Self> {
        if write::is_special(path) {
            return Err(CliError::failure(format!(
                "{} is no plain file: a .pvd file names others, which stand in a folder beside it",
                path.display()
            )));
        }
        write::check(path, existing)?;
        let place = path.with_extension("");
        let name = place.file_name().and_then(|name| name.to_str());
        let Some(folder) = name.filter(|name| !name.contains(char::is_control)) else {
            return Err(CliError::failure(format!(
                "{}: a .pvd file cannot name a folder that is called so; allowed: UTF-8 without control characters",
                path.display()
            )));
        };
        Ok(Self {
            path: path.to_owned(),
            existing,
            folder: folder.to_owned(),
            room: Room::create(&place, existing)?,
            fields: fields.clone(),
            bodies: Bodies::of(&[]),
            colliders: Colliders::default(),
            index: Index::default(),
            is_indexed: false,
            frame_count: 0,
            is_torn: false,
        })
    }

    /// These watch options with what is kept, in the precision of a session.
    pub(super) fn watch(&self, options: WatchOptions, session: &v1::Session) -> WatchOptions {
        self.fields.watch_exactly(options, session)
    }

    /// Keeps the bodies, whose cells every file repeats, and the colliders.
    pub(super) fn topology(&mut self, topology: Topology) {
        self.bodies = Bodies::of(&topology.bodies);
        self.colliders = Colliders::of(topology.colliders);
    }

    /// Writes the files of a frame, and at times the index.
    ///
    /// # Errors
    /// When one cannot be written.
    pub(super) fn frame(&mut self, frame: &Frame) -> Result<()> {
        self.room.begin()?;
        let written = self.write_files(frame).and_then(|()| {
            self.frame_count += 1;
            if self.frame_count % RENEWED == 1 { self.renew() } else { Ok(()) }
        });
        self.is_torn |= written.is_err();
        written.map_err(|error| self.room.told(error))
    }

    /// Has the files take the place of those of another run, and writes the index of all. None came: those stay.
    ///
    /// # Errors
    /// When a file is missing, or one cannot be written, removed or renamed.
    pub(super) fn finish(mut self) -> Result<()> {
        if self.frame_count == 0 {
            return Ok(());
        }
        if self.is_torn && self.room.is_aside() {
            return Err(self.room.told(CliError::failure("a file of a frame could not be written")));
        }
        self.room.finish()?;
        self.write_index()
    }

    fn write_files(&mut self, frame: &Frame) -> Result<()> {
        let number = frame.frame;
        let mut files = vec![(Part::Particles, self.write_particles(frame)?)];
        if let Some(poses) = self.colliders.moved(frame) {
            let placed = self.colliders.placed(frame, &poses);
            let [vertices, lines] = [VtpCells::new::<1>(&[]), VtpCells::new::<2>(&[])];
            let file = VtpFile {
                facts: &facts::of_poses(frame, &poses),
                points: &placed.points,
                point_data: &[],
                cell_data: placed.cell_data,
                vertices: &vertices,
                lines: &lines,
                triangles: placed.triangles,
            };
            write(&self.room.file(&name("colliders", number)), &file)?;
            self.colliders.note(number, poses);
        }
        files.extend(self.colliders.newest().map(|number| (Part::Colliders, name("colliders", number))));
        if let Some(grid) = &frame.grid {
            files.push((Part::Grid, self.write_grid(frame, grid)?));
        }
        for (part, file) in files {
            self.index.add(frame.time, part, file);
        }
        Ok(())
    }

    /// Writes the file of the particles, and gives its name.
    fn write_particles(&self, frame: &Frame) -> Result<String> {
        let point_data: Vec<VtpArray> = [
            frame.velocities.as_ref().map(|array| VtpArray::new("velocity", 3, vectors(array))),
            frame.plastic_ratios.as_ref().map(|array| VtpArray::new("plastic_ratio", 1, scalars(array))),
            frame.stress_norms.as_ref().map(|array| VtpArray::new("stress_norm", 1, scalars(array))),
            frame.forces.as_ref().map(|array| VtpArray::new("force", 3, vectors(array))),
            frame.accelerations.as_ref().map(|array| VtpArray::new("acceleration", 3, vectors(array))),
        ]
        .into_iter()
        .flatten()
        .collect();
        let Bodies { names, cell_data, vertices, lines, triangles } = &self.bodies;
        let file = VtpFile {
            facts: &facts::of_frame(frame, names),
            points: &VtpArray::new("Points", 3, vectors(&frame.positions)),
            point_data: &point_data,
            cell_data,
            vertices,
            lines,
            triangles,
        };
        let name = name("frame", frame.frame);
        write(&self.room.file(&name), &file)?;
        Ok(name)
    }

    /// Writes the file of the nodes of the grid, and gives its name.
    fn write_grid(&self, frame: &Frame, grid: &GridFrame) -> Result<String> {
        let positions: Vec<f32> = grid.positions().flatten().collect();
        let nodes: Vec<[u32; 1]> = (0..grid.len()).map(|node| [node as u32]).collect();
        let [lines, triangles] = [VtpCells::new::<2>(&[]), VtpCells::new::<3>(&[])];
        let mut point_data = vec![
            VtpArray::new("mass", 1, VtpNumbers::F32(&grid.masses)),
            VtpArray::new("velocity", 3, VtpNumbers::F32(grid.velocities.as_flattened())),
        ];
        if frame.forces.is_some() && grid.forces.len() == grid.len() {
            point_data.push(VtpArray::new("force", 3, VtpNumbers::F32(grid.forces.as_flattened())));
        }
        let file = VtpFile {
            facts: &facts::of_instant(frame),
            points: &VtpArray::new("Points", 3, VtpNumbers::F32(&positions)),
            point_data: &point_data,
            cell_data: &[],
            vertices: &VtpCells::new(&nodes),
            lines: &lines,
            triangles: &triangles,
        };
        let name = name("grid", frame.frame);
        write(&self.room.file(&name), &file)?;
        Ok(name)
    }

    /// Writes the index of the frames so far: at its place, or beside it while the files of another run are there.
    fn renew(&mut self) -> Result<()> {
        let Some(aside) = self.room.aside() else { return self.write_index() };
        let text = self.index.text(&format!("{}/{aside}", self.folder));
        let beside = write::beside(&write::place(&self.path));
        write::write_whole(&beside, text.as_bytes(), Existing::Overwritten)
    }

    /// Writes the index at its place.
    fn write_index(&mut self) -> Result<()> {
        let text = self.index.text(&self.folder);
        let existing = if self.is_indexed { Existing::Overwritten } else { self.existing };
        write::write_whole(&self.path, text.as_bytes(), existing)?;
        self.is_indexed = true;
        Ok(())
    }
}

/// The name of a file of a frame.
fn name(what: &str, frame: u64) -> String {
    format!("{what}-{frame:06}.vtp")
}

fn vectors(vectors: &Vectors) -> VtpNumbers<'_> {
    match vectors {
        Vectors::F32(numbers) => VtpNumbers::F32(numbers),
        Vectors::F64(numbers) => VtpNumbers::F64(numbers),
    }
}

fn scalars(scalars: &Scalars) -> VtpNumbers<'_> {
    match scalars {
        Scalars::F32(numbers) => VtpNumbers::F32(numbers),
        Scalars::F64(numbers) => VtpNumbers::F64(numbers),
    }
}

fn write(path: &Path, file: &VtpFile<'_>) -> Result<()> {
    write::write_by(path, Existing::Kept, |out| {
        let mut out = BufWriter::new(out);
        write_vtp(file, &mut out)?;
        out.flush()
    })
}
