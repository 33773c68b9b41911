//! Particles of elastic objects that are held to a collider which stands: each goes with its own deformation about a place on the
//! surface, x = a + F_E (X - a), and keeps the velocity that the grid gives it.
//!
//! The grid holds what is at a sticky collider by its nodes alone. A body that only touches the surface has nothing behind it, and
//! leaves it row by row (docs/laws/snow.md); one that is held so stretches there as if it went on.

use super::{
    particles::Lanes,
    setup::{SnowError, SnowSetup},
};
use crate::{
    collide::{Collider, Contact},
    math::{Columns, LANES, Pack, Real, array::minus},
};

/// Cells from the surface within which particles are held.
const REACH: f64 = 0.5;

/// A particle that is held.
#[derive(Clone, Copy, Debug)]
struct Held<R> {
    /// The place on the surface (m).
    anchor: [R; 3],
    /// From there to the particle at rest (m).
    offset: [R; 3],
}

/// All particles that are held.
#[derive(Clone, Debug, Default)]
pub(crate) struct Attached<R> {
    /// By the numbers of particles: 0, or the place among those that are held, and one more. Empty where none is.
    of: Vec<u32>,
    held: Vec<Held<R>>,
    /// Names of objects, each with that of the collider.
    names: Vec<[String; 2]>,
}

impl<R: Real> Attached<R> {
    /// Those of a setup, among colliders.
    ///
    /// # Errors
    /// When there is no such collider, it moves or does not stick, or no particle of an object is near it.
    pub(super) fn of(setup: &SnowSetup, colliders: &[Collider]) -> Result<Self, SnowError> {
        let (mut attached, mut first) = (Self::default(), 0);
        let count: usize = setup.objects.iter().map(|object| object.x.len()).sum();
        for object in &setup.objects {
            if let Some(name) = &object.attach {
                let refused = |message: String| SnowError::Object { object: object.name.clone(), message };
                let found = colliders.iter().find(|collider| collider.name == *name);
                let collider = found.ok_or_else(|| {
                    refused(format!("it is attached to '{name}', and no collider has that name"))
                })?;
                check(collider).map_err(refused)?;
                attached.of.resize(count, 0);
                let before = attached.held.len();
                for (own, x) in object.x.iter().enumerate() {
                    attached.add(first + own, *x, collider, REACH * setup.settings.cell);
                }
                if attached.held.len() == before {
                    return Err(refused(format!(
                        "it is attached to '{name}', and none of its particles is within half a cell of that"
                    )));
                }
                attached.names.push([object.name.clone(), name.clone()]);
            }
            first += object.x.len();
        }
        Ok(attached)
    }

    /// Holds a particle at a place (m) if that is within reach (m) of the surface.
    fn add(&mut self, id: usize, x: [f64; 3], collider: &Collider, reach: f64) {
        let (distance, normal) = collider.distance(x, 0.0);
        if distance.abs() <= reach {
            let anchor = [0, 1, 2].map(|c| x[c] - distance * normal[c]);
            let offset = minus(x, anchor).map(R::of);
            self.held.push(Held { anchor: anchor.map(R::of), offset });
            self.of[id] = self.held.len() as u32;
        }
    }

    /// Whether no particle is held.
    pub(crate) fn is_empty(&self) -> bool {
        self.held.is_empty()
    }

    /// Names of objects, each with that of the collider that it is held to.
    pub(crate) fn names(&self) -> &[[String; 2]] {
        &self.names
    }

    /// The positions (m) of particles, by their numbers, that have F_E by columns and went to `x`.
    #[inline(always)]
    pub(crate) fn hold<P: Pack<Number = R>>(&self, ids: &[u32], f: &Columns<P>, x: [P; 3]) -> [P; 3] {
        let mut places = [[R::zero(); LANES]; 3];
        let mut columns = [[[R::zero(); LANES]; 3]; 3];
        for row in 0..3 {
            places[row] = x[row].store();
            for column in 0..3 {
                columns[column][row] = f[column][row].store();
            }
        }
        self.put(ids, &columns, &mut places);
        [P::load(&places[0]), P::load(&places[1]), P::load(&places[2])]
    }

    fn put(&self, ids: &[u32], f: &[[Lanes<R>; 3]; 3], places: &mut [Lanes<R>; 3]) {
        for (lane, id) in ids.iter().enumerate() {
            let Some(at) = self.of[*id as usize].checked_sub(1) else { continue };
            let Held { anchor, offset } = self.held[at as usize];
            for (row, places) in places.iter_mut().enumerate() {
                let along = |column: usize| f[column][row][lane] * offset[column];
                places[lane] = anchor[row] + (along(0) + along(1) + along(2));
            }
        }
    }
}

/// Refuses a collider that does not hold what is attached to it.
fn check(collider: &Collider) -> Result<(), String> {
    let name = &collider.name;
    if collider.contact != Contact::Sticky {
        return Err(format!(
            "it is attached to '{name}', to which snow does not stick: contact = \"sticky\" is needed"
        ));
    }
    if collider.way.is_some() || collider.velocity != [0.0; 3] {
        return Err(format!("it is attached to '{name}', which moves: a collider that stands is needed"));
    }
    Ok(())
}
