//! Where frames are kept: an HTML file, a folder with PLY files, files for ParaView, a scene of USD, a table, a picture, or a
//! Rerun recording.
//!
//! Every frame that comes is kept. All but a recording are written here; a recording by `nappe-viewer`, which this command
//! starts. A picture and a film are drawn at the end, by a browser, of an HTML file that then goes.

mod surfaces;
mod room;
mod solids;
mod folder;
mod html;
mod vtk;
mod usd;
mod table;
mod picture;
mod recording;
#[cfg(test)]
mod golden;

use std::path::{Path, PathBuf};

use nappe_client::{Frame, SessionEnd, Topology, WatchOptions, v1};

use self::{folder::Folder, html::Html, picture::Picture, table::Table, usd::Usd, vtk::Vtk};
pub(crate) use self::{
    folder::Reached,
    recording::{File, Recording},
};
use crate::{
    files::{paths, write::Existing},
    options::{fields::FieldsArgs, picture_args::PictureArgs},
    scenes::scene::Input,
    words::error::{CliError, Result},
};

/// Where the frames of a session go.
pub(crate) struct Destination {
    /// The file or the folder.
    pub(crate) path: PathBuf,
    /// Who writes it.
    pub(crate) form: Form,
    /// The picture or the film that is drawn of it, where that is what is kept.
    pub(crate) picture: Option<Box<Picture>>,
}

/// Who writes frames.
pub(crate) enum Form {
    /// This command, as the frames come.
    Sink(Sink),
    /// `nappe-viewer`, a recording; and this command what stands beside it.
    Recording(Box<Recording>, Option<Sink>),
}

/// What is kept beside the path of `--save`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Beside<'a> {
    /// The scene, if it is at hand.
    pub(crate) scene: Option<&'a Input>,
    /// Where a table goes, if one is kept.
    pub(crate) table: Option<&'a Path>,
    /// What a picture or a film is asked for.
    pub(crate) picture: PictureArgs,
}

/// What this command writes.
pub(crate) enum Sink {
    /// One PLY file per frame.
    Folder(Box<Folder>),
    /// One page that holds its frames.
    Html(Box<Html>),
    /// Files for ParaView.
    Vtk(Box<Vtk>),
    /// One file for Blender, Houdini and Omniverse.
    Usd(Box<Usd>),
    /// A row per frame.
    Table(Box<Table>),
    /// One of them, and a table beside it.
    Tabled(Box<Self>, Box<Table>),
}

impl Destination {
    /// What the ending of a path says, a folder where there is none; and what is kept beside it.
    ///
    /// # Errors
    /// When the path names none of them; when there is no viewer to record, or no browser to draw, the file or the folder
    /// cannot be made, or a file or frames that are there stay.
    pub(crate) async fn open(
        path: &Path,
        existing: Existing,
        fields: &FieldsArgs,
        beside: Beside<'_>,
    ) -> Result<Self> {
        paths::check_save(path)?;
        let table = match beside.table {
            Some(table) => Some(beside_of(table, path, existing)?),
            None => None,
        };
        let picture = if paths::is_drawn(path) {
            Some(Box::new(Picture::open(path, existing, beside.picture).await?))
        } else {
            None
        };
        let form = if paths::is_recording(path) {
            let recording = Recording::prepare(path, existing, fields).await?;
            Form::Recording(Box::new(recording), table.map(Sink::Table))
        } else {
            let page = picture.as_ref().map(|picture| picture.page());
            let sink = Sink::create(page.as_deref().unwrap_or(path), existing, fields, beside.scene)?;
            Form::Sink(match table {
                Some(table) => Sink::Tabled(Box::new(sink), table),
                None => sink,
            })
        };
        Ok(Self { path: path.to_owned(), form, picture })
    }

    /// A folder in which a run goes on that was saved there.
    ///
    /// # Errors
    /// When another run writes there.
    pub(crate) fn going_on(path: &Path, fields: &FieldsArgs, reached: Reached) -> Result<Self> {
        let sink = Sink::Folder(Box::new(Folder::going_on(path, fields, reached)?));
        Ok(Self { path: path.to_owned(), form: Form::Sink(sink), picture: None })
    }

    /// A folder for the frames of a run of a scene that is kept: those of another run go before the first one comes.
    ///
    /// # Errors
    /// When the path names no folder, it cannot be made, or frames that are there stay.
    pub(crate) fn cleared(
        path: &Path,
        existing: Existing,
        fields: &FieldsArgs,
        scene: &Input,
    ) -> Result<Self> {
        paths::check_save(path)?;
        let folder = Folder::cleared(path, existing, fields, scene.digest())?;
        Ok(Self { path: path.to_owned(), form: Form::Sink(Sink::Folder(Box::new(folder))), picture: None })
    }

    /// The folder in which the session of a scene goes on that was kept.
    ///
    /// # Errors
    /// When another run writes there.
    pub(crate) fn of_same(path: &Path, fields: &FieldsArgs, scene: &Input) -> Result<Self> {
        let folder = Folder::of_same(path, fields, scene.digest())?;
        Ok(Self { path: path.to_owned(), form: Form::Sink(Sink::Folder(Box::new(folder))), picture: None })
    }

    /// The folder, if a run can go on from its frames.
    pub(crate) fn resumable(&self) -> Option<&Path> {
        match &self.form {
            Form::Sink(sink) if sink.is_resumable() => Some(self.path.as_path()),
            _ => None,
        }
    }

