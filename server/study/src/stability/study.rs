//! The study of stability of a scene, part by part.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    math::Precision,
};

use super::{
    expected::Theory,
    ground::Ground,
    limit::Search,
    map::{Map, Mapped, Mapping, hessians},
    modes::Gain,
    order::{order, own, share, share_of},
    probe::{AtRest, Probe},
    row::{Across, Over, StabilityRow},
    stepping,
};
use crate::{
    case::{Case, Times},
    method::{Method, Setting, Steps},
    reference::{Effort, NoReference, chosen},
    run::{Budget, Phase, Runner, Verdict},
};

/// Share of the budget at whose end what runs are judged against is known, or nothing is.
const GROUND: f64 = 0.7;
/// Shares of the seconds that are left then which each part may take.
const REST: f64 = 0.15;
const LOAD: f64 = 0.55;
const STEPPING: f64 = 0.35;
const IMPLICIT_REST: f64 = 0.25;
const AGAIN: f64 = 0.4;
const MAPS: f64 = 0.97;

/// Steps of explicit methods at rest: a damped mode a percent beyond its limit grows by some percents per step, and begins as one of
/// thousands.
const STEPS_AT_REST: u64 = 1000;
/// The same of implicit ones, which are costly and have none.
const IMPLICIT_STEPS_AT_REST: u64 = 200;
/// The longest step tried, times the bound or the scene's own step.
const LONGEST: f64 = 64.0;
/// The shortest, times the bound.
const SHORTEST: f64 = 1e-6;

/// What is asked of a study of stability.
#[derive(Clone, Debug, PartialEq)]
pub struct StabilityRequest {
    /// Error that matters (m).
    pub tolerance: f64,
    /// The end of the scene (s).
    pub end: f64,
    /// Names of methods; empty: all.
    pub methods: Vec<String>,
    /// What is mapped.
    pub maps: Vec<Map>,
    /// Cells along each side of a map.
    pub cells: usize,
    /// The class of effort of the reference and of the fine run; none: the largest that the budget can pay.
    pub effort: Option<Effort>,
}

/// Where methods fail on a scene.
#[derive(Clone, Debug)]
pub struct Stability {
    /// Error that matters (m).
    pub tolerance: f64,
    /// The certified bound on explicit steps (s) at rest, infinite where there is none.
    pub bound: f64,
    /// The class of effort of the reference and of the fine run; none where it came to none.
    pub effort: Option<Effort>,
    /// Until when (s) runs under load are judged at most; 0 where nothing is known.
    pub judged: f64,
    /// What theory says at rest, where it says anything.
    pub theory: Option<Theory>,
    /// The predictability horizon (s) for a displacement of 1e-8 m; 0 where it is not known.
    pub window: f64,
    /// The mean rate (1/s) at which what starts so far apart grows apart until then.
    pub growth_rate: Option<f64>,
    /// Why nothing could be judged under load.
    pub missing: Option<NoReference>,
    /// Runs and limits, in the order of parts, methods and steps.
    pub rows: Vec<StabilityRow>,
    /// Whether anything is not known for want of time.
    pub is_cut: bool,
    /// Whether somebody ended it.
    pub is_stopped: bool,
}

impl Stability {
    /// Limits at rest, or under load.
    pub fn limits(&self, over: Over) -> impl Iterator<Item = &StabilityRow> {
        self.rows.iter().filter(move |row| row.is_limit && row.over == over)
    }

    /// Runs that say nothing of how they were lost: an error of this program.
    pub fn lost(&self) -> impl Iterator<Item = &StabilityRow> {
        self.rows.iter().filter(|row| row.verdict == Verdict::Lost)
    }
}

/// A motion about rest in raw steps (s): whether it is stable.
pub fn probe_at_rest(case: &Case, method: Method, dt: f64, budget: &Budget) -> StabilityRow {
    let (rest, phase) = (case.at_rest(), budget.until(1.0));
    at_rest(&rest, method, dt, &Gain::of(&rest, method, &phase), &phase)
}

