//! A pair of parts of a surface in one sub-step: where they meet, and whether they push each other.
//!
//! With n the direction between the nearest points where they meet, and w their weights (1 in sum on the first side, -1 on the second), the gap at
//! the end is linear about that place: g = g* + n.(w x' - w x*). A pair that is active adds the energy k (t - g)² / 2 to what the step
//! minimises, so h² k n nᵀ times w wᵀ to its matrix. k = 100 m / h², 1 / m = sum w² / m_i: a load of the weight of m lies g h² / 100 deep.

use super::{
    friction::{Friction, Off, Seen},
    place::{Going, Place, mixed},
    rules::{ADDED, HARDER, KEPT, LATE, PULL, SETTLING, SHORT, STIFFNESS, THIN},
};
use crate::{
    cloth::layout::Surface,
    math::Vec3,
    surface::{Candidate, PairKind, between_middles, closest, gap_along},
};

/// Times what a pair lacks of its target that its push alone takes a particle, at most.
const FARTHEST: f64 = 3.0;

/// A pair in a sub-step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    pub(crate) candidate: Candidate,
    /// Distance (m) at the start, and the direction from the second part to the first there.
    pub(crate) gap: f64,
    pub(crate) direction: Vec3<f64>,
    /// Distance that is kept, and the gap that the solve aims at (m).
    pub(crate) thickness: f64,
    pub(crate) target: f64,
    /// Where they meet: weights of the nearest points, the direction from the second part to the first, and the linear gap (m) where no
    /// corner moves.
    pub(crate) weights: [f64; 4],
    pub(crate) normal: Vec3<f64>,
    at_start: f64,
    /// h² k (kg); 0 where nothing is free.
    pub(crate) stiffness: f64,
    pub(super) friction: Friction,
    pub(crate) activity: Activity,
    pushes_at: PushesAt,
    /// How many times it was made harder.
    hardened: u8,
}

/// Where a pair pushes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PushesAt {
    /// Where the surfaces touch that it is part of.
    Touching,
    /// Wherever its nearest points lie: it was not certified once.
    Nearest,
    /// Where its nearest points were at the start: it was not certified once more, or late. Sets of such pairs do not alternate.
    Start,
}

/// Whether a pair pushes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Activity {
    /// It is not near, and is not kept.
    Far,
    Idle,
    Active,
    /// It was dropped once in this sub-step.
    Dropped,
    /// It was dropped once in this sub-step, and is active again.
    Again,
    /// It was dropped twice in this sub-step.
    Gone,
}

impl Activity {
    pub(crate) fn pushes(self) -> bool {
        matches!(self, Self::Active | Self::Again)
    }

    /// It pushes from now on.
    pub(super) fn added(self) -> Self {
        match self {
            Self::Idle => Self::Active,
            Self::Dropped => Self::Again,
            same => same,
        }
    }

    /// It does not push any more after a round in which it pulled by a share of the thickness. One that was dropped before goes on, since sets of
    /// pairs may alternate for ever; late on, what pulls hard is dropped for good.
    pub(super) fn dropped(self, pull: f64, round: u32) -> Self {
        match self {
            Self::Active if pull > PULL => Self::Dropped,
            Self::Again if pull > SHORT && round >= LATE => Self::Gone,
            same => same,
        }
    }
}

/// What a look at a pair after a solve found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Look {
    /// Whether other pairs push, or elsewhere.
    pub(super) is_changed: bool,
    pub(super) is_unsafe: bool,
    pub(super) off: Off,
}

impl Pair {
    /// One of which nothing is known but that it is not near.
    pub(super) fn far(candidate: Candidate) -> Self {
        Self {
            candidate,
            gap: 0.0,
            direction: Vec3::zeros(),
            thickness: 0.0,
            target: 0.0,
            weights: [0.0; 4],
            normal: Vec3::zeros(),
            at_start: 0.0,
            stiffness: 0.0,
            friction: Friction::default(),
            activity: Activity::Far,
            pushes_at: PushesAt::Touching,
            hardened: 0,
        }
    }

    /// A pair in a sub-step that begins with its corners at `x` (m), and may give back so much of what it lost (m). None where it stays apart
    /// whatever happens, as long as no corner comes nearer to one of the other part than by `room` (m).
    pub(crate) fn near(
        surface: &Surface,
        candidate: Candidate,
        x: [Vec3<f64>; 4],
        (room, regained): (f64, f64),
    ) -> Option<Self> {
        let found = closest(candidate.kind(), x);
        let gap = found.difference.norm();
        if is_clear(gap, room) {
            return None;
        }
        let direction = if gap > 0.0 { found.difference / gap } else { Vec3::zeros() };
        let thickness = surface.distance_of(&candidate);
        Some(Self {
            gap,
            direction,
            thickness,
            target: thickness.min(gap + regained),
            weights: found.weights,
            normal: direction,
            at_start: gap,
            activity: Activity::Idle,
            ..Self::far(candidate)
        })
    }

