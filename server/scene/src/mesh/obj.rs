//! Wavefront OBJ: positions, texture coordinates and faces; groups, normals and materials are
//! ignored, and other elements are told.
//!
//! Positions keep their order and their number, because masses and pins name them by index: this
//! is why the reader is ours (those on offer drop or renumber points, and their errors name no
//! line).

use std::{
    io::{self, Write},
    iter::Peekable,
};

use nappe_sim::mesh::TriangleMesh;

use super::{
    loaded::{Loaded, Met},
    memory::{self, BESIDE, POINT, TRIANGLE, UV, Widest, make_room},
    numbers::{Line, lines},
    polygon::{Placed, Polygons},
    text::without_mark,
};
use crate::{
    error::{ErrorKind, SceneError, excerpt},
    printable::printable,
};

/// Elements that a mesh has no use for; of lines, which are the first, more is told than of the others.
const ELEMENTS: [&str; 11] = ["l", "p", "curv", "curv2", "surf", "call", "bzp", "bsp", "cdc", "cdp", "res"];

/// What a mesh of positions and faces loses nothing without: names, normals, materials, and details of the elements
/// that are told.
const HARMLESS: &str = "vn o g s usemtl mtllib vp mg usemap maplib bevel c_interp d_interp lod shadow_obj trace_obj \
                        ctech stech cstype deg bmat step parm trim hole scrv sp end con";

/// Reads an OBJ. Texture coordinates are kept where every point has one and only one.
///
/// # Errors
/// The first error, with its line.
pub fn read_obj(text: &str, file: &str) -> Result<Loaded, SceneError> {
    let mut parts = Parts::with_room(&Counts::of(text.as_bytes()));
    let mut rest = lines(file, text, Some('#')).peekable();
    let mut words = Vec::new();
    while let Some(line) = rest.next() {
        joined(&line, &mut rest, &mut words);
        let Some((&keyword, words)) = words.split_first() else { continue };
        match keyword {
            "v" => parts.mesh.points.push(line.numbers(words, "a vertex")?),
            "vt" => parts.uv.push(texture(&line, words)?),
            "f" => parts.face(&line, words)?,
            _ => parts.other(&line, keyword)?,
        }
    }
    parts.loaded(file)
}

/// The words of a line, and of the lines below it that a `\` at its end joins to it.
fn joined<'a>(
    line: &Line<'a>,
    rest: &mut Peekable<impl Iterator<Item = Line<'a>>>,
    words: &mut Vec<&'a str>,
) {
    line.words_into(words);
    let mut number = line.number;
    while let Some(last) = words.last().copied().and_then(|last| last.strip_suffix('\\')) {
        words.pop();
        if !last.is_empty() {
            words.push(last);
        }
        number += 1;
        let Some(next) = rest.next_if(|next| next.number == number) else { break };
        words.extend(next.text.split_ascii_whitespace());
    }
}

/// What a file holds at most, from a look at the first word of each line.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    points: usize,
    uv: usize,
    triangles: usize,
    widest: Widest,
}

impl Counts {
    fn of(bytes: &[u8]) -> Self {
        // Words of the lines above that the next one goes on.
        let (mut counts, mut joined) = (Self::default(), 0);
        for line in memory::lines(bytes) {
            let line = line.split(|byte| *byte == b'#').next().unwrap_or(line).trim_ascii();
            let keyword = line.split(u8::is_ascii_whitespace).next().unwrap_or(line);
            match keyword {
                // Whatever the line above is, one of its kind was counted at most.
                _ if joined > 0 => {
                    counts.points += 1;
                    counts.uv += 1;
                    counts.triangles += memory::words(line);
                }
                b"v" => counts.points += 1,
                b"vt" => counts.uv += 1,
                b"f" => counts.triangles += memory::words(line).saturating_sub(3),
                _ => {}
            }

            let goes_on = line.ends_with(b"\\");
            if joined > 0 || goes_on {
                joined += memory::words(line);
                counts.widest.see_words(joined);
            } else {
                counts.widest.see(line);
            }
            if !goes_on {
                joined = 0;
            }
        }
        counts
    }
}

