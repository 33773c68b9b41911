//! The thick cloth that is timed: a sheet that hangs, a towel that lies folded, and five sheets on a ball; and the same cloth without
//! a thickness.
//!
//! Reads shipped scenes; writes seconds per step, rounds and pairs.

use std::collections::BTreeMap;

use nappe_scene::{NoMeshes, Scene, SceneLimits};
use nappe_sim::{math::Precision, report::SurfaceReport, world::WorldSetup};
use serde::Serialize;

use super::{
    row::Row,
    sample::{self, Sample},
    timings::{self, StepCounts, Timing},
};
use crate::{
    scenes::scene::shipped_text,
    words::{
        error::Result,
        output::{self, Column},
    },
};

/// Distance that surfaces keep (m).
const THICKNESS: f64 = 0.004;
const PRECISION: Precision = Precision::F32;

/// A measurement of thick cloth.
#[derive(Debug, Serialize)]
pub(super) struct ThickRow {
    #[serde(flatten)]
    row: Row,
    /// Median seconds of a step of the same cloth without a thickness, on as many threads.
    thin_seconds: f64,
    /// The most solves of a sub-step: the median over steps.
    rounds: f64,
    /// Pairs that could meet, and those of them that pushed: medians over steps.
    pairs: f64,
    active: f64,
    /// Median seconds of each stage that takes any.
    stages: BTreeMap<&'static str, f64>,
    state_hash: String,
}

/// What is timed.
struct Case {
    name: &'static str,
    scene: &'static str,
    /// Steps of the scene before those that are timed.
    begun: usize,
}

const CASES: [Case; 3] = [
    Case { name: "thick_hanging", scene: "hanging_sheet", begun: 100 },
    // At the end of its scene the towel lies in folds.
    Case { name: "thick_folded", scene: "towel", begun: 800 },
    Case { name: "thick_pile", scene: "five_sheets", begun: 200 },
];

impl Case {
    /// The world of its scene, all cloth of this thickness (m).
    ///
    /// # Errors
    /// When the scene cannot be built so, which would be an error in this program.
    fn world(&self, thickness: f64) -> Result<WorldSetup> {
        let mut scene = Scene::parse(shipped_text(self.scene)?, self.scene)?;
        for body in &mut scene.bodies {
            body.thickness = thickness;
        }
        Ok(scene.build(&NoMeshes, &SceneLimits::default())?.setup)
    }
}

/// Times so many steps of each case on each of the thread counts.
///
/// # Errors
/// When a run fails.
pub(super) fn rows(threads: &[usize], timed: usize) -> Result<Vec<ThickRow>> {
    let mut rows = Vec::new();
    for case in &CASES {
        output::note(&format!("{}, {PRECISION} ...", case.name));
        let steps = StepCounts { warm_up: case.begun, timed };
        let (thick, thin) = (case.world(THICKNESS)?, case.world(0.0)?);
        let particles: usize = thick.bodies.iter().map(|body| body.network.x.len()).sum();
        let thick = timings::measure(&thick, PRECISION, threads, steps)?;
        let thin = timings::measure(&thin, PRECISION, threads, steps)?;
        rows.extend(thick.iter().zip(&thin).map(|(thick, thin)| thick_row(case, particles, [thick, thin])));
    }
    Ok(rows)
}

fn thick_row(case: &Case, particles: usize, [thick, thin]: [&Timing; 2]) -> ThickRow {
    let seconds = |timing: &Timing| sample::median(timing.samples.iter().map(|sample| sample.seconds));
    let told = |of: fn(&SurfaceReport) -> f64| {
        let of_step = |sample: &Sample| sample.surface.as_ref().map_or(0.0, of);
        sample::median(thick.samples.iter().map(of_step))
    };
    let median_seconds = seconds(thick);
    ThickRow {
        row: Row {
            name: format!("cloth/{}", case.name),
            particles,
            threads: thick.threads,
            precision: PRECISION.name(),
            median_seconds,
            min_seconds: sample::minimum(thick.samples.iter().map(|sample| sample.seconds)),
            rate: 1.0 / median_seconds,
            unit: "steps/s",
        },
        thin_seconds: seconds(thin),
        rounds: told(|surface| f64::from(surface.rounds)),
        pairs: told(|surface| surface.pairs as f64),
        active: told(|surface| surface.active as f64),
        stages: sample::named_stages(&thick.samples),
        state_hash: output::hash(thick.state_hash),
    }
}

/// The rows as a table.
pub(super) fn text(rows: &[ThickRow]) -> String {
    let columns = [
        Column::Left("cloth with a thickness"),
        Column::Right("particles"),
        Column::Right("threads"),
        Column::Right("median"),
        Column::Right("fastest"),
        Column::Right("without"),
        Column::Right("rounds"),
        Column::Right("pairs"),
        Column::Right("that push"),
    ];
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|ThickRow { row, thin_seconds, rounds, pairs, active, .. }| {
            vec![
                row.name.trim_start_matches("cloth/").to_owned(),
                output::count(row.particles as u64),
                row.threads.to_string(),
                output::time(row.median_seconds),
                output::time(row.min_seconds),
                output::time(*thin_seconds),
                format!("{rounds:.0}"),
                output::count(*pairs as u64),
                output::count(*active as u64),
            ]
        })
        .collect();
    format!(
        "{}\n\nA step in {PRECISION} of the scenes hanging_sheet, towel and five_sheets, with a thickness of {} mm and without one; \
         rounds: the most solves of a sub-step.",
        output::table(&columns, &cells),
        1e3 * THICKNESS
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_is_a_scene_that_can_be_stepped_with_a_thickness_and_without() {
        for case in &CASES {
            for thickness in [THICKNESS, 0.0] {
                let setup = case.world(thickness).expect("a shipped scene");
                assert!(!setup.bodies.is_empty(), "{}", case.name);
                assert!(setup.bodies.iter().all(|body| body.network.thickness == thickness), "{}", case.name);
                let steps = StepCounts { warm_up: 0, timed: 1 };
                let timings = timings::measure(&setup, PRECISION, &[1], steps).expect("a stable step");
                assert_eq!(timings[0].samples[0].surface.is_some(), thickness > 0.0, "{}", case.name);
            }
        }
    }
}
