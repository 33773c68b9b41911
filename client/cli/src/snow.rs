//! Figures of snow in words: JSON for programs, phrases for people.
//!
//! Enters: `v1::SnowDiagnostics`. Leaves: [`SnowJson`], a line for a table, a phrase for a progress bar.

use nappe_client::{time_bound_name, v1};
use serde::Serialize;

use crate::output;

/// Figures of snow as programs read them; the names are those of the contract (frame.proto).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct SnowJson {
    substeps: u32,
    dt_seconds: f64,
    bound: &'static str,
    bound_particle: Option<u64>,
    /// None if nothing limits the step.
    bound_seconds: Option<f64>,
    mass: f64,
    grid_mass_error: f64,
    plastic_count: u64,
    inverted_count: u64,
    clamped_count: u64,
    ballistic_count: u64,
    min_plastic_ratio: f64,
    max_plastic_ratio: f64,
    max_speed: f64,
    dropped_momentum: f64,
    angular_momentum: [f64; 3],
    block_count: u64,
}

impl From<&v1::SnowDiagnostics> for SnowJson {
    fn from(snow: &v1::SnowDiagnostics) -> Self {
        let angular_momentum = snow.angular_momentum.unwrap_or_default();
        Self {
            substeps: snow.substeps,
            dt_seconds: snow.dt_seconds,
            bound: time_bound_name(snow.bound()),
            bound_particle: snow.bound_particle,
            bound_seconds: Some(snow.bound_seconds).filter(|seconds| seconds.is_finite()),
            mass: snow.mass,
            grid_mass_error: snow.grid_mass_error,
            plastic_count: snow.plastic_count,
            inverted_count: snow.inverted_count,
            clamped_count: snow.clamped_count,
            ballistic_count: snow.ballistic_count,
            min_plastic_ratio: snow.min_plastic_ratio,
            max_plastic_ratio: snow.max_plastic_ratio,
            max_speed: snow.max_speed,
            dropped_momentum: snow.dropped_momentum,
            angular_momentum: [angular_momentum.x, angular_momentum.y, angular_momentum.z],
            block_count: snow.block_count,
        }
    }
}

impl SnowJson {
    /// How the last step was divided, and what limits the next one.
    pub(crate) fn steps(&self) -> String {
        let place =
            self.bound_particle.map_or_else(String::new, |particle| format!(" at particle {particle}"));
        format!(
            "{} in a step, dt {}; bound: {}{place}",
            output::count(self.substeps.into()),
            output::duration(self.dt_seconds),
            self.bound
        )
    }

    /// Particles that did something, each count that is not 0.
    pub(crate) fn counts(&self) -> String {
        let counts = [
            ("plastic", self.plastic_count),
            ("inverted", self.inverted_count),
            ("clamped", self.clamped_count),
            ("ballistic", self.ballistic_count),
        ];
        let told = counts.iter().filter(|(_, count)| *count > 0);
        let told: Vec<String> =
            told.map(|(name, count)| format!("{} {name}", output::count(*count))).collect();
        if told.is_empty() { "all elastic".to_owned() } else { told.join(", ") }
    }

    /// Range of J_P.
    pub(crate) fn packing(&self) -> String {
        format!("J_P {:.3} to {:.3}", self.min_plastic_ratio, self.max_plastic_ratio)
    }
}

/// A phrase for a progress bar or a line of figures; empty without snow.
pub(crate) fn phrase(figures: &v1::Diagnostics) -> String {
    figures.snow.as_ref().map_or_else(String::new, |snow| {
        let snow = SnowJson::from(snow);
        let dt = output::duration(snow.dt_seconds);
        format!("  {} x {dt} ({}), {}, {}", snow.substeps, snow.bound, snow.counts(), snow.packing())
    })
}

#[cfg(test)]
mod tests {
    use nappe_client::TIME_BOUNDS;
    use nappe_sim::report::BoundKind;

    use super::*;

    #[test]
    fn bounds_have_the_names_of_the_simulation() {
        let names: Vec<&str> = TIME_BOUNDS.iter().map(|(_, name)| *name).collect();
        assert_eq!(names, BoundKind::ALL.map(BoundKind::name));
    }

    #[test]
    fn only_counts_above_0_are_told() {
        let mut snow =
            v1::SnowDiagnostics { substeps: 12, dt_seconds: 2e-4, ..v1::SnowDiagnostics::default() };
        snow.set_bound(v1::TimeBound::ElasticWave);
        snow.bound_particle = Some(3);
        snow.bound_seconds = f64::INFINITY;
        let json = SnowJson::from(&snow);
        assert_eq!(json.counts(), "all elastic");
        assert_eq!(json.steps(), "12 in a step, dt 200.0 us; bound: elastic_wave at particle 3");
        assert_eq!(json.bound_seconds, None, "JSON has no infinity");
        snow.plastic_count = 1200;
        snow.inverted_count = 1;
        assert_eq!(SnowJson::from(&snow).counts(), "1 200 plastic, 1 inverted");
        let figures = v1::Diagnostics { snow: Some(snow), ..v1::Diagnostics::default() };
        assert!(phrase(&figures).contains("12 x 200.0 us (elastic_wave)"));
        assert_eq!(phrase(&v1::Diagnostics::default()), "");
    }
}
