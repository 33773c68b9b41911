//! Mutants of the contact of cloth with cloth.
//!
//! Each leaves out or falsifies one rule of the search, the rounds, the certificate, friction, acceptance, or bodies side
//! by side.

use super::patch::{Patch, expression, text};

/// Part of the names of tests that are run: nothing else has a thickness.
pub(super) const ONLY: [&str; 1] = ["surface::"];

/// Parts of the names of tests that are left out.
pub(super) const SLOW: [&str; 7] = [
    "flung_about_in_boxes",
    "that_fall_on_a_ball_cross",
    "folded_twice_and_let_go",
    "surface::twisted",
    "surface::linked",
    "cloth_that_rubs_on_itself",
    "a_pile_with_friction",
];

/// What each mutant does wrong, in the order of their numbers, from 201.
pub(super) const NAMES: [&str; 12] = [
    "surfaces without certificates",
    "certificates that look at ends before they are rounded",
    "boxes of surfaces without their ways",
    "pairs that are not looked for again where particles end elsewhere",
    "pairs that are dropped once and pull for ever after",
    "colliders left out of the solve of surfaces",
    "a bound on triangles beside each other blind to folds",
    "pairs looked for within their thickness, whatever their ways",
    "cloth without friction on cloth",
    "acceptance blind to the energy of pairs",
    "the thickness of the first of two bodies in place of their mean",
    "springs of all bodies changed in place of one body's",
];

/// The patches that make the mutants, in the order of their numbers.
#[rustfmt::skip] // one line per patch where it fits
pub(super) const PATCHES: [Patch; 13] = [
    expression(201, "cloth/contact/rounds.rs", "!is_safe(pair, start, end, floor)", "false"),
    text(202, "cloth/contact/rounds.rs", "                let (start, end) = (at(&state.x), at(&ends[0]));", "                let (start, mut end) = (at(&state.x), at(&ends[0]));\n                if crate::mutant(202) { end = at(&state.x); for (x, v) in end.iter_mut().zip(at(&next.v)) { *x += v * dt; } }"),
    expression(202, "cloth/contact/rounds.rs", "FLOOR * R::ROUNDING * largest", "0.0"),
    expression(203, "cloth/contact/ways.rs", "x + expectedly", "x"),
    expression(204, "cloth/contact/rounds.rs", "self.search.ways.left(&self.ends[0][..model.count])", "None"),
    expression(205, "cloth/contact/hold.rs", "pull > SHORT && round >= LATE", "false"),
    text(206, "cloth/contact/rounds.rs", "                Wall::list(model, block, colliders, from, (sub_step, steps), walls);", "                if !crate::mutant(206) { Wall::list(model, block, colliders, from, (sub_step, steps), walls); }"),
    expression(207, "surface/beside.rs", "stretch * least - deviation.sqrt()", "stretch * least"),
    expression(208, "cloth/contact/ways.rs", "furthest(kind, expected) + (self.reach(corners[0]) + self.reach(corners[3]))", "self.reach(corners[0]) + self.reach(corners[3])"),
    text(209, "cloth/contact/rounds.rs", "        let Scene { model, surface, state, sub_step: SubStep { dt, .. }, friction, .. } = scene;", "        let Scene { model, surface, state, sub_step: SubStep { dt, .. }, friction, .. } = scene;\n        let friction = if crate::mutant(209) { 0.0 } else { friction };"),
    expression(210, "cloth/judge/accept.rs", "after.pairs", "PairEnergy { start: 0.0, at_velocity: 0.0, end: 0.0, ..after.pairs }"),
    expression(211, "cloth/layout/surface.rs", "0.5 * (one + other)", "one"),
    expression(212, "world/body/cloth_parameters.rs", "parameters.laws[part.laws.clone()].iter_mut()", "parameters.laws.iter_mut()"),
];
