//! What a saved frame says of itself in comments: its step and time, of which scene it is, and what steps after it depend on.
//!
//! Enters: what is known of a frame; or the header of a file. Leaves: lines of comments; or what they say. Two runs of one scene say the
//! same.

use std::{
    fs::File,
    io::{self, BufRead as _, BufReader, Read},
    path::Path,
};

use nappe_client::{Precision, v1};
use nappe_scene::printable;

/// Bytes of the header of a frame, at most.
const HEADER_BYTES: u64 = 1 << 25;
/// Its last line.
const HEADER_END: &[u8] = b"end_header\n";
/// Numbers in a line.
const PER_LINE: usize = 8;

/// What a saved frame says of itself. Nothing of it is known of a file that another program wrote.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct FrameNotes {
    pub(crate) step: Option<u64>,
    /// Time (s).
    pub(crate) time: Option<f64>,
    /// The version of nappe that saved it.
    pub(crate) version: Option<String>,
    /// What its scene is known by.
    pub(crate) scene: Option<String>,
    pub(crate) carried: Option<v1::Carried>,
    /// That of its positions.
    pub(crate) precision: Option<Precision>,
    /// The names of the numbers of a particle.
    pub(crate) properties: Vec<String>,
}

/// The comments of a frame with velocities, beside its step and its time; `scene` is what its scene is known by, if that is at hand.
pub(crate) fn comments(scene: Option<&str>, carried: Option<&v1::Carried>) -> Vec<String> {
    let mut lines = vec![format!("nappe {}", env!("CARGO_PKG_VERSION"))];
    lines.extend(scene.map(|scene| format!("scene {}", printable(scene))));
    let Some(v1::Carried { numbers, missing }) = carried else { return lines };
    lines.extend(missing.iter().map(|name| format!("missing {}", printable(name))));
    for numbers in numbers.chunks(PER_LINE) {
        // Digits enough to be read back to the last bit.
        let words: Vec<String> = numbers.iter().map(|number| format!("{number:e}")).collect();
        lines.push(format!("carried {}", words.join(" ")));
    }
    lines
}

impl FrameNotes {
    /// Reads the header of a file.
    ///
    /// # Errors
    /// Those of the system.
    pub(crate) fn of_file(path: &Path) -> io::Result<Self> {
        Ok(Self::read(&header_of(File::open(path)?)?))
    }

    /// Reads the header at the start of these bytes.
    fn read(bytes: &[u8]) -> Self {
        let mut notes = Self::default();
        for line in bytes.split(|byte| *byte == b'\n') {
            let Ok(line) = std::str::from_utf8(line) else { break };
            let line = line.trim_end();
            if line == "end_header" {
                break;
            }
            let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
            match (word, rest.split_once(' ')) {
                ("comment", Some((key, value))) => notes.comment(key, value),
                ("property", Some((kind, name))) if kind != "list" => notes.property(kind, name),
                _ => {}
            }
        }
        notes
    }

    fn comment(&mut self, key: &str, value: &str) {
        match key {
            "step" => self.step = value.parse().ok(),
            "time_seconds" => self.time = value.parse().ok(),
            "nappe" => self.version = Some(value.to_owned()),
            "scene" => self.scene = Some(value.to_owned()),
            "missing" => self.carried.get_or_insert_default().missing.push(value.to_owned()),
            "carried" => {
                // A word that is no number is none that a server goes on from.
                let numbers = value.split(' ').map(|word| word.parse().unwrap_or(f64::NAN));
                self.carried.get_or_insert_default().numbers.extend(numbers);
            }
            _ => {}
        }
    }

    fn property(&mut self, kind: &str, name: &str) {
        if name == "x" {
            self.precision = match kind {
                "float" | "float32" => Some(Precision::F32),
                "double" | "float64" => Some(Precision::F64),
                _ => None,
            };
        }
        self.properties.push(name.to_owned());
    }

