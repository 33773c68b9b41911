//! How snow is stepped in a run: a transfer and a kernel, a precision, cells, steps.

use nappe_sim::{
    math::Precision,
    snow::{Blend, SnowSettings, SnowSetup, Transfer},
    time_step::TimeStep,
};

use super::{of_snow::Variant, setting::Plan, split::split};
use crate::case::Case;

/// The share of FLIP of scenes of another transfer.
const FLIP: Blend = Blend::PerStep(0.95);
/// Steps of the snow in a step of the world, at most.
const MOST_SUBSTEPS: u32 = 1_000_000;

/// How long steps of the snow are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SnowSteps {
    /// Certified, at this share of the bound.
    Share(f64),
    /// As the scene is written; so is all else, but cells that are halved, with steps as much shorter as they are.
    Own,
}

/// A transfer with a kernel, a precision, cells, steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SnowSetting {
    /// How velocities go to the grid and back.
    pub variant: Variant,
    /// Of positions and velocities.
    pub precision: Precision,
    /// Side of a cell (m).
    pub cell: f64,
    /// How long steps are.
    pub steps: SnowSteps,
    /// How often each particle is split into eight.
    pub halvings: u32,
}

/// Transfers with kernels that snow is compared by, in the order of a chart.
pub(crate) fn variants(settings: &SnowSettings) -> Vec<Variant> {
    Variant::smooth(match settings.transfer {
        Transfer::PicFlip(blend) => blend,
        Transfer::Apic | Transfer::Mls => FLIP,
    })
}

impl SnowSetting {
    /// As the snow of a setup is written, with cells that are halved so often.
    pub(crate) fn own(snow: &SnowSetup, precision: Precision, halvings: u32) -> Self {
        let cell = snow.settings.cell / f64::from(halvings).exp2();
        Self { variant: Variant::of(&snow.settings), precision, cell, steps: SnowSteps::Own, halvings }
    }

    /// What a run of a case is built from, in which times are an interval (s) apart.
    pub(crate) fn plan(&self, case: &Case, interval: f64) -> Plan {
        let mut setup = case.setup.clone();
        if let Some(snow) = &mut setup.snow {
            self.configure(snow);
        }
        let is_own = self.steps == SnowSteps::Own;
        // A step of the world that is divided like that on cells twice as long keeps the ratio of steps to cells.
        setup.dt = if is_own { case.dt() / f64::from(self.halvings).exp2() } else { interval };
        Plan { steps: (interval / setup.dt).round().max(1.0) as u64, setup }
    }

    /// Has snow stepped so.
    fn configure(&self, snow: &mut SnowSetup) {
        for halving in 0..self.halvings {
            let cell = snow.settings.cell / f64::from(halving).exp2();
            snow.objects.iter_mut().for_each(|object| *object = split(object, cell));
        }
        let settings = &mut snow.settings;
        // A period is so many blocks of cells.
        let ratio = settings.cell / self.cell;
        settings.periodic = settings.periodic.map(|blocks| (f64::from(blocks) * ratio).round() as u32);
        settings.cell = self.cell;
        (settings.kernel, settings.transfer) = (self.variant.kernel, self.variant.transfer);
        settings.time_step = match (self.steps, settings.time_step) {
            (SnowSteps::Share(safety), _) => TimeStep::Certified { safety },
            (SnowSteps::Own, TimeStep::Fixed(dt)) => TimeStep::Fixed(dt / ratio),
            (SnowSteps::Own, TimeStep::Unchecked(dt)) => TimeStep::Unchecked(dt / ratio),
            (SnowSteps::Own, certified @ TimeStep::Certified { .. }) => certified,
        };
        if self.steps != SnowSteps::Own || self.halvings > 0 {
            settings.max_substeps = settings.max_substeps.max(MOST_SUBSTEPS);
            // What a scene allows of its state is no property of a method.
            settings.max_energy = None;
        }
    }
}
