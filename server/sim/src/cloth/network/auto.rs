//! What settings leave to the program: decided when a cloth is built, by numbers alone.

use super::description::{ElementList, Network};
use crate::{
    cloth::settings::ClothSettings,
    linalg::{AtCap, PreconditionerKind},
};

/// Settings whose preconditioner is not `auto`, for a network in steps of the world of `dt` (s). Only of stiff cloth, where it
/// was, may solves that come to their cap go on with patches.
pub(crate) fn resolve(settings: &ClothSettings, network: &Network, dt: f64) -> ClothSettings {
    let mut settings = *settings;
    if settings.solver.preconditioner == PreconditionerKind::Auto {
        let springs = network.springs.iter().map(|spring| [spring.law.stiffness, spring.law.damping]);
        let laws = springs.chain(network.elements.iter().map(ElementList::as_springs));
        let sums = laws.fold([0.0; 2], |[k, nu], [stiffness, damping]| [k + stiffness, nu + damping]);
        let pinned: f64 = network.pins.iter().filter_map(|pin| network.masses.get(*pin as usize)).sum();
        let mass = network.masses.iter().sum::<f64>() - pinned;
        let is_stiff = settings.is_stiff(network.x.len() as u64, mass, sums, dt);
        settings.solver.preconditioner =
            if is_stiff { PreconditionerKind::TwoLevel } else { PreconditionerKind::BlockJacobi };
        // Pairs that keep surfaces apart are no part of what patches are made of.
        if network.thickness > 0.0 || !settings.has_stiff_springs(mass, sums, dt) {
            settings.solver.at_cap = AtCap::Stop;
        }
    } else {
        settings.solver.at_cap = AtCap::Stop;
    }
    settings
}
