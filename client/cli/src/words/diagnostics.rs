//! Diagnostics of a step in words: parts of a table, a phrase for a progress bar.
//!
//! Enters: `v1::Diagnostics` and `v1::SnowDiagnostics`. Leaves: text. As JSON, the contract's own types are written.

use nappe_client::v1;

use crate::words::output;

/// Kinetic, elastic and gravitational energy together (J).
pub(crate) fn total_energy(diagnostics: &v1::Diagnostics) -> f64 {
    diagnostics.kinetic_energy + diagnostics.elastic_energy + diagnostics.gravitational_energy
}

/// Length of the last step of the cloths or of the snow, whichever is shorter (s).
pub(crate) fn dt_seconds(diagnostics: &v1::Diagnostics) -> Option<f64> {
    let cloth = diagnostics.cloth.as_ref().map(|cloth| cloth.dt_seconds);
    let snow = diagnostics.snow.as_ref().map(|snow| snow.dt_seconds);
    cloth.into_iter().chain(snow).filter(|seconds| *seconds > 0.0).reduce(f64::min)
}

/// How the last step of the scene was divided into steps of snow, and what limits the next one.
pub(crate) fn substeps(snow: &v1::SnowDiagnostics) -> String {
    let at = snow.bound_particle.map_or_else(String::new, |particle| format!(" at particle {particle}"));
    format!(
        "{} per step, dt {}; bound: {}{at}",
        output::count(snow.substeps.into()),
        output::time(snow.dt_seconds),
        snow.bound().word()
    )
}

/// How the last step of the scene was divided for the cloths, what limits the next sub-step, and the error made.
pub(crate) fn cloth_steps(cloth: &v1::ClothSteps) -> String {
    let at = cloth.bound_particle.map_or_else(String::new, |particle| format!(" at particle {particle}"));
    let far = if cloth.solve_error_m > 0.0 {
        format!(", at their cap about {:.1e} m off", cloth.solve_error_m)
    } else {
        String::new()
    };
    let more = if cloth.solves > cloth.substeps {
        format!(", {} in all", output::count(cloth.solves.into()))
    } else {
        String::new()
    };
    let solved =
        cloth.preconditioner.as_ref().map_or_else(String::new, |kind| format!("; solves: {kind}{more}{far}"));
    format!(
        "{} per step, dt {}; bound: {}{at}; error {:.1e} m (largest {:.1e} m){solved}",
        output::count(cloth.substeps.into()),
        output::time(cloth.dt_seconds),
        cloth.bound().word(),
        cloth.error_rms,
        cloth.error_largest
    )
}

/// What kept surfaces of cloth apart, and how often edges cross triangles where that is counted.
pub(crate) fn surfaces(surface: &v1::SurfaceReport) -> String {
    let v1::SurfaceReport {
        pairs, active, rounds, least_gap_m, failed, crossings, yield_m, yielding, ..
    } = *surface;
    let told = [
        least_gap_m.map(|gap| format!("least gap {gap:.2e} m")),
        (failed > 0).then(|| format!("{} sub-steps not accepted", output::count(failed))),
        crossings.map(|count| format!("{} crossings", output::count(count))),
        (yielding > 0).then(|| {
            format!("{} corners of figures yield, up to {:.1} mm", output::count(yielding), 1e3 * yield_m)
        }),
    ];
    let [pairs, active, rounds] = [pairs, active, rounds.into()].map(output::count);
    let pushed = format!("{active} of {pairs} pairs push, {rounds} rounds");
    let parts: Vec<String> = [pushed].into_iter().chain(told.into_iter().flatten()).collect();
    parts.join("; ")
}

/// How much of the cloth lies still, and how far the liveliest of it went.
pub(crate) fn rest(rest: &v1::RestReport) -> String {
    let v1::RestReport { calm_share, pieces, calm_pieces, way_m, change_m, told_m, .. } = *rest;
    let [calm, all] = [calm_pieces, pieces].map(output::count);
    let still = format!(
        "{calm} of {all} pieces are calm, {:.1} % of the particles; in a window at most {way_m:.1e} m, changed by {change_m:.1e} m",
        100.0 * calm_share
    );
    if rest.pieces_asleep == 0 && rest.wakes == 0 {
        return still;
    }
    let [asleep, wakes] = [rest.pieces_asleep, rest.wakes].map(output::count);
    format!("{still}; {asleep} pieces sleep, woken {wakes} times; off by about {told_m:.1e} m")
}

/// How many particles yielded, were inverted and so on: each count that is not 0.
pub(crate) fn counts(snow: &v1::SnowDiagnostics) -> String {
    let counts = [
        ("plastic", snow.plastic_count),
        ("inverted", snow.inverted_count),
        ("clamped", snow.clamped_count),
        ("ballistic", snow.ballistic_count),
        ("torn", snow.torn_count),
    ];
    let told = counts.iter().filter(|(_, count)| *count > 0);
    let told: Vec<String> = told.map(|(name, count)| format!("{} {name}", output::count(*count))).collect();
    if told.is_empty() { "all elastic".to_owned() } else { told.join(", ") }
}

/// Range of the plastic ratio J_P.
pub(crate) fn packing(snow: &v1::SnowDiagnostics) -> String {
    format!("J_P {:.3} to {:.3}", snow.min_plastic_ratio, snow.max_plastic_ratio)
}