/// Bytes that reading takes at most, beside the file's own and the copy of a text.
pub(super) fn memory_bytes(bytes: &[u8]) -> u64 {
    let Counts { points, uv, triangles, widest } = Counts::of(without_mark(bytes));
    // With what joins each point to its texture coordinates.
    let of_point = POINT + size_of::<Option<usize>>() as u64 + if uv > 0 { UV } else { 0 };
    let arrays = of_point * points as u64 + UV * uv as u64 + TRIANGLE * triangles as u64;
    arrays + widest.bytes() + BESIDE
}

/// What was read of a file.
#[derive(Debug, Default)]
struct Parts {
    mesh: TriangleMesh,
    uv: Vec<[f64; 2]>,
    uv_of_point: Vec<Option<usize>>,
    /// Corners of the face that is being read.
    corners: Vec<u32>,
    polygons: Polygons,
    seams: Met,
    elements: [Met; ELEMENTS.len()],
    unknown: Met,
    /// The first of the unknown keywords.
    unknown_keyword: String,
}

impl Parts {
    /// Nothing yet, with room for what was counted.
    fn with_room(counts: &Counts) -> Self {
        let mut parts = Self::default();
        make_room(&mut parts.mesh.points, counts.points);
        make_room(&mut parts.mesh.triangles, counts.triangles);
        make_room(&mut parts.uv, counts.uv);
        make_room(&mut parts.uv_of_point, counts.points);
        parts
    }

    /// The corners of a face: point, and texture coordinate where given.
    fn face(&mut self, line: &Line<'_>, words: &[&str]) -> Result<(), SceneError> {
        if words.len() < 3 {
            let message = format!("a face has {} corners; allowed: 3 or more", words.len());
            return Err(line.error(ErrorKind::Syntax, message));
        }

        let points = self.mesh.points.len();
        self.uv_of_point.resize(points, None);
        self.corners.clear();
        for word in words {
            let mut parts = word.split('/');
            let point = index(line, parts.next().unwrap_or(""), points, "vertex")?;
            self.corners.push(point as u32);

            if let Some(part) = parts.next().filter(|part| !part.is_empty()) {
                let texture = index(line, part, self.uv.len(), "texture coordinate")?;
                if *self.uv_of_point[point].get_or_insert(texture) != texture {
                    self.seams.add(line.number);
                }
            }
        }
        self.polygons.cut(&self.mesh.points, &self.corners, line.number, &mut self.mesh.triangles);
        Ok(())
    }

    /// A line that gives a mesh nothing.
    fn other(&mut self, line: &Line<'_>, keyword: &str) -> Result<(), SceneError> {
        if let Some(element) = ELEMENTS.iter().position(|element| *element == keyword) {
            self.elements[element].add(line.number);
            return Ok(());
        }
        if HARMLESS.split(' ').any(|harmless| harmless == keyword) {
            return Ok(());
        }

        let is_text = keyword.chars().all(|c| !c.is_control() && c != char::REPLACEMENT_CHARACTER);
        if !is_text && self.mesh.points.is_empty() {
            let message = format!(
                "begins with '{}', which is not text: this may be a binary file; allowed: an OBJ, which is text",
                excerpt(keyword)
            );
            return Err(line.error(ErrorKind::Unsupported, message));
        }
        if self.unknown.count == 0 {
            self.unknown_keyword = printable(&excerpt(keyword)).into_owned();
        }
        self.unknown.add(line.number);
        Ok(())
    }