    /// The version that saved it, if that is later than this one, or of a form that this one does not know.
    pub(crate) fn newer_version(&self) -> Option<&str> {
        let numbers = |version: &str| -> Option<Vec<u64>> {
            version.split('.').map(|number| number.parse().ok()).collect()
        };
        let own = numbers(env!("CARGO_PKG_VERSION"));
        self.version.as_deref().filter(|version| numbers(version).is_none_or(|theirs| Some(theirs) > own))
    }
}

/// The bytes of a file as far as its header goes.
fn header_of(source: impl Read) -> io::Result<Vec<u8>> {
    let mut source = BufReader::new(source.take(HEADER_BYTES));
    let mut bytes = Vec::new();
    while source.read_until(b'\n', &mut bytes)? > 0 {
        if bytes.ends_with(HEADER_END) {
            break;
        }
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A header with these lines.
    fn header(lines: &[String]) -> Vec<u8> {
        let comments = lines.iter().fold(String::new(), |text, line| text + "comment " + line + "\n");
        let mut bytes = format!(
            "ply\nformat binary_little_endian 1.0\ncomment step 7\ncomment time_seconds 0.1\n{comments}element vertex 1\n\
             property double x\nproperty float vx\nproperty float vy\nproperty float vz\nelement face 0\n\
             property list uchar uint vertex_indices\nend_header\n"
        )
        .into_bytes();
        bytes.extend(b"comment step 8\n\xff\n");
        bytes
    }

    #[test]
    fn what_a_frame_says_is_read_back_to_the_last_bit() {
        let numbers: Vec<f64> = [0.0, -0.0, 1.0 / 3.0, 1e-300, f64::MAX, f64::MIN_POSITIVE / 8.0].repeat(4);
        let carried = v1::Carried { numbers, missing: vec!["past".to_owned(), "pins".to_owned()] };
        let notes = FrameNotes::read(&header(&comments(Some("00ff"), Some(&carried))));
        assert_eq!((notes.step, notes.time, notes.precision), (Some(7), Some(0.1), Some(Precision::F64)));
        assert_eq!(notes.scene.as_deref(), Some("00ff"));
        let read = notes.carried.clone().expect("numbers");
        assert_eq!(read.missing, carried.missing);
        let bits = |numbers: &[f64]| numbers.iter().map(|number| number.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&read.numbers), bits(&carried.numbers));
        assert_eq!(notes.properties, ["x", "vx", "vy", "vz"]);
        assert!(notes.newer_version().is_none());
    }

    #[test]
    fn a_frame_that_says_nothing_has_no_notes_and_names_have_no_lines() {
        let notes = FrameNotes::read(&header(&comments(None, None)));
        assert_eq!((notes.step, notes.scene, notes.carried), (Some(7), None, None));
        let missing = vec!["a\ncomment step 9".to_owned()];
        let carried = v1::Carried { numbers: Vec::new(), missing };
        assert_eq!(FrameNotes::read(&header(&comments(None, Some(&carried)))).step, Some(7));
        let notes = FrameNotes::read(b"\x1f\x8b\x08\n\n");
        assert_eq!(notes, FrameNotes::default());
    }

    #[test]
    fn a_long_header_is_read_to_its_end_and_no_further() {
        let numbers = (3..40_000).map(|number| 1.0 / f64::from(number)).collect();
        let carried = v1::Carried { numbers, missing: Vec::new() };
        let bytes = header(&comments(None, Some(&carried)));
        let read = header_of(&bytes[..]).expect("bytes are read");
        assert!(read.len() > 1 << 18 && read.ends_with(HEADER_END), "{} bytes", read.len());
        assert_eq!(FrameNotes::read(&read).carried, Some(carried));
        let cut = header_of(&bytes[..1000]).expect("bytes are read");
        assert!(FrameNotes::read(&cut).properties.is_empty());
    }

    #[test]
    fn a_later_version_is_told_from_this_one_and_those_before() {
        let newer = |version: &str| {
            let notes = FrameNotes { version: Some(version.to_owned()), ..FrameNotes::default() };
            notes.newer_version().is_some()
        };
        assert_eq!(["0.0.9", env!("CARGO_PKG_VERSION")].map(newer), [false; 2]);
        assert_eq!(["99.0.0", "0.99", "next", ""].map(newer), [true; 4]);
    }
}
