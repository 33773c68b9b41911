//! Linear systems: conjugate gradient on systems solved in 60 digits, and the operators of a step.

mod operators;
mod systems;
mod tangents;
