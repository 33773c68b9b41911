//! PC2, the point cache of many modellers: frames of points, each with a place in every frame. Binary, lowest bytes first.
//!
//! Twelve bytes name the format; then stand its version, the count of points, the first frame, the frames that pass from one sample to
//! the next, and the count of samples, four bytes each; then, sample after sample, three numbers of binary32 for each point.

use std::{
    io::{self, Write},
    sync::Arc,
};

use super::text::refuse_pointer;
use crate::error::{ErrorKind, SceneError};

/// How every file begins.
const MAGIC: &[u8; 12] = b"POINTCACHE2\0";
/// Bytes before the first sample.
const HEAD_BYTES: usize = 32;
/// Bytes of a point in a sample.
const POINT_BYTES: u64 = 12;

/// Frames of points.
#[derive(Clone, Debug, PartialEq)]
pub struct PointFrames {
    /// Points of a frame, 1 or more.
    pub points: u32,
    /// Places (m) of all points, frame after frame; 1 frame or more, of finite numbers. Shared, so that a copy copies none of them.
    pub places: Arc<[[f32; 3]]>,
}

impl PointFrames {
    /// How many frames there are.
    pub fn count(&self) -> usize {
        self.places.len() / self.points.max(1) as usize
    }

    /// Memory that they take (bytes).
    pub fn bytes(&self) -> u64 {
        size_of_val(&*self.places) as u64
    }
}

/// Reads frames; `file` is its name in messages. How fast they pass the file does not say: its frames have no length.
///
/// # Errors
/// A file that is none, whose length does not fit its header, or that has a number which is not finite.
pub fn read_pc2(bytes: &[u8], file: &str) -> Result<PointFrames, SceneError> {
    let refused = |kind, message: String| Err(SceneError::new(kind, file, message));
    refuse_pointer(bytes, file)?;
    let Some((head, data)) = bytes.split_first_chunk::<HEAD_BYTES>() else {
        let found = bytes.len();
        let message = format!("is no PC2: it has {found} bytes, and its header alone has {HEAD_BYTES}");
        return refused(ErrorKind::Syntax, message);
    };
    if !head.starts_with(MAGIC) {
        let message = "is no PC2: its first bytes are not POINTCACHE2 with a 0 behind it".to_owned();
        return refused(ErrorKind::Syntax, message);
    }
    let (words, _) = head[MAGIC.len()..].as_chunks::<4>();
    let [version, points, _, _, frames] = [0, 1, 2, 3, 4].map(|word| i32::from_le_bytes(words[word]));
    if version != 1 {
        let message = format!("is PC2 of version {version}; allowed: 1");
        return refused(ErrorKind::Unsupported, message);
    }
    let counts = (u32::try_from(points).unwrap_or(0), u32::try_from(frames).unwrap_or(0));
    let (1.., 1..) = counts else {
        let message =
            format!("has {points} points and {frames} frames by its header; allowed: 1 or more of each");
        return refused(ErrorKind::OutOfRange, message);
    };
    let (points, frames) = counts;
    let needed = u64::from(points) * u64::from(frames);
    let needed = needed.saturating_mul(POINT_BYTES).saturating_add(HEAD_BYTES as u64);
    if bytes.len() as u64 != needed {
        let found = bytes.len();
        let message = format!(
            "has {found} bytes, and its header, with {frames} frames of {points} points, needs {needed}: it was cut, or is another file"
        );
        return refused(ErrorKind::Inconsistent, message);
    }

    let number =
        |bytes: &[u8], c: usize| f32::from_le_bytes([bytes[c], bytes[c + 1], bytes[c + 2], bytes[c + 3]]);
    let (all, _) = data.as_chunks::<12>();
    let places: Arc<[[f32; 3]]> = all.iter().map(|place| [0, 4, 8].map(|c| number(place, c))).collect();
    let is_bad = |place: &[f32; 3]| !place.iter().all(|c| c.is_finite());
    if let Some(at) = places.iter().position(is_bad) {
        let (frame, point, place) = (at / points as usize, at % points as usize, places[at]);
        let message = format!(
            "has a place that is not finite, {place:?}, in frame {frame}, of point {point} (both from 0); allowed: finite numbers"
        );
        return refused(ErrorKind::OutOfRange, message);
    }
    Ok(PointFrames { points, places })
}

