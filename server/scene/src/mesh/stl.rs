//! STL, binary or text: facets, whose corners in one place become one point.
//!
//! A file says the corners of each facet anew. Those with the same three coordinates, bit by bit, are one point, in
//! the order in which places appear, so that a closed solid is a closed mesh. Names, normals and colours are ignored.

use std::{array, collections::HashMap};

use nappe_sim::mesh::TriangleMesh;

use super::{
    loaded::Loaded,
    numbers::{Line, lines},
    text::text,
};
use crate::error::{ErrorKind, SceneError, excerpt};

/// Bytes before the facets of a binary file; the last four of them count the facets.
const HEAD_BYTES: usize = 84;
/// Bytes of a facet: a normal, three corners, and a number of colours.
const FACET_BYTES: usize = 50;
/// Bytes that a facet takes at most while vectors grow: its corners, their places in the table, and a triangle. In a
/// text, a facet has more bytes than in a binary file.
const FACET_MEMORY: u64 = 3 * (3 * 24 + 120) + 3 * 12;

/// Facets as they come.
#[derive(Debug, Default)]
struct Facets {
    mesh: TriangleMesh,
    /// The point in each place, by the bits of its coordinates.
    points: HashMap<[u64; 3], u32>,
    /// Facets of which two corners are in one place.
    left_out: usize,
}

impl Facets {
    fn add(&mut self, corners: [[f64; 3]; 3]) {
        // 0 is added so that -0 and 0 are one place.
        let places @ [a, b, c] = corners.map(|corner| corner.map(|x| (x + 0.0).to_bits()));
        if a == b || b == c || a == c {
            self.left_out += 1;
            return;
        }
        let Self { mesh, points, .. } = self;
        let triangle = array::from_fn(|i| {
            *points.entry(places[i]).or_insert_with(|| {
                mesh.points.push(corners[i]);
                (mesh.points.len() - 1) as u32
            })
        });
        mesh.triangles.push(triangle);
    }
}

/// Reads an STL.
///
/// # Errors
/// The first error, with its line in a text, with its facet in a binary file.
pub fn read_stl(bytes: &[u8], file: &str) -> Result<Loaded, SceneError> {
    let (mut facets, mut warnings) = (Facets::default(), Vec::new());
    if is_text(bytes) {
        read_text(&text(bytes, file)?, file, &mut facets)?;
    } else {
        read_binary(bytes, file, &mut facets, &mut warnings)?;
    }

    let Facets { mesh, left_out, .. } = facets;
    if mesh.triangles.is_empty() {
        let message = format!(
            "holds no triangles ({left_out} facets have two corners in one place); allowed: one facet or more"
        );
        return Err(SceneError::new(ErrorKind::BadMesh, file, message));
    }
    if left_out > 0 {
        warnings.push(format!("{file}: {left_out} facets have two corners in one place: they are left out"));
    }
    Ok(Loaded { mesh, warnings })
}

/// Whether a file is a text. Some programs begin binary files as texts begin: their length tells, or a byte 0.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let begins_so = text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let is_binary = bytes.split_first_chunk::<HEAD_BYTES>().is_some_and(|(head, facets)| {
        u64::from(announced(head)) * FACET_BYTES as u64 == facets.len() as u64 || head.contains(&0)
    });
    begins_so && !is_binary
}

/// The number of facets that a binary file announces.
fn announced(head: &[u8; HEAD_BYTES]) -> u32 {
    u32::from_le_bytes([head[80], head[81], head[82], head[83]])
}

fn read_binary(
    bytes: &[u8],
    file: &str,
    facets: &mut Facets,
    warnings: &mut Vec<String>,
) -> Result<(), SceneError> {
    let Some((head, rest)) = bytes.split_first_chunk::<HEAD_BYTES>() else {
        let message = format!(
            "has {} bytes; allowed: a text that begins with 'solid', or {HEAD_BYTES} bytes and {FACET_BYTES} for each facet",
            bytes.len()
        );
        return Err(SceneError::new(ErrorKind::Syntax, file, message));
    };
    let count = announced(head) as usize;
    let (whole, _) = rest.as_chunks::<FACET_BYTES>();
    if whole.len() < count {
        let message = format!(
            "announces {count} facets of {FACET_BYTES} bytes, but the file ends after {}: it may be cut, or no STL",
            whole.len()
        );
        return Err(SceneError::new(ErrorKind::Inconsistent, file, message));
    }

    for (index, facet) in whole[..count].iter().enumerate() {
        // The normal stands before the corners, which it follows from.
        let number = |at: usize| f32::from_le_bytes([facet[at], facet[at + 1], facet[at + 2], facet[at + 3]]);
        let corner = |corner: usize| array::from_fn(|axis| f64::from(number(12 + 12 * corner + 4 * axis)));
        let corners: [[f64; 3]; 3] = array::from_fn(corner);
        if let Some([x, y, z]) = corners.iter().find(|corner| !corner.iter().all(|x| x.is_finite())) {
            let message =
                format!("facet {index} (from 0) has a corner at {x} {y} {z}; allowed: finite numbers");
            return Err(SceneError::new(ErrorKind::BadMesh, file, message));
        }
        facets.add(corners);
    }

    match rest.len() - count * FACET_BYTES {
        0 => {}
        left => warnings.push(format!("{file}: {left} bytes after the last facet are ignored")),
    }
    Ok(())
}

fn read_text(text: &str, file: &str, facets: &mut Facets) -> Result<(), SceneError> {
    let mut rest = lines(file, text, None);
    while let Some(line) = rest.next() {
        begins(&line, &["solid"])?;
        while begins(&next(&mut rest, file, "endsolid")?, &["facet", "endsolid"])? == "facet" {
            begins(&next(&mut rest, file, "outer loop")?, &["outer"])?;
            let mut corners = [[0.0; 3]; 3];
            for corner in &mut corners {
                let line = next(&mut rest, file, "vertex")?;
                begins(&line, &["vertex"])?;
                let numbers: Vec<&str> = line.text.split_whitespace().skip(1).take(3).collect();
                *corner = line.numbers(&numbers, "a vertex")?;
            }
            begins(&next(&mut rest, file, "endloop")?, &["endloop"])?;
            begins(&next(&mut rest, file, "endfacet")?, &["endfacet"])?;
            facets.add(corners);
        }
    }
    Ok(())
}

/// The next line; `missing` is what the text lacks without it.
fn next<'a>(
    rest: &mut impl Iterator<Item = Line<'a>>,
    file: &str,
    missing: &str,
) -> Result<Line<'a>, SceneError> {
    rest.next().ok_or_else(|| {
        let message = format!("ends before a line '{missing}': the file may be cut; allowed: whole solids");
        SceneError::new(ErrorKind::Inconsistent, file, message)
    })
}

/// The word of `allowed` with which a line begins, in small letters or not.
fn begins<'a>(line: &Line<'_>, allowed: &[&'a str]) -> Result<&'a str, SceneError> {
    let found = line.text.split_whitespace().next().unwrap_or_default();
    allowed.iter().find(|word| found.eq_ignore_ascii_case(word)).copied().ok_or_else(|| {
        let message =
            format!("says '{}'; allowed here: a line '{}'", excerpt(line.text), allowed.join("' or '"));
        line.error(ErrorKind::Syntax, message)
    })
}

/// Bytes that reading takes at most, beside the file's own and the copy of a text.
pub(super) fn memory_bytes(bytes: &[u8]) -> u64 {
    (bytes.len() as u64).saturating_mul(FACET_MEMORY.div_ceil(FACET_BYTES as u64))
}
