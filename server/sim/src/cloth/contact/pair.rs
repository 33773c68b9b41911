//! A pair of parts of a surface in one sub-step: where they meet, and whether they push each other.
//!
//! Its stencil is that of the nearest points where they meet, and its gap linear about that place: g = g* + n.(w x' - w x*). k = 100 m / h²,
//! 1 / m = sum w² / m_i: a load of the weight of m lies g h² / 100 deep.

use super::{
    friction::{Friction, Off, Seen},
    hold::{Activity, Hold, Stencil},
    place::{Going, Place},
    rules::{ADDED, HARDER, KEPT, LATE, SETTLING, SHORT, STIFFNESS, THIN},
};
use crate::{
    cloth::layout::Surface,
    math::Vec3,
    surface::{Candidate, PairKind, between_middles, closest, gap_along},
};

/// Times what a pair lacks of its target that its push alone takes a particle, at most.
const FARTHEST: f64 = 3.0;

/// A pair in a sub-step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pair {
    pub(super) stencil: Stencil,
    pub(super) hold: Hold,
    /// Number of the triangle, as in a [`Candidate`].
    triangle: u32,
    /// From the second part to the first at the start: a unit vector.
    pub(super) direction: Vec3<f64>,
    /// Distance (m) that is kept.
    pub(super) thickness: f64,
    pushes_at: PushesAt,
    /// How many times it was made harder.
    hardened: u8,
    /// How many sub-steps that the scene asks for this one is long: it stays as stiff as in one of them. Two bytes, as there are many pairs.
    steps: u16,
}

