//! Where frames are kept: a Rerun recording, or a folder with one PLY mesh a frame.
//!
//! Reads topology and frames as they arrive; writes files. Every frame that comes is kept.

use std::{
    fs::{self, File},
    io::{BufWriter, Write as _},
    path::{Path, PathBuf},
};

use nappe_client::{Frame, Topology};
use nappe_scene::mesh::{PlyFrame, write_ply_frame};

use crate::error::{CliError, Result};

/// Whether this build can write Rerun recordings.
pub(crate) const RECORDS: bool = cfg!(feature = "rerun");

/// An open recording or folder.
pub(crate) struct Sink {
    path: PathBuf,
    form: Form,
}

enum Form {
    Folder(Folder),
    #[cfg(feature = "rerun")]
    Recording(Box<nappe_rerun::Recorder>),
}

/// Whether a path names a Rerun recording.
pub(crate) fn is_recording(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("rrd"))
}

/// Says what is wrong with a path before anything is computed for it.
///
/// # Errors
/// When it names neither a recording nor a folder, or a recording in a build without Rerun.
pub(crate) fn check(path: &Path) -> Result<()> {
    if is_recording(path) {
        if RECORDS {
            return Ok(());
        }
        return Err(CliError::usage(format!(
            "--save {}: this build cannot write Rerun recordings",
            path.display()
        ))
        .hint(
            "give a folder for PLY meshes, or build nappe with its feature `rerun`, which is on by default",
        ));
    }
    if path.extension().is_none() || path.is_dir() {
        return Ok(());
    }
    Err(CliError::usage(format!(
        "--save {}: frames are kept in a Rerun recording, FILE.rrd, or in a folder of PLY meshes",
        path.display()
    ))
    .hint("a folder's name has no extension, unless the folder exists already"))
}

impl Sink {
    /// Opens a recording for a path that ends in `.rrd`, a folder for another.
    ///
    /// # Errors
    /// As [`check`]; when the file or the folder cannot be made, or the folder holds frames already.
    pub(crate) fn create(path: &Path) -> Result<Self> {
        check(path)?;
        let form = if is_recording(path) { recording(path)? } else { Form::Folder(Folder::create(path)?) };
        Ok(Self { path: path.to_owned(), form })
    }

    /// Keeps the topology; it comes before the frames.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn topology(&mut self, topology: Topology) -> Result<()> {
        match &mut self.form {
            Form::Folder(folder) => {
                folder.triangles = topology.bodies.into_iter().flat_map(|body| body.triangles).collect();
                Ok(())
            }
            #[cfg(feature = "rerun")]
            Form::Recording(recorder) => recorder.topology(&topology).map_err(CliError::failure),
        }
    }

    /// Keeps a frame.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn frame(&mut self, frame: &Frame) -> Result<()> {
        match &mut self.form {
            Form::Folder(folder) => folder.write(frame),
            #[cfg(feature = "rerun")]
            Form::Recording(recorder) => recorder.frame(frame).map_err(CliError::failure),
        }
    }

    /// Closes it and gives its path.
    ///
    /// # Errors
    /// When its end cannot be written.
    pub(crate) fn finish(self) -> Result<PathBuf> {
        match self.form {
            Form::Folder(_) => {}
            #[cfg(feature = "rerun")]
            Form::Recording(recorder) => recorder.finish().map_err(CliError::failure)?,
        }
        Ok(self.path)
    }
}

#[cfg(feature = "rerun")]
fn recording(path: &Path) -> Result<Form> {
    let title = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let recorder = nappe_rerun::Recorder::open(&title, nappe_rerun::Sink::Save(path.to_owned()))
        .map_err(CliError::failure)?;
    Ok(Form::Recording(Box::new(recorder)))
}

#[cfg(not(feature = "rerun"))]
fn recording(path: &Path) -> Result<Form> {
    // `check` says it in the user's words before anybody comes here.
    Err(CliError::usage(format!("{}: this build cannot write Rerun recordings", path.display())))
}

/// One PLY mesh a frame: frame-000000.ply, frame-000001.ply ...
struct Folder {
    path: PathBuf,
    triangles: Vec<[u32; 3]>,
}

impl Folder {
    fn create(path: &Path) -> Result<Self> {
        fs::create_dir_all(path).map_err(|error| CliError::file("make the folder", path, &error))?;
        let entries = fs::read_dir(path).map_err(|error| CliError::file("read the folder", path, &error))?;
        for entry in entries {
            let entry = entry.map_err(|error| CliError::file("read the folder", path, &error))?;
            if entry.file_name().to_string_lossy().starts_with("frame-") {
                return Err(CliError::failure(format!(
                    "the folder {} holds frames already ({}): two runs would be mixed up",
                    path.display(),
                    entry.file_name().to_string_lossy()
                ))
                .hint("remove them, or give another folder"));
            }
        }
        Ok(Self { path: path.to_owned(), triangles: Vec::new() })
    }

    fn write(&self, frame: &Frame) -> Result<()> {
        let path = self.path.join(format!("frame-{:06}.ply", frame.frame));
        let mesh = PlyFrame {
            positions: &frame.positions.to_f32(),
            triangles: &self.triangles,
            step: frame.step,
            time: frame.time,
        };
        File::create(&path)
            .and_then(|file| {
                let mut out = BufWriter::new(file);
                write_ply_frame(&mesh, &mut out)?;
                out.flush()
            })
            .map_err(|error| CliError::file("write", &path, &error))
    }
}
