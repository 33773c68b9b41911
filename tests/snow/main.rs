//! Snow against closed forms, golden data and itself: transfers, laws, motion, stability.

mod own;
mod affine;
mod bars;
mod beam;
mod certified;
mod conservation;
mod dissipation;
mod faults;
mod flight;
mod forces;
mod friction;
mod gather;
mod volumes;
mod golden_step;
mod bounce;
mod impact;
mod refinement;
mod kernels;
mod laws;
mod limits;
mod manufactured;
mod periodic_bar;
mod seed;
mod semi_implicit;
mod statics;
