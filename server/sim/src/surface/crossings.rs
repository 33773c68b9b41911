//! How many edges of a surface cross its triangles, counted exactly, and the first that does.

use std::ops::ControlFlow;

use super::{faces::Faces, predicates::crosses, tree::Tree};
use crate::{
    interrupt::{Interrupt, Interrupted},
    math::{Vec3, array3},
};

/// An edge and a triangle that it crosses, by the numbers of their particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crossing {
    /// Both ends of the edge.
    pub edge: [u32; 2],
    /// The corners of the triangle.
    pub triangle: [u32; 3],
}

/// Counts crossings, with memory that serves from one count to the next.
#[derive(Clone, Debug)]
pub struct Crossings {
    tree: Tree,
    /// Of each block of triangles.
    found: Vec<Found>,
}

/// What a block of triangles has found.
#[derive(Clone, Debug, Default)]
struct Found {
    count: u64,
    first: Option<Crossing>,
}

impl Crossings {
    /// Room for the count over these faces.
    pub fn new(faces: &Faces) -> Self {
        Self { tree: Tree::new(faces.triangles().len()), found: Vec::new() }
    }

    /// How many pairs there are of an edge and a triangle that it crosses, by the rule of [`crosses`], of those that share no
    /// particle and are not both of figures; and the first of them: in the order of the lower of the two triangles that the pair belongs to, then of the
    /// other.
    ///
    /// `x` gives the place (m, finite) of a particle.
    ///
    /// # Errors
    /// When the count is given up.
    ///
    /// # Panics
    /// When the faces are not as many as this was made for.
    pub fn count(
        &mut self,
        faces: &Faces,
        x: &(dyn Fn(u32) -> Vec3<f64> + Sync),
        interrupt: &Interrupt,
    ) -> Result<(u64, Option<Crossing>), Interrupted> {
        self.look(faces, x, &|_| true, u64::MAX, interrupt)?;
        Ok((self.found.iter().map(|found| found.count).sum(), self.first()))
    }

    /// The first of those pairs that count, by their particles: the ends of the edge, then the corners of the triangle. Nothing is
    /// looked for behind it.
    ///
    /// # Errors
    /// When the search is given up.
    ///
    /// # Panics
    /// When the faces are not as many as this was made for.
    pub fn first_of(
        &mut self,
        faces: &Faces,
        x: &(dyn Fn(u32) -> Vec3<f64> + Sync),
        counts: &(dyn Fn(&[u32]) -> bool + Sync),
        interrupt: &Interrupt,
    ) -> Result<Option<Crossing>, Interrupted> {
        self.look(faces, x, counts, 0, interrupt)?;
        Ok(self.first())
    }

    /// Looks at all blocks, up to the first one that has found more than `most`.
    fn look(
        &mut self,
        faces: &Faces,
        x: &(dyn Fn(u32) -> Vec3<f64> + Sync),
        counts: &(dyn Fn(&[u32]) -> bool + Sync),
        most: u64,
        interrupt: &Interrupt,
    ) -> Result<(), Interrupted> {
        let Self { tree, found } = self;
        let triangles = faces.triangles();
        tree.refit(&|face| {
            let [a, b, c] = triangles[face].map(|corner| array3(&x(corner)));
            let low = [0, 1, 2].map(|k| a[k].min(b[k]).min(c[k]));
            let high = [0, 1, 2].map(|k| a[k].max(b[k]).max(c[k]));
            [low, high]
        });
        tree.partners(found, interrupt, |found: &mut Found, face, partners| {
            for other in partners.iter().filter(|other| faces.meet(face, **other)) {
                for (from, to) in [(face, *other), (*other, face)] {
                    found.look(faces, x, [from, to], counts);
                }
            }
            if found.count > most { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    }

    /// The first that was found: blocks behind one that broke off may have found some too.
    fn first(&self) -> Option<Crossing> {
        self.found.iter().find_map(|found| found.first)
    }
}

impl Found {
    /// Looks at the edges of one triangle and at another one.
    fn look(
        &mut self,
        faces: &Faces,
        x: &(dyn Fn(u32) -> Vec3<f64> + Sync),
        [from, to]: [usize; 2],
        counts: &(dyn Fn(&[u32]) -> bool + Sync),
    ) {
        let triangle @ [a, b, c] = faces.triangles()[to];
        for edge @ [p, q] in faces.edges(from) {
            let shares = edge.iter().any(|end| triangle.contains(end));
            if !shares && crosses(edge.map(x), triangle.map(x)) && counts(&[p, q, a, b, c]) {
                self.count += 1;
                self.first.get_or_insert(Crossing { edge, triangle });
            }
        }
    }
}