/// Where a pair pushes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum PushesAt {
    /// Where the surfaces touch that it is part of.
    #[default]
    Touching,
    /// Wherever its nearest points lie: it was not certified once.
    Nearest,
    /// Where its nearest points were at the start: it was not certified once more, or late. Sets of such pairs do not alternate.
    Start,
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
    /// The parts that it is of.
    pub(super) fn candidate(&self) -> Candidate {
        Candidate { corners: self.stencil.corners, triangle: self.triangle }
    }

    /// Is of other parts from now on, of which nothing else is known yet.
    pub(super) fn take(&mut self, candidate: Candidate) {
        (self.stencil.corners, self.triangle) = (candidate.corners, candidate.triangle);
    }

    /// A pair in a sub-step that begins with its corners at `x` (m), may give back so much of what it lost (m), in a sub-step as long as so
    /// many of the scene. None where it stays apart whatever happens, as long as no corner comes nearer to one of the other part than by
    /// `room` (m).
    pub(crate) fn near(
        surface: &Surface,
        candidate: Candidate,
        x: [Vec3<f64>; 4],
        (room, [regained, steps]): (f64, [f64; 2]),
    ) -> Option<Self> {
        let found = closest(candidate.kind(), x);
        let gap = found.difference.norm();
        if is_clear(gap, room) {
            return None;
        }
        let direction = if gap > 0.0 { found.difference / gap } else { Vec3::zeros() };
        let thickness = surface.distance_of(&candidate);
        Some(Self {
            stencil: Stencil { corners: candidate.corners, weights: found.weights, normal: direction },
            hold: Hold::idle(gap, thickness.min(gap + regained), 0.0),
            triangle: candidate.triangle,
            direction,
            thickness,
            steps: steps as u16,
            ..Self::default()
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
        let place = self.going([start, ways]).meets(self.hold.target)?;
        let is_anywhere = self.pushes_at == PushesAt::Nearest;
        place.borne(&surface.faces, &self.candidate(), at).or(is_anywhere.then_some(place))
    }

    /// How its corners go such ways (m) from where they start.
    fn going(&self, [start, ways]: [[Vec3<f64>; 4]; 2]) -> Going {
        Going { kind: self.candidate().kind(), start, ways, gap: self.hold.began, normal: self.direction }
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
            self.hold.began < (1.0 + SHORT) * self.thickness || place.distance < THIN * self.thickness
        };
        if let Some(place) = self.meets(surface, on_ways, at).filter(is_near) {
            self.put(&place, &on_ways[1], inv_m);
            self.hold.add();
        }
    }

    /// Takes over where it meets on ways (m).
    fn put(&mut self, place: &Place, ways: &[Vec3<f64>; 4], inv_m: [f64; 4]) {
        (self.stencil.weights, self.stencil.normal) = (place.weights, place.normal);
        self.hold.gap = place.distance - place.share * self.across(ways);
        self.hold.stiffness = self.hardness() * stiffness_of(place.weights, inv_m);
    }

    /// How many times as hard it is as one of the scene's sub-step that was not made harder.
    fn hardness(&self) -> f64 {
        (0..self.hardened).fold(self.firmness(), |hardness, _| hardness * HARDER)
    }

    /// How many times as stiff it is, over h², as in one sub-step of the scene.
    fn firmness(&self) -> f64 {
        f64::from(self.steps) * f64::from(self.steps)
    }

    /// By how much (m) ways (m) of its corners take its parts farther apart.
    fn across(&self, ways: &[Vec3<f64>; 4]) -> f64 {
        self.stencil.normal.dot(&self.stencil.relative(ways))
    }

    /// What friction sees of it, from the ways (m) of its corners in `dt` (s) and the velocities (m/s) that they came with.
    fn seen(&self, bound: f64, [ways, came]: [&[Vec3<f64>; 4]; 2], dt: f64) -> Seen {
        let [way, came] = [ways, came].map(|vectors| self.stencil.along(&self.stencil.relative(vectors)));
        let mass = self.hold.stiffness / (STIFFNESS * self.hardness());
        Seen { bound, along: way / dt, came: came.norm(), mass }
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
        let (across, pushed) = (self.across(&ways), self.hold.activity.pushes());
        let gap = self.hold.gap_after(across);
        let push = if pushed { self.hold.impulse(across, dt).max(0.0) } else { 0.0 };
        let place = self.meets(surface, [start, ways], at);
        if !pushed {
            let least = self.hold.target - ADDED * self.thickness;
            let Some(place) = place.filter(|place| place.distance < least) else { return look };
            self.put(&place, &ways, inv_m);
            look.is_changed = self.hold.add();
            if look.is_changed {
                // As if it carried itself alone.
                let bound =
                    friction * self.hold.impulse(self.across(&ways), dt) / (STIFFNESS * self.firmness());
                let seen = self.seen(bound, [&ways, &came], dt);
                let rubs = friction > 0.0 && round > 0;
                self.hold.rub = if rubs { Friction::guess(seen) } else { Friction::default() };
            }
            return look;
        }
        if let Some(place) = &place {
            if round < last && gap < THIN * self.thickness.min(self.hold.began) {
                (self.hardened, look.is_changed) = (self.hardened + 1, true);
            }
            self.put(place, &ways, inv_m);
            let now = self.hold.gap_after(self.across(&ways));
            look.is_changed |= (now - gap).abs() > SHORT * self.thickness;
        }
        // What slides goes across the direction that the next solve has.
        if friction > 0.0 && round < SETTLING {
            let seen = self.seen(friction * push, [&ways, &came], dt);
            look.off = self.hold.rub.look(seen, round);
        }
        let target = self.hold.target;
        if place.is_none() && !(self.pushes_at == PushesAt::Start && gap < target) {
            // What meets nothing where it was led has nothing to push, but pulls nothing.
            let pull = if gap < target { SHORT } else { (gap - target) / self.thickness };
            look.is_changed |= self.hold.let_go(pull, round);
        }
        look
    }

    /// What was not certified on its ways (m) in a round pushes from now on, wherever its nearest points lie, and harder. What was not again, or so
    /// late, pushes where they were at the start.
    pub(crate) fn insist(&mut self, [start, ways]: [[Vec3<f64>; 4]; 2], inv_m: [f64; 4], round: u32) {
        let is_first = self.pushes_at == PushesAt::Touching && round < LATE;
        self.pushes_at = if is_first { PushesAt::Nearest } else { PushesAt::Start };
        if self.hold.activity.pushes() || !is_first {
            self.hardened += 1;
        }
        let going = self.going([start, ways]);
        let meeting = if is_first { going.meets(self.hold.target) } else { None };
        if let Some(place) = meeting.or_else(|| going.begins()) {
            self.put(&place, &ways, inv_m);
            if self.hold.stiffness > 0.0 && !self.hold.activity.pushes() {
                self.hold.activity = Activity::Active;
            }
        }
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
