//! The chart of a scene of snow: as long as the budget allows, a reference on halved cells, and rows of every transfer with every
//! kernel against it.

use nappe_sim::{
    math::Precision,
    snow::{Kernel, SnowSettings, SnowSetup},
    time_step::TimeStep,
};

use super::{
    front,
    of_cloth::{Chart, Limit, REFERENCE, fits},
    request::Request,
    row::Row,
    timing,
};
use crate::{
    case::{Case, Times},
    method::{SnowSetting, SnowSteps, Variant, variants},
    quantity::length,
    reference::{COST, Effort, F64_COST, NoReference, Reference, Scan, chosen_of_snow, halved},
    run::{Budget, End, Phase, run, run_within},
};

/// Shares of the budget at whose end each part is over.
const ROWS: f64 = 0.85;
const AGAIN: f64 = 0.98;
/// Shares of the certified bound that steps of rows have.
const SHARES: [f64; 2] = [TimeStep::SAFETY, 0.5 * TimeStep::SAFETY];
/// Cells of rows, times those of the scene.
const CELLS: [f64; 2] = [1.0, 2.0];
/// How many times as long a step by the cubic kernel takes as one by the quadratic.
pub(crate) const CUBIC: f64 = 1.6;

/// Names of all transfers with kernels that the snow of a scene is compared by.
pub(crate) fn names(snow: &SnowSetup) -> Vec<String> {
    variants(&snow.settings).into_iter().map(Variant::name).collect()
}

/// Charts the snow of a case. `tell` is called with what is done now.
pub(crate) fn of_snow(
    case: &Case,
    snow: &SnowSetup,
    request: &Request,
    budget: &Budget,
    tell: &dyn Fn(&str),
) -> Chart {
    let settings = settings(snow, request);
    // Copies that start almost alike tell nothing that halved cells do not.
    let mut chart = Chart::new(case, request, Limit::Scene, Scan::nothing(case));
    let phase = budget.until(REFERENCE);
    let left = phase.left();
    if let Err(missing) = compare(&mut chart, (case, snow), request, &phase, tell) {
        chart.is_cut = true;
        chart.missing = Some(missing);
    }
    chart.fits = chart.missing.as_ref().and_then(|missing| fits(case, request, missing, left));
    add_rows(&mut chart, case, snow, &settings, &budget.until(ROWS), tell);
    front::mark(&mut chart.rows, chart.floor);
    if let Some(reference) = &chart.reference {
        tell("timing the best rows again, in turn");
        timing::again(case, &mut chart.rows, &reference.times, &budget.until(AGAIN));
        front::mark(&mut chart.rows, chart.floor);
    }
    chart.is_stopped = budget.is_stopped();
    chart
}

/// Chooses a class of effort, and looks for the reference and for the times at which runs are compared.
///
/// # Errors
/// Time was over before there was anything to compare with.
fn compare(
    chart: &mut Chart,
    (case, snow): (&Case, &SnowSetup),
    request: &Request,
    phase: &Phase,
    tell: &dyn Fn(&str),
) -> Result<(), NoReference> {
    tell("measuring the first steps");
    let asked = request.times.as_ref().map(Times::end);
    let ends = [asked.unwrap_or(request.end), asked.unwrap_or(0.0)];
    let chosen = chosen_of_snow((case, snow), request.effort, ends, phase)?;
    chart.effort = Some(chosen.effort);
    tell(&chosen.told("the scene as it is written"));
    let (times, limit) = window((case, snow), request, chosen.effort, phase).map_err(NoReference::Time)?;
    chart.limit = limit;
    if times.count() > 0 {
        tell(&chosen.told("computing the reference on halved cells"));
        chart.take(halved(case, &times, chosen.effort, phase), &times);
    }
    Ok(())
}

impl Chart {
    /// Takes over a reference that was looked for at some times.
    fn take(&mut self, reference: Result<Reference, NoReference>, times: &Times) {
        match reference {
            Ok(found) => {
                if found.times != *times {
                    self.limit = Limit::Reference;
                }
                self.floor = found.error();
                self.scan.step = found.step;
                self.whole = Some(found.clone());
                self.reference = Some(found);
            }
            Err(missing) => {
                self.is_cut |= matches!(missing, NoReference::Time(_));
                self.missing = Some(missing);
            }
        }
    }
}

