//! Given forces on particles: what they do to velocities after each sub-step.

use crate::{
    math::Real,
    snow::state::{SnowState, SnowWorkspace},
};

/// Adds what given forces do to velocities in a sub-step of `dt` (s), once it was taken; returns their work (J), force times the
/// mean of both velocities.
pub(super) fn push<R: Real>(state: &mut SnowState<R>, work: &mut SnowWorkspace<R>, dt: f64) -> f64 {
    let particles = &mut state.particles;
    let (mut done, mut fastest) = (0.0, work.extremes.speed2);
    for at in 0..particles.len() {
        let force = work.forces[particles.id[at] as usize];
        if force == [0.0; 3] {
            continue;
        }
        let (v, mass) = (particles.v(at), particles.mass(at).to_f64());
        let new = [0, 1, 2].map(|c| R::of(v[c].to_f64() + dt * force[c] / mass));
        particles.set_v(at, new);
        let (v, new) = (v.map(Real::to_f64), new.map(Real::to_f64));
        done += (0..3).map(|c| 0.5 * dt * force[c] * (v[c] + new[c])).sum::<f64>();
        fastest = fastest.max(new.iter().map(|c| c * c).sum());
    }
    (work.extremes.speed2, work.culprits) = (fastest, None);
    done
}
