//! Particles of one group after the grid: positions, deformation, stress; and where they go.
//!
//! Reads what a group gathered; writes the particles, their extremes and the node that each begins
//! at (Stomakhin et al. 2013, steps 7, 8 and 10).

use super::weights::first_node;
use crate::snow::{
    bound::Extremes,
    grid::migration::codes,
    law::{
        constitutive::{Coefficients, Moduli, hardened},
        deform::{Deformed, deform, predict, stiffness_of, undeformed},
    },
    particles::{Group, Pair, Particles, write},
    step::Engine,
};
use crate::{
    math::{Columns, LANES, Pack, Portable, Real, WithSimd},
    parallel::Disjoint,
};

/// A number a lane, in memory.
pub(crate) type Lane<R> = [R; LANES];

/// Positions and masses, velocities and J_P of a group, a quad a particle.
pub(crate) type Moving<R> = [[[R; 4]; LANES]; 2];

/// What sixteen particles brought from the grid.
#[derive(Clone, Copy)]
pub(crate) struct Arrival<R> {
    /// New velocity (m/s).
    pub(crate) v: [Lane<R>; 3],
    /// Velocity that moves the position (m/s).
    pub(crate) drift: [Lane<R>; 3],
    /// C to be kept (1/s), by columns.
    pub(crate) affine: [[Lane<R>; 3]; 3],
    /// Velocity gradient (1/s), by columns.
    pub(crate) gradient: [[Lane<R>; 3]; 3],
    /// Mass on the grid around the particle over h³ (kg/m³).
    pub(crate) density: Lane<R>,
    /// Coordinates of the block that it comes from.
    pub(crate) block: [Lane<R>; 3],
}

impl<R: Real> Arrival<R> {
    pub(crate) fn new() -> Self {
        let zero = [R::zero(); LANES];
        Self {
            v: [zero; 3],
            drift: [zero; 3],
            affine: [[zero; 3]; 3],
            gradient: [[zero; 3]; 3],
            density: zero,
            block: [zero; 3],
        }
    }
}

/// Planes that a step writes.
pub(crate) struct Planes<'a, R> {
    pub(crate) motion: Disjoint<'a, Pair<R>>,
    pub(crate) shape: Disjoint<'a, Pair<R>>,
    pub(crate) affine: Disjoint<'a, Pair<R>>,
    pub(crate) stress: Disjoint<'a, Pair<R>>,
}

/// Sums and extremes over the particles of a run of blocks, a number a lane.
#[derive(Clone, Copy)]
pub(crate) struct Tally<R> {
    /// As in [`Extremes`].
    extremes: [Lane<R>; 5],
    /// Smallest and largest J_P.
    jp: [Lane<R>; 2],
    /// Yielded, clamped, inverted, ballistic.
    counts: [Lane<R>; 4],
}

/// The same after the last group.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RunFigures {
    pub(crate) extremes: Extremes,
    pub(crate) jp: [f64; 2],
    /// Yielded, clamped, inverted, ballistic.
    pub(crate) counts: [u32; 4],
}

impl<R: Real> Tally<R> {
    pub(crate) fn new() -> Self {
        let (zero, largest) = ([R::zero(); LANES], [R::of(R::LARGEST); LANES]);
        let lowest = [R::of(-R::LARGEST); LANES];
        Self { extremes: [zero; 5], jp: [largest, lowest], counts: [zero; 4] }
    }

    pub(crate) fn finish(&self) -> RunFigures {
        let greatest = |lanes: &Lane<R>| lanes.iter().fold(f64::NEG_INFINITY, |most, x| most.max(x.to_f64()));
        let least = |lanes: &Lane<R>| lanes.iter().fold(f64::INFINITY, |least, x| least.min(x.to_f64()));
        let [wave2, alone2, speed2, gradient2, stretch2] = self.extremes.each_ref().map(greatest);
        let count = |lanes: &Lane<R>| lanes.iter().map(|x| x.to_f64() as u32).sum();
        RunFigures {
            extremes: Extremes { wave2, alone2, speed2, gradient2, stretch2 },
            jp: [least(&self.jp[0]), greatest(&self.jp[1])],
            counts: self.counts.each_ref().map(count),
        }
    }
}

/// What to do with the deformation.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Deformation {
    /// Predict, return, renew the stress.
    Step,
    /// Leave F_E and J_P as they are; renew the stress.
    Refresh,
}

