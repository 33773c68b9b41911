//! Scenes and meshes on disk: the only module of this crate that opens files.
//!
//! The server's programs and the command line both need "load the mesh in this file", so it stands
//! here. None of it may serve a path that came over the network: scenes from clients name uploads.

use std::{
    fs, io,
    path::{Path, PathBuf},
    sync::Arc,
};

use nappe_sim::mesh::TriangleMesh;

use crate::{
    assemble::MeshSource,
    course::{ObjectParameters, SimuParameters},
    error::{ErrorKind, SceneError, SceneErrors},
    mesh::{
        EtiOptions, EtiTexts, Loaded, NamedText, read_eti, read_obj, read_off, read_ply, write_eti,
        write_obj, write_off, write_ply,
    },
    scene::Scene,
};

/// How files are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadOptions {
    /// What to do about errors of `.eti` sets.
    pub eti: EtiOptions,
    /// Bytes of one file.
    pub max_bytes: u64,
}

impl Default for ReadOptions {
    /// Errors are refused; a file has at most 1 GiB.
    fn default() -> Self {
        Self { eti: EtiOptions::default(), max_bytes: 1 << 30 }
    }
}

/// Formats of mesh files.
const FORMATS: &str = ".obj, .off, .ply, points.eti or the folder that holds it";

/// Reads a scene file.
///
/// # Errors
/// A file that cannot be read, or a scene that cannot.
pub fn load_scene(path: &Path) -> Result<Scene, SceneErrors> {
    let bytes = read(path, &ReadOptions { max_bytes: 16 << 20, ..ReadOptions::default() })?;
    let file = path.display().to_string();
    let text = String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = valid.split(|byte| *byte == b'\n').count();
        SceneError::new(ErrorKind::Syntax, &file, "is not UTF-8").at_line(line)
    })?;
    Scene::parse(&text, &file)
}

/// Reads a mesh by its extension: .obj, .off, .ply, or an `.eti` set (its points.eti or its folder).
///
/// # Errors
/// A file that cannot be read, an unknown extension, a mesh that cannot be read.
pub fn load_mesh(path: &Path, options: &ReadOptions) -> Result<Loaded, SceneError> {
    let file = path.display().to_string();
    if path.is_dir() {
        return load_eti_folder(path, options);
    }
    match extension(path).as_str() {
        "obj" => read_obj(&text(path, options)?, &file),
        "off" => read_off(&text(path, options)?, &file),
        "ply" => read_ply(&read(path, options)?, &file),
        "eti" => load_eti_folder(path.parent().unwrap_or(Path::new(".")), options),
        other => Err(SceneError::new(
            ErrorKind::Unsupported,
            &file,
            format!("has the extension '{other}'; allowed: {FORMATS}"),
        )),
    }
}

/// Writes a mesh by its extension; an existing folder, or a name without an extension, becomes the folder of an
/// `.eti` set. Returns the files written.
///
/// # Errors
/// A file that cannot be written, an unknown extension.
pub fn save_mesh(path: &Path, mesh: &TriangleMesh) -> Result<Vec<PathBuf>, SceneError> {
    if path.is_dir() {
        return save_eti(path, mesh);
    }
    let mut bytes = Vec::new();
    let written = match extension(path).as_str() {
        "obj" => write_obj(mesh, &mut bytes),
        "off" => write_off(mesh, &mut bytes),
        "ply" => write_ply(mesh, &mut bytes),
        "" => return save_eti(path, mesh),
        "eti" => return save_eti(path.parent().unwrap_or(Path::new(".")), mesh),
        other => {
            let message = format!("has the extension '{other}'; allowed: {FORMATS}");
            return Err(SceneError::new(ErrorKind::Unsupported, &path.display().to_string(), message));
        }
    };

    written.and_then(|()| fs::write(path, &bytes)).map_err(|error| io_error(path, &error))?;
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
    )
}

/// Reads a simulation file of the course.
///
/// # Errors
/// A file that cannot be read, or an error in it.
pub fn load_simu(path: &Path) -> Result<SimuParameters, SceneError> {
    SimuParameters::parse(&text(path, &ReadOptions::default())?, &path.display().to_string())
}

/// Reads an object file of the course.
///
/// # Errors
/// A file that cannot be read, or an error in it.
pub fn load_object_parameters(path: &Path) -> Result<ObjectParameters, SceneError> {
    ObjectParameters::parse(&text(path, &ReadOptions::default())?, &path.display().to_string())
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
}

fn load_eti_folder(folder: &Path, options: &ReadOptions) -> Result<Loaded, SceneError> {
    let existing = |name: &str| Some(folder.join(name)).filter(|path| path.exists());
    load_eti(
        &folder.join("points.eti"),
        existing("faceset.eti").as_deref(),
        existing("masses.eti").as_deref(),
        existing("texcoord.eti").as_deref(),
        options,
    )
}

fn load_eti(
    points: &Path,
    faceset: Option<&Path>,
    masses: Option<&Path>,
    texcoord: Option<&Path>,
    options: &ReadOptions,
) -> Result<Loaded, SceneError> {
    let named = |path: &Path| Ok::<_, SceneError>((path.display().to_string(), text(path, options)?));
    let points = named(points)?;
    let others = [faceset, masses, texcoord];
    let [faceset, masses, texcoord] = others.map(|path| path.map(named).transpose());
    let (faceset, masses, texcoord) = (faceset?, masses?, texcoord?);
    let texts = EtiTexts {
        points: NamedText { file: &points.0, text: &points.1 },
        faceset: faceset.as_ref().map(|(file, text)| NamedText { file, text }),
        masses: masses.as_ref().map(|(file, text)| NamedText { file, text }),
        texcoord: texcoord.as_ref().map(|(file, text)| NamedText { file, text }),
    };

    read_eti(&texts, &options.eti)
}

fn save_eti(folder: &Path, mesh: &TriangleMesh) -> Result<Vec<PathBuf>, SceneError> {
    fs::create_dir_all(folder).map_err(|error| io_error(folder, &error))?;
    let set = write_eti(mesh);
    let files = [
        ("points.eti", Some(set.points)),
        ("faceset.eti", Some(set.faceset)),
        ("masses.eti", set.masses),
        ("texcoord.eti", set.texcoord),
    ];
    let mut written = Vec::new();
    for (name, text) in files {
        let Some(text) = text else { continue };
        let path = folder.join(name);
        fs::write(&path, text).map_err(|error| io_error(&path, &error))?;
        written.push(path);
    }

    Ok(written)
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Text of a mesh or parameter file: comments may be in any encoding, numbers are ASCII.
fn text(path: &Path, options: &ReadOptions) -> Result<String, SceneError> {
    Ok(String::from_utf8_lossy(&read(path, options)?).into_owned())
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
