//! Contact of cloth: friction, restitution, and particles put back on the surface. A particle that would end
//! inside a collider loses its approach speed, is slowed by Coulomb friction, and is put on the surface.
//!
//! Reads and writes positions (m) and velocities (m/s) at the end of a step; colliders are met in
//! their order. The impulse of the normal bounds that of friction: `|dv_t| <= mu |dv_n|`.

use rayon::prelude::*;

use super::Collider;
use crate::{
    math::{Padded, Real, Vec3, array3, vec3},
    parallel::Share,
};

/// Where, when and for how long particles may have met colliders: the end of a step.
#[derive(Clone, Copy)]
pub(crate) struct Contacts<'a> {
    pub(crate) colliders: &'a [Collider],
    /// Time (s) at the end of the step.
    pub(crate) time: f64,
    /// Length (s) of the step.
    pub(crate) dt: f64,
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Met {
    /// Particles that touched one.
    pub(crate) touched: u64,
    /// Those of them that were inside one at the start of the step already.
    pub(crate) inside: u64,
    /// Particles that were in front of one at the start of the step, and are behind it or within it at its end.
    pub(crate) passed: u64,
    /// The first of these in the user's numbering.
    pub(crate) first_passed: Option<Passed>,
}

impl Met {
    /// What two disjoint sets of particles met.
    fn and(self, other: Self) -> Self {
        let first = self.first_passed.into_iter().chain(other.first_passed).min();
        Self {
            touched: self.touched + other.touched,
            inside: self.inside + other.inside,
            passed: self.passed + other.passed,
            first_passed: first,
        }
    }

    /// What all ranks met.
    fn of_all(self, share: &Share) -> Self {
        let Passed { particle, collider } =
            self.first_passed.unwrap_or(Passed { particle: u32::MAX, collider: u32::MAX });
        let told = [self.touched, self.inside, self.passed].map(|count| count as f64);
        let [touched, inside, passed] = told;
        let mut all = Self::default();
        let told = [touched, inside, passed, particle.into(), collider.into()];
        share.tell(told, |[touched, inside, passed, particle, collider]| {
            let first = Passed { particle: particle as u32, collider: collider as u32 };
            let first_passed = (passed > 0.0).then_some(first);
            let [touched, inside, passed] = [touched, inside, passed].map(|count| count as u64);
            all = all.and(Self { touched, inside, passed, first_passed });
        });
        all
    }

    /// What one particle met.
    fn of(near: Near, was_inside: impl FnOnce() -> bool, first_passed: Option<Passed>) -> Self {
        Self {
            touched: u64::from(near == Near::Touched),
            inside: u64::from(near == Near::Touched && was_inside()),
            passed: u64::from(first_passed.is_some()),
            first_passed,
        }
    }
}

/// What contact changes of a particle.
struct Moved<'a, R: Real> {
    x: &'a mut Padded<R>,
    v: &'a mut Padded<R>,
    /// Position and velocity at the start of the step, of steps that go on from it.
    past: Option<[&'a mut Padded<R>; 2]>,
}

/// Resolves the contacts of all free particles (`inv_m` > 0), which were at `from` before the step; tells how many there
/// were, and how many particles, pins too, went through a collider. Of steps that go on from the past, that of what was
/// touched takes over the change: it is then that of a particle which moved so before.
#[allow(clippy::disallowed_methods, reason = "whole numbers add to the same in any order")]
pub(crate) fn resolve<R: Real>(
    contacts: Contacts<'_>,
    inv_m: &[R],
    from: &[Padded<R>],
    [x, v]: [&mut [Padded<R>]; 2],
    past: Option<[&mut [Padded<R>]; 2]>,
) -> Met {
    if contacts.colliders.is_empty() {
        return Met::default();
    }

    let (size, own) = (contacts.share.block_size(), contacts.share.own());
    let user = own.rows(contacts.user);
    let constants =
        (user.par_chunks(size), own.rows(inv_m).par_chunks(size), own.rows(from).par_chunks(size));
    let [past_x, past_v] = past.unwrap_or_default().map(|field| own.rows_mut(field).par_chunks_mut(size));
    let pasts = past_x.zip(past_v).map(Some);
    let pasts = pasts.chain(rayon::iter::repeat_n((), user.len().div_ceil(size)).map(|()| None));
    let [x, v] = [x, v].map(|field| own.rows_mut(field).par_chunks_mut(size));
    let met = (constants, (x, v), pasts)
        .into_par_iter()
        .map(|((user, inv_m, from), (x, v), mut past)| {
            let particles = user.iter().zip(inv_m).zip(from).zip(x.iter_mut().zip(v)).enumerate();
            let met = particles.map(|(row, (((user, inv_m), from), (x, v)))| {
                let past = past.as_mut().map(|(x, v)| [&mut x[row], &mut v[row]]);
                let is_free = *inv_m > R::zero();
                let near = if is_free { meet(contacts, Moved { x, v, past }) } else { Near::Untold };
                let way = [from.vector(), x.vector()];
                Met::of(near, || was_inside(contacts, way), passed(contacts, *user, near, way))
            });
            met.fold(Met::default(), Met::and)
        })
        .reduce(Met::default, Met::and);
    met.of_all(contacts.share)
}

/// How near a particle is to colliders at the end of a step.
#[derive(Clone, Copy, PartialEq)]
enum Near {
    Touched,
    /// No surface is nearer than this (m).
    Free(f64),
    Untold,
}

