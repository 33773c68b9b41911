//! A frame as the caller sees it: plain owned arrays.
//!
//! Enters: nothing. Leaves: [`Frame`] with its arrays, filled by `decode`.

use std::borrow::Cow;

use nappe_proto::v1;

use crate::pose::ColliderPose;

/// The particles at one instant, in the user's own numbering.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Frame number: 0 is the initial state.
    pub frame: u64,
    /// Steps taken since the start.
    pub step: u64,
    /// Simulated time (s).
    pub time: f64,
    /// Hash of the exact state, in the frames that carry one.
    pub state_hash: Option<u64>,
    /// Positions (m).
    pub positions: Vectors,
    /// Velocities (m/s), if asked for.
    pub velocities: Option<Vectors>,
    /// Plastic ratios J_P of snow, 1 for particles of cloth, if asked for.
    pub plastic_ratios: Option<Scalars>,
    /// Frobenius norms of the Cauchy stress of snow (Pa), 0 for particles of cloth, if asked for.
    pub stress_norms: Option<Scalars>,
    /// What acts on each particle (N), contacts left out, if asked for; of a pin what it holds.
    pub forces: Option<Vectors>,
    /// The same over the mass of each particle (m/s²), if asked for; 0 for pins.
    pub accelerations: Option<Vectors>,
    /// Nodes of the snow's grid, if asked for and there is snow.
    pub grid: Option<GridFrame>,
    /// Frames that this watcher did not receive since the one before.
    pub dropped_count: u64,
    /// Diagnostics of the step that made the frame.
    pub diagnostics: Option<v1::Diagnostics>,
    /// Where the colliders are that keys of the scene or calls move, in the order of the scene. Any other is where its
    /// velocity has brought it since time 0, and is not turned.
    pub poses: Vec<ColliderPose>,
    /// What a session needs to know that is to begin at this frame, if velocities were asked for.
    pub carried: Option<v1::Carried>,
}

impl Frame {
    /// The pose of a collider, if keys or calls move it.
    pub fn pose(&self, collider: &str) -> Option<&ColliderPose> {
        self.poses.iter().find(|pose| pose.name == collider)
    }
}

/// An array of 3-vectors: x y z per particle, flat, in the precision that was asked for.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the names say everything")]
pub enum Vectors {
    F32(Vec<f32>),
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

/// An array of one number per particle, in the precision that was asked for.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the names say everything")]
pub enum Scalars {
    F32(Vec<f32>),
    F64(Vec<f64>),
}

impl Scalars {
    /// Number of particles.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(numbers) => numbers.len(),
            Self::F64(numbers) => numbers.len(),
        }
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of particle `index`, or `None` past the end.
    pub fn get(&self, index: usize) -> Option<f64> {
        match self {
            Self::F32(numbers) => numbers.get(index).copied().map(f64::from),
            Self::F64(numbers) => numbers.get(index).copied(),
        }
    }

    /// The array in binary32, without a copy when it already is.
    pub fn to_f32(&self) -> Cow<'_, [f32]> {
        match self {
            Self::F32(numbers) => Cow::Borrowed(numbers),
            Self::F64(numbers) => Cow::Owned(numbers.iter().map(|&value| value as f32).collect()),
        }
    }
}

/// Nodes of the snow's grid that carry mass, at the time of a frame; the arrays are of one length, but for forces that are not there.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GridFrame {
    /// Distance of nodes (m).
    pub cell: f64,
    /// Indices of the nodes: node `i` stands at `cell * indices[i]` (m).
    pub indices: Vec<[i32; 3]>,
    /// Masses (kg).
    pub masses: Vec<f32>,
    /// Velocities (m/s).
    pub velocities: Vec<[f32; 3]>,
    /// Forces of the stress (N), at the state that the frame shows, if they were asked for; none otherwise.
    pub forces: Vec<[f32; 3]>,
    /// Only nodes whose indices are multiples of this were sent; 1: all.
    pub stride: u32,
    /// Nodes of the selection on the grid, sent or not.
    pub node_count: u64,
}

impl GridFrame {
    /// Number of nodes that were sent.
    pub fn len(&self) -> usize {
        self.indices.len()
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// Positions of the nodes (m).
    pub fn positions(&self) -> impl ExactSizeIterator<Item = [f32; 3]> {
        let cell = self.cell;
        self.indices.iter().map(move |index| index.map(|i| (cell * f64::from(i)) as f32))
    }
}
