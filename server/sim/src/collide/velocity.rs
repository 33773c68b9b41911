//! What contact does to the velocity of snow, at a node of the grid or at a particle.
//!
//! Reads a velocity and the outward normal of the collider that it is inside of; writes the velocity
//! after contact (Stomakhin et al. 2013, section 8).

use super::{Collider, Contact};

/// The velocity (m/s) of snow inside a collider after contact with it. Restitution plays no part.
pub(crate) fn velocity_after(collider: &Collider, v: [f64; 3], normal: [f64; 3]) -> [f64; 3] {
    let relative = [0, 1, 2].map(|k| v[k] - collider.velocity[k]);
    let approach: f64 = (0..3).map(|k| relative[k] * normal[k]).sum();
    match collider.contact {
        Contact::Sticky => return collider.velocity,
        Contact::Separating if approach >= 0.0 => return v,
        Contact::Slip | Contact::Separating => {}
    }
    let sliding = [0, 1, 2].map(|k| relative[k] - approach * normal[k]);
    let speed = sliding.iter().map(|c| c * c).sum::<f64>().sqrt();
    // Coulomb: the impulse along the surface is at most friction times that across it.
    let slowed = collider.friction * (-approach).max(0.0);
    let left = if speed > slowed { 1.0 - slowed / speed } else { 0.0 };
    [0, 1, 2].map(|k| collider.velocity[k] + left * sliding[k])
}
