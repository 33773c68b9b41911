//! Particles as they are stored: the only file that knows where each number of a particle lies.
//!
//! Sixteen particles at a time are read into lanes and written back; a particle is found through the
//! sorted order of its block. Numbers lie in planes of two quads per particle, so that no two streams
//! of the same size move in step (they would alias in the first cache).

use super::{
    group::{Constants, Group, NewLanes},
    motion::Motion,
};
use crate::{
    interrupt,
    math::{Columns, LANES, Pack, Real},
    parallel::{Disjoint, Own, per_block, per_block_mut},
    snow::setup::SnowObject,
};

/// The numbers of a particle in one plane.
type Pair<R> = [[R; 4]; 2];

/// All particles, by place. Places are renewed now and then, so that those of a block lie together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Particles<R> {
    /// Position (m) and mass (kg); velocity (m/s) and J_P.
    motion: Vec<Pair<R>>,
    /// 24 numbers, eight per plane: F_E by rows; C (1/s) by rows; V0 tau (J) as xx yy zz xy xz yz.
    tensors: [Vec<Pair<R>>; 3],
    /// Volume at rest V0 (m³), and factor on the stiffness.
    fixed: Vec<[R; 2]>,
    /// The user's number of each particle.
    pub(crate) id: Vec<u32>,
    /// The object of each particle, which has a material.
    pub(crate) object: Vec<u16>,
}

impl<R: Real> Particles<R> {
    /// The particles of all objects, in the user's order: F_E = I, C as the object turns, J_P = 1, no stress.
    pub(crate) fn of(objects: &[SnowObject]) -> Self {
        let count = objects.iter().map(|object| object.x.len()).sum();
        let mut particles = Self {
            motion: Vec::with_capacity(count),
            tensors: std::array::from_fn(|_| vec![[[R::zero(); 4]; 2]; count]),
            fixed: Vec::with_capacity(count),
            id: Vec::with_capacity(count),
            object: Vec::with_capacity(count),
        };
        for (index, object) in objects.iter().enumerate() {
            for i in 0..object.x.len() {
                let ([x, y, z], [vx, vy, vz]) = (object.x[i].map(R::of), object.v[i].map(R::of));
                particles.motion.push([[x, y, z, R::of(object.mass[i])], [vx, vy, vz, R::one()]]);
                let [volume, factor] = [&object.volume, &object.stiffness].map(|n| *n.get(i).unwrap_or(&1.0));
                particles.fixed.push([R::of(volume), R::of(factor)]);
                particles.id.push(particles.id.len() as u32);
                particles.object.push(index as u16);
            }
        }

        let (zero, one) = (R::zero(), R::one());
        let identity = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
        for at in 0..count {
            interrupt::point();
            let c = objects[usize::from(particles.object[at])].affine_velocity().map(|row| row.map(R::of));
            particles.set_tensors(at, identity, c, [zero; 6]);
        }

        particles
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.id.len()
    }

    /// Position (m) of the particle at a place.
    pub(crate) fn x(&self, at: usize) -> [R; 3] {
        let [x, y, z, _] = self.motion[at][0];
        [x, y, z]
    }

    /// Velocity (m/s).
    pub(crate) fn v(&self, at: usize) -> [R; 3] {
        let [x, y, z, _] = self.motion[at][1];
        [x, y, z]
    }

    /// Mass (kg).
    pub(crate) fn mass(&self, at: usize) -> R {
        self.motion[at][0][3]
    }

    /// Plastic volume ratio J_P.
    pub(crate) fn plastic_ratio(&self, at: usize) -> R {
        self.motion[at][1][3]
    }

    /// Volume at rest V0 (m³).
    pub(crate) fn volume(&self, at: usize) -> R {
        self.fixed[at][0]
    }

