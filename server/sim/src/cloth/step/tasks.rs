//! The tasks of a step, each by itself, at the state as it is: to be timed one by one. A step does several of them in one sweep.

use super::stepping::Stepping;
use crate::{
    cloth::{
        evaluate::Evaluated,
        integrate::{accelerate, drift, kick, solve_once},
        settings::{ClothSettings, Integrator, Purpose},
    },
    math::Real,
    report::{NoStopwatch, Task},
    sub_step::SubStep,
};

impl<R: Real> Stepping<'_, R> {
    /// Does every task of a sub-step that its scene asks for, and tells each once it is done; those of an implicit step where it
    /// makes linear solves. The state stays as it is, but what is known of it is forgotten.
    pub(crate) fn tasks(&mut self, done: &mut dyn FnMut(Task)) {
        self.begin();
        self.memory.forget();
        let Self { model, settings, around, .. } = *self;
        let dt = settings.time_step.asked(around.dt);
        let sub_step = SubStep { dt, end: around.time + dt };
        self.refresh(sub_step);
        self.memory.turns.make_room(self.state);
        let mut forces = self.room_for_forces(sub_step);
        let (mut x, mut v) = (self.state.x.clone(), self.state.v.clone());
        done(Task::Room);

        forces.evaluate(model, Purpose::Resultant, self.state);
        done(Task::Force);
        let (rows, h) = (&mut forces.evaluation.rows, R::of(dt));
        accelerate(model, rows);
        done(Task::Acceleration);
        kick(model, &mut v, rows, h);
        done(Task::Velocity);
        drift(model, &mut x, &v, h);
        done(Task::Position);

        if !settings.solves() {
            return;
        }
        let purpose = match Purpose::of(settings) {
            purpose if purpose.has_matrix() => purpose,
            _ => Purpose::Iterate(settings.solver.preconditioner),
        };
        self.memory.evaluated.evaluate(model, purpose, self.state);
        done(Task::ForceAndMatrix);
        solve_once(&mut self.step(&mut NoStopwatch), settings, around.interrupt);
        done(Task::Solve);
    }

    /// Room for an evaluation of the forces alone, with what acts on the particles of this cloth.
    fn room_for_forces(&self, sub_step: SubStep) -> Evaluated<R> {
        let Self { model, parameters, settings, around, .. } = self;
        let integrator = match settings.integrator {
            // Of implicit steps, elements are evaluated times the length of the step.
            implicit if implicit.is_implicit() => Integrator::SymplecticEuler,
            explicit => explicit,
        };
        let settings = ClothSettings { integrator, ..**settings };
        let mut forces = Evaluated::default();
        forces.size_for(model, Purpose::Resultant);
        forces.take_forces(&self.memory.evaluated);
        forces.numbers.refresh(model, parameters, &settings, around, (sub_step, 0.0));
        forces
    }
}
