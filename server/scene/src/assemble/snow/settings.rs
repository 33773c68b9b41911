//! How the snow of a scene is stepped: its keys checked against each other.

use nappe_sim::{
    linalg::Stop,
    math::number,
    snow::{Advection, Blend, Integration, Kernel, SnowSettings, Transfer},
    time_step::TimeStep,
};

use crate::{
    error::{ErrorKind, SceneError},
    location::Location,
    snow::{AdvectionName, Snow, TransferName},
};

/// The share of FLIP of a scene that names none (Stomakhin et al. 2013).
const FLIP: f64 = 0.95;

/// Settings for the simulation.
pub(crate) fn settings(snow: &Snow, at: &Location<'_>) -> Result<SnowSettings, SceneError> {
    if snow.kernel == Kernel::Linear && snow.transfer != TransferName::PicFlip {
        return at.key("kernel").inconsistent("is 'linear', which works only with transfer = \"pic_flip\" and is there to show how it fails; allowed here: quadratic, cubic",
        );
    }

    if snow.kernel == Kernel::Linear && snow.beta > 0.0 {
        return at.key("beta").inconsistent("does not go with kernel = \"linear\"; allowed here: 0");
    }
    Ok(SnowSettings {
        kernel: snow.kernel,
        transfer: transfer(snow, at)?,
        advection: match snow.advection {
            None | Some(AdvectionName::Particle) => Advection::Particle,
            Some(AdvectionName::Grid) => Advection::Grid,
        },
        time_step: time_step(snow, at)?,
        integration: integration(snow, at)?,
        max_substeps: snow.max_substeps,
        ballistic_below: snow.ballistic_below,
        max_energy: snow.max_energy,
        drag: snow.drag,
        ..SnowSettings::new(snow.cell)
    })
}

fn transfer(snow: &Snow, at: &Location<'_>) -> Result<Transfer, SceneError> {
    let affine = match snow.transfer {
        TransferName::PicFlip => {
            return match (snow.flip, snow.flip_time) {
                (Some(_), Some(_)) => {
                    at.key("flip_time").inconsistent("does not go with flip: one of them is needed")
                }
                (share, None) => Ok(Transfer::PicFlip(Blend::PerStep(share.unwrap_or(FLIP)))),
                (None, Some(time)) => Ok(Transfer::PicFlip(Blend::TimeConstant(time))),
            };
        }
        TransferName::Apic => Transfer::Apic,
        TransferName::Mls => Transfer::Mls,
    };

    let given = [
        ("flip", snow.flip.is_some()),
        ("flip_time", snow.flip_time.is_some()),
        ("advection", snow.advection.is_some()),
    ];
    for (key, given) in given {
        if given {
            let message = format!(
                "works only with transfer = \"pic_flip\"; the transfer here is \"{}\"",
                affine.name()
            );
            return at.key(key).inconsistent(message);
        }
    }

    Ok(affine)
}

fn time_step(snow: &Snow, at: &Location<'_>) -> Result<TimeStep, SceneError> {
    match (snow.safety, snow.substep, snow.unchecked) {
        (Some(_), Some(_), _) => at
            .key("safety")
            .inconsistent("does not go with substep: a fixed step takes no share of the bound"),
        (_, None, true) => {
            at.key("unchecked").inconsistent("is for a fixed step: give its length, substep = seconds")
        }
        (None, Some(dt), true) => Ok(TimeStep::Unchecked(dt)),
        (None, Some(dt), false) => Ok(TimeStep::Fixed(dt)),
        (safety, None, false) => Ok(TimeStep::Certified { safety: safety.unwrap_or(TimeStep::SAFETY) }),
    }
}

fn integration(snow: &Snow, at: &Location<'_>) -> Result<Integration, SceneError> {
    if snow.beta == 0.0 {
        return match snow.solver {
            Some(_) => at.key("solver").inconsistent("is for a semi-implicit step: give beta, 0.5 to 1"),
            None => Ok(Integration::Explicit),
        };
    }

    let least = Integration::LEAST_BETA;
    if snow.beta < least {
        let message = format!(
            "is {}; allowed: 0, or {least} to 1: below {least} elastic waves bound the step as they bound an explicit one",
            number(snow.beta)
        );
        return Err(at.key("beta").error(ErrorKind::OutOfRange, message));
    }

    let solver = snow.solver.unwrap_or_default();
    let stop = Stop::Residual { tolerance: solver.tolerance, max_iterations: solver.max_iterations };
    Ok(Integration::SemiImplicit { beta: snow.beta, stop })
}
