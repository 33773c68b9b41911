//! What colliders feel: minus the impulses that contact gives to cloth and snow.
//!
//! Enters, contact by contact, the change of a velocity times its mass, and where; leaves the sums over blocks in their
//! fixed order, and from them the mean force and torque over a step of the world.

use std::{ops::Range, sync::Arc};

use super::collider::Collider;
use crate::{
    math::{
        Vec3,
        array::{cross, dot, length, minus},
        array3,
    },
    parallel::{Share, sum_by},
    report::Load,
    sub_step::SubStep,
};

/// Bytes that a block of particles takes for each collider: what it gives in a sub-step, and in a step.
pub const LOAD_BYTES: u64 = 2 * size_of::<Felt>() as u64;

/// As many loads of 0 as there are colliders, in memory that nobody else holds: that which is given, if it is such.
pub(crate) fn cleared(mut loads: Arc<[Load]>, count: usize) -> Arc<[Load]> {
    if count == 0 {
        return loads;
    }
    match Arc::get_mut(&mut loads) {
        Some(own) if own.len() == count => own.fill(Load::default()),
        _ => loads = std::iter::repeat_n(Load::default(), count).collect(),
    }
    loads
}

/// What one collider got.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Felt {
    /// Impulse (N s), and its moment (N m s) about the shape's reference point at time 0.
    impulse: [f64; 3],
    moment: [f64; 3],
    /// What it gave by its motion (J): each impulse times the velocity of the surface there. In the frame of the surface a contact
    /// gives nothing, so that this is all that it gives.
    work: f64,
    contacts: u64,
    /// Number, from 1, of the particle that was counted last.
    last: u32,
}

impl Felt {
    /// Takes minus the impulse (N s) that a collider gave at a place (m), where its surface moves with a velocity (m/s).
    pub(crate) fn take(&mut self, collider: &Collider, given: [f64; 3], at: [f64; 3], moving: [f64; 3]) {
        let moment = cross(minus(at, collider.shape.reference()), given);
        self.work += dot(given, moving);
        for c in 0..3 {
            self.impulse[c] -= given[c];
            self.moment[c] -= moment[c];
        }
    }

    /// The size of the impulse (N s) that it got.
    pub(crate) fn push(&self) -> f64 {
        length(self.impulse)
    }

    /// What its motion gave (J).
    pub(crate) fn work(&self) -> f64 {
        self.work
    }

    /// Counts a contact.
    pub(crate) fn count(&mut self) {
        self.contacts += 1;
    }

    /// Adds what it got elsewhere.
    pub(crate) fn add(&mut self, other: &Self) {
        for c in 0..3 {
            self.impulse[c] += other.impulse[c];
            self.moment[c] += other.moment[c];
        }
        self.work += other.work;
        self.contacts += other.contacts;
    }

    fn numbers(&self) -> [f64; 8] {
        let ([px, py, pz], [lx, ly, lz]) = (self.impulse, self.moment);
        [px, py, pz, lx, ly, lz, self.work, self.contacts as f64]
    }

    fn of([px, py, pz, lx, ly, lz, work, contacts]: [f64; 8]) -> Self {
        let (impulse, moment) = ([px, py, pz], [lx, ly, lz]);
        Self { impulse, moment, work, contacts: contacts as u64, last: 0 }
    }

    /// Adds itself to the load of its collider in a step of the world.
    pub(crate) fn add_to(&self, load: &mut Load, collider: &Collider, whole: SubStep) {
        let SubStep { dt, end } = whole;
        let away = minus(collider.shape.reference(), collider.pose(end).position);
        let moved = cross(away, self.impulse);
        for c in 0..3 {
            load.force[c] += self.impulse[c] / dt;
            load.torque[c] += (self.moment[c] + moved[c]) / dt;
        }
        load.contacts += self.contacts;
    }
}

/// What each block gives to each collider.
#[derive(Clone, Debug, Default)]
pub(crate) struct BlockLoads {
    /// Of each block one after the other, for each collider.
    felt: Vec<Felt>,
    /// Numbers of the blocks, to be added by.
    blocks: Vec<usize>,
    colliders: usize,
}

impl BlockLoads {
    /// Makes room for so many blocks and colliders.
    pub(crate) fn size_for(&mut self, blocks: usize, colliders: usize) {
        self.colliders = colliders;
        self.felt.resize(blocks * colliders, Felt::default());
        let known = self.blocks.len();
        self.blocks.truncate(blocks);
        self.blocks.extend(known..blocks);
    }

    /// The same, with what it has room for.
    pub(crate) fn sized_for(&mut self, blocks: usize, colliders: usize) -> &mut [Felt] {
        self.size_for(blocks, colliders);
        &mut self.felt
    }

    /// Of each block one after the other, for each collider.
    pub(crate) fn felt_mut(&mut self) -> &mut [Felt] {
        &mut self.felt
    }

