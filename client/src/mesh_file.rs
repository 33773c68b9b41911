//! Upload of a file of a mesh or of frames as it is: the server reads it, and tells its faults with file and line.
//!
//! Enters: a path, or bytes. Leaves: `UploadMeshRequest` messages.

use std::{fs, io, path::Path};

use bytes::Bytes;
use nappe_proto::v1::{self, FileFormat};

use crate::upload::pieces;

/// How every file begins that gzip has packed.
const PACKED: [u8; 2] = [0x1f, 0x8b];
/// Why such a file is not sent.
const UNPACK: &str = "is packed by gzip, and files are sent as they are: unpack it first (gunzip); allowed: .obj, .off, .ply, .stl";

/// A mesh file to send, or the files of a set of the MecaSim course.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFile {
    /// A name for messages.
    pub name: String,
    /// The format of the file.
    pub format: FileFormat,
    /// The file; of a set, points.eti.
    pub file: Bytes,
    /// Of a set, faceset.eti, masses.eti and texcoord.eti; empty where there is none.
    pub others: [Bytes; 3],
    /// Of a set, the mass (kg) of points that masses.eti leaves out; none: such a set is refused.
    pub missing_mass: Option<f64>,
}

impl MeshFile {
    /// Reads a file whose format follows from its extension: .obj, .off, .ply, .stl, frames of a figure as .pc2, or a set of the course (its
    /// points.eti or the folder that holds it).
    ///
    /// # Errors
    /// A file that cannot be read, or an extension that is none of these.
    pub fn read(path: &Path) -> io::Result<Self> {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let format = match extension.as_str() {
            _ if path.is_dir() => return Self::read_set(path, name),
            "obj" => FileFormat::Obj,
            "off" => FileFormat::Off,
            "ply" => FileFormat::Ply,
            "stl" => FileFormat::Stl,
            "pc2" => FileFormat::Pc2,
            "eti" => return Self::read_set(path.parent().unwrap_or(Path::new(".")), name),
            "gz" => return Err(io::Error::new(io::ErrorKind::InvalidInput, UNPACK)),
            other => {
                let message = format!(
                    "has the extension '{other}'; allowed: .obj, .off, .ply, .stl, .pc2, points.eti or its folder"
                );
                return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
            }
        };
        let file: Bytes = fs::read(path)?.into();
        if file.starts_with(&PACKED) {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, UNPACK));
        }
        Ok(Self { name, format, file, others: Default::default(), missing_mass: None })
    }

    fn read_set(folder: &Path, name: String) -> io::Result<Self> {
        let mut others: [Bytes; 3] = Default::default();
        for (bytes, file) in others.iter_mut().zip(["faceset.eti", "masses.eti", "texcoord.eti"]) {
            let path = folder.join(file);
            if path.exists() {
                *bytes = fs::read(path)?.into();
            }
        }
        let file = fs::read(folder.join("points.eti"))?.into();
        Ok(Self { name, format: FileFormat::Eti, file, others, missing_mass: None })
    }

    /// The messages of the upload.
    pub(crate) fn messages(&self) -> Vec<v1::UploadMeshRequest> {
        use v1::upload_mesh_request::Part;
        let [faceset, masses, texcoord] = self.others.each_ref().map(|bytes| bytes.len() as u64);
        let header = v1::FileHeader {
            name: self.name.clone(),
            format: self.format.into(),
            byte_count: self.file.len() as u64,
            faceset_byte_count: faceset,
            masses_byte_count: masses,
            texcoord_byte_count: texcoord,
            missing_mass: self.missing_mass,
        };
        let mut messages = vec![v1::UploadMeshRequest { part: Some(Part::File(header)) }];
        messages.extend(pieces(self.file.clone()));
        messages.extend(self.others.iter().cloned().flat_map(pieces));
        messages
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_is_one_header_and_its_files_in_order() {
        let set = MeshFile {
            name: "set".into(),
            format: FileFormat::Eti,
            file: Bytes::from_static(b"1\n0 0 0\n"),
            others: [Bytes::new(), Bytes::from_static(b"0.5\n"), Bytes::new()],
            missing_mass: Some(1.0),
        };
        let messages = set.messages();
        let Some(v1::upload_mesh_request::Part::File(header)) = &messages[0].part else {
            panic!("the header comes first")
        };
        assert_eq!((header.byte_count, header.faceset_byte_count, header.masses_byte_count), (8, 0, 4));
        assert_eq!((messages.len(), header.missing_mass), (3, Some(1.0)));
    }

    #[test]
    fn an_extension_that_is_no_format_is_refused_with_those_that_are() {
        let refused = MeshFile::read(Path::new("cow.glb")).expect_err("no format").to_string();
        assert!(refused.contains("'glb'") && refused.contains(".obj"), "{refused}");
        let refused = MeshFile::read(Path::new("cow.obj.gz")).expect_err("it is packed").to_string();
        assert!(refused.contains("gunzip"), "{refused}");
    }
}