/// How often something made the results doubtful: each count that is not 0.
pub(crate) fn doubts(notices: &v1::Notices) -> String {
    let counts = [
        ("solves at their cap", notices.capped_solves),
        ("solves of a matrix that is not positive definite", notices.indefinite_solves),
        ("passages through a collider", notices.passed_particles),
        ("sub-steps that were not accepted", notices.rejected_steps),
        ("pinched particles", notices.pinched_particles),
        ("corners of figures off their frames", notices.yielding_corners),
    ];
    let told = counts.iter().filter(|(_, count)| *count > 0);
    let told = told.map(|(name, count)| format!("{} {name}", output::count(*count)));
    let torn = notices.first_torn_particle.zip(notices.first_torn_seconds).map(|(particle, seconds)| {
        format!("torn by numerics: particle {particle} first, at {}", output::moment(seconds))
    });
    told.chain(torn).collect::<Vec<_>>().join(", ")
}

/// A sub-step of the cloths that was not accepted, in one line.
pub(crate) fn rejected(step: &v1::RejectedStep) -> String {
    format!(
        "t = {:.6} s: a sub-step of {} was not accepted for body '{}': {}",
        step.time_seconds,
        output::time(step.dt_seconds),
        step.body,
        step.message
    )
}

/// A phrase for a progress bar or a line of diagnostics; empty without snow.
pub(crate) fn snow_phrase(diagnostics: &v1::Diagnostics) -> String {
    diagnostics.snow.as_ref().map_or_else(String::new, |snow| {
        let dt = output::time(snow.dt_seconds);
        let bound = snow.bound().word();
        format!("  {} x {dt} ({bound}), {}, {}", snow.substeps, counts(snow), packing(snow))
    })
}

#[cfg(test)]
mod tests {
    use nappe_sim::report::BoundKind;

    use super::*;

    #[test]
    fn bounds_have_the_names_of_the_simulation() {
        let bounds = (1..).map_while(|number| v1::TimeBound::try_from(number).ok());
        let words: Vec<String> = bounds.map(v1::TimeBound::word).collect();
        assert_eq!(words, BoundKind::ALL.map(BoundKind::name));
    }

    #[test]
    fn only_counts_above_0_are_told() {
        let mut snow =
            v1::SnowDiagnostics { substeps: 12, dt_seconds: 2e-4, ..v1::SnowDiagnostics::default() };
        snow.set_bound(v1::TimeBound::ElasticWave);
        snow.bound_particle = Some(3);
        assert_eq!(counts(&snow), "all elastic");
        assert_eq!(substeps(&snow), "12 per step, dt 200 µs; bound: elastic_wave at particle 3");
        snow.plastic_count = 1200;
        snow.inverted_count = 1;
        assert_eq!(counts(&snow), "1 200 plastic, 1 inverted");
        let diagnostics = v1::Diagnostics { snow: Some(snow), ..v1::Diagnostics::default() };
        assert!(snow_phrase(&diagnostics).contains("12 x 200 µs (elastic_wave)"));
        assert_eq!(snow_phrase(&v1::Diagnostics::default()), "");

        let surface = v1::SurfaceReport { pairs: 1200, active: 7, rounds: 2, ..v1::SurfaceReport::default() };
        assert_eq!(surfaces(&surface), "7 of 1 200 pairs push, 2 rounds");
        let surface =
            v1::SurfaceReport { least_gap_m: Some(1.5e-3), failed: 1, crossings: Some(0), ..surface };
        assert_eq!(
            surfaces(&surface),
            "7 of 1 200 pairs push, 2 rounds; least gap 1.50e-3 m; 1 sub-steps not accepted; 0 crossings"
        );
        let pressed =
            v1::SurfaceReport { pairs: 9, yield_m: 0.0171, yielding: 14, ..v1::SurfaceReport::default() };
        assert_eq!(
            surfaces(&pressed),
            "0 of 9 pairs push, 0 rounds; 14 corners of figures yield, up to 17.1 mm"
        );

        let still = v1::RestReport {
            calm_share: 0.25,
            pieces: 1200,
            calm_pieces: 2,
            way_m: 1e-3,
            change_m: 2e-6,
            ..v1::RestReport::default()
        };
        assert_eq!(
            rest(&still),
            "2 of 1 200 pieces are calm, 25.0 % of the particles; in a window at most 1.0e-3 m, changed by 2.0e-6 m"
        );
        let asleep = v1::RestReport { pieces_asleep: 2, wakes: 1, told_m: 3e-5, ..still };
        assert!(rest(&asleep).ends_with("; 2 pieces sleep, woken 1 times; off by about 3.0e-5 m"));

        let notices = v1::Notices { passed_particles: 1, pinched_particles: 2000, ..v1::Notices::default() };
        assert_eq!(doubts(&notices), "1 passages through a collider, 2 000 pinched particles");
        assert_eq!(doubts(&v1::Notices::default()), "");
        let notices = v1::Notices {
            torn_particles: 40,
            first_torn_particle: Some(7),
            first_torn_seconds: Some(0.95),
            ..v1::Notices::default()
        };
        assert_eq!(doubts(&notices), "torn by numerics: particle 7 first, at 0.950 s");
    }
}
