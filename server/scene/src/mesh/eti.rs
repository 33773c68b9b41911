//! The course's `.eti` sets: points, triangles, masses and texture coordinates, a text each.
//!
//! Reads texts with any white space and blank lines; says what is missing or left over and where.
//! Writes what the course's own tool writes, digit for digit.

use std::fmt::Write;

use nappe_sim::{math::number, mesh::TriangleMesh};

use super::{
    loaded::Loaded,
    numbers::{Line, lines, six_digits},
};
use crate::error::{ErrorKind, SceneError};

/// A text and its name in messages.
#[derive(Clone, Copy, Debug)]
pub struct NamedText<'a> {
    /// Its name in messages.
    pub file: &'a str,
    /// What the file holds.
    pub text: &'a str,
}

/// The texts of a set.
#[derive(Clone, Copy, Debug)]
pub struct EtiTexts<'a> {
    /// points.eti: the number of points, then `x y z` (m) on each line.
    pub points: NamedText<'a>,
    /// faceset.eti: three point indices on each line, from 0; none for free particles.
    pub faceset: Option<NamedText<'a>>,
    /// masses.eti: a mass (kg) on each line, 0 pins; none for a mesh without masses.
    pub masses: Option<NamedText<'a>>,
    /// texcoord.eti: `u v` on each line; none for a mesh without.
    pub texcoord: Option<NamedText<'a>>,
}

/// What to do about errors in a set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EtiOptions {
    /// The mass (kg) of points that masses.eti leaves out; none: refuse.
    pub missing_mass: Option<f64>,
}

/// The four texts of a set, as the course's tool writes them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EtiWritten {
    /// Text of `points.eti`.
    pub points: String,
    /// Text of `faceset.eti`.
    pub faceset: String,
    /// masses.eti; none for a mesh without masses.
    pub masses: Option<String>,
    /// texcoord.eti; none for a mesh without.
    pub texcoord: Option<String>,
}

/// Reads a set.
///
/// # Errors
/// The first error, with file and line. Masses that are missing are an error unless
/// `options` gives them a value.
pub fn read_eti(texts: &EtiTexts<'_>, options: &EtiOptions) -> Result<Loaded, SceneError> {
    let mut loaded = Loaded::default();
    loaded.mesh.points = read_points(&texts.points)?;
    let count = loaded.mesh.points.len();
    for line in texts.faceset.iter().flat_map(|t| lines(t.file, t.text, None)) {
        let words = line.words();
        let [a, b, c] = words[..] else {
            let message = format!("has {} indices; allowed: three, a triangle", words.len());
            return Err(line.error(ErrorKind::Syntax, message));
        };
        loaded.mesh.triangles.push([line.index(a, count)?, line.index(b, count)?, line.index(c, count)?]);
    }

    if let Some(masses) = &texts.masses {
        loaded.mesh.masses = read_masses(masses, count, options, &mut loaded.warnings)?;
    }
    if let Some(texcoord) = &texts.texcoord {
        loaded.mesh.uv = read_texcoord(texcoord, count)?;
    }
    Ok(loaded)
}

fn read_points(points: &NamedText<'_>) -> Result<Vec<[f64; 3]>, SceneError> {
    let mut rest = lines(points.file, points.text, None);
    let Some(first) = rest.next() else {
        return Err(SceneError::new(
            ErrorKind::Syntax,
            points.file,
            "is empty; allowed: a number of points first",
        ));
    };

    let count = first.count(first.text, "points")?;
    let mut out = Vec::new();
    for line in rest {
        exactly(&line, 3, "a point")?;
        out.push(line.numbers(&line.words(), "a point")?);
    }

    if out.len() != count {
        let message = format!("announces {count} points, but {} follow", out.len());
        return Err(first.error(ErrorKind::Inconsistent, message));
    }

    Ok(out)
}

