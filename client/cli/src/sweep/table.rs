//! The rows of a sweep on disk: one line as each run ends, sorted in the end. Started again, it goes on where it was.

use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions},
    io::{self, Write as _},
    path::{Path, PathBuf},
};

use serde_json::Value;

use super::run::COLUMNS;
use crate::{
    error::{CliError, Result},
    study::files::quoted,
    write::{self, Existing},
};

/// Rows of a sweep in a folder.
pub(crate) struct Table {
    path: PathBuf,
    header: String,
    file: File,
    /// Lines by the numbers of their runs.
    lines: BTreeMap<usize, String>,
}

impl Table {
    /// Begins a sweep in a folder, or goes on with one of the same description where that is not to be overwritten.
    ///
    /// # Errors
    /// A folder that holds another sweep, which stays, and files that cannot be read or written.
    pub(crate) fn open(
        folder: &Path,
        description: &Value,
        keys: &[&str],
        existing: Existing,
    ) -> Result<Self> {
        let told = folder.join("sweep.json");
        let path = folder.join("sweep.csv");
        let text = format!("{description:#}\n");
        match fs::read_to_string(&told) {
            Ok(there) if existing == Existing::Kept && there == text => {}
            Ok(_) if existing == Existing::Kept => {
                return Err(CliError::usage(format!(
                    "--out {}: holds another sweep, of other arguments or of another version: --force overwrites it",
                    folder.display()
                )));
            }
            _ => {
                clear(folder, existing)?;
                write::write(&told, text.as_bytes(), existing)?;
            }
        }
        let columns: Vec<String> =
            ["run"].iter().chain(keys).chain(COLUMNS.iter()).map(|name| quoted(name)).collect();
        let header = columns.join(",") + "\n";
        let mut table = Self { lines: lines(&path, &header), file: writer(&path)?, path, header };
        // A line that was cut off is made again.
        table.rewrite()?;
        Ok(table)
    }

    /// Whether a run has its line.
    pub(crate) fn has(&self, run: usize) -> bool {
        self.lines.contains_key(&run)
    }

    /// How many runs have their lines.
    pub(crate) fn len(&self) -> usize {
        self.lines.len()
    }

    /// How many runs came to their end: they have no cause.
    pub(crate) fn ok_count(&self) -> usize {
        self.lines.values().filter(|line| line.contains(",ok,,")).count()
    }

    /// Adds the line of a run.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn add(&mut self, run: usize, fields: &[String]) -> Result<()> {
        let line = format!("{run},{}\n", fields.join(","));
        let written = self.file.write_all(line.as_bytes()).and_then(|()| self.file.flush());
        written.map_err(|error| CliError::file("write", &self.path, &error))?;
        self.lines.insert(run, line);
        Ok(())
    }

    /// Writes all lines in the order of runs, in place of what is there, at once.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn rewrite(&mut self) -> Result<()> {
        let text: String = std::iter::once(&self.header).chain(self.lines.values()).cloned().collect();
        let new = self.path.with_extension("csv.new");
        fs::write(&new, text)
            .and_then(|()| fs::rename(&new, &self.path))
            .map_err(|error| CliError::file("write", &self.path, &error))?;
        self.file = writer(&self.path)?;
        Ok(())
    }
}

/// Takes files of another sweep out of a folder, if they do not stay.
fn clear(folder: &Path, existing: Existing) -> Result<()> {
    let unread = |error: io::Error| CliError::file("read the folder", folder, &error);
    for entry in fs::read_dir(folder).map_err(unread)? {
        let path = entry.map_err(unread)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let is_end = name.starts_with("run-") && path.extension().is_some_and(|ending| ending == "ply");
        if is_end || ["sweep.csv", "sweep.json"].contains(&name.as_ref()) {
            write::check(&path, existing)?;
            fs::remove_file(&path).map_err(|error| CliError::file("remove", &path, &error))?;
        }
    }
    Ok(())
}

fn writer(path: &Path) -> Result<File> {
    let opened = OpenOptions::new().create(true).append(true).open(path);
    opened.map_err(|error| CliError::file("write", path, &error))
}

/// Whole lines of runs that are there.
fn lines(path: &Path, header: &str) -> BTreeMap<usize, String> {
    let text = fs::read_to_string(path).unwrap_or_default();
    let Some(rows) = text.strip_prefix(header) else { return BTreeMap::new() };
    let whole = rows.split_inclusive('\n').filter(|line| line.ends_with('\n'));
    whole.filter_map(|line| Some((line.split(',').next()?.parse().ok()?, line.to_owned()))).collect()
}
