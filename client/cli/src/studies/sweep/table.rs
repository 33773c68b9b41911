//! The rows of a sweep on disk: one line as each run ends, sorted in the end. Started again, it resumes.

use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions},
    io::{self, Write as _},
    path::{Path, PathBuf},
};

use super::{
    description::Description,
    measure::Measure,
    part::Part,
    run::{AFTER, BEFORE},
};
use crate::{
    files::write::{self, Existing},
    studies::study::csv::{fields, quoted},
    words::error::{CliError, Result},
};

/// Rows of a sweep in a folder.
pub(crate) struct Table {
    folder: PathBuf,
    path: PathBuf,
    description: Description,
    /// Runs of the whole sweep.
    all: usize,
    /// Which of them have rows here.
    part: Part,
    header: String,
    file: File,
    /// Lines by the numbers of their runs.
    lines: BTreeMap<usize, String>,
}

/// What stands in the rows of a sweep.
pub(crate) struct Columns<'a> {
    pub(crate) keys: &'a [String],
    pub(crate) measures: &'a [Measure],
}

impl Columns<'_> {
    /// Their names, in a line.
    pub(super) fn header(&self) -> String {
        let keys = self.keys.iter().map(String::as_str);
        let measures = self.measures.iter().map(|measure| measure.name.as_str());
        let names = ["run"].into_iter().chain(keys).chain(BEFORE).chain(measures).chain(AFTER);
        names.map(quoted).collect::<Vec<_>>().join(",") + "\n"
    }
}

impl Table {
    /// Begins a part of a sweep of so many runs in a folder, or goes on with one of the same description where that is not to be
    /// overwritten.
    ///
    /// # Errors
    /// A folder that holds another sweep, which stays, and files that cannot be read or written.
    pub(crate) fn open(
        folder: &Path,
        description: Description,
        columns: &Columns<'_>,
        all: usize,
        part: Part,
        existing: Existing,
    ) -> Result<Self> {
        let told = folder.join("sweep.json");
        let path = folder.join("sweep.csv");
        let header = columns.header();
        match fs::read_to_string(&told) {
            Ok(there) if existing == Existing::Kept => {
                let differences = description.differences(&there);
                if !differences.is_empty() {
                    return Err(CliError::usage(format!(
                        "--out {}: holds another sweep: {}; --force begins anew",
                        folder.display(),
                        differences.join("; ")
                    )));
                }
            }
            _ => {
                clear(folder, existing)?;
                write::write_whole(&told, description.text(0, part.count(all)).as_bytes(), existing)?;
                write::write_whole(&path, header.as_bytes(), existing)?;
            }
        }
        let lines = lines(&path, &header, all, part)?;
        let (folder, file) = (folder.to_owned(), writer(&path)?);
        let mut table = Self { folder, path, description, all, part, header, file, lines };
        // A line that was cut off is made again.
        table.rewrite()?;
        Ok(table)
    }

    /// Whether a run has its line.
    pub(crate) fn has(&self, run: usize) -> bool {
        self.lines.contains_key(&run)
    }

    /// How many runs there are.
    pub(crate) fn runs(&self) -> usize {
        self.part.count(self.all)
    }

    /// How many runs have their lines.
    pub(crate) fn len(&self) -> usize {
        self.lines.len()
    }

    /// Whether all runs have their lines.
    pub(crate) fn is_complete(&self) -> bool {
        self.len() == self.runs()
    }

    /// The fields of each row, in the order of runs.
    pub(crate) fn rows(&self) -> impl Iterator<Item = Vec<String>> {
        self.lines.values().map(|line| fields(line.trim_end()))
    }

    /// How many runs finished.
    pub(crate) fn ok_count(&self) -> usize {
        self.rows().filter(|row| is_ok(row)).count()
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

    /// Writes all lines in the order of runs in place of what is there, and whether all runs have theirs.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn rewrite(&mut self) -> Result<()> {
        let text: String = std::iter::once(&self.header).chain(self.lines.values()).cloned().collect();
        write::write_whole(&self.path, text.as_bytes(), Existing::Overwritten)?;
        self.file = writer(&self.path)?;
        let told = self.description.text(self.len(), self.runs());
        write::write_whole(&self.folder.join("sweep.json"), told.as_bytes(), Existing::Overwritten)
    }
}

/// Whether the run of a row finished.
pub(crate) fn is_ok(row: &[String]) -> bool {
    let place = AFTER.iter().rev().position(|name| *name == "outcome");
    place.and_then(|place| row.iter().rev().nth(place)).is_some_and(|outcome| outcome == "ok")
}

/// Takes files of another sweep out of a folder, if they do not stay.
fn clear(folder: &Path, existing: Existing) -> Result<()> {
    let unread = |error: io::Error| CliError::file("read the folder", folder, &error);
    for entry in fs::read_dir(folder).map_err(unread)? {
        let path = entry.map_err(unread)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let is_end = name.starts_with("run-") && path.extension().is_some_and(|ending| ending == "ply");
        if is_end || ["sweep.csv", "sweep.json", "sweep.svg", "sweep.png"].contains(&name.as_ref()) {
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

/// Whole lines that are there of the runs of a part, by the numbers of the runs.
///
/// # Errors
/// A table that cannot be read, or has other columns.
pub(super) fn lines(path: &Path, header: &str, all: usize, part: Part) -> Result<BTreeMap<usize, String>> {
    let text = match fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(BTreeMap::new()),
        Err(error) => return Err(CliError::file("read", path, &error)),
    };
    let Some(rows) = text.strip_prefix(header) else {
        if header.starts_with(&text) {
            return Ok(BTreeMap::new());
        }
        return Err(CliError::usage(format!(
            "{} does not begin with the columns of this sweep: {}; another folder for --out keeps it, --force begins anew",
            path.display(),
            header.trim_end()
        )));
    };
    let columns = fields(header.trim_end()).len();
    let whole = rows.split_inclusive('\n').filter(|line| line.ends_with('\n'));
    let numbered = whole.filter_map(|line| {
        let fields = fields(line.trim_end());
        let run = fields.first()?.parse::<usize>().ok().filter(|run| *run < all && part.has(*run))?;
        (fields.len() == columns).then(|| (run, line.to_owned()))
    });
    Ok(numbered.collect())
}
