//! Mutants of snow: which text of which file of the numerics becomes which other text.
//!
//! Nineteen errors that programs of snow have made, and two time steps that are too long. Each text must stand
//! in its file exactly once: a kernel that was rewritten makes the copy fail, and its mutant is stated anew.

use super::patch::{Patch, expression, text};

/// Parts of the names of tests that are left out.
pub(super) const SLOW: [&str; 14] = [
    "clumps",
    "statics",
    "dissipation",
    "semi_implicit",
    "corners",
    "measured_limits",
    "step_bounds",
    "friction",
    "volumes",
    "a_rigid_body_that_turns",
    "a_body_without_stress_that_turns",
    "affine_transfers_keep_angular_momentum",
    "expected_errors_of_every",
    "the_scene_of_brasseur",
];

/// What each mutant does wrong, in the order of their numbers, from 1.
pub(super) const NAMES: [&str; 21] = [
    "gradient of the weight without 1/h",
    "stress without F^T",
    "stress transposed: F^T (F - R)",
    "F in place of R: (F - I) F^T",
    "current volume with Kirchhoff stress",
    "volume at rest with Cauchy stress",
    "lambda (J - 1) without J",
    "sign of lambda",
    "volume of the cell in place of the particle's",
    "volume never set (1)",
    "sign of the force",
    "fields not cleared between steps",
    "F += grad v F without dt",
    "force not divided by the mass of the node",
    "grad v from velocities before forces",
    "grad v transposed",
    "F (I + dt grad v) in place of (I + dt grad v) F",
    "sign of the hardening",
    "sign lost in the slope of the kernel",
    "dt = 1/240 s, whatever the bound",
    "dt = 1/24 s, one step per frame",
];

