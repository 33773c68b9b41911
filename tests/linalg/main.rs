//! Linear systems: conjugate gradient and minimal residuals on systems solved in 60 digits, and the
//! operators of a step.

mod dense;
mod minres;
mod operators;
mod systems;
mod tangents;
