//! Motion that many particles share, in vertex block descent. A sweep moves each particle against its neighbours, which
//! hold it: an error that all share it removes at a rate of m / (h² K), next to nothing where the cloth is stiff. So the
//! first guess falls, components without pins are moved as a whole, and the momentum of others has to balance.

use super::update::Step;
use crate::{
    cloth::{
        evaluate::{Evaluated, StepNumbers},
        layout::Model,
        state::State,
    },
    linalg::{lanes_at, packs, store_padded},
    math::{LANES, Mat3, Pack, Padded, Real, Sixteen, Vec3, WithSimd, array3, dispatch, three},
    parallel::{join, per_row, per_row_mut, per_sixteen},
    report::{Stage, StepFailure},
};

/// Share of the impulse on a component that forces and inertia may leave over, added up over its particles.
const SHARE: f64 = 0.1;
/// What they may leave over in any case, as an acceleration of the whole (m/s²): what Newton's method may leave over at a
/// particle where nothing else is asked for.
const LEAST: f64 = 0.01;
/// Rows that a thread adds up at a time.
const ROWS: usize = 4096;

impl<R: Real> Step<'_, R> {
    /// Adds to the iterate in `next`, at which velocities do not change and which was evaluated, what gravity does to each
    /// particle there: the part of its acceleration that is along gravity, from nothing to free fall (Chen et al. 2024,
    /// section 3.7).
    pub(super) fn fall(&mut self) {
        let Evaluated { evaluation, numbers, .. } = &*self.evaluated;
        let (model, next) = (self.model, &mut *self.next);
        let gravity = array3(&numbers.gravity);
        let square: f64 = gravity.iter().map(|c| c * c).sum();
        if square == 0.0 {
            return;
        }
        let along = gravity.map(|c| R::of(c / square));
        let longest = R::of(numbers.sub_step.dt / numbers.scheme.beyond);
        let (gravity, h) = (gravity.map(R::of), R::of(numbers.scheme.h));
        let iterate = [per_row_mut(&mut next.x), per_row_mut(&mut next.v)];
        let fields = (per_row(&model.inv_m), per_sixteen(&evaluation.rows), iterate);
        model.share.own().each(fields, |_, (inv_m, rows, [x, v])| {
            dispatch(Fall { inv_m, rows, x, v, along, gravity, longest, h });
        });
    }
}

struct Fall<'a, R: Real> {
    inv_m: &'a [R],
    rows: &'a [Sixteen<R>],
    x: &'a mut [Padded<R>],
    v: &'a mut [Padded<R>],
    along: [R; 3],
    gravity: [R; 3],
    longest: R,
    h: R,
}

impl<R: Real> WithSimd<R> for Fall<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let Self { inv_m, rows, x, v, along, gravity, longest, h } = self;
        let (x, v) = (x.as_chunks_mut::<LANES>().0, v.as_chunks_mut::<LANES>().0);
        for (group, ((row, x), v)) in rows.iter().zip(x).zip(v).enumerate() {
            let inv_m = lanes_at::<P>(inv_m, group);
            let rest = row.load::<P>();
            let time = rest[0] * along[0] + rest[1] * along[1] + rest[2] * along[2];
            let time = (time * inv_m).max(P::zero()).min(P::splat(longest)).where_positive(inv_m);
            let (old_x, old_v) = (packs::<P>(x), packs::<P>(v));
            store_padded(three!(|c| old_v[c] + time * gravity[c]), v);
            store_padded(three!(|c| old_x[c] + time * gravity[c] * h), x);
        }
    }
}

/// Sums over the free rows of a component.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// What forces and inertia leave over (N s).
    rest: Vec3<f64>,
    /// m (u - V) (N s).
    change: Vec3<f64>,
    /// Mass (kg).
    mass: f64,
    /// B of the air (N s/m).
    air: Mat3<f64>,
}

impl Sums {
    fn and(self, other: Self) -> Self {
        let (rest, change) = (self.rest + other.rest, self.change + other.change);
        Self { rest, change, mass: self.mass + other.mass, air: self.air + other.air }
    }
}

/// The iterate in `next`, to be added up.
struct Momenta<'a, R: Real> {
    model: &'a Model<R>,
    state: &'a State<R>,
    /// Share of the change in the sub-step before that goes on.
    past: f64,
    numbers: &'a StepNumbers<R>,
    rest: &'a [Sixteen<R>],
    u: &'a [Padded<R>],
}

