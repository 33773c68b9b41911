//! The bodies that a cloth consists of: one, or all that have a thickness; whose particle is which.

use std::ops::Range;

use crate::world::setup::{
    BodySetup,
    topology::{BodyRole, BodyTopology},
};

/// Bodies that a message names, at most.
const NAMED: usize = 4;

/// A body within a cloth.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) name: String,
    /// Index of its first particle among all.
    pub(crate) first_particle: u32,
    /// Its particles in the user's numbering of the cloth.
    pub(crate) own: Range<u32>,
    /// Its entries in the cloth's table of laws.
    pub(crate) laws: Range<usize>,
    role: BodyRole,
    /// For drawing, in the user's numbering of the body.
    triangles: Vec<[u32; 3]>,
    springs: Vec<[u32; 2]>,
    uv: Vec<[f64; 2]>,
}

impl Part {
    /// A body whose first particle among all is given, with its particles and its laws in the cloth.
    pub(crate) fn new(setup: &BodySetup, first_particle: u32, own: Range<u32>, laws: Range<usize>) -> Self {
        let BodySetup { name, network, .. } = setup;
        Self {
            name: name.clone(),
            first_particle,
            own,
            laws,
            role: if network.is_figure() { BodyRole::Figure } else { BodyRole::Cloth },
            triangles: network.triangles.clone(),
            springs: network.springs.iter().map(|spring| spring.particles).collect(),
            uv: network.uv.clone(),
        }
    }

    /// Number of its particles.
    pub(crate) fn count(&self) -> usize {
        self.own.len()
    }

    /// Whether frames lead it.
    pub(crate) fn is_figure(&self) -> bool {
        self.role == BodyRole::Figure
    }

    /// Its particles among all.
    pub(crate) fn of_all_bodies(&self) -> Range<u32> {
        self.first_particle..self.first_particle + self.own.len() as u32
    }

    /// What frames refer to; particles are asked for by their numbers in the cloth, masses are in kg.
    pub(crate) fn topology(
        &self,
        is_pinned: impl Fn(u32) -> bool,
        mass: impl Fn(u32) -> f64,
    ) -> BodyTopology {
        let first = self.first_particle;
        // Corners of figures are no pins that anybody set.
        let pins = self.own.clone().filter(|own| !self.is_figure() && is_pinned(*own));
        let pins = pins.map(|own| self.of_all(own));
        BodyTopology {
            name: self.name.clone(),
            role: self.role,
            first_particle: first,
            particle_count: self.count() as u32,
            triangles: self.triangles.iter().map(|t| t.map(|p| p + first)).collect(),
            springs: self.springs.iter().map(|s| s.map(|p| p + first)).collect(),
            pins: pins.collect(),
            uv: self.uv.clone(),
            // That by which a corner gives way is no weight.
            masses: self.own.clone().map(|own| if self.is_figure() { 0.0 } else { mass(own) }).collect(),
            volumes: Vec::new(),
        }
    }

    /// Number among all particles of one of the cloth's, which is its own.
    fn of_all(&self, own: u32) -> u32 {
        self.first_particle + (own - self.own.start)
    }
}

/// The bodies of a cloth, in the order of the setup. Others may stand between them.
#[derive(Clone, Debug)]
pub(crate) struct Parts {
    parts: Vec<Part>,
    /// Their names, one after the other.
    names: String,
}

impl Parts {
    /// One body or more, whose particles in the cloth follow each other.
    pub(crate) fn new(parts: Vec<Part>) -> Self {
        let names = list(parts.iter(), parts.len());
        Self { parts, names }
    }

    /// What all of them together are called: the name of the body if there is one.
    pub(crate) fn names(&self) -> &str {
        &self.names
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &Part> {
        self.parts.iter()
    }

    /// The body of that name, if it is one of them.
    pub(crate) fn named(&self, name: &str) -> Option<&Part> {
        self.parts.iter().find(|part| part.name == name)
    }

    /// What the others are called, figures left out, which feel no air; nothing where there are none.
    pub(crate) fn beside(&self, name: &str) -> String {
        let others = || self.parts.iter().filter(|part| part.name != name && !part.is_figure());
        list(others(), others().count())
    }

    /// The body of a particle of the cloth.
    pub(crate) fn of(&self, own: u32) -> &Part {
        &self.parts[self.parts.partition_point(|part| part.own.start <= own) - 1]
    }

    /// Number among all particles of one of the cloth's.
    pub(crate) fn of_all(&self, own: u32) -> u32 {
        self.of(own).of_all(own)
    }

    /// Number in the cloth of a particle among all, if it is one of its own.
    pub(crate) fn own(&self, particle: u32) -> Option<u32> {
        self.parts.iter().find_map(|part| {
            let within = particle.checked_sub(part.first_particle)?;
            (within < part.own.len() as u32).then(|| part.own.start + within)
        })
    }
}

/// The names of the first of so many bodies, and how many more there are.
fn list<'a>(parts: impl Iterator<Item = &'a Part>, count: usize) -> String {
    let names: Vec<&str> = parts.take(NAMED).map(|part| part.name.as_str()).collect();
    match count.saturating_sub(NAMED) {
        0 => names.join(", "),
        more => format!("{} and {more} more", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloth::{ClothSettings, Network};

    #[test]
    fn numbers_are_those_of_each_body_where_others_stand_between() {
        let part = |name: &str, first_particle, own| {
            let (network, settings) = (Network::default(), ClothSettings::default());
            let setup = BodySetup { name: name.to_owned(), network, settings, forces: Vec::new() };
            Part::new(&setup, first_particle, own, 0..0)
        };
        let parts = Parts::new(vec![part("one", 2, 0..3), part("other", 9, 3..5)]);
        assert_eq!(parts.names(), "one, other");
        assert_eq!([0, 2, 3, 4].map(|own| parts.of_all(own)), [2, 4, 9, 10]);
        assert_eq!([2, 4, 9, 10].map(|particle| parts.own(particle)), [0, 2, 3, 4].map(Some));
        assert_eq!([1, 5, 8, 11].map(|particle| parts.own(particle)), [None; 4]);
        assert_eq!([2, 3].map(|own| parts.of(own).name.as_str()), ["one", "other"]);
        assert_eq!(parts.beside("other"), "one");
        assert!(parts.named("third").is_none());
        let parts = Parts::new(["a", "b", "c", "d", "e", "f"].map(|name| part(name, 0, 0..0)).into());
        assert_eq!(parts.names(), "a, b, c, d and 2 more");
        assert_eq!(
            [parts.beside("a"), parts.beside("f")],
            ["b, c, d, e and 1 more", "a, b, c, d and 1 more"]
        );
    }
}
