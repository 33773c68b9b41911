//! How much memory and time a session takes, before anything large is made: from the counts of its scene.
//!
//! The numbers per particle, spring and triangle were measured (`tests/hostile/estimates.rs` compares): an estimate lies
//! between 1.0 and 1.5 times what real scenes of cloth and of snow take.

use nappe_scene::SceneSize;
use nappe_sim::{linalg::patch_bytes, math::Precision};

use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    memory::Claim,
};

/// Every session: its threads, its status, its first frames (bytes).
const SESSION: f64 = 1e6;
/// Every thread of a session (bytes).
const THREAD: f64 = 0.3e6;

/// Bytes of each element while the session is built, and while it is stepped.
#[derive(Clone, Copy, Debug)]
struct Cost {
    build: f64,
    session: f64,
}

const fn cost(build: f64, session: f64) -> Cost {
    Cost { build, session }
}

/// A body, however small: its name and its keys, its parameters and its topology as messages have them.
const BODY: Cost = cost(7_000.0, 3_000.0);
/// Costs in binary32, and what binary64 adds: a cloth, however small, has lists of its layout and of its states, for sixteen particles at
/// least, and memory for its steps.
const CLOTH: [Cost; 2] = [cost(17_000.0, 19_000.0), cost(8_000.0, 8_000.0)];
const CLOTH_PARTICLE: [Cost; 2] = [cost(166.0, 146.0), cost(76.0, 111.0)];
const IMPLICIT_PARTICLE: [Cost; 2] = [cost(0.0, 95.0), cost(0.0, 75.0)];
/// The iterate that is tried, the state before the last one, and the diagonal blocks kept at a saddle.
const ITERATED_PARTICLE: [Cost; 2] = [cost(0.0, 120.0), cost(0.0, 96.0)];
/// The iterate that is tried alone.
const TRIED_PARTICLE: [Cost; 2] = [cost(66.0, 34.0), cost(92.0, 32.0)];
/// The third state that sub-steps take turns in.
const DIVIDED_PARTICLE: [Cost; 2] = [cost(0.0, 36.0), cost(0.0, 30.0)];
/// Where its window began, its way in the one before, how far it was within the window, its piece, which it may be alone, and the force that
/// holds it while it sleeps.
const WATCHED_PARTICLE: [Cost; 2] = [cost(0.0, 112.0), cost(0.0, 48.0)];
/// A block with its share of a coarse space, and the factored top of one (bytes).
const COARSE_BLOCK: Cost = cost(48_000.0, 40_000.0);
const COARSE_TOP: f64 = 0.8e6;
/// The positions that patches were made at (bytes per particle), beside what they take themselves, of flat cloth a third of it. Where solves
/// come to them late, the first of them takes it.
const PATCHED_PARTICLE: f64 = 32.0;
const SPRING: [Cost; 2] = [cost(108.0, 29.0), cost(14.0, 18.0)];
const MESH_SPRING: Cost = cost(46.0, 0.0);
const TRIANGLE: Cost = cost(50.0, 31.0);
/// Its corners as blocks name them, and its share of what the air does to particles.
const TRIANGLE_IN_AIR: [Cost; 2] = [cost(22.0, 22.0), cost(13.0, 13.0)];
/// Its box in the tree of its surface, and the list of triangles about each particle; pairs that may meet are counted once they are found. While the
/// session is built it has no box yet, and the first step begins when all that the build alone needs is gone.
const TRIANGLE_APART: Cost = cost(300.0, 420.0);
const SNOW_PARTICLE: [Cost; 2] = [cost(321.0, 266.0), cost(221.0, 216.0)];
const SOLID_TRIANGLE: Cost = cost(300.0, 0.0);
/// A point and a triangle of a collider's mesh while it is closed; what its solid takes is counted in bytes.
const COLLIDER_POINT: Cost = cost(80.0, 0.0);
const COLLIDER_TRIANGLE: Cost = cost(200.0, 0.0);

/// Sessions may have claimed one part in so many of their memory without having taken it yet: what their first steps
/// and their frames need.
const UNTAKEN_SHARE: u64 = 2;
/// Memory that must be left for everything else (bytes).
const SPARE: u64 = 128 << 20;

/// Nanoseconds that each takes on one thread.
const NANOSECONDS: [f64; 6] = [1000.0, 1000.0, 200.0, 3000.0, 1000.0, 4000.0];

