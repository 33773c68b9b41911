//! The momentum of what no pin holds, set to what acts on it: a solve that ends at a tolerance, at a cap or in binary32 leaves a little of
//! it over, and a free body would drift by that. No spring feels what all of a part does, so that one division is exact.

use super::{update::Step, vectors::Vectors};
use crate::{
    cloth::{
        evaluate::{Common, Led, Shift, sums},
        layout::Model,
        state::State,
    },
    math::{LANES, Padded, Real, Vec3},
    parallel::{per_row_mut, per_sixteen_mut},
};

/// Roundings of velocities that an iterate is not moved by.
const ROUNDINGS: f64 = 4.0;

impl<R: Real> Step<'_, R> {
    /// Of a change of velocity that was solved for from the state: sets the momentum that it leads to, and tells the judge of the step
    /// what parts do as a whole.
    pub(super) fn balance_change(&mut self) {
        let dv = std::mem::take(&mut self.next.dv);
        let lacks = self.look_at_parts(Led::ByChange { from: &self.state.v, dv: &dv });
        self.next.dv = dv;
        if lacks {
            self.shift_change();
        }
    }

    /// The same of one from the iterate in `next`.
    pub(super) fn balance_change_of_iterate(&mut self) {
        let State { dv, v, .. } = &mut *self.next;
        let (dv, v) = (std::mem::take(dv), std::mem::take(v));
        let lacks = self.look_at_parts(Led::ByChange { from: &v, dv: &dv });
        (self.next.dv, self.next.v) = (dv, v);
        if lacks {
            self.shift_change();
        }
    }

    fn shift_change(&mut self) {
        let (model, Vectors { shifts, lacking, .. }) = (self.model, &mut *self.vectors);
        self.solver.cg.lower(lacking.iter().map(|shift| shift.descent).sum());
        shifts.clear();
        shifts.extend(lacking.iter().map(|shift| shift.by.map(R::of)));
        model.share.own().each(per_sixteen_mut(&mut self.next.dv), |block, dv| {
            for (row, shift) in rows_that_move(model, shifts, block) {
                let (group, lane) = ((row - block * model.block_size) / LANES, row % LANES);
                let moved = dv[group].get(lane) + shift;
                dv[group].set(lane, moved);
            }
        });
    }

    /// The same of the iterate in `next`, where more is lacking than rounding; returns by how much its gravitational energy rises (J), where
    /// anything moved.
    pub(super) fn balance_iterate(&mut self) -> Option<f64> {
        let u = std::mem::take(&mut self.next.v);
        let lacks = self.look_at_parts(Led::To(&u));
        self.next.v = u;
        let (model, Vectors { shifts, lacking, .. }) = (self.model, &mut *self.vectors);
        let speed = (2.0 * self.evaluated.evaluation.total.kinetic_energy / model.free_mass).sqrt();
        let least = ROUNDINGS * R::ROUNDING * speed;
        if !lacks || lacking.iter().all(|shift| shift.by.amax() <= least) {
            return None;
        }

        let numbers = &self.evaluated.numbers;
        let (h, gravity) = (numbers.scheme.h, numbers.gravity.map(R::to_f64));
        let parts = model.parts.all().iter().zip(&*lacking);
        let lift: f64 = parts.map(|(part, shift)| -part.mass * gravity.dot(&shift.by) * h).sum();
        shifts.clear();
        shifts.extend(lacking.iter().map(|shift| shift.by.map(R::of)));
        let h = R::of(h);
        let iterate = [per_row_mut(&mut self.next.x), per_row_mut(&mut self.next.v)];
        model.share.own().each(iterate, |block, [x, v]| {
            for (row, shift) in rows_that_move(model, shifts, block) {
                let row = row - block * model.block_size;
                v[row] = Padded::new(&(v[row].vector() + shift));
                x[row] = Padded::new(&(x[row].vector() + shift * h));
            }
        });
        Some(lift)
    }

    /// Takes over what parts do as a whole once each has the momentum that it should have; says whether any lacks some.
    fn look_at_parts(&mut self, led: Led<'_, R>) -> bool {
        let (model, numbers, lacking) = (self.model, &self.evaluated.numbers, &mut self.vectors.lacking);
        let (common, of_parts) = (&mut *self.common, &mut *self.of_parts);
        common.clear();
        lacking.clear();
        if !Common::is_any(model, self.state) {
            return false;
        }
        sums(model, numbers, self.state, led, of_parts);
        let pins = Common::pins(model, &of_parts.sums);
        if model.thick_surface().is_some() {
            // Parts that push each other have their momentum together.
            self.contact.feel(model, |row| led.of(row), numbers.sub_step.dt);
            let groups = &mut self.contact.groups;
            of_parts.join(groups.of_part(), groups.all.len());
            groups.see_from(pins, |group| of_parts.of_groups[group].of_pins());
            for (group, (part, sums)) in groups.all.iter().zip(&mut of_parts.of_groups).enumerate() {
                let pushed = groups.pushed(group);
                let shift = pushed.and_then(|pushed| sums.lacking_beside(part, numbers, pushed));
                let shift = shift.unwrap_or(Shift::NONE);
                *sums = sums.shifted(part, numbers, shift.by);
                common.momenta.push(shift.by);
                self.solver.cg.lower(shift.descent);
            }
            let shift_of = |group: &u32| Shift { by: common.momenta[*group as usize], descent: 0.0 };
            lacking.extend(groups.of_part().iter().map(shift_of));
            common.set_implicit(
                numbers,
                (&groups.all, &of_parts.of_groups),
                groups.frames.iter().copied(),
                pins,
            );
            return lacking.iter().any(|shift| shift.by != Vec3::zeros());
        }
        for (part, sums) in model.parts.all().iter().zip(&mut of_parts.sums) {
            let shift = sums.lacking(part, numbers).unwrap_or(Shift::NONE);
            *sums = sums.shifted(part, numbers, shift.by);
            lacking.push(shift);
        }
        let parts = model.parts.all();
        common.set_implicit(numbers, (parts, &of_parts.sums), parts.iter().map(|_| pins), pins);
        lacking.iter().any(|shift| shift.by != Vec3::zeros())
    }
}

/// Free rows of a block that are shifted, with the shift of their part.
fn rows_that_move<R: Real>(
    model: &Model<R>,
    shifts: &[Vec3<R>],
    block: usize,
) -> impl Iterator<Item = (usize, Vec3<R>)> {
    let first = block * model.block_size;
    let rows = first..model.count.min(first + model.block_size);
    let of_row = |row: usize| (row, shifts[model.parts.of_row(row)]);
    let moves =
        move |(row, shift): &(usize, Vec3<R>)| model.inv_m[*row] > R::zero() && *shift != Vec3::zeros();
    rows.map(of_row).filter(moves)
}
