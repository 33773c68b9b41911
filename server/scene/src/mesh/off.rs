//! Object File Format: `OFF` with its prefixes, counts, points, polygons.
//!
//! The reader is ours: the one on offer keeps positions in binary32. Colours and normals are
//! ignored; points of other than three coordinates (4OFF, nOFF) and binary files are refused by name.

use std::io::{self, Write};

use nappe_sim::mesh::TriangleMesh;

use super::{
    loaded::Loaded,
    numbers::{Line, lines},
    polygon::{Placed, Polygons},
};
use crate::error::{ErrorKind, SceneError, excerpt};

/// What the first lines say of the others.
#[derive(Debug)]
struct Header<'a> {
    /// The line of the counts.
    line: Line<'a>,
    point_count: usize,
    face_count: usize,
    /// Fewest numbers of a point whose last two are texture coordinates; none: it has none.
    textured: Option<usize>,
}

/// Reads an OFF. Texture coordinates are kept where the header announces them.
///
/// # Errors
/// The first error, with its line.
pub fn read_off(text: &str, file: &str) -> Result<Loaded, SceneError> {
    let mut rest = lines(file, text, Some('#'));
    let header = header(&mut rest, file)?;
    let mut mesh = TriangleMesh::default();
    read_points(&header, &mut rest, &mut mesh)?;

    let mut polygons = Polygons::new();
    read_faces(&header, &mut rest, &mut mesh, &mut polygons)?;
    let mut warnings = polygons.warnings(file, Placed::Lines);
    if let Some(line) = rest.next() {
        warnings.push(format!("{file}:{}: lines after the last face are ignored", line.number));
    }
    Ok(Loaded { mesh, warnings })
}

/// The kind of the file and its counts, on one line or two. The word `OFF` may be absent, and the first count may
/// touch it.
fn header<'a>(rest: &mut impl Iterator<Item = Line<'a>>, file: &str) -> Result<Header<'a>, SceneError> {
    let empty = || {
        SceneError::new(
            ErrorKind::Syntax,
            file,
            "ends before its counts; allowed: OFF, then `points faces edges`",
        )
    };

    let mut line = rest.next().ok_or_else(empty)?;
    let mut words = line.words();
    let is_counts = words.len() == 3 && words.iter().all(|word| word.parse::<usize>().is_ok());
    let mut textured = None;
    if !is_counts {
        let (prefix, glued) = words[0]
            .split_once("OFF")
            .filter(|(_, glued)| glued.bytes().all(|byte| byte.is_ascii_digit()))
            .ok_or_else(|| unknown(&line, words[0]))?;
        textured = prefixes(&line, words[0], prefix)?;
        words.remove(0);
        if words.first() == Some(&"BINARY") {
            let message = "is a binary OFF; allowed: text. Save it as text, or as PLY";
            return Err(line.error(ErrorKind::Unsupported, message));
        }
        if !glued.is_empty() {
            words.insert(0, glued);
        }
        if words.is_empty() {
            line = rest.next().ok_or_else(empty)?;
            words = line.words();
        }
    }

    if words.len() < 2 {
        return Err(line.error(ErrorKind::Syntax, "has one count; allowed: `points faces edges`"));
    }
    let (point_count, face_count) = (line.count(words[0], "points")?, line.count(words[1], "faces")?);
    Ok(Header { line, point_count, face_count, textured })
}

fn unknown(line: &Line<'_>, word: &str) -> SceneError {
    let message = format!("begins with '{}'; allowed: OFF, with ST, C and N before it", excerpt(word));
    line.error(ErrorKind::Unsupported, message)
}

/// What stands before `OFF` in `word`: the fewest numbers of a point if the last two are texture coordinates.
fn prefixes(line: &Line<'_>, word: &str, prefix: &str) -> Result<Option<usize>, SceneError> {
    let (mut rest, mut least, mut is_textured) = (prefix, 3, false);
    while !rest.is_empty() {
        // Some programs write the prefixes in another order than ST, C, N.
        if let Some(after) = rest.strip_prefix("ST") {
            (rest, least, is_textured) = (after, least + 2, true);
        } else if let Some(after) = rest.strip_prefix(['C', 'N']) {
            (rest, least) = (after, least + 3);
        } else if matches!(rest, "4" | "n" | "4n") {
            let message = format!(
                "is {}, whose points have other than three coordinates; allowed: OFF, with ST, C and N before it. \
                 Write it as OFF, OBJ or PLY with another program",
                excerpt(word)
            );
            return Err(line.error(ErrorKind::Unsupported, message));
        } else {
            return Err(unknown(line, word));
        }
    }
    Ok(is_textured.then_some(least))
}

fn read_points<'a>(
    header: &Header<'a>,
    rest: &mut impl Iterator<Item = Line<'a>>,
    mesh: &mut TriangleMesh,
) -> Result<(), SceneError> {
    let count = header.point_count;
    for read in 0..count {
        let line = rest.next().ok_or_else(|| {
            let message = format!("announces {count} points, but {read} follow");
            header.line.error(ErrorKind::Inconsistent, message)
        })?;
        let words = line.words();
        mesh.points.push(line.numbers(&words, "a point")?);

        let Some(least) = header.textured else { continue };
        if words.len() < least {
            let message = format!(
                "a point has {} numbers; allowed: {least} or more, of which the last two are texture coordinates",
                words.len()
            );
            return Err(line.error(ErrorKind::Syntax, message));
        }
        mesh.uv.push(line.numbers(&words[words.len() - 2..], "a texture coordinate")?);
    }
    Ok(())
}

fn read_faces<'a>(
    header: &Header<'a>,
    rest: &mut impl Iterator<Item = Line<'a>>,
    mesh: &mut TriangleMesh,
    polygons: &mut Polygons,
) -> Result<(), SceneError> {
    let (count, mut corners) = (header.face_count, Vec::new());
    for read in 0..count {
        let line = rest.next().ok_or_else(|| {
            let message = format!("announces {count} faces, but {read} follow");
            header.line.error(ErrorKind::Inconsistent, message)
        })?;
        let words = line.words();
        let corner_count = line.count(words[0], "corners")?;
        let Some(found) = corner_count.checked_add(1).and_then(|end| words.get(1..end)) else {
            let message = format!("announces {corner_count} corners, but {} follow", words.len() - 1);
            return Err(line.error(ErrorKind::Inconsistent, message));
        };

        corners.clear();
        for word in found {
            corners.push(line.index(word, header.point_count)?);
        }
        polygons.cut(&mesh.points, &corners, line.number, &mut mesh.triangles);
    }
    Ok(())
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