    /// Checks that a session has what is to be drawn of it, and that its earlier frames are there where it goes on.
    ///
    /// # Errors
    /// When it ends before the instant of a picture, or a frame is missing.
    pub(crate) fn check(&self, session: &v1::Session) -> Result<()> {
        if let Form::Sink(Sink::Folder(folder)) = &self.form {
            folder.check(session)?;
        }
        self.picture.as_ref().map_or(Ok(()), |picture| picture.check(session))
    }

    /// Closes what this command writes, with how the session ended or why it failed, if it did; then draws it, if that is
    /// what is kept.
    ///
    /// # Errors
    /// When its end cannot be written, or it cannot be drawn.
    pub(crate) async fn finish(
        self,
        end: Option<SessionEnd>,
        failure: Option<&v1::Failure>,
    ) -> Result<PathBuf> {
        if let Form::Sink(sink) | Form::Recording(_, Some(sink)) = self.form {
            sink.finish(end, failure)?;
        }
        if let Some(picture) = self.picture {
            Box::pin(picture.draw()).await?;
        }
        Ok(self.path)
    }
}

/// A table at a path, beside what is kept at another.
fn beside_of(table: &Path, path: &Path, existing: Existing) -> Result<Box<Table>> {
    paths::check_table(table)?;
    if table == path {
        return Err(CliError::usage(format!(
            "--table and --save both name {}: two files have two names",
            path.display()
        )));
    }
    Ok(Box::new(Table::create(table, existing)?))
}

/// An error with the frame at which it came.
fn at(frame: &Frame, error: CliError) -> CliError {
    CliError { message: format!("frame {}: {}", frame.frame, error.message), ..error }
}

impl Sink {
    /// What the ending of a path says, which is none of a recording; a folder where there is none.
    fn create(path: &Path, existing: Existing, fields: &FieldsArgs, scene: Option<&Input>) -> Result<Self> {
        Ok(if paths::is_html(path) {
            let text = scene.and_then(Input::text);
            Self::Html(Box::new(Html::create(path, existing, fields, text)?))
        } else if paths::is_vtk(path) {
            Self::Vtk(Box::new(Vtk::create(path, existing, fields)?))
        } else if paths::is_usd(path) {
            Self::Usd(Box::new(Usd::create(path, existing, fields)?))
        } else if paths::is_table(path) {
            Self::Table(Box::new(Table::create(path, existing)?))
        } else {
            let digest = scene.and_then(Input::digest);
            Self::Folder(Box::new(Folder::create(path, existing, fields, digest)?))
        })
    }

    /// Whether a run can go on from what is kept.
    fn is_resumable(&self) -> bool {
        match self {
            Self::Folder(folder) => folder.is_resumable(),
            Self::Tabled(sink, _) => sink.is_resumable(),
            Self::Html(_) | Self::Vtk(_) | Self::Usd(_) | Self::Table(_) => false,
        }
    }

    /// These watch options with what is kept of a session's frames.
    pub(crate) fn watch(&mut self, options: WatchOptions, session: &v1::Session) -> WatchOptions {
        match self {
            Self::Folder(folder) => folder.watch(options, session),
            Self::Html(html) => html.watch(options, session),
            Self::Vtk(vtk) => vtk.watch(options, session),
            Self::Usd(usd) => usd.watch(options, session),
            Self::Table(_) => options,
            Self::Tabled(sink, _) => sink.watch(options, session),
        }
    }

    /// Keeps the topology; it comes before the frames.
    pub(crate) fn topology(&mut self, topology: Topology) {
        match self {
            Self::Folder(folder) => folder.topology(topology),
            Self::Html(html) => html.topology(topology),
            Self::Vtk(vtk) => vtk.topology(topology),
            Self::Usd(usd) => usd.topology(topology),
            Self::Table(table) => table.topology(&topology),
            Self::Tabled(sink, table) => {
                table.topology(&topology);
                sink.topology(topology);
            }
        }
    }

    /// Keeps a frame.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn frame(&mut self, frame: &Frame) -> Result<()> {
        match self {
            // Files of frames have its number in their names.
            Self::Folder(folder) => folder.write(frame),
            Self::Vtk(vtk) => vtk.frame(frame),
            Self::Html(html) => html.frame(frame).map_err(|error| at(frame, error)),
            Self::Usd(usd) => usd.frame(frame).map_err(|error| at(frame, error)),
            Self::Table(table) => table.frame(frame).map_err(|error| at(frame, error)),
            Self::Tabled(sink, table) => {
                sink.frame(frame)?;
                table.frame(frame).map_err(|error| at(frame, error))
            }
        }
    }

    /// Closes it, with how the session ended or why it failed, if it did.
    ///
    /// # Errors
    /// When its end cannot be written.
    pub(crate) fn finish(self, end: Option<SessionEnd>, failure: Option<&v1::Failure>) -> Result<()> {
        match self {
            Self::Folder(folder) => folder.finish(),
            Self::Html(html) => html.finish(end, failure),
            Self::Vtk(vtk) => vtk.finish(),
            Self::Usd(usd) => usd.finish(),
            Self::Table(table) => table.finish(),
            Self::Tabled(sink, table) => {
                // Each gets its end, whatever becomes of the other.
                let ends = [sink.finish(end, failure), table.finish()];
                ends.into_iter().collect()
            }
        }
    }
}
