//! Scenes and meshes on disk: the only module of this crate that opens files.
//!
//! The server's programs and the command line both need "load the mesh in this file", so it stands
//! here. None of it may serve a path that came over the network: scenes from clients name uploads.

use std::{
    fs::{self, File},
    io::{self, Write as _},
    path::{Path, PathBuf},
    sync::Arc,
};

use nappe_sim::mesh::{MeshSpring, TriangleMesh};

use crate::{
    assemble::MeshSource,
    course::{ObjectParameters, SimuParameters},
    error::{ErrorKind, SceneError, SceneErrors},
    mesh::{
        EtiOptions, EtiTexts, Loaded, MeshFile, NamedText, PointFrames, endings, gzip, read_eti, read_pc2,
        read_springs_csv, text, write_eti, write_obj, write_off, write_ply,
    },
    scene::Scene,
    utf8::utf8,
};

/// How files are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadOptions {
    /// What to do about errors of `.eti` sets.
    pub eti: EtiOptions,
    /// Bytes of one file, also once gzip has unpacked it.
    pub max_bytes: u64,
}

impl Default for ReadOptions {
    /// Errors are refused; a file has at most 1 GiB.
    fn default() -> Self {
        Self { eti: EtiOptions::default(), max_bytes: 1 << 30 }
    }
}

/// Reads a scene file.
///
/// # Errors
/// A file that cannot be read, or a scene that cannot.
pub fn load_scene(path: &Path) -> Result<Scene, SceneErrors> {
    Scene::parse(&read_scene(path)?, &path.display().to_string())
}

/// Reads the text of a scene file, of at most 16 MiB.
///
/// # Errors
/// A file that cannot be read, or is not UTF-8.
pub fn read_scene(path: &Path) -> Result<String, SceneError> {
    let bytes = read(path, &ReadOptions { max_bytes: 16 << 20, ..ReadOptions::default() })?;
    utf8(&bytes, &path.display().to_string())
}

/// Reads a mesh by its extension: .obj, .off, .ply or .stl, also as gzip has packed it (.obj.gz, or by its first bytes),
/// or an `.eti` set (its points.eti or its folder).
///
/// # Errors
/// A file that cannot be read, an unknown extension, a mesh that cannot be read.
pub fn load_mesh(path: &Path, options: &ReadOptions) -> Result<Loaded, SceneError> {
    load_mesh_and_tell(path, options, &mut |_, _| {})
}

/// The same, and calls `tell` with the path and the bytes of each file that is read, as they are on disk. An `.eti` set has
/// several files.
///
/// # Errors
/// As [`load_mesh`].
pub fn load_mesh_and_tell(
    path: &Path,
    options: &ReadOptions,
    tell: &mut dyn FnMut(&Path, &[u8]),
) -> Result<Loaded, SceneError> {
    let file = path.display().to_string();
    if path.is_dir() {
        return load_eti_folder(path, options, tell);
    }
    let is_packed = extension(path) == "gz";
    let ending = if is_packed { extension(&path.with_extension("")) } else { extension(path) };
    let mut bytes = || {
        let bytes = read(path, options)?;
        tell(path, &bytes);
        gzip::unpacked(bytes, options.max_bytes, &file)
    };
    match ending.as_str() {
        "obj" => MeshFile::Obj(&bytes()?).read(&file),
        "off" => MeshFile::Off(&bytes()?).read(&file),
        "ply" => MeshFile::Ply(&bytes()?).read(&file),
        "stl" => MeshFile::Stl(&bytes()?).read(&file),
        "eti" if !is_packed => load_eti_folder(path.parent().unwrap_or(Path::new(".")), options, tell),
        other => {
            let ending = if is_packed { format!("{other}.gz") } else { other.to_owned() };
            Err(SceneError::new(ErrorKind::Unsupported, &file, endings::not_read(&ending)))
        }
    }
}

/// Reads the springs of a mesh of so many points from a table ([`read_springs_csv`]).
///
/// # Errors
/// A file that cannot be read, or an error in it.
pub fn load_springs(
    path: &Path,
    points: usize,
    options: &ReadOptions,
) -> Result<Vec<MeshSpring>, SceneError> {
    read_springs_csv(&load_text(path, options)?, &path.display().to_string(), points)
}

