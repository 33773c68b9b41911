//! Pieces of the snow's grid, joined.
//!
//! Enters: `v1::GridField` in order, from a server that is not trusted. Leaves: a [`GridFrame`] whose arrays are of
//! one length and hold finite numbers. Memory grows with what has arrived, and stays below a limit.

use nappe_proto::v1;

use super::error::DecodeError;
use crate::frame::GridFrame;

/// Appends the nodes of a piece, at most `max_nodes` in all.
pub(super) fn append(
    grid: &mut Option<GridFrame>,
    frame: u64,
    piece: &v1::GridField,
    max_nodes: usize,
) -> Result<(), DecodeError> {
    let v1::GridField { cell, stride, node_count, .. } = *piece;
    let is_same = |grid: &GridFrame| {
        grid.cell.to_bits() == cell.to_bits() && grid.stride == stride && grid.node_count == node_count
    };
    if !(cell.is_finite() && cell > 0.0) || stride == 0 || !grid.as_ref().is_none_or(is_same) {
        return Err(DecodeError::GridHead { frame, cell, stride, node_count });
    }

    let grid = grid.get_or_insert_with(|| GridFrame { cell, stride, node_count, ..GridFrame::default() });

    let (indices, index_rest) = piece.index_i32.as_chunks::<12>();
    let (masses, mass_rest) = piece.mass_f32.as_chunks::<4>();
    let (velocities, velocity_rest) = piece.velocity_f32.as_chunks::<12>();
    let (forces, force_rest) = piece.force_f32.as_chunks::<12>();
    let rests = [index_rest.len(), mass_rest.len(), velocity_rest.len(), force_rest.len()];
    let are_like_indices = indices.len() == masses.len() && indices.len() == velocities.len();
    // Of a frame all nodes come with a force, or none does.
    let with_forces = grid.forces.len() + forces.len();
    let is_forced = with_forces == 0 || with_forces == grid.indices.len() + indices.len();
    if rests != [0; 4] || !are_like_indices || !is_forced {
        return Err(DecodeError::GridBytes {
            frame,
            index_bytes: piece.index_i32.len(),
            mass_bytes: piece.mass_f32.len(),
            velocity_bytes: piece.velocity_f32.len(),
            force_bytes: piece.force_f32.len(),
        });
    }

    let received = grid.indices.len().saturating_add(indices.len());
    let allowed = max_nodes.min(usize::try_from(node_count).unwrap_or(usize::MAX));
    if received > allowed {
        return Err(DecodeError::GridTooLarge { frame, received, allowed });
    }

    let first = grid.indices.len();
    grid.indices.extend(indices.iter().map(|bytes| three(bytes, i32::from_le_bytes)));
    grid.masses.extend(masses.iter().map(|&bytes| f32::from_le_bytes(bytes)));
    grid.velocities.extend(velocities.iter().map(|bytes| three(bytes, f32::from_le_bytes)));
    grid.forces.extend(forces.iter().map(|bytes| three(bytes, f32::from_le_bytes)));
    check_values(grid, first, frame)
}

/// The grid, if all that was announced has come.
pub(super) fn finish(grid: Option<GridFrame>, frame: u64) -> Result<Option<GridFrame>, DecodeError> {
    if let Some(GridFrame { indices, stride: 1, node_count, .. }) = &grid
        && indices.len() as u64 != *node_count
    {
        return Err(DecodeError::GridMissing { frame, received: indices.len(), announced: *node_count });
    }
    Ok(grid)
}

/// Masses are finite and not negative, velocities and forces finite, from node `first` on.
fn check_values(grid: &GridFrame, first: usize, frame: u64) -> Result<(), DecodeError> {
    for (node, (&mass, velocity)) in grid.masses.iter().zip(&grid.velocities).enumerate().skip(first) {
        if !(mass.is_finite() && mass >= 0.0) {
            return Err(DecodeError::GridValue { frame, field: "mass", node, value: mass.into() });
        }
        if let Some(&value) = velocity.iter().find(|value| !value.is_finite()) {
            return Err(DecodeError::GridValue { frame, field: "velocity", node, value: value.into() });
        }
    }
    for (node, force) in grid.forces.iter().enumerate().skip(first) {
        if let Some(&value) = force.iter().find(|value| !value.is_finite()) {
            return Err(DecodeError::GridValue { frame, field: "force", node, value: value.into() });
        }
    }
    Ok(())
}

fn three<T>(bytes: &[u8; 12], read: impl Fn([u8; 4]) -> T) -> [T; 3] {
    std::array::from_fn(|axis| {
        let at = 4 * axis;
        read([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
    })
}
