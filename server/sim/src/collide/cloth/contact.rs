//! Contact of cloth: which particles would end a step inside a collider, and what comes of them.
//!
//! Reads positions (m) and velocities (m/s) at the start of a step, and reads and writes those at its end. What one particle
//! does is in [`super::answer`].

use super::{
    answer::Encounter,
    facing::{Facing, facing, mesh},
    passed::has_passed,
    pinch::can_hold,
    touch::Answer,
};
use crate::{
    collide::{
        collider::Collider,
        load::{BlockLoads, Carried, Felt, Giving},
        shape::{MeshSolid, Near},
    },
    math::{Padded, Real, Vec3, array::length, array3, vec3},
    parallel::{Share, block_count, per_block_mut, per_row, per_row_mut, several_per_block_mut},
    report::Load,
    sub_step::SubStep,
};

/// Reach of a look around, over what is needed: a particle that comes nearer soon asks less.
const LOOK: f64 = 4.0;

/// Where and when particles may have met colliders.
#[derive(Clone, Copy)]
pub(crate) struct Contacts<'a> {
    pub(crate) colliders: &'a [Collider],
    pub(crate) sub_step: SubStep,
    /// The blocks of particles that are looked at here.
    pub(crate) share: &'a Share,
    /// The user's number of each particle.
    pub(crate) user: &'a [u32],
}

/// A particle that went through a collider.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Passed {
    /// In the user's numbering.
    pub(crate) particle: u32,
    /// Index of the collider.
    pub(crate) collider: u32,
}

/// What met colliders in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Met {
    /// Particles that touched one.
    pub(crate) touched: u64,
    /// Those of them that were inside one at the start of the step already.
    pub(crate) inside: u64,
    /// Particles that were in front of one at the start of the step, and are behind it or within it at its end.
    pub(crate) passed: u64,
    /// The first of these in the user's numbering.
    pub(crate) first_passed: Option<Passed>,
    /// Particles that a collider with creases leaves no room, and the first of them in the user's numbering.
    pub(crate) pinched: u64,
    pub(crate) first_pinched: Option<u32>,
    /// Energy (J) that bounces add where a method's velocities are not those of its way: it takes as much in flight.
    pub(crate) swing: f64,
    /// How the surfaces move that were touched.
    pub(crate) carried: Carried,
}

impl Met {
    /// What two disjoint sets of particles met.
    fn and(self, other: Self) -> Self {
        let first = self.first_passed.into_iter().chain(other.first_passed).min();
        let first_pinched = self.first_pinched.into_iter().chain(other.first_pinched).min();
        Self {
            touched: self.touched + other.touched,
            inside: self.inside + other.inside,
            passed: self.passed + other.passed,
            first_passed: first,
            pinched: self.pinched + other.pinched,
            first_pinched,
            swing: self.swing + other.swing,
            carried: self.carried.and(other.carried),
        }
    }

    /// What all blocks of all ranks met.
    fn of_all(share: &Share, blocks: &[Self]) -> Self {
        let own = share.own().blocks(blocks).iter().copied().fold(Self::default(), Self::and);
        let Passed { particle, collider } =
            own.first_passed.unwrap_or(Passed { particle: u32::MAX, collider: u32::MAX });
        let pinched = own.first_pinched.unwrap_or(u32::MAX);
        let counts = [own.touched, own.inside, own.passed, own.pinched].map(|count| count as f64);
        let [touched, inside, passed, held] = counts;
        let mut all = Self::default();
        let told = [touched, inside, passed, particle.into(), collider.into(), held, pinched.into()];
        let sums = |block: &Self| {
            let [push, x, y, z, work, px, py, pz] = block.carried.numbers();
            [block.swing, push, x, y, z, work, px, py, pz]
        };
        let [swing, carried @ ..] = share.sum_and_tell(
            blocks,
            &sums,
            told,
            |[touched, inside, passed, particle, collider, held, pinched]| {
                let first = Passed { particle: particle as u32, collider: collider as u32 };
                let first_passed = (passed > 0.0).then_some(first);
                let first_pinched = (held > 0.0).then_some(pinched as u32);
                let [touched, inside, passed, held] =
                    [touched, inside, passed, held].map(|count| count as u64);
                let pinched = held;
                let other =
                    Self { touched, inside, passed, first_passed, pinched, first_pinched, ..Self::default() };
                all = all.and(other);
            },
        );
        Self { swing, carried: Carried::of(carried), ..all }
    }
}

/// What is kept between steps: memory, and what spares questions.
#[derive(Clone, Debug, Default)]
pub(crate) struct Kept {
    /// What each block met.
    met: Vec<Met>,
    /// What each particle knows of each mesh among the colliders.
    near: Vec<Near>,
    /// What each block gave to each collider in the sub-step that is tried, and in those of the step that were accepted.
    tried: BlockLoads,
    given: BlockLoads,
}

