//! The .pvd file: which files belong to which time.
//!
//! Enters: times (s) and names of files. Leaves: a text that ParaView opens.

use std::fmt::Write as _;

use nappe_scene::mesh::escaped;

/// The files of all frames.
#[derive(Debug, Default)]
pub(super) struct Index {
    rows: Vec<Row>,
}

/// A file of a time.
#[derive(Debug)]
struct Row {
    time: f64,
    part: Part,
    file: String,
}

/// What a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// The particles of a frame.
    Particles,
    /// The colliders, where they are.
    Colliders,
    /// Nodes of the snow's grid.
    Grid,
}

impl Part {
    /// The name of the block that it becomes.
    const fn name(self) -> &'static str {
        match self {
            Self::Particles => "particles",
            Self::Colliders => "colliders",
            Self::Grid => "grid",
        }
    }
}

impl Index {
    /// Adds a file of a time (s).
    pub(super) fn add(&mut self, time: f64, part: Part, file: String) {
        self.rows.push(Row { time, part, file });
    }

    /// The text, for files in this folder beside it.
    pub(super) fn text(&self, folder: &str) -> String {
        let mut text = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n<Collection>\n",
        );
        let folder = escaped(folder);
        for Row { time, part, file } in &self.rows {
            // Writing into a string does not fail.
            let _ = writeln!(
                text,
                "<DataSet timestep=\"{time}\" part=\"{}\" name=\"{}\" file=\"{folder}/{file}\"/>",
                *part as u8,
                part.name()
            );
        }
        text + "</Collection>\n</VTKFile>\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_has_its_time_and_names_of_folders_cannot_end_their_place() {
        let mut index = Index::default();
        index.add(0.0, Part::Particles, "frame-000000.vtp".to_owned());
        index.add(0.1, Part::Particles, "frame-000001.vtp".to_owned());
        index.add(0.1, Part::Colliders, "colliders-000000.vtp".to_owned());
        let text = index.text("a \"b\" & <c>");
        let rows: Vec<&str> = text.lines().filter(|line| line.starts_with("<DataSet")).collect();
        let file = "file=\"a &quot;b&quot; &amp; &lt;c&gt;/";
        assert_eq!(
            rows,
            [
                format!("<DataSet timestep=\"0\" part=\"0\" name=\"particles\" {file}frame-000000.vtp\"/>"),
                format!("<DataSet timestep=\"0.1\" part=\"0\" name=\"particles\" {file}frame-000001.vtp\"/>"),
                format!(
                    "<DataSet timestep=\"0.1\" part=\"1\" name=\"colliders\" {file}colliders-000000.vtp\"/>"
                ),
            ]
        );
        assert!(text.ends_with("</Collection>\n</VTKFile>\n"));
    }
}
