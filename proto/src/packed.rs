//! Packed arrays: numbers on a grid of a known step, as differences, in planes of bytes, deflated.
//!
//! Enters: an array over the particles, and a [`Step`]. Leaves: bytes, and from bytes the array again, each number within
//! half a step of what it was. `docs/frames.md` says what every byte means.

use flate2::{Compress, Compression, Decompress, FlushCompress, FlushDecompress, Status};

/// Whole numbers stay below this: times a step they are exact in binary32.
const LIMIT: i32 = 1 << 23;
/// The most bytes that a whole number takes before it is deflated.
const MAX_PLANES: usize = 4;
/// Added to a number of binary64 that is small beside it, this leaves the nearest whole number in the lowest bits.
const ROUND: f64 = 1.5 * (1_u64 << 52) as f64;

/// The distance of neighbouring numbers on the grid: a power of two, in the array's unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Step {
    exponent: i32,
}

impl Step {
    /// The least and the greatest exponent: all that lies between is exact in binary32.
    pub const EXPONENTS: [i32; 2] = [-126, 104];

    /// The step 2 to the power of `exponent`; `None` unless that lies in [`Self::EXPONENTS`].
    pub fn new(exponent: i32) -> Option<Self> {
        let [least, greatest] = Self::EXPONENTS;
        (least..=greatest).contains(&exponent).then_some(Self { exponent })
    }

    /// The largest step that keeps numbers within `bound` of what they were; `None` where there is none.
    pub fn within(bound: f64) -> Option<Self> {
        let twice = 2.0 * bound;
        // Of a normal number the exponent is that of the largest power of two below it.
        twice.is_normal().then_some(())?;
        Self::new((twice.to_bits() >> 52) as i32 - 1023).filter(|_| bound > 0.0)
    }

    /// The step itself.
    pub fn size(self) -> f64 {
        power_of_two(self.exponent)
    }

    /// Its exponent: it is 2 to this power.
    pub fn exponent(self) -> i32 {
        self.exponent
    }

    /// How far a number may be from what it was: half of the step.
    pub fn bound(self) -> f64 {
        self.size() / 2.0
    }

    /// The whole numbers of steps nearest to `values`; of two as near, the even one.
    ///
    /// # Errors
    /// If a value is 2^23 steps or more from 0, or not finite.
    pub fn quantize<T: Copy + Into<f64>>(self, values: &[T]) -> Result<Vec<i32>, OutOfRange> {
        let steps = power_of_two(-self.exponent);
        let far = f64::from(LIMIT) - 0.5;
        let mut are_near = true;
        let numbers = values.iter().map(|&value| {
            let number: f64 = value.into() * steps;
            // What is not a number is not below the limit either.
            are_near &= number.abs() < far;
            (number + ROUND).to_bits() as i32
        });
        let numbers = numbers.collect();
        if are_near {
            return Ok(numbers);
        }
        let is_near = |value: T| (value.into() * steps).abs() < far;
        let index = values.iter().position(|&value| !is_near(value)).unwrap_or_default();
        Err(OutOfRange { index })
    }

    /// The numbers again, exact multiples of the step.
    pub fn restore(self, numbers: &[i32]) -> Vec<f32> {
        let size = self.size() as f32;
        numbers.iter().map(|&number| number as f32 * size).collect()
    }
}

/// 2 to a power between -126 and 126.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

/// A number that no whole number of steps below 2^23 is near to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("number {index} of the array is 2^23 steps or more from 0, or not finite")]
pub struct OutOfRange {
    /// Where it stands in the array.
    pub index: usize,
}

/// How long is searched for repeated bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// For streams: level 1 of deflate.
    Fast,
    /// For files: level 6, some percent smaller for several times the work.
    Small,
}

/// Packs an array of whole numbers, `components` per particle; with a base, what it differs by from another array of
/// the same shape.
///
/// # Panics
/// If the numbers are not whole particles, or the base has another length.
pub fn pack(numbers: &[i32], components: usize, base: Option<&[i32]>, effort: Effort) -> Vec<u8> {
    assert!(numbers.len().is_multiple_of(components), "whole particles");
    assert!(base.is_none_or(|base| base.len() == numbers.len()), "a base of the same shape");
    if numbers.is_empty() {
        return Vec::new();
    }
    let zigzags = zigzags(numbers, components, base);
    let all = zigzags.iter().fold(0, |all, zigzag| all | zigzag);
    let planes = MAX_PLANES - (all.leading_zeros() / 8).min(3) as usize;
    let bytes: Vec<u8> = (0..planes)
        .flat_map(|plane| zigzags.iter().map(move |zigzag| (zigzag >> (8 * plane)) as u8))
        .collect();
    deflate(&bytes, effort)
}

