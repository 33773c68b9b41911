//! STL, binary or text: facets, whose corners in one place become one point.
//!
//! A file says the corners of each facet anew. Those with the same three coordinates, bit by bit, are one point, in
//! the order in which places appear, so that a closed solid is a closed mesh. Names, normals and colours are ignored.

use std::{
    array,
    hash::{BuildHasher as _, RandomState},
};

use nappe_sim::mesh::TriangleMesh;

use super::{
    loaded::Loaded,
    memory::{self, BESIDE, POINT, TRIANGLE, make_room},
    numbers::{Line, lines},
    text::text,
};
use crate::error::{ErrorKind, SceneError, excerpt};

/// Bytes before the facets of a binary file; the last four of them count the facets.
const HEAD_BYTES: usize = 84;
/// Bytes of a facet: a normal, three corners, and a number of colours.
const FACET_BYTES: usize = 50;
/// Lines of a facet in a text.
const FACET_LINES: usize = 7;
/// Facets at most: their corners are numbered in 32 bits.
const MOST_FACETS: usize = (u32::MAX / 3) as usize - 1;
/// Places in the table for each corner, if no two are in one place: half of them stay free.
const SLOTS_PER_CORNER: usize = 2;
/// Bytes that joining the corners of a facet takes at most: its triangle, three points of its own, and its triangle once more where
/// facets are left out. The table is gone by then, and is smaller.
const JOINED_BYTES: u64 = TRIANGLE + 3 * POINT + TRIANGLE;

/// The corners of a facet (m).
type Facet = [[f64; 3]; 3];

/// Stands for the corners of a facet that is left out, and for a free place in the table.
const NONE: u32 = u32::MAX;

/// The first corner in each place, by its number: a table whose keys are where corners are, and are not kept. Its hash is another one
/// each time, so that no file can be made for it.
#[derive(Debug)]
struct Firsts {
    slots: Vec<u32>,
    hash: RandomState,
    /// Corners in it.
    count: usize,
}

impl Firsts {
    /// Of none of so many corners.
    fn of(corners: usize) -> Self {
        let hash = RandomState::new();
        Self { slots: vec![NONE; SLOTS_PER_CORNER * corners + 1], hash, count: 0 }
    }

    /// The first corner in a place, which is this one if there was none.
    fn first(&mut self, corner: u32, place: [u64; 3], place_of: impl Fn(u32) -> [u64; 3]) -> u32 {
        let count = self.slots.len();
        let mut slot = ((u128::from(self.hash.hash_one(place)) * count as u128) >> u64::BITS) as usize;
        loop {
            let known = self.slots[slot];
            if known == NONE {
                self.slots[slot] = corner;
                self.count += 1;
                return corner;
            }
            if place_of(known) == place {
                return known;
            }
            slot = (slot + 1) % count;
        }
    }
}

/// A place by the bits of its coordinates. 0 is added so that -0 and 0 are one place.
fn place(corner: [f64; 3]) -> [u64; 3] {
    corner.map(|x| (x + 0.0).to_bits())
}

/// Makes one point of corners in one place, in the order in which places appear; tells how many of `count` facets have two corners in one,
/// and are left out.
///
/// # Errors
/// More facets than can be numbered.
fn joined(
    count: usize,
    file: &str,
    facet: impl Fn(usize) -> Facet,
) -> Result<(TriangleMesh, usize), SceneError> {
    if count > MOST_FACETS {
        let message = format!("has {count} facets; allowed: at most {MOST_FACETS}");
        return Err(SceneError::new(ErrorKind::TooLarge, file, message));
    }
    let corner = |number: usize| facet(number / 3)[number % 3];
    let mut firsts = Firsts::of(3 * count);
    let (mut triangles, mut left_out) = (Vec::new(), 0);
    make_room(&mut triangles, count);
    for number in 0..count {
        let places @ [a, b, c] = facet(number).map(place);
        if a == b || b == c || a == c {
            left_out += 1;
            triangles.push([NONE; 3]);
            continue;
        }
        let first = |i: usize| {
            firsts.first((3 * number + i) as u32, places[i], |other| place(corner(other as usize)))
        };
        triangles.push([0, 1, 2].map(first));
    }

    let mut points = Vec::new();
    make_room(&mut points, firsts.count);
    drop(firsts);
    // A first corner stands before all others in its place: they find the number of its point in its stead.
    let names = triangles.as_flattened_mut();
    for number in 0..names.len() {
        let first = names[number];
        if first as usize == number {
            names[number] = points.len() as u32;
            points.push(corner(number));
        } else if first != NONE {
            names[number] = names[first as usize];
        }
    }
    if left_out > 0 {
        triangles.retain(|names| names[0] != NONE);
        triangles.shrink_to_fit();
    }
    Ok((TriangleMesh { points, triangles, ..TriangleMesh::default() }, left_out))
}