/// Groups that are worked on together: one waits for square roots while the other goes on.
pub(crate) const TOGETHER: usize = 2;

/// Constants of a group's particles, a lane each.
#[derive(Clone, Copy)]
pub(crate) struct Constants<R> {
    /// Volume at rest (m³), and factor on the stiffness.
    pub(crate) fixed: [Lane<R>; 2],
    pub(crate) object: [u16; LANES],
}

/// The update of two groups; the second may be empty.
pub(crate) struct Update<'a, 'b, R> {
    pub(crate) groups: &'a [Group; TOGETHER],
    /// Positions and masses, velocities and J_P before the step.
    pub(crate) moving: &'a [Moving<R>; TOGETHER],
    pub(crate) arrivals: &'a [Arrival<R>; TOGETHER],
    /// Volume at rest (m³) and factor on the stiffness, and the object, by place.
    pub(crate) fixed: &'a [[R; 2]],
    pub(crate) object: &'a [u16],
    pub(crate) planes: &'a Planes<'b, R>,
    pub(crate) coefficients: &'a [Coefficients<R>],
    /// Time step (s); 1 / h (1/m); density on the grid over own, below which a particle is ballistic.
    pub(crate) dt: R,
    pub(crate) inverse_cell: R,
    pub(crate) ballistic_below: R,
    pub(crate) deformation: Deformation,
    /// Nodes an axis of the kernel.
    pub(crate) width: usize,
    pub(crate) tally: &'a mut Tally<R>,
    /// Blocks a period along each axis.
    pub(crate) periodic: [u32; 3],
    /// Where the particles went, see [`codes`].
    pub(crate) codes: &'a mut [[u16; LANES]; TOGETHER],
}

/// Reads the pair of each particle of a group.
#[inline(always)]
#[allow(unsafe_code, reason = "the particles of a group belong to one run of blocks")]
fn pair<P: Pack>(plane: &Disjoint<'_, Pair<P::Number>>, group: &Group) -> [[P; 4]; 2] {
    let mut quads = [[[P::Number::default(); 4]; LANES]; 2];
    plane.hold_all(&group.at);
    for lane in 0..LANES {
        // SAFETY: held above; the sorted order names each particle once, and a run of blocks is
        // worked on by one thread.
        let pair = unsafe { *plane.held_slot(group.at[lane] as usize) };
        (quads[0][lane], quads[1][lane]) = (pair[0], pair[1]);
    }
    [P::columns(&quads[0]), P::columns(&quads[1])]
}

#[inline(always)]
fn load3<P: Pack>(lanes: &[Lane<P::Number>; 3]) -> [P; 3] {
    [P::load(&lanes[0]), P::load(&lanes[1]), P::load(&lanes[2])]
}

#[inline(always)]
fn load9<P: Pack>(lanes: &[[Lane<P::Number>; 3]; 3]) -> [[P; 3]; 3] {
    [load3(&lanes[0]), load3(&lanes[1]), load3(&lanes[2])]
}

impl<R: Real> WithSimd<R> for Update<'_, '_, R> {
    const WIDE_BINARY64: bool = false;
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(mut self) {
        let one = P::one();
        let (mut shapes, mut jps, mut volumes) =
            ([[[one; 3]; 3]; TOGETHER], [one; TOGETHER], [one; TOGETHER]);
        let mut moduli = [Moduli::gather(self.coefficients, &[0; LANES], one); TOGETHER];
        for k in 0..TOGETHER {
            let group = &self.groups[k];
            let [.., jp] = P::columns(&self.moving[k][1]);
            let [[xx, xy, xz, yx], [yy, yz, zx, zy]] = pair(&self.planes.shape, group);
            let [[zz, ..], _] = pair(&self.planes.affine, group);
            let f = [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]];
            let Constants { fixed, object } = constants(self.fixed, self.object, group);
            (jps[k], volumes[k]) = (jp, P::load(&fixed[0]));
            moduli[k] = Moduli::gather(self.coefficients, &object, P::load(&fixed[1]));
            shapes[k] = match self.deformation {
                Deformation::Step => {
                    let gradient = load9(&self.arrivals[k].gradient);
                    predict(&f, &still(&gradient, self.ballistic(k, volumes[k])), P::splat(self.dt))
                }
                Deformation::Refresh => f,
            };
        }
        let new = match self.deformation {
            Deformation::Step => deform(&shapes, &jps, &volumes, &moduli),
            Deformation::Refresh => undeformed(&shapes, &jps, &volumes, &moduli),
        };
        for k in 0..TOGETHER {
            self.finish(k, &new[k], volumes[k], &moduli[k]);
        }
    }
}