/// Differences along the particles, component by component, with the sign in the lowest bit.
fn zigzags(numbers: &[i32], components: usize, base: Option<&[i32]>) -> Vec<u32> {
    let mut zigzags = Vec::with_capacity(numbers.len());
    for component in 0..components {
        let mut before = 0_i32;
        let mut push = |number: i32| {
            let difference = number.wrapping_sub(before);
            before = number;
            zigzags.push(((difference << 1) ^ (difference >> 31)) as u32);
        };
        let of_component = numbers[component..].iter().step_by(components);
        match base {
            None => of_component.for_each(|&number| push(number)),
            Some(base) => of_component
                .zip(base[component..].iter().step_by(components))
                .for_each(|(number, base)| push(number.wrapping_sub(*base))),
        }
    }
    zigzags
}

/// Bytes that hold no packed array of the shape that was said.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum UnpackError {
    /// No raw deflate, or more than a plane of bytes for each byte of a number.
    #[error("the bytes are no raw deflate of at most {allowed} bytes")]
    Deflate {
        /// The most bytes that the array can have.
        allowed: usize,
    },
    /// Not 1 to 4 whole planes.
    #[error("the array has {found} bytes, which are not 1 to 4 planes of {count}")]
    Planes {
        /// Bytes that were inflated.
        found: usize,
        /// Numbers of the array, a byte of each per plane.
        count: usize,
    },
    /// A whole number that is not below 2^23.
    #[error("number {index} of the array is 2^23 steps or more from 0")]
    Range {
        /// Where it stands in the array.
        index: usize,
    },
}

/// The whole numbers of an array of `count` particles with `components` each; with the base that they were packed with.
///
/// # Errors
/// If the bytes hold no such array. No more than 4 bytes per number are made from any bytes.
///
/// # Panics
/// If the base has another shape.
pub fn unpack(
    bytes: &[u8],
    count: usize,
    components: usize,
    base: Option<&[i32]>,
) -> Result<Vec<i32>, UnpackError> {
    let len = count * components;
    assert!(base.is_none_or(|base| base.len() == len), "a base of the same shape");
    let bytes = if len == 0 && bytes.is_empty() { Vec::new() } else { inflate(bytes, len * MAX_PLANES)? };
    let found = bytes.len();
    let is_whole = if len == 0 { found == 0 } else { found > 0 && found.is_multiple_of(len) };
    if !is_whole {
        return Err(UnpackError::Planes { found, count: len });
    }

    let mut numbers = vec![0_i32; len];
    let mut outside = false;
    for component in 0..components {
        let mut sum = 0_i32;
        let start = component * count;
        let planes: Vec<&[u8]> =
            bytes.chunks_exact(len.max(1)).map(|plane| &plane[start..start + count]).collect();
        for particle in 0..count {
            let mut zigzag = 0_u32;
            for (plane, bytes) in planes.iter().enumerate() {
                zigzag |= u32::from(bytes[particle]) << (8 * plane);
            }
            sum = sum.wrapping_add((zigzag >> 1) as i32 ^ -((zigzag & 1) as i32));
            let at = particle * components + component;
            let number = sum.wrapping_add(base.map_or(0, |base| base[at]));
            outside |= number.unsigned_abs() >= LIMIT as u32;
            numbers[at] = number;
        }
    }
    let is_outside = |number: &i32| number.unsigned_abs() >= LIMIT as u32;
    match numbers.iter().position(is_outside).filter(|_| outside) {
        Some(index) => Err(UnpackError::Range { index }),
        None => Ok(numbers),
    }
}

fn deflate(bytes: &[u8], effort: Effort) -> Vec<u8> {
    let level = match effort {
        Effort::Fast => Compression::new(1),
        Effort::Small => Compression::new(6),
    };
    let mut compress = Compress::new(level, false);
    let mut packed = Vec::with_capacity(bytes.len() / 2 + 64);
    loop {
        let taken = compress.total_in() as usize;
        let status = compress.compress_vec(&bytes[taken..], &mut packed, FlushCompress::Finish);
        match status {
            Ok(Status::StreamEnd) => return packed,
            // There was no room for the rest.
            _ => packed.reserve(packed.len().max(64)),
        }
    }
}

fn inflate(bytes: &[u8], allowed: usize) -> Result<Vec<u8>, UnpackError> {
    let mut inflated = Vec::with_capacity(allowed);
    let mut decompress = Decompress::new(false);
    let status = decompress.decompress_vec(bytes, &mut inflated, FlushDecompress::Finish);
    let is_whole =
        status.is_ok_and(|status| status == Status::StreamEnd) && decompress.total_in() == bytes.len() as u64;
    if is_whole { Ok(inflated) } else { Err(UnpackError::Deflate { allowed }) }
}