    /// F_E by rows.
    #[inline(always)]
    pub(crate) fn f_e(&self, at: usize) -> [[R; 3]; 3] {
        let [[xx, xy, xz, yx], [yy, yz, zx, zy]] = self.tensors[0][at];
        let [[zz, ..], _] = self.tensors[1][at];
        [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]]
    }

    /// C (1/s) by rows.
    #[inline(always)]
    pub(crate) fn c(&self, at: usize) -> [[R; 3]; 3] {
        let [[_, xx, xy, xz], [yx, yy, yz, zx]] = self.tensors[1][at];
        let [[zy, zz, ..], _] = self.tensors[2][at];
        [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]]
    }

    /// V0 tau (J): xx yy zz xy xz yz.
    #[inline(always)]
    pub(crate) fn v0_tau(&self, at: usize) -> [R; 6] {
        let [[.., xx, yy], [zz, xy, xz, yz]] = self.tensors[2][at];
        [xx, yy, zz, xy, xz, yz]
    }

    /// Gives a particle another position (m), velocity (m/s) and J_P.
    pub(crate) fn set_motion(&mut self, at: usize, [x, v]: [[R; 3]; 2], plastic_ratio: R) {
        let mass = self.mass(at);
        self.motion[at] = [[x[0], x[1], x[2], mass], [v[0], v[1], v[2], plastic_ratio]];
    }

    /// Gives a particle a velocity (m/s).
    pub(crate) fn set_v(&mut self, at: usize, v: [R; 3]) {
        self.motion[at][1][..3].copy_from_slice(&v);
    }

    /// Gives a particle its volume at rest V0 (m³).
    pub(crate) fn set_volume(&mut self, at: usize, volume: R) {
        self.fixed[at][0] = volume;
    }

    /// Puts F_E, C and V0 tau in their places.
    pub(crate) fn set_tensors(&mut self, at: usize, f_e: [[R; 3]; 3], c: [[R; 3]; 3], v0_tau: [R; 6]) {
        let numbers = f_e.as_flattened().iter().chain(c.as_flattened()).chain(&v0_tau);
        for (n, number) in numbers.enumerate() {
            self.tensors[n / 8][at][n % 8 / 4][n % 4] = *number;
        }
    }

    /// All numbers of a particle, in the order in which they are stored.
    pub(super) fn numbers(&self, at: usize) -> impl Iterator<Item = &R> {
        let planes = [&self.motion].into_iter().chain(&self.tensors);
        planes.flat_map(move |plane| plane[at].as_flattened()).chain(&self.fixed[at])
    }

    /// The same, to be written.
    pub(super) fn numbers_mut(&mut self, at: usize) -> impl Iterator<Item = &mut R> {
        let planes = [&mut self.motion].into_iter().chain(&mut self.tensors);
        planes.flat_map(move |plane| plane[at].as_flattened_mut()).chain(&mut self.fixed[at])
    }

    /// Puts the numbers of particles in a new order, but for `id` and `object`; `spare` is scratch.
    pub(crate) fn permute(&mut self, order: &[u32], spare: &mut Vec<[R; 4]>) {
        spare.resize(order.len(), [R::zero(); 4]);
        let Self { motion, tensors: [first, second, third], fixed, .. } = self;
        let all = Own::whole(order.len(), 1);
        for plane in [motion, first, second, third] {
            for half in 0..2 {
                let fields = (per_block_mut(spare), per_block(order));
                all.each(fields, |_, (quad, place)| *quad = plane[*place as usize][half]);
                let fields = (per_block_mut(plane), per_block(spare));
                all.each(fields, |_, (pair, quad)| pair[half] = *quad);
            }
        }

        all.each((per_block_mut(spare), per_block(order)), |_, (quad, place)| {
            let [volume, factor] = fixed[*place as usize];
            *quad = [volume, factor, R::zero(), R::zero()];
        });

        let fields = (per_block_mut(fixed), per_block(spare));
        all.each(fields, |_, (fixed, quad)| *fixed = [quad[0], quad[1]]);
    }

    /// Bytes in use.
    pub(crate) fn bytes(&self) -> usize {
        let pairs = self.motion.capacity() + self.tensors.iter().map(Vec::capacity).sum::<usize>();
        pairs * size_of::<Pair<R>>()
            + self.fixed.capacity() * size_of::<[R; 2]>()
            + self.id.capacity() * 4
            + self.object.capacity() * 2
    }
}

/// Groups of particles that are read into lanes while nobody writes.
impl<R: Real> Particles<R> {
    /// Positions (m) and masses (kg).
    #[inline(always)]
    pub(crate) fn x_and_mass<P: Pack<Number = R>>(&self, group: &Group) -> ([P; 3], P) {
        let [x, y, z, mass] = read::<P, 0>(&self.motion, group);
        ([x, y, z], mass)
    }