/// Resolves the contacts of one particle.
fn meet<R: Real>(contacts: Contacts<'_>, moved: Moved<'_, R>) -> Near {
    let (mut x, mut v) = (moved.x.vector(), moved.v.vector());
    let (mut touched, mut pushed, mut change) = (false, Vec3::zeros(), Vec3::zeros());
    let mut nearest = f64::INFINITY;
    for collider in contacts.colliders {
        let (distance, normal) = collider.distance(array3(&x), contacts.time);
        if distance >= collider.margin {
            nearest = nearest.min(distance);
            continue;
        }

        touched = true;

        let by = velocity_change(collider, &v.map(R::to_f64), &vec3(normal));

        // The step moved the particle with the velocity that it no longer has.
        let mut position = x.map(R::to_f64) + by * contacts.dt;
        let (distance, normal) = collider.distance(array3(&position), contacts.time);
        if distance < collider.margin {
            let push = vec3::<f64>(normal) * (collider.margin - distance);
            position += push;
            pushed += push;
        }

        x = position.map(R::of);
        v = (v.map(R::to_f64) + by).map(R::of);
        change += by;
    }

    if touched {
        (*moved.x, *moved.v) = (Padded::new(&x), Padded::new(&v));
        if let Some([x, v]) = moved.past {
            let add = |to: &mut Padded<R>, by: Vec3<f64>| {
                *to = Padded::new(&(to.vector().map(R::to_f64) + by).map(R::of));
            };
            add(x, pushed);
            add(v, change);
        }
    }
    if touched { Near::Touched } else { Near::Free(nearest) }
}

/// Steps of a search along the way of a particle, at most.
const SEARCH_STEPS: u32 = 64;
/// Distance from a surface at which a way has come to it, or within it at which it has gone in, over the length of the way.
const REACHED: f64 = 1e-3;

/// The first collider that a particle went through or into on its way, which has a start and an end.
fn passed<R: Real>(contacts: Contacts<'_>, particle: u32, near: Near, way: [Vec3<R>; 2]) -> Option<Passed> {
    let rounding = 4.0 * R::ROUNDING * way[1].map(R::to_f64).amax();
    let way = way.map(|point| point.map(R::to_f64));
    let (length, dt) = ((way[1] - way[0]).norm(), contacts.dt);
    let is_passed = |collider: &Collider| {
        // No surface is nearer: neither comes to the other.
        let is_far =
            matches!(near, Near::Free(d) if d >= length + vec3::<f64>(collider.velocity).norm() * dt);
        !is_far && has_passed(collider, contacts, way, rounding)
    };
    let first = contacts.colliders.iter().position(is_passed)?;
    Some(Passed { particle, collider: first as u32 })
}

/// Whether a particle that touches a collider was inside one at the start of its way already.
fn was_inside<R: Real>(contacts: Contacts<'_>, way: [Vec3<R>; 2]) -> bool {
    let [start, end] = way.map(|point| point.map(R::to_f64));
    let spare = REACHED * (end - start).norm() + 4.0 * R::ROUNDING * start.amax();
    let start = array3(&start);
    let distance = |collider: &Collider| collider.distance(start, contacts.time - contacts.dt).0;
    contacts.colliders.iter().any(|collider| distance(collider) < collider.margin - spare)
}

/// Whether a particle went through a collider from `start` to `end`. At the start it was outside; at the end it is
/// within, or it came to the surface on its way and the nearest of it looked the other way at the start than at the end.
/// `rounding` (m) is that of positions.
fn has_passed(
    collider: &Collider,
    contacts: Contacts<'_>,
    [start, end]: [Vec3<f64>; 2],
    rounding: f64,
) -> bool {
    // As the collider sees it, which stands where it is at the end.
    let way = end - start - vec3::<f64>(collider.velocity) * contacts.dt;
    let length = way.norm();
    let at = |share: f64| collider.distance(array3(&(end - way * share)), contacts.time);
    let (distance, normal) = at(0.0);
    // No point of the surface is nearer than `distance`.
    if distance >= length || !length.is_finite() {
        return false;
    }

    let within = -REACHED * length - rounding;
    let (start, came_from) = at(1.0);
    if start < within {
        return false;
    }
    if distance < within {
        return true;
    }
    if vec3::<f64>(came_from).dot(&vec3(normal)) >= 0.0 {
        return false;
    }

    // Back from the end, by as much as is free of the surface in every direction.
    let mut gone = distance.max(0.0) / length;
    for _ in 0..SEARCH_STEPS {
        if gone >= 1.0 {
            return false;
        }
        let distance = at(gone).0;
        if distance <= REACHED * length {
            return true;
        }
        gone += distance / length;
    }
    false
}

/// What a collider adds to the velocity of a particle that touches it.
fn velocity_change(collider: &Collider, v: &Vec3<f64>, normal: &Vec3<f64>) -> Vec3<f64> {
    let relative = v - vec3::<f64>(collider.velocity);
    let approach = relative.dot(normal);
    if approach >= 0.0 {
        return Vec3::zeros();
    }

    let push = -(1.0 + collider.restitution) * approach;
    let sliding = relative - normal * approach;
    let speed = sliding.norm();
    let slowed = if speed > 0.0 { (collider.friction * push / speed).min(1.0) } else { 0.0 };
    normal * push - sliding * slowed
}
