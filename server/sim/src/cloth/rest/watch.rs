//! The pieces of a cloth, watched over windows of eight steps of the scene: how far their particles go, and how steadily.
//!
//! Reads positions (m) after each step; writes, at the end of a window, which pieces are calm.

use serde::{Deserialize, Serialize};

use super::{ladder::Ladder, sleep::Sleep};
use crate::{
    cloth::{layout::Model, network::Components, settings::RestSettings},
    math::{Padded, Real, array3, bytes},
    parallel::{per_row, per_row_mut},
    report::RestReport,
};

/// Steps of the scene in a window.
pub(super) const WINDOW: u32 = 8;
/// The share of what the rules divide that a particle may go within a window.
const SHARE_OF_WAY: f64 = 0.125;
/// The share of it that half of the changes of a way may add up to over the time that the scene allows.
const SHARE_OF_CHANGE: f64 = 0.5;

/// What a piece may do within a window and count as calm.
#[derive(Clone, Copy, Debug)]
struct Limits {
    /// How far a particle may go from where the window began (m).
    way: f64,
    /// What half of the change of its way from one window to the next may be (m).
    change: f64,
    /// The same over the largest coordinate of the piece, if that is more.
    relative: f64,
}

impl Limits {
    /// Of a scene whose steps are of `dt` (s).
    fn of<R: Real>(rest: RestSettings, dt: f64) -> Self {
        let (share, window) = (rest.share(), f64::from(WINDOW) * dt);
        Self {
            way: SHARE_OF_WAY * share,
            change: SHARE_OF_CHANGE * share * (window / rest.within),
            relative: Watch::<R>::ROUNDINGS * R::ROUNDING,
        }
    }
}

/// A piece, and what its last whole window told.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Piece {
    /// How many particles it has.
    particles: u64,
    /// The farthest that one of them was from where the window began (m).
    pub(super) way: f64,
    /// Half of the largest change of the way of one of them from the window before (m).
    change: f64,
    /// The largest coordinate of one of them (m).
    pub(super) coordinate: f64,
    pub(super) ladder: Ladder,
}

impl Piece {
    /// Begins the sums of a window.
    fn begin_window(&mut self) {
        (self.way, self.change, self.coordinate) = (0.0, 0.0, 0.0);
    }

    /// Takes in what a particle did within the window.
    fn take(&mut self, [way, change, coordinate]: [f64; 3]) {
        self.way = self.way.max(way);
        self.change = self.change.max(change);
        self.coordinate = self.coordinate.max(coordinate);
    }

    /// Judges the window.
    fn judge(&mut self, limits: Limits) {
        let change = limits.change.max(limits.relative * self.coordinate);
        if self.way <= limits.way && self.change <= change {
            self.ladder.rise();
        } else {
            self.ladder.fall();
        }
    }
}

/// What is known of how still the pieces of a cloth lie.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub(crate) struct Watch<R: Real> {
    /// Positions (m) where the window began, as those of the state.
    #[serde(with = "bytes")]
    pub(super) begun: Vec<Padded<R>>,
    /// Ways (m) within the window before, from its beginning to its end; 0 where there was none.
    #[serde(with = "bytes")]
    pub(super) before: Vec<Padded<R>>,
    /// Squares of the farthest (m²) that particles were from where the window began.
    pub(super) farthest: Vec<f64>,
    /// Steps of the window that were taken.
    pub(super) taken: u32,
    /// In the order of the model's components.
    pub(super) pieces: Vec<Piece>,
    /// How it sleeps, all of it or nothing.
    pub(super) sleep: Sleep,
    /// The forces (N) with which colliders hold each particle of what sleeps; none of what is awake, or held by none.
    #[serde(with = "bytes")]
    pub(super) held: Vec<Padded<R>>,
    /// What the last whole window told, and how it sleeps.
    pub(super) told: RestReport,
}

impl<R: Real> Watch<R> {
    /// Roundings of a coordinate that half of a change may always have: positions do not tell less.
    pub(super) const ROUNDINGS: f64 = 4.0;

    /// Of a cloth with particles at these positions (m).
    ///
    /// # Panics
    /// Unless the model was laid out for settings that ask for it.
    pub(crate) fn new(model: &Model<R>, x: &[Padded<R>]) -> Self {
        let components = components_of(model);
        let mut pieces = vec![Piece::default(); components.count()];
        for row in 0..components.row_count() {
            pieces[components.of_row(row)].particles += 1;
        }
        let mut watch = Self {
            begun: Vec::new(),
            before: Vec::new(),
            farthest: Vec::new(),
            taken: 0,
            pieces,
            sleep: Sleep::default(),
            held: Vec::new(),
            told: RestReport::default(),
        };
        watch.begin(x);
        watch
    }

