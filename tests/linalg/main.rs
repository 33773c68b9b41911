//! Linear systems: conjugate gradient and minimal residuals on systems solved in 60 digits, and the
//! operators of a step.

mod systems;
mod dense;
mod endings;
mod operators;
mod two_level;
mod minres;
mod first_indefinite;
