//! What does not change during a session, as the messages that every stream begins with.
//!
//! Enters: a simulation, colours of its bodies. Leaves: its topology in messages of at most 1 MiB, because the triangles
//! of a large cloth need several.

use nappe_proto::v1;
use nappe_sim::world::{BodyRole, BodyTopology, Simulation};

use super::{collider::collider, packing::packed, pieces::BUDGET_BYTES, topology_pieces::split};

/// A session has one topology for all its life; frames name it by this number.
pub(super) const TOPOLOGY_ID: u32 = 1;
/// Colour of figures to which a scene gives none: that in which viewers draw solids.
const SOLID: u32 = 0x0096_9eaa;

/// The messages of a session's topology, each with the session's uid; at least one. `colors` are by the names of bodies, as
/// messages have them.
pub(crate) fn topology(
    simulation: &Simulation,
    colors: &[(String, u32)],
    session_uid: &str,
) -> Vec<v1::Topology> {
    let color = |name: &str| colors.iter().find(|(of, _)| of == name).map(|&(_, color)| color);
    let bodies = simulation.topology();
    let whole = v1::Topology {
        topology_id: TOPOLOGY_ID,
        particle_count: bodies.iter().map(|body| body.particle_count).sum(),
        bodies: bodies.iter().map(|of| body(of, color(&of.name))).collect(),
        colliders: simulation.colliders().iter().map(collider).collect(),
        chunk: None,
        session_uid: session_uid.to_owned(),
    };
    split(whole, BUDGET_BYTES)
}

fn body(body: &BodyTopology, color: Option<u32>) -> v1::BodyTopology {
    let solid = (body.role == BodyRole::Figure).then_some(SOLID);
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
        color: color.or(solid),
        role: role(body.role).into(),
        mass_f32: packed(body.masses.iter().map(|mass| (*mass as f32).to_le_bytes())),
        volume_f32: packed(body.volumes.iter().map(|volume| (*volume as f32).to_le_bytes())),
    }
}

fn role(role: BodyRole) -> v1::BodyRole {
    match role {
        BodyRole::Snow => v1::BodyRole::Unspecified,
        BodyRole::Cloth => v1::BodyRole::Cloth,
        BodyRole::Figure => v1::BodyRole::Figure,
    }
}
