//! All cloths of a world that are awake, stepped together: they share sub-steps, and none goes on before all have accepted one.

use std::sync::Arc;

use super::{division::Division, pace::Pace};
use crate::{
    collide::Moved,
    math::Real,
    report::{
        BoundKind, ClothSteps, ErrorEstimate, Rejection, StepFailure, StepReport, Stopwatch, TimeBound,
    },
    sub_step::SubStep,
    surroundings::Surroundings,
    time_step::TimeStep,
    world::body::{Body, cloth::Cloth},
};

/// Sub-steps of the cloths in one step of the world, at most.
const MAX_SUBSTEPS: u32 = 10_000;

/// The index of a body, and why its step cannot be taken.
pub(crate) type Failure = (usize, StepFailure);

/// Takes a step of the world with all cloths among the bodies that are awake, and adds to its report.
///
/// # Errors
/// Of the first body whose step cannot be taken.
pub(crate) fn step<R: Real>(
    bodies: &mut [Body<R>],
    pace: &mut Pace,
    around: &Surroundings<'_>,
    report: &mut StepReport,
    watch: &mut dyn Stopwatch,
) -> Result<(), Failure> {
    let asked = asked(bodies, around);
    if asked.is_infinite() {
        return Ok(());
    }
    if cloths(bodies).next().is_none() {
        report.cloth = Some(none_taken(asked));
        return Ok(());
    }

    for (_, cloth) in cloths(bodies) {
        cloth.sort_pins();
        cloth.stepping(around).begin();
        cloth.stepping(around).aim();
    }
    let (mut division, mut moved) = (Division::of(around.dt), Moved::of(around.colliders));
    let (mut substeps, mut rejected) = (0, 0);
    let mut next = shortest(bodies, pace, asked, around, watch)?;
    let dt = loop {
        division.fit(pace.length(around.dt, asked, next.certified).min(asked));
        // What bounds ask for, not what is held since they asked for more.
        let needed = TimeStep::divide(division.dt() * division.left(), next.bound.dt.min(asked));
        if f64::from(substeps) + needed > f64::from(MAX_SUBSTEPS) {
            return Err(next.too_many(bodies));
        }

        let dt = division.dt();
        let sub_step = SubStep { dt, end: around.time + division.end() };
        let colliders = moved.over(around.colliders, sub_step);
        match attempt(bodies, &Surroundings { colliders, ..*around }, sub_step, watch) {
            Ok(strain) => {
                for (index, cloth) in cloths(bodies) {
                    cloth.stepping(around).settle(watch).map_err(|failure| (index, failure))?;
                }
                division.go_on();
                substeps += 1;
                pace.accept(dt, strain, || division.is_even());
                if !division.is_done() {
                    cloths(bodies).for_each(|(_, cloth)| cloth.stepping(around).aim());
                }
            }
            Err((index, failure)) => {
                cloths(bodies).for_each(|(_, cloth)| cloth.stepping(around).abandon());
                if !can_shorten(&bodies[index], &failure, pace, [dt, asked]) {
                    return Err((index, failure));
                }
                rejected += 1;
                report.rejections.push(rejection(&bodies[index], sub_step, failure));
            }
        }
        next = shortest(bodies, pace, asked, around, watch)?;
        if division.is_done() {
            break dt;
        }
    };

    let (mut error, mut without_history, mut solves) = (ErrorEstimate::default(), 0, 0);
    for index in 0..bodies.len() {
        if let Some(cloth) = bodies[index].as_cloth_mut().filter(|cloth| cloth.is_awake()) {
            let told = cloth.stepping(around).finish(watch).map_err(|failure| (index, failure))?;
            cloth.told(&told).add_to(report);
            if let Some(loads) = Arc::get_mut(&mut report.loads) {
                cloth.stepping(around).add_to(loads);
            }
            (error, without_history) = (error.max(told.error), without_history + told.without_history);
            solves = solves.max(told.solves);
        }
    }
    count_failed(report);
    let (bound, preconditioner) = (next.shifted(bodies, asked), report.solve.and_then(|s| s.preconditioner));
    let steps = ClothSteps { substeps, rejected, without_history, solves, dt, bound, error, preconditioner };
    report.cloth = Some(steps);
    Ok(())
}

/// The least sub-step (s) that cloths ask for. What sleeps counts: a step is divided alike whatever does.
fn asked<R: Real>(bodies: &[Body<R>], around: &Surroundings<'_>) -> f64 {
    bodies.iter().filter_map(Body::as_cloth).map(|cloth| cloth.asked(around)).fold(f64::INFINITY, f64::min)
}

/// Counts the sub-steps that contact did not let through.
fn count_failed(report: &mut StepReport) {
    if let Some(surface) = &mut report.surface {
        let cut = |rejection: &&Rejection| {
            matches!(rejection.cause, StepFailure::Contact { .. } | StepFailure::Crowded { .. })
        };
        surface.failed = report.rejections.iter().filter(cut).count() as u64;
    }
}

