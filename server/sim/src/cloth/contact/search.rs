//! Looks for pairs of parts that could meet in a sub-step.

use super::{
    pair::{Activity, Pair, is_clear, is_near},
    ways::{Start, Ways},
};
use crate::{
    cloth::layout::{Model, Surface},
    interrupt::Interrupt,
    math::{Padded, Real},
    parallel::{Own, per_row, per_row_mut},
    surface::{Candidate, PairKind, Tree, Unlisted, Wanted},
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
    /// Pairs of a sub-step that begins so, in a fixed order; what lost its distance may get so much of it back (m).
    pub(crate) fn begin<R: Real>(
        &mut self,
        model: &Model<R>,
        surface: &Surface,
        start: Start<'_, R>,
        regained: f64,
        pairs: &mut Vec<Pair>,
        interrupt: &Interrupt,
    ) -> Result<(), Unlisted> {
        self.ways.predict(model, surface, start);
        self.look(model, surface, regained, pairs, interrupt)
    }

    /// Pairs for the ways to where a solve led; those that were known go on as they were.
    pub(crate) fn again<R: Real>(
        &mut self,
        model: &Model<R>,
        surface: &Surface,
        [from, to]: [&[Padded<R>]; 2],
        regained: f64,
        pairs: &mut Vec<Pair>,
        interrupt: &Interrupt,
    ) -> Result<(), Unlisted> {
        self.before.clear();
        self.before.extend(pairs.iter().filter(|pair| pair.activity != Activity::Idle));
        self.before.sort_unstable_by_key(|pair| pair.candidate);
        self.ways.follow(model, from, to);
        self.look(model, surface, regained, pairs, interrupt)?;
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
        regained: f64,
        pairs: &mut Vec<Pair>,
        interrupt: &Interrupt,
    ) -> Result<(), Unlisted> {
        let Self { tree, ways, candidates, looked, .. } = self;
        let (faces, ways) = (&surface.faces, &*ways);
        let tree = tree.get_or_insert_with(|| Tree::new(faces.triangles().len()));
        tree.refit(&|face| ways.around(&faces.triangles()[face]));
        let is_wanted = |kind: PairKind, corners: [u32; 4]| {
            let [at, expected] = ways.starts_and_expected(&corners);
            is_near(kind, at, ways.room(kind, &corners, &expected))
                && corners.iter().any(|corner| model.inv_m[*corner as usize] > R::zero())
        };
        let without = |face: usize| {
            let corners = &faces.triangles()[face];
            let [gap, travel] = surface.beside.apart(face, corners, ways.fields());
            let room = travel + 2.0 * ways.reach(corners[0]);
            if is_clear(gap, room) { surface.beside.triangles(face) } else { &[] }
        };
        let wanted = Wanted { without: &without, is_wanted: &is_wanted };
        tree.candidates(faces, &wanted, &|part| ways.around(part), candidates, interrupt)?;

        looked.resize(candidates.len(), None);
        let fields = (per_row_mut(looked), per_row(candidates));
        Own::whole(candidates.len(), GO).each(fields, |_, (looked, candidates)| {
            if interrupt.is_requested() {
                return;
            }
            for (looked, candidate) in looked.iter_mut().zip(candidates) {
                let corners = candidate.corners;
                let [at, expected] = ways.starts_and_expected(&corners);
                let room = ways.room(candidate.kind, &corners, &expected);
                *looked = Pair::near(surface, *candidate, at, (room, regained));
                if let Some(pair) = looked {
                    let inv_m = corners.map(|corner| model.inv_m[corner as usize].to_f64());
                    let free = corners.map(|corner| ways.free(corner));
                    pair.begin(surface, [at, free], inv_m, |particle, share| ways.freely(particle, share));
                }
            }
        });
        if interrupt.is_requested() {
            return Err(Unlisted::Interrupted);
        }
        pairs.clear();
        pairs.extend(looked.iter().flatten());
        Ok(())
    }
}
