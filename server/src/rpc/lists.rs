//! Forces, pulls and states as messages carry them: packed lists of numbers.

use std::sync::Arc;

use nappe_proto::v1;
use nappe_sim::world::{Change, Forces, Pull, Vectors};
use prost::bytes::Bytes;

use super::validate::{finite, finite_vector};
use crate::error::ServiceError;

/// Gives points (m) and velocities (m/s) of an uploaded mesh, without a copy.
pub(super) type MeshById<'a> = dyn Fn(&str) -> Result<[Vectors; 2], ServiceError> + 'a;

/// Bytes of a list that are shown of changes that wait, at most.
const SHOWN: usize = 4096;
/// Bytes of all lists of an answer, at most: of 10 000 changes the rest has 1.5 MB, and a message 4 MiB.
const SHOWN_TOGETHER: usize = 2 << 20;

/// Room for lists in an answer (bytes): those that do not fit are left out.
#[derive(Debug)]
pub(super) struct Room(usize);

impl Room {
    /// That of an answer without lists.
    pub(super) fn of_answer() -> Self {
        Self(SHOWN_TOGETHER)
    }

    /// Takes the room of a list of so many bytes, if it is short enough and there is as much.
    fn take(&mut self, bytes: usize) -> bool {
        let fits = bytes <= SHOWN.min(self.0);
        if fits {
            self.0 -= bytes;
        }
        fits
    }
}

/// Ranges and counts are the simulation's to check.
pub(super) fn force(field: &str, update: &v1::ForceUpdate) -> Result<Change, ServiceError> {
    let v1::ForceUpdate { body, particles_u32, force, forces_f64 } = update;
    let particles = numbers(field, particles_u32)?;
    let forces = match force {
        Some(_) if !forces_f64.is_empty() => {
            return Err(ServiceError::field(field, "has both force and forces_f64: one is needed"));
        }
        Some(force) => Forces::One(finite_vector(&format!("{field}.force"), *force)?),
        None if forces_f64.is_empty() => {
            return Err(ServiceError::field(field, "has neither force nor forces_f64"));
        }
        None => Forces::Each(vectors(&format!("{field}.forces_f64"), forces_f64, "a force")?),
    };
    Ok(Change::Force { body: named(field, body)?, particles, forces })
}

/// The same of a pull.
pub(super) fn pull(field: &str, update: &v1::PullUpdate) -> Result<Change, ServiceError> {
    let v1::PullUpdate { body, particles_u32, points_f64, frequency, most, seconds } = update;
    Ok(Change::Pull(Pull {
        body: named(field, body)?,
        particles: numbers(field, particles_u32)?,
        points: vectors(&format!("{field}.points_f64"), points_f64, "a point")?,
        frequency: finite(&format!("{field}.frequency"), *frequency)?,
        most: finite(&format!("{field}.most"), *most)?,
        seconds: finite(&format!("{field}.seconds"), *seconds)?,
    }))
}

/// The same of where a body is put.
pub(super) fn state(
    field: &str,
    update: &v1::StateUpdate,
    mesh: &MeshById<'_>,
) -> Result<Change, ServiceError> {
    let v1::StateUpdate { body, positions_f64, velocities_f64, upload_id } = update;
    let body = named(field, body)?;
    if !upload_id.is_empty() {
        if !positions_f64.is_empty() || !velocities_f64.is_empty() {
            let problem = "has both an upload and arrays: one is needed";
            return Err(ServiceError::field(field, problem));
        }
        let [positions, velocities] = mesh(upload_id)?;
        let velocities = (!velocities.is_empty()).then_some(velocities);
        return Ok(Change::State { body, positions, velocities });
    }
    let positions = vectors(&format!("{field}.positions_f64"), positions_f64, "a position")?;
    let velocities = (!velocities_f64.is_empty())
        .then(|| vectors(&format!("{field}.velocities_f64"), velocities_f64, "a velocity"))
        .transpose()?;
    Ok(Change::State { body, positions: positions.into(), velocities: velocities.map(Into::into) })
}

fn named(field: &str, body: &str) -> Result<String, ServiceError> {
    if body.is_empty() {
        return Err(ServiceError::field(format!("{field}.body"), "is empty: the name of a body is needed"));
    }
    Ok(body.to_owned())
}

