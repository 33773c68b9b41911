//! Looks for pairs of parts that could meet in a sub-step.

use super::{
    hold::Activity,
    pair::{Pair, is_clear, is_near},
    room::make_room,
    ways::{Start, Ways},
};
use crate::{
    cloth::layout::{Model, Surface},
    interrupt::Interrupt,
    math::{Padded, Real},
    parallel::{Own, per_row_mut},
    surface::{PairKind, Tree, Unlisted, Wanted},
};

/// Candidates that a thread looks at in one go.
const GO: usize = 64;

/// Why pairs are not listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stopped {
    /// They are too many at one place, or the search was given up.
    Unlisted(Unlisted),
    /// They are so many, more than there may be.
    TooMany(usize),
}

impl From<Unlisted> for Stopped {
    fn from(unlisted: Unlisted) -> Self {
        Self::Unlisted(unlisted)
    }
}

/// Memory of the search, and the ways that it was made for.
#[derive(Debug, Default)]
pub(crate) struct Search {
    tree: Option<Tree>,
    pub(crate) ways: Ways,
    /// How many pairs may be listed; none: all that there are.
    pub(crate) most: Option<usize>,
    /// What pairs of the search before did, in the order of their corners.
    before: Vec<Pair>,
}

impl Search {
    /// Another one that may list as many pairs, and has none.
    pub(crate) fn anew(&self) -> Self {
        Self { most: self.most, ..Self::default() }
    }

    /// Pairs of a sub-step that begins so, in a fixed order. `beginning`: what lost its distance may get so much of it back (m), and how many
    /// sub-steps of the scene this one is long.
    pub(crate) fn begin<R: Real>(
        &mut self,
        model: &Model<R>,
        surface: &Surface,
        start: Start<'_, R>,
        beginning: [f64; 2],
        pairs: &mut Vec<Pair>,
        interrupt: &Interrupt,
    ) -> Result<(), Stopped> {
        self.ways.predict(model, surface, start);
        self.look(model, surface, beginning, pairs, interrupt)
    }

    /// Pairs for the ways to where a solve led; those that were known go on as they were.
    pub(crate) fn again<R: Real>(
        &mut self,
        model: &Model<R>,
        surface: &Surface,
        [from, to]: [&[Padded<R>]; 2],
        beginning: [f64; 2],
        pairs: &mut Vec<Pair>,
        interrupt: &Interrupt,
    ) -> Result<(), Stopped> {
        let known = |pair: &&Pair| pair.hold.activity != Activity::Idle;
        self.before.clear();
        make_room(&mut self.before, pairs.iter().filter(known).count(), usize::MAX);
        self.before.extend(pairs.iter().filter(known));
        self.before.sort_unstable_by_key(Pair::candidate);
        self.ways.follow(model, from, to);
        self.look(model, surface, beginning, pairs, interrupt)?;
        for pair in pairs {
            if let Ok(place) = self.before.binary_search_by_key(&pair.candidate(), Pair::candidate) {
                *pair = self.before[place];
            }
        }
        Ok(())
    }

    fn look<R: Real>(
        &mut self,
        model: &Model<R>,
        surface: &Surface,
        beginning: [f64; 2],
        pairs: &mut Vec<Pair>,
        interrupt: &Interrupt,
    ) -> Result<(), Stopped> {
        let Self { tree, ways, most, .. } = self;
        let (faces, ways, movable) = (&surface.faces, &*ways, model.movable());
        let tree = tree.get_or_insert_with(|| Tree::new(faces.triangles().len()));
        tree.refit(&|face| ways.around(&faces.triangles()[face]));
        let is_wanted = |kind: PairKind, corners: [u32; 4]| {
            let [at, expected] = ways.starts_and_expected(&corners);
            is_near(kind, at, ways.room(kind, &corners, &expected))
                && corners.iter().any(|corner| movable[*corner as usize] > R::zero())
        };
        let without = |face: usize| {
            let corners = &faces.triangles()[face];
            let [gap, travel] = surface.beside.apart(face, corners, ways.fields());
            let room = travel + 2.0 * ways.reach(corners[0]);
            if is_clear(gap, room) { surface.beside.triangles(face) } else { &[] }
        };
        let wanted = Wanted { without: &without, is_wanted: &is_wanted };
        let most = most.unwrap_or(usize::MAX);
        let count = tree.find(faces, &wanted, &|part| ways.around(part), most, interrupt)?;
        if count > most {
            return Err(Stopped::TooMany(count));
        }

        make_room(pairs, count, most);
        pairs.resize(count, Pair::default());
        tree.write(pairs, Pair::take);
        Own::whole(count, GO).each(per_row_mut(pairs), |_, pairs| {
            if interrupt.is_requested() {
                return;
            }
            for pair in pairs {
                let (candidate, corners) = (pair.candidate(), pair.stencil.corners);
                let [at, expected] = ways.starts_and_expected(&corners);
                let room = ways.room(candidate.kind(), &corners, &expected);
                let Some(near) = Pair::near(surface, candidate, at, (room, beginning)) else {
                    pair.hold.activity = Activity::Far;
                    continue;
                };
                *pair = near;
                let inv_m = corners.map(|corner| movable[corner as usize].to_f64());
                let free = corners.map(|corner| ways.free(corner));
                pair.begin(surface, [at, free], inv_m, |particle, share| ways.freely(particle, share));
            }
        });
        if interrupt.is_requested() {
            // Some of them nobody has looked at.
            pairs.clear();
            return Err(Unlisted::Interrupted.into());
        }
        pairs.retain(|pair| pair.hold.activity != Activity::Far);
        Ok(())
    }

    /// Bytes of its lists of pairs.
    pub(crate) fn bytes(&self) -> usize {
        self.tree.as_ref().map_or(0, Tree::bytes) + self.before.capacity() * size_of::<Pair>()
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        cloth::contact::pair::{Look, Pair},
        surface::Candidate,
    };

    #[test]
    fn a_pair_takes_less_than_240_bytes_in_the_lists_that_have_every_pair() {
        assert!(size_of::<Pair>() <= 192, "{}", size_of::<Pair>());
        let all = size_of::<Candidate>() + size_of::<Pair>() + size_of::<Look>();
        assert!(all < 240, "{all}");
    }
}
