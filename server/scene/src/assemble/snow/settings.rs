//! How the snow of a scene is stepped: its fields held against each other.

use nappe_sim::{
    linalg::Stop,
    snow::{Advection, Blend, Integration, Kernel, SnowSettings, TimeStep, Transfer},
};

use crate::{
    error::SceneError,
    location::Place,
    snow::{AdvectionName, Snow, TransferName},
};

/// The share of FLIP of a scene that names none (Stomakhin et al. 2013).
const FLIP: f64 = 0.95;

/// Settings for the simulation.
pub(crate) fn settings(snow: &Snow, place: &Place<'_>) -> Result<SnowSettings, SceneError> {
    if snow.kernel == Kernel::Linear && snow.transfer != TransferName::PicFlip {
        return place.clash(
            "kernel",
            "is 'linear', which goes with transfer = \"pic_flip\" alone: it is here to show how it fails; allowed here: quadratic, cubic",
        );
    }
    if snow.kernel == Kernel::Linear && snow.beta > 0.0 {
        return place.clash("beta", "does not go with kernel = \"linear\"; allowed here: 0");
    }
    Ok(SnowSettings {
        kernel: snow.kernel,
        transfer: transfer(snow, place)?,
        advection: match snow.advection {
            None | Some(AdvectionName::Particle) => Advection::Particle,
            Some(AdvectionName::Grid) => Advection::Grid,
        },
        time_step: time_step(snow, place)?,
        integration: integration(snow, place)?,
        max_substeps: snow.max_substeps,
        ballistic_below: snow.ballistic_below,
        max_energy: snow.max_energy,
        ..SnowSettings::new(snow.cell)
    })
}

fn transfer(snow: &Snow, place: &Place<'_>) -> Result<Transfer, SceneError> {
    let affine = match snow.transfer {
        TransferName::PicFlip => {
            return match (snow.flip, snow.flip_time) {
                (Some(_), Some(_)) => {
                    place.clash("flip_time", "does not go with flip: one of them is needed")
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
    for (field, given) in given {
        if given {
            let message = format!(
                "goes with transfer = \"pic_flip\" alone; the transfer here is \"{}\"",
                affine.name()
            );
            return place.clash(field, message);
        }
    }
    Ok(affine)
}

fn time_step(snow: &Snow, place: &Place<'_>) -> Result<TimeStep, SceneError> {
    match (snow.safety, snow.substep, snow.unchecked) {
        (Some(_), Some(_), _) => {
            place.clash("safety", "does not go with substep: a fixed step takes no share of the bound")
        }
        (_, None, true) => {
            place.clash("unchecked", "is for a fixed step: give its length, substep = seconds")
        }
        (None, Some(dt), true) => Ok(TimeStep::Unchecked(dt)),
        (None, Some(dt), false) => Ok(TimeStep::Fixed(dt)),
        (safety, None, false) => Ok(TimeStep::Certified { safety: safety.unwrap_or(TimeStep::SAFETY) }),
    }
}

fn integration(snow: &Snow, place: &Place<'_>) -> Result<Integration, SceneError> {
    if snow.beta == 0.0 {
        return match snow.solver {
            Some(_) => place.clash("solver", "is for a semi-implicit step: give beta above 0, at most 1"),
            None => Ok(Integration::Explicit),
        };
    }
    let solver = snow.solver.unwrap_or_default();
    let stop = Stop::Residual { tolerance: solver.tolerance, max_iterations: solver.max_iterations };
    Ok(Integration::SemiImplicit { beta: snow.beta, stop })
}
