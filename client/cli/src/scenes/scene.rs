//! Scenes as the command line names them: a shipped name or a file.
//!
//! Reads scene files and the meshes beside them; sends the meshes to the server and writes their
//! ids into the scene, so that a server never opens a client's files.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use nappe_client::{Client, ClientError, CreateSession, MeshFile, Scene as Sent, v1};
use nappe_scene::{Body, ColliderText, Mesh, Scene, files, suggestion};
use nappe_sim::mesh::TriangleMesh;
use serde::Serialize;
use xxhash_rust::xxh3::Xxh3;

use crate::{
    files::paths,
    options::args::OverrideArgs,
    scenes::{mesh_files::MeshFiles, meshes},
    words::{
        error::{CliError, Result},
        output,
    },
};

/// A scene that comes with nappe.
#[derive(Debug, Serialize)]
pub(crate) struct Shipped {
    /// Name for the command line.
    pub(crate) name: &'static str,
    /// Title, as the scene has it.
    pub(crate) title: String,
    /// Steps to its end; 0: it has none.
    pub(crate) steps: u64,
}

/// The scenes that come with nappe.
///
/// # Errors
/// When one does not read, which would be an error in this program.
pub(crate) fn shipped() -> Result<Vec<Shipped>> {
    nappe_scene::shipped_scenes()
        .iter()
        .map(|(name, text)| {
            let scene = Scene::parse(text, name)?;
            Ok(Shipped { name, title: scene.title, steps: scene.steps })
        })
        .collect()
}

/// The text of a shipped scene.
///
/// # Errors
/// When there is none of this name.
pub(crate) fn shipped_text(name: &str) -> Result<&'static str> {
    let scenes = nappe_scene::shipped_scenes();
    scenes.iter().find(|(known, _)| *known == name).map(|(_, text)| *text).ok_or_else(|| {
        let near = suggestion(name, scenes.iter().map(|(name, _)| *name));
        let file = format!("{name}.toml");
        let hint = if Path::new(&file).is_file() {
            format!("there is a file {file}, which is named with its ending")
        } else {
            "`nappe scenes` lists them; a scene of your own is a file: its path ends in .toml".to_owned()
        };
        CliError::failure(format!("no scene '{name}' comes with nappe; {near}")).hint(hint)
    })
}

/// The text of a scene file.
///
/// # Errors
/// When it cannot be read; a file that is not there and is called as a shipped scene is told so.
pub(crate) fn file_text(path: &Path) -> Result<String> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
    let shipped = nappe_scene::shipped_scenes().iter().find(|(name, _)| *name == stem);
    match shipped {
        Some((name, _)) if !path.exists() => Err(CliError::failure(format!(
            "there is no file {}; '{name}' is a scene that comes with nappe, and is named without an ending",
            path.display()
        ))),
        _ => Ok(files::read_scene(path)?),
    }
}

/// Who must know the name of a shipped scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Names {
    /// This command, so that a name is checked before anything starts.
    Ours,
    /// The server that it talks to, which may ship other scenes.
    Servers,
}

/// A saved frame at which a session of a scene is to begin.
#[derive(Debug)]
pub(crate) struct Begun {
    /// Where it was saved.
    pub(crate) file: PathBuf,
    /// What a server is told of it.
    pub(crate) begin: v1::Begin,
}

/// A scene to be computed.
#[derive(Debug)]
pub(crate) enum Input {
    /// A shipped scene.
    Named(String),
    /// A scene with its meshes.
    Written(Box<Written>),
}

/// A scene read and checked, with its meshes.
#[derive(Debug)]
pub(crate) struct Written {
    /// As the command line names it.
    name: String,
    scene: Scene,
    /// The text as it was written; a server's messages then have the lines of the file.
    text: String,
    /// Whether there is such a file, or the program made the text.
    origin: Origin,
    /// Meshes to send.
    meshes: MeshFiles,
    /// Files of frames to send, by the path in the scene.
    frames: BTreeMap<String, MeshFile>,
}

/// Where the text of a scene comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Origin {
    /// A file that the command line names.
    File,
    /// This program: nobody sees its lines.
    Program,
}

impl Input {
    /// A shipped scene by its name, or a file by a path that ends in `.toml`.
    ///
    /// # Errors
    /// When there is no such scene, or it or a mesh of it cannot be read.
    pub(crate) fn read(name: &str, names: Names) -> Result<Self> {
        let path = Path::new(name);
        if paths::is_scene(path) {
            let text = file_text(path)?;
            return Written::parse(name, text, path.parent().unwrap_or(Path::new("")), &[]);
        }
        if names == Names::Ours {
            shipped_text(name)?;
        }
        Ok(Self::Named(name.to_owned()))
    }

