//! The rounds of a sub-step with contact: a solve with the pairs that push, a look at where it leads, and another one until all is safe.

use super::{
    book::PairEnergy,
    certificate::{is_safe, separation},
    friction::Off,
    groups::Groups,
    limit::{failure_of, moved_pin, pairs_in},
    pair::{Look, Pair},
    pushing::{Pushing, pushing},
    room::make_room,
    rows::PairRows,
    rules::SETTLING,
    search::Search,
    wall::Wall,
    ways::{Start, wide},
};
use crate::{
    cloth::{
        layout::{Model, Surface},
        state::State,
    },
    collide::{Approach, BlockLoads, Carried, Collider, Contacts, Felt, Kept, Met, resolve},
    interrupt::Interrupt,
    linalg::Inverse3,
    math::{Padded, Real, Sixteen, Vec3},
    parallel::{Own, block_count, per_block, per_block_mut, per_row, per_row_mut, several_per_block_mut},
    report::{StepFailure, SurfaceReport},
    sub_step::SubStep,
    surface::closest,
};

/// Rounds of a sub-step, at most.
pub(crate) const ROUNDS: u32 = 20;
/// Rounds at the end in which pairs are not made harder.
const LAST: u32 = 2;
/// Roundings of a position below which no gap may fall.
const FLOOR: f64 = 64.0;
/// Share of all friction by which that of a solve may be off what Coulomb's law says.
const RUBS_OTHERWISE: f64 = 0.03;
/// Pairs that a thread looks at in one go.
const GO: usize = 64;

/// What a look at a solve says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Review {
    /// Nothing crosses on the way to where it leads.
    Safe,
    /// Pairs changed, or one is not safe.
    Again,
}

/// Pairs of the sub-step that is tried, and memory of the search for them. A copy has none of it: each sub-step begins with a search.
#[derive(Debug, Default)]
pub(crate) struct Contact<R: Real> {
    search: Search,
    pairs: Vec<Pair>,
    /// Of each block.
    walls: Vec<Vec<Wall>>,
    walls_before: Vec<Vec<Wall>>,
    pub(crate) rows: PairRows<R>,
    looks: Vec<Look>,
    /// Positions (m) and velocities (m/s) after colliders were met in the last round, and what was met; none before the first one.
    ends: [Vec<Padded<R>>; 2],
    met: Option<Met>,
    /// What walls gave to colliders.
    given: BlockLoads,
    /// Which parts push each other in the next solve.
    pub(crate) groups: Groups,
    pub(crate) energy: PairEnergy,
    pub(crate) report: SurfaceReport,
    /// The particles of the first pair that was not safe at the last look, and how near it came (m); a particle alone, twice, that went where no
    /// pairs were looked for.
    pub(crate) first_unsafe: Option<([u32; 2], f64)>,
    /// A pin that moves, of the first pair with one that was not safe.
    driven: Option<u32>,
}

/// Where and when a sub-step with contact is taken.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a, R: Real> {
    pub(crate) model: &'a Model<R>,
    pub(crate) surface: &'a Surface,
    pub(crate) colliders: &'a [Collider],
    pub(crate) state: &'a State<R>,
    /// Changes of velocity in the sub-step before (m/s), where solves start from them; else none.
    pub(crate) before: &'a [Sixteen<R>],
    pub(crate) sub_step: SubStep,
    /// How many sub-steps that the scene asks for this one is long: what pushes stays as stiff as in one of them.
    pub(crate) steps: f64,
    pub(crate) gravity: Vec3<f64>,
    pub(crate) friction: f64,
    /// How fast (m/s) lost thickness is given back.
    pub(crate) recovery: f64,
    pub(crate) interrupt: &'a Interrupt,
}

impl<R: Real> Clone for Contact<R> {
    fn clone(&self) -> Self {
        Self { search: self.search.anew(), ..Self::default() }
    }
}

impl<R: Real> Contact<R> {
    /// Lets lists of pairs take so many bytes from now on.
    pub(crate) fn limit(&mut self, bytes: u64) {
        self.search.most = Some(pairs_in(bytes));
    }

    /// Bytes that lists of pairs take.
    pub(crate) fn bytes(&self) -> usize {
        let listed = self.pairs.capacity() * size_of::<Pair>() + self.looks.capacity() * size_of::<Look>();
        self.search.bytes() + listed + self.rows.bytes()
    }

