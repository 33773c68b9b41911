//! Methods compared on a scene: references and errors against golden data, windows, classes of effort, rows that nothing changes, limits of
//! steps against theory.

mod support;
mod budgets;
mod golden;
mod window;
mod effort;
mod rows;
mod snow;
mod plan;
mod terms;
mod coarser;
mod stability;
mod eigenvalues;