/// The scene itself in raw steps (s), judged as limits are.
///
/// # Errors
/// Why there is no fine run to judge by.
pub fn probe_under_load(
    case: &Case,
    method: Method,
    dt: f64,
    request: &StabilityRequest,
    budget: &Budget,
) -> Result<StabilityRow, NoReference> {
    let phase = budget.until(1.0);
    let effort = request.effort.unwrap_or(Effort::DEFAULT);
    let ground = Ground::new(case, request.end, request.tolerance, effort, &phase)?;
    Ok(under_load(case, method, dt, (&ground, request.tolerance), &phase))
}

fn under_load(
    case: &Case,
    method: Method,
    dt: f64,
    (ground, tolerance): (&Ground, f64),
    phase: &Phase,
) -> StabilityRow {
    Probe { case, method, dt, steps: ground.steps(dt), over: Over::Load }.judged(ground, tolerance, phase)
}

fn at_rest(rest: &Case, method: Method, dt: f64, gain: &Gain, phase: &Phase) -> StabilityRow {
    let steps = if method.integrator.is_implicit() { IMPLICIT_STEPS_AT_REST } else { STEPS_AT_REST };
    let probe = Probe { case: rest, method, dt, steps, over: Over::Rest };
    gain.row(probe.row(), steps).unwrap_or_else(|| probe.run(&mut AtRest::new(rest, method), phase))
}

/// Studies a case. `tell` is called with what is done now.
pub fn stability(case: &Case, request: &StabilityRequest, budget: &Budget, tell: &dyn Fn(&str)) -> Stability {
    let rest = case.at_rest();
    let mut study = Stability {
        tolerance: request.tolerance,
        bound: bound(&rest, &budget.until(1.0)),
        effort: request.effort,
        judged: 0.0,
        theory: Theory::of(&rest),
        window: 0.0,
        growth_rate: None,
        missing: None,
        rows: Vec::new(),
        is_cut: false,
        is_stopped: false,
    };
    let wanted = &request.methods;
    let mut methods = Method::studied();
    methods.retain(|method| wanted.is_empty() || wanted.contains(&method.name()));
    let scale = if study.bound.is_finite() { study.bound } else { case.dt() };
    let parts = Parts { case, request, methods, scale };

    match ground(case, request, &budget.until(GROUND), tell) {
        Ok(ground) => {
            (study.window, study.growth_rate) = (ground.window, ground.growth_rate);
            (study.effort, study.judged) = (Some(ground.effort), ground.end());
            parts.all(&rest, Some(&ground), &mut study, &budget.until(1.0), tell);
        }
        Err(missing) => {
            let is_late = matches!(missing, NoReference::Time(_));
            study.missing = Some(missing);
            if is_late {
                // What needs no fine run would take the time that it needs.
                let cut = budget.until(1.0).cut();
                let of_method = |method: &Method| {
                    [Over::Rest, Over::Load].map(|over| StabilityRow::unknown_limit(*method, over, cut))
                };
                study.rows = parts.methods.iter().flat_map(of_method).collect();
            } else {
                parts.all(&rest, None, &mut study, &budget.until(1.0), tell);
            }
        }
    }
    study.is_cut = study.rows.iter().any(|row| row.cut.is_some());
    study.is_stopped = budget.is_stopped();
    study
}

/// What runs under load are judged against, by a class of effort that the phase can pay.
fn ground(
    case: &Case,
    request: &StabilityRequest,
    phase: &Phase,
    tell: &dyn Fn(&str),
) -> Result<Ground, NoReference> {
    tell("measuring the first steps");
    let chosen = chosen(case, request.effort, [request.end, 0.0], phase)?;
    tell(&chosen.told("the predictability horizon, and a fine run of the scene"));
    Ground::new(case, request.end, request.tolerance, chosen.effort, phase)
}

/// The certified bound (s) on steps of symplectic Euler at the start of a case; infinite without one.
fn bound(case: &Case, phase: &Phase) -> f64 {
    let method = Method::new(Integrator::SymplecticEuler, Hessian::Absolute);
    let setting = Setting::new(method, Precision::F64, Steps::Divided(0));
    let runner = Runner::start(case, &setting, &Times::even(case.dt(), 1), phase);
    runner.map_or(f64::INFINITY, |runner| runner.bound())
}