/// The settings of all rows, in the order of a chart. A period of an odd number of blocks has no cells twice as long.
fn settings(snow: &SnowSetup, request: &Request) -> Vec<SnowSetting> {
    let is_even = snow.settings.periodic.iter().all(|blocks| blocks.is_multiple_of(2));
    let is_wanted = |name: &String| request.methods.is_empty() || request.methods.contains(name);
    let mut settings = Vec::new();
    for variant in variants(&snow.settings).into_iter().filter(|variant| is_wanted(&variant.name())) {
        for ratio in CELLS.into_iter().filter(|ratio| *ratio == 1.0 || is_even) {
            for &precision in &request.precisions {
                let cell = ratio * snow.settings.cell;
                let steps = SHARES.map(SnowSteps::Share);
                settings.extend(steps.map(|steps| SnowSetting {
                    variant,
                    precision,
                    cell,
                    steps,
                    halvings: 0,
                }));
            }
        }
    }
    settings
}

/// How long a run by a setting takes, next to one by the quadratic kernel in f32 on the cells of the scene at the bound.
fn cost(setting: &SnowSetting, scene: &SnowSettings) -> f64 {
    let share = match (setting.steps, scene.time_step) {
        (SnowSteps::Share(share), _) => share,
        (SnowSteps::Own, TimeStep::Certified { safety }) => safety,
        (SnowSteps::Own, TimeStep::Fixed(_) | TimeStep::Unchecked(_)) => TimeStep::SAFETY,
    };
    let precision = if setting.precision == Precision::F64 { F64_COST } else { 1.0 };
    let kernel = if setting.variant.kernel == Kernel::Cubic { CUBIC } else { 1.0 };
    precision * kernel * scene.cell / (setting.cell * share)
}

/// The times at which runs are compared, and what ends them: those that were asked for, or as many steps of the scene as a
/// reference on cells half as long makes with the work that its effort allows.
///
/// # Errors
/// Time was over; about how many seconds the reference takes.
fn window(
    (case, snow): (&Case, &SnowSetup),
    request: &Request,
    effort: Effort,
    phase: &Phase,
) -> Result<(Times, Limit), f64> {
    if let Some(times) = &request.times {
        return Ok((times.clone(), Limit::Asked));
    }
    let steps = (request.end / case.dt()).round() as u64;
    let own = SnowSetting::own(snow, case.precision, 0);
    let last = Times { interval: case.dt(), marks: vec![steps] };
    let most = (effort.of_snow() as f64 / (COST * case.particle_count() as f64)) as u64;
    let made = run_within(case, (&own).into(), &last, phase, most);
    let limit = match &made.end {
        End::Reached => Limit::Scene,
        End::Failed(failure) => Limit::Failed(failure.cause.clone()),
        End::Cut(_) | End::Costly if made.work.force_evaluations > most => Limit::Work,
        End::Cut(_) | End::Costly => {
            let share = made.work.force_evaluations as f64 / most as f64;
            return Err(if share > 0.0 { COST * made.elapsed / share } else { f64::INFINITY });
        }
    };
    Ok((Times::of_first(made.seconds.len() as u64, case.dt()), limit))
}

/// Adds the scene as it is written, and the rows of all settings, what is cheap first.
fn add_rows(
    chart: &mut Chart,
    case: &Case,
    snow: &SnowSetup,
    settings: &[SnowSetting],
    phase: &Phase,
    tell: &dyn Fn(&str),
) {
    let Some(reference) = chart.reference.clone() else { return };
    let places: Vec<usize> = (0..reference.states.len()).collect();
    let own = SnowSetting::own(snow, case.precision, 0);
    let made = run(case, &own, &reference.times, phase);
    let mut rows = vec![(0, Row::new(case, &own, &made, (&reference, &places)))];
    let second = made.elapsed / cost(&own, &snow.settings);

    let mut order: Vec<usize> = (0..settings.len()).collect();
    order.sort_by(|a, b| {
        let [a, b] = [a, b].map(|place| cost(&settings[*place], &snow.settings));
        a.total_cmp(&b)
    });
    for place in order {
        let setting = &settings[place];
        if phase.is_over() || second * cost(setting, &snow.settings) > phase.left() {
            chart.is_cut = true;
            continue;
        }
        let (name, precision) = (setting.variant.name(), setting.precision);
        tell(&format!("{name} {precision}, cells of {}", length(setting.cell)));
        let made = run(case, setting, &reference.times, phase);
        rows.push((place + 1, Row::new(case, setting, &made, (&reference, &places))));
    }
    rows.sort_by_key(|(place, _)| *place);
    for (_, mut row) in rows {
        chart.is_cut |= row.end.cut().is_some();
        row.mark_below(chart.floor);
        chart.rows.push(row);
    }
}