/// Reads the text of a file of parameters or springs.
///
/// # Errors
/// A file that cannot be read, or is no text.
pub fn load_text(path: &Path, options: &ReadOptions) -> Result<String, SceneError> {
    Ok(text::text(&read(path, options)?, &path.display().to_string())?.into_owned())
}

/// Reads frames of points from a PC2 file ([`read_pc2`]).
///
/// # Errors
/// A file that cannot be read, or an error in it.
pub fn load_frames(path: &Path, options: &ReadOptions) -> Result<PointFrames, SceneError> {
    read_pc2(&read(path, options)?, &path.display().to_string())
}

/// What becomes of a file that is there where one is to be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// It stays, and nothing is written.
    Kept,
    /// It is overwritten.
    Overwritten,
}

/// Makes a file, empty. A device or a pipe holds nothing that could be lost, and is opened as it is.
///
/// # Errors
/// Those of the system; [`io::ErrorKind::AlreadyExists`] where a file stays.
pub fn create(path: &Path, existing: Existing) -> io::Result<File> {
    let is_special = fs::metadata(path).is_ok_and(|there| !there.is_file());
    let mut options = File::options();
    options.write(true);
    if existing == Existing::Kept && !is_special {
        options.create_new(true);
    } else {
        options.create(true).truncate(true);
    }
    options.open(path)
}

/// Writes a mesh by its extension; an existing folder, or a name without an extension, becomes the folder of an
/// `.eti` set. Returns the files written.
///
/// # Errors
/// A file that cannot be written, one that stays ([`ErrorKind::Exists`]), an unknown extension.
pub fn save_mesh(path: &Path, mesh: &TriangleMesh, existing: Existing) -> Result<Vec<PathBuf>, SceneError> {
    if path.is_dir() {
        return save_eti(path, mesh, existing);
    }
    let mut bytes = Vec::new();
    let written = match extension(path).as_str() {
        "obj" => write_obj(mesh, &mut bytes),
        "off" => write_off(mesh, &mut bytes),
        "ply" => write_ply(mesh, &mut bytes),
        "" => return save_eti(path, mesh, existing),
        "eti" => return save_eti(path.parent().unwrap_or(Path::new(".")), mesh, existing),
        other => {
            let message = format!("has the extension '{other}'; allowed: {}", endings::WRITTEN);
            return Err(SceneError::new(ErrorKind::Unsupported, &path.display().to_string(), message));
        }
    };

    written.map_err(|error| io_error(path, &error))?;
    write(path, &bytes, existing)?;
    Ok(vec![path.to_owned()])
}

/// Reads the `.eti` set that an object file names; its paths are relative to `folder`.
///
/// # Errors
/// A file that cannot be read, or an error in one.
pub fn load_object(
    object: &ObjectParameters,
    folder: &Path,
    options: &ReadOptions,
) -> Result<Loaded, SceneError> {
    let join = |name: &Option<String>| name.as_ref().map(|name| folder.join(name));
    load_eti(
        &folder.join(&object.points),
        join(&object.faceset).as_deref(),
        Some(&folder.join(&object.masses)),
        join(&object.textures).as_deref(),
        options,
        &mut |_, _| {},
    )
}

/// Reads a simulation file of the course.
///
/// # Errors
/// A file that cannot be read, or an error in it.
pub fn load_simu(path: &Path) -> Result<SimuParameters, SceneError> {
    SimuParameters::parse(&load_text(path, &ReadOptions::default())?, &path.display().to_string())
}

/// Reads an object file of the course.
///
/// # Errors
/// A file that cannot be read, or an error in it.
pub fn load_object_parameters(path: &Path) -> Result<ObjectParameters, SceneError> {
    ObjectParameters::parse(&load_text(path, &ReadOptions::default())?, &path.display().to_string())
}

/// Mesh files beside a scene file, for scenes of the user's own; no uploads.
#[derive(Clone, Debug)]
pub struct Folder {
    /// Where relative paths start.
    pub folder: PathBuf,
    /// How files are read.
    pub options: ReadOptions,
}

impl MeshSource for Folder {
    fn upload(&self, _: &str) -> Option<Arc<TriangleMesh>> {
        None
    }

    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError> {
        load_mesh(&self.folder.join(path), &self.options).map(|loaded| loaded.mesh)
    }

