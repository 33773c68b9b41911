//! Transfers of snow with the kernels that go with them.

use nappe_sim::snow::{Blend, Kernel, SnowSettings, Transfer};

/// A kernel with a transfer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variant {
    /// B-spline that spreads a particle over nodes.
    pub kernel: Kernel,
    /// How velocities go to the grid and back.
    pub transfer: Transfer,
}

impl Variant {
    /// Every kernel with every transfer that goes with it.
    pub fn all() -> Vec<Self> {
        let blends = [Blend::PerStep(0.95), Blend::TimeConstant(0.02)].map(Transfer::PicFlip);
        let linear = Self { kernel: Kernel::Linear, transfer: blends[0] };
        let smooth = [Kernel::Quadratic, Kernel::Cubic].into_iter().flat_map(|kernel| {
            let transfers = [blends[0], blends[1], Transfer::Apic, Transfer::Mls];
            transfers.map(move |transfer| Self { kernel, transfer })
        });
        std::iter::once(linear).chain(smooth).collect()
    }

    /// Those that filter once per step, whatever its length: as scenes have them that say nothing of it.
    pub fn per_step() -> Vec<Self> {
        let is_one = |v: &Self| !matches!(v.transfer, Transfer::PicFlip(Blend::TimeConstant(_)));
        Self::all().into_iter().filter(is_one).collect()
    }

    /// Both smooth kernels with every transfer, PIC and FLIP blended so.
    pub(crate) fn smooth(blend: Blend) -> Vec<Self> {
        let transfers = [Transfer::PicFlip(blend), Transfer::Apic, Transfer::Mls];
        let of = |transfer| [Kernel::Quadratic, Kernel::Cubic].map(|kernel| Self { kernel, transfer });
        transfers.into_iter().flat_map(of).collect()
    }

    /// That by which snow is stepped.
    pub fn of(settings: &SnowSettings) -> Self {
        Self { kernel: settings.kernel, transfer: settings.transfer }
    }

    /// Those that carry affine velocities.
    pub fn affine() -> Vec<Self> {
        Self::all().into_iter().filter(|v| !matches!(v.transfer, Transfer::PicFlip(_))).collect()
    }

    /// `mls_quadratic`, `pic_flip_tau_cubic`, ...
    pub fn name(self) -> String {
        let blend = match self.transfer {
            Transfer::PicFlip(Blend::TimeConstant(_)) => "_tau",
            _ => "",
        };
        format!("{}{blend}_{}", self.transfer.name(), self.kernel.name())
    }
    /// The same as a reader writes it: `MLS, quadratic kernel`, `PIC/FLIP with a time constant, cubic kernel`, ...
    pub fn reader_name(self) -> String {
        let transfer = match self.transfer {
            Transfer::PicFlip(Blend::PerStep(_)) => "PIC/FLIP",
            Transfer::PicFlip(Blend::TimeConstant(_)) => "PIC/FLIP with a time constant",
            Transfer::Apic => "APIC",
            Transfer::Mls => "MLS",
        };
        format!("{transfer}, {} kernel", self.kernel.name())
    }
}
