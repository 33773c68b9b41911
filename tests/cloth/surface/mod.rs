//! Cloth that keeps its surfaces apart: no edge crosses a triangle after any step, whatever the cloth does.

mod starts;
mod few;
mod folded;
mod twisted;
mod stacked;
mod flung;
mod linked;
mod closing;
mod meeting;
mod friction;
mod sliding;
mod apart;
pub(crate) mod energy;
mod bodies;
mod calls;
mod placed;
mod figures;
mod beside_figures;
mod yielding;
