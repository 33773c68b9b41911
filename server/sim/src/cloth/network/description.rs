//! The description of a cloth before it is laid out for computing: particles, springs, pins, in
//! the user's own numbering and in binary64.
//!
//! A scene builds it; `Model::new` turns it into arrays for the kernels.

use serde::{Deserialize, Serialize};

use std::collections::BTreeSet;

use super::{continuations::straight_continuations, frames::Frames};
use crate::{
    cloth::laws::{Air, Bending, ElementKind, Listed, Threads, WarpError, no_warp},
    interrupt,
    math::array::{length, minus},
    mesh::{MeshSpring, TriangleMesh},
};

pub use crate::mesh::SpringKind;

/// Stiffness and damping of a spring: f = -k (l - l0) u - nu ((v_i - v_j).u) u.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpringLaw {
    /// Stiffness k (N/m), 0 or more.
    pub stiffness: f64,
    /// Damping nu along the spring (N s/m), 0 or more.
    pub damping: f64,
}

/// A spring between two particles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spring {
    /// Its ends, user's numbering.
    pub particles: [u32; 2],
    /// What it resists.
    pub kind: SpringKind,
    /// Rest length l0 (m), 0 or more.
    pub rest_length: f64,
    /// Stiffness and damping.
    pub law: SpringLaw,
}

/// Elements of a body under one law, with one stiffness and one damping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ElementList {
    /// The law that all of them follow.
    pub kind: ElementKind,
    /// Stiffness and damping, in the units that the law's page gives; of a membrane what its shares are multiplied by.
    pub law: SpringLaw,
    /// Their particles in the user's numbering, one element after the other.
    pub(crate) particles: Vec<u32>,
    /// Numbers of each element that never change.
    pub(crate) rest: Vec<f64>,
    /// What the mesh makes of the bending stiffness, under a law that asks.
    pub(crate) bending: Option<Bending>,
    /// The threads of a fabric, under a law that asks.
    pub(crate) threads: Threads,
}

impl ElementList {
    /// The elements that a law gives a mesh, at rest as it lies. Those of a membrane have the threads of
    /// [`Threads::default`].
    ///
    /// # Panics
    /// On a mesh that [`TriangleMesh::check`] refuses.
    pub fn new(kind: ElementKind, law: SpringLaw, mesh: &TriangleMesh) -> Self {
        Self::made(kind, law, Threads::default(), mesh)
    }

    /// The elements of a membrane on a mesh, at rest as it lies. Along warp and weft and against shear it has the stiffness
    /// (N/m) and the damping (N s/m) of the law times the shares of the threads.
    ///
    /// # Errors
    /// Where the warp has no direction.
    ///
    /// # Panics
    /// On a mesh that [`TriangleMesh::check`] refuses.
    pub fn membrane(law: SpringLaw, threads: Threads, mesh: &TriangleMesh) -> Result<Self, WarpError> {
        match no_warp(mesh, threads.warp) {
            Some(error) => Err(error),
            None => Ok(Self::made(ElementKind::Membrane, law, threads, mesh)),
        }
    }

    /// The elements of the same law on a mesh, at rest as it lies; those without a warp are left out.
    ///
    /// # Panics
    /// On a mesh that [`TriangleMesh::check`] refuses.
    #[must_use]
    pub fn on(&self, mesh: &TriangleMesh) -> Self {
        Self::made(self.kind, self.law, self.threads, mesh)
    }

    fn made(kind: ElementKind, law: SpringLaw, threads: Threads, mesh: &TriangleMesh) -> Self {
        let Listed { particles, rest, bending } = kind.list(mesh, &threads);
        Self { kind, law, particles, rest, bending, threads }
    }

    /// The threads of its fabric, of a membrane.
    pub fn threads(&self) -> Option<Threads> {
        (self.kind == ElementKind::Membrane).then_some(self.threads)
    }

    /// Stiffness (N/m) and damping (N s/m) that a spring would have which takes as much of a step, of all elements together.
    pub fn as_springs(&self) -> [f64; 2] {
        // Each end of a spring has a share of twice its stiffness.
        let share = 0.25 * self.kind.total_share(&self.rest);
        [share * self.law.stiffness, share * self.law.damping]
    }

    /// What the mesh makes of the bending stiffness, of a plate.
    pub const fn bending(&self) -> Option<Bending> {
        self.bending
    }

    /// Particles of all elements together.
    pub fn corner_count(&self) -> usize {
        self.particles.len()
    }
}

