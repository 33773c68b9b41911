//! Pieces of the wire to whole frames.
//!
//! Enters: `v1::Topology` once, then `v1::Frame` messages, each a frame or a piece of one, from a server that
//! is not trusted. Leaves: [`Frame`]s whose arrays cover every particle with finite numbers. Memory grows with
//! what has arrived, never with what is announced, and stays below [`DecodeLimits`].

mod error;
mod arrays;
mod grid;
mod poses;

use std::collections::HashSet;

pub use error::DecodeError;
use nappe_proto::v1;

use self::arrays::{FrameExtent, Joining};
use crate::{
    frame::{Frame, GridFrame, Vectors},
    join::Pieces,
    options::DecodeLimits,
    selection::{Field, Fields},
    topology::{Topology, TopologyError},
};

/// What frames need to know of their topology.
#[derive(Debug)]
struct Announced {
    id: u32,
    particle_count: usize,
    /// Names of the colliders; none where no topology came.
    colliders: Option<HashSet<String>>,
}

/// Puts the frames of one stream together.
#[derive(Debug)]
pub struct Decoder {
    fields: Fields,
    limits: DecodeLimits,
    /// The topology announced.
    topology: Option<Announced>,
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
        let colliders = topology.colliders.iter().map(|collider| collider.name.clone()).collect();
        let Topology { id, particle_count, .. } = topology;
        self.topology = Some(Announced { id, particle_count, colliders: Some(colliders) });
        Ok(Some(topology))
    }

    /// Reads a frame or a piece of one; returns the frame when its last piece has come.
    ///
    /// # Errors
    /// If the piece does not follow the one before, is of the wrong size or holds a value that is not finite.
    pub fn frame(&mut self, wire: v1::Frame) -> Result<Option<Frame>, DecodeError> {
        let mut partial = self.accept(&wire)?;
        let extent = partial.extent;
        for piece in wire.fields {
            if let Some(array) = partial.array(&piece) {
                array.append(extent, &piece)?;
            }
        }
        if let Some(piece) = &wire.grid {
            grid::append(&mut partial.grid, extent.frame, piece, self.limits.max_grid_nodes)?;
        }

        partial.received += 1;
        if partial.received < partial.count {
            self.partial = Some(partial);
            return Ok(None);
        }
        partial.finish().map(Some)
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

        match (begun, &self.topology) {
            (Some(begun), _) => Ok(begun),
            (None, Some(topology)) if topology.id == wire.topology_id => {
                Partial::begin(wire, chunk.count, topology, self.fields)
            }
            (None, announced) => Err(DecodeError::UnknownTopology {
                frame: wire.frame,
                found: wire.topology_id,
                announced: announced.as_ref().map(|topology| topology.id),
            }),
        }
    }
}

/// A frame that came in one piece and without its stream, of a session with so many particles.
pub(crate) fn decode_whole(
    wire: v1::Frame,
    particles: u64,
    fields: Fields,
    limits: DecodeLimits,
) -> Result<Frame, DecodeError> {
    let particles = usize::try_from(particles).unwrap_or(usize::MAX);
    if particles > limits.max_particles {
        let allowed = limits.max_particles;
        return Err(TopologyError::TooMany { announced: particles as u64, allowed }.into());
    }

    let (frame, chunk) = (wire.frame, wire.chunk);
    let mut decoder = Decoder::new(fields, limits);
    let id = wire.topology_id;
    decoder.topology = Some(Announced { id, particle_count: particles, colliders: None });
    let expected = || {
        let v1::Chunk { index, count } = chunk.unwrap_or_default();
        DecodeError::Piece { frame, index, count, expected: 0, expected_count: 1 }
    };
    decoder.frame(wire)?.ok_or_else(expected)
}

/// A frame in the making.
#[derive(Debug)]
struct Partial {
    frame: Frame,
    extent: FrameExtent,
    /// Pieces announced and received.
    count: u32,
    received: u32,
    positions: Joining,
    /// The arrays asked for besides positions.
    velocities: Option<Joining>,
    plastic_ratios: Option<Joining>,
    stress_norms: Option<Joining>,
    forces: Option<Joining>,
    accelerations: Option<Joining>,
    grid: Option<GridFrame>,
}

impl Partial {
    fn begin(
        wire: &v1::Frame,
        count: u32,
        topology: &Announced,
        fields: Fields,
    ) -> Result<Self, DecodeError> {
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
            plastic_ratios: None,
            stress_norms: None,
            forces: None,
            accelerations: None,
            grid: None,
            dropped_count: wire.dropped_count,
            diagnostics: wire.diagnostics.clone(),
            poses: poses::read(&wire.poses, wire.frame, topology.colliders.as_ref())?,
            carried: wire.carried.clone().filter(is_finite),
        };
        let wanted = |field: Field, array: fn(&'static str) -> Joining| {
            fields.contains(field).then(|| array(field.name()))
        };
        Ok(Self {
            frame,
            extent: FrameExtent { frame: wire.frame, particles: topology.particle_count },
            count,
            received: 0,
            positions: Joining::vectors("positions"),
            velocities: wanted(Field::Velocities, Joining::vectors),
            plastic_ratios: wanted(Field::PlasticRatios, Joining::scalars),
            stress_norms: wanted(Field::StressNorms, Joining::scalars),
            forces: wanted(Field::Forces, Joining::vectors),
            accelerations: wanted(Field::Accelerations, Joining::vectors),
            grid: None,
        })
    }

    /// The array that a piece continues; none for one that was not asked for, or that a newer server sends.
    fn array(&mut self, piece: &v1::FieldData) -> Option<&mut Joining> {
        match v1::Field::try_from(piece.field).ok()? {
            v1::Field::Unspecified => None,
            v1::Field::Positions => Some(&mut self.positions),
            v1::Field::Velocities => self.velocities.as_mut(),
            v1::Field::PlasticRatio => self.plastic_ratios.as_mut(),
            v1::Field::StressNorm => self.stress_norms.as_mut(),
            v1::Field::Forces => self.forces.as_mut(),
            v1::Field::Accelerations => self.accelerations.as_mut(),
        }
    }

    fn finish(self) -> Result<Frame, DecodeError> {
        let extent = self.extent;
        let scalars = |array: Option<Joining>| array.map(|array| array.into_scalars(extent)).transpose();
        let vectors = |array: Option<Joining>| array.map(|array| array.into_vectors(extent)).transpose();
        Ok(Frame {
            positions: self.positions.into_vectors(extent)?,
            velocities: vectors(self.velocities)?,
            plastic_ratios: scalars(self.plastic_ratios)?,
            stress_norms: scalars(self.stress_norms)?,
            forces: vectors(self.forces)?,
            accelerations: vectors(self.accelerations)?,
            grid: grid::finish(self.grid, extent.frame)?,
            ..self.frame
        })
    }
}

/// Whether all numbers are finite that a frame carries: with others nothing begins.
fn is_finite(carried: &v1::Carried) -> bool {
    carried.numbers.iter().all(|number| number.is_finite())
}
