//! PLY, binary or text: positions, texture coordinates, masses and faces; other properties are
//! ignored.
//!
//! Reads any of the three encodings; writes binary little-endian: doubles for a mesh, floats for a
//! frame of a simulation. The parser is `ply-rs-bw`, which takes memory as it reads, never by a
//! count of the header alone.

use std::io::{self, BufReader, Write};

use nappe_sim::mesh::TriangleMesh;
use ply_rs_bw::{
    parser::Parser,
    ply::{Property, PropertyAccess, PropertyAccessResult},
};

use super::loaded::{Loaded, fan};
use crate::error::{ErrorKind, SceneError};

/// A vertex or a face, with the properties that a mesh knows.
#[derive(Debug, Default)]
struct Element {
    xyz: [Option<f64>; 3],
    uv: [Option<f64>; 2],
    mass: Option<f64>,
    corners: Option<Vec<i64>>,
}

/// Memory of an element as the parser keeps it (bytes).
pub(super) const ELEMENT_BYTES: u64 = size_of::<Element>() as u64;

impl PropertyAccess for Element {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let slot = match name {
            "x" => &mut self.xyz[0],
            "y" => &mut self.xyz[1],
            "z" => &mut self.xyz[2],
            "u" | "s" | "texture_u" => &mut self.uv[0],
            "v" | "t" | "texture_v" => &mut self.uv[1],
            "mass" => &mut self.mass,
            "vertex_indices" | "vertex_index" => {
                self.corners = whole_numbers(property);
                return if self.corners.is_some() {
                    PropertyAccessResult::Set
                } else {
                    PropertyAccessResult::UnsupportedType
                };
            }
            _ => return PropertyAccessResult::Ignored,
        };

        *slot = number(&property);
        if slot.is_some() { PropertyAccessResult::Set } else { PropertyAccessResult::UnsupportedType }
    }
}

fn number(property: &Property) -> Option<f64> {
    Some(match *property {
        Property::Char(x) => f64::from(x),
        Property::UChar(x) => f64::from(x),
        Property::Short(x) => f64::from(x),
        Property::UShort(x) => f64::from(x),
        Property::Int(x) => f64::from(x),
        Property::UInt(x) => f64::from(x),
        Property::Float(x) => f64::from(x),
        Property::Double(x) => x,
        _ => return None,
    })
}

fn whole_numbers(property: Property) -> Option<Vec<i64>> {
    Some(match property {
        Property::ListChar(list) => list.into_iter().map(i64::from).collect(),
        Property::ListUChar(list) => list.into_iter().map(i64::from).collect(),
        Property::ListShort(list) => list.into_iter().map(i64::from).collect(),
        Property::ListUShort(list) => list.into_iter().map(i64::from).collect(),
        Property::ListInt(list) => list.into_iter().map(i64::from).collect(),
        Property::ListUInt(list) => list.into_iter().map(i64::from).collect(),
        _ => return None,
    })
}

/// Reads a PLY.
///
/// # Errors
/// The first error; with its line where it is in the header or in a text payload.
pub fn read_ply(bytes: &[u8], file: &str) -> Result<Loaded, SceneError> {
    let mut reader = BufReader::new(bytes);
    let mut ply = Parser::<Element>::new().read_ply(&mut reader).map_err(|error| {
        // The parser's messages run over several lines and repeat the line number.
        let words = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
        let message = format!("is not a PLY that can be read: {words}");
        let located = SceneError::new(ErrorKind::Syntax, file, message);
        match error.line() {
            Some(line) => located.at_line(line),
            None => located,
        }
    })?;

    let bad = |message: String| SceneError::new(ErrorKind::BadMesh, file, message);
    let vertices =
        ply.payload.shift_remove("vertex").ok_or_else(|| bad("has no element 'vertex'".to_owned()))?;
    let faces = ply.payload.shift_remove("face").unwrap_or_default();
    let mut mesh = TriangleMesh::default();
    for (i, vertex) in vertices.iter().enumerate() {
        let [Some(x), Some(y), Some(z)] = vertex.xyz else {
            return Err(bad(format!("vertex {i} lacks a coordinate; allowed: properties x, y and z")));
        };
        if !(x.is_finite() && y.is_finite() && z.is_finite()) {
            return Err(bad(format!("vertex {i} is {x} {y} {z}; allowed: finite numbers")));
        }
        mesh.points.push([x, y, z]);
    }

    mesh.masses = vertices.iter().map_while(|vertex| vertex.mass).collect();
    mesh.uv = vertices.iter().map_while(|vertex| Some([vertex.uv[0]?, vertex.uv[1]?])).collect();
    for (i, face) in faces.iter().enumerate() {
        let Some(corners) = &face.corners else {
            return Err(bad(format!("face {i} lacks its corners; allowed: a list property vertex_indices")));
        };
        let count = mesh.points.len();
        let corners: Option<Vec<u32>> =
            corners.iter().map(|&c| u32::try_from(c).ok().filter(|c| (*c as usize) < count)).collect();
        let Some(corners) = corners else {
            return Err(bad(format!(
                "face {i} names a point that is not there; allowed: 0 to {}",
                count.saturating_sub(1)
            )));
        };
        mesh.triangles.extend(fan(&corners));
    }

    Ok(Loaded { mesh, warnings: Vec::new() })
}