/// Which springs a mesh gets; `None` leaves a kind out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringRules {
    /// On edges; on a lattice, between neighbours along rows and columns.
    pub stretch: SpringLaw,
    /// Across each pair of triangles; on a lattice, along both diagonals of a cell.
    pub shear: Option<SpringLaw>,
    /// Between particles two apart: on a mesh, along the straightest continuation of each edge;
    /// on a lattice, along rows and columns.
    pub bend: Option<SpringLaw>,
}

/// Particles joined by springs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Network {
    /// Positions of the particles (m).
    pub x: Vec<[f64; 3]>,
    /// Velocities (m/s), as many as positions.
    pub v: Vec<[f64; 3]>,
    /// Masses (kg), as many as positions; 0 pins a particle.
    pub masses: Vec<f64>,
    /// Particles pinned whatever their mass.
    pub pins: Vec<u32>,
    /// Springs between particles, each once.
    pub springs: Vec<Spring>,
    /// Elements of three to six particles, a list per law.
    pub elements: Vec<ElementList>,
    /// Linear drag of the medium on each particle (N s/m): f = -drag (v - wind).
    pub drag: f64,
    /// Air that acts on the triangles.
    pub air: Option<Air>,
    /// Distance (m) that its surface keeps from itself; 0: it may cross itself.
    pub thickness: f64,
    /// Triangles, for drawing, for the air and for what keeps a thickness; empty for a chain.
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates, for drawing; empty or as many as positions.
    pub uv: Vec<[f64; 2]>,
    /// Where all its particles are over time, of a figure: nothing else moves them. None: it is cloth.
    pub frames: Option<Frames>,
}

impl Network {
    /// Whether frames lead its particles: it has a surface that cloth meets, and is no cloth.
    pub fn is_figure(&self) -> bool {
        self.frames.is_some()
    }

    /// All pairs of particles that springs or elements join, in the numbering that `place` gives; some more than once, and
    /// particles with themselves.
    pub(crate) fn pairs<'a>(&'a self, place: &'a [u32]) -> impl Iterator<Item = [u32; 2]> + Clone + 'a {
        let row = |particle: u32| place[particle as usize];
        let springs = self.springs.iter().map(move |spring| spring.particles.map(row));
        let elements = self.elements.iter().flat_map(move |list| {
            let corners = list.kind.particles();
            list.particles.chunks_exact(corners).flat_map(move |of_one| {
                (0..corners * corners).map(move |k| [of_one[k / corners], of_one[k % corners]].map(row))
            })
        });
        springs.chain(elements)
    }

    /// Pairs of particles that are next to each other, in the numbering that `place` gives: joined by springs along edges, and
    /// across them where a particle has eight such springs at most, as on a lattice; without these along the sides of membranes,
    /// and without those all pairs.
    pub(crate) fn rings(&self, place: &[u32]) -> Vec<[u32; 2]> {
        let of = |kinds: &[SpringKind]| -> Vec<[u32; 2]> {
            let springs = self.springs.iter().filter(|spring| kinds.contains(&spring.kind));
            springs.map(|spring| spring.particles.map(|particle| place[particle as usize])).collect()
        };
        let near = of(&[SpringKind::Stretch, SpringKind::Shear]);
        let rings = if near.len() <= 4 * self.x.len() { near } else { of(&[SpringKind::Stretch]) };
        if !rings.is_empty() {
            return rings;
        }
        let membranes: Vec<[u32; 2]> =
            self.membrane_sides().map(|side| side.map(|particle| place[particle as usize])).collect();
        if membranes.is_empty() { self.pairs(place).collect() } else { membranes }
    }

    /// Sides of the elements of its membranes, those of two elements twice.
    pub(crate) fn membrane_sides(&self) -> impl Iterator<Item = [u32; 2]> {
        let membranes = self.elements.iter().filter(|list| list.kind == ElementKind::Membrane);
        let triangles = membranes.flat_map(|list| list.particles.as_chunks::<3>().0);
        triangles.flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
    }

