//! Changes that wait for their step, as messages.
//!
//! Enters: changes of a session. Leaves: the calls that asked for them, page by page.

use nappe_proto::v1;
use nappe_sim::{cloth::SpringKind, world::Change};

use super::{collider_moves, lists};
use crate::{
    error::{Reason, ServiceError},
    session::{Accepted, PendingChange},
};

impl From<Accepted> for v1::UpdateParametersResponse {
    fn from(Accepted { step, order }: Accepted) -> Self {
        Self { effective_step: step, order }
    }
}

/// A page of changes; if more follow, its token names the last of them. Lists for which a message has no room are left out.
pub(super) fn page(page: &[PendingChange], last: Option<Accepted>) -> v1::ListPendingChangesResponse {
    let mut room = lists::Room::of_answer();
    v1::ListPendingChangesResponse {
        next_page_token: last.map_or_else(String::new, |Accepted { step, order }| format!("{step}-{order}")),
        changes: page.iter().map(|pending| message(pending, &mut room)).collect(),
    }
}

/// The change that a page token names: the next page begins after it.
///
/// # Errors
/// If the token was not made by [`page`].
pub(super) fn page_token(token: &str) -> Result<Option<Accepted>, ServiceError> {
    if token.is_empty() {
        return Ok(None);
    }
    let numbers = token.split_once('-').and_then(|(step, order)| step.parse().ok().zip(order.parse().ok()));
    let accepted = numbers.map(|(step, order)| Accepted { step, order });
    accepted.map(Some).ok_or_else(|| {
        ServiceError::new(Reason::InvalidPageToken, "the page token was not made by this server")
            .at_field("page_token", "was not made by this server")
    })
}

fn message(pending: &PendingChange, room: &mut lists::Room) -> v1::PendingChange {
    let mut request = v1::UpdateParametersRequest::default();
    for change in &pending.changes {
        match change {
            Change::Gravity(value) => request.gravity = Some((*value).into()),
            Change::Wind(value) => request.wind = Some((*value).into()),
            Change::Drag(value) => request.drag = Some(*value),
            Change::Air { body, density, normal, lift, tangential } => request.air.push(v1::AirUpdate {
                body: body.clone().unwrap_or_default(),
                density: *density,
                normal: *normal,
                lift: *lift,
                tangential: *tangential,
            }),
            Change::Springs { body, kind, stiffness, damping } => request.springs.push(v1::SpringUpdate {
                body: body.clone().unwrap_or_default(),
                kind: kind_message(*kind).into(),
                stiffness: *stiffness,
                damping: *damping,
            }),
            Change::Force { body, particles, forces } => {
                request.forces.push(lists::force_message(body, particles, forces, room));
            }
            Change::Pull(pull) => request.pulls.push(lists::pull_message(pull, room)),
            Change::State { body, positions, velocities } => {
                request.states.push(lists::state_message(body, positions, velocities.as_deref(), room));
            }
            // It does not wait.
            Change::Reset => {}
            Change::Pin { particle, target, duration } => request.pins.push(v1::PinUpdate {
                particle: *particle,
                target: Some((*target).into()),
                duration_seconds: *duration,
            }),
            Change::PinPath { particle, points } => request.paths.push(v1::PinPath {
                particle: *particle,
                times_seconds: points.iter().map(|(time, _)| *time).collect(),
                targets: points.iter().flat_map(|(_, target)| *target).collect(),
            }),
            Change::Collider(asked) => collider_moves::tell(&mut request, asked),
        }
    }
    v1::PendingChange { accepted: Some(pending.accepted.into()), changes: Some(request) }
}

fn kind_message(kind: Option<SpringKind>) -> v1::SpringKind {
    match kind {
        None => v1::SpringKind::Unspecified,
        Some(SpringKind::Stretch) => v1::SpringKind::Stretch,
        Some(SpringKind::Shear) => v1::SpringKind::Shear,
        Some(SpringKind::Bend) => v1::SpringKind::Bend,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nappe_sim::world::{ColliderMove, MoveKey, Vectors};
    use prost::Message as _;

    use super::*;

    /// What a client takes by default, and what a call may have (bytes).
    const MESSAGE_BYTES: usize = 4 << 20;

    fn one_call(changes: Vec<Change>) -> v1::ListPendingChangesResponse {
        let accepted = Accepted { step: 7, order: 3 };
        page(&[PendingChange { accepted, changes }], None)
    }

    #[test]
    fn an_answer_is_no_longer_than_a_message_whatever_one_call_asked_for() {
        // By the id of one upload, a short call puts many bodies, and each list is short enough to be shown.
        let (vectors, count) = (Vectors::from(vec![[0.5; 3]; 170]), 5000);
        let put = |number: usize| Change::State {
            body: format!("{number:064}"),
            positions: vectors.clone(),
            velocities: Some(vectors.clone()),
        };
        let told = one_call((0..count).map(put).collect());
        assert!(told.encoded_len() < MESSAGE_BYTES, "{} bytes", told.encoded_len());
        let states = &told.changes[0].changes.as_ref().expect("changes").states;
        assert_eq!(states.len(), count);
        let lengths =
            [0, count - 1].map(|at| (states[at].positions_f64.len(), states[at].velocities_f64.len()));
        assert_eq!(lengths, [(4080, 4080), (0, 0)]);

        let key = MoveKey { time: 1.0, position: Some([0.1; 3]), turn: Some([0.0, 0.0, 0.0, 1.0]) };
        let sent = |number: usize| {
            Change::Collider(ColliderMove { collider: format!("{number:064}"), keys: Arc::new([key]) })
        };
        let told = one_call((0..10_000).map(sent).collect());
        assert!(told.encoded_len() < MESSAGE_BYTES / 2, "{} bytes", told.encoded_len());
    }
}
