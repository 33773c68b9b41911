//! What a session's figures say about snow.
//!
//! Enters: `v1::Session`, `v1::TimeBound`. Leaves: whether there may be snow, the name of a bound.

use nappe_proto::v1;

/// Every bound on the time step of snow, and its name.
pub const TIME_BOUNDS: [(v1::TimeBound, &str); 7] = [
    (v1::TimeBound::ElasticWave, "elastic_wave"),
    (v1::TimeBound::IsolatedParticle, "isolated_particle"),
    (v1::TimeBound::ParticleSpeed, "particle_speed"),
    (v1::TimeBound::VelocityGradient, "velocity_gradient"),
    (v1::TimeBound::ColliderSpeed, "collider_speed"),
    (v1::TimeBound::Fixed, "fixed"),
    (v1::TimeBound::Frame, "frame"),
];

/// Name of a bound on the time step of snow: `elastic_wave`, `particle_speed` ...; `unknown` for one of a
/// newer server.
pub fn time_bound_name(bound: v1::TimeBound) -> &'static str {
    TIME_BOUNDS.iter().find(|(known, _)| *known == bound).map_or("unknown", |(_, name)| name)
}

/// Whether a session may hold snow, as far as it tells: its figures hold those of snow from its first step on,
/// and a session without springs has no cloth.
pub fn may_hold_snow(session: &v1::Session) -> bool {
    let has_snow = session.diagnostics.as_ref().is_some_and(|figures| figures.snow.is_some());
    has_snow || session.spring_count == 0
}