/// The particles that a change names.
fn numbers(field: &str, particles_u32: &[u8]) -> Result<Arc<[u32]>, ServiceError> {
    let name = format!("{field}.particles_u32");
    let particles = whole::<4>(&name, particles_u32, "a particle")?;
    Ok(particles.map(|bytes| u32::from_le_bytes(*bytes)).collect())
}

/// Numbers of `N` bytes each.
fn whole<'a, const N: usize>(
    field: &str,
    bytes: &'a [u8],
    of: &str,
) -> Result<impl Iterator<Item = &'a [u8; N]> + Clone, ServiceError> {
    let (numbers, rest) = bytes.as_chunks::<N>();
    if !rest.is_empty() {
        let problem = format!("has {} bytes: {N} for {of} are needed", bytes.len());
        return Err(ServiceError::field(field, problem).with("bytes", bytes.len()));
    }
    Ok(numbers.iter())
}

fn vectors(field: &str, bytes: &[u8], of: &str) -> Result<Arc<[[f64; 3]]>, ServiceError> {
    let vector = |bytes: &[u8; 24]| {
        let numbers = bytes.as_chunks::<8>().0;
        [0, 1, 2].map(|c| f64::from_le_bytes(numbers[c]))
    };
    let vectors: Arc<[[f64; 3]]> = whole::<24>(field, bytes, of)?.map(vector).collect();
    match vectors.as_flattened().iter().position(|number| !number.is_finite()) {
        Some(at) => {
            let value = vectors.as_flattened()[at];
            let problem = format!("{of}, number {}, is {value}: a finite number is needed", at / 3);
            Err(ServiceError::field(field, problem).with("particle", at / 3))
        }
        None => Ok(vectors),
    }
}

/// Forces that wait, without lists that are long.
pub(super) fn force_message(
    body: &str,
    particles: &[u32],
    forces: &Forces,
    room: &mut Room,
) -> v1::ForceUpdate {
    let (force, each) = match forces {
        Forces::One(force) => (Some((*force).into()), Bytes::new()),
        Forces::Each(forces) => (None, packed(forces, room)),
    };
    let particles_u32 = packed_particles(particles, room);
    v1::ForceUpdate { body: body.to_owned(), particles_u32, force, forces_f64: each }
}

/// The same of a pull.
pub(super) fn pull_message(pull: &Pull, room: &mut Room) -> v1::PullUpdate {
    let Pull { body, particles, points, frequency, most, seconds } = pull;
    v1::PullUpdate {
        body: body.clone(),
        particles_u32: packed_particles(particles, room),
        points_f64: packed(points, room),
        frequency: *frequency,
        most: *most,
        seconds: *seconds,
    }
}

/// A session as it stands among others: the bodies that forces act on are named, and the particles are left out.
pub(super) fn without_lists(mut session: v1::Session) -> v1::Session {
    for told in session.parameters.iter_mut().flat_map(|parameters| &mut parameters.forces) {
        let v1::ForceUpdate { particles_u32, force, forces_f64, .. } = told;
        if !particles_u32.is_empty() {
            (*particles_u32, *force, *forces_f64) = (Bytes::new(), None, Bytes::new());
        }
    }
    session
}

/// The same of a state.
pub(super) fn state_message(
    body: &str,
    positions: &[[f64; 3]],
    velocities: Option<&[[f64; 3]]>,
    room: &mut Room,
) -> v1::StateUpdate {
    v1::StateUpdate {
        body: body.to_owned(),
        positions_f64: packed(positions, room),
        velocities_f64: velocities.map_or_else(Bytes::new, |velocities| packed(velocities, room)),
        upload_id: String::new(),
    }
}

fn packed_particles(particles: &[u32], room: &mut Room) -> Bytes {
    if !room.take(size_of_val(particles)) {
        return Bytes::new();
    }
    particles.iter().flat_map(|particle| particle.to_le_bytes()).collect()
}

fn packed(vectors: &[[f64; 3]], room: &mut Room) -> Bytes {
    if !room.take(size_of_val(vectors)) {
        return Bytes::new();
    }
    vectors.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect()
}
