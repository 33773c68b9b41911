//! A glTF file as it is read: its document, the bytes of its buffers, and the numbers of its accessors.
//!
//! What a file says of offsets and counts is checked before it is followed.

use std::{fs, path::Path};

use base64::{Engine as _, engine::general_purpose::STANDARD};
use gltf::{Accessor, Document, Gltf, accessor::DataType, buffer::Source};

use crate::words::error::{CliError, Result};

/// A file, with all that it refers to.
#[derive(Debug)]
pub(super) struct Asset {
    /// Its name in messages.
    name: String,
    pub(super) document: Document,
    /// In the order of the document.
    buffers: Vec<Vec<u8>>,
}

impl Asset {
    /// Reads a .glb, or a .gltf with the buffers beside it.
    ///
    /// # Errors
    /// A file that cannot be read, or is no glTF 2.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let bytes = fs::read(path).map_err(|error| CliError::file("read", path, &error))?;
        let Gltf { document, mut blob } = Gltf::from_slice(&bytes).map_err(|error| {
            CliError::failure(format!("{name}: is no glTF 2 that can be read: {error}"))
                .hint("allowed: a .glb or .gltf file, or a folder of .obj or .ply files")
        })?;

        let mut buffers = Vec::new();
        for buffer in document.buffers() {
            let (index, needed) = (buffer.index(), buffer.length());
            let bytes = match buffer.source() {
                Source::Bin => blob.take().unwrap_or_default(),
                Source::Uri(uri) => read_uri(path, index, uri)?,
            };
            if bytes.len() < needed {
                let found = bytes.len();
                let message = format!("{name}: buffer {index} has {found} bytes, where {needed} are needed");
                return Err(CliError::failure(message));
            }
            buffers.push(bytes);
        }
        Ok(Self { name, document, buffers })
    }

    /// A failure of this file.
    pub(super) fn refused(&self, what: &str) -> CliError {
        CliError::failure(format!("{}: {what}", self.name))
    }

    /// The numbers of an accessor, element after element, which has at least one, of `width` numbers each.
    ///
    /// # Errors
    /// One that is sparse, is of another width, goes beyond its buffer, or has a number that is not finite.
    pub(super) fn numbers(&self, accessor: &Accessor<'_>, width: usize) -> Result<Vec<f64>> {
        let refused = |what: &str| Err(self.refused(&format!("accessor {} {what}", accessor.index())));
        if accessor.sparse().is_some() {
            return refused("is sparse; allowed: accessors that have all of their numbers in a buffer");
        }
        let found = accessor.dimensions().multiplicity();
        if found != width {
            return refused(&format!("has {found} numbers in an element, where {width} are needed"));
        }
        let Some(view) = accessor.view() else {
            return refused("has no bytes, as where a mesh is compressed; allowed: meshes that are not");
        };

        let buffer = self.buffers.get(view.buffer().index()).map_or(&[][..], Vec::as_slice);
        let end = view.offset().checked_add(view.length());
        let bytes = end.and_then(|end| buffer.get(view.offset()..end));
        let bytes = bytes.and_then(|bytes| bytes.get(accessor.offset()..)).unwrap_or_default();
        let (count, size) = (accessor.count(), accessor.size());
        let stride = view.stride().unwrap_or(size);
        let before_last = count.checked_sub(1).and_then(|last| last.checked_mul(stride));
        let needed = before_last.and_then(|before| before.checked_add(size));
        if stride < size || needed.is_none_or(|needed| needed > bytes.len()) {
            return refused("has no element, or goes beyond its buffer");
        }

        let kind = accessor.data_type();
        let most = if accessor.normalized() { most(kind) } else { None };
        let mut numbers = Vec::with_capacity(count * width);
        for element in 0..count {
            let own = &bytes[element * stride..element * stride + size];
            numbers.extend(own.chunks_exact(kind.size()).map(|bytes| {
                let number = number(bytes, kind);
                most.map_or(number, |most| (number / most).max(-1.0))
            }));
        }
        match numbers.iter().position(|number| !number.is_finite()) {
            None => Ok(numbers),
            Some(at) => refused(&format!("has a number that is not finite, in element {}", at / width)),
        }
    }
}

/// Reads a buffer that stands in the text of a file, or beside it.
fn read_uri(path: &Path, index: usize, uri: &str) -> Result<Vec<u8>> {
    if uri.starts_with("data:") {
        let bytes = uri.split_once(";base64,").and_then(|(_, text)| STANDARD.decode(text).ok());
        return bytes
            .ok_or_else(|| CliError::failure(format!("{}: buffer {index} is no base64", path.display())));
    }
    let beside = path.parent().unwrap_or(Path::new(".")).join(uri);
    fs::read(&beside).map_err(|error| {
        CliError::file("read", &beside, &error).hint(format!("{} has buffer {index} there", path.display()))
    })
}

/// The number that stands for 1 where whole numbers are shares.
fn most(kind: DataType) -> Option<f64> {
    match kind {
        DataType::I8 => Some(f64::from(i8::MAX)),
        DataType::U8 => Some(f64::from(u8::MAX)),
        DataType::I16 => Some(f64::from(i16::MAX)),
        DataType::U16 => Some(f64::from(u16::MAX)),
        DataType::U32 | DataType::F32 => None,
    }
}

/// A number of as many bytes as its kind has, the lowest first.
fn number(bytes: &[u8], kind: DataType) -> f64 {
    match (kind, bytes) {
        (DataType::I8, &[a]) => f64::from(i8::from_le_bytes([a])),
        (DataType::U8, &[a]) => f64::from(a),
        (DataType::I16, &[a, b]) => f64::from(i16::from_le_bytes([a, b])),
        (DataType::U16, &[a, b]) => f64::from(u16::from_le_bytes([a, b])),
        (DataType::U32, &[a, b, c, d]) => f64::from(u32::from_le_bytes([a, b, c, d])),
        (DataType::F32, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
        _ => f64::NAN,
    }
}
