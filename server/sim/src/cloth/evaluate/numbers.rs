//! Parameters and time step as the kernels of one step read them.

use super::{bound::Bounds, external::External};
use crate::{
    cloth::{
        layout::{ElementNumbers, Model, Parameters},
        settings::{ClothSettings, Integrator, Scheme},
    },
    math::{LANES, Real, Vec3, vec3},
    sub_step::SubStep,
    surroundings::Surroundings,
};

/// Numbers of the laws of sixteen springs, each with a lane per spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SpringNumbers<R> {
    /// k (N/m).
    pub(crate) stiffness: [R; LANES],
    /// nu (N s/m).
    pub(crate) damping: [R; LANES],
    /// h k (N s/m).
    pub(crate) push: [R; LANES],
    /// h² k (kg).
    pub(crate) elastic: [R; LANES],
    /// h nu (kg).
    pub(crate) viscous: [R; LANES],
}

/// Parameters and time step of a step.
#[derive(Clone, Debug, PartialEq, Default)]
pub(crate) struct StepNumbers<R: Real> {
    /// The sub-step that they are of.
    pub(crate) sub_step: SubStep,
    /// How an implicit integrator takes it; of an explicit one, h is the length of the sub-step.
    pub(crate) scheme: Scheme,
    /// Numbers for each pattern of laws of the model's springs.
    pub(crate) springs: Vec<SpringNumbers<R>>,
    /// Numbers for each list of elements.
    pub(crate) elements: Vec<ElementNumbers<R>>,
    /// h² k + h nu of each pattern (kg): a + b d.d of a spring's block a I + b d dᵀ.
    pub(crate) along: Vec<[R; LANES]>,
    /// What the transverse ratio of a compressed spring is multiplied by, if that makes it greater: 1, 0 or -1.
    pub(crate) mirror: R,
    /// Gravity (m/s²).
    pub(crate) gravity: Vec3<R>,
    /// What acts on each particle by itself.
    pub(crate) external: External<R>,
    /// What bounds an explicit step.
    pub(crate) bounds: Bounds<R>,
    /// Sum of the stiffness of all springs, and of what elements add at all particles (N/m).
    pub(crate) stiffness: f64,
    /// What they were made from.
    parameters: Option<Parameters>,
}

impl<R: Real> StepNumbers<R> {
    /// Takes over the parameters and the surroundings of a sub-step, `before` (s) being the length of the one before, 0 without
    /// one; says whether anything changed on which an evaluation depends.
    pub(crate) fn refresh(
        &mut self,
        model: &Model<R>,
        parameters: &Parameters,
        settings: &ClothSettings,
        around: &Surroundings<'_>,
        (sub_step, before): (SubStep, f64),
    ) -> bool {
        let scheme = Scheme::of(settings.integrator, sub_step.dt, before);
        let h = scheme.h;
        let (gravity, wind) = (vec3(around.gravity), vec3(around.wind));
        let mirror = R::of(settings.hessian.mirror());
        let has_same_laws = self.parameters.as_ref() == Some(parameters);
        let is_same =
            has_same_laws && (self.gravity, self.external.wind, self.mirror) == (gravity, wind, mirror);
        let is_timeless = !settings.integrator.is_implicit();
        let is_as_long = self.scheme.h.to_bits() == h.to_bits();
        (self.sub_step, self.scheme) = (sub_step, scheme);
        if is_same && (is_timeless || is_as_long) {
            return false;
        }

        (self.gravity, self.mirror) = (gravity, mirror);
        self.external.refresh(parameters, wind);
        // Wind over time is another one in every step.
        if !has_same_laws {
            self.weigh(model, parameters, settings);
        }
        self.springs.clear();
        self.springs.extend(model.springs.patterns.iter().map(|laws| {
            let of = |number: &dyn Fn(f64, f64) -> f64| {
                laws.map(|law| {
                    let law = parameters.laws[law as usize].law;
                    R::of(number(law.stiffness, law.damping))
                })
            };
            SpringNumbers {
                stiffness: of(&|k, _| k),
                damping: of(&|_, nu| nu),
                push: of(&|k, _| h * k),
                elastic: of(&|k, _| h * h * k),
                viscous: of(&|_, nu| h * nu),
            }
        }));
        self.along.clear();
        self.along.extend(
            self.springs
                .iter()
                .map(|numbers| std::array::from_fn(|lane| numbers.elastic[lane] + numbers.viscous[lane])),
        );
        self.take_elements(model, parameters, settings.integrator);
        match &mut self.parameters {
            Some(Parameters { laws, elements, drag, air }) => {
                laws.clone_from(&parameters.laws);
                elements.clone_from(&parameters.elements);
                (*drag, *air) = (parameters.drag, parameters.air);
            }
            None => self.parameters = Some(parameters.clone()),
        }
        true
    }

    /// Takes over the laws of elements, for a step of the length that was taken over.
    fn take_elements(&mut self, model: &Model<R>, parameters: &Parameters, integrator: Integrator) {
        let (h, is_damped) = (self.scheme.h, self.bounds.is_damped());
        self.elements.clear();
        self.elements.extend(model.elements.iter().zip(&parameters.elements).map(|(elements, law)| {
            let matrix = h * h * law.stiffness + h * law.damping;
            let [gradient, velocity, elastic] = if integrator.is_implicit() {
                let elastic = if matrix > 0.0 { h * h * law.stiffness / matrix } else { 0.0 };
                [h * law.stiffness, h * law.damping, elastic]
            } else {
                [law.stiffness, law.damping, 0.0]
            };
            let [all, loads] = if is_damped { [0.0, law.stiffness] } else { [law.stiffness, 0.0] };
            let bounded = [all, loads].map(R::of);
            let [gradient, velocity, matrix, elastic] = [gradient, velocity, matrix, elastic].map(R::of);
            let is_turning = elements.frozen_count() > 0;
            ElementNumbers { energy: law.stiffness, gradient, velocity, matrix, elastic, bounded, is_turning }
        }));
    }

    /// Whether anything is damped along directions that change with the state: springs, and elements but for those that bend.
    pub(crate) fn has_turning_damping(&self) -> bool {
        let springs = self.springs.iter().flat_map(|laws| laws.damping);
        let elements = self.elements.iter().filter(|numbers| numbers.is_turning);
        springs.chain(elements.map(|numbers| numbers.velocity)).any(|damping| damping > R::zero())
    }

    /// Takes over what depends on the laws alone, and looks at every element for that.
    fn weigh(&mut self, model: &Model<R>, parameters: &Parameters, settings: &ClothSettings) {
        let springs = model.springs_of_laws.iter().zip(&parameters.laws);
        self.stiffness = springs.map(|(count, entry)| f64::from(*count) * entry.law.stiffness).sum();
        for (elements, law) in model.elements.iter().zip(&parameters.elements) {
            let mut shares = vec![0.0; model.count];
            elements.add_shares(&mut shares);
            self.stiffness += law.stiffness * shares.iter().sum::<f64>();
        }
        if !settings.integrator.is_implicit() {
            self.bounds.refresh(model, parameters, settings.integrator);
        }
    }
}
