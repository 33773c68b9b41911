//! Wavefront OBJ: positions, texture coordinates and faces; groups, normals and materials are
//! ignored.
//!
//! Positions keep their order and their number, because masses and pins name them by index: this
//! is why the reader is ours (those on offer drop or renumber points, and their errors name no
//! line). Polygons become fans of triangles.

use std::io::{self, Write};

use nappe_sim::mesh::TriangleMesh;

use super::{
    loaded::{Loaded, fan},
    numbers::{Line, lines},
};
use crate::error::{ErrorKind, SceneError, excerpt};

/// Reads an OBJ. Texture coordinates are kept where every point has one and only one.
///
/// # Errors
/// The first error, with its line.
pub fn read_obj(text: &str, file: &str) -> Result<Loaded, SceneError> {
    let mut mesh = TriangleMesh::default();
    let mut uv: Vec<[f64; 2]> = Vec::new();
    let mut uv_of_point: Vec<Option<usize>> = Vec::new();
    let mut seams = 0;
    for line in lines(file, text, Some('#')) {
        let words = line.words();
        match words[0] {
            "v" => mesh.points.push(line.numbers(&words[1..], "a vertex")?),
            "vt" => uv.push(texture(&line, &words[1..])?),
            "f" => {
                let corners = face(&line, &words[1..], mesh.points.len(), uv.len())?;
                uv_of_point.resize(mesh.points.len(), None);
                for &(point, texture) in &corners {
                    let slot = &mut uv_of_point[point as usize];
                    seams += usize::from(texture.is_some() && slot.is_some() && *slot != texture);
                    *slot = slot.or(texture);
                }
                let points: Vec<u32> = corners.iter().map(|(point, _)| *point).collect();
                mesh.triangles.extend(fan(&points));
            }
            _ => {}
        }
    }

    if mesh.points.is_empty() {
        return Err(SceneError::new(ErrorKind::BadMesh, file, "holds no vertices ('v x y z')"));
    }
    let mut warnings = Vec::new();
    if seams > 0 {
        warnings.push(format!(
            "{file}: {seams} corners give a point another texture coordinate: the first one is kept"
        ));
    }

    uv_of_point.resize(mesh.points.len(), None);
    let all: Option<Vec<[f64; 2]>> = uv_of_point.iter().map(|t| t.map(|t| uv[t])).collect();
    match all {
        Some(all) => mesh.uv = all,
        None if !uv.is_empty() => {
            warnings.push(format!("{file}: some points have no texture coordinate: none are kept"));
        }
        None => {}
    }

    Ok(Loaded { mesh, warnings })
}

fn texture(line: &Line<'_>, words: &[&str]) -> Result<[f64; 2], SceneError> {
    // v is optional in OBJ, and 0 then.
    let u = line.numbers::<1>(words, "a texture coordinate")?[0];
    let v = words.get(1).map_or(Ok(0.0), |word| line.number(word, "a texture coordinate"))?;
    Ok([u, v])
}

/// The corners of a face: point, and texture coordinate where given.
fn face(
    line: &Line<'_>,
    words: &[&str],
    points: usize,
    textures: usize,
) -> Result<Vec<(u32, Option<usize>)>, SceneError> {
    if words.len() < 3 {
        let message = format!("a face has {} corners; allowed: 3 or more", words.len());
        return Err(line.error(ErrorKind::Syntax, message));
    }

    words
        .iter()
        .map(|word| {
            let mut parts = word.split('/');
            let point = index(line, parts.next().unwrap_or(""), points, "vertex")?;
            let texture = parts.next().filter(|part| !part.is_empty());
            let texture =
                texture.map(|part| index(line, part, textures, "texture coordinate")).transpose()?;
            Ok((point as u32, texture))
        })
        .collect()
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
        let allowed = format!("1 to {count} (those above this line), or -1 to -{count} from the last");
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
