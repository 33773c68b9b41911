//! Pieces of the wire to whole frames.
//!
//! Enters: `v1::Topology` once, then `v1::Frame` messages, each a frame or a piece of one, from a server that
//! is not trusted. Leaves: [`Frame`]s whose arrays cover every particle with finite numbers. Memory grows with
//! what has arrived, never with what is announced, and stays below [`DecodeLimits`].

use bytes::Bytes;
use nappe_proto::v1;

use crate::{
    frame::{Frame, Vectors},
    join::Pieces,
    options::{DecodeLimits, Fields},
    topology::{Topology, TopologyError},
};

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
    /// Bytes that are no whole number of vectors.
    #[error("frame {frame}: {bytes} bytes of {field}, no multiple of {element}")]
    Bytes {
        /// The frame.
        frame: u64,
        /// The array.
        field: &'static str,
        /// Bytes received.
        bytes: usize,
        /// Bytes of a vector.
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

/// Puts the frames of one stream together.
#[derive(Debug)]
pub struct Decoder {
    fields: Fields,
    limits: DecodeLimits,
    /// Id and particle count of the topology announced.
    topology: Option<(u32, usize)>,
    /// Pieces of the next topology.
    pieces: Pieces,
    partial: Option<Partial>,
}

impl Decoder {
    /// A decoder of streams that carry `fields`.
    pub fn new(fields: Fields, limits: DecodeLimits) -> Self {
        Self { fields, limits, topology: None, pieces: Pieces::default(), partial: None }
    }

    /// Reads a topology or a piece of one; returns it when its last piece has come. A frame in the making
    /// is forgotten: a stream begins here.
    ///
    /// # Errors
    /// If a count, range or index does not fit, or the particles exceed the limits.
    pub fn topology(&mut self, wire: v1::Topology) -> Result<Option<Topology>, DecodeError> {
        self.partial = None;
        self.topology = None;
        let Some(wire) = self.pieces.add(wire, self.limits.max_topology_bytes)? else { return Ok(None) };
        let topology = Topology::from_wire(wire, self.limits.max_particles)?;
        self.topology = Some((topology.id, topology.particle_count));
        Ok(Some(topology))
    }

    /// Reads a frame or a piece of one; returns the frame when its last piece has come.
    ///
    /// # Errors
    /// If the piece is out of place, of the wrong size or holds a value that is not finite.
    pub fn frame(&mut self, wire: v1::Frame) -> Result<Option<Frame>, DecodeError> {
        let mut partial = self.accept(&wire)?;
        let (frame, particles) = (partial.frame.frame, partial.particles);
        for piece in wire.fields {
            let place = |field| Place { frame, field, particles };
            match v1::Field::try_from(piece.field) {
                Ok(v1::Field::Positions) => place("positions").append(&mut partial.positions, &piece)?,
                Ok(v1::Field::Velocities) => place("velocities").append(&mut partial.velocities, &piece)?,
                // An array of a newer server, which was not asked for.
                _ => {}
            }
        }
        partial.received += 1;
        if partial.received < partial.count {
            self.partial = Some(partial);
            return Ok(None);
        }
        partial.finish(self.fields).map(Some)
    }

    /// The frame in the making that this piece continues, or a new one.
    fn accept(&mut self, wire: &v1::Frame) -> Result<Partial, DecodeError> {
        let chunk = wire.chunk.unwrap_or(v1::Chunk { index: 0, count: 1 });
        let begun = self.partial.take();
        if let Some(begun) = &begun
            && begun.frame.frame != wire.frame
        {
            let (frame, next) = (begun.frame.frame, wire.frame);
            return Err(DecodeError::BrokenOff { frame, received: begun.received, count: begun.count, next });
        }
        let (expected, expected_count) =
            begun.as_ref().map_or((0, chunk.count), |begun| (begun.received, begun.count));
        if chunk.count == 0 || chunk.index != expected || chunk.count != expected_count {
            let (index, count) = (chunk.index, chunk.count);
            return Err(DecodeError::Piece { frame: wire.frame, index, count, expected, expected_count });
        }
        match (begun, self.topology) {
            (Some(begun), _) => Ok(begun),
            (None, Some((id, particles))) if id == wire.topology_id => {
                Partial::begin(wire, chunk.count, particles)
            }
            (None, announced) => Err(DecodeError::UnknownTopology {
                frame: wire.frame,
                found: wire.topology_id,
                announced: announced.map(|(id, _)| id),
            }),
        }
    }
}

/// A frame in the making.
#[derive(Debug)]
struct Partial {
    frame: Frame,
    particles: usize,
    /// Pieces announced and received.
    count: u32,
    received: u32,
    positions: Option<Vectors>,
    velocities: Option<Vectors>,
}

impl Partial {
    fn begin(wire: &v1::Frame, count: u32, particles: usize) -> Result<Self, DecodeError> {
        if !wire.time_seconds.is_finite() {
            return Err(DecodeError::Time { frame: wire.frame, time: wire.time_seconds });
        }
        let frame = Frame {
            frame: wire.frame,
            step: wire.step,
            time: wire.time_seconds,
            state_hash: wire.state_hash,
            positions: Vectors::F32(Vec::new()),
            velocities: None,
            dropped_count: wire.dropped_count,
            diagnostics: wire.diagnostics.clone(),
        };
        Ok(Self { frame, particles, count, received: 0, positions: None, velocities: None })
    }

    fn finish(self, fields: Fields) -> Result<Frame, DecodeError> {
        let Self { mut frame, particles, positions, velocities, .. } = self;
        let full = |field, array: Option<Vectors>| {
            let array = array.unwrap_or(Vectors::F32(Vec::new()));
            if array.len() == particles {
                return Ok(array);
            }
            Err(DecodeError::Missing { frame: frame.frame, field, received: array.len(), particles })
        };
        let positions = full("positions", positions)?;
        let velocities = match fields {
            Fields::Positions => None,
            Fields::PositionsAndVelocities => Some(full("velocities", velocities)?),
        };
        frame.positions = positions;
        frame.velocities = velocities;
        Ok(frame)
    }
}

/// Where values go: for bounds and messages.
struct Place {
    frame: u64,
    field: &'static str,
    particles: usize,
}

impl Place {
    /// Appends the vectors of a piece to their array.
    fn append(&self, array: &mut Option<Vectors>, piece: &v1::FieldData) -> Result<(), DecodeError> {
        let unknown =
            || DecodeError::Encoding { frame: self.frame, field: self.field, encoding: piece.encoding };
        let wide = match v1::Encoding::try_from(piece.encoding) {
            Ok(v1::Encoding::RawF64) => true,
            Ok(v1::Encoding::RawF32 | v1::Encoding::Unspecified) => false,
            Err(_number) => return Err(unknown()),
        };
        let target = array
            .get_or_insert_with(|| if wide { Vectors::F64(Vec::new()) } else { Vectors::F32(Vec::new()) });
        let expected = target.len();
        match target {
            Vectors::F32(flat) if !wide => {
                self.check(expected, piece, 12)?;
                self.extend(flat, &piece.data, f32::from_le_bytes)
            }
            Vectors::F64(flat) if wide => {
                self.check(expected, piece, 24)?;
                self.extend(flat, &piece.data, f64::from_le_bytes)
            }
            _ => Err(unknown()),
        }
    }

    /// The piece is whole, follows what came before and stays within the particles.
    fn check(&self, expected: usize, piece: &v1::FieldData, element: usize) -> Result<(), DecodeError> {
        let (frame, field, particles) = (self.frame, self.field, self.particles);
        let bytes = piece.data.len();
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
        &self,
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
        let (frame, field) = (self.frame, self.field);
        Err(DecodeError::NotFinite { frame, field, particle: at / 3, value: flat[at].into() })
    }
}