/// The cloths that are awake, with their places among the bodies.
fn cloths<R: Real>(bodies: &mut [Body<R>]) -> impl Iterator<Item = (usize, &mut Cloth<R>)> {
    let all = bodies.iter_mut().enumerate();
    let cloths = all.filter_map(|(index, body)| Some((index, body.as_cloth_mut()?)));
    cloths.filter(|(_, cloth)| cloth.is_awake())
}

/// What is told of a step, for which the scene asks for sub-steps of `asked` (s), where all sleep.
fn none_taken(asked: f64) -> ClothSteps {
    ClothSteps {
        substeps: 0,
        rejected: 0,
        without_history: 0,
        solves: 0,
        dt: asked,
        bound: TimeBound { kind: BoundKind::Frame, dt: asked, particle: None },
        error: ErrorEstimate::default(),
        preconditioner: None,
    }
}

/// The shortest sub-step that a body or the pace asks for.
struct Shortest {
    /// Particles of the body.
    bound: TimeBound,
    body: usize,
    /// The least that certified steps are allowed (s).
    certified: f64,
}

impl Shortest {
    /// The failure of a step that would need too many sub-steps.
    fn too_many<R: Real>(&self, bodies: &[Body<R>]) -> Failure {
        let TimeBound { kind, dt, particle } = self.bound;
        let is_of_laws = matches!(kind, BoundKind::Stiffness | BoundKind::Damping);
        let law = particle
            .filter(|_| is_of_laws)
            .and_then(|own| bodies[self.body].as_cloth()?.bounding_law(own as u32));
        let particle = particle.unwrap_or_default();
        (self.body, StepFailure::Substeps { particle, dt, limit: MAX_SUBSTEPS, bound: kind, law })
    }

    /// The bound with particles over all bodies: where there is none, what the scene asks for (s).
    fn shifted<R: Real>(&self, bodies: &[Body<R>], asked: f64) -> TimeBound {
        let TimeBound { kind, dt, particle } = self.bound;
        let dt = if dt.is_finite() { dt } else { asked };
        TimeBound { kind, dt, particle: particle.map(|own| bodies[self.body].of_all(own)) }
    }
}

fn shortest<R: Real>(
    bodies: &mut [Body<R>],
    pace: &Pace,
    asked: f64,
    around: &Surroundings<'_>,
    watch: &mut dyn Stopwatch,
) -> Result<Shortest, Failure> {
    let mut least = Shortest { bound: pace.bound(asked), body: 0, certified: f64::INFINITY };
    for (body, cloth) in cloths(bodies) {
        let bound = cloth.stepping(around).bound(watch).map_err(|failure| (body, failure))?;
        if bound.kind != BoundKind::Fixed {
            least.certified = least.certified.min(bound.dt);
        }
        if bound.dt < least.bound.dt {
            (least.bound, least.body) = (bound, body);
        }
    }
    Ok(least)
}

/// Tries a sub-step with every cloth; returns the largest strain.
fn attempt<R: Real>(
    bodies: &mut [Body<R>],
    around: &Surroundings<'_>,
    sub_step: SubStep,
    watch: &mut dyn Stopwatch,
) -> Result<Option<f64>, Failure> {
    // Of all before any: who fails has all of them return.
    cloths(bodies).for_each(|(_, cloth)| cloth.stepping(around).begin_substep());
    let mut largest = None;
    for (index, cloth) in cloths(bodies) {
        cloth.stepping(around).attempt(sub_step, watch).map_err(|failure| (index, failure))?;
        largest = cloth.strain().into_iter().chain(largest).reduce(f64::max);
    }
    Ok(largest)
}

/// Whether a sub-step of `dt` (s), of which the scene asks for `asked` (s), is to be taken again shorter.
fn can_shorten<R: Real>(
    body: &Body<R>,
    failure: &StepFailure,
    pace: &mut Pace,
    [dt, asked]: [f64; 2],
) -> bool {
    let Some(cloth) = body.as_cloth() else { return false };
    let is_given_up = matches!(failure, StepFailure::Interrupted | StepFailure::PairMemory { .. });
    if is_given_up || cloth.is_unchecked() {
        return false;
    }
    let strain = cloth.strain().filter(|_| matches!(failure, StepFailure::Inaccurate { .. }));
    pace.reject(dt, asked, strain)
}

fn rejection<R: Real>(body: &Body<R>, sub_step: SubStep, failure: StepFailure) -> Rejection {
    let name = body.name_for(&failure).to_owned();
    Rejection {
        time: sub_step.start(),
        dt: sub_step.dt,
        body: name,
        cause: failure.renumbered(|own| body.of_all(own)),
    }
}
