//! Snow against closed forms, golden data and itself: transfers, laws, motion, stability.

mod affine;
mod bars;
mod beam;
mod conservation;
mod flight;
mod impact;
mod manufactured;
mod statics;
