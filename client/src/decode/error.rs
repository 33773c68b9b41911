//! Why a stream's bytes make no frame: what was met, where, what was expected.
//!
//! Enters: nothing. Leaves: [`DecodeError`].

use crate::topology::TopologyError;

/// Why bytes make no frame.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The topology does not hold together.
    #[error("topology: {0}")]
    Topology(#[from] TopologyError),
    /// A frame before its topology.
    #[error("frame {frame} belongs to topology {found}, but {} was announced", name_of(*announced))]
    UnknownTopology {
        /// The frame.
        frame: u64,
        /// The topology that it names.
        found: u32,
        /// The newest topology received.
        announced: Option<u32>,
    },
    /// A piece out of place.
    #[error(
        "frame {frame}: piece {index} of {count} came where piece {expected} of {expected_count} was next"
    )]
    Piece {
        /// The frame.
        frame: u64,
        /// The piece, from 0.
        index: u32,
        /// Pieces that it announces.
        count: u32,
        /// The piece that was next.
        expected: u32,
        /// Pieces announced before.
        expected_count: u32,
    },
    /// A frame broken off by another one.
    #[error("frame {frame} broke off after {received} of {count} pieces: frame {next} began")]
    BrokenOff {
        /// The frame.
        frame: u64,
        /// Pieces received.
        received: u32,
        /// Pieces announced.
        count: u32,
        /// The frame that began.
        next: u64,
    },
    /// A packing that this client does not know, or that changes within a frame.
    #[error("frame {frame}: {field} in encoding {encoding} (known: 1 = RAW_F32, 2 = RAW_F64, one a frame)")]
    Encoding {
        /// The frame.
        frame: u64,
        /// The array.
        field: &'static str,
        /// The encoding's number.
        encoding: i32,
    },
    /// Bytes that are no whole number of elements.
    #[error("frame {frame}: {bytes} bytes of {field}, no multiple of {element}")]
    Bytes {
        /// The frame.
        frame: u64,
        /// The array.
        field: &'static str,
        /// Bytes received.
        bytes: usize,
        /// Bytes of an element.
        element: usize,
    },
    /// A piece of an array that does not follow the one before, or passes the end.
    #[error(
        "frame {frame}: {field} of particles {first} to {end} came where {expected} was next of {particles}"
    )]
    Range {
        /// The frame.
        frame: u64,
        /// The array.
        field: &'static str,
        /// First particle of the piece.
        first: usize,
        /// One past its last particle.
        end: usize,
        /// First particle not received yet.
        expected: usize,
        /// Particles of the session.
        particles: usize,
    },
    /// A frame whose last piece came and whose arrays are not full.
    #[error("frame {frame}: {field} of {received} of {particles} particles")]
    Missing {
        /// The frame.
        frame: u64,
        /// The array.
        field: &'static str,
        /// Particles received.
        received: usize,
        /// Particles of the session.
        particles: usize,
    },
    /// A value that is infinite or not a number.
    #[error("frame {frame}: {field} of particle {particle} is {value}")]
    NotFinite {
        /// The frame.
        frame: u64,
        /// The array.
        field: &'static str,
        /// The particle.
        particle: usize,
        /// The value.
        value: f64,
    },
    /// Nodes of a grid whose arrays do not fit each other, in bytes or in number.
    #[error(
        "frame {frame}: nodes of the grid take {index_bytes} bytes of indices, {mass_bytes} of masses and {velocity_bytes} of velocities (12, 4 and 12 a node)"
    )]
    GridBytes {
        /// The frame.
        frame: u64,
        /// Bytes of indices.
        index_bytes: usize,
        /// Bytes of masses.
        mass_bytes: usize,
        /// Bytes of velocities.
        velocity_bytes: usize,
    },
    /// More nodes than the client agrees to hold, or than the grid is said to have.
    #[error("frame {frame}: {received} nodes of the grid came, at most {allowed} are taken")]
    GridTooLarge {
        /// The frame.
        frame: u64,
        /// Nodes received.
        received: usize,
        /// The smaller of the client's limit and the number of nodes announced.
        allowed: usize,
    },
    /// A grid whose every node was announced and did not come.
    #[error("frame {frame}: {received} nodes of the grid came, {announced} were announced")]
    GridMissing {
        /// The frame.
        frame: u64,
        /// Nodes received.
        received: usize,
        /// Nodes announced.
        announced: u64,
    },
    /// A head of a grid that makes none, or that changes within a frame.
    #[error(
        "frame {frame}: a grid of cell {cell} m, stride {stride} and {node_count} nodes (needed: a cell above 0, a stride of 1 or more, the same in every piece)"
    )]
    GridHead {
        /// The frame.
        frame: u64,
        /// Distance of nodes (m).
        cell: f64,
        /// Multiples of the cell at which nodes were sent.
        stride: u32,
        /// Nodes announced.
        node_count: u64,
    },
    /// A mass that is no mass, or a velocity that is infinite or not a number.
    #[error("frame {frame}: {field} of node {node} of the grid is {value}")]
    GridValue {
        /// The frame.
        frame: u64,
        /// Mass or velocity.
        field: &'static str,
        /// The node's place in the frame.
        node: usize,
        /// The value.
        value: f64,
    },
    /// A simulated time that is infinite or not a number.
    #[error("frame {frame}: its time is {time} s")]
    Time {
        /// The frame.
        frame: u64,
        /// The time (s).
        time: f64,
    },
}

fn name_of(announced: Option<u32>) -> String {
    announced.map_or_else(|| "none".to_owned(), |id| format!("topology {id}"))
}
