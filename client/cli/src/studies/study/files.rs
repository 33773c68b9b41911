//! Files of a study: the folder that they are written into, a table, a document and pictures.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use serde::Serialize;

use super::look::LookArgs;
use crate::{
    files::write::{self, Existing},
    words::{
        error::{CliError, Result},
        output::{self, Format},
    },
};

/// Pictures, or why there are none.
#[cfg(feature = "charts")]
pub(crate) type Drawn = std::result::Result<Vec<nappe_charts::Picture>, String>;

/// What a study leaves.
pub(crate) struct Contents<'a, D> {
    /// Name of the table and of the document, without extension.
    pub(crate) name: &'a str,
    /// Its rows as CSV, with a line of names first.
    pub(crate) table: String,
    /// What is written as JSON, if anything is.
    pub(crate) document: Option<D>,
    /// Draws its pictures.
    #[cfg(feature = "charts")]
    pub(crate) draw: &'a dyn Fn(&nappe_charts::Style) -> Drawn,
}

/// The folder of a study's files.
pub(crate) struct Folder {
    path: PathBuf,
    /// What a study may write, without extensions.
    names: &'static [&'static str],
    existing: Existing,
}

impl Folder {
    /// Makes it, where there is none, and checks that files of these names, without extension, can be written into it.
    ///
    /// # Errors
    /// A path that is a file, or that cannot be written; a file that is there and stays.
    pub(crate) fn open(path: PathBuf, names: &'static [&'static str], existing: Existing) -> Result<Self> {
        check_folder(&path)?;
        let folder = Self { path, names, existing };
        folder.files().iter().try_for_each(|file| write::check(file, existing))?;
        Ok(folder)
    }

    /// Files of these names.
    fn files(&self) -> Vec<PathBuf> {
        let of = |name: &&str| {
            ["csv", "json", "svg", "png"].map(|extension| self.path.join(format!("{name}.{extension}")))
        };
        self.names.iter().flat_map(of).collect()
    }

    /// Writes what a study leaves, each file whole; their paths. Nothing of an earlier study is left beside them.
    ///
    /// # Errors
    /// What cannot be drawn, and a file that cannot be written.
    pub(crate) fn write<D: Serialize>(
        &self,
        look: &LookArgs,
        contents: Contents<'_, D>,
    ) -> Result<Vec<PathBuf>> {
        let pictures = contents.pictures(look)?;
        let Contents { name, table, document, .. } = contents;
        let mut files = vec![(format!("{name}.csv"), table.into_bytes())];
        if let Some(document) = document {
            let text = serde_json::to_string_pretty(&document)
                .map_err(|error| CliError::failure(format!("cannot write {name}.json: {error}")))?;
            files.push((format!("{name}.json"), (text + "\n").into_bytes()));
        }
        let mut written = Vec::new();
        for (name, bytes) in files.into_iter().chain(pictures) {
            let path = self.path.join(name);
            write::write_whole(&path, &bytes, self.existing)?;
            written.push(path);
        }
        if self.existing == Existing::Overwritten {
            for old in self.files().iter().filter(|file| file.is_file() && !written.contains(file)) {
                fs::remove_file(old).map_err(|error| CliError::file("remove", old, &error))?;
            }
        }
        Ok(written)
    }
}

/// Makes a folder, where there is none, and checks that files can be written into it.
///
/// # Errors
/// A path that is a file, or that cannot be written.
pub(crate) fn check_folder(folder: &Path) -> Result<()> {
    if folder.is_file() {
        return Err(CliError::usage(format!("--out {}: is a file; a folder is needed", folder.display())));
    }
    fs::create_dir_all(folder).map_err(|error| CliError::file("make the folder", folder, &error))?;
    let probe = folder.join(".nappe-study");
    let probed = fs::write(&probe, []).and_then(|()| match fs::remove_file(&probe) {
        // Another study that begins here has removed it.
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        removed => removed,
    });
    probed.map_err(|error| CliError::file("write into", folder, &error))
}

impl<D> Contents<'_, D> {
    /// Its pictures as files.
    #[cfg(feature = "charts")]
    fn pictures(&self, look: &LookArgs) -> Result<Vec<(String, Vec<u8>)>> {
        of_pictures(self.name, (self.draw)(&look.style()))
    }

    /// None: this build draws nothing, and says so.
    #[cfg(not(feature = "charts"))]
    fn pictures(&self, _: &LookArgs) -> Result<Vec<(String, Vec<u8>)>> {
        note_without_pictures();
        Ok(Vec::new())
    }
}

/// Pictures of what has a name as files, each as SVG and PNG.
///
/// # Errors
/// Why there are none.
#[cfg(feature = "charts")]
pub(crate) fn of_pictures(name: &str, drawn: Drawn) -> Result<Vec<(String, Vec<u8>)>> {
    let pictures =
        drawn.map_err(|error| CliError::failure(format!("cannot draw the pictures of {name}: {error}")))?;
    let files = |picture: nappe_charts::Picture| {
        [
            (format!("{}.svg", picture.name), picture.svg.into_bytes()),
            (format!("{}.png", picture.name), picture.png),
        ]
    };
    Ok(pictures.into_iter().flat_map(files).collect())
}

/// Says that this build draws nothing.
#[cfg(not(feature = "charts"))]
pub(crate) fn note_without_pictures() {
    output::note("no pictures: this command was built without its feature `charts`");
}

/// Says what was found: to programs one object, to people words, and where the files are.
///
/// # Errors
/// When standard output cannot be written.
pub(crate) fn say(format: Format, json: &impl Serialize, words: &str, written: &[PathBuf]) -> Result<()> {
    if format == Format::Json {
        return output::json(json);
    }
    let paths: Vec<_> = written.iter().map(|path| path.display().to_string()).collect();
    let told = format!("Written: {}", paths.join(", "));
    output::line(&if words.is_empty() { told } else { format!("{words}\n{told}") })
}