/// What a session is estimated to take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Estimate {
    /// Bytes at most while it is built.
    pub(crate) build_bytes: u64,
    /// Bytes while it is stepped, without the frames that it keeps.
    pub(crate) session_bytes: u64,
    /// Those of them that the snow takes.
    pub(crate) snow_bytes: u64,
    /// Bytes that solves may take beside, if there are as many: where they come to their cap.
    pub(crate) patch_bytes: u64,
    /// Seconds of its building.
    pub(crate) seconds: f64,
}

/// Bytes of the patches of so many particles.
fn of_patches(particles: u64) -> f64 {
    patch_bytes(particles) + PATCHED_PARTICLE * particles as f64
}

impl Estimate {
    pub(crate) fn of(size: &SceneSize, precision: Precision, thread_count: u32) -> Self {
        let wide = if precision == Precision::F64 { 1.0 } else { 0.0 };
        let by = |[narrow, more]: [Cost; 2]| {
            cost(narrow.build + wide * more.build, narrow.session + wide * more.session)
        };
        let parts = [
            (size.bodies, BODY),
            (size.cloths, by(CLOTH)),
            (size.cloth_particles, by(CLOTH_PARTICLE)),
            (size.implicit_particles, by(IMPLICIT_PARTICLE)),
            (size.iterated_particles, by(ITERATED_PARTICLE)),
            (size.tried_particles, by(TRIED_PARTICLE)),
            (size.divided_particles, by(DIVIDED_PARTICLE)),
            (size.watched_particles, by(WATCHED_PARTICLE)),
            (size.coarse_blocks, COARSE_BLOCK),
            (size.springs, by(SPRING)),
            (size.mesh_springs, MESH_SPRING),
            (size.triangles, TRIANGLE),
            (size.triangles_in_air, by(TRIANGLE_IN_AIR)),
            (size.snow_particles, by(SNOW_PARTICLE)),
            (size.solid_triangles, SOLID_TRIANGLE),
            (size.collider_points, COLLIDER_POINT),
            (size.collider_triangles, COLLIDER_TRIANGLE),
        ];
        let grid = size.snow_grid_bytes[usize::from(precision == Precision::F64)] as f64;
        let listed = size.collider_bytes.saturating_add(size.named_bytes).saturating_add(size.frame_bytes);
        let top = if size.coarse_blocks > 0 { COARSE_TOP } else { 0.0 };
        let beside = grid + top + of_patches(size.patched_particles) + listed as f64;
        let fixed = SESSION + THREAD * f64::from(thread_count) + beside;
        let sum = |bytes: fn(&Cost) -> f64| {
            parts.iter().map(|(count, cost)| *count as f64 * bytes(cost)).sum::<f64>()
        };

        let counts = [
            size.cloth_particles,
            size.springs,
            size.triangles,
            size.snow_particles,
            size.solid_triangles,
            size.collider_triangles,
        ];
        let nanoseconds =
            counts.iter().zip(NANOSECONDS).map(|(count, each)| *count as f64 * each).sum::<f64>();
        let apart = size.triangles_apart as f64;
        let build = fixed + sum(|cost| cost.build.max(cost.session)) + apart * TRIANGLE_APART.build;
        let session = fixed + sum(|cost| cost.session) + apart * TRIANGLE_APART.session;
        Self {
            build_bytes: build.max(session) as u64,
            session_bytes: session as u64,
            snow_bytes: (grid + size.snow_particles as f64 * by(SNOW_PARTICLE).session) as u64,
            patch_bytes: of_patches(size.switching_particles) as u64,
            seconds: 1e-9 * nanoseconds,
        }
    }

    /// Takes the memory of the build and of all frames that the session may keep: what a session was promised no
    /// other can take away.
    ///
    /// # Errors
    /// If it does not fit, or the build would take too long.
    pub(crate) fn claim(&self, memory: &Claim, limits: &Limits) -> Result<(), ServiceError> {
        let Self { build_bytes, seconds, .. } = *self;
        let allowed = limits.max_build_seconds;
        if seconds > f64::from(allowed) {
            let message = format!(
                "building the scene would take {seconds:.0} s and {build_bytes} bytes; allowed: at most {allowed} s"
            );
            return Err(ServiceError::new(Reason::BuildTooLong, message)
                .with("needed_seconds", format!("{seconds:.1}"))
                .with("allowed_seconds", allowed)
                .with("needed_bytes", build_bytes));
        }

        let needed = build_bytes.saturating_add(limits.history_bytes_per_session);
        memory.grow(needed).map_err(|full| full.with("needed_seconds", format!("{seconds:.1}")))?;
        probe(build_bytes.saturating_add(memory.of_all() / UNTAKEN_SHARE).saturating_add(SPARE))
    }
}