/// The patches that make the mutants, in the order of their numbers.
#[rustfmt::skip] // one line per patch where it fits
pub(super) const PATCHES: [Patch; 23] = [
    expression(1, "transfer/particles_to_grid.rs", "-self.dt * self.inverse_cell", "-self.dt"),
    expression(1, "transfer/grid_to_particles.rs", "sums.slopes[axis][k] * inverse_cell", "sums.slopes[axis][k]"),
    expression(2, "law/constitutive.rs", "two_mu * (sigma[i] - one) * sigma[i] + pressure", "two_mu * (sigma[i] - one) + pressure / sigma[i]"),
    text(3, "law/deform.rs", "    let volume_stress = in_frame(&u, &force);", "    let volume_stress = if crate::mutant(3) { in_frame(&mutated_right(trial, &u, &sigma), &force) } else if crate::mutant(4) { mutated_unrotated(&elastic, volume, hardening, m) } else { in_frame(&u, &force) };"),
    text(3, "law/deform.rs", "        out[k].volume_stress = in_frame(&u, &t);", "        out[k].volume_stress = if crate::mutant(3) { in_frame(&mutated_right(&f[k], &u, &sigma), &t) } else if crate::mutant(4) { mutated_unrotated(&f[k], volume[k], out[k].hardening, &m[k]) } else { in_frame(&u, &t) };"),
    text(5, "law/constitutive.rs", "    t\n}\n\n/// Elastic energy per volume at rest", "    let volume_ratio = sigma[0] * sigma[1] * sigma[2];\n    if crate::mutant(5) { return [t[0] * volume_ratio, t[1] * volume_ratio, t[2] * volume_ratio]; }\n    if crate::mutant(6) { return [t[0] / volume_ratio, t[1] / volume_ratio, t[2] / volume_ratio]; }\n    t\n}\n\n/// Elastic energy per volume at rest"),
    expression(7, "law/constitutive.rs", "lambda * (j - one) * j", "lambda * (j - one)"),
    text(8, "law/constitutive.rs", "    let mut t = [pressure; 3];", "    let pressure = if crate::mutant(8) { -pressure } else { pressure };\n    let mut t = [pressure; 3];"),
    text(9, "transfer/particle_update.rs", "            (plastic_ratios[k], volumes[k]) = (plastic_ratio, P::load(&volume));", "            (plastic_ratios[k], volumes[k]) = (plastic_ratio, P::load(&volume));\n            if crate::mutant(9) { volumes[k] = P::of(8.0) * volumes[k]; }\n            if crate::mutant(10) { volumes[k] = one; }"),
    expression(11, "transfer/particles_to_grid.rs", "-self.dt * self.inverse_moment * self.inverse_cell", "self.dt * self.inverse_moment * self.inverse_cell"),
    text(11, "transfer/particles_to_grid.rs", "                out.force[axis] = P::rows([a * impulse, b * impulse, c * impulse, zero]);", "                let impulse = if crate::mutant(11) { -impulse } else { impulse };\n                out.force[axis] = P::rows([a * impulse, b * impulse, c * impulse, zero]);"),
    text(12, "transfer/particles_to_grid.rs", "        tile.fill(R::zero());", "        if !crate::mutant(12) { tile.fill(R::zero()); }"),
    text(12, "transfer/particles_to_grid.rs", "        impulses.fill(R::zero());", "        if !crate::mutant(12) { impulses.fill(R::zero()); }"),
    expression(13, "law/deform.rs", "dt * change[column][row]", "change[column][row]"),
    expression(14, "transfer/grid_update.rs", "impulses[i][c] * inverse", "impulses[i][c]"),
    text(15, "transfer/grid_to_particles.rs", "        one::<P, S, N>(&tiles[0], cell, &weights, lane, &mut sums);", "        one::<P, S, N>(&tiles[0], cell, &weights, lane, &mut sums);\n        if crate::mutant(15) && S::APART {\n            let (mut before, kept) = (tiles[0], sums.v[lane]);\n            for i in 0..TILE { before[i] = before[i] - tiles[1][i]; }\n            one::<P, S, N>(&before, cell, &weights, lane, &mut sums);\n            sums.v[lane] = kept;\n        }"),
    text(16, "law/deform.rs", "    let change = product(gradient, f);", "    let turned = [[gradient[0][0], gradient[1][0], gradient[2][0]], [gradient[0][1], gradient[1][1], gradient[2][1]], [gradient[0][2], gradient[1][2], gradient[2][2]]];\n    let change = if crate::mutant(16) { product(&turned, f) } else if crate::mutant(17) { product(f, gradient) } else { product(gradient, f) };"),
    expression(18, "law/constitutive.rs", "P::one() - plastic_ratio", "plastic_ratio - P::one()"),
    text(19, "transfer/weights.rs", "            (w, [-a, -(c + c), b, zero])", "            (w, [if crate::mutant(19) { a } else { -a }, -(c + c), b, zero])"),
    expression(19, "transfer/weights.rs", "-(half * u2)", "half * u2"),
    expression(20, "step/time_step.rs", "state.hold.length(dt, allowed)", "1.0 / 240.0"),
    expression(21, "step/time_step.rs", "TimeStep::divide(self.left, held)", "TimeStep::divide(self.left, 1.0 / 24.0)"),
    text(0, "law/deform.rs", "/// U diag(t) U^T: xx yy zz xy xz yz.", RIGHT),
];

/// What some mutants need: columns of V from F = U diag(sigma) V^T; 2 mu (F - I) F^T + lambda (J - 1) J,
/// symmetrised, times the volume.
const RIGHT: &str =
    "fn mutated_right<P: Pack>(f: &Columns<P>, u: &Columns<P>, sigma: &[P; 3]) -> Columns<P> {
    let mut v = *u;
    for k in 0..3 {
        for column in 0..3 {
            v[k][column] = dot3(&f[column], &u[k]) / sigma[k];
        }
    }
    v
}

fn mutated_unrotated<P: Pack>(f: &Columns<P>, volume: P, hardening: P, m: &Moduli<P>) -> [P; 6] {
    let (one, half) = (P::one(), P::of(0.5));
    let mut strain = *f;
    for k in 0..3 {
        strain[k][k] -= one;
    }
    let transposed = [[f[0][0], f[1][0], f[2][0]], [f[0][1], f[1][1], f[2][1]], [f[0][2], f[1][2], f[2][2]]];
    let s = product(&strain, &transposed);
    let (two_mu, j) = ((m.mu + m.mu) * hardening, dot3(&f[0], &cross3(&f[1], &f[2])));
    let pressure = m.lambda * hardening * (j - one) * j;
    let along = |k: usize| (two_mu * s[k][k] + pressure) * volume;
    let across = |a: usize, b: usize| two_mu * half * (s[a][b] + s[b][a]) * volume;
    [along(0), along(1), along(2), across(0, 1), across(0, 2), across(1, 2)]
}

/// U diag(t) U^T: xx yy zz xy xz yz.";
