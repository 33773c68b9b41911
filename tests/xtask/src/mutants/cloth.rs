//! Mutants of cloth: which text of which file of the numerics becomes which other text.
//!
//! Errors that programs of cloth, solvers and their parallel parts have made or could make. Each text must
//! stand in its file exactly once: code that was rewritten makes the copy fail, and its mutant is stated anew.

use super::patch::{Patch, expression, text};

/// Parts of the names of tests that are left out.
pub(super) const SLOW: [&str; 11] = [
    "convergence::",
    "conservation::",
    "shipped::",
    "oscillators::",
    "transients::",
    "that_bounces_rises",
    "no_particle_of_a_cloth_enters",
    "snow::",
    "any_number_of_threads",
    "every_width_of_vector",
    "a_dense_system_of_fifty_nodes",
];

/// What each mutant does wrong, in the order of their numbers, from 101.
pub(super) const NAMES: [&str; 34] = [
    "sign of the spring's force",
    "spring force without its rest length",
    "spring force along d in place of d / l",
    "damping along d in place of d / l",
    "drag against the velocity, not that relative to the wind",
    "elastic energy without 1/2",
    "springs counted at both ends",
    "|1 - l0/l| without the magnitude",
    "max(0, 1 - l0/l) without the maximum",
    "matrix with h k in place of h² k",
    "matrix without the damping of springs",
    "matrix without drag",
    "right-hand side without h df/dx v",
    "pins that a solve moves",
    "assembled blocks beside the diagonal with the wrong sign",
    "explicit Euler that moves with the new velocity",
    "symplectic Euler that moves with the old velocity",
    "velocity Verlet with one kick of a whole step",
    "predicted velocity Verlet without the prediction",
    "implicit Euler that moves before its velocity changes",
    "conjugate gradient without beta: steepest descent",
    "conjugate gradient with the tolerance on |r| in place of |r| / |b|",
    "conjugate gradient blind to negative curvature",
    "conjugate gradient that returns its last iterate, not its best",
    "inverse of a 3 x 3 block with a wrong cofactor",
    "minimal residuals with a wrong step",
    "minimal residuals without the mass in the norm",
    "friction that turns sliding back",
    "contact without restitution",
    "contact blind to the collider's velocity",
    "contact without the margin",
    "sum over blocks that leaves the fixed tree",
    "Hilbert curve without its reflections",
    "an empty lane that pulls to particle 0",
];