/// Reads an STL.
///
/// # Errors
/// The first error, with its line in a text, with its facet in a binary file.
pub fn read_stl(bytes: &[u8], file: &str) -> Result<Loaded, SceneError> {
    let mut warnings = Vec::new();
    let (mesh, left_out) = if is_text(bytes) {
        let facets = read_text(&text(bytes, file)?, file)?;
        joined(facets.len(), file, |number| facets[number])?
    } else {
        let facets = read_binary(bytes, file, &mut warnings)?;
        joined(facets.len(), file, |number| corners(&facets[number]))?
    };
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

/// The facets of a binary file, whose corners are finite.
fn read_binary<'a>(
    bytes: &'a [u8],
    file: &str,
    warnings: &mut Vec<String>,
) -> Result<&'a [[u8; FACET_BYTES]], SceneError> {
    let Some((head, rest)) = bytes.split_first_chunk::<HEAD_BYTES>() else {
        let message = format!(
            "has {} bytes; allowed: a text that begins with 'solid', or {HEAD_BYTES} bytes and {FACET_BYTES} for each facet",
            bytes.len()
        );
        return Err(SceneError::new(ErrorKind::Syntax, file, message));
    };
    let count = announced(head) as usize;
    let (whole, _) = rest.as_chunks::<FACET_BYTES>();
    let Some(facets) = whole.get(..count) else {
        let message = format!(
            "announces {count} facets of {FACET_BYTES} bytes, but the file ends after {}: it may be cut, or no STL",
            whole.len()
        );
        return Err(SceneError::new(ErrorKind::Inconsistent, file, message));
    };

    for (index, facet) in facets.iter().enumerate() {
        let not_finite = corners(facet).into_iter().find(|corner| !corner.iter().all(|x| x.is_finite()));
        if let Some([x, y, z]) = not_finite {
            let message =
                format!("facet {index} (from 0) has a corner at {x} {y} {z}; allowed: finite numbers");
            return Err(SceneError::new(ErrorKind::BadMesh, file, message));
        }
    }

    match rest.len() - count * FACET_BYTES {
        0 => {}
        left => warnings.push(format!("{file}: {left} bytes after the last facet are ignored")),
    }
    Ok(facets)
}

/// The corners of a facet of a binary file.
fn corners(facet: &[u8; FACET_BYTES]) -> Facet {
    // The normal stands before the corners, which it follows from.
    let number = |at: usize| f32::from_le_bytes([facet[at], facet[at + 1], facet[at + 2], facet[at + 3]]);
    array::from_fn(|corner| array::from_fn(|axis| f64::from(number(12 + 12 * corner + 4 * axis))))
}

/// The facets of a text.
fn read_text(text: &str, file: &str) -> Result<Vec<Facet>, SceneError> {
    let mut facets = Vec::new();
    make_room(&mut facets, facets_in_text(text.as_bytes()));
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
            facets.push(corners);
        }
    }
    Ok(facets)
}

/// Facets that a text has at most.
fn facets_in_text(text: &[u8]) -> usize {
    memory::lines(text).count() / FACET_LINES
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
    allowed.iter().find(|word| begins_with(line.text, word)).copied().ok_or_else(|| {
        let message =
            format!("says '{}'; allowed here: a line '{}'", excerpt(line.text), allowed.join("' or '"));
        line.error(ErrorKind::Syntax, message)
    })
}

/// Whether a line begins with a word. Some programs part the words of an end: `end solid`, `end_loop`.
fn begins_with(line: &str, word: &str) -> bool {
    let mut words = line.split_whitespace();
    let [first, second] = [(); 2].map(|()| words.next().unwrap_or_default());
    let is_parted = |of: &str| match first.split_once(['_', '-']) {
        Some((end, rest)) => end.eq_ignore_ascii_case("end") && rest.eq_ignore_ascii_case(of),
        None => first.eq_ignore_ascii_case("end") && second.eq_ignore_ascii_case(of),
    };
    first.eq_ignore_ascii_case(word) || word.strip_prefix("end").is_some_and(is_parted)
}

/// Bytes that reading takes at most, beside the file's own and the copy of a text.
pub(super) fn memory_bytes(bytes: &[u8]) -> u64 {
    let (facets, each) = if is_text(bytes) {
        (facets_in_text(bytes), size_of::<Facet>() as u64 + JOINED_BYTES)
    } else {
        let whole = bytes.len().saturating_sub(HEAD_BYTES) / FACET_BYTES;
        let announced = bytes.first_chunk().map_or(0, |head| announced(head) as usize);
        // A file that ends before the last of them is refused.
        (if announced > whole { 0 } else { announced }, JOINED_BYTES)
    };
    BESIDE.saturating_add(each.saturating_mul(facets as u64))
}
