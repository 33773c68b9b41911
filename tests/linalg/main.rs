//! Linear systems: both solvers on systems solved in 60 digits, and the operators of a step. The solvers are
//! conjugate gradient and minimal residuals.

mod systems;
mod dense;
mod endings;
mod operators;
mod two_level;
mod patches;
mod minres;
mod first_indefinite;