/// The patches that make the mutants, in the order of their numbers.
#[rustfmt::skip] // one line per patch where it fits
pub(super) const PATCHES: [Patch; 34] = [
    text(101, "cloth/forces/spring.rs", "            sums[c] -= pull[c];", "            if crate::mutant(101) { sums[c] += pull[c]; } else { sums[c] -= pull[c]; }"),
    expression(102, "cloth/forces/spring.rs", "stiffness * (length - edges.rest_length) * inverse", "stiffness * length * inverse"),
    text(103, "cloth/forces/spring.rs", "        let viscous =", "        let elastic = if crate::mutant(103) { stiffness * (length - edges.rest_length) } else { elastic };\n        let viscous ="),
    expression(104, "cloth/forces/spring.rs", "damping * dot(edges.w, edges.d) * inverse * inverse", "damping * dot(edges.w, edges.d) * inverse"),
    expression(105, "cloth/forces/mod.rs", "(self.v[i].vector() - wind)", "self.v[i].vector()"),
    expression(106, "cloth/forces/spring.rs", "P::Wide::of(0.5)", "P::Wide::of(1.0)"),
    expression(107, "cloth/diagnose.rs", "0.5 * lanes[0][lane]", "lanes[0][lane]"),
    expression(108, "cloth/forces/spring.rs", "ratio.abs()", "ratio"),
    expression(109, "cloth/forces/spring.rs", "ratio.max(P::zero())", "ratio"),
    expression(110, "cloth/state.rs", "R::of(dt * dt * k)", "R::of(dt * k)"),
    expression(111, "cloth/forces/spring.rs", "(stiffness - across + damping)", "(stiffness - across)"),
    expression(112, "cloth/step_operator.rs", "(dt * frozen.drag, [P::zero(); 3])", "(R::zero(), [P::zero(); 3])"),
    expression(113, "cloth/step_operator.rs", "(force * dt - stiff) * free", "force * dt * free"),
    expression(114, "cloth/step_operator.rs", "(springs + self.p[i].vector() * (model.m[i] + drag)) * free", "springs + self.p[i].vector() * (model.m[i] + drag)"),
    text(115, "cloth/step_operator.rs", "                blocks[place(j)] -= block;", "                if crate::mutant(115) { blocks[place(j)] += block; } else { blocks[place(j)] -= block; }"),
    text(116, "cloth/integrate/explicit_euler.rs", "    step.drift(step.dt());\n    step.kick(step.dt());", "    if crate::mutant(116) { step.kick(step.dt()); step.drift(step.dt()); return; }\n    step.drift(step.dt());\n    step.kick(step.dt());"),
    text(117, "cloth/integrate/symplectic_euler.rs", "    step.kick(step.dt());\n    step.drift(step.dt());", "    if crate::mutant(117) { step.drift(step.dt()); step.kick(step.dt()); return; }\n    step.kick(step.dt());\n    step.drift(step.dt());"),
    text(118, "cloth/integrate/velocity_verlet.rs", "    step.kick(half);\n    step.drift(step.dt());\n\n    step.accelerate();", "    if crate::mutant(118) { step.kick(step.dt()); step.drift(step.dt()); return; }\n    step.kick(half);\n    step.drift(step.dt());\n\n    step.accelerate();"),
    text(119, "cloth/integrate/velocity_verlet.rs", "    step.accelerate_at_w();", "    if crate::mutant(119) { step.accelerate() } else { step.accelerate_at_w() }"),
    text(120, "cloth/integrate/implicit_euler.rs", "    step.kick_by_dv();\n    step.drift(step.dt());", "    if crate::mutant(120) { step.drift(step.dt()); step.kick_by_dv(); return Ok(report); }\n    step.kick_by_dv();\n    step.drift(step.dt());"),
    expression(121, "linalg/cg.rs", "rho_next / rho", "0.0"),
    expression(122, "linalg/cg.rs", "tolerance * b_norm", "tolerance"),
    text(123, "linalg/cg.rs", "        if curvature > bound {", "        if crate::mutant(123) || curvature > bound {"),
    text(124, "linalg/cg.rs", "    if !best_is_x && !fixed", "    if !crate::mutant(124) && !best_is_x && !fixed"),
    expression(125, "linalg/precondition.rs", "self.xz * self.yz - self.xy * self.zz", "self.xy * self.zz - self.xz * self.yz"),
    expression(126, "linalg/minres.rs", "self.cosine * self.residual", "self.residual"),
    expression(127, "linalg/minres.rs", "*r / *m", "*r"),
    expression(128, "collide/contact.rs", "(collider.friction * push / speed).min(1.0)", "collider.friction * push / speed"),
    expression(129, "collide/contact.rs", "-(1.0 + collider.restitution) * approach", "-approach"),
    expression(130, "collide/contact.rs", "v - vec3::<f64>(collider.velocity)", "*v"),
    text(131, "collide/contact.rs", "        if distance >= collider.margin {", "        if distance >= (if crate::mutant(131) { 0.0 } else { collider.margin }) {"),
    expression(132, "parallel/mod.rs", "elements.len().next_power_of_two() / 2", "elements.len() / 2"),
    text(133, "parallel/order.rs", "                axes[0] ^= below;", "                if !crate::mutant(133) { axes[0] ^= below; }"),
    text(134, "cloth/sell.rs", "            let mut neighbours = std::array::from_fn(|lane| (first + lane.min(rows.len() - 1)) as u32);", "            let mut neighbours = std::array::from_fn(|lane| if crate::mutant(134) { 0 } else { (first + lane.min(rows.len() - 1)) as u32 });"),
];
