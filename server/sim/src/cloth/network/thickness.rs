//! What a thickness asks of a network, and where a surface crosses itself.

use std::fmt;

use super::description::Network;
use crate::{
    cloth::settings::{ClothSettings, Integrator, MinimizerKind},
    interrupt,
    linalg::{OperatorKind, PreconditionerKind},
    math::{
        Vec3,
        array::{length, minus},
        array3, four_digits, number,
    },
    parallel::hilbert_order,
    surface::{Crossing, Crossings, Faces, touching},
};

/// Edges of a surface that cross triangles of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crossed {
    /// Pairs of an edge and a triangle, none of which has a particle in common; at least 1.
    pub count: u64,
    /// The ends of the first edge, in the user's numbering of the body.
    pub edge: [u32; 2],
    /// The corners of the triangle that it crosses.
    pub triangle: [u32; 3],
}

impl fmt::Display for Crossed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { count, edge: [p, q], triangle: [a, b, c] } = self;
        match count {
            1 => f.write_str("an edge crosses a triangle: ")?,
            _ => write!(f, "{count} times an edge crosses a triangle, first ")?,
        }
        write!(f, "that of particles {p} and {q} crosses that of {a}, {b} and {c}")
    }
}

impl Network {
    /// Why its surface cannot keep its thickness where it is stepped so, as what a sentence says of the thickness; none
    /// where it can, and where it has none.
    pub fn invalid_thickness(&self, settings: &ClothSettings) -> Option<String> {
        let thickness = self.thickness;
        if !thickness.is_finite() || thickness < 0.0 {
            return Some(format!("is {thickness} m: a finite number from 0 is needed"));
        }
        if thickness == 0.0 {
            return None;
        }
        let told = number(thickness);
        let only = |what: &str, name: &str, by: &str| {
            format!("is {told} m, and {what} {name}: surfaces are kept apart by {by} alone")
        };
        let ClothSettings { integrator, minimizer, time_step, solver, .. } = settings;
        if *integrator != Integrator::ImplicitEuler {
            return Some(only("the integrator is", integrator.name(), Integrator::ImplicitEuler.name()));
        }
        if !matches!(minimizer.kind(), MinimizerKind::Auto | MinimizerKind::OneStep) {
            return Some(only("the minimizer is", minimizer.kind().name(), MinimizerKind::OneStep.name()));
        }
        if time_step.is_unchecked() {
            return Some(only("steps are", "unchecked", "steps that are checked"));
        }
        if solver.operator != OperatorKind::MatrixFree {
            return Some(only("the operator is", solver.operator.name(), OperatorKind::MatrixFree.name()));
        }
        // Its functions and its steps are made for parts that join what is near at rest.
        if solver.preconditioner == PreconditionerKind::Patches {
            let name = solver.preconditioner.name();
            return Some(only("the preconditioner is", name, "solves with another one"));
        }
        let Some((shortest, [a, b])) = self.shortest_edge() else {
            return Some(format!("is {told} m, and there are no triangles: only triangles make a surface"));
        };
        // A figure does not meet itself, and so has no neighbours to be told from.
        if self.is_figure() {
            return None;
        }
        // Closer ones could not be told from neighbours.
        if thickness > 0.5 * shortest {
            let [length, allowed] = [shortest, 0.5 * shortest].map(number);
            return Some(format!(
                "is {told} m, above half of the shortest edge, which is {length} m long, from particle {a} to {b}: allowed \
                 is at most {allowed}"
            ));
        }
        // What lies beside a sliver is nearer than that to what lies on its other side.
        let (height, [a, b, c]) = self.flattest_triangle().filter(|(height, _)| thickness > *height)?;
        let height = four_digits(height);
        Some(format!(
            "is {told} m, above the height of the flattest triangle, of particles {a}, {b} and {c}, which is {height} m and the most \
             that is allowed (a mesh without such slivers allows more)"
        ))
    }

