//! Drag, air and springs of a cloth: told, and changed by calls.

use super::{cloth::Cloth, parts::Part};
use crate::{
    cloth::{Air, Parameters, SpringKind, bounding_law},
    math::Real,
    world::setup::parameters::{ClothParameters, ranges},
};

impl<R: Real> Cloth<R> {
    /// Whether any spring of one of its bodies is of a kind.
    pub(crate) fn has_springs(&self, part: &Part, kind: SpringKind) -> bool {
        self.parameters.laws[part.laws.clone()].iter().any(|law| law.kind == kind)
    }

    /// Drag and springs of its bodies as they are now, each with its first particle.
    pub(crate) fn parameters(&self) -> impl Iterator<Item = (u32, ClothParameters)> {
        let Parameters { laws, drag, air, .. } = &self.parameters;
        self.parts.iter().map(move |part| {
            let (name, springs) = (part.name.clone(), ranges(&laws[part.laws.clone()]));
            let pull_count = self.pulls.count_in(&part.own);
            (part.first_particle, ClothParameters { name, drag: *drag, air: *air, springs, pull_count })
        })
    }

    pub(crate) fn set_drag(&mut self, drag: f64) {
        self.state.kept.forget();
        self.parameters.drag = drag;
    }

    /// The law with the largest part of the stiffness at one of its particles, by its name in scenes; none without any.
    pub(crate) fn bounding_law(&self, own: u32) -> Option<String> {
        bounding_law(&self.model, &self.parameters, own)
    }

    /// Whether the air acts on it.
    pub(crate) fn feels_air(&self) -> bool {
        self.parameters.air.is_some()
    }

    /// Changes the air around it, if it feels any.
    pub(crate) fn change_air(&mut self, change: impl Fn(Air) -> Air) {
        self.state.kept.forget();
        self.parameters.air = self.parameters.air.map(change);
    }

    /// Sets stiffness (N/m) and damping (N s/m) of the springs of a kind in the body of a name, or in all; `None` leaves one as
    /// it is.
    pub(crate) fn set_springs(
        &mut self,
        name: Option<&str>,
        kind: Option<SpringKind>,
        stiffness: Option<f64>,
        damping: Option<f64>,
    ) {
        let Self { parts, parameters, state, .. } = self;
        for part in parts.iter().filter(|part| name.is_none_or(|name| part.name == name)) {
            state.kept.forget();
            let laws = parameters.laws[part.laws.clone()].iter_mut();
            for entry in laws.filter(|entry| kind.is_none_or(|kind| entry.kind == kind)) {
                entry.law.stiffness = stiffness.unwrap_or(entry.law.stiffness);
                entry.law.damping = damping.unwrap_or(entry.law.damping);
            }
        }
    }
}