    /// Begins anew from these positions (m): nothing counts as calm, nor slept.
    pub(crate) fn begin(&mut self, x: &[Padded<R>]) {
        self.begun.clear();
        self.begun.extend_from_slice(x);
        self.before.clear();
        self.before.resize(x.len(), Padded::default());
        self.farthest.clear();
        self.farthest.resize(x.len(), 0.0);
        self.taken = 0;
        for piece in &mut self.pieces {
            *piece = Piece { particles: piece.particles, ..Piece::default() };
        }
        self.sleep = Sleep::default();
        self.held = Vec::new();
        self.told = self.report();
    }

    /// What the last whole window told, and how it sleeps.
    pub(crate) fn told(&self) -> RestReport {
        self.told
    }

    /// Takes in where particles are (m) after a step of the scene, which is of `dt` (s).
    pub(crate) fn look(&mut self, model: &Model<R>, rest: RestSettings, x: &[Padded<R>], dt: f64) {
        let fields = (per_row_mut(&mut self.farthest), per_row(&self.begun), per_row(x));
        model.share.own().each(fields, |_, (farthest, begun, x)| keep_farthest(farthest, begun, x));

        self.taken += 1;
        if self.taken == WINDOW {
            self.end_window(components_of(model), x, Limits::of::<R>(rest, dt));
            self.told = self.report();
        }
    }

    /// Judges every piece by the window that ends at these positions (m), and begins the next one there.
    fn end_window(&mut self, components: &Components, x: &[Padded<R>], limits: Limits) {
        let Self { begun, before, farthest, taken, pieces, .. } = self;
        for piece in &mut *pieces {
            piece.begin_window();
        }
        for row in 0..components.row_count() {
            let place = x[row].vector().map(R::to_f64);
            let way = place - begun[row].vector().map(R::to_f64);
            let change = way - before[row].vector().map(R::to_f64);
            let found = [farthest[row].sqrt(), 0.5 * change.norm(), place.amax()];
            pieces[components.of_row(row)].take(found);
            before[row] = Padded::new(&way.map(R::of));
        }
        for piece in &mut *pieces {
            piece.judge(limits);
        }

        begun.copy_from_slice(x);
        farthest.fill(0.0);
        *taken = 0;
    }

    /// Whether the cloth of another watch can go on from this one, of which nobody may know who wrote it.
    pub(crate) fn is_sound(&self, other: &Self) -> bool {
        let count = other.begun.len();
        let is_row = |row: &Padded<R>| array3(&row.vector()).iter().all(|c| c.is_finite());
        let is_length = |length: f64| length.is_finite() && length >= 0.0;
        let is_piece = |(piece, other): (&Piece, &Piece)| {
            let lengths = [piece.way, piece.change, piece.coordinate];
            piece.particles == other.particles
                && lengths.into_iter().all(is_length)
                && piece.ladder.is_sound()
        };
        [self.begun.len(), self.before.len(), self.farthest.len()] == [count; 3]
            && self.held.len() <= count
            && self.begun.iter().chain(&self.before).chain(&self.held).all(is_row)
            && self.farthest.iter().copied().all(is_length)
            && self.taken < WINDOW
            && self.pieces.len() == other.pieces.len()
            && self.pieces.iter().zip(&other.pieces).all(is_piece)
            && self.sleep.is_sound()
            && [self.told.way, self.told.change, self.told.told].into_iter().all(is_length)
    }

    pub(super) fn report(&self) -> RestReport {
        let (long_steps, wakes, wake) = self.sleep.counts();
        let mut told = RestReport {
            pieces: self.pieces.len() as u64,
            told: self.sleep.told(),
            long_steps,
            wakes,
            wake,
            ..RestReport::default()
        };
        for piece in &self.pieces {
            told.particles += piece.particles;
            if piece.ladder.is_calm() {
                told.calm_particles += piece.particles;
                told.calm_pieces += 1;
            }
            told.way = told.way.max(piece.way);
            told.change = told.change.max(piece.change);
        }
        if self.sleep.is_asleep() {
            (told.particles_asleep, told.pieces_asleep) = (told.particles, told.pieces);
        }
        told
    }
}

/// What springs and elements hold together.
fn components_of<R: Real>(model: &Model<R>) -> &Components {
    model.components.as_ref().expect("laid out for these settings")
}

/// Keeps the squares of the farthest (m²) that particles of a block were from where the window began.
fn keep_farthest<R: Real>(farthest: &mut [f64], begun: &[Padded<R>], x: &[Padded<R>]) {
    for ((farthest, begun), x) in farthest.iter_mut().zip(begun).zip(x) {
        let way = x.vector().map(R::to_f64) - begun.vector().map(R::to_f64);
        *farthest = f64::max(*farthest, way.norm_squared());
    }
}
