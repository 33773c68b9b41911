//! A pair of parts of a surface in one sub-step: where they are closest at its start, and whether they push each other.
//!
//! With n the direction between the closest points, w their weights (1 in sum on the first side, -1 on the second) and g0 their distance, the gap at
//! the end is linear: g = g0 + h n.(w v'). A pair that is active adds the energy k (t - g)² / 2 to what the step minimises, so h² k n nᵀ
//! times w wᵀ to its matrix. k = 100 m / h², 1 / m = sum w² / m_i: a load of the weight of m lies g h² / 100 deep.

use crate::{
    cloth::layout::Surface,
    math::Vec3,
    surface::{Candidate, Inside, PairKind, between_middles, closest, gap_along},
};

/// h² k over the reduced mass of a pair.
pub(super) const STIFFNESS: f64 = 100.0;
/// Times what a pair lacks of its target that its push alone takes a particle, at most.
const FARTHEST: f64 = 3.0;
/// Share of the gap at the start that a pair must keep on its way.
pub(crate) const KEPT: f64 = 0.1;
/// Share of lost thickness that a sub-step gives back. All at once would throw what lies on top.
pub(super) const REGAINED: f64 = 0.1;
/// Shares of the thickness by which an active pair may pull before it is dropped, and by which another may fall short before it is added.
pub(super) const PULL: f64 = 0.0003;
pub(super) const SHORT: f64 = 0.01;
/// Share of the thickness and of the gap at the start below which a pair is made harder, and how much.
pub(super) const THIN: f64 = 0.5;
pub(super) const HARDER: f64 = 4.0;
/// Rounds after which certificates alone decide, and friction stays as it is: what is hard to keep apart does not settle while it changes.
pub(super) const SETTLING: u32 = 4;
/// Friction over Coulomb's bound from which on a pair slips.
const SLIPS: f64 = 1.05;
/// Least speed (m/s) along each other by which friction is divided: what rests creeps.
pub(super) const CREEP: f64 = 1e-3;

/// A pair in a sub-step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    pub(crate) candidate: Candidate,
    pub(crate) weights: [f64; 4],
    /// From the second part to the first: a unit vector.
    pub(crate) normal: Vec3<f64>,
    /// Distance at the start, distance that is kept, and the gap that the solve aims at (m).
    pub(crate) gap: f64,
    pub(crate) thickness: f64,
    pub(crate) target: f64,
    /// h² k (kg); 0 where nothing is free.
    pub(crate) stiffness: f64,
    /// Friction: h times force over speed (kg).
    pub(crate) rub: f64,
    /// Speeds along each other (m/s): that at which friction reaches its bound, and that without friction.
    slip: f64,
    free_speed: f64,
    pub(crate) activity: Activity,
    /// Whether its closest points are such that it may be added to those that push.
    bears: bool,
}

/// Whether a pair pushes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Activity {
    Idle,
    Active,
    /// It was dropped once in this sub-step, and is active again.
    Again,
    /// It was dropped once in this sub-step.
    Dropped,
}

impl Activity {
    pub(crate) fn pushes(self) -> bool {
        matches!(self, Self::Active | Self::Again)
    }

    fn added(self) -> Self {
        if matches!(self, Self::Dropped | Self::Again) { Self::Again } else { Self::Active }
    }
}

/// What a look at a pair after a solve changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    Nothing,
    Something,
}

impl Pair {
    /// A pair in a sub-step that begins with its corners at `x` (m), of inverse masses `inv_m` (1/kg), of velocities `v` (m/s), and
    /// that would go by `ways` (m) without forces. None where it stays apart whatever happens, as long as no corner comes nearer to one of the other
    /// part than by `room` (m).
    pub(crate) fn near(
        surface: &Surface,
        candidate: Candidate,
        x: [Vec3<f64>; 4],
        inv_m: [f64; 4],
        (ways, v): ([Vec3<f64>; 4], [Vec3<f64>; 4]),
        room: f64,
    ) -> Option<Self> {
        let found = closest(candidate.kind, x);
        let gap = found.difference.norm();
        if is_clear(gap, room) {
            return None;
        }
        let normal = if gap > 0.0 { found.difference / gap } else { Vec3::zeros() };
        let thickness = surface.distance_of(&candidate);
        let target = if gap < thickness { gap + REGAINED * (thickness - gap) } else { thickness };
        let weights = found.weights;
        let mut pair = Self {
            candidate,
            weights,
            normal,
            gap,
            thickness,
            target,
            stiffness: stiffness_of(weights, inv_m),
            rub: 0.0,
            slip: CREEP,
            free_speed: 0.0,
            activity: Activity::Idle,
            bears: bears(surface, &candidate, found.inside),
        };
        let velocity = pair.relative(v);
        pair.slip = (velocity - pair.normal * velocity.dot(&pair.normal)).norm().max(CREEP);
        let freely = pair.gap_after(&pair.relative(ways));
        let is_near = gap < (1.0 + SHORT) * thickness && freely < pair.target;
        if pair.can_push() && pair.bears && (is_near || freely < THIN * thickness) {
            pair.activity = Activity::Active;
        }
        Some(pair)
    }