    /// The least height (m) of a triangle over its longest side, and its corners; none without triangles.
    fn flattest_triangle(&self) -> Option<(f64, [u32; 3])> {
        let mut flattest: Option<(f64, [u32; 3])> = None;
        for corners in &self.triangles {
            interrupt::point();
            let [Some(a), Some(b), Some(c)] = corners.map(|corner| self.x.get(corner as usize)) else {
                continue;
            };
            let sides = [minus(*b, *a), minus(*c, *b), minus(*a, *c)];
            let longest = sides.map(length).into_iter().fold(0.0, f64::max);
            let height = Vec3::from(sides[0]).cross(&Vec3::from(sides[1])).norm() / longest;
            if flattest.is_none_or(|(least, _)| height < least) {
                flattest = Some((height, *corners));
            }
        }
        flattest
    }

    /// The length (m) of the shortest edge of its triangles, and its ends; none without triangles. Corners that are no
    /// particles are left to the check that refuses them.
    fn shortest_edge(&self) -> Option<(f64, [u32; 2])> {
        let mut shortest: Option<(f64, [u32; 2])> = None;
        for [a, b, c] in &self.triangles {
            interrupt::point();
            for [from, to] in [[*a, *b], [*b, *c], [*c, *a]] {
                let ends = [from, to].map(|end| self.x.get(end as usize));
                let [Some(p), Some(q)] = ends else { continue };
                let length = length(minus(*q, *p));
                if from != to && shortest.is_none_or(|(least, _)| length < least) {
                    shortest = Some((length, [from, to]));
                }
            }
        }
        shortest
    }

    /// How often edges of its triangles cross others of them at the start, exactly, and the first pair; none where none does, and of a figure,
    /// which does not meet itself.
    ///
    /// # Panics
    /// If a triangle names a particle that is not there.
    pub fn crossed(&self) -> Option<Crossed> {
        let faces = self.faces().filter(|_| !self.is_figure())?;
        let place = |particle: u32| Vec3::from(self.x[particle as usize]);
        let mut crossings = Crossings::new(&faces);
        let (count, first) = interrupt::shared(|interrupt| crossings.count(&faces, &place, interrupt));
        first.map(|Crossing { edge, triangle }| Crossed { count, edge, triangle })
    }

    /// The first of these pairs, without a count of the others.
    ///
    /// # Panics
    /// If a triangle names a particle that is not there.
    pub fn first_crossing(&self) -> Option<Crossing> {
        self.first_crossing_of(&|_| true)
    }

    /// The first of those pairs that count, by their particles: the ends of the edge, then the corners of the triangle.
    ///
    /// # Panics
    /// If a triangle names a particle that is not there.
    pub(crate) fn first_crossing_of(&self, counts: &(dyn Fn(&[u32]) -> bool + Sync)) -> Option<Crossing> {
        let faces = self.faces()?;
        let place = |particle: u32| Vec3::from(self.x[particle as usize]);
        let mut crossings = Crossings::new(&faces);
        interrupt::shared(|interrupt| crossings.first_of(&faces, &place, counts, interrupt))
    }

    /// A particle of each of two parts of its surface, an edge or a corner and a triangle, that touch at the start, share no particle and count, by
    /// their particles; none where none do.
    ///
    /// # Panics
    /// If a triangle names a particle that is not there.
    pub(crate) fn touching_of(&self, counts: &(dyn Fn(&[u32]) -> bool + Sync)) -> Option<[u32; 2]> {
        let faces = self.faces()?;
        let place = |particle: u32| Vec3::from(self.x[particle as usize]);
        interrupt::shared(|interrupt| touching(&faces, &place, counts, interrupt))
    }

    /// Its triangles, those near each other beside each other; none where all of them name a particle twice.
    fn faces(&self) -> Option<Faces> {
        let is_degenerate = |[a, b, c]: &[u32; 3]| a == b || b == c || c == a;
        if self.triangles.iter().all(is_degenerate) {
            return None;
        }
        let place = |particle: u32| Vec3::from(self.x[particle as usize]);
        // Triangles that are near each other stand near each other in the tree.
        let middle = |[a, b, c]: &[u32; 3]| {
            interrupt::point();
            array3(&((place(*a) + place(*b) + place(*c)) / 3.0))
        };
        let middles: Vec<[f64; 3]> = self.triangles.iter().map(middle).collect();
        let order = hilbert_order(&middles, 0.0);
        let triangles: Vec<[u32; 3]> = order.iter().map(|i| self.triangles[*i as usize]).collect();
        Some(Faces::new(&triangles, self.x.len()))
    }
}