    /// Looks for pairs at the start of a sub-step; `rows` is the right-hand side without them.
    ///
    /// # Errors
    /// Where so many parts could meet that their pairs do not fit into memory, or the step is given up.
    pub(crate) fn begin(&mut self, scene: Scene<'_, R>, rows: &[Sixteen<R>]) -> Result<(), StepFailure> {
        let Scene { model, surface, state, before, sub_step, gravity, .. } = scene;
        let start = Start { x: &state.x, v: &state.v, dv: before, sub_step, gravity };
        let beginning = [scene.recovery * sub_step.dt, scene.steps];
        let found = self.search.begin(model, surface, start, beginning, &mut self.pairs, scene.interrupt);
        found.map_err(|stopped| failure_of(model, surface, stopped))?;
        self.list_walls(scene);
        self.rows.keep(model, rows);
        self.report = SurfaceReport::default();
        (self.first_unsafe, self.driven, self.energy) = (None, None, PairEnergy::default());
        self.met = None;
        Ok(())
    }

    fn list_walls(&mut self, scene: Scene<'_, R>) {
        let Scene { model, colliders, state, sub_step, steps, .. } = scene;
        let Self { search, walls, .. } = self;
        walls.resize(block_count(model.count, model.block_size), Vec::new());
        model.share.own().each(per_block_mut(walls), |block, walls| {
            walls.clear();
            if !colliders.is_empty() {
                let from = ([&state.x[..], &state.v[..]], &search.ways);
                Wall::list(model, block, colliders, from, (sub_step, steps), walls);
            }
        });
    }

    /// Takes the pairs that push over into the rows of the next solve, beside the inverse diagonal blocks without them.
    pub(crate) fn set(&mut self, scene: Scene<'_, R>, inverse: &[Inverse3]) {
        let Scene { model, state, sub_step: SubStep { dt, .. }, .. } = scene;
        self.rows.set((model, inverse), pushing(&self.pairs, &self.walls), (&state.v, dt));
        self.groups.find(model, &self.pairs, &self.walls);
    }

    /// Takes over what colliders push each group with, where a solve leads to velocities (m/s).
    pub(crate) fn feel(&mut self, model: &Model<R>, velocity: impl Fn(usize) -> Vec3<f64>, dt: f64) {
        self.groups.feel(model, &self.walls, (velocity, dt));
    }

    /// Looks at where a solve leads, once it has met colliders.
    ///
    /// # Errors
    /// Where so many parts could meet that their pairs do not fit into memory, or the step is given up.
    pub(crate) fn review(
        &mut self,
        scene: Scene<'_, R>,
        next: &State<R>,
        kept: &mut Kept,
        round: u32,
    ) -> Result<Review, StepFailure> {
        let Scene { model, state, sub_step: SubStep { dt, .. }, .. } = scene;
        let pushing = pushing(&self.pairs, &self.walls);
        self.energy = PairEnergy::of((model, &self.groups), pushing, [&state.v, &next.v], dt);
        let active = self.pairs.iter().filter(|pair| pair.hold.activity.pushes()).count();
        self.report.largest_push = self.largest_push(&next.v, dt);

        let (mut is_changed, mut off) = self.review_walls(scene, next, round);
        self.meet(scene, next, kept);
        self.look(scene, next, round);
        if scene.interrupt.is_requested() {
            return Err(StepFailure::Interrupted);
        }
        (self.first_unsafe, self.driven) = (None, None);
        for (look, pair) in self.looks.iter().zip(&self.pairs) {
            is_changed |= look.is_changed;
            off = off.and(look.off);
            if look.is_unsafe && self.driven.is_none() {
                self.driven = moved_pin(model, &next.v, pair.stencil.corners);
            }
            if look.is_unsafe && self.first_unsafe.is_none() {
                let [first, .., last] = pair.stencil.corners;
                let end = pair.stencil.corners.map(|corner| wide(&self.ends[0][corner as usize]));
                let apart = separation(pair, end);
                // What is not a number is no gap.
                let gap = if apart > 0.0 { apart.min(pair.hold.began) } else { 0.0 };
                self.first_unsafe = Some(([first, last], gap));
            }
        }
        let is_unsafe = self.first_unsafe.is_some();
        is_changed |= off.by > RUBS_OTHERWISE * off.of;

        self.report.rounds = round + 1;
        (self.report.pairs, self.report.active) = (self.pairs.len() as u64, active as u64);
        if let Some(particle) = self.search.ways.left(&self.ends[0][..model.count]) {
            // Nothing is known of what it may meet.
            self.first_unsafe = self.first_unsafe.or(Some(([particle; 2], 0.0)));
            self.look_again(scene)?;
            return Ok(Review::Again);
        }
        if is_unsafe || is_changed && round + 1 < SETTLING {
            return Ok(Review::Again);
        }
        self.report.least_gap = self.least_gap();
        Ok(Review::Safe)
    }