fn read_masses(
    masses: &NamedText<'_>,
    count: usize,
    options: &EtiOptions,
    warnings: &mut Vec<String>,
) -> Result<Vec<f64>, SceneError> {
    let mut out = Vec::new();
    let mut last_line = None;
    for line in lines(masses.file, masses.text, None) {
        exactly(&line, 1, "a mass")?;
        let mass = line.number(line.text, "a mass")?;
        if mass < 0.0 {
            let (point, found) = (out.len(), number(mass));
            let message = format!("the mass of point {point} is {found}; allowed: 0 (pinned) or more");
            return Err(line.error(ErrorKind::OutOfRange, message));
        }
        if out.len() == count {
            let message = format!("has more masses than the {count} points; allowed: one per point");
            return Err(line.error(ErrorKind::Inconsistent, message));
        }
        out.push(mass);
        last_line = Some(line);
    }

    // The file does not say how many masses it holds: a last line without its end may be cut
    // anywhere (`1` of `1.25`), so it does not count as a mass.
    let cut = last_line.filter(|_| masses.text.chars().last().is_some_and(|c| !c.is_whitespace()));
    if cut.is_some() {
        out.pop();
    }
    if out.len() == count {
        return Ok(out);
    }
    let found = format!(
        "holds {} masses{} for {count} points",
        out.len(),
        cut.map_or(String::new(), |line| format!(
            " and an unfinished line {} ('{}' without an end of line: the file may be cut)",
            line.number, line.text
        ))
    );

    let Some(value) = options.missing_mass else {
        let message = format!(
            "{found}; point {} is the first without: end the file, or say which mass the missing ones have (missing mass, kg)",
            out.len()
        );
        let error = SceneError::new(ErrorKind::Inconsistent, masses.file, message);
        return Err(error.at_line(last_line.map_or(1, |line| line.number)));
    };

    warnings.push(format!(
        "{} {found}: points {} to {} get the mass {} kg",
        masses.file,
        out.len(),
        count - 1,
        number(value)
    ));

    out.resize(count, value);
    Ok(out)
}

fn read_texcoord(texcoord: &NamedText<'_>, count: usize) -> Result<Vec<[f64; 2]>, SceneError> {
    let mut out = Vec::new();
    for line in lines(texcoord.file, texcoord.text, None) {
        exactly(&line, 2, "a texture coordinate")?;
        out.push(line.numbers(&line.words(), "a texture coordinate")?);
    }
    if out.len() != count {
        let message =
            format!("holds {} texture coordinates for {count} points; allowed: one per point", out.len());
        return Err(SceneError::new(ErrorKind::Inconsistent, texcoord.file, message));
    }
    Ok(out)
}

fn exactly(line: &Line<'_>, count: usize, what: &str) -> Result<(), SceneError> {
    let found = line.words().len();
    if found == count {
        return Ok(());
    }
    Err(line.error(ErrorKind::Syntax, format!("{what} has {found} numbers; allowed: {count}")))
}

/// Writes a set: numbers with 6 significant digits, one blank between them, one end of line after.
pub fn write_eti(mesh: &TriangleMesh) -> EtiWritten {
    let mut points = format!("{}\n", mesh.points.len());
    // Writing to a String cannot fail.
    for [x, y, z] in &mesh.points {
        let _ = writeln!(points, "{} {} {}", six_digits(*x), six_digits(*y), six_digits(*z));
    }
    let mut faceset = String::new();
    for [a, b, c] in &mesh.triangles {
        let _ = writeln!(faceset, "{a} {b} {c}");
    }
    let mut masses = String::new();
    for mass in &mesh.masses {
        let _ = writeln!(masses, "{}", six_digits(*mass));
    }
    let mut texcoord = String::new();
    for [u, v] in &mesh.uv {
        let _ = writeln!(texcoord, "{} {}", six_digits(*u), six_digits(*v));
    }
    let some = |text: String| Some(text).filter(|text| !text.is_empty());
    EtiWritten { points, faceset, masses: some(masses), texcoord: some(texcoord) }
}
