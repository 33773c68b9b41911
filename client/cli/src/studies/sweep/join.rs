//! Parts of a sweep that jobs computed apart, put together.
//!
//! Enters: folders, each with the rows of a part. Leaves: the folder of the whole sweep, as if it had been computed there.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs, io,
    path::{Path, PathBuf},
};

use super::{
    description::Description,
    measure::Measure,
    part::Part,
    run,
    table::{self, Columns, Table},
};
use crate::{
    files::write::{self, Existing},
    studies::study::csv::{fields, quoted},
    words::error::{CliError, Result},
};

/// A folder with a part of a sweep.
struct OfPart {
    folder: PathBuf,
    part: Part,
    /// What the whole sweep was asked for.
    whole: Description,
}

impl OfPart {
    fn read(folder: &Path) -> Result<Self> {
        let told = folder.join("sweep.json");
        let text = fs::read_to_string(&told).map_err(|error| CliError::file("read", &told, &error))?;
        let Some(description) = Description::read(&text) else {
            return Err(CliError::failure(format!("{} is not what a sweep writes", told.display())));
        };
        let Some(part) = description.part() else {
            return Err(CliError::usage(format!("{} holds a sweep, and no part of one", folder.display()))
                .hint("parts are computed with --part K/N"));
        };
        Ok(Self { folder: folder.to_owned(), part, whole: description.of_whole() })
    }
}

/// Parts of one sweep, with what all of them were asked for.
pub(crate) struct Parts {
    found: Vec<OfPart>,
    /// The scene, as it was named.
    pub(crate) scene: String,
    pub(crate) keys: Vec<String>,
    pub(crate) measures: Vec<Measure>,
    runs: usize,
}

impl Parts {
    /// Reads what folders hold.
    ///
    /// # Errors
    /// A folder without a part of a sweep, parts of several sweeps, and a part that is there twice.
    pub(crate) fn read(folders: &[PathBuf]) -> Result<Self> {
        let parts = folders.iter().map(|folder| OfPart::read(folder)).collect::<Result<Vec<_>>>()?;
        let Some(first) = parts.first() else {
            return Err(CliError::usage("no folder of a part is named"));
        };
        let mut known = BTreeSet::new();
        for other in &parts {
            check_alike(first, other)?;
            if !known.insert(other.part) {
                return Err(CliError::usage(format!("part {} is there twice", other.part)));
            }
        }
        let unread = || {
            let told = first.folder.join("sweep.json");
            CliError::failure(format!("{} does not say keys, values and measures", told.display()))
        };
        let whole = &first.whole;
        let (scene, keys) = (whole.scene().to_owned(), whole.texts("keys").ok_or_else(unread)?);
        let names = whole.texts("measures").ok_or_else(unread)?;
        let measures = names.iter().map(|name| Measure::parse(name).ok()).collect::<Option<Vec<_>>>();
        let (measures, runs) = (measures.ok_or_else(unread)?, whole.run_count().ok_or_else(unread)?);
        Ok(Self { found: parts, scene, keys, measures, runs })
    }

    /// What stands in their rows.
    pub(crate) fn columns(&self) -> Columns<'_> {
        Columns { keys: &self.keys, measures: &self.measures }
    }

    /// Puts rows and ends of runs into the folder of the whole sweep, and gives its table.
    ///
    /// # Errors
    /// A folder of a part, one that holds another sweep, and files that cannot be read or written.
    pub(crate) fn put_into(&self, folder: &Path, existing: Existing) -> Result<Table> {
        if let Some(same) = self.found.iter().find(|part| is_same(&part.folder, folder)) {
            let (out, part) = (folder.display(), same.part);
            return Err(CliError::usage(format!(
                "--out {out}: is the folder of part {part}; another one is needed"
            )));
        }
        let (columns, mut all) = (self.columns(), BTreeMap::new());
        for part in &self.found {
            let path = part.folder.join("sweep.csv");
            let lines = table::lines(&path, &columns.header(), self.runs, part.part)?;
            all.extend(lines.into_iter().map(|(run, line)| (run, (line, part.folder.as_path()))));
        }
        let whole = self.found[0].whole.clone();
        let mut table = Table::open(folder, whole, &columns, self.runs, Part::WHOLE, existing)?;
        for (run, (line, from)) in all {
            copy_end(run, from, folder)?;
            if !table.has(run) {
                let row: Vec<String> =
                    fields(line.trim_end()).iter().skip(1).map(|field| quoted(field)).collect();
                table.add(run, &row)?;
            }
        }
        table.rewrite()?;
        Ok(table)
    }

    /// The parts that lack rows in the table of the whole sweep.
    pub(crate) fn lacking(&self, table: &Table) -> Vec<String> {
        let is_lacking = |part: &Part| (0..self.runs).any(|run| part.has(run) && !table.has(run));
        self.found[0].part.all().filter(is_lacking).map(|part| part.to_string()).collect()
    }
}

/// Refuses a part of another sweep than the first one.
fn check_alike(first: &OfPart, other: &OfPart) -> Result<()> {
    let mut differences = first.whole.differences(&other.whole.text(0, 1));
    if first.part.of() != other.part.of() {
        differences.push(format!("it is one of {} parts, and not of {}", other.part.of(), first.part.of()));
    }
    if differences.is_empty() {
        return Ok(());
    }
    Err(CliError::usage(format!(
        "{} holds a part of another sweep than {}: {}",
        other.folder.display(),
        first.folder.display(),
        differences.join("; ")
    )))
}

/// Whether two paths lead to one folder.
fn is_same(one: &Path, other: &Path) -> bool {
    match (fs::canonicalize(one), fs::canonicalize(other)) {
        (Ok(one), Ok(other)) => one == other,
        _ => false,
    }
}

/// Copies the end of a run, where it was kept.
fn copy_end(run: usize, from: &Path, to: &Path) -> Result<()> {
    let name = run::end_file(run);
    let path = from.join(&name);
    match fs::read(&path) {
        // A join that was cut short has left one.
        Ok(bytes) => write::write_whole(&to.join(name), &bytes, Existing::Overwritten),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(CliError::file("read", &path, &error)),
    }
}