    /// Pairs of corners of the triangles that the air acts on, in the numbering that `place` gives; some more than once.
    pub(crate) fn pairs_in_air<'a>(
        &'a self,
        place: &'a [u32],
    ) -> impl Iterator<Item = [u32; 2]> + Clone + 'a {
        let triangles = if self.air.is_some() { &self.triangles[..] } else { &[] };
        triangles.iter().flat_map(move |[a, b, c]| {
            [[a, b], [b, c], [c, a]].map(|pair| pair.map(|corner| place[*corner as usize]))
        })
    }

    /// Springs on a triangle mesh, at rest as it lies. `default_mass` (kg) is the mass of each particle
    /// of a mesh that carries none.
    ///
    /// # Panics
    /// On a mesh that [`TriangleMesh::check`] refuses.
    pub fn from_mesh(mesh: &TriangleMesh, rules: &SpringRules, default_mass: f64) -> Self {
        let mut network = Self::particles_of(mesh, default_mass);
        let mut joined = BTreeSet::new();

        network.join(&mesh.edges(), SpringKind::Stretch, rules.stretch, &mut joined);

        if let Some(law) = rules.shear {
            let across: Vec<_> = mesh.pairs().iter().map(|pair| pair.opposite).collect();
            network.join(&across, SpringKind::Shear, law, &mut joined);
        }

        if let Some(law) = rules.bend {
            network.join(&straight_continuations(mesh), SpringKind::Bend, law, &mut joined);
        }
        network
    }

    /// The springs that a mesh carries; those without a rest length are at rest as it lies. `default_mass` (kg) is the mass of each
    /// particle of a mesh that carries none.
    ///
    /// # Panics
    /// On a mesh that [`TriangleMesh::check`] refuses.
    pub fn from_springs(mesh: &TriangleMesh, default_mass: f64) -> Self {
        let mut network = Self::particles_of(mesh, default_mass);
        network.springs.reserve_exact(mesh.springs.len());
        for &MeshSpring { points, kind, stiffness, damping, rest_length } in &mesh.springs {
            network.add(points, kind, SpringLaw { stiffness, damping });
            if let (Some(length), Some(spring)) = (rest_length, network.springs.last_mut()) {
                spring.rest_length = length;
            }
        }
        network
    }

    /// Springs on a grid of `columns` x `rows` points numbered row by row, at rest as it lies.
    ///
    /// # Panics
    /// Unless the mesh has `columns * rows` points.
    pub fn from_lattice(
        mesh: &TriangleMesh,
        [columns, rows]: [usize; 2],
        rules: &SpringRules,
        default_mass: f64,
    ) -> Self {
        assert_eq!(mesh.points.len(), columns * rows, "a lattice of {columns} x {rows}");
        let mut network = Self::particles_of(mesh, default_mass);

        let kinds = [
            (SpringKind::Stretch, Some(rules.stretch), [[1, 0], [0, 1]]),
            (SpringKind::Shear, rules.shear, [[1, 1], [-1, 1]]),
            (SpringKind::Bend, rules.bend, [[2, 0], [0, 2]]),
        ];
        for (kind, law, offsets) in kinds {
            let Some(law) = law else { continue };
            lattice_pairs([columns as i64, rows as i64], offsets)
                .for_each(|pair| network.add(pair, kind, law));
        }
        network
    }

    fn particles_of(mesh: &TriangleMesh, default_mass: f64) -> Self {
        let count = mesh.points.len();
        Self {
            x: mesh.points.clone(),
            v: vec![[0.0; 3]; count],
            masses: if mesh.masses.is_empty() { vec![default_mass; count] } else { mesh.masses.clone() },
            triangles: mesh.triangles.clone(),
            uv: mesh.uv.clone(),
            ..Self::default()
        }
    }

    /// Adds a spring at rest between each pair that no spring joins yet.
    fn join(
        &mut self,
        pairs: &[[u32; 2]],
        kind: SpringKind,
        law: SpringLaw,
        joined: &mut BTreeSet<[u32; 2]>,
    ) {
        for &[a, b] in pairs {
            if a != b && joined.insert([a.min(b), a.max(b)]) {
                self.add([a, b], kind, law);
            }
        }
    }

    /// Adds a spring at rest.
    fn add(&mut self, [a, b]: [u32; 2], kind: SpringKind, law: SpringLaw) {
        interrupt::point();
        let rest_length = distance(self.x[a as usize], self.x[b as usize]);
        self.springs.push(Spring { particles: [a, b], kind, rest_length, law });
    }
}

/// Pairs of points some columns and rows apart, row by row: each once, for different offsets give different pairs.
fn lattice_pairs([columns, rows]: [i64; 2], offsets: [[i64; 2]; 2]) -> impl Iterator<Item = [u32; 2]> {
    let points = (0..rows).flat_map(move |r| (0..columns).map(move |c| [c, r]));
    points.flat_map(move |[c, r]| {
        let others = offsets.into_iter().map(move |[dc, dr]| [c + dc, r + dr]);
        let within = others.filter(move |[c2, r2]| (0..columns).contains(c2) && *r2 < rows);
        within.map(move |[c2, r2]| [(r * columns + c) as u32, (r2 * columns + c2) as u32])
    })
}

fn distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    length(minus(q, p))
}