/// 0 where a particle is ballistic: it moves as a point, and keeps its F_E.
#[inline(always)]
fn still<P: Pack>(gradient: &Columns<P>, ballistic: P) -> Columns<P> {
    let zero = P::zero();
    let mut out = *gradient;
    for axis in 0..3 {
        for k in 0..3 {
            out[axis][k] = zero.if_less(ballistic, zero, gradient[axis][k]);
        }
    }
    out
}

impl<R: Real> Update<'_, '_, R> {
    /// 1 where the density on the grid is below a share of m / V0, else 0: nearly alone.
    #[inline(always)]
    fn ballistic<P: Pack<Number = R>>(&self, k: usize, volume: P) -> P {
        let [.., m] = P::columns(&self.moving[k][0]);
        let own = m * self.ballistic_below;
        let density = P::load(&self.arrivals[k].density);
        (density * volume).if_less(own, P::one(), P::zero())
    }

    /// Writes a group, and counts it.
    #[inline(always)]
    fn finish<P: Pack<Number = R>>(&mut self, k: usize, new: &Deformed<P>, volume: P, moduli: &Moduli<P>) {
        let (zero, dt) = (P::zero(), P::splat(self.dt));
        let (group, arrival) = (&self.groups[k], &self.arrivals[k]);
        let [x, y, z, m] = P::columns(&self.moving[k][0]);
        let (v, drift) = (load3(&arrival.v), load3::<P>(&arrival.drift));
        let c = load9(&arrival.affine);
        let position = [x + dt * drift[0], y + dt * drift[1], z + dt * drift[2]];
        let ballistic = self.ballistic(k, volume);
        let c = still(&c, ballistic);
        let mut s = new.volume_stress;
        for k in 0..6 {
            s[k] = zero.if_less(ballistic, zero, s[k]);
        }
        let e = &new.elastic;
        let motion = [[position[0], position[1], position[2], m], [v[0], v[1], v[2], new.plastic_ratio]];
        write(&self.planes.motion, group, motion);
        let shape = [[e[0][0], e[1][0], e[2][0], e[0][1]], [e[1][1], e[2][1], e[0][2], e[1][2]]];
        write(&self.planes.shape, group, shape);
        let affine = [[e[2][2], c[0][0], c[1][0], c[2][0]], [c[0][1], c[1][1], c[2][1], c[0][2]]];
        write(&self.planes.affine, group, affine);
        write(&self.planes.stress, group, [[c[1][2], c[2][2], s[0], s[1]], [s[2], s[3], s[4], s[5]]]);
        let counts = [new.yielded, new.clamped, new.inverted, ballistic];
        let extremes = extremes(&new.elastic, new.hardening, &v, &c, volume / m, moduli);
        self.tally.include(group.count, extremes, new.plastic_ratio, counts);
        let mut node = position;
        for axis in 0..3 {
            let at = position[axis] * self.inverse_cell;
            node[axis] = match self.width {
                2 => first_node::<P, 2>(at),
                3 => first_node::<P, 3>(at),
                _ => first_node::<P, 4>(at),
            };
        }
        self.codes[k] = codes(&load3(&arrival.block), &node, self.periodic);
    }
}

/// What bounds the next step, from what is stored: F_E and C by columns, volume over mass.
#[inline(always)]
fn extremes<P: Pack>(
    f: &Columns<P>,
    hardening: P,
    v: &[P; 3],
    c: &Columns<P>,
    specific: P,
    moduli: &Moduli<P>,
) -> [P; 5] {
    let ([wave, alone], stretch2) = stiffness_of(f, hardening, moduli);
    let speed2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    let mut gradient2 = P::zero();
    for axis in 0..3 {
        for k in 0..3 {
            gradient2 += c[axis][k] * c[axis][k];
        }
    }
    [wave * specific, alone * specific, speed2, gradient2, stretch2]
}