/// Writes a mesh, exactly: doubles, with masses and texture coordinates where it has them.
///
/// # Errors
/// Those of `out`.
pub fn write_ply(mesh: &TriangleMesh, out: &mut impl Write) -> io::Result<()> {
    write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.points.len())?;
    out.write_all(b"property double x\nproperty double y\nproperty double z\n")?;
    if !mesh.masses.is_empty() {
        out.write_all(b"property double mass\n")?;
    }
    if !mesh.uv.is_empty() {
        out.write_all(b"property double u\nproperty double v\n")?;
    }
    write_face_header(mesh.triangles.len(), out)?;
    for (i, point) in mesh.points.iter().enumerate() {
        for c in point {
            out.write_all(&c.to_le_bytes())?;
        }
        if let Some(mass) = mesh.masses.get(i) {
            out.write_all(&mass.to_le_bytes())?;
        }
        for c in mesh.uv.get(i).into_iter().flatten() {
            out.write_all(&c.to_le_bytes())?;
        }
    }

    write_faces(&mesh.triangles, out)
}

/// One frame of a simulation.
#[derive(Clone, Copy, Debug)]
pub struct PlyFrame<'a> {
    /// Positions (m), x y z of each particle.
    pub positions: &'a [f32],
    /// What else is known of the particles.
    pub properties: &'a [PlyProperty<'a>],
    /// Triangles: three indices of particles each.
    pub triangles: &'a [[u32; 3]],
    /// Number of the step, from 0.
    pub step: u64,
    /// Simulated time (s).
    pub time: f64,
}

/// Numbers of every particle beside its position.
#[derive(Clone, Copy, Debug)]
pub struct PlyProperty<'a> {
    /// Names of a particle's numbers, in their order.
    pub names: &'a [&'a str],
    /// The numbers, one a name and particle.
    pub values: &'a [f32],
}

/// Writes a frame: floats, with step and time as comments.
///
/// # Errors
/// Those of `out`.
///
/// # Panics
/// Unless there are three coordinates a particle, and one number of a property a name and particle.
pub fn write_ply_frame(frame: &PlyFrame<'_>, out: &mut impl Write) -> io::Result<()> {
    assert_eq!(frame.positions.len() % 3, 0, "three coordinates a particle");
    let count = frame.positions.len() / 3;
    for PlyProperty { names, values } in frame.properties {
        assert_eq!(values.len(), names.len() * count, "one number a name and particle: {names:?}");
    }
    write!(out, "ply\nformat binary_little_endian 1.0\ncomment step {}\n", frame.step)?;
    write!(out, "comment time_seconds {}\nelement vertex {}\n", frame.time, count)?;
    out.write_all(b"property float x\nproperty float y\nproperty float z\n")?;
    for name in frame.properties.iter().flat_map(|property| property.names) {
        writeln!(out, "property float {name}")?;
    }
    write_face_header(frame.triangles.len(), out)?;
    for (particle, position) in frame.positions.chunks_exact(3).enumerate() {
        let numbers = frame.properties.iter().flat_map(|PlyProperty { names, values }| {
            let width = names.len();
            &values[width * particle..width * (particle + 1)]
        });
        for number in position.iter().chain(numbers) {
            out.write_all(&number.to_le_bytes())?;
        }
    }

    write_faces(frame.triangles, out)
}

fn write_face_header(count: usize, out: &mut impl Write) -> io::Result<()> {
    write!(out, "element face {count}\nproperty list uchar uint vertex_indices\nend_header\n")
}

fn write_faces(triangles: &[[u32; 3]], out: &mut impl Write) -> io::Result<()> {
    for corners in triangles {
        out.write_all(&[3])?;
        for c in corners {
            out.write_all(&c.to_le_bytes())?;
        }
    }
    Ok(())
}
