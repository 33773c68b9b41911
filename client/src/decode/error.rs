//! Why a stream's bytes make no frame: what was met, where, what was expected.
//!
//! Enters: nothing. Leaves: [`DecodeError`].

use crate::topology::TopologyError;

/// Why bytes make no frame.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of each variant says what its fields are")]
pub enum DecodeError {
    /// The topology does not hold together.
    #[error("topology: {0}")]
    Topology(#[from] TopologyError),
    /// A frame before its topology.
    #[error("frame {frame} belongs to topology {found}, but {} was announced", name_of(*announced))]
    UnknownTopology {
        frame: u64,
        /// The topology that it names.
        found: u32,
        announced: Option<u32>,
    },
    /// A piece that does not follow the one before.
    #[error(
        "frame {frame}: piece {index} of {count} came where piece {expected} of {expected_count} was next"
    )]
    Piece {
        frame: u64,
        index: u32,
        count: u32,
        /// The piece that was next.
        expected: u32,
        expected_count: u32,
    },
    /// A frame broken off by another one.
    #[error("frame {frame} broke off after {received} of {count} pieces: frame {next} began")]
    BrokenOff { frame: u64, received: u32, count: u32, next: u64 },
    /// A packing that this client does not know, or that changes within a frame.
    #[error("frame {frame}: {field} in encoding {encoding} (known: 1 = RAW_F32, 2 = RAW_F64, one per frame)")]
    Encoding { frame: u64, field: &'static str, encoding: i32 },
    /// Bytes that are no whole number of elements.
    #[error("frame {frame}: {bytes} bytes of {field}, no multiple of {element}")]
    Bytes { frame: u64, field: &'static str, bytes: usize, element: usize },
    /// A piece of an array that does not follow the one before, or passes the end.
    #[error(
        "frame {frame}: {field} of particles {first} to {end} came where {expected} was next of {particles}"
    )]
    Range {
        frame: u64,
        field: &'static str,
        /// First particle of the piece.
        first: usize,
        /// One past its last particle.
        end: usize,
        /// First particle not received yet.
        expected: usize,
        particles: usize,
    },
    /// A frame whose last piece came and whose arrays are not full.
    #[error("frame {frame}: {field} of {received} of {particles} particles")]
    Missing { frame: u64, field: &'static str, received: usize, particles: usize },
    /// A value that is infinite or not a number.
    #[error("frame {frame}: {field} of particle {particle} is {value}")]
    NotFinite { frame: u64, field: &'static str, particle: usize, value: f64 },
    /// Nodes of a grid whose arrays do not fit each other, in bytes or in number.
    #[error(
        "frame {frame}: nodes of the grid take {index_bytes} bytes of indices, {mass_bytes} of masses, {velocity_bytes} of velocities and {force_bytes} of forces (12, 4, 12 and none or 12 per node)"
    )]
    GridBytes { frame: u64, index_bytes: usize, mass_bytes: usize, velocity_bytes: usize, force_bytes: usize },
    /// More nodes than the client agrees to hold, or than the grid is said to have.
    #[error("frame {frame}: {received} nodes of the grid came, at most {allowed} are taken")]
    GridTooLarge {
        frame: u64,
        received: usize,
        /// The smaller of the client's limit and the number of nodes announced.
        allowed: usize,
    },
    /// A grid whose every node was announced and did not come.
    #[error("frame {frame}: {received} nodes of the grid came, {announced} were announced")]
    GridMissing { frame: u64, received: usize, announced: u64 },
    /// A head of a grid that makes none, or that changes within a frame.
    #[error(
        "frame {frame}: a grid of cell {cell} m, stride {stride} and {node_count} nodes (needed: a cell above 0, a stride of 1 or more, the same in every piece)"
    )]
    GridHead {
        frame: u64,
        /// Distance of nodes (m).
        cell: f64,
        /// Multiples of the cell at which nodes were sent.
        stride: u32,
        node_count: u64,
    },
    /// A mass that is no mass, or a velocity that is infinite or not a number.
    #[error("frame {frame}: {field} of node {node} of the grid is {value}")]
    GridValue {
        frame: u64,
        field: &'static str,
        /// Index of the node among those of the frame.
        node: usize,
        value: f64,
    },
    /// A pose that no collider can have.
    #[error("frame {frame}: the pose of collider {collider:?}: {what}")]
    Pose {
        frame: u64,
        /// The name that it has.
        collider: String,
        what: &'static str,
    },
    /// A simulated time that is infinite or not a number.
    #[error("frame {frame}: its time is {time} s")]
    Time {
        frame: u64,
        /// The time (s).
        time: f64,
    },
}

fn name_of(announced: Option<u32>) -> String {
    announced.map_or_else(|| "none".to_owned(), |id| format!("topology {id}"))
}