impl<R: Real> Engine<R> {
    /// The extremes of one particle, as a step has them.
    pub(crate) fn extremes_of(&self, group: &Group) -> Extremes {
        let particles = &self.particles;
        let at = group.at[0] as usize;
        let lane = |value: R| Portable::splat(value);
        let columns = |rows: [[R; 3]; 3]| [0, 1, 2].map(|k| [0, 1, 2].map(|row| lane(rows[row][k])));
        let Constants { fixed, object } = constants(&particles.fixed, &particles.object, group);
        let moduli = Moduli::gather(&self.coefficients, &object, Portable::load(&fixed[1]));
        let values = extremes(
            &columns(particles.elastic(at)),
            hardened(lane(particles.plastic_ratio(at)), &moduli),
            &particles.v(at).map(lane),
            &columns(particles.affine(at)),
            lane(fixed[0][0]) / lane(particles.mass(at)),
            &moduli,
        );
        let [wave2, alone2, speed2, gradient2, stretch2] = values.map(|value| value.store()[0].to_f64());
        Extremes { wave2, alone2, speed2, gradient2, stretch2 }
    }
}

impl<R: Real> Tally<R> {
    /// Adds a group: extremes from what is stored, so that a run restored from its particles takes
    /// the same steps.
    #[inline(always)]
    fn include<P: Pack<Number = R>>(&mut self, count: usize, extremes: [P; 5], jp: P, counts: [P; 4]) {
        let mut active = [R::zero(); LANES];
        active[..count].fill(R::one());
        // Lanes past the last particle hold what is nobody's.
        let (active, zero) = (P::load(&active), P::zero());
        for k in 0..5 {
            let own = zero.if_less(active, extremes[k], zero);
            self.extremes[k] = P::load(&self.extremes[k]).max(own).store();
        }
        let [least, most] = [P::load(&self.jp[0]), P::load(&self.jp[1])];
        self.jp[0] = zero.if_less(active, least.min(jp), least).store();
        self.jp[1] = zero.if_less(active, most.max(jp), most).store();
        for k in 0..4 {
            self.counts[k] = (P::load(&self.counts[k]) + counts[k] * active).store();
        }
    }
}

impl<R: Real> Particles<R> {
    /// Planes to be written by several threads, and what is only read.
    pub(crate) fn planes(&mut self) -> (Planes<'_, R>, &[[R; 2]], &[u16]) {
        let Self { motion, shape, affine, stress, fixed, object, .. } = self;
        let planes = Planes {
            motion: Disjoint::new(motion),
            shape: Disjoint::new(shape),
            affine: Disjoint::new(affine),
            stress: Disjoint::new(stress),
        };
        (planes, fixed, object)
    }
}

impl<R: Real> Planes<'_, R> {
    /// Asks for what the update of the groups at `start` will read, and the gather of the next.
    #[inline(always)]
    pub(crate) fn prefetch(&self, list: &[u32], start: usize) {
        let ahead = LANES * TOGETHER;
        for at in &list[start..list.len().min(start + ahead)] {
            self.shape.prefetch(*at as usize);
            self.affine.prefetch(*at as usize);
            self.stress.prefetch(*at as usize);
        }
        for at in &list[list.len().min(start + ahead)..list.len().min(start + 2 * ahead)] {
            self.motion.prefetch(*at as usize);
        }
    }
}

/// Volumes, stiffness factors and objects of a group.
#[inline(always)]
pub(crate) fn constants<R: Real>(fixed: &[[R; 2]], object: &[u16], group: &Group) -> Constants<R> {
    let mut out = Constants { fixed: [[R::zero(); LANES]; 2], object: [0; LANES] };
    for lane in 0..LANES {
        let at = group.at[lane] as usize;
        [out.fixed[0][lane], out.fixed[1][lane]] = fixed[at];
        out.object[lane] = object[at];
    }
    out
}

/// Positions and masses, velocities and J_P of a group.
#[inline(always)]
#[allow(unsafe_code, reason = "the particles of a group belong to one run of blocks")]
pub(crate) fn motion<R: Real>(planes: &Planes<'_, R>, group: &Group, quads: &mut Moving<R>) {
    planes.motion.hold_all(&group.at);
    for lane in 0..LANES {
        // SAFETY: held above; the sorted order names each particle once, and a run of blocks is
        // worked on by one thread.
        let pair = unsafe { *planes.motion.held_slot(group.at[lane] as usize) };
        (quads[0][lane], quads[1][lane]) = (pair[0], pair[1]);
    }
}