    fn loaded(mut self, file: &str) -> Result<Loaded, SceneError> {
        if self.mesh.points.is_empty() {
            return Err(SceneError::new(ErrorKind::BadMesh, file, "holds no vertices ('v x y z')"));
        }
        let mut warnings = self.ignored(file);
        warnings.extend(self.polygons.warnings(file, Placed::Lines));
        let Met { count, first } = self.seams;
        if count > 0 {
            warnings.push(format!(
                "{file}:{first}: corners that give a point another texture coordinate ({count}, the first here): \
                 each point keeps its first one"
            ));
        }

        self.uv_of_point.resize(self.mesh.points.len(), None);
        if self.uv_of_point.iter().all(Option::is_some) {
            self.mesh.uv = self.uv_of_point.iter().map(|at| at.map_or([0.0; 2], |at| self.uv[at])).collect();
        } else if !self.uv.is_empty() {
            warnings.push(format!("{file}: some points have no texture coordinate: none are kept"));
        }
        Ok(Loaded { mesh: self.mesh, warnings })
    }

    /// What is told of the lines that give a mesh nothing.
    fn ignored(&self, file: &str) -> Vec<String> {
        let mut warnings = Vec::new();
        let Met { count, first } = self.elements[0];
        if count > 0 {
            warnings.push(format!(
                "{file}:{first}: the elements 'l' ({count}, the first here) are ignored: lines give no springs. A row \
                 of particles that springs join is written in the scene as mesh = {{ chain = n, spacing = s }}"
            ));
        }

        let met = || ELEMENTS.into_iter().zip(&self.elements).skip(1).filter(|(_, met)| met.count > 0);
        if let Some(first) = met().map(|(_, met)| met.first).min() {
            let names: Vec<_> = met().map(|(name, met)| format!("'{name}' ({})", met.count)).collect();
            warnings.push(format!(
                "{file}:{first}: the elements {} are ignored (the first here): a mesh is made from 'v', 'vt' and 'f'",
                names.join(", ")
            ));
        }
        let Met { count, first } = self.unknown;
        if count > 0 {
            warnings.push(format!(
                "{file}:{first}: lines that begin with no keyword of OBJ are ignored ({count}, the first here, with \
                 '{}'): is it misspelt?",
                self.unknown_keyword
            ));
        }
        warnings
    }
}

fn texture(line: &Line<'_>, words: &[&str]) -> Result<[f64; 2], SceneError> {
    // v is optional in OBJ, and 0 then.
    let u = line.numbers::<1>(words, "a texture coordinate")?[0];
    let v = words.get(1).map_or(Ok(0.0), |word| line.number(word, "a texture coordinate"))?;
    Ok([u, v])
}

/// From 1, or back from the last with a minus sign.
fn index(line: &Line<'_>, word: &str, count: usize, what: &str) -> Result<usize, SceneError> {
    let from_end = |i: i64| usize::try_from(count as i64 + i).ok();
    let index = match word.parse::<i64>() {
        Ok(i) if i > 0 => usize::try_from(i - 1).ok(),
        Ok(i) if i < 0 && -(count as i64) <= i => from_end(i),
        _ => None,
    };
    index.filter(|i| *i < count).ok_or_else(|| {
        let allowed = match count {
            0 => "none, there are none above this line".to_owned(),
            _ => format!("1 to {count} (those above this line), or -1 to -{count} from the last"),
        };
        let message = format!("a face names {what} '{}'; allowed: {allowed}", excerpt(word));
        line.error(ErrorKind::OutOfRange, message)
    })
}

/// Writes an OBJ with texture coordinates where the mesh has them. Masses are not part of the format.
///
/// # Errors
/// Those of `out`.
pub fn write_obj(mesh: &TriangleMesh, out: &mut impl Write) -> io::Result<()> {
    for [x, y, z] in &mesh.points {
        writeln!(out, "v {x} {y} {z}")?;
    }
    for [u, v] in &mesh.uv {
        writeln!(out, "vt {u} {v}")?;
    }
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|i| i + 1);
        if mesh.uv.is_empty() {
            writeln!(out, "f {a} {b} {c}")?;
        } else {
            writeln!(out, "f {a}/{a} {b}/{b} {c}/{c}")?;
        }
    }

    Ok(())
}