    /// The same with values in place of others, by their keys; a shipped scene is the one of this command.
    ///
    /// # Errors
    /// As [`Self::read`]; a key that is set twice, that the scene lacks or whose value its schema does not allow.
    pub(crate) fn with_values(name: &str, values: &[(String, String)]) -> Result<Self> {
        let mut keys = BTreeSet::new();
        if let Some(twice) = values.iter().find(|set| !keys.insert(&set.0)) {
            return Err(CliError::usage(format!("--set {}: the key is set twice", twice.0)));
        }
        let path = Path::new(name);
        let is_file = paths::is_scene(path);
        let text = if is_file { file_text(path)? } else { shipped_text(name)?.to_owned() };
        Written::parse(name, text, path.parent().unwrap_or(Path::new("")), values)
    }

    /// A scene made by the program, with its meshes by the path that it names.
    pub(crate) fn made(name: String, scene: Scene, meshes: BTreeMap<String, TriangleMesh>) -> Self {
        let (text, origin, meshes) = (scene.to_toml(), Origin::Program, MeshFiles::without_tables(meshes));
        Self::Written(Box::new(Written { name, scene, text, origin, meshes, frames: BTreeMap::new() }))
    }

    /// The scene as the command line names it.
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Named(name) => name,
            Self::Written(written) => &written.name,
        }
    }

    /// The scene's text, where this command has it.
    pub(crate) fn text(&self) -> Option<&str> {
        match self {
            Self::Named(name) => shipped_text(name).ok(),
            Self::Written(written) => Some(&written.text),
        }
    }

    /// Steps to the scene's end, where this command has its text; 0: it has none.
    pub(crate) fn steps(&self) -> Option<u64> {
        match self {
            Self::Named(name) => Some(Scene::parse(shipped_text(name).ok()?, name).ok()?.steps),
            Self::Written(written) => Some(written.scene.steps),
        }
    }

    /// What the scene and its meshes are known by, 16 hexadecimal digits, where this command has them: others have other ones.
    pub(crate) fn digest(&self) -> Option<String> {
        let mut hasher = Xxh3::new();
        hasher.update(self.text()?.as_bytes());
        if let Self::Written(written) = self {
            written.meshes.add_to(&mut hasher);
            for (file, frames) in &written.frames {
                hasher.update(file.as_bytes());
                hasher.update(&frames.file);
            }
        }
        Some(output::hash(hasher.digest()))
    }

    /// Makes a session of the scene on a server, which gets its meshes first; tells what is odd about it. With an empty
    /// id, the server chooses one. It begins at the start of the scene, or at a frame.
    ///
    /// # Errors
    /// When the server refuses a mesh, the scene or the frame.
    pub(crate) async fn create(
        &self,
        client: &Client,
        id: String,
        overrides: &OverrideArgs,
        begun: Option<&Begun>,
    ) -> Result<v1::Session> {
        let sent = match self {
            Self::Named(name) => Sent::Named(name.clone()),
            Self::Written(written) => Sent::Text(written.send(client).await?),
        };
        let begin = begun.map(|begun| begun.begin.clone());
        let wanted = CreateSession { begin, ..overrides.session(id, sent) };
        let created = client.create_session(wanted).await;
        let created = created.map_err(|error| match begun {
            Some(begun) => begun.refused(error).unwrap_or_else(|error| self.refused(error)),
            None => self.refused(error),
        })?;
        let named = |warning: &String| self.with_file(&self.as_named(warning));
        let warnings: Vec<_> = created.warnings.iter().map(named).collect();
        meshes::note(&warnings);
        Ok(created.session)
    }

    /// A warning about a body or a collider, with the file of its mesh if it has one.
    fn with_file(&self, warning: &str) -> String {
        let Self::Written(written) = self else { return warning.to_owned() };
        let named = |what: &str, name: &str, mesh: &Mesh| {
            let Mesh::File { file, .. } = mesh else { return None };
            let name = format!("{what} '{name}'");
            let rest = warning.strip_prefix(&name)?.strip_prefix(": ")?;
            Some(format!("{name} ({file}): {rest}"))
        };
        let of_body = |body: &Body| named("body", &body.name, &body.mesh);
        let of_collider = |collider: &ColliderText| named("collider", &collider.name, &collider.mesh()?.mesh);
        let Scene { bodies, colliders, .. } = &written.scene;
        let found = bodies.iter().find_map(of_body).or_else(|| colliders.iter().find_map(of_collider));
        found.unwrap_or_else(|| warning.to_owned())
    }

    /// A refusal of the scene, in which it is called as the command line calls it.
    fn refused(&self, error: ClientError) -> CliError {
        match error {
            ClientError::Server(mut refusal) if refusal.metadata.contains_key("violation") => {
                refusal.message = self.as_named(&refusal.message);
                ClientError::Server(refusal).into()
            }
            error => error.into(),
        }
    }

    /// What a server says of the scene, with its name here: a server sees its text alone and calls it `scene`.
    fn as_named(&self, said: &str) -> String {
        let Self::Written(written) = self else { return said.to_owned() };
        let Written { name, origin, .. } = written.as_ref();
        let named = |line: &str| match (line.strip_prefix("scene:"), origin) {
            (None, _) => line.to_owned(),
            (Some(rest), Origin::File) => format!("{name}:{rest}"),
            (Some(rest), Origin::Program) => {
                let place = |c: char| c.is_ascii_digit() || c == ':';
                format!("{name}: {}", rest.trim_start_matches(place).trim_start())
            }
        };
        said.lines().map(named).collect::<Vec<_>>().join("\n")
    }
}