    /// Whether anything of it is free, and it has a direction.
    pub(crate) fn can_push(&self) -> bool {
        self.stiffness > 0.0 && self.gap > 0.0
    }

    /// The way or velocity of the first closest point relative to the second, from those of the corners.
    pub(crate) fn relative(&self, of_corners: [Vec3<f64>; 4]) -> Vec3<f64> {
        let [a, b, c, d] = self.weights;
        of_corners[0] * a + of_corners[1] * b + of_corners[2] * c + of_corners[3] * d
    }

    /// The linear gap (m) after a relative way (m).
    pub(crate) fn gap_after(&self, way: &Vec3<f64>) -> f64 {
        self.gap + way.dot(&self.normal)
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

    /// Looks at where the solve of a round leads, from the relative way (m) in `dt` (s): drops what pulls, adds what bears and falls short, hardens
    /// what is too thin before the round `last`, and takes over friction of a coefficient.
    pub(crate) fn review(
        &mut self,
        way: &Vec3<f64>,
        dt: f64,
        friction: f64,
        [round, last]: [u32; 2],
    ) -> Change {
        let gap = self.gap_after(way);
        if !self.activity.pushes() {
            if self.bears && self.can_push() && gap < self.target - SHORT * self.thickness {
                self.activity = self.activity.added();
                // As if it carried itself alone.
                self.rub = friction * self.impulse(way, dt) / (STIFFNESS * self.slip);
                return Change::Something;
            }
            return Change::Nothing;
        }
        if gap > self.target + PULL * self.thickness && self.activity == Activity::Active {
            (self.activity, self.rub) = (Activity::Dropped, 0.0);
            return Change::Something;
        }
        let mut change = Change::Nothing;
        if round < last && gap < THIN * self.thickness.min(self.gap) {
            self.stiffness *= HARDER;
            change = Change::Something;
        }
        if friction > 0.0 && round < SETTLING && self.rubs_otherwise(way, dt, friction, round) {
            change = Change::Something;
        }
        change
    }

    /// Takes over friction of a coefficient from the relative way (m) in `dt` (s); whether that calls for another solve. The first solve of a sub-step
    /// has none, and says how fast the pair goes without. The next one has that which holds it at the speed that it came with. If
    /// that is more than Coulomb's bound, it slips: by a chord of the two, at the speed at which friction is the bound.
    fn rubs_otherwise(&mut self, way: &Vec3<f64>, dt: f64, friction: f64, round: u32) -> bool {
        let bound = friction * self.impulse(way, dt).max(0.0);
        let velocity = way / dt;
        let speed = (velocity - self.normal * velocity.dot(&self.normal)).norm();
        let had = self.rub * speed;
        let slips = self.rub > 0.0 && had > SLIPS * bound;
        if self.rub == 0.0 {
            self.free_speed = speed;
        } else if slips {
            let slower = (self.free_speed - speed).max(0.0);
            self.slip = (speed + slower * (had - bound) / had).max(CREEP);
        }
        self.rub = bound / self.slip;
        bound > 0.0 && (round == 0 || slips)
    }

    /// What was not certified pushes from now on, or pushes harder.
    pub(crate) fn insist(&mut self) {
        if !self.can_push() {
            return;
        }
        if self.activity.pushes() {
            self.stiffness *= HARDER;
        } else {
            (self.activity, self.bears) = (self.activity.added(), true);
        }
    }

    /// Goes on as the same pair did that was found before.
    pub(crate) fn go_on(&mut self, before: &Self) {
        (self.stiffness, self.activity) = (before.stiffness, before.activity);
        (self.rub, self.slip, self.free_speed) = (before.rub, before.slip, before.free_speed);
        self.bears = before.bears;
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

/// Whether the closest points let a pair push: inside of both parts, or where a triangle counts an edge or corner for all that have it, so that
/// rims push too.
fn bears(surface: &Surface, candidate: &Candidate, inside: Inside) -> bool {
    let triangle = candidate.triangle as usize;
    match (candidate.kind, inside) {
        (_, Inside::Both) => true,
        (PairKind::VertexTriangle, Inside::Edge(edge)) => surface.faces.owns_edge(triangle, edge.into()),
        (PairKind::VertexTriangle, Inside::Corner(corner)) => {
            surface.faces.owns_vertex(triangle, corner.into())
        }
        _ => false,
    }
}