    /// Velocities (m/s) and J_P.
    #[inline(always)]
    pub(crate) fn v_and_plastic_ratio<P: Pack<Number = R>>(&self, group: &Group) -> ([P; 3], P) {
        let [x, y, z, plastic_ratio] = read::<P, 1>(&self.motion, group);
        ([x, y, z], plastic_ratio)
    }

    /// F_E by columns.
    #[inline(always)]
    pub(crate) fn f_e_columns<P: Pack<Number = R>>(&self, group: &Group) -> Columns<P> {
        let [xx, xy, xz, yx] = read::<P, 0>(&self.tensors[0], group);
        let [yy, yz, zx, zy] = read::<P, 1>(&self.tensors[0], group);
        let [zz, ..] = read::<P, 0>(&self.tensors[1], group);
        [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]]
    }

    /// V0 tau (J): xx yy zz xy xz yz.
    #[inline(always)]
    pub(crate) fn v0_tau_lanes<P: Pack<Number = R>>(&self, group: &Group) -> [P; 6] {
        let [.., xx, yy] = read::<P, 0>(&self.tensors[2], group);
        let [zz, xy, xz, yz] = read::<P, 1>(&self.tensors[2], group);
        [xx, yy, zz, xy, xz, yz]
    }

    /// C (1/s) by columns; and V0 tau (J), which shares a quad with it: xx yy zz xy xz yz.
    #[inline(always)]
    pub(crate) fn c_columns_and_v0_tau<P: Pack<Number = R>>(&self, group: &Group) -> (Columns<P>, [P; 6]) {
        let [zy, zz, sxx, syy] = read::<P, 0>(&self.tensors[2], group);
        let [szz, sxy, sxz, syz] = read::<P, 1>(&self.tensors[2], group);
        let [_, xx, xy, xz] = read::<P, 0>(&self.tensors[1], group);
        let [yx, yy, yz, zx] = read::<P, 1>(&self.tensors[1], group);
        ([[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]], [sxx, syy, szz, sxy, sxz, syz])
    }

    /// Positions, masses, velocities and J_P of a group.
    pub(crate) fn motion(&self, group: &Group) -> Motion<R> {
        let mut out = Motion::new();
        for lane in 0..LANES {
            out.set(lane, self.motion[group.at[lane] as usize]);
        }
        out
    }

    /// What never changes of the particles of a group.
    #[inline(always)]
    pub(crate) fn constants(&self, group: &Group) -> Constants<R> {
        constants(&self.fixed, &self.object, group)
    }
}

/// One quad of each particle of a group, in lanes.
#[inline(always)]
fn read<P: Pack, const HALF: usize>(plane: &[Pair<P::Number>], group: &Group) -> [P; 4] {
    let mut quads = [[P::Number::default(); 4]; LANES];
    for lane in 0..LANES {
        quads[lane] = plane[group.at[lane] as usize][HALF];
    }
    P::columns(&quads)
}

#[inline(always)]
fn constants<R: Real>(fixed: &[[R; 2]], object: &[u16], group: &Group) -> Constants<R> {
    let mut out = Constants { volume: [R::zero(); LANES], stiffness: [R::zero(); LANES], object: [0; LANES] };
    for lane in 0..LANES {
        let at = group.at[lane] as usize;
        [out.volume[lane], out.stiffness[lane]] = fixed[at];
        out.object[lane] = object[at];
    }
    out
}

/// Particles that several threads read and write, each place by one of them.
pub(crate) struct SharedParticles<'a, R> {
    motion: Disjoint<'a, Pair<R>>,
    tensors: [Disjoint<'a, Pair<R>>; 3],
    fixed: &'a [[R; 2]],
    object: &'a [u16],
    /// The user's number of each particle.
    pub(crate) id: &'a [u32],
}

impl<R: Real> Particles<R> {
    /// Shares particles among threads; the sorted order keeps these apart.
    pub(crate) fn share(&mut self) -> SharedParticles<'_, R> {
        let Self { motion, tensors, fixed, object, id } = self;
        SharedParticles {
            motion: Disjoint::new(motion),
            tensors: tensors.each_mut().map(|plane| Disjoint::new(plane)),
            fixed,
            object,
            id,
        }
    }
}

