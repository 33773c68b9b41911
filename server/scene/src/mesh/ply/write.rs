//! Writing of PLY files, binary little-endian: meshes, and frames of a simulation.

use std::{
    io::{self, Write},
    ops::Range,
};

use nappe_sim::mesh::{MeshSpring, SpringKind, TriangleMesh};

/// The end of every header.
const END: &[u8] = b"end_header\n";
/// The properties of a spring, in the order in which [`write_spring`] writes them.
const SPRING_PROPERTIES: &[u8] = b"property uint vertex1\nproperty uint vertex2\nproperty double stiffness\n\
    property double damping\nproperty double rest_length\nproperty uchar kind\n";

/// Writes a mesh, exactly: doubles, with masses, texture coordinates, velocities and springs where it has them.
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
    if !mesh.velocities.is_empty() {
        out.write_all(b"property double vx\nproperty double vy\nproperty double vz\n")?;
    }
    write_face_header(mesh.triangles.len(), out)?;
    if !mesh.springs.is_empty() {
        writeln!(out, "element edge {}", mesh.springs.len())?;
        out.write_all(SPRING_PROPERTIES)?;
    }
    out.write_all(END)?;
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
        for c in mesh.velocities.get(i).into_iter().flatten() {
            out.write_all(&c.to_le_bytes())?;
        }
    }

    write_faces(&mesh.triangles, out)?;
    mesh.springs.iter().try_for_each(|spring| write_spring(spring, out))
}

/// One frame of a simulation.
#[derive(Clone, Copy, Debug)]
pub struct PlyFrame<'a> {
    /// Positions (m), x y z of each particle.
    pub positions: PlyNumbers<'a>,
    /// What else is known of the particles.
    pub properties: &'a [PlyProperty<'a>],
    /// Triangles: three indices of particles each.
    pub triangles: &'a [[u32; 3]],
    /// Number of the step, from 0.
    pub step: u64,
    /// Simulated time (s).
    pub time: f64,
    /// What else it says of itself, a line each, of printable characters.
    pub comments: &'a [String],
}

/// Numbers of every particle beside its position.
#[derive(Clone, Copy, Debug)]
pub struct PlyProperty<'a> {
    /// Names of a particle's numbers, in their order.
    pub names: &'a [&'a str],
    /// The numbers, one a name and particle.
    pub values: PlyNumbers<'a>,
}

/// Numbers of particles in the precision that they have; a file holds the same bits.
#[derive(Clone, Copy, Debug)]
pub enum PlyNumbers<'a> {
    /// In binary32, the type `float` of a file.
    F32(&'a [f32]),
    /// In binary64, the type `double` of a file.
    F64(&'a [f64]),
}

impl PlyNumbers<'_> {
    fn count(self) -> usize {
        match self {
            Self::F32(numbers) => numbers.len(),
            Self::F64(numbers) => numbers.len(),
        }
    }

    /// What a header calls their type.
    const fn type_name(self) -> &'static str {
        match self {
            Self::F32(_) => "float",
            Self::F64(_) => "double",
        }
    }

    fn write(self, range: Range<usize>, out: &mut impl Write) -> io::Result<()> {
        match self {
            Self::F32(numbers) => {
                numbers[range].iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))
            }
            Self::F64(numbers) => {
                numbers[range].iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))
            }
        }
    }
}

/// Writes a frame: its numbers as they are, with step, time and what else it says as comments.
///
/// # Errors
/// Those of `out`.
///
/// # Panics
/// Unless there are three coordinates a particle, and one number of a property a name and particle.
pub fn write_ply_frame(frame: &PlyFrame<'_>, out: &mut impl Write) -> io::Result<()> {
    assert_eq!(frame.positions.count() % 3, 0, "three coordinates a particle");
    let count = frame.positions.count() / 3;
    for PlyProperty { names, values } in frame.properties {
        assert_eq!(values.count(), names.len() * count, "one number a name and particle: {names:?}");
    }
    write!(out, "ply\nformat binary_little_endian 1.0\ncomment step {}\n", frame.step)?;
    writeln!(out, "comment time_seconds {}", frame.time)?;
    for comment in frame.comments {
        writeln!(out, "comment {comment}")?;
    }
    writeln!(out, "element vertex {count}")?;

    let positions = PlyProperty { names: &["x", "y", "z"], values: frame.positions };
    let properties = || std::iter::once(&positions).chain(frame.properties);
    for PlyProperty { names, values } in properties() {
        for name in *names {
            writeln!(out, "property {} {name}", values.type_name())?;
        }
    }
    write_face_header(frame.triangles.len(), out)?;
    out.write_all(END)?;
    for particle in 0..count {
        for PlyProperty { names, values } in properties() {
            let width = names.len();
            values.write(width * particle..width * (particle + 1), out)?;
        }
    }

    write_faces(frame.triangles, out)
}

fn write_face_header(count: usize, out: &mut impl Write) -> io::Result<()> {
    write!(out, "element face {count}\nproperty list uchar uint vertex_indices\n")
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

/// A spring without a rest length has NaN there.
fn write_spring(spring: &MeshSpring, out: &mut impl Write) -> io::Result<()> {
    for point in spring.points {
        out.write_all(&point.to_le_bytes())?;
    }
    for number in [spring.stiffness, spring.damping, spring.rest_length.unwrap_or(f64::NAN)] {
        out.write_all(&number.to_le_bytes())?;
    }
    let kind = match spring.kind {
        SpringKind::Stretch => 0,
        SpringKind::Shear => 1,
        SpringKind::Bend => 2,
    };
    out.write_all(&[kind])
}
