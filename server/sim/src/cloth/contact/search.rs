//! Looks for pairs of parts that could meet in a sub-step.

use super::{
    pair::{Activity, Pair},
    ways::{Start, Ways, wide},
};
use crate::{
    cloth::layout::{Model, Surface},
    math::{Padded, Real},
    parallel::{Own, per_row, per_row_mut},
    surface::{Candidate, Crowded, Tree},
};

/// Candidates that a thread looks at in one go.
const GO: usize = 64;

/// Memory of the search, and the ways that it was made for.
#[derive(Clone, Debug, Default)]
pub(crate) struct Search {
    tree: Option<Tree>,
    pub(crate) ways: Ways,
    candidates: Vec<Candidate>,
    /// Of each candidate, whether it is near enough.
    looked: Vec<Option<Pair>>,
    /// What pairs of the search before did, in the order of their corners.
    before: Vec<Pair>,
}

impl Search {
    /// Pairs of a sub-step that begins so, in a fixed order.
    pub(crate) fn begin<R: Real>(
        &mut self,
        model: &Model<R>,
        surface: &Surface,
        start: Start<'_, R>,
        pairs: &mut Vec<Pair>,
    ) -> Result<(), Crowded> {
        self.ways.predict(model, start, surface.thickness);
        self.look(model, surface, [start.x, start.v], pairs)
    }

    /// Pairs for the ways to where a solve led; those that were known go on as they were.
    pub(crate) fn again<R: Real>(
        &mut self,
        model: &Model<R>,
        surface: &Surface,
        (from, to): ([&[Padded<R>]; 2], &[Padded<R>]),
        pairs: &mut Vec<Pair>,
    ) -> Result<(), Crowded> {
        self.before.clear();
        self.before.extend(pairs.iter().filter(|pair| pair.activity != Activity::Idle));
        self.before.sort_unstable_by_key(|pair| pair.candidate);
        self.ways.follow(model, from[0], to);
        self.look(model, surface, from, pairs)?;
        for pair in pairs {
            if let Ok(place) = self.before.binary_search_by_key(&pair.candidate, |pair| pair.candidate) {
                pair.go_on(&self.before[place]);
            }
        }
        Ok(())
    }

    fn look<R: Real>(
        &mut self,
        model: &Model<R>,
        surface: &Surface,
        [x, v]: [&[Padded<R>]; 2],
        pairs: &mut Vec<Pair>,
    ) -> Result<(), Crowded> {
        let Self { tree, ways, candidates, looked, .. } = self;
        let (faces, ways) = (&surface.faces, &*ways);
        let tree = tree.get_or_insert_with(|| Tree::new(faces.triangles().len()));
        tree.refit(&|face| ways.around(&faces.triangles()[face]));
        let is_pinned = |particle: u32| model.inv_m[particle as usize] == R::zero();
        tree.candidates(faces, &is_pinned, &|part| ways.around(part), candidates)?;

        looked.resize(candidates.len(), None);
        let fields = (per_row_mut(looked), per_row(candidates));
        Own::whole(candidates.len(), GO).each(fields, |_, (looked, candidates)| {
            for (looked, candidate) in looked.iter_mut().zip(candidates) {
                let corners = candidate.corners;
                let at = corners.map(|corner| wide(&x[corner as usize]));
                let inv_m = corners.map(|corner| model.inv_m[corner as usize].to_f64());
                let ways = corners.map(|corner| ways.of(x, corner));
                let v = corners.map(|corner| wide(&v[corner as usize]));
                *looked = Pair::near(surface, *candidate, at, inv_m, (ways, v));
            }
        });
        pairs.clear();
        pairs.extend(looked.iter().flatten());
        Ok(())
    }
}
