//! Mesh files as bytes, by their format: what reading one takes at most, and its reading.
//!
//! Enters: bytes. Leaves: a mesh. The memory of reading is known beforehand, from a look at lines and headers, so that
//! who serves others can refuse a file that is small and would become large.

use super::{
    eti::{EtiOptions, EtiTexts, NamedText, read_eti},
    gzip,
    loaded::Loaded,
    memory::{GROWTH, Widest, lines},
    obj::{self, read_obj},
    off::{self, read_off},
    ply::{self, read_ply},
    stl::{self, read_stl},
    text::{refuse_pointer, text},
};
use crate::error::{ErrorKind, SceneError};

/// A mesh file, or the files of a set of the course.
#[derive(Clone, Copy, Debug)]
pub enum MeshFile<'a> {
    /// Wavefront OBJ, which is text.
    Obj(&'a [u8]),
    /// Object File Format, as text.
    Off(&'a [u8]),
    /// Polygon File Format, as text or binary.
    Ply(&'a [u8]),
    /// STL, as text or binary.
    Stl(&'a [u8]),
    /// A set of the course: points, triangles, masses and texture coordinates.
    Eti {
        /// The file of the points, without which there is no set.
        points: &'a [u8],
        /// faceset.eti, masses.eti and texcoord.eti, where there are.
        others: [Option<&'a [u8]>; 3],
        /// What to do about errors.
        options: EtiOptions,
    },
}

impl MeshFile<'_> {
    /// Reads the mesh; `file` is its name in messages.
    ///
    /// # Errors
    /// The first error, with its line where it has one. A file that gzip has packed, and a pointer of a large-file store.
    pub fn read(&self, file: &str) -> Result<Loaded, SceneError> {
        if gzip::is_packed(self.first()) {
            let message = "is packed by gzip; allowed: the file itself, which `gunzip` unpacks";
            return Err(SceneError::new(ErrorKind::Unsupported, file, message));
        }
        match *self {
            Self::Obj(bytes) => read_obj(&text(bytes, file)?, file),
            Self::Off(bytes) => read_off(&text(bytes, file)?, file),
            Self::Ply(bytes) => refuse_pointer(bytes, file).and_then(|()| read_ply(bytes, file)),
            Self::Stl(bytes) => refuse_pointer(bytes, file).and_then(|()| read_stl(bytes, file)),
            Self::Eti { points, others, options } => {
                let name = |part: &str| format!("{file}/{part}.eti");
                let (first, names) = (name("points"), ["faceset", "masses", "texcoord"].map(name));
                let points = text(points, &first)?;
                let other = |i: usize| others[i].map(|bytes| text(bytes, &names[i])).transpose();
                let others = [other(0)?, other(1)?, other(2)?];
                let named = |i: usize| others[i].as_deref().map(|text| NamedText { file: &names[i], text });
                let texts = EtiTexts {
                    points: NamedText { file: &first, text: &points },
                    faceset: named(0),
                    masses: named(1),
                    texcoord: named(2),
                };
                read_eti(&texts, &options)
            }
        }
    }

    /// The bytes of the file, or of the points of a set.
    fn first(&self) -> &[u8] {
        match *self {
            Self::Obj(bytes) | Self::Off(bytes) | Self::Ply(bytes) | Self::Stl(bytes) => bytes,
            Self::Eti { points, .. } => points,
        }
    }

    /// Bytes that reading takes at most, beside the file's own.
    pub fn memory_bytes(&self) -> u64 {
        match *self {
            Self::Obj(bytes) => copy_of(bytes).saturating_add(obj::memory_bytes(bytes)),
            Self::Off(bytes) => copy_of(bytes).saturating_add(off::memory_bytes(bytes)),
            Self::Ply(bytes) => ply::memory_bytes(bytes),
            Self::Stl(bytes) if stl::is_text(bytes) => {
                copy_of(bytes).saturating_add(stl::memory_bytes(bytes))
            }
            Self::Stl(bytes) => stl::memory_bytes(bytes),
            Self::Eti { points, others, .. } => {
                let texts = std::iter::once(points).chain(others.into_iter().flatten());
                texts.map(|bytes| text_bytes(bytes) + GROWTH * 24 * lines(bytes).count() as u64).sum()
            }
        }
    }
}

/// A text that is not UTF-8 is copied, and each byte that is not may take three.
fn copy_of(bytes: &[u8]) -> u64 {
    if std::str::from_utf8(bytes).is_ok() { 0 } else { 2 * GROWTH * bytes.len() as u64 }
}

/// The same with the widest line, which is held as words.
fn text_bytes(bytes: &[u8]) -> u64 {
    let mut widest = Widest::default();
    lines(bytes).for_each(|line| widest.see(line));
    copy_of(bytes) + widest.bytes()
}

#[cfg(test)]
mod tests {
    use nappe_sim::mesh::TriangleMesh;

    use super::*;
    use crate::mesh::{write_eti, write_obj, write_off, write_ply};

    #[test]
    fn bytes_are_read_as_files_are_and_their_memory_is_known_before() {
        let mesh = TriangleMesh { masses: vec![0.5; 300], ..TriangleMesh::grid(20, 15, 0.5) };
        let [mut obj, mut off, mut ply] = [const { Vec::new() }; 3];
        write_obj(&mesh, &mut obj).expect("memory takes it");
        write_off(&mesh, &mut off).expect("memory takes it");
        write_ply(&mesh, &mut ply).expect("memory takes it");
        let set = write_eti(&mesh);
        let others = [Some(&set.faceset), set.masses.as_ref(), set.texcoord.as_ref()];
        let eti = MeshFile::Eti {
            points: set.points.as_bytes(),
            others: others.map(|text| text.map(String::as_bytes)),
            options: EtiOptions::default(),
        };

        let arrays = 300 * 24 + mesh.triangles.len() as u64 * 12;
        for file in [MeshFile::Obj(&obj), MeshFile::Off(&off), MeshFile::Ply(&ply), eti] {
            let loaded = file.read("test").expect("it was just written");
            assert_eq!((&loaded.mesh.points, &loaded.mesh.triangles), (&mesh.points, &mesh.triangles));
            let bytes = file.memory_bytes();
            assert!(bytes >= arrays && bytes < 60 * arrays, "{file:?}: {bytes}");
        }
    }

    #[test]
    fn what_a_header_announces_takes_no_memory_and_what_a_line_holds_does() {
        let header = "ply\nformat binary_little_endian 1.0\nelement nothing 4000000000\nelement vertex 4000000000\n\
                      property float x\nproperty float y\nproperty float z\nend_header\n";
        assert!(MeshFile::Ply(header.as_bytes()).memory_bytes() < 4096);
        let corners = format!("OFF\n1 1 0\n0 0 0\n1000 {}\n", "0 ".repeat(1000));
        assert!(MeshFile::Off(corners.as_bytes()).memory_bytes() > 998 * 12);
    }

    #[test]
    fn long_lines_are_counted() {
        let line = "0 ".repeat(1000);
        for file in [MeshFile::Obj(line.as_bytes()), MeshFile::Off(line.as_bytes())] {
            assert!(file.memory_bytes() > 1000 * 16, "{file:?}");
        }
    }

    #[test]
    fn an_error_names_the_file_of_a_set_and_the_line() {
        let eti = MeshFile::Eti {
            points: b"1\n0 0 0\n",
            others: [Some(b"0 0 7\n"), None, None],
            options: EtiOptions::default(),
        };
        let error = eti.read("cow").expect_err("there is no point 7");
        assert_eq!((error.file.as_str(), error.line), ("cow/faceset.eti", 1));
    }
}
