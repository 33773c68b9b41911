//! Whether surfaces with a thickness are apart after changes that put bodies somewhere.
//!
//! Reads changes that the rules accept, and the state before them; writes nothing. The rule is that of a setup, for the places as
//! they will be stored.

use super::changes::{Change, ChangeError};
use crate::{
    interrupt,
    math::{Padded, Real, Vec3, array3, vec3},
    surface::{Crossing, Crossings, touching},
    world::body::{
        cloth::Cloth,
        parts::Part,
        together::{crossing, touch},
    },
};

/// When surfaces that are refused with changes meet.
const AFTER: &str = "after the change";

/// What a change puts somewhere: a body, and the places (m) of its particles.
type Put<'a> = (&'a Part, &'a [[f64; 3]]);

impl<R: Real> Cloth<R> {
    /// Refuses changes after which a surface that they put somewhere crosses or touches one that has a thickness too, or itself.
    /// All of a list counts as one: bodies may go where others were. The looks at surfaces are points at which it can be left.
    ///
    /// # Errors
    /// The first pair of a part that was put and another one. Pairs of pins alone are left out, as in a step: a scene may have moved
    /// them through each other.
    pub(crate) fn check_apart(&self, changes: &[Change]) -> Result<(), ChangeError> {
        let Some(surface) = self.model.thick_surface() else { return Ok(()) };
        let ([start, _], _) = &*self.start;
        let (begin, changes) = match changes.iter().rposition(|change| matches!(change, Change::Reset)) {
            Some(reset) => (start, &changes[reset + 1..]),
            None => (&self.state.x, changes),
        };
        let put: Vec<Put<'_>> = changes.iter().filter_map(|change| self.put_by(change)).collect();
        if put.is_empty() {
            return Ok(());
        }

        let (x, is_put) = self.after(begin, &put);
        let place = |row: u32| x[row as usize];
        // Pins and corners of figures that give way are kept apart in a step.
        let movable = self.model.movable();
        let counts = |rows: &[u32]| {
            let is_there = |row: &u32| is_put[*row as usize];
            let may_move = |row: &u32| movable[*row as usize] != R::zero();
            rows.iter().any(is_there) && rows.iter().any(may_move)
        };
        let faces = &surface.faces;
        let mut crossings = Crossings::new(faces);
        let crossed = interrupt::shared(|interrupt| crossings.first_of(faces, &place, &counts, interrupt));
        if let Some(Crossing { edge, triangle }) = crossed {
            let first = Crossing { edge: self.numbers(edge), triangle: self.numbers(triangle) };
            let rows = [edge[0], triangle[0]];
            return Err(self.not_apart(rows, |bodies| crossing(bodies, &first, AFTER)));
        }
        match interrupt::shared(|interrupt| touching(faces, &place, &counts, interrupt)) {
            Some(rows) => Err(self.not_apart(rows, |bodies| touch(bodies, self.numbers(rows), AFTER))),
            None => Ok(()),
        }
    }

    /// What a change puts somewhere of this cloth.
    fn put_by<'a>(&'a self, change: &'a Change) -> Option<Put<'a>> {
        match change {
            Change::State { body, positions, .. } => Some((self.parts.named(body)?, &**positions)),
            _ => None,
        }
    }

    /// Where particles are (m) that were elsewhere before, and of which some are put, in the model's order; and which these are.
    fn after(&self, before: &[Padded<R>], put: &[Put<'_>]) -> (Vec<Vec3<f64>>, Vec<bool>) {
        let mut x: Vec<Vec3<f64>> = before.iter().map(|x| array3(&x.vector()).into()).collect();
        let mut is_put = vec![false; x.len()];
        for (part, places) in put {
            for (own, place) in part.own.clone().zip(*places) {
                let row = self.model.place[own as usize] as usize;
                x[row] = array3(&vec3::<R>(*place)).into();
                is_put[row] = true;
            }
        }
        (x, is_put)
    }

    /// The numbers of particles of the model in their bodies.
    fn numbers<const N: usize>(&self, rows: [u32; N]) -> [u32; N] {
        rows.map(|row| {
            let own = self.model.user[row as usize];
            own - self.parts.of(own).own.start
        })
    }

    /// That surfaces meet at a particle of each; `message` says how, from the names of their bodies.
    fn not_apart(&self, rows: [u32; 2], message: impl FnOnce([&str; 2]) -> String) -> ChangeError {
        let names = rows.map(|row| self.parts.of(self.model.user[row as usize]).name.as_str());
        let bodies = names.map(str::to_owned);
        ChangeError::NotApart { bodies, particles: self.numbers(rows), message: message(names) }
    }
}
