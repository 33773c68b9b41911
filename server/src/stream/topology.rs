//! What does not change during a session, as the messages that every stream begins with.
//!
//! Enters: a simulation. Leaves: its topology in messages of at most 1 MiB, because the triangles
//! of a large cloth need several. The messages share the memory of the arrays; a body continues from piece to
//! piece until its arrays are sent.

use bytes::Bytes;
use nappe_proto::v1;
use nappe_sim::world::{BodyTopology, Simulation};

use super::{
    collider::collider,
    pieces::{BUDGET_BYTES, numbered},
};

/// A session has one topology for all its life; frames name it by this number.
pub(super) const TOPOLOGY_ID: u32 = 1;

/// Bytes that a body takes in a message besides its name and arrays, at most.
const BODY_BYTES: usize = 64;

/// The messages of a session's topology, each with the session's uid; at least one.
pub(crate) fn topology(simulation: &Simulation, session_uid: &str) -> Vec<v1::Topology> {
    let bodies = simulation.topology();
    let whole = v1::Topology {
        topology_id: TOPOLOGY_ID,
        particle_count: bodies.iter().map(|body| body.particle_count).sum(),
        bodies: bodies.iter().map(body).collect(),
        colliders: simulation.colliders().iter().map(collider).collect(),
        chunk: None,
        session_uid: session_uid.to_owned(),
    };
    split(whole, BUDGET_BYTES)
}

fn body(body: &BodyTopology) -> v1::BodyTopology {
    // Triangles are enough to draw a body that has them.
    let springs = if body.triangles.is_empty() { body.springs.as_slice() } else { &[] };

    v1::BodyTopology {
        name: body.name.clone(),
        first_particle: body.first_particle,
        particle_count: body.particle_count,
        triangles_u32: packed(body.triangles.as_flattened().iter().map(|i| i.to_le_bytes())),
        springs_u32: packed(springs.as_flattened().iter().map(|i| i.to_le_bytes())),
        pins_u32: packed(body.pins.iter().map(|i| i.to_le_bytes())),
        uv_f32: packed(body.uv.as_flattened().iter().map(|c| (*c as f32).to_le_bytes())),
    }
}

fn packed(numbers: impl Iterator<Item = [u8; 4]>) -> Bytes {
    numbers.flatten().collect::<Vec<u8>>().into()
}

fn split(whole: v1::Topology, budget: usize) -> Vec<v1::Topology> {
    let mut cutter = Cutter { pieces: vec![Vec::new()], room: budget, budget };
    for body in whole.bodies {
        cutter.add(body);
    }

    let mut colliders = Some(whole.colliders);
    numbered(cutter.pieces)
        .map(|(chunk, bodies)| v1::Topology {
            topology_id: whole.topology_id,
            particle_count: whole.particle_count,
            bodies,
            colliders: colliders.take().unwrap_or_default(),
            chunk: Some(chunk),
            session_uid: whole.session_uid.clone(),
        })
        .collect()
}

/// Cuts the arrays of bodies into pieces of at most `budget` bytes; at least one.
struct Cutter {
    pieces: Vec<Vec<v1::BodyTopology>>,
    /// Bytes left in the last piece.
    room: usize,
    budget: usize,
}

impl Cutter {
    fn add(&mut self, mut body: v1::BodyTopology) {
        loop {
            let head = BODY_BYTES + body.name.len();
            if self.room < head + 12 && self.room < self.budget {
                self.pieces.push(Vec::new());
                self.room = self.budget;
            }

            self.room = self.room.saturating_sub(head);

            // At least one element, so that every piece carries something.
            let mut room = self.room.max(12);
            let mut part = |data: &mut Bytes, element: usize| {
                let bytes = (room / element * element).min(data.len());
                room -= bytes;
                data.split_to(bytes)
            };
            let part = v1::BodyTopology {
                name: body.name.clone(),
                first_particle: body.first_particle,
                particle_count: body.particle_count,
                triangles_u32: part(&mut body.triangles_u32, 12),
                springs_u32: part(&mut body.springs_u32, 8),
                pins_u32: part(&mut body.pins_u32, 4),
                uv_f32: part(&mut body.uv_f32, 8),
            };
            self.room = room;
            self.pieces.last_mut().expect("there is a piece").push(part);

            if is_sent(&body) {
                return;
            }
            self.room = 0;
        }
    }
}

/// Whether nothing of the arrays is left.
fn is_sent(body: &v1::BodyTopology) -> bool {
    [&body.triangles_u32, &body.springs_u32, &body.pins_u32, &body.uv_f32].iter().all(|data| data.is_empty())
}

#[cfg(test)]
mod tests {
    use prost::Message as _;

    use super::*;

    fn body(name: &str, first_particle: u32, triangles: usize, uv: usize) -> v1::BodyTopology {
        let bytes = |count: usize| Bytes::from((0..count).map(|i| i as u8).collect::<Vec<_>>());
        v1::BodyTopology {
            name: name.into(),
            first_particle,
            particle_count: 10,
            triangles_u32: bytes(12 * triangles),
            springs_u32: Bytes::new(),
            pins_u32: bytes(4),
            uv_f32: bytes(8 * uv),
        }
    }

    #[test]
    fn pieces_put_together_are_the_whole_and_none_is_too_large() {
        let bodies =
            vec![body("a", 0, 3, 0), body("b", 10, 200, 77), body("c", 20, 0, 5), body("d", 30, 90, 1)];
        let whole = v1::Topology { topology_id: 1, particle_count: 40, bodies, ..v1::Topology::default() };
        for budget in [200, 500, 1000, 1 << 20] {
            let pieces = split(whole.clone(), budget);
            let mut together: Vec<v1::BodyTopology> = Vec::new();
            for (i, piece) in pieces.iter().enumerate() {
                assert!(piece.encoded_len() <= budget + 100, "{} of {budget}", piece.encoded_len());
                assert_eq!(piece.chunk, Some(v1::Chunk { index: i as u32, count: pieces.len() as u32 }));
                for part in &piece.bodies {
                    match together.last_mut().filter(|last| last.first_particle == part.first_particle) {
                        None => together.push(part.clone()),
                        Some(last) => {
                            last.triangles_u32 =
                                [&last.triangles_u32[..], &part.triangles_u32].concat().into();
                            last.pins_u32 = [&last.pins_u32[..], &part.pins_u32].concat().into();
                            last.uv_f32 = [&last.uv_f32[..], &part.uv_f32].concat().into();
                        }
                    }
                }
            }
            assert_eq!(together, whole.bodies, "budget {budget}");
        }
    }
}
