//! Files of a study: the folder that they are written into, tables and pictures.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use crate::{
    error::{CliError, Result},
    write::{self, Existing},
};

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

    /// Writes files, each of them whole; their paths. Nothing of an earlier study is left beside them.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn write(&self, files: impl Iterator<Item = (String, Vec<u8>)>) -> Result<Vec<PathBuf>> {
        let mut written = Vec::new();
        for (name, bytes) in files {
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

/// Says where files are.
pub(crate) fn told(written: &[PathBuf]) -> String {
    let paths: Vec<_> = written.iter().map(|path| path.display().to_string()).collect();
    format!("Written: {}", paths.join(", "))
}

/// Each picture as SVG and PNG.
#[cfg(feature = "charts")]
pub(crate) fn of_pictures(pictures: Vec<nappe_charts::Picture>) -> Vec<(String, Vec<u8>)> {
    let files = |picture: nappe_charts::Picture| {
        [
            (format!("{}.svg", picture.name), picture.svg.into_bytes()),
            (format!("{}.png", picture.name), picture.png),
        ]
    };
    pictures.into_iter().flat_map(files).collect()
}

/// Says that this build draws nothing.
#[cfg(not(feature = "charts"))]
pub(crate) fn note_without_pictures() {
    crate::output::note("no pictures: this command was built without its feature `charts`");
}

/// A field of comma-separated values, in quotes where it needs them (RFC 4180).
pub(crate) fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

/// The fields of a row of comma-separated values, as they were before they were quoted.
pub(crate) fn fields(row: &str) -> Vec<String> {
    let (mut fields, mut field, mut is_quoted) = (Vec::new(), String::new(), false);
    let mut letters = row.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if is_quoted && letters.next_if_eq(&'"').is_some() => field.push('"'),
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => fields.push(std::mem::take(&mut field)),
            letter => field.push(letter),
        }
    }
    fields.push(field);
    fields
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_end_a_field_is_quoted_and_read_back() {
        assert_eq!(quoted("plain"), "plain");
        assert_eq!(quoted("a, \"b\""), "\"a, \"\"b\"\"\"");
        for row in [&["plain", "", "a, \"b\"", "[1,2]"][..], &["\"", "\"\"", ","], &[""]] {
            let text: Vec<String> = row.iter().map(|field| quoted(field)).collect();
            assert_eq!(fields(&text.join(",")), row);
        }
    }
}
