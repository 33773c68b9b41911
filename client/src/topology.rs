//! What does not change from frame to frame: bodies, their triangles or springs, pins, colliders.
//!
//! Enters: `v1::Topology`, from the wire. Leaves: [`Topology`], whose indices are all in range, so that a
//! viewer can follow them without looking.

use nappe_proto::v1;

use crate::collider::{self, Collider};

/// What a session is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Topology {
    /// Changes when the topology does.
    pub id: u32,
    /// Number of particles in every frame.
    pub particle_count: usize,
    /// The bodies, in order; together they hold every particle once.
    pub bodies: Vec<Body>,
    /// The colliders, in the order of the scene.
    pub colliders: Vec<Collider>,
}

/// One body: its particles and what joins them.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Its name in the scene.
    pub name: String,
    /// Index of its first particle.
    pub first_particle: usize,
    /// Number of its particles.
    pub particle_count: usize,
    /// Triangles: indices over all particles of the session.
    pub triangles: Vec<[u32; 3]>,
    /// Springs, only for a body without triangles: indices over all particles of the session.
    pub springs: Vec<[u32; 2]>,
    /// Pinned particles: indices over all particles of the session.
    pub pins: Vec<u32>,
    /// Texture coordinates, one pair per particle of the body, or none.
    pub uv: Vec<[f32; 2]>,
    /// Red, green and blue of sRGB that the scene gives it; none: a viewer chooses.
    pub color: Option<[u8; 3]>,
    /// Masses (kg), one per particle of the body; none from an older server.
    pub masses: Vec<f32>,
    /// Volumes at rest (m³), one per particle of snow; none of cloth.
    pub volumes: Vec<f32>,
}

