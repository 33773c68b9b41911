//! Mesh files as bytes, by their format: what reading one takes at most, and its reading.
//!
//! Enters: bytes. Leaves: a mesh. The memory of reading is known beforehand, from a look at lines and headers, so that
//! who serves others can refuse a file that is small and would become large.

use super::{
    eti::{EtiOptions, EtiTexts, NamedText, read_eti},
    loaded::Loaded,
    obj::read_obj,
    off::read_off,
    ply::{ELEMENT_BYTES, read_ply},
};
use crate::error::SceneError;

/// A vector that grows has at most so many times the bytes of its elements, while it is copied.
const GROWTH: u64 = 3;

/// A mesh file, or the files of a set of the course.
#[derive(Clone, Copy, Debug)]
pub enum MeshFile<'a> {
    /// Wavefront OBJ, which is text.
    Obj(&'a [u8]),
    /// Object File Format, as text.
    Off(&'a [u8]),
    /// Polygon File Format, as text or binary.
    Ply(&'a [u8]),
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
    /// The first error, with its line where it has one.
    pub fn read(&self, file: &str) -> Result<Loaded, SceneError> {
        match *self {
            Self::Obj(bytes) => read_obj(&String::from_utf8_lossy(bytes), file),
            Self::Off(bytes) => read_off(&String::from_utf8_lossy(bytes), file),
            Self::Ply(bytes) => read_ply(bytes, file),
            Self::Eti { points, others, options } => {
                let names = ["faceset", "masses", "texcoord"].map(|name| format!("{file}/{name}.eti"));
                let texts = others.map(|bytes| bytes.map(String::from_utf8_lossy));
                let text = |i: usize| texts[i].as_deref().map(|text| NamedText { file: &names[i], text });
                let texts = EtiTexts {
                    points: NamedText {
                        file: &format!("{file}/points.eti"),
                        text: &String::from_utf8_lossy(points),
                    },
                    faceset: text(0),
                    masses: text(1),
                    texcoord: text(2),
                };
                read_eti(&texts, &options)
            }
        }
    }

    /// Bytes that reading takes at most, beside the file's own.
    pub fn memory_bytes(&self) -> u64 {
        match *self {
            Self::Obj(bytes) => copy_of(bytes).saturating_add(obj_bytes(bytes)),
            Self::Off(bytes) => copy_of(bytes).saturating_add(off_bytes(bytes)),
            Self::Ply(bytes) => ply_bytes(bytes),
            Self::Eti { points, others, .. } => {
                let texts = std::iter::once(points).chain(others.into_iter().flatten());
                texts.map(|bytes| copy_of(bytes) + GROWTH * 24 * lines(bytes).count() as u64).sum()
            }
        }
    }
}

fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    bytes.split(|byte| *byte == b'\n')
}

fn words(line: &[u8]) -> u64 {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).count() as u64
}

/// A text that is not UTF-8 is copied, and each byte that is not may take three.
fn copy_of(bytes: &[u8]) -> u64 {
    if std::str::from_utf8(bytes).is_ok() { 0 } else { 2 * GROWTH * bytes.len() as u64 }
}

/// Points with what joins them to texture coordinates, texture coordinates, triangles of faces.
fn obj_bytes(bytes: &[u8]) -> u64 {
    let of_line = |line: &[u8]| match line.trim_ascii_start() {
        [b'v', b't', ..] => 16,
        [b'v', ..] => 24 + 16 + 16,
        [b'f', ..] => 12 * words(line),
        _ => 0,
    };
    GROWTH * lines(bytes).map(of_line).sum::<u64>()
}

/// Each line is a point, or a face of as many triangles as it has words.
fn off_bytes(bytes: &[u8]) -> u64 {
    GROWTH * lines(bytes).map(|line| 24.max(12 * words(line))).sum::<u64>()
}

/// Elements as the parser keeps them, lists as they are read and as triangles, and the mesh.
fn ply_bytes(bytes: &[u8]) -> u64 {
    let (mut elements, mut list_factor, mut header) = (0_u64, 0_u64, 0_usize);
    for line in lines(bytes) {
        header += line.len() + 1;
        let line: Vec<&[u8]> = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
        match line[..] {
            [b"element", _, count] => {
                let count = std::str::from_utf8(count).ok().and_then(|count| count.parse::<u64>().ok());
                elements = elements.saturating_add(count.unwrap_or(u64::MAX));
            }
            // A number of one byte becomes one of eight bytes, and a triangle of twelve.
            [b"property", b"list", _, item, ..] => {
                let size = match item {
                    b"char" | b"uchar" | b"int8" | b"uint8" => 1,
                    b"short" | b"ushort" | b"int16" | b"uint16" => 2,
                    _ => 4,
                };
                list_factor = list_factor.max((8 + GROWTH * 12) / size);
            }
            [b"end_header"] => break,
            _ => {}
        }
    }
    let body = bytes.len().saturating_sub(header) as u64;
    let of_element = GROWTH * (ELEMENT_BYTES + 24 + 24);
    elements.saturating_mul(of_element).saturating_add(body.saturating_mul(list_factor))
}

#[cfg(test)]
mod tests {
    use nappe_sim::mesh::TriangleMesh;

    use super::*;
    use crate::mesh::{write_eti, write_obj, write_off, write_ply};

    #[test]
    fn bytes_are_read_as_files_are_and_their_memory_is_known_before() {
        let mesh = TriangleMesh { masses: vec![0.5; 12], ..TriangleMesh::grid(4, 3, 0.5) };
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

        let arrays = 12 * 24 + mesh.triangles.len() as u64 * 12;
        for file in [MeshFile::Obj(&obj), MeshFile::Off(&off), MeshFile::Ply(&ply), eti] {
            let loaded = file.read("test").expect("it was just written");
            assert_eq!((&loaded.mesh.points, &loaded.mesh.triangles), (&mesh.points, &mesh.triangles));
            let bytes = file.memory_bytes();
            assert!(bytes >= arrays && bytes < 60 * arrays, "{file:?}: {bytes}");
        }
    }

    #[test]
    fn elements_of_no_bytes_are_counted_before_they_are_made() {
        let text = b"ply\nformat binary_little_endian 1.0\nelement nothing 4000000000\nend_header\n";
        assert!(MeshFile::Ply(text).memory_bytes() > 400_000_000_000);
        let corners = format!("OFF\n1 1 0\n0 0 0\n9 {}\n", "0 ".repeat(1000));
        assert!(MeshFile::Off(corners.as_bytes()).memory_bytes() > 998 * 12);
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
