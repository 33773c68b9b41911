//! Object File Format: `OFF` with its prefixes, counts, points, polygons.
//!
//! The reader is ours: the one on offer keeps positions in binary32. Colours and normals are
//! ignored; points of other than three coordinates (4OFF, nOFF) and binary files are refused by name.

use std::io::{self, Write};

use nappe_sim::mesh::TriangleMesh;

use super::{
    loaded::Loaded,
    memory::{self, BESIDE, POINT, TRIANGLE, UV, Widest, make_room},
    numbers::{Line, lines},
    polygon::{Placed, Polygons},
    text::without_mark,
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
    let counts = Counts::of(&header, rest.clone());
    counts.check(&header)?;
    let mut mesh = TriangleMesh::default();
    make_room(&mut mesh.points, header.point_count);
    make_room(&mut mesh.triangles, counts.triangles);
    if header.textured.is_some() {
        make_room(&mut mesh.uv, header.point_count);
    }
    read_points(&header, &mut rest, &mut mesh)?;

    let mut polygons = Polygons::new();
    read_faces(&header, &mut rest, &mut mesh, &mut polygons)?;
    let mut warnings = polygons.warnings(file, Placed::Lines);
    if let Some(line) = rest.next() {
        warnings.push(format!("{file}:{}: lines after the last face are ignored", line.number));
    }
    Ok(Loaded { mesh, warnings })
}

/// What follows the counts of a header, from a look at the first word of each face.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    lines: usize,
    /// Triangles of the faces, at most.
    triangles: usize,
    widest: Widest,
}

impl Counts {
    fn of<'a>(header: &Header<'a>, rest: impl Iterator<Item = Line<'a>>) -> Self {
        let faces = header.point_count..header.point_count.saturating_add(header.face_count);
        let mut counts = Self::default();
        for Line { text, .. } in rest {
            if faces.contains(&counts.lines) {
                let first = text.split_ascii_whitespace().next().unwrap_or("");
                counts.triangles += triangles(first, text.len());
            }
            counts.widest.see(text.as_bytes());
            counts.lines += 1;
        }
        counts
    }

    /// Refuses a file of fewer lines than its header announces, before memory is taken for them.
    fn check(&self, header: &Header<'_>) -> Result<(), SceneError> {
        let (points, faces) = (header.point_count, header.face_count);
        let (what, announced, found) = match self.lines.checked_sub(points) {
            None => ("points", points, self.lines),
            Some(left) if left < faces => ("faces", faces, left),
            Some(_) => return Ok(()),
        };
        let message = format!("announces {announced} {what}, but {found} follow");
        Err(header.line.error(ErrorKind::Inconsistent, message))
    }
}

/// Bytes that reading takes at most, beside the file's own and the copy of a text.
pub(super) fn memory_bytes(bytes: &[u8]) -> u64 {
    let bytes = without_mark(bytes);
    let Ok(text) = std::str::from_utf8(bytes) else { return most_bytes(bytes) };
    let mut rest = lines("", text, Some('#'));
    let mut of_header = Widest::default();
    rest.clone().take(2).for_each(|line| of_header.see(line.text.as_bytes()));
    let beside = of_header.bytes() + BESIDE;
    let Ok(header) = header(&mut rest, "") else { return beside };
    let counts = Counts::of(&header, rest);
    if counts.check(&header).is_err() {
        return beside;
    }
    let of_point = POINT + if header.textured.is_some() { UV } else { 0 };
    let arrays = of_point * header.point_count as u64 + TRIANGLE * counts.triangles as u64;
    arrays + counts.widest.bytes() + beside
}

/// The same of a file whose counts are not read before it is copied: each line is a point, or a face.
fn most_bytes(bytes: &[u8]) -> u64 {
    let (mut widest, mut arrays) = (Widest::default(), 0);
    for line in memory::lines(bytes) {
        widest.see(line);
        let line = line.split(|byte| *byte == b'#').next().unwrap_or(line).trim_ascii();
        let first = line.split(u8::is_ascii_whitespace).next().unwrap_or(line);
        // A byte that is not UTF-8 has three in the copy.
        let length = if line.is_ascii() { line.len() } else { 3 * line.len() };
        let triangles = triangles(std::str::from_utf8(first).unwrap_or(""), length);
        arrays += (POINT + UV).max(TRIANGLE * triangles as u64);
    }
    arrays + widest.bytes() + BESIDE
}

/// Triangles that a face gives at most, from the first word of its line and the bytes of the line: a corner has a digit and
/// what stands before it.
fn triangles(first: &str, length: usize) -> usize {
    first.parse::<usize>().unwrap_or(0).min(length / 2).saturating_sub(2)
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
    let mut words = Vec::new();
    for line in rest.take(header.point_count) {
        line.words_into(&mut words);
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
    let (mut corners, mut words) = (Vec::new(), Vec::new());
    for line in rest.take(header.face_count) {
        line.words_into(&mut words);
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
