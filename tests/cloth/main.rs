//! Cloth: forces, integrators and contacts against closed forms and golden data.

mod springs;
mod quadratic_bending;
mod two_particles;
mod oscillators;
mod discrete;
mod convergence;
mod midpoint;
mod free_fall;
mod near_coincident;
mod conservation;
mod statics;
mod modes;
mod pendulums;
mod transients;
mod pins;
mod contact;
mod notices;
mod external;
mod bodies;
mod scenes;
mod shipped;
mod steps;
mod newton;
mod vertex_block_descent;
mod odd_networks;
mod work;
