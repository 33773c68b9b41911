//! How a body is stepped: how its implicit steps are solved, and how steps of the scene are divided.
//!
//! Reads the keys of a body; writes the settings of its cloth.

use nappe_sim::{
    cloth::{
        ClothSettings, Minimizer, MinimizerKind, NewtonSettings, OnPass, RestSettings, StateLimits,
        SurfaceSettings,
    },
    linalg::{AtCap, SolverSettings, Stop},
    time_step::TimeStep,
};

use crate::{
    body::Body,
    error::{ErrorKind, SceneError},
    location::Location,
};

/// The settings of the body at `at`, in steps of the scene of `dt` (s), whose surface meets others so, and whose pieces are calm by
/// these rules.
///
/// # Errors
/// Keys that do not go with each other, at the first of them.
pub(super) fn settings(
    body: &Body,
    at: &Location<'_>,
    dt: f64,
    contact: SurfaceSettings,
    rest: Option<RestSettings>,
) -> Result<ClothSettings, SceneError> {
    let solver = at.key("solver");
    let minimizer = minimizer(body, at)?;
    let stop = match (body.solver.fixed_iterations, body.solver.tolerance, body.solver.max_iterations) {
        (Some(count), None, None) => Stop::Iterations(count),
        (Some(_), Some(_), _) => {
            return solver.key("tolerance").inconsistent("does not go with fixed_iterations");
        }
        (Some(_), _, Some(_)) => {
            return solver.key("max_iterations").inconsistent("does not go with fixed_iterations");
        }
        (None, tolerance, cap) => {
            let Stop::Residual { tolerance: default_tolerance, max_iterations } = minimizer.default_stop()
            else {
                return solver.inconsistent("has no default tolerance");
            };
            Stop::Residual {
                tolerance: tolerance.unwrap_or(default_tolerance),
                max_iterations: cap.unwrap_or(max_iterations),
            }
        }
    };

    if !body.block_size.is_power_of_two() {
        let message = format!("is {}; allowed: a power of two, 32 to 4096", body.block_size);
        return Err(at.key("block_size").error(ErrorKind::OutOfRange, message));
    }

    Ok(ClothSettings {
        integrator: body.integrator,
        minimizer,
        hessian: body.hessian,
        solver: SolverSettings {
            stop,
            preconditioner: body.solver.preconditioner,
            at_cap: AtCap::default(),
            operator: body.solver.operator,
            warm_start: body.solver.warm_start,
            floor: 0.0,
        },
        time_step: time_step(body, at, dt)?,
        tolerance: body.tolerance,
        on_pass: body.on_pass,
        contact,
        limits: StateLimits { max_stretch: body.limits.max_stretch, max_energy: body.limits.max_energy },
        rest,
        block_size: body.block_size,
    })
}

/// How an implicit step is solved.
fn minimizer(body: &Body, at: &Location<'_>) -> Result<Minimizer, SceneError> {
    let Body { minimizer, accuracy, newton_tolerance, newton_iterations, sweeps, integrator, .. } = body;
    let is_for_any = matches!(minimizer, MinimizerKind::Auto | MinimizerKind::OneStep);
    if !is_for_any && !integrator.is_implicit() {
        let message = format!("is for implicit integrators, and '{}' is explicit", integrator.name());
        return at.key("minimizer").inconsistent(message);
    }
    let keys = [
        ("accuracy", accuracy.is_some(), MinimizerKind::Auto),
        ("newton_tolerance", newton_tolerance.is_some(), MinimizerKind::Newton),
        ("newton_iterations", newton_iterations.is_some(), MinimizerKind::Newton),
        ("sweeps", sweeps.is_some(), MinimizerKind::VertexBlockDescent),
    ];
    if let Some((key, _, kind)) = keys.into_iter().find(|(_, given, kind)| *given && kind != minimizer) {
        return at.key(key).inconsistent(format!("is for minimizer = \"{}\"", kind.name()));
    }

    let defaults = NewtonSettings::default();
    Ok(match minimizer {
        MinimizerKind::Auto => Minimizer::Auto { accuracy: self::accuracy(body, at)? },
        MinimizerKind::OneStep => Minimizer::OneStep,
        MinimizerKind::Newton => Minimizer::Newton(NewtonSettings {
            tolerance: newton_tolerance.unwrap_or(defaults.tolerance),
            max_iterations: newton_iterations.unwrap_or(defaults.max_iterations),
        }),
        MinimizerKind::VertexBlockDescent => {
            Minimizer::VertexBlockDescent { sweeps: sweeps.unwrap_or(Minimizer::DEFAULT_SWEEPS) }
        }
    })
}

/// How much a fall may lack of what a solve promised; refused where no step goes on that lacks more.
fn accuracy(body: &Body, at: &Location<'_>) -> Result<f64, SceneError> {
    let Some(accuracy) = body.accuracy else { return Ok(Minimizer::DEFAULT_ACCURACY) };
    let key = at.key("accuracy");
    if !body.integrator.is_implicit() {
        let name = body.integrator.name();
        return key.inconsistent(format!("is for implicit integrators, and '{name}' is explicit"));
    }
    if body.unchecked {
        return key.inconsistent("does not go with unchecked: such steps make one linear solve");
    }
    if body.thickness > 0.0 {
        return key.inconsistent("does not go with a thickness: its solves end where surfaces are apart");
    }
    Ok(accuracy)
}

/// How steps of the scene are divided, which are of `dt` (s).
fn time_step(body: &Body, at: &Location<'_>, dt: f64) -> Result<TimeStep, SceneError> {
    let Body { substeps, substep, safety, unchecked, tolerance, on_pass, .. } = body;
    let is_fixed = substeps.is_some() || substep.is_some();
    if substeps.is_some() && substep.is_some() {
        return at
            .key("substep")
            .inconsistent("does not go with substeps: one gives their length, one their number");
    }
    if safety.is_some() && (is_fixed || *unchecked) {
        return at.key("safety").inconsistent(
            "is for steps by the certified bound: it does not go with substeps, substep or unchecked",
        );
    }
    if tolerance.is_some() && *unchecked {
        return at
            .key("tolerance")
            .inconsistent("does not go with unchecked: such steps are never taken again");
    }

    if *on_pass == OnPass::Reject && *unchecked {
        return at.key("on_pass").inconsistent(
            "is \"reject\", which does not go with unchecked: such steps are never taken again",
        );
    }

    let length = substep.unwrap_or_else(|| dt / f64::from(substeps.unwrap_or(1)));
    Ok(match (*unchecked, is_fixed) {
        (true, _) => TimeStep::Unchecked(length),
        (false, true) => TimeStep::Fixed(length),
        (false, false) => TimeStep::Certified { safety: safety.unwrap_or(TimeStep::SAFETY) },
    })
}
