//! Methods compared on a scene: references and errors against golden data, windows, classes of effort, measures, rows that nothing
//! changes, limits of steps against theory, bodies with a thickness.

mod support;
mod budgets;
mod golden;
mod window;
mod effort;
mod measures;
mod claims;
mod rows;
mod thick;
mod snow;
mod plan;
mod terms;
mod rest;
mod coarser;
mod stability;
mod eigenvalues;