    fn frames_file(&self, path: &str) -> Result<PointFrames, SceneError> {
        load_frames(&self.folder.join(path), &self.options)
    }

    fn springs_file(&self, path: &str, points: usize) -> Result<Vec<MeshSpring>, SceneError> {
        load_springs(&self.folder.join(path), points, &self.options)
    }
}

fn load_eti_folder(
    folder: &Path,
    options: &ReadOptions,
    tell: &mut dyn FnMut(&Path, &[u8]),
) -> Result<Loaded, SceneError> {
    let existing = |name: &str| Some(folder.join(name)).filter(|path| path.exists());
    load_eti(
        &folder.join("points.eti"),
        existing("faceset.eti").as_deref(),
        existing("masses.eti").as_deref(),
        existing("texcoord.eti").as_deref(),
        options,
        tell,
    )
}

fn load_eti(
    points: &Path,
    faceset: Option<&Path>,
    masses: Option<&Path>,
    texcoord: Option<&Path>,
    options: &ReadOptions,
    tell: &mut dyn FnMut(&Path, &[u8]),
) -> Result<Loaded, SceneError> {
    let mut named = |path: &Path| {
        let (file, bytes) = (path.display().to_string(), read(path, options)?);
        tell(path, &bytes);
        let text = text::text(&bytes, &file)?.into_owned();
        Ok::<_, SceneError>((file, text))
    };
    let points = named(points)?;
    let others = [faceset, masses, texcoord];
    let [faceset, masses, texcoord] = others.map(|path| path.map(&mut named).transpose());
    let (faceset, masses, texcoord) = (faceset?, masses?, texcoord?);
    let texts = EtiTexts {
        points: NamedText { file: &points.0, text: &points.1 },
        faceset: faceset.as_ref().map(|(file, text)| NamedText { file, text }),
        masses: masses.as_ref().map(|(file, text)| NamedText { file, text }),
        texcoord: texcoord.as_ref().map(|(file, text)| NamedText { file, text }),
    };

    read_eti(&texts, &options.eti)
}

/// Writes a set. Of one that is there nothing is left beside it: its masses would be taken for those of the new one.
fn save_eti(folder: &Path, mesh: &TriangleMesh, existing: Existing) -> Result<Vec<PathBuf>, SceneError> {
    fs::create_dir_all(folder).map_err(|error| io_error(folder, &error))?;
    let set = write_eti(mesh);
    let files = [
        ("points.eti", Some(set.points)),
        ("faceset.eti", Some(set.faceset)),
        ("masses.eti", set.masses),
        ("texcoord.eti", set.texcoord),
    ];
    for path in files.iter().map(|(name, _)| folder.join(name)).filter(|path| path.is_file()) {
        match existing {
            Existing::Kept => return Err(stays(&path)),
            Existing::Overwritten => fs::remove_file(&path).map_err(|error| io_error(&path, &error))?,
        }
    }
    let mut written = Vec::new();
    for (name, text) in files {
        let Some(text) = text else { continue };
        let path = folder.join(name);
        write(&path, text.as_bytes(), existing)?;
        written.push(path);
    }

    Ok(written)
}

fn write(path: &Path, bytes: &[u8], existing: Existing) -> Result<(), SceneError> {
    let written = create(path, existing).and_then(|mut file| file.write_all(bytes));
    written.map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => stays(path),
        _ => io_error(path, &error),
    })
}

/// A file that is there and stays.
fn stays(path: &Path) -> SceneError {
    SceneError::new(ErrorKind::Exists, &path.display().to_string(), "is there already")
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

fn read(path: &Path, options: &ReadOptions) -> Result<Vec<u8>, SceneError> {
    let size = fs::metadata(path).map_err(|error| io_error(path, &error))?.len();
    if size > options.max_bytes {
        let message = format!("has {size} bytes; allowed: at most {}", options.max_bytes);
        return Err(SceneError::new(ErrorKind::TooLarge, &path.display().to_string(), message));
    }
    fs::read(path).map_err(|error| io_error(path, &error))
}

fn io_error(path: &Path, error: &io::Error) -> SceneError {
    SceneError::new(ErrorKind::Io, &path.display().to_string(), error.to_string())
}