impl<R: Real> SharedParticles<'_, R> {
    /// Asks for the tensors of the places `list[start..]`, and for the motion of the places after
    /// these: `ahead` of each.
    #[inline(always)]
    pub(crate) fn prefetch(&self, list: &[u32], start: usize, ahead: usize) {
        for at in &list[start..list.len().min(start + ahead)] {
            self.tensors[0].prefetch(*at as usize);
            self.tensors[1].prefetch(*at as usize);
            self.tensors[2].prefetch(*at as usize);
        }
        for at in &list[list.len().min(start + ahead)..list.len().min(start + 2 * ahead)] {
            self.motion.prefetch(*at as usize);
        }
    }

    /// Reads positions, masses, velocities and J_P of a group.
    #[inline(always)]
    #[allow(unsafe_code, reason = "the particles of a group belong to one chunk of blocks")]
    pub(crate) fn read_motion(&self, group: &Group, out: &mut Motion<R>) {
        self.motion.hold_all(&group.at);
        for lane in 0..LANES {
            // SAFETY: held above; the sorted order names each particle once, and one thread works on a chunk.
            let pair = unsafe { *self.motion.held_slot(group.at[lane] as usize) };
            out.set(lane, pair);
        }
    }

    /// What never changes of the particles of a group.
    #[inline(always)]
    pub(crate) fn constants(&self, group: &Group) -> Constants<R> {
        constants(self.fixed, self.object, group)
    }

    /// F_E by columns.
    #[inline(always)]
    pub(crate) fn f_e_columns<P: Pack<Number = R>>(&self, group: &Group) -> Columns<P> {
        let [[xx, xy, xz, yx], [yy, yz, zx, zy]] = read_shared::<P>(&self.tensors[0], group);
        let [[zz, ..], _] = read_shared::<P>(&self.tensors[1], group);
        [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]]
    }

    /// Writes a group.
    #[inline(always)]
    pub(crate) fn write<P: Pack<Number = R>>(&self, group: &Group, new: &NewLanes<P>) {
        let NewLanes { x, mass, v, plastic_ratio, f_e: f, c, v0_tau: s } = new;
        write(&self.motion, group, [[x[0], x[1], x[2], *mass], [v[0], v[1], v[2], *plastic_ratio]]);
        let first = [[f[0][0], f[1][0], f[2][0], f[0][1]], [f[1][1], f[2][1], f[0][2], f[1][2]]];
        write(&self.tensors[0], group, first);
        let second = [[f[2][2], c[0][0], c[1][0], c[2][0]], [c[0][1], c[1][1], c[2][1], c[0][2]]];
        write(&self.tensors[1], group, second);
        write(&self.tensors[2], group, [[c[1][2], c[2][2], s[0], s[1]], [s[2], s[3], s[4], s[5]]]);
    }
}

/// Both quads of each particle of a group, in lanes.
#[inline(always)]
#[allow(unsafe_code, reason = "the particles of a group belong to one chunk of blocks")]
fn read_shared<P: Pack>(plane: &Disjoint<'_, Pair<P::Number>>, group: &Group) -> [[P; 4]; 2] {
    let mut quads = [[[P::Number::default(); 4]; LANES]; 2];
    plane.hold_all(&group.at);
    for lane in 0..LANES {
        // SAFETY: held above; the sorted order names each particle once, and one thread works on a chunk.
        let pair = unsafe { *plane.held_slot(group.at[lane] as usize) };
        (quads[0][lane], quads[1][lane]) = (pair[0], pair[1]);
    }
    [P::columns(&quads[0]), P::columns(&quads[1])]
}

/// Writes both quads of each particle of a group.
#[inline(always)]
#[allow(unsafe_code, reason = "the particles of a group belong to one chunk of blocks")]
fn write<P: Pack>(plane: &Disjoint<'_, Pair<P::Number>>, group: &Group, pair: [[P; 4]; 2]) {
    let (first, second) = (P::rows(pair[0]), P::rows(pair[1]));
    plane.hold_all(&group.at);
    for lane in 0..group.count {
        // SAFETY: held above; the sorted order names each particle once, and one thread works on a chunk.
        unsafe { *plane.held_slot(group.at[lane] as usize) = [first[lane], second[lane]] };
    }
}