/// Writes frames as [`read_pc2`] reads them: the first is frame 0, and each sample is one frame.
///
/// # Errors
/// More points or frames than the format counts, and those of the writer.
pub fn write_pc2(frames: &PointFrames, out: &mut impl Write) -> io::Result<()> {
    let count = |number: usize| i32::try_from(number).map_err(io::Error::other);
    out.write_all(MAGIC)?;
    out.write_all(&1_i32.to_le_bytes())?;
    out.write_all(&count(frames.points as usize)?.to_le_bytes())?;
    out.write_all([0.0_f32, 1.0].map(f32::to_le_bytes).as_flattened())?;
    out.write_all(&count(frames.count())?.to_le_bytes())?;
    for place in &*frames.places {
        out.write_all(place.map(f32::to_le_bytes).as_flattened())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of so many points and frames by its header, with these numbers behind it.
    fn file(points: i32, frames: i32, numbers: &[f32]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([1, points].map(i32::to_le_bytes).as_flattened());
        bytes.extend([0.0_f32, 1.0].map(f32::to_le_bytes).as_flattened());
        bytes.extend(frames.to_le_bytes());
        bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        bytes
    }

    #[test]
    fn places_are_read_frame_after_frame() {
        let numbers: Vec<f32> = (0..18_u8).map(f32::from).collect();
        let read = read_pc2(&file(2, 3, &numbers), "walk.pc2").expect("it is one");
        assert_eq!((read.points, read.count(), read.bytes()), (2, 3, 72));
        assert_eq!(read.places[..3], [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0], [6.0, 7.0, 8.0]]);
        assert_eq!(read.places[5], [15.0, 16.0, 17.0]);
    }

    #[test]
    fn what_is_written_is_read_with_the_same_bits() {
        let numbers: Vec<f32> = (0..18_u8).map(|number| f32::from(number) / 7.0).collect();
        let bytes = file(2, 3, &numbers);
        let read = read_pc2(&bytes, "walk.pc2").expect("it is one");
        let mut written = Vec::new();
        write_pc2(&read, &mut written).expect("memory takes it");
        assert_eq!(written, bytes);
    }

    #[test]
    fn what_is_wrong_with_a_file_is_told_with_its_name_and_place() {
        let told = |bytes: &[u8]| {
            let error = read_pc2(bytes, "walk.pc2").expect_err("it is refused");
            assert_eq!(error.file, "walk.pc2");
            (error.kind, error.message)
        };
        let whole = file(2, 3, &[0.5; 18]);
        let mut of_two = whole.clone();
        of_two[12] = 2;
        let mut bad = [0.5; 18];
        bad[10] = f32::NAN;
        for (bytes, kind, words) in [
            (&whole[..20], ErrorKind::Syntax, "20 bytes"),
            (&[b'x'; 40][..], ErrorKind::Syntax, "is no PC2"),
            (&of_two[..], ErrorKind::Unsupported, "version 2"),
            (&file(0, 3, &[])[..], ErrorKind::OutOfRange, "0 points and 3 frames"),
            (&file(2, -1, &[])[..], ErrorKind::OutOfRange, "2 points and -1 frames"),
            (&whole[..whole.len() - 1], ErrorKind::Inconsistent, "has 103 bytes"),
            (&[&whole[..], &[0]].concat()[..], ErrorKind::Inconsistent, "needs 104"),
            (&file(i32::MAX, i32::MAX, &[])[..], ErrorKind::Inconsistent, "has 32 bytes"),
            (&file(2, 3, &bad)[..], ErrorKind::OutOfRange, "in frame 1, of point 1"),
        ] {
            let (found, message) = told(bytes);
            assert!(found == kind && message.contains(words), "{message}, not {words}");
        }
    }
}