impl Begun {
    /// A refusal of the frame, in which it is called by its file; or one of something else.
    fn refused(&self, error: ClientError) -> std::result::Result<CliError, ClientError> {
        let said = error.server().and_then(|refusal| {
            let field = refusal.metadata.get("field").filter(|field| field.starts_with("begin"))?;
            Some(refusal.message.strip_prefix(field.as_str())?.to_owned())
        });
        match said {
            Some(said) => Ok(CliError::failure(format!("{}{said}", self.file.display()))),
            None => Err(error),
        }
    }
}

impl Written {
    /// Reads a scene with its meshes. With other values its text is made by this program.
    fn parse(name: &str, text: String, folder: &Path, values: &[(String, String)]) -> Result<Input> {
        let mut scene = Scene::parse(&text, name)?;
        if !values.is_empty() {
            let changed = scene.with_values(values);
            scene = changed.map_err(|error| CliError::usage(format!("{name}: {error}")))?;
        }
        let meshes = MeshFiles::read(&scene, folder)?;
        let mut frames = BTreeMap::new();
        for file in scene.frame_files() {
            frames.insert(file.to_owned(), meshes::read_frames(&folder.join(file))?);
        }
        let (mut text, mut origin) = (text, Origin::File);
        if !values.is_empty() {
            (text, origin) = (scene.to_toml(), Origin::Program);
            scene = Scene::parse(&text, name)?;
        }
        let name = name.to_owned();
        Ok(Input::Written(Box::new(Self { name, scene, text, origin, meshes, frames })))
    }

    /// Sends the meshes and the frames; the text that then names them by their ids.
    async fn send(&self, client: &Client) -> Result<String> {
        let (meshes, mut frames) = (self.meshes.send(client).await?, BTreeMap::new());
        for (file, bytes) in &self.frames {
            frames.insert(file.as_str(), client.upload_file(bytes).await?.mesh_id);
        }
        if meshes.is_empty() && frames.is_empty() {
            return Ok(self.text.clone());
        }
        let id_of =
            |file: &str, table: Option<&str>| meshes.get(file, table).or_else(|| frames.get(file).cloned());
        Ok(self.scene.text_with_uploads(id_of))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_server_s_messages_have_the_name_of_the_file_and_no_lines_of_a_text_that_nobody_sees() {
        let written = |origin| {
            let made = Input::made("drap.toml".to_owned(), Scene::default(), BTreeMap::new());
            let Input::Written(made) = made else { unreachable!("a scene that was made") };
            Input::Written(Box::new(Written { origin, ..*made }))
        };
        let said = "scene:21:1: dt: is 2; allowed: 1\nscene: mesh: scene:3 is odd\na.obj:1: is empty";
        assert_eq!(
            written(Origin::File).as_named(said),
            "drap.toml:21:1: dt: is 2; allowed: 1\ndrap.toml: mesh: scene:3 is odd\na.obj:1: is empty"
        );
        assert_eq!(
            written(Origin::Program).as_named(said),
            "drap.toml: dt: is 2; allowed: 1\ndrap.toml: mesh: scene:3 is odd\na.obj:1: is empty"
        );
        assert_eq!(Input::Named("flag".to_owned()).as_named("flag:3:1: x"), "flag:3:1: x");
    }
}
