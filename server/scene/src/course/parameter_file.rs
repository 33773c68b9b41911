//! `Key=value;` lines: `#` opens a comment line, keys are not case-sensitive, the last value wins.

use std::collections::BTreeMap;

use crate::{
    error::{ErrorKind, SceneError, excerpt, suggestion},
    mesh::numbers::{Line, lines},
};

/// The last value of a key.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry<'a> {
    /// The key as it was written.
    key: &'a str,
    value: &'a str,
    line: Line<'a>,
}

/// The entries of a parameter file, by key in lower case.
pub(super) struct ParameterFile<'a> {
    file: &'a str,
    entries: BTreeMap<String, Entry<'a>>,
    pub(super) warnings: Vec<String>,
}

impl<'a> ParameterFile<'a> {
    pub(super) fn read(text: &'a str, file: &'a str) -> Result<Self, SceneError> {
        let (mut entries, mut warnings) = (BTreeMap::new(), Vec::new());
        for line in lines(file, text, None) {
            if line.text.starts_with('#') {
                continue;
            }
            let Some((key, rest)) = line.text.split_once('=') else {
                let message =
                    format!("is '{}'; allowed: Key=value; or a line that starts with #", excerpt(line.text));
                return Err(line.error(ErrorKind::Syntax, message));
            };
            let (value, after) = rest.split_once(';').unwrap_or_else(|| {
                warnings.push(format!("{file}:{}: the line has no ';'", line.number));
                (rest, "")
            });
            if !after.trim().is_empty() {
                warnings.push(format!(
                    "{file}:{}: '{}' after the ';' is ignored",
                    line.number,
                    excerpt(after.trim())
                ));
            }
            let entry = Entry { key: key.trim(), value: value.trim(), line };
            if let Some(before) = entries.insert(entry.key.to_lowercase(), entry) {
                warnings.push(format!(
                    "{file}:{}: {} was '{}' in line {}: the last value wins",
                    line.number,
                    entry.key,
                    excerpt(before.value),
                    before.line.number
                ));
            }
        }

        Ok(Self { file, entries, warnings })
    }

    /// Takes the entry of a key.
    pub(super) fn take(&mut self, key: &str) -> Option<Entry<'a>> {
        self.entries.remove(&key.to_lowercase())
    }

    /// Takes the entries whose key is `prefix` and a number, in the order of the numbers.
    pub(super) fn take_numbered(&mut self, prefix: &str) -> BTreeMap<usize, Entry<'a>> {
        let numbered = |key: &str| key.strip_prefix(prefix).and_then(|n| n.parse::<usize>().ok());
        let keys: Vec<String> = self.entries.keys().filter(|k| numbered(k).is_some()).cloned().collect();
        keys.iter().filter_map(|key| Some((numbered(key)?, self.entries.remove(key)?))).collect()
    }

    pub(super) fn number(&mut self, key: &str) -> Result<Option<f64>, SceneError> {
        self.take(key).map(|entry| entry.number()).transpose()
    }

    pub(super) fn whole(&mut self, key: &str) -> Result<Option<u64>, SceneError> {
        self.take(key).map(|entry| entry.whole()).transpose()
    }

    /// A file name; an empty value counts as none.
    pub(super) fn path(&mut self, key: &str) -> Option<String> {
        self.take(key).map(|entry| entry.value.to_owned()).filter(|path| !path.is_empty())
    }

    pub(super) fn missing(&self, key: &str, what: &str) -> SceneError {
        SceneError::new(ErrorKind::Missing, self.file, format!("is missing: {what}")).for_key(key)
    }

    /// Warnings on the keys of `unused` that are here, and on those that nobody knows.
    pub(super) fn finish(mut self, unused: &[&str], known: &[&str]) -> Vec<String> {
        let here: Vec<&str> = unused.iter().copied().filter(|key| self.take(key).is_some()).collect();
        if !here.is_empty() {
            let list = here.join(", ");
            self.warnings.push(format!("{}: {list}: for sph and rigid objects, unused here", self.file));
        }
        for entry in self.entries.values() {
            let near = suggestion(entry.key, known.iter().chain(unused).copied());
            let (number, key) = (entry.line.number, excerpt(entry.key));
            self.warnings.push(format!("{}:{number}: unknown key '{key}' is ignored; {near}", self.file));
        }
        self.warnings
    }
}

impl<'a> Entry<'a> {
    pub(super) fn value(&self) -> &'a str {
        self.value
    }

    pub(super) fn line_number(&self) -> usize {
        self.line.number
    }

    pub(super) fn number(&self) -> Result<f64, SceneError> {
        self.line.number(self.value, "the value").map_err(|error| error.for_key(self.key))
    }

    pub(super) fn whole(&self) -> Result<u64, SceneError> {
        self.value.parse().ok().ok_or_else(|| {
            self.error(ErrorKind::Syntax, format!("is '{}'; allowed: a whole number", excerpt(self.value)))
        })
    }

    pub(super) fn error(&self, kind: ErrorKind, message: impl Into<String>) -> SceneError {
        self.line.error(kind, message).for_key(self.key)
    }
}