impl<R: Real> Momenta<'_, R> {
    /// Sums over rows, in pairs, whatever the number of threads.
    fn sums(&self, rows: &[u32]) -> Sums {
        if rows.len() > ROWS {
            let (left, right) = rows.split_at(rows.len().next_power_of_two() / 2);
            let (left, right) = join(|| self.sums(left), || self.sums(right));
            return left.and(right);
        }
        let past = &self.state.past;
        rows.iter().fold(Sums::default(), |sums, row| {
            let row = *row as usize;
            let of = |field: &[Padded<R>]| field[row].vector().map(R::to_f64);
            let (v, mass) = (of(&self.state.v), self.model.m[row].to_f64());
            let base = if past.dt > 0.0 { v + (v - of(&past.v)) * self.past } else { v };
            let rest = self.rest[row / LANES].get(row % LANES).map(R::to_f64);
            let air = self.numbers.external.air_of(row).map_or(Mat3::zeros(), |air| air.map(R::to_f64));
            sums.and(Sums { rest, change: (of(self.u) - base) * mass, mass, air })
        })
    }
}

impl<R: Real> Step<'_, R> {
    fn momenta(&self) -> Momenta<'_, R> {
        let Evaluated { evaluation, numbers, .. } = &*self.evaluated;
        let (model, state) = (self.model, self.state);
        let past = numbers.scheme.past;
        Momenta { model, state, past, numbers, rest: &evaluation.rows, u: &self.next.v }
    }

    /// Whether the momentum of a component with pins does not balance after so many sweeps: what is left over of it is more
    /// than a share of the impulse that gravity, the medium and pins give. One without pins is brought to balance.
    pub(super) fn unbalanced(&self, sweeps: u32) -> Option<StepFailure> {
        let model = self.model;
        let components = model.components.as_ref().expect("laid out for these settings");
        let numbers = &self.evaluated.numbers;
        let gravity = numbers.gravity.map(R::to_f64) * numbers.scheme.h;
        (0..components.count()).filter(|it| components.is_pinned(*it)).find_map(|it| {
            let rows = components.rows(it);
            let Sums { rest, change, mass, .. } = self.momenta().sums(rows);
            let weight = gravity * mass;
            let others = rest + change - weight;
            let limit = SHARE * (weight.norm() + others.norm()) + LEAST * numbers.scheme.h * mass;
            (rest.norm() > limit).then(|| {
                let particle = rows.iter().map(|row| model.user[*row as usize]).min().unwrap_or_default();
                StepFailure::Unbalanced { particle: particle.into(), value: rest.norm(), limit, sweeps }
            })
        })
    }

    /// Moves each component without pins as a whole to where its momentum balances: forces within it do not change by that.
    /// Says whether there is any.
    pub(super) fn take_common_motion(&mut self) -> bool {
        let model = self.model;
        let components = model.components.as_ref().expect("laid out for these settings");
        let mut shifts = std::mem::take(&mut self.vectors.shifts);
        shifts.clear();
        shifts.extend((0..components.count()).map(|it| {
            let rows = components.rows(it);
            if components.is_pinned(it) || rows.is_empty() {
                return Vec3::zeros();
            }
            let Sums { rest, mass, air, .. } = self.momenta().sums(rows);
            let StepNumbers { scheme, external, .. } = &self.evaluated.numbers;
            let mass = mass + external.drag_of(rows.len() as f64, scheme.h);
            if !external.has_air() {
                return (rest / mass).map(R::of);
            }
            let matrix = Mat3::from_diagonal_element(mass) + air * scheme.h;
            matrix.cholesky().map_or_else(Vec3::zeros, |matrix| matrix.solve(&rest).map(R::of))
        }));
        let moves = shifts.iter().any(|shift| *shift != Vec3::zeros());
        if moves {
            let h = R::of(self.evaluated.numbers.scheme.h);
            let iterate = [per_row_mut(&mut self.next.x), per_row_mut(&mut self.next.v)];
            model.share.own().each(iterate, |block, [x, v]| {
                for (row, (x, v)) in (block * model.block_size..model.count).zip(x.iter_mut().zip(v)) {
                    if model.inv_m[row] > R::zero() {
                        let shift = shifts[components.of_row(row)];
                        *v = Padded::new(&(v.vector() + shift));
                        *x = Padded::new(&(x.vector() + shift * h));
                    }
                }
            });
            self.watch.lap(Stage::Position);
        }
        self.vectors.shifts = shifts;
        moves
    }
}
