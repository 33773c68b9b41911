//! What a header says of the data that follow, checked before anything is stored.

use nappe_proto::v1::MeshHeader;
use nappe_scene::{is_printable, printable};

use crate::{
    config::Limits,
    error::{Reason, ServiceError},
};

/// Longest name of a mesh (bytes).
const NAME_BYTES: usize = 256;

/// Elements of the arrays, in the order in which they come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    pub(super) points: usize,
    pub(super) triangles: usize,
    pub(super) masses: usize,
    pub(super) uv: usize,
    pub(super) velocities: usize,
    /// Bytes of all of them.
    pub(super) total: usize,
}

impl Layout {
    /// Bytes of an element of each array, as it is sent.
    pub(super) const SIZES: [usize; 5] = [24, 12, 8, 8, 24];

    /// # Errors
    /// A name, counts or a size that are not allowed.
    pub(super) fn of(header: &MeshHeader, limits: &Limits) -> Result<Self, ServiceError> {
        check_name("header.name", &header.name)?;
        let points = header.point_count;
        if points == 0 {
            return Err(ServiceError::field("header.point_count", "is 0: a mesh has points"));
        }

        let of_points = [
            ("header.mass_count", header.mass_count),
            ("header.uv_count", header.uv_count),
            ("header.velocity_count", header.velocity_count),
        ];
        for (field, count) in of_points {
            if count != 0 && count != points {
                let problem = format!("is {count}: allowed are 0 and the number of points, {points}");
                return Err(ServiceError::field(field, problem).with("value", count));
            }
        }

        check_points(points, limits)?;

        let MeshHeader { triangle_count, mass_count, uv_count, velocity_count, .. } = *header;
        let counts = [points, triangle_count, mass_count, uv_count, velocity_count];
        let sizes = std::array::from_fn::<_, 5, _>(|i| counts[i].saturating_mul(Self::SIZES[i] as u64));
        let total = sizes.iter().fold(0_u64, |sum, size| sum.saturating_add(*size));
        check_size(total, limits)?;

        let whole = |count: u64| {
            usize::try_from(count).expect("the total, which is within the limit, fits into memory")
        };
        let [points, triangles, masses, uv, velocities] = counts.map(whole);
        Ok(Self { points, triangles, masses, uv, velocities, total: whole(total) })
    }
}

/// The name of an upload, as a field of its request.
///
/// # Errors
/// A name that is too long or cannot be printed.
pub(super) fn check_name(field: &str, name: &str) -> Result<(), ServiceError> {
    if name.len() > NAME_BYTES {
        let problem = format!("has {} bytes; allowed: at most {NAME_BYTES}", name.len());
        return Err(ServiceError::field(field, problem));
    }

    if !is_printable(name) {
        let problem = format!("is '{}'; allowed: a name without control characters", printable(name));
        return Err(ServiceError::field(field, problem));
    }
    Ok(())
}

/// The points of an upload.
///
/// # Errors
/// More than a session may have particles.
pub(super) fn check_points(points: u64, limits: &Limits) -> Result<(), ServiceError> {
    let allowed = limits.max_particles;
    if points <= allowed {
        return Ok(());
    }
    let message = format!(
        "the mesh has {points} points, {} too many; allowed: at most {allowed} particles (--max-particles raises the limit)",
        points - allowed
    );
    Err(ServiceError::new(Reason::MeshTooLarge, message).with("points", points).with("allowed", allowed))
}

/// The bytes that an upload announces.
///
/// # Errors
/// More than are allowed.
pub(super) fn check_size(total: u64, limits: &Limits) -> Result<(), ServiceError> {
    let allowed = limits.max_mesh_bytes;
    if total <= allowed {
        return Ok(());
    }
    let message = format!(
        "the upload has {total} bytes, {} too many; allowed: at most {allowed} (--max-mesh-bytes raises the limit)",
        total - allowed
    );
    Err(ServiceError::new(Reason::MeshTooLarge, message).with("bytes", total).with("allowed", allowed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_that_overflow_are_refused_before_memory_is_taken() {
        let limits = Limits { max_particles: u64::MAX, ..Limits::default() };
        for (point_count, triangle_count) in [(u64::MAX, 0), (1, u64::MAX), (u64::MAX / 24, u64::MAX / 12)] {
            let header = MeshHeader { point_count, triangle_count, ..MeshHeader::default() };
            let error = Layout::of(&header, &limits).expect_err("too large");
            assert_eq!(error.reason, Reason::MeshTooLarge);
        }
    }
}