    /// What the motion of all colliders gave (J), of one process.
    pub(crate) fn work(&self) -> f64 {
        self.felt.iter().map(Felt::work).sum()
    }

    /// Forgets what was given.
    pub(crate) fn clear(&mut self) {
        self.felt.fill(Felt::default());
    }

    /// Adds what others of the same blocks gave.
    pub(crate) fn add(&mut self, other: &Self) {
        self.felt.iter_mut().zip(&other.felt).for_each(|(felt, other)| felt.add(other));
    }

    /// What all blocks of all ranks gave to the collider of a number; these are those of the whole body.
    pub(crate) fn sum(&self, share: &Share, collider: usize) -> Felt {
        Felt::of(share.sum(&self.blocks, &|block: &usize| self.numbers(*block, collider)))
    }

    /// The same of a range of blocks, which one process has, or which are the own ones of a share.
    pub(crate) fn sum_own(&self, own: Range<usize>, share: Option<&Share>, collider: usize) -> Felt {
        let (blocks, of) = (&self.blocks[own], |block: &usize| self.numbers(*block, collider));
        Felt::of(match share {
            Some(share) => share.sum_own_and_tell(blocks, &of, [], |[]| {}),
            None => sum_by(blocks, &of),
        })
    }

    fn numbers(&self, block: usize, collider: usize) -> [f64; 8] {
        self.felt[block * self.colliders + collider].numbers()
    }
}

/// What the blocks of a chunk give, of which each begins somewhere in an order of particles.
pub(crate) struct ChunkLoads<'a> {
    /// Of each block one after the other, for each collider.
    felt: &'a mut [Felt],
    colliders: usize,
    starts: &'a [u32],
    /// The block that was asked for last.
    block: usize,
}

impl<'a> ChunkLoads<'a> {
    /// Nothing so far; `starts` has where each block begins, and the end.
    pub(crate) fn new(felt: &'a mut [Felt], colliders: usize, starts: &'a [u32]) -> Self {
        felt.fill(Felt::default());
        Self { felt, colliders, starts, block: 0 }
    }

    /// What the block of the particle at a position of the order gives to each collider; positions ascend from call to call.
    pub(crate) fn at(&mut self, position: usize) -> &mut [Felt] {
        while self.starts[self.block + 1] as usize <= position {
            self.block += 1;
        }
        let first = self.block * self.colliders;
        &mut self.felt[first..first + self.colliders]
    }
}

/// How the surfaces move that particles touch: a velocity (m/s) is that of all of them, each as it pushes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Carried {
    /// Sizes of impulses (N s), and these times the velocities of surfaces (kg m²/s²).
    pub(crate) push: f64,
    pub(crate) along: [f64; 3],
    /// Impulses times velocities of surfaces: what the motion of colliders gave (J).
    pub(crate) work: f64,
    /// All impulses together (N s).
    pub(crate) impulse: [f64; 3],
}

impl Carried {
    /// The same with what others touch.
    pub(crate) fn and(self, other: Self) -> Self {
        let [mine, others] = [self, other].map(|carried| carried.numbers());
        Self::of(std::array::from_fn(|i| mine[i] + others[i]))
    }

    pub(crate) fn numbers(&self) -> [f64; 8] {
        let ([x, y, z], [px, py, pz]) = (self.along, self.impulse);
        [self.push, x, y, z, self.work, px, py, pz]
    }

    pub(crate) fn of([push, x, y, z, work, impulse @ ..]: [f64; 8]) -> Self {
        Self { push, along: [x, y, z], work, impulse }
    }

    /// The velocity (m/s) of the surfaces; that of none is 0.
    pub(crate) fn velocity(&self) -> [f64; 3] {
        if self.push > 0.0 { self.along.map(|c| c / self.push) } else { [0.0; 3] }
    }
}

/// What the particles of a block give in a sub-step, one after the other.
pub(crate) struct Giving<'a> {
    colliders: &'a [Collider],
    felt: &'a mut [Felt],
    carried: Carried,
    /// The inverse mass (1/kg) of the particle, and its number from 1 in the block.
    inv_m: f64,
    particle: u32,
}

impl<'a> Giving<'a> {
    /// Of the first particle of a block, to colliders that felt so much before.
    pub(crate) fn new(colliders: &'a [Collider], felt: &'a mut [Felt]) -> Self {
        Self { colliders, felt, carried: Carried::default(), inv_m: 0.0, particle: 0 }
    }

    /// Goes on to a particle, by its number from 0 in the block, of an inverse mass (1/kg).
    pub(crate) fn of(&mut self, particle: usize, inv_m: f64) {
        (self.particle, self.inv_m) = (particle as u32 + 1, inv_m);
    }

    /// How the surfaces move that were touched.
    pub(crate) fn carried(&self) -> Carried {
        self.carried
    }

