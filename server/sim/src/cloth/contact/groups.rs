//! Parts of a cloth that push each other, as one: what a group of them does as a whole follows from what acts on it from outside, like
//! what a part alone does, unless pins hold it or a collider pushes it.

use super::{pair::Pair, pushing::pushing, wall::Wall};
use crate::{
    cloth::layout::{Model, Part, Pushed},
    math::{Real, Vec3},
};

/// The groups of a solve.
#[derive(Clone, Debug, Default)]
pub(crate) struct Groups {
    /// Of each part another one of its group, up to the first.
    towards: Vec<u32>,
    /// The group of each part.
    of_part: Vec<u32>,
    /// What is known of each group: it is held by pins, by figures, or by colliders.
    pub(crate) all: Vec<Part>,
    /// Mass (kg) of particles that colliders push, and that times the velocities (kg m/s) of their surfaces.
    touched: Vec<(f64, Vec3<f64>)>,
    /// Whether pins or figures hold each, and whether pins of cloth do.
    has_pins: Vec<bool>,
    has_pinned_cloth: Vec<bool>,
    pushed: Vec<Pushed>,
    /// The velocity (m/s) from which a group is seen: of one that is held, that of the pins, of its figures, or of the colliders that push it.
    pub(crate) frames: Vec<Vec3<f64>>,
}

impl Groups {
    /// Takes over which parts push each other, and which of them colliders push.
    pub(super) fn find<R: Real>(&mut self, model: &Model<R>, pairs: &[Pair], walls: &[Vec<Wall>]) {
        let parts = model.parts.all();
        self.towards.clear();
        self.towards.extend(0..parts.len() as u32);
        for pair in pairs.iter().filter(|pair| parts.len() > 1 && pair.hold.activity.pushes()) {
            let [first, .., last] = pair.stencil.corners.map(|corner| model.parts.of_row(corner as usize));
            let (one, other) = (self.first_of(first), self.first_of(last));
            self.towards[one.max(other)] = one.min(other) as u32;
        }
        self.of_part.clear();
        self.has_pins.clear();
        self.has_pinned_cloth.clear();
        self.all.clear();
        self.touched.clear();
        for (number, part) in parts.iter().enumerate() {
            let first = self.first_of(number);
            let group = if first == number {
                self.all.push(Part::default());
                self.touched.push((0.0, Vec3::zeros()));
                self.has_pins.push(false);
                self.has_pinned_cloth.push(false);
                self.all.len() as u32 - 1
            } else {
                self.of_part[first]
            };
            self.of_part.push(group);
            let group = group as usize;
            let all = &mut self.all[group];
            (all.mass, all.count) = (all.mass + part.mass, all.count + part.count);
            all.is_held |= part.is_held;
            all.led += part.led;
            self.has_pins[group] |= part.is_held;
            self.has_pinned_cloth[group] |= part.is_held && part.led == 0;
        }
        for wall in walls.iter().flatten().filter(|wall| wall.hold.activity.pushes()) {
            let row = wall.particle();
            let group = self.of_row(model, row);
            let (mass, along) = &mut self.touched[group];
            let m = model.m[row].to_f64();
            (*mass, *along) = (*mass + m, *along + wall.velocity * m);
            self.all[group].is_held = true;
        }
        self.frames.clear();
        self.frames.resize(self.all.len(), Vec3::zeros());
    }

    fn first_of(&self, part: usize) -> usize {
        let mut part = part;
        while self.towards[part] as usize != part {
            part = self.towards[part] as usize;
        }
        part
    }

    /// The group of a row.
    pub(super) fn of_row<R: Real>(&self, model: &Model<R>, row: usize) -> usize {
        self.of_part[model.parts.of_row(row)] as usize
    }

    /// Takes over what walls push each group with in steps of `dt` (s), where particles go at velocities (m/s).
    pub(super) fn feel<R: Real>(
        &mut self,
        model: &Model<R>,
        walls: &[Vec<Wall>],
        (velocity, dt): (impl Fn(usize) -> Vec3<f64>, f64),
    ) {
        self.pushed.clear();
        self.pushed.resize(self.all.len(), Pushed::default());
        for push in pushing(&[], walls) {
            let pushed = push.pushed(&push.relative(&velocity), dt);
            let group = self.of_row(model, push.stencil.corners[0] as usize);
            let sum = &mut self.pushed[group];
            (sum.impulse, sum.matrix) = (sum.impulse + pushed.impulse, sum.matrix + pushed.matrix);
        }
    }

    /// What colliders push a group with; nothing is known of one that pins hold.
    pub(crate) fn pushed(&self, group: usize) -> Option<&Pushed> {
        if self.has_pins[group] { None } else { Some(&self.pushed[group]) }
    }

    /// The group of each part.
    pub(crate) fn of_part(&self) -> &[u32] {
        &self.of_part
    }

    /// Sees each group from what holds it: the pins of cloth, which move with a mean velocity (m/s), or else its figures, of whose corners the
    /// velocities (m/s) add up to what `corners` gives. A figure says nothing of cloth that it does not touch.
    pub(crate) fn see_from(&mut self, pins: Vec3<f64>, corners: impl Fn(usize) -> Vec3<f64>) {
        for (group, frame) in self.frames.iter_mut().enumerate() {
            let (led, (mass, along)) = (self.all[group].led, &self.touched[group]);
            *frame = if led > 0 && !self.has_pinned_cloth[group] {
                corners(group) / f64::from(led)
            } else if self.has_pins[group] || *mass == 0.0 {
                pins
            } else {
                along / *mass
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_figures_alone_hold_is_seen_from_their_corners_and_all_else_from_pins_or_colliders() {
        let part = |is_held, led| Part { is_held, led, ..Part::default() };
        let untouched = (0.0, Vec3::zeros());
        // Held by pins, by a figure of two corners, by both, by nothing, by a collider.
        let mut groups = Groups {
            all: vec![part(true, 0), part(true, 2), part(true, 2), part(false, 0), part(true, 0)],
            touched: vec![untouched, untouched, untouched, untouched, (2.0, Vec3::new(0.0, 0.0, 6.0))],
            has_pins: vec![true, true, true, false, false],
            has_pinned_cloth: vec![true, false, true, false, false],
            frames: vec![Vec3::zeros(); 5],
            ..Groups::default()
        };
        let pins = Vec3::new(0.0, 1.0, 0.0);
        groups.see_from(pins, |_| Vec3::new(60.0, 0.0, 0.0));
        let [figure, collider] = [Vec3::new(30.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 3.0)];
        assert_eq!(groups.frames, [pins, figure, pins, pins, collider]);
    }
}
