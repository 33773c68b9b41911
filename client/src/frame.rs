//! A frame as the caller sees it: plain owned arrays.
//!
//! Enters: nothing. Leaves: [`Frame`] and [`Vectors`], filled by `decode`.

use std::borrow::Cow;

use nappe_proto::v1;

/// The particles at one instant, in the user's own numbering.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Frame number: 0 is the initial state.
    pub frame: u64,
    /// Steps taken.
    pub step: u64,
    /// Simulated time (s).
    pub time: f64,
    /// Hash of the exact state, in the frames that carry one.
    pub state_hash: Option<u64>,
    /// Positions (m).
    pub positions: Vectors,
    /// Velocities (m/s), if asked for.
    pub velocities: Option<Vectors>,
    /// Frames that this watcher did not receive since the one before.
    pub dropped_count: u64,
    /// Figures of the step that made the frame.
    pub diagnostics: Option<v1::Diagnostics>,
}

/// An array of 3-vectors: x y z a particle, flat, in the precision that was asked for.
#[derive(Debug, Clone, PartialEq)]
pub enum Vectors {
    /// binary32.
    F32(Vec<f32>),
    /// binary64.
    F64(Vec<f64>),
}

impl Vectors {
    /// Number of vectors.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(flat) => flat.len() / 3,
            Self::F64(flat) => flat.len() / 3,
        }
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Vector `index`, or `None` past the end.
    pub fn get(&self, index: usize) -> Option<[f64; 3]> {
        let range = index.checked_mul(3)?..index.checked_mul(3)?.checked_add(3)?;
        match self {
            Self::F32(flat) => flat.get(range).map(|v| [v[0].into(), v[1].into(), v[2].into()]),
            Self::F64(flat) => flat.get(range).map(|v| [v[0], v[1], v[2]]),
        }
    }

    /// The flat array in binary32, without a copy when it already is.
    pub fn to_f32(&self) -> Cow<'_, [f32]> {
        match self {
            Self::F32(flat) => Cow::Borrowed(flat),
            Self::F64(flat) => Cow::Owned(flat.iter().map(|&value| value as f32).collect()),
        }
    }
}