    /// Where it meets if its corners go such ways (m), and may be pushed; `at` says where any particle is after a share of its way.
    fn meets(
        &self,
        surface: &Surface,
        [start, ways]: [[Vec3<f64>; 4]; 2],
        at: impl Fn(u32, f64) -> Vec3<f64>,
    ) -> Option<Place> {
        if self.pushes_at == PushesAt::Start {
            return None;
        }
        let place = self.going([start, ways]).meets(self.target)?;
        let is_anywhere = self.pushes_at == PushesAt::Nearest;
        place.borne(&surface.faces, &self.candidate, at).or(is_anywhere.then_some(place))
    }

    /// How its corners go such ways (m) from where they start.
    fn going(&self, [start, ways]: [[Vec3<f64>; 4]; 2]) -> Going {
        Going { kind: self.candidate.kind(), start, ways, gap: self.gap, normal: self.direction }
    }

    /// Begins to push where it would meet on ways (m) without it, with corners of inverse masses (1/kg).
    pub(crate) fn begin(
        &mut self,
        surface: &Surface,
        on_ways: [[Vec3<f64>; 4]; 2],
        inv_m: [f64; 4],
        at: impl Fn(u32, f64) -> Vec3<f64>,
    ) {
        // What is not near yet may be led elsewhere.
        let is_near = |place: &Place| {
            self.gap < (1.0 + SHORT) * self.thickness || place.distance < THIN * self.thickness
        };
        if let Some(place) = self.meets(surface, on_ways, at).filter(is_near) {
            self.put(&place, &on_ways[1], inv_m);
            self.activity = if self.can_push() { Activity::Active } else { Activity::Idle };
        }
    }

    /// Takes over where it meets on ways (m).
    fn put(&mut self, place: &Place, ways: &[Vec3<f64>; 4], inv_m: [f64; 4]) {
        (self.weights, self.normal) = (place.weights, place.normal);
        self.at_start = place.distance - place.share * self.normal.dot(&mixed(ways, &self.weights));
        self.stiffness = self.hardness() * stiffness_of(self.weights, inv_m);
    }

    /// How many times as hard it is as one that was not made harder.
    fn hardness(&self) -> f64 {
        (0..self.hardened).fold(1.0, |hardness, _| hardness * HARDER)
    }

    /// Whether anything of it is free, and it has a direction.
    pub(crate) fn can_push(&self) -> bool {
        self.stiffness > 0.0
    }

    /// What friction sees of it, from its relative way (m) in `dt` (s) and the relative velocity (m/s) that it came with.
    fn seen(&self, bound: f64, [way, came]: [&Vec3<f64>; 2], dt: f64) -> Seen {
        let mass = self.stiffness / (STIFFNESS * self.hardness());
        Seen { bound, along: self.along(way) / dt, came: self.along(came).norm(), mass }
    }

    /// The way or velocity of the first nearest point relative to the second, from those of the corners.
    pub(crate) fn relative(&self, of_corners: &[Vec3<f64>; 4]) -> Vec3<f64> {
        mixed(of_corners, &self.weights)
    }

    /// What of a relative way or velocity is along the surfaces.
    pub(crate) fn along(&self, relative: &Vec3<f64>) -> Vec3<f64> {
        relative - self.normal * relative.dot(&self.normal)
    }

    /// The linear gap (m) after a relative way (m).
    pub(crate) fn gap_after(&self, way: &Vec3<f64>) -> f64 {
        self.at_start + way.dot(&self.normal)
    }

    /// Whether it is beyond what it aims at after a relative way (m).
    pub(crate) fn pulls(&self, way: &Vec3<f64>) -> bool {
        self.gap_after(way) >= self.target
    }

    /// How much (m) of what was lost of the thickness it gives back.
    pub(crate) fn regained(&self) -> f64 {
        (self.target - self.gap).max(0.0)
    }

    /// h times the force (N s) with which it pushes after a relative way (m) in `dt` (s).
    pub(crate) fn impulse(&self, way: &Vec3<f64>, dt: f64) -> f64 {
        self.stiffness / dt * (self.target - self.gap_after(way))
    }

    /// Energy (J) of its push after a relative way (m) in `dt` (s), on both sides of its target as the solve has it.
    pub(crate) fn energy(&self, way: &Vec3<f64>, dt: f64) -> f64 {
        let short = self.target - self.gap_after(way);
        0.5 * self.stiffness / (dt * dt) * short * short
    }