    /// The particle touched a collider at a place (m), where its surface moves with a velocity (m/s), which changed its own by
    /// so much (m/s).
    pub(crate) fn touched(
        &mut self,
        collider: &Collider,
        change: &Vec3<f64>,
        (at, moving): (&Vec3<f64>, [f64; 3]),
    ) {
        let given = array3(&(change / self.inv_m));
        let push = length(given);
        let along = moving.map(|c| push * c);
        let carried = Carried { push, along, work: dot(given, moving), impulse: given };
        self.carried = self.carried.and(carried);
        let number = self.colliders.iter().position(|other| std::ptr::eq(other, collider));
        let Some(felt) = self.felt.get_mut(number.unwrap_or(usize::MAX)) else { return };
        felt.take(collider, given, array3(at), moving);
        if felt.last != self.particle {
            felt.last = self.particle;
            felt.count();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collide::{
        collider::{Contact, StartInside},
        motion::{PoseKey, Way, pose::Pose},
        shape::{Shape, Sphere},
    };

    fn ball(center: [f64; 3], velocity: [f64; 3], way: Option<Way>) -> Collider {
        Collider {
            name: "ball".into(),
            shape: Shape::Sphere(Sphere { center, radius: 0.1 }),
            velocity,
            way,
            friction: 0.0,
            restitution: 0.0,
            margin: 0.0,
            contact: Contact::Separating,
            recovery: Collider::RECOVERY,
            on_start_inside: StartInside::Warn,
        }
    }

    fn load(collider: &Collider, given: &[([f64; 3], [f64; 3])], [dt, end]: [f64; 2]) -> Load {
        let (mut felt, mut load) = (Felt::default(), Load::default());
        for (given, at) in given {
            felt.take(collider, *given, *at, collider.velocity_at(*at, end));
        }
        felt.add_to(&mut load, collider, SubStep { dt, end });
        load
    }

    #[test]
    fn a_load_is_minus_what_was_given_over_the_step_and_turns_about_where_the_reference_point_is() {
        let still = ball([1.0, 2.0, 3.0], [0.0; 3], None);
        let found = load(&still, &[([0.0, 4.0, 0.0], [1.5, 2.0, 3.0])], [0.5, 9.0]);
        assert_eq!((found.force, found.torque), ([0.0, -8.0, 0.0], [0.0, 0.0, -4.0]));

        // At 2 s both are at (1, 2, 7): the force acts 4 m in front of them, along x.
        let (way, end) = ([0.0, 0.0, 2.0], [1.0, 2.0, 7.0]);
        let key = |time, position| PoseKey { time, pose: Pose { position, turn: Pose::NO_TURN } };
        let keys = vec![key(0.0, [1.0, 2.0, 3.0]), key(2.0, end)];
        for moving in [ball([1.0, 2.0, 3.0], way, None), ball([1.0, 2.0, 3.0], [0.0; 3], Some(Way { keys }))]
        {
            let found = load(&moving, &[([0.0, 4.0, 0.0], [5.0, 2.0, 7.0])], [0.5, 2.0]);
            assert_eq!((found.force, found.torque), ([0.0, -8.0, 0.0], [0.0, 0.0, -32.0]));
        }
    }

    #[test]
    fn a_particle_counts_once_for_each_collider() {
        let colliders = [ball([0.0; 3], [0.0; 3], None), ball([1.0, 0.0, 0.0], [0.0; 3], None)];
        let mut felt = [Felt::default(); 2];
        let mut giving = Giving::new(&colliders, &mut felt);
        for (particle, collider, change) in [(0, 0, 1.0), (0, 1, 2.0), (0, 0, 0.5), (4, 0, 0.0), (5, 1, 3.0)]
        {
            giving.of(particle, 2.0);
            giving.touched(
                &colliders[collider],
                &Vec3::new(0.0, change, 0.0),
                (&Vec3::zeros(), [0.0, 7.0, 0.0]),
            );
        }
        let carried =
            Carried { push: 3.25, along: [0.0, 22.75, 0.0], work: 22.75, impulse: [0.0, 3.25, 0.0] };
        assert_eq!(giving.carried(), carried);
        assert_eq!(felt.map(|felt| felt.contacts), [2, 2]);
        assert_eq!(felt.map(|felt| felt.impulse[1]), [-0.75, -2.5]);
        assert_eq!(felt.map(|felt| felt.moment), [[0.0; 3], [0.0, 0.0, 2.5]]);
        assert_eq!(felt.map(|felt| felt.work), [7.0 * 0.75, 7.0 * 2.5]);
    }

    #[test]
    fn memory_that_nobody_holds_is_taken_again() {
        let none = cleared(Arc::default(), 0);
        assert!(none.is_empty());
        let mut loads = cleared(none, 2);
        Arc::get_mut(&mut loads).expect("its own").fill(Load { contacts: 3, ..Load::default() });
        let place = loads.as_ptr();
        let again = cleared(loads, 2);
        assert_eq!((again.as_ptr(), &again[..]), (place, &[Load::default(); 2][..]));
        let held = again.clone();
        let other = cleared(again, 2);
        assert_ne!(other.as_ptr(), held.as_ptr());
    }
}
