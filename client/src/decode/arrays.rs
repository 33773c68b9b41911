//! Pieces of one array over the particles, joined.
//!
//! Enters: `v1::FieldData` in order. Leaves: the whole array, every number finite.

use bytes::Bytes;
use nappe_proto::v1;

use super::error::DecodeError;
use crate::frame::{Scalars, Vectors};

/// An array in the making: `width` numbers per particle.
#[derive(Debug)]
pub(super) struct Joining {
    field: &'static str,
    width: usize,
    numbers: Option<Numbers>,
}

#[derive(Debug)]
enum Numbers {
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// The frame that is put together: for bounds and messages.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameExtent {
    /// Number of the frame.
    pub(super) frame: u64,
    /// Particles that each array must cover.
    pub(super) particles: usize,
}

impl Numbers {
    fn len(&self) -> usize {
        match self {
            Self::F32(numbers) => numbers.len(),
            Self::F64(numbers) => numbers.len(),
        }
    }
}

impl Joining {
    /// Nothing yet, of three numbers per particle.
    pub(super) fn vectors(field: &'static str) -> Self {
        Self { field, width: 3, numbers: None }
    }

    /// Nothing yet, of one number per particle.
    pub(super) fn scalars(field: &'static str) -> Self {
        Self { field, width: 1, numbers: None }
    }

    /// Particles that have come.
    fn received(&self) -> usize {
        self.numbers.as_ref().map_or(0, Numbers::len) / self.width
    }

    /// Appends a piece.
    pub(super) fn append(&mut self, extent: FrameExtent, piece: &v1::FieldData) -> Result<(), DecodeError> {
        let (frame, field, expected) = (extent.frame, self.field, self.received());
        let unknown = || DecodeError::Encoding { frame, field, encoding: piece.encoding };
        let wide = match v1::Encoding::try_from(piece.encoding) {
            Ok(v1::Encoding::RawF64) => true,
            Ok(v1::Encoding::RawF32 | v1::Encoding::Unspecified) => false,
            Err(_number) => return Err(unknown()),
        };

        let empty = || if wide { Numbers::F64(Vec::new()) } else { Numbers::F32(Vec::new()) };
        let array = ArrayName { field, width: self.width };
        match self.numbers.get_or_insert_with(empty) {
            Numbers::F32(flat) if !wide => {
                array.check(extent, expected, piece, 4)?;
                array.extend(frame, flat, &piece.data, f32::from_le_bytes)
            }
            Numbers::F64(flat) if wide => {
                array.check(extent, expected, piece, 8)?;
                array.extend(frame, flat, &piece.data, f64::from_le_bytes)
            }
            _ => Err(unknown()),
        }
    }

    /// The whole array of three numbers per particle, if every particle has come.
    pub(super) fn into_vectors(self, extent: FrameExtent) -> Result<Vectors, DecodeError> {
        Ok(match self.full(extent)? {
            Numbers::F32(flat) => Vectors::F32(flat),
            Numbers::F64(flat) => Vectors::F64(flat),
        })
    }

    /// The whole array of one number per particle, if every particle has come.
    pub(super) fn into_scalars(self, extent: FrameExtent) -> Result<Scalars, DecodeError> {
        Ok(match self.full(extent)? {
            Numbers::F32(flat) => Scalars::F32(flat),
            Numbers::F64(flat) => Scalars::F64(flat),
        })
    }

    fn full(self, extent: FrameExtent) -> Result<Numbers, DecodeError> {
        let (frame, field, particles) = (extent.frame, self.field, extent.particles);
        let received = self.received();
        if received != particles {
            return Err(DecodeError::Missing { frame, field, received, particles });
        }
        Ok(self.numbers.unwrap_or(Numbers::F32(Vec::new())))
    }
}

/// An array's name, and how many numbers each particle has in it.
#[derive(Clone, Copy)]
struct ArrayName {
    field: &'static str,
    width: usize,
}

impl ArrayName {
    /// The piece is whole, follows what came before and stays within the particles.
    fn check(
        self,
        extent: FrameExtent,
        expected: usize,
        piece: &v1::FieldData,
        number_bytes: usize,
    ) -> Result<(), DecodeError> {
        let FrameExtent { frame, particles } = extent;
        let (field, element, bytes) = (self.field, self.width * number_bytes, piece.data.len());
        if !bytes.is_multiple_of(element) {
            return Err(DecodeError::Bytes { frame, field, bytes, element });
        }
        let first = piece.first_particle as usize;
        let end = first.saturating_add(bytes / element);
        if first != expected || end > particles {
            return Err(DecodeError::Range { frame, field, first, end, expected, particles });
        }
        Ok(())
    }

    fn extend<T, const SIZE: usize>(
        self,
        frame: u64,
        flat: &mut Vec<T>,
        data: &Bytes,
        read: impl Fn([u8; SIZE]) -> T,
    ) -> Result<(), DecodeError>
    where
        T: Copy + Into<f64>,
    {
        let start = flat.len();
        let (values, _) = data.as_chunks::<SIZE>();
        flat.extend(values.iter().map(|&bytes| read(bytes)));
        let is_finite = |value: T| value.into().is_finite();
        // One pass without a branch; the culprit is looked for only if there is one.
        if flat[start..].iter().fold(true, |all, &value| all & is_finite(value)) {
            return Ok(());
        }
        let at = flat.iter().position(|&value| !is_finite(value)).expect("the fold found one");
        let particle = at / self.width;
        Err(DecodeError::NotFinite { frame, field: self.field, particle, value: flat[at].into() })
    }
}