/// What the parts of a study need.
struct Parts<'a> {
    case: &'a Case,
    request: &'a StabilityRequest,
    methods: Vec<Method>,
    /// The bound at rest, or the scene's own step (s).
    scale: f64,
}

impl Parts<'_> {
    /// Every part, those under load where there is something to judge them against. The order of work does not depend on the time
    /// that there is.
    fn all(
        &self,
        rest: &Case,
        ground: Option<&Ground>,
        study: &mut Stability,
        phase: &Phase,
        tell: &dyn Fn(&str),
    ) {
        let (implicit, explicit): (Vec<Method>, Vec<Method>) =
            self.methods.iter().partition(|method| method.integrator.is_implicit());
        self.rest((rest, &explicit), study, &phase.share(REST), tell);
        if let Some(ground) = ground {
            self.load(ground, study, &phase.share(LOAD), tell);
            self.as_run(ground, study, &phase.share(STEPPING), tell);
        }
        // They should have none, and take the longest to show it.
        self.rest((rest, &implicit), study, &phase.share(IMPLICIT_REST), tell);
        let Some(ground) = ground else { return };
        self.again(rest, ground, study, &phase.share(AGAIN), tell);
        // Maps are of raw steps, all of which are refused where bodies have a thickness.
        let maps: &[Map] = if self.case.is_thick() { &[] } else { &self.request.maps };
        for (i, map) in maps.iter().enumerate() {
            tell(&format!("the map over {}", map.name()));
            let left = phase.share(MAPS / (maps.len() - i) as f64);
            let rows = self.mapping(*map, ground, study).make(&left);
            study.rows.extend(rows);
        }
        self.again(rest, ground, study, phase, tell);
    }

    /// The shortest and the longest step (s) that are tried.
    fn range(&self) -> [f64; 2] {
        [SHORTEST * self.scale, LONGEST * self.scale.max(self.case.dt())]
    }

    /// From which step (s) on a limit is looked for: of implicit methods the longest, since they should have none.
    fn start(&self, method: Method) -> f64 {
        if method.integrator.is_implicit() { self.range()[1] } else { self.scale }
    }

    fn rest(
        &self,
        (rest, methods): (&Case, &[Method]),
        study: &mut Stability,
        phase: &Phase,
        tell: &dyn Fn(&str),
    ) {
        let mut found = vec![Vec::new(); methods.len()];
        for (i, place) in order(self.case, methods).into_iter().enumerate() {
            let method = methods[place];
            tell(&format!("limit of {} at rest", method.name()));
            let share = phase.share(share_of(self.case, method, methods.len() - i));
            found[place] = self.limit_at_rest(rest, method, study, &share);
        }
        study.rows.extend(found.into_iter().flatten());
    }

    fn limit_at_rest(
        &self,
        rest: &Case,
        method: Method,
        study: &Stability,
        phase: &Phase,
    ) -> Vec<StabilityRow> {
        let theory = study.theory.as_ref().and_then(|theory| theory.limit(method.integrator));
        let gain = Gain::of(rest, method, phase);
        let mut run =
            |dt: f64, phase: &Phase| StabilityRow { theory, ..at_rest(rest, method, dt, &gain, phase) };
        let search = Search { run: &mut run, rows: Vec::new(), range: self.range() };
        search.find(self.start(method), phase)
    }

    fn load(&self, ground: &Ground, study: &mut Stability, phase: &Phase, tell: &dyn Fn(&str)) {
        let mut found = vec![Vec::new(); self.methods.len()];
        for (i, place) in order(self.case, &self.methods).into_iter().enumerate() {
            let method = self.methods[place];
            tell(&format!("limit of {} under load", method.name()));
            let share = phase.share(share_of(self.case, method, self.methods.len() - i));
            found[place] = self.limit_under_load(ground, method, &share);
        }
        study.rows.extend(found.into_iter().flatten());
    }

    fn limit_under_load(&self, ground: &Ground, method: Method, phase: &Phase) -> Vec<StabilityRow> {
        let against = (ground, self.request.tolerance);
        let mut run = |dt: f64, phase: &Phase| under_load(self.case, method, dt, against, phase);
        let search = Search { run: &mut run, rows: Vec::new(), range: self.range() };
        let mut rows = search.find(self.start(method), phase);
        if let Some(mut limit) = rows.pop_if(|row| row.verdict == Verdict::Wrong) {
            let search = Search { run: &mut run, rows: Vec::new(), range: [1e-3 * self.scale, limit.dt] };
            let (right, longest) = search.find_right(limit.dt, phase);
            limit.right = longest;
            limit.cut = longest.is_none().then(|| phase.cut());
            rows.extend(right.into_iter().chain([limit]));
        }
        rows
    }

    /// Looks again for limits that were cut, with the time that others left over.
    fn again(&self, rest: &Case, ground: &Ground, study: &mut Stability, phase: &Phase, tell: &dyn Fn(&str)) {
        let cut = study.rows.iter().filter(|row| row.is_limit && row.cut.is_some());
        let mut cut: Vec<(Method, Over)> = cut.map(|row| (row.method, row.over)).collect();
        // Explicit Euler often bears no step at all, which takes the longest to show.
        cut.sort_by_key(|(method, _)| method.integrator == Integrator::ExplicitEuler);
        for (method, over) in cut {
            if phase.is_over() {
                return;
            }
            tell(&format!("limit of {}, with the time that is left", method.name()));
            // Rather some that are known than all of them cut again.
            let share = phase.share(0.5);
            let rows = match over {
                Over::Rest => self.limit_at_rest(rest, method, study, &share),
                Over::Load | Over::Scene => self.limit_under_load(ground, method, &share),
            };
            let is_its = |row: &StabilityRow| row.method == method && row.over == over;
            let place = study.rows.iter().position(is_its).unwrap_or(study.rows.len());
            study.rows.retain(|row| !is_its(row));
            study.rows.splice(place..place, rows);
        }
    }

    fn as_run(&self, ground: &Ground, study: &mut Stability, phase: &Phase, tell: &dyn Fn(&str)) {
        tell("every method as the program runs it");
        let mut found = vec![Vec::new(); self.methods.len()];
        for (i, place) in order(self.case, &self.methods).into_iter().enumerate() {
            let method = self.methods[place];
            let of_method = phase.share(share_of(self.case, method, self.methods.len() - i));
            for (j, times) in stepping::TIMES.into_iter().enumerate() {
                let share = of_method.share(share(stepping::TIMES.len() - j));
                let against = (ground, self.request.tolerance);
                found[place].push(stepping::run(self.case, method, times, against, &share));
            }
        }
        study.rows.extend(found.into_iter().flatten());
    }

    fn mapping<'a>(&'a self, map: Map, ground: &'a Ground, study: &Stability) -> Mapping<'a> {
        let explicit = [self.scale / 16.0, 4.0 * self.scale];
        let implicit = [self.scale / 4.0, self.range()[1]];
        let with_range = |method: Method| Mapped {
            method,
            range: if method.integrator.is_implicit() { implicit } else { explicit },
        };
        let (across, methods) = match map {
            Map::Damping => {
                let mut methods: Vec<Method> =
                    own(self.case).into_iter().chain([best_explicit(study)]).collect();
                methods.dedup_by_key(|method| method.name());
                (self.case.damping_axis(), methods)
            }
            Map::Compression => (Across::Compression, hessians().collect()),
        };
        Mapping {
            case: self.case,
            ground,
            across,
            methods: methods.into_iter().map(with_range).collect(),
            cells: self.request.cells,
            tolerance: self.request.tolerance,
            end: self.request.end,
        }
    }
}

/// The explicit method that bears the longest step under load; velocity Verlet where none was found.
fn best_explicit(study: &Stability) -> Method {
    let explicit = study.limits(Over::Load).filter(|row| !row.method.integrator.is_implicit());
    let best = explicit.filter_map(|row| Some((row.limit?, row.method)));
    best.max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(Method::new(Integrator::VelocityVerlet, Hessian::Absolute), |(_, method)| method)
}
