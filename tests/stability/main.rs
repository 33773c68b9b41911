//! Stability: the largest stable step of every method, where it fails, and how it says so.

mod bounds;
mod certified;
mod critical_step;
mod verlet;
mod divergence;
mod energy;
mod squash;
mod sweep;
mod table;
