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

/// A page of changes; if more follow, its token names the last of them.
pub(super) fn page(page: &[PendingChange], last: Option<Accepted>) -> v1::ListPendingChangesResponse {
    v1::ListPendingChangesResponse {
        next_page_token: last.map_or_else(String::new, |Accepted { step, order }| format!("{step}-{order}")),
        changes: page.iter().map(message).collect(),
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

fn message(pending: &PendingChange) -> v1::PendingChange {
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
                request.forces.push(lists::force_message(body, particles, forces));
            }
            Change::State { body, positions, velocities } => {
                request.states.push(lists::state_message(body, positions, velocities.as_deref()));
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