    /// Reviews all walls, which keep what the solve pushed with: whether other ones push, and by how much friction is off.
    fn review_walls(&mut self, scene: Scene<'_, R>, next: &State<R>, round: u32) -> (bool, Off) {
        let Scene { model, surface, state, sub_step, .. } = scene;
        let (mut is_changed, mut off) = (false, Off::default());
        for wall in self.walls.iter_mut().flatten() {
            let [particle, collider] = wall.key();
            let collider = &scene.colliders[collider];
            let (x, v) = (wide(&state.x[particle]), [&state.v, &next.v].map(|v| wide(&v[particle])));
            let inv_m = model.inv_m[particle].to_f64();
            wall.keep_push(&v[1], sub_step.dt, inv_m);
            let comes = Approach { collider, x: [x, x + v[1] * sub_step.dt], v, sub_step };
            let of_particle = (surface.thickness_of(particle as u32), inv_m);
            let (changed, of) = wall.review(&comes, of_particle, [round, ROUNDS - LAST]);
            is_changed |= changed;
            off = off.and(of);
        }
        (is_changed, off)
    }

    /// Lets a copy of what a solve led to meet colliders: that of the last round is the end of the sub-step.
    fn meet(&mut self, scene: Scene<'_, R>, next: &State<R>, kept: &mut Kept) {
        let Scene { model, colliders, state, sub_step, .. } = scene;
        let Self { walls, given, ends: [x, v], energy, .. } = self;
        x.clone_from(&next.x);
        v.clone_from(&next.v);
        if colliders.is_empty() {
            self.met = Some(Met::default());
            return;
        }
        rub(model, colliders, walls, given, (&state.x, sub_step.dt), [x, v]);
        let contacts = Contacts { colliders, sub_step, share: &model.share, user: &model.user };
        let mut met = resolve(contacts, &model.inv_m, [&state.x, &state.v], [x, v], None, kept);
        kept.add(given);
        // How many times a collider pushed a particle in the solve, or pulled it a little as it let go; how those surfaces move, and what their
        // motion gave beyond what the solve counted.
        let (mut pushed, mut carried) = (0, Carried::default());
        for wall in walls.iter().flatten().filter(|wall| wall.pushed != 0.0) {
            let push = wall.pushed.abs() * model.m[wall.particle()].to_f64();
            pushed += 1;
            carried.push += push;
            (0..3).for_each(|c| carried.along[c] += push * wall.velocity[c]);
        }
        carried.work = given.work() - energy.of_colliders;
        (met.touched, met.carried) = (met.touched.max(pushed), met.carried.and(carried));
        self.met = Some(met);
    }

    /// Puts the ends of the last round in place of where the solve led, and tells what was met there; none where no round has met colliders.
    pub(crate) fn take(&mut self, next: &mut State<R>) -> Option<Met> {
        let met = self.met.take()?;
        let [x, v] = &mut self.ends;
        std::mem::swap(x, &mut next.x);
        std::mem::swap(v, &mut next.v);
        Some(met)
    }

    /// Reviews all pairs, and whether each is safe.
    fn look(&mut self, scene: Scene<'_, R>, next: &State<R>, round: u32) {
        let Scene { model, surface, state, sub_step: SubStep { dt, .. }, friction, .. } = scene;
        let Self { pairs, looks, ends, .. } = self;
        let count = pairs.len();
        make_room(looks, count, pairs.capacity());
        looks.resize(count, Look::default());
        let fields = (per_row_mut(pairs), per_row_mut(looks));
        let way = |particle: u32| wide(&next.v[particle as usize]) * dt;
        let gone = |particle: u32, share: f64| wide(&state.x[particle as usize]) + way(particle) * share;
        Own::whole(count, GO).each(fields, |_, (pairs, looks)| {
            if scene.interrupt.is_requested() {
                return;
            }
            for (pair, look) in pairs.iter_mut().zip(looks) {
                let corners = pair.stencil.corners;
                let at = |field: &[Padded<R>]| corners.map(|corner| wide(&field[corner as usize]));
                let (start, end) = (at(&state.x), at(&ends[0]));
                let largest = end.iter().map(Vec3::amax).fold(0.0, f64::max);
                let floor = FLOOR * R::ROUNDING * largest;
                let inv_m = corners.map(|corner| model.movable()[corner as usize].to_f64());
                let ways = corners.map(way);
                let is_unsafe = !is_safe(pair, start, end, floor);
                let rounds = [round, ROUNDS - LAST];
                *look =
                    pair.review(surface, [start, ways, at(&state.v)], inv_m, (dt, friction), rounds, gone);
                look.is_unsafe = is_unsafe;
                if is_unsafe {
                    pair.insist([start, ways], inv_m, round);
                }
            }
        });
    }