impl Kept {
    /// Begins a step of the world.
    pub(crate) fn begin(&mut self) {
        self.given.clear();
    }

    /// Adds what the solve of the sub-step that is tried gave to colliders.
    pub(crate) fn add(&mut self, given: &BlockLoads) {
        self.tried.add(given);
    }

    /// Takes over what the sub-step that was tried gave to colliders.
    pub(crate) fn accept(&mut self) {
        self.given.add(&self.tried);
    }

    /// Adds what was given in a step of the world to the loads of its colliders.
    pub(crate) fn add_to(&self, share: &Share, loads: &mut [Load], colliders: &[Collider], whole: SubStep) {
        for (number, (load, collider)) in loads.iter_mut().zip(colliders).enumerate() {
            self.given.sum(share, number).add_to(load, collider, whole);
        }
    }
}

/// A particle, and what contact changes of it.
struct Moved<'a, R: Real> {
    /// Position and velocity at the start of the step.
    from: [&'a Padded<R>; 2],
    x: &'a mut Padded<R>,
    v: &'a mut Padded<R>,
    /// Position and velocity at the start of the step, of steps that go on from it.
    past: Option<[&'a mut Padded<R>; 2]>,
}

/// Resolves the contacts of all free particles (`inv_m` > 0), of which position and velocity were `from` before the step; tells
/// what met. Of steps that go on from the past, that of what was touched becomes that of a particle
/// which moved so before.
pub(crate) fn resolve<R: Real>(
    contacts: Contacts<'_>,
    inv_m: &[R],
    from: [&[Padded<R>]; 2],
    [x, v]: [&mut [Padded<R>]; 2],
    past: Option<[&mut [Padded<R>]; 2]>,
    Kept { met, near, tried, given }: &mut Kept,
) -> Met {
    if contacts.colliders.is_empty() {
        return Met::default();
    }

    let (count, size) = (contacts.user.len(), contacts.share.block_size());
    let (blocks, colliders) = (block_count(count, size), contacts.colliders.len());
    met.resize(blocks, Met::default());
    for sums in [&mut *tried, given] {
        sums.size_for(blocks, colliders);
    }
    let holds = can_hold(contacts.colliders);
    let meshes = contacts.colliders.iter().filter(|collider| mesh(collider).is_some()).count();
    near.resize(count * meshes, Near::default());
    let constants = (per_row(contacts.user), per_row(inv_m), from.map(per_row));
    let changed = ([x, v].map(per_row_mut), past.map(|past| past.map(per_row_mut)));
    let felt = several_per_block_mut(tried.felt_mut(), colliders);
    let fields = (per_block_mut(met), several_per_block_mut(near, size * meshes), felt, constants, changed);
    contacts.share.own().each(fields, |_, (met, near, felt, (user, inv_m, from), ([x, v], mut past))| {
        *met = Met::default();
        felt.fill(Felt::default());
        let mut giving = Giving::new(contacts.colliders, felt);
        for (row, (user, inv_m)) in user.iter().zip(inv_m).enumerate() {
            let past = past.as_mut().map(|[x, v]| [&mut x[row], &mut v[row]]);
            let from = from.map(|field| &field[row]);
            let moved = Moved { from, x: &mut x[row], v: &mut v[row], past };
            let near = &mut near[row * meshes..(row + 1) * meshes];
            giving.of(row, inv_m.to_f64());
            if let Some(one) = of_one(contacts, *user, *inv_m, moved, near, (holds, &mut giving)) {
                *met = met.and(one);
            }
        }
        met.carried = giving.carried();
    });
    Met::of_all(contacts.share, met)
}

/// Resolves the contacts of one particle; none where it met nothing. `holds` says whether two colliders may hold it.
#[inline]
fn of_one<R: Real>(
    contacts: Contacts<'_>,
    user: u32,
    inv_m: R,
    mut moved: Moved<'_, R>,
    near: &mut [Near],
    (holds, giving): (bool, &mut Giving<'_>),
) -> Option<Met> {
    let is_free = inv_m > R::zero();
    let reach = if is_free { reach(contacts, &moved, near) } else { Reach::Untold };
    let held = if holds && is_free { moved.encounter(contacts, near).held() } else { None };
    if reach == Reach::Far && held.is_none() {
        return None;
    }
    let mut met = Met::default();
    if reach == Reach::Touched || held.is_some() {
        let answer = moved.answer(contacts, near, held, giving);
        met.touched = 1;
        met.inside = u64::from(answer.was_inside);
        met.pinched = u64::from(answer.is_pinched);
        met.first_pinched = answer.is_pinched.then_some(user);
        met.swing = answer.swing / inv_m.to_f64();
    }
    met.first_passed = passed(contacts, near, user, [moved.from[0].vector(), moved.x.vector()]);
    met.passed = u64::from(met.first_passed.is_some());
    (met != Met::default()).then_some(met)
}

/// How near a particle is to colliders at the end of a step.
#[derive(Clone, Copy, PartialEq)]
enum Reach {
    Touched,
    /// Neither it nor a surface went as far as they are apart.
    Far,
    Untold,
}

/// Whether a particle touches a collider.
#[inline]
fn reach<R: Real>(contacts: Contacts<'_>, moved: &Moved<'_, R>, near: &mut [Near]) -> Reach {
    let ends = [moved.from[0], &*moved.x].map(|x| array3(&x.vector()));
    let mut is_far = true;
    let mut near = near.iter_mut();
    for collider in contacts.colliders {
        let known = mesh(collider).and_then(|mesh| Some((mesh, near.next()?)));
        let way = length(collider.way_of(ends, contacts.sub_step));
        let (distance, is_met) = match known {
            Some((mesh, near)) => reach_of_mesh::<R>(contacts, (collider, mesh), (ends, way), near),
            None => (collider.distance(ends[1], contacts.sub_step.end).0, false),
        };
        if is_met || distance < collider.margin {
            return Reach::Touched;
        }
        // What is not a number is not far.
        is_far &= distance >= way;
    }
    if is_far { Reach::Far } else { Reach::Untold }
}

/// The distance (m) of a particle from a mesh at the end of a step, or one that it certainly has and that is all there is to
/// know; and whether its way, of which the mesh sees ends and length (m), led through the mesh. Looks around where not enough is known.
fn reach_of_mesh<R: Real>(
    contacts: Contacts<'_>,
    (collider, mesh): (&Collider, &MeshSolid),
    (ends, way): ([[f64; 3]; 2], f64),
    near: &mut Near,
) -> (f64, bool) {
    let place = collider.place(ends[1], contacts.sub_step.end);
    let needed = way.max(collider.margin);
    let least = near.at_least(place);
    if least >= needed {
        return (least, false);
    }
    let (distance, _) = mesh.by_near(place, near).unwrap_or_else(|| {
        let (looked, nearest) = mesh.look(place, LOOK * needed);
        *near = looked;
        nearest
    });
    let rounding = 4.0 * R::ROUNDING * vec3::<f64>(ends[1]).amax();
    let is_met = distance < way && has_passed(collider.into(), contacts.sub_step, ends, rounding);
    (distance, is_met)
}

impl<R: Real> Moved<'_, R> {
    /// The particle in the sub-step as its method has it.
    fn encounter<'b>(&self, contacts: Contacts<'b>, near: &'b [Near]) -> Encounter<'b> {
        let wide = |vector: &Padded<R>| vector.vector().map(R::to_f64);
        let x = [wide(self.from[0]), wide(self.x)];
        let v = [wide(self.from[1]), wide(self.v)];
        let rounding = 4.0 * R::ROUNDING * x[0].amax().max(x[1].amax());
        let Contacts { colliders, sub_step, .. } = contacts;
        Encounter { colliders, near, x, v, sub_step, rounding }
    }

    /// Takes over what contact makes of the step: what two colliders that hold the particle make of it, if there are such, of
    /// which each gives half.
    fn answer(
        &mut self,
        contacts: Contacts<'_>,
        near: &[Near],
        held: Option<(Answer, [Facing<'_>; 2])>,
        giving: &mut Giving<'_>,
    ) -> Answer {
        let encounter = self.encounter(contacts, near);
        let Encounter { x, v, sub_step, .. } = encounter;
        let answer = match held {
            Some((answer, fingers)) => {
                let half = (answer.v - v[1]) * 0.5;
                for finger in &fingers {
                    let moving = finger.velocity_at(array3(&answer.x), sub_step.end);
                    giving.touched(finger, &half, (&answer.x, moving));
                }
                answer
            }
            None => encounter.answer(giving),
        };

        let narrow = |vector: Vec3<f64>| Padded::new(&vector.map(R::of));
        (*self.x, *self.v) = (narrow(answer.x), narrow(answer.v));
        if let Some([past_x, past_v]) = &mut self.past {
            let (way, change) = (x[1] - x[0], answer.v - v[1]);
            **past_x = narrow(answer.x - way - change * sub_step.dt);
            **past_v = narrow(past_v.vector().map(R::to_f64) + change);
        }
        answer
    }
}

/// The first collider that a particle went through or into on its way, which has a start and an end.
fn passed<R: Real>(
    contacts: Contacts<'_>,
    near: &[Near],
    particle: u32,
    way: [Vec3<R>; 2],
) -> Option<Passed> {
    let Contacts { colliders, sub_step, .. } = contacts;
    let way = way.map(|point| array3(&point));
    let rounding = 4.0 * R::ROUNDING * vec3::<f64>(way[1]).amax();
    let first = facing(colliders, near).position(|collider| has_passed(collider, sub_step, way, rounding))?;
    Some(Passed { particle, collider: first as u32 })
}
