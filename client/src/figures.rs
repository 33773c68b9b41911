//! What a session's figures say about snow.
//!
//! Enters: `v1::Session`, `v1::TimeBound`. Leaves: whether there is snow, the name of a bound.

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

/// Whether a session holds snow.
pub fn holds_snow(session: &v1::Session) -> bool {
    session.snow_particle_count > 0
}