/// Why a topology is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of each variant says what its fields are")]
pub enum TopologyError {
    /// More particles than the client agrees to hold.
    #[error("{announced} particles announced (this client holds at most {allowed})")]
    TooMany { announced: u64, allowed: usize },
    /// A piece that does not follow the one before.
    #[error("piece {index} of {count} came where piece {expected} was next")]
    Piece {
        index: u32,
        count: u32,
        /// The piece that was next.
        expected: u32,
    },
    /// More bytes than the client agrees to hold.
    #[error("{bytes} bytes came (this client holds at most {allowed})")]
    TooLarge { bytes: usize, allowed: usize },
    /// The bodies do not hold every particle once, in order.
    #[error(
        "body {body:?} starts at particle {first} and has {count}, where {expected} is next of {particles}"
    )]
    Range {
        body: String,
        first: u32,
        count: u32,
        /// The first particle that no body before holds.
        expected: usize,
        particles: usize,
    },
    /// Particles without a body.
    #[error("the bodies hold {held} of {particles} particles")]
    Uncovered { held: usize, particles: usize },
    /// An index outside its body.
    #[error("{what} of body {body:?} name particle {index} (allowed: {first} to {last})")]
    Index { what: &'static str, body: String, index: u32, first: usize, last: usize },
    /// Bytes that are no whole number of elements.
    #[error("{what} of body {body:?} take {bytes} bytes, no multiple of {element}")]
    Bytes {
        /// Triangles, springs, pins or texture coordinates.
        what: &'static str,
        body: String,
        bytes: usize,
        element: usize,
    },
    /// Texture coordinates that are not one pair per particle.
    #[error("body {body:?} has {count} texture coordinates for {particles} particles")]
    TextureCount { body: String, count: usize, particles: u32 },
    /// Masses or volumes that are not one per particle, or no finite numbers from 0 on.
    #[error(
        "body {body:?} has {count} {what} for {particles} particles, all of which have to be finite and 0 or more"
    )]
    Weights { what: &'static str, body: String, count: usize, particles: u32 },
    /// A collider that cannot be drawn.
    #[error("collider {collider:?}: {what}")]
    Collider { collider: String, what: &'static str },
}

impl Topology {
    /// Reads the message and checks every count and index.
    ///
    /// # Errors
    /// At the first count, range or index that does not fit.
    pub(crate) fn from_wire(wire: v1::Topology, max_particles: usize) -> Result<Self, TopologyError> {
        let particle_count = wire.particle_count as usize;
        if particle_count > max_particles {
            let announced = u64::from(wire.particle_count);
            return Err(TopologyError::TooMany { announced, allowed: max_particles });
        }

        let mut held = 0;
        let mut bodies = Vec::with_capacity(wire.bodies.len());
        for body in wire.bodies {
            let body = Body::from_wire(body, held, particle_count)?;
            held += body.particle_count;
            bodies.push(body);
        }
        if held != particle_count {
            return Err(TopologyError::Uncovered { held, particles: particle_count });
        }
        let colliders = collider::read(wire.colliders)
            .map_err(|(collider, what)| TopologyError::Collider { collider, what })?;
        Ok(Self { id: wire.topology_id, particle_count, bodies, colliders })
    }
}

impl Body {
    fn from_wire(wire: v1::BodyTopology, expected: usize, particles: usize) -> Result<Self, TopologyError> {
        let (first, count) = (wire.first_particle as usize, wire.particle_count as usize);
        if first != expected || count > particles - expected {
            return Err(TopologyError::Range {
                body: wire.name,
                first: wire.first_particle,
                count: wire.particle_count,
                expected,
                particles,
            });
        }

        let color = wire.color.map(|packed| {
            let [_, red, green, blue] = packed.to_be_bytes();
            [red, green, blue]
        });
        let body = wire.name;
        let triangles: Vec<[u32; 3]> = unpack(&wire.triangles_u32, "triangles", &body, u32::from_le_bytes)?;
        let springs: Vec<[u32; 2]> = unpack(&wire.springs_u32, "springs", &body, u32::from_le_bytes)?;
        let pins: Vec<[u32; 1]> = unpack(&wire.pins_u32, "pins", &body, u32::from_le_bytes)?;
        let uv: Vec<[f32; 2]> = unpack(&wire.uv_f32, "texture coordinates", &body, f32::from_le_bytes)?;
        if !uv.is_empty() && uv.len() != count {
            return Err(TopologyError::TextureCount {
                body,
                count: uv.len(),
                particles: wire.particle_count,
            });
        }

        let masses = weights(&wire.mass_f32, "masses", &body, wire.particle_count)?;
        let volumes = weights(&wire.volume_f32, "volumes", &body, wire.particle_count)?;
        let lists = [
            ("triangles", triangles.as_flattened()),
            ("springs", springs.as_flattened()),
            ("pins", pins.as_flattened()),
        ];
        for (what, list) in lists {
            let outside = list.iter().find(|&&index| !(first..first + count).contains(&(index as usize)));
            if let Some(&index) = outside {
                let last = (first + count).saturating_sub(1);
                return Err(TopologyError::Index { what, body, index, first, last });
            }
        }

        let pins = pins.as_flattened().to_vec();
        let (first_particle, particle_count) = (first, count);
        let name = body;
        Ok(Self {
            name,
            first_particle,
            particle_count,
            triangles,
            springs,
            pins,
            uv,
            color,
            masses,
            volumes,
        })
    }
}

/// Numbers of 0 and more, one per particle or none.
fn weights(bytes: &[u8], what: &'static str, body: &str, particles: u32) -> Result<Vec<f32>, TopologyError> {
    let numbers: Vec<[f32; 1]> = unpack(bytes, what, body, f32::from_le_bytes)?;
    let numbers = numbers.as_flattened().to_vec();
    let is_whole = numbers.is_empty() || numbers.len() == particles as usize;
    if is_whole && numbers.iter().all(|number| number.is_finite() && *number >= 0.0) {
        return Ok(numbers);
    }
    Err(TopologyError::Weights { what, body: body.to_owned(), count: numbers.len(), particles })
}

/// Little-endian elements of `N` four-byte values.
fn unpack<T: Copy, const N: usize>(
    bytes: &[u8],
    what: &'static str,
    body: &str,
    read: impl Fn([u8; 4]) -> T,
) -> Result<Vec<[T; N]>, TopologyError> {
    let element = 4 * N;
    if !bytes.len().is_multiple_of(element) {
        return Err(TopologyError::Bytes { what, body: body.to_owned(), bytes: bytes.len(), element });
    }
    let value =
        |chunk: &[u8], i: usize| read([chunk[4 * i], chunk[4 * i + 1], chunk[4 * i + 2], chunk[4 * i + 3]]);
    Ok(bytes.chunks_exact(element).map(|chunk| std::array::from_fn(|i| value(chunk, i))).collect())
}
