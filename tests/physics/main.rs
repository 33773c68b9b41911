//! Physics: forces, integrators and contacts against closed forms and golden data.

mod bodies;
mod conservation;
mod contact;
mod convergence;
mod discrete;
mod external;
mod faults;
mod modes;
mod oscillators;
mod pins;
mod shipped;
mod springs;
mod statics;
mod transients;
mod two_particles;