impl Estimate {
    /// Takes the memory of solves that come to their cap, after that of the build: returns how much it took, all or nothing.
    pub(crate) fn claim_patches(&self, memory: &Claim) -> u64 {
        let bytes = self.patch_bytes;
        let is_taken = memory.grow(bytes).is_ok_and(|()| {
            let untaken = memory.of_all() / UNTAKEN_SHARE;
            probe(bytes.saturating_add(untaken).saturating_add(SPARE)).is_ok()
        });
        if is_taken { bytes } else { 0 }
    }
}

/// Asks the system for memory that is given back at once: where it has none, the session that asked is refused. An
/// allocation that failed in the middle of a build, or of another session's step, would end the process.
fn probe(bytes: u64) -> Result<(), ServiceError> {
    let reserved = usize::try_from(bytes).ok().map(|bytes| Vec::<u8>::new().try_reserve_exact(bytes));
    if matches!(reserved, Some(Ok(()))) {
        return Ok(());
    }
    let message =
        format!("the system has no {bytes} bytes left, for the session and for what others were promised");
    Err(ServiceError::new(Reason::ServerMemoryFull, message).with("needed_bytes", bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::MemoryAccount;

    const SIZE: SceneSize = SceneSize {
        bodies: 1,
        cloths: 1,
        cloth_particles: 1000,
        implicit_particles: 1000,
        iterated_particles: 0,
        tried_particles: 0,
        divided_particles: 1000,
        watched_particles: 0,
        coarse_blocks: 0,
        patched_particles: 0,
        switching_particles: 0,
        springs: 6000,
        mesh_springs: 0,
        triangles: 2000,
        triangles_apart: 0,
        triangles_in_air: 0,
        snow_particles: 0,
        solid_triangles: 0,
        collider_points: 0,
        collider_triangles: 0,
        collider_bytes: 0,
        frame_bytes: 0,
        named_bytes: 0,
        snow_grid_bytes: [0; 2],
    };

    #[test]
    fn what_does_not_fit_or_takes_too_long_is_refused_with_its_numbers() {
        let estimate = Estimate::of(&SIZE, Precision::F64, 2);
        assert!(estimate.session_bytes < estimate.build_bytes && estimate.seconds < 1.0);

        let limits = Limits { history_bytes_per_session: 1000, ..Limits::default() };
        let account = MemoryAccount::of_server(estimate.build_bytes + 1500);
        let first = account.claim();
        estimate.claim(&first, &limits).expect("it fits");
        let refused = estimate.claim(&account.claim(), &limits).expect_err("it does not fit twice");
        assert_eq!(refused.reason, Reason::ServerMemoryFull);
        assert!(refused.metadata.contains(&("left_bytes", "500".to_owned())), "{refused:?}");
        let needed = (estimate.build_bytes + 1000).to_string();
        assert!(refused.metadata.contains(&("needed_bytes", needed)), "{refused:?}");

        let solid =
            SceneSize { collider_triangles: 1000, collider_points: 502, collider_bytes: 200_000, ..SIZE };
        let with_solid = Estimate::of(&solid, Precision::F64, 2);
        assert_eq!(with_solid.session_bytes, estimate.session_bytes + 200_000);
        assert!(
            with_solid.build_bytes > estimate.build_bytes + 200_000 && with_solid.seconds > estimate.seconds
        );

        let apart = Estimate::of(&SceneSize { triangles_apart: 2000, ..SIZE }, Precision::F64, 2);
        assert_eq!(apart.session_bytes, estimate.session_bytes + 840_000);

        let watched = Estimate::of(&SceneSize { watched_particles: 1000, ..SIZE }, Precision::F64, 2);
        assert_eq!(watched.session_bytes, estimate.session_bytes + 160_000);

        let forces = Estimate::of(&SceneSize { named_bytes: 1 << 50, ..SIZE }, Precision::F64, 2);
        let refused = forces.claim(&account.claim(), &limits).expect_err("a name stands for many particles");
        assert_eq!(refused.reason, Reason::ServerMemoryFull);

        let huge = SceneSize { snow_particles: u64::MAX, ..SIZE };
        let refused = Estimate::of(&huge, Precision::F32, 1).claim(&account.claim(), &limits);
        assert_eq!(refused.expect_err("it takes for ever").reason, Reason::BuildTooLong);
        assert_eq!(probe(u64::MAX).expect_err("nobody has it").reason, Reason::ServerMemoryFull);
        probe(1 << 20).expect("everybody has it");
    }
}