    /// Looks at where the solve of a round leads, from where its corners begin, their ways (m) in `dt` (s) and the velocities (m/s) that they came
    /// with: drops what pulls, adds what falls short, puts it where it meets, hardens what is too thin before the round `last`, and takes
    /// over friction of a coefficient.
    pub(crate) fn review(
        &mut self,
        surface: &Surface,
        [start, ways, came]: [[Vec3<f64>; 4]; 3],
        inv_m: [f64; 4],
        (dt, friction): (f64, f64),
        [round, last]: [u32; 2],
        at: impl Fn(u32, f64) -> Vec3<f64>,
    ) -> Look {
        let mut look = Look::default();
        let way = self.relative(&ways);
        let (gap, pushed) = (self.gap_after(&way), self.activity.pushes());
        let push = if pushed { self.impulse(&way, dt).max(0.0) } else { 0.0 };
        let place = self.meets(surface, [start, ways], at);
        if !pushed {
            let falls_short = place.filter(|place| place.distance < self.target - ADDED * self.thickness);
            let Some(place) = falls_short else { return look };
            self.put(&place, &ways, inv_m);
            let next = if self.can_push() { self.activity.added() } else { self.activity };
            if next != self.activity {
                (self.activity, look.is_changed) = (next, true);
                let way = self.relative(&ways);
                // As if it carried itself alone.
                let bound = friction * self.impulse(&way, dt) / STIFFNESS;
                let seen = self.seen(bound, [&way, &self.relative(&came)], dt);
                let rubs = friction > 0.0 && round > 0;
                self.friction = if rubs { Friction::guess(seen) } else { Friction::default() };
            }
            return look;
        }
        if let Some(place) = &place {
            if round < last && gap < THIN * self.thickness.min(self.gap) {
                (self.hardened, look.is_changed) = (self.hardened + 1, true);
            }
            self.put(place, &ways, inv_m);
            look.is_changed |= (self.gap_after(&self.relative(&ways)) - gap).abs() > SHORT * self.thickness;
        }
        // What slides goes across the direction that the next solve has.
        if friction > 0.0 && round < SETTLING {
            let seen = self.seen(friction * push, [&self.relative(&ways), &self.relative(&came)], dt);
            look.off = self.friction.look(seen, round);
        }
        if place.is_none() && !(self.pushes_at == PushesAt::Start && gap < self.target) {
            // What meets nothing where it was led has nothing to push, but pulls nothing.
            let pull = if gap < self.target { SHORT } else { (gap - self.target) / self.thickness };
            let next = self.activity.dropped(pull, round);
            if next != self.activity {
                (self.activity, self.friction, look.is_changed) = (next, Friction::default(), true);
            }
        }
        look
    }

    /// What was not certified on its ways (m) in a round pushes from now on, wherever its nearest points lie, and harder. What was not again, or so
    /// late, pushes where they were at the start.
    pub(crate) fn insist(&mut self, [start, ways]: [[Vec3<f64>; 4]; 2], inv_m: [f64; 4], round: u32) {
        let is_first = self.pushes_at == PushesAt::Touching && round < LATE;
        self.pushes_at = if is_first { PushesAt::Nearest } else { PushesAt::Start };
        if self.activity.pushes() || !is_first {
            self.hardened += 1;
        }
        let going = self.going([start, ways]);
        let meeting = if is_first { going.meets(self.target) } else { None };
        if let Some(place) = meeting.or_else(|| going.begins()) {
            self.put(&place, &ways, inv_m);
            if self.can_push() && !self.activity.pushes() {
                self.activity = Activity::Active;
            }
        }
    }

    /// Goes on as the same pair did that was found before.
    pub(crate) fn go_on(&mut self, before: &Self) {
        *self = *before;
    }
}

/// h² k (kg) of a pair with such weights of its corners and inverse masses (1/kg); 0 where nothing is free.
///
/// A stiffness K with what a pair lacks, t - g0, takes a corner K |w| / m / (1 + K sum w² / m) times as far. Between pins a corner of little weight
/// would go 1 / |w| times as far, to give back what only the pins could.
fn stiffness_of(weights: [f64; 4], inv_m: [f64; 4]) -> f64 {
    let softness: f64 = (0..4).map(|k| weights[k] * weights[k] * inv_m[k]).sum();
    let ease = (0..4).map(|k| weights[k].abs() * inv_m[k]).fold(0.0, f64::max);
    let softness = softness.max(STIFFNESS * (ease / FARTHEST - softness));
    if softness > 0.0 { STIFFNESS / softness } else { 0.0 }
}

/// Whether parts at a distance (m) stay apart, if no corner comes nearer to one of the other part than by `room` (m).
#[inline(always)]
pub(crate) fn is_clear(gap: f64, room: f64) -> bool {
    (1.0 - KEPT) * gap > room
}

/// Whether parts at `x` (m) may be so near that `room` (m) matters: along the way between their middles they are not seen to be farther apart.
#[inline(always)]
pub(crate) fn is_near(kind: PairKind, x: [Vec3<f64>; 4], room: f64) -> bool {
    let direction = between_middles(kind, x);
    let gap = (1.0 - KEPT) * gap_along(kind, x, &direction);
    // What is not a number is near.
    !(gap > 0.0 && gap * gap > room * room * direction.norm_squared())
}

/// How far (m) a corner of one part goes at most beside one of the other.
#[inline(always)]
pub(crate) fn furthest(kind: PairKind, [a, b, c, d]: &[Vec3<f64>; 4]) -> f64 {
    let apart = |one: &Vec3<f64>, other: &Vec3<f64>| (one - other).norm_squared();
    let squares = match kind {
        PairKind::VertexTriangle => [apart(a, b), apart(a, c), apart(a, d), 0.0],
        PairKind::Edges => [apart(a, c), apart(a, d), apart(b, c), apart(b, d)],
    };
    squares[0].max(squares[1]).max(squares[2].max(squares[3])).sqrt()
}