    /// Looks for pairs about the ways that the last solve led along.
    fn look_again(&mut self, scene: Scene<'_, R>) -> Result<(), StepFailure> {
        let Scene { model, surface, state, .. } = scene;
        let beginning = [scene.recovery * scene.sub_step.dt, scene.steps];
        let ends = [&*state.x, &*self.ends[0]];
        let found = self.search.again(model, surface, ends, beginning, &mut self.pairs, scene.interrupt);
        found.map_err(|stopped| failure_of(model, surface, stopped))?;
        std::mem::swap(&mut self.walls, &mut self.walls_before);
        self.list_walls(scene);
        for (walls, before) in self.walls.iter_mut().zip(&self.walls_before) {
            for wall in walls {
                if let Ok(place) = before.binary_search_by_key(&wall.key(), Wall::key) {
                    *wall = before[place];
                }
            }
        }
        Ok(())
    }

    /// Why the sub-step is not accepted that was reviewed last.
    pub(crate) fn failure(&self, model: &Model<R>) -> StepFailure {
        let ([one, other], gap) = self.first_unsafe.unwrap_or_default();
        let user = |particle: u32| u64::from(model.user[particle as usize]);
        StepFailure::Contact { particles: [one, other].map(user), gap, driven: self.driven.map(user) }
    }

    /// The largest force (N) of a pair in the solve that led to velocities (m/s) in `dt` (s); 0 where none pushed.
    fn largest_push(&self, v: &[Padded<R>], dt: f64) -> f64 {
        let force = |push: Pushing<'_>| {
            let relative = push.relative(|corner| wide(&v[corner]));
            push.hold.impulse(push.across(&relative, dt), dt) / dt
        };
        pushing(&self.pairs, &[]).map(force).fold(0.0, f64::max)
    }

    /// The least distance (m) of a pair at the end; infinite without one.
    fn least_gap(&self) -> f64 {
        let mut least = f64::INFINITY;
        for pair in &self.pairs {
            let end = pair.stencil.corners.map(|corner| wide(&self.ends[0][corner as usize]));
            if separation(pair, end) < least {
                least = least.min(closest(pair.candidate().kind(), end).difference.norm());
            }
        }
        least
    }
}

/// Rubs what a solve pushed against colliders, of each block after what its walls kept.
fn rub<R: Real>(
    model: &Model<R>,
    colliders: &[Collider],
    walls: &[Vec<Wall>],
    given: &mut BlockLoads,
    (from, dt): (&[Padded<R>], f64),
    [x, v]: [&mut [Padded<R>]; 2],
) {
    let blocks = block_count(model.count, model.block_size);
    let felt = given.sized_for(blocks, colliders.len());
    felt.fill(Felt::default());
    let fields = (per_block(walls), [per_row_mut(x), per_row_mut(v)], per_row(from));
    let felt = several_per_block_mut(felt, colliders.len());
    model.share.own().each((fields, felt), |block, ((walls, [x, v], from), felt)| {
        let first = block * model.block_size;
        for wall in walls.iter().filter(|wall| wall.pushed != 0.0) {
            let [particle, number] = wall.key();
            let (row, inv_m) = (particle - first, model.inv_m[particle].to_f64());
            let [mut end, mut velocity] = [wide(&x[row]), wide(&v[row])];
            let moved = wall.rub(
                &colliders[number],
                (&wide(&from[row]), inv_m, dt),
                [&mut end, &mut velocity],
                &mut felt[number],
            );
            if moved {
                x[row] = Padded::new(&end.map(R::of));
                v[row] = Padded::new(&velocity.map(R::of));
            }
        }
    });
}
