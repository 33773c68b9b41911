//! How many pairs there may be: the bytes that each takes, and why a sub-step fails whose pairs are not listed; pins that are moved.

use super::{
    pair::{Look, Pair},
    rows::PUSH_BYTES,
    search::Stopped,
    ways::wide,
};
use crate::{
    cloth::layout::{Model, Surface},
    math::{Padded, Real},
    report::StepFailure,
    surface::{Candidate, Unlisted},
};

/// Bytes for which there must be room where a pair is listed: in the search, whose lists may be twice as long, in those of all pairs, and in those of the
/// pairs that push, which a quarter of them do.
const PAIR_BYTES: usize =
    2 * size_of::<Candidate>() + size_of::<Pair>() + size_of::<Look>() + (PUSH_BYTES + size_of::<Pair>()) / 4;

/// How many pairs there is room for in so many bytes.
pub(super) fn pairs_in(bytes: u64) -> usize {
    usize::try_from(bytes).map_or(usize::MAX, |bytes| bytes / PAIR_BYTES)
}

/// Why pairs that are not listed are not kept apart.
pub(super) fn failure_of<R: Real>(model: &Model<R>, surface: &Surface, stopped: Stopped) -> StepFailure {
    match stopped {
        Stopped::Unlisted(Unlisted::Crowded { triangle, most }) => {
            let [first, ..] = surface.faces.triangles()[triangle];
            StepFailure::Crowded { particle: u64::from(model.user[first as usize]), limit: most as u64 }
        }
        Stopped::Unlisted(Unlisted::Interrupted) => StepFailure::Interrupted,
        Stopped::TooMany(count) => {
            StepFailure::PairMemory { bytes: (count as u64).saturating_mul(PAIR_BYTES as u64) }
        }
    }
}

/// The first of a pair's corners that is a pin which moves; `v` are velocities (m/s).
pub(super) fn moved_pin<R: Real>(model: &Model<R>, v: &[Padded<R>], corners: [u32; 4]) -> Option<u32> {
    let is_moved = |particle: &u32| {
        let particle = *particle as usize;
        model.inv_m[particle].to_f64() == 0.0 && wide(&v[particle]).amax() > 0.0
    };
    corners.into_iter().find(is_moved)
}
