//! Object File Format: `OFF`, counts, points, polygons.
//!
//! The reader is ours: the one on offer keeps positions in binary32. Colours after a face are
//! ignored; other kinds of OFF (COFF, 4OFF, binary) are refused by name.

use std::io::{self, Write};

use nappe_sim::mesh::TriangleMesh;

use super::{
    loaded::{Loaded, fan},
    numbers::lines,
};
use crate::error::{ErrorKind, SceneError, excerpt};

/// Reads an OFF.
///
/// # Errors
/// The first error, with its line.
pub fn read_off(text: &str, file: &str) -> Result<Loaded, SceneError> {
    let mut rest = lines(file, text, Some('#'));
    let empty = || {
        SceneError::new(
            ErrorKind::Syntax,
            file,
            "ends before its counts; allowed: OFF, then `points faces edges`",
        )
    };

    let mut header = rest.next().ok_or_else(empty)?;
    let mut words = header.words();
    if words[0] != "OFF" {
        let message = format!("begins with '{}'; allowed: OFF", excerpt(words[0]));
        return Err(header.error(ErrorKind::Unsupported, message));
    }

    if words.len() > 1 && words[1] == "BINARY" {
        return Err(header.error(ErrorKind::Unsupported, "is a binary OFF; allowed: text"));
    }
    words.remove(0);
    if words.is_empty() {
        header = rest.next().ok_or_else(empty)?;
        words = header.words();
    }

    if words.len() < 2 {
        return Err(header.error(ErrorKind::Syntax, "has one count; allowed: `points faces edges`"));
    }
    let point_count = header.count(words[0], "points")?;
    let face_count = header.count(words[1], "faces")?;
    let mut mesh = TriangleMesh::default();
    for read in 0..point_count {
        let line = rest.next().ok_or_else(|| {
            header
                .error(ErrorKind::Inconsistent, format!("announces {point_count} points, but {read} follow"))
        })?;
        mesh.points.push(line.numbers(&line.words(), "a point")?);
    }

    for read in 0..face_count {
        let line = rest.next().ok_or_else(|| {
            header.error(ErrorKind::Inconsistent, format!("announces {face_count} faces, but {read} follow"))
        })?;
        let words = line.words();
        let corner_count = line.count(words[0], "corners")?;
        let Some(corners) = corner_count.checked_add(1).and_then(|end| words.get(1..end)) else {
            let message = format!("announces {corner_count} corners, but {} follow", words.len() - 1);
            return Err(line.error(ErrorKind::Inconsistent, message));
        };
        let corners: Vec<u32> =
            corners.iter().map(|word| line.index(word, point_count)).collect::<Result<_, _>>()?;
        mesh.triangles.extend(fan(&corners));
    }

    let mut warnings = Vec::new();
    if let Some(line) = rest.next() {
        warnings.push(format!("{file}:{}: lines after the last face are ignored", line.number));
    }
    Ok(Loaded { mesh, warnings })
}

/// Writes an OFF. Masses and texture coordinates are not part of the format.
///
/// # Errors
/// Those of `out`.
pub fn write_off(mesh: &TriangleMesh, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "OFF\n{} {} 0", mesh.points.len(), mesh.triangles.len())?;
    for [x, y, z] in &mesh.points {
        writeln!(out, "{x} {y} {z}")?;
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(out, "3 {a} {b} {c}")?;
    }
    Ok(())
}
