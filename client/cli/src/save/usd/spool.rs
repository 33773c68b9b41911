//! Samples of attributes on their way: gathered in a file beside as frames come, and given back attribute by attribute.
//!
//! USD wants all times of an attribute together, and frames bring all attributes of a time. Memory holds only where each sample
//! stands.

use std::{
    fs::{self, File},
    io::{self, Read as _, Seek as _, SeekFrom, Write as _},
    path::{Path, PathBuf},
};

use crate::words::error::{CliError, Result};

/// An attribute of a spool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Attribute(usize);

/// Where a sample stands in the file.
#[derive(Clone, Copy, Debug)]
struct Part {
    start: u64,
    length: usize,
}

/// Samples of several attributes.
pub(super) struct Spool {
    path: PathBuf,
    file: File,
    bytes: u64,
    /// The samples of each attribute.
    parts: Vec<Vec<Part>>,
}

impl Spool {
    /// Makes the file, in the place of one that a killed run left.
    ///
    /// # Errors
    /// When it cannot be made.
    pub(super) fn create(path: &Path) -> Result<Self> {
        let made = File::options().read(true).write(true).create(true).truncate(true).open(path);
        let file = made.map_err(|error| CliError::file("write", path, &error))?;
        Ok(Self { path: path.to_owned(), file, bytes: 0, parts: Vec::new() })
    }

    /// Bytes of all samples so far.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// A new attribute, without samples.
    pub(super) fn attribute(&mut self) -> Attribute {
        self.parts.push(Vec::new());
        Attribute(self.parts.len() - 1)
    }

    /// Adds a sample of an attribute.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(super) fn add(&mut self, attribute: Attribute, sample: &str) -> Result<()> {
        let written = self.file.write_all(sample.as_bytes());
        written.map_err(|error| CliError::file("write", &self.path, &error))?;
        self.parts[attribute.0].push(Part { start: self.bytes, length: sample.len() });
        self.bytes += sample.len() as u64;
        Ok(())
    }

    /// Hands over the samples of an attribute, one after the other. No sample is added after that.
    ///
    /// # Errors
    /// When the file cannot be read, and those of `take`.
    pub(super) fn each(
        &mut self,
        attribute: Attribute,
        mut take: impl FnMut(&[u8]) -> Result<()>,
    ) -> Result<()> {
        let mut sample = Vec::new();
        for part in &self.parts[attribute.0] {
            let read = read(&mut self.file, *part, &mut sample);
            read.map_err(|error| CliError::file("read", &self.path, &error))?;
            take(&sample)?;
        }
        Ok(())
    }
}

fn read(file: &mut File, part: Part, sample: &mut Vec<u8>) -> io::Result<()> {
    file.seek(SeekFrom::Start(part.start))?;
    sample.resize(part.length, 0);
    file.read_exact(sample)
}

impl Drop for Spool {
    /// The file goes, whatever became of the run.
    fn drop(&mut self) {
        // What cannot be removed is replaced by the next run.
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_come_back_attribute_by_attribute_and_the_file_goes() {
        let path = std::env::temp_dir().join(format!("nappe-spool-{}", std::process::id()));
        fs::write(&path, "left by a killed run").expect("a file");
        let mut spool = Spool::create(&path).expect("it is made");
        let [first, second, none] = [spool.attribute(), spool.attribute(), spool.attribute()];
        for (attribute, sample) in [(first, "a"), (second, "bb"), (first, ""), (first, "ccc"), (second, "d")]
        {
            spool.add(attribute, sample).expect("there is room");
        }
        assert_eq!(spool.bytes(), 7);
        for (attribute, expected) in [(second, &["bb", "d"][..]), (first, &["a", "", "ccc"]), (none, &[])] {
            let mut found = Vec::new();
            let taken = spool.each(attribute, |sample| {
                found.push(String::from_utf8_lossy(sample).into_owned());
                Ok(())
            });
            taken.expect("it can be read");
            assert_eq!(found, expected);
        }
        drop(spool);
        assert!(!path.exists());
    }
}
