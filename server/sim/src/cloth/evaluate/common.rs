//! Common motion: what each part of a cloth does as a whole. It says nothing about how good a step is, so a step is judged by what is
//! left without it.
//!
//! A part that no pin holds moves as a whole under what acts on it from outside, whatever springs do: of an implicit step the velocity c at
//! which G is least among those that all of it shares follows from its momentum alone. What pins hold goes along with the mean
//! velocity of the pins. Seen from that velocity a step is the same whatever moves past.

use super::{external::symmetric, led::Led, numbers::StepNumbers};
use crate::{
    cloth::{
        layout::{Model, Part, Pushed},
        state::State,
    },
    math::{Mat3, Padded, Real, Vec3},
    parallel::between_mut,
};

/// Numbers of [`Sums`].
const PIECE: usize = 27;

/// Memory of sums over parts.
#[derive(Clone, Debug, Default)]
pub(crate) struct PartSums {
    pieces: Vec<[f64; PIECE]>,
    numbers: Vec<[f64; PIECE]>,
    /// Of each part.
    pub(crate) sums: Vec<Sums>,
    /// Of each group of parts, where they push each other.
    pub(crate) of_groups: Vec<Sums>,
}

impl PartSums {
    /// Adds up what the parts of each of so many groups have; `group_of` is that of each part.
    pub(crate) fn join(&mut self, group_of: &[u32], count: usize) {
        self.of_groups.clear();
        self.of_groups.resize(count, Sums::default());
        for (group, sums) in group_of.iter().zip(&self.sums) {
            self.of_groups[*group as usize].join(sums);
        }
    }
}

/// Sums over the rows of a part: three numbers of each vector, six of B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sums([f64; PIECE]);

impl Default for Sums {
    fn default() -> Self {
        Self([0.0; PIECE])
    }
}

/// The vectors among them.
#[derive(Clone, Copy)]
enum Vector {
    /// m v and m u (N s): velocities at the start, and those that an implicit step minimises over; of an explicit one those at its end.
    Before,
    After,
    /// m V (N s).
    Base,
    /// m (V - s) (N s), s the velocities at which X + h s is x_n.
    Still,
    /// What the medium and given forces push with (N) at s and at u.
    PushAtStill,
    Push,
    /// Velocities of pins (m/s).
    Pins,
}

impl Sums {
    fn add(&mut self, vector: Vector, of: Vec3<f64>) {
        let first = 3 * vector as usize;
        (0..3).for_each(|c| self.0[first + c] += of[c]);
    }

    /// Adds those of another part.
    fn join(&mut self, other: &Self) {
        self.0.iter_mut().zip(&other.0).for_each(|(sum, number)| *sum += number);
    }

    fn vector(&self, vector: Vector) -> Vec3<f64> {
        Vec3::from_column_slice(&self.0[3 * vector as usize..][..3])
    }

    fn air(&self) -> Mat3<f64> {
        symmetric([0, 1, 2, 3, 4, 5].map(|i| self.0[21 + i]))
    }

    /// Momentum (N s) at the start.
    pub(crate) fn before(&self) -> Vec3<f64> {
        self.vector(Vector::Before)
    }

    /// Velocities (m/s) of pins, in sum.
    pub(crate) fn of_pins(&self) -> Vec3<f64> {
        self.vector(Vector::Pins)
    }

    /// Momentum (N s) of the velocities that a step leads to.
    pub(crate) fn after(&self) -> Vec3<f64> {
        self.vector(Vector::After)
    }
}

/// Adds up the rows of each part, from a state to where a step leads; and the velocities of pins.
pub(crate) fn sums<R: Real>(
    model: &Model<R>,
    numbers: &StepNumbers<R>,
    state: &State<R>,
    led: Led<'_, R>,
    PartSums { pieces, numbers: totals, sums, .. }: &mut PartSums,
) {
    let (parts, share) = (&model.parts, &model.share);
    pieces.resize(parts.starts().last().map_or(0, |end| *end as usize), [0.0; PIECE]);
    share.own().each(between_mut(pieces, parts.starts()), |block, pieces| {
        pieces.fill([0.0; PIECE]);
        let first = block * model.block_size;
        for row in first..model.count.min(first + model.block_size) {
            let sums = &mut pieces[parts.piece_of(block, row)];
            add_row(model, numbers, state, led, row, sums);
        }
    });
    share.complete_numbers(pieces, |rank| parts.pieces_of(share, rank));
    parts.sum(pieces, totals);
    sums.clear();
    sums.extend(totals.iter().copied().map(Sums));
}

fn add_row<R: Real>(
    model: &Model<R>,
    numbers: &StepNumbers<R>,
    state: &State<R>,
    led: Led<'_, R>,
    row: usize,
    sums: &mut [f64; PIECE],
) {
    let wide = |field: &[Padded<R>]| field[row].vector().map(R::to_f64);
    let v = wide(&state.v);
    let mut all = Sums(*sums);
    if model.inv_m[row] == R::zero() {
        all.add(Vector::Pins, v);
        *sums = all.0;
        return;
    }
    let (m, u, past, share) = (model.m[row].to_f64(), led.of(row), &state.past, numbers.scheme.past);
    let (base, still) = if past.dt > 0.0 {
        let way = wide(&state.x) - wide(&past.x);
        (v + (v - wide(&past.v)) * share, way * (-share / numbers.scheme.h))
    } else {
        (v, Vec3::zeros())
    };
    all.add(Vector::Before, v * m);
    all.add(Vector::After, u * m);
    all.add(Vector::Base, base * m);
    all.add(Vector::Still, (base - still) * m);
    if !numbers.external.is_still() {
        all.add(Vector::PushAtStill, numbers.external.force_on(row, still));
        all.add(Vector::Push, numbers.external.force_on(row, u));
    }
    if let Some(air) = numbers.external.air_of(row).map(|air| air.map(R::to_f64)) {
        let entries = [air.m11, air.m22, air.m33, air.m12, air.m13, air.m23];
        entries.into_iter().enumerate().for_each(|(i, entry)| all.0[21 + i] += entry);
    }
    *sums = all.0;
}

/// A velocity that all of a part gets, and by how much that lowers what an implicit step minimises (J).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shift {
    pub(crate) by: Vec3<f64>,
    pub(crate) descent: f64,
}

impl Shift {
    pub(crate) const NONE: Self = Self { by: Vec3::new(0.0, 0.0, 0.0), descent: 0.0 };
}

impl Sums {
    /// M + h C (kg) of a part, C that of the medium: what its common motion has for a matrix.
    fn matrix<R: Real>(&self, part: &Part, numbers: &StepNumbers<R>) -> Mat3<f64> {
        let h = numbers.scheme.h;
        let own = part.mass + numbers.external.drag_of(f64::from(part.count), h);
        Mat3::from_diagonal_element(own) + self.air() * h
    }

    /// The weight of a part (N).
    fn weight<R: Real>(part: &Part, numbers: &StepNumbers<R>) -> Vec3<f64> {
        numbers.gravity.map(R::to_f64) * part.mass
    }

    /// What the momentum of a part lacks to balance what acts on it from outside, as a velocity of all of it; none of what pins
    /// hold.
    pub(crate) fn lacking<R: Real>(&self, part: &Part, numbers: &StepNumbers<R>) -> Option<Shift> {
        if part.is_held { None } else { self.lacking_beside(part, numbers, &Pushed::default()) }
    }

    /// The same of what colliders push beside what acts on it from outside.
    pub(crate) fn lacking_beside<R: Real>(
        &self,
        part: &Part,
        numbers: &StepNumbers<R>,
        pushed: &Pushed,
    ) -> Option<Shift> {
        let acting = Self::weight(part, numbers) + self.vector(Vector::Push);
        let lacks = self.vector(Vector::Base) - self.after() + acting * numbers.scheme.h + pushed.impulse;
        let by = (self.matrix(part, numbers) + pushed.matrix).cholesky()?.solve(&lacks);
        by.iter().all(|c| c.is_finite()).then(|| Shift { by, descent: 0.5 * by.dot(&lacks) })
    }

    /// The same once all of a part has another velocity by that much.
    pub(crate) fn shifted<R: Real>(&self, part: &Part, numbers: &StepNumbers<R>, by: Vec3<f64>) -> Self {
        let mut shifted = *self;
        shifted.add(Vector::After, by * part.mass);
        let slowing = by * numbers.external.drag_of(f64::from(part.count), 1.0) + self.air() * by;
        shifted.add(Vector::Push, -slowing);
        shifted
    }

    /// By how much what an implicit step minimises (J) is lower where all of a part has the velocity s + c than where it has s: c is the
    /// velocity at which it is least, of a part that is held that of its pins (m/s).
    fn descent<R: Real>(&self, part: &Part, numbers: &StepNumbers<R>, pins: Vec3<f64>) -> f64 {
        let acting = Self::weight(part, numbers) + self.vector(Vector::PushAtStill);
        let b = self.vector(Vector::Still) + acting * numbers.scheme.h;
        let matrix = self.matrix(part, numbers);
        if part.is_held {
            // As far as pins go on their way.
            let along = pins * (numbers.sub_step.dt / (numbers.scheme.beyond * numbers.scheme.h));
            return along.dot(&b) - 0.5 * along.dot(&(matrix * along));
        }
        matrix.cholesky().map_or(0.0, |matrix| 0.5 * b.dot(&matrix.solve(&b)))
    }

    /// What the common motion of a part gains in energy (J) in an implicit step, less what the medium gives it: of a part that is held what
    /// it gets as it is carried along with its pins (m/s), of another one what its method makes of a fall and of a past.
    fn carried<R: Real>(&self, part: &Part, numbers: &StepNumbers<R>, pins: Vec3<f64>) -> f64 {
        let (before, end, push) = (self.before(), self.end(numbers), self.vector(Vector::Push));
        if part.is_held {
            return pins.dot(&(end - before - (Self::weight(part, numbers) + push) * numbers.sub_step.dt));
        }
        let [middle, own] = [(before + end) * 0.5, self.after()].map(|momentum| momentum / part.mass);
        let still = self.vector(Vector::Base) - self.vector(Vector::Still);
        let way = (self.after() - still) * (numbers.scheme.h * numbers.scheme.beyond);
        let fallen = numbers.gravity.map(R::to_f64).dot(&way);
        middle.dot(&(end - before)) - own.dot(&push) * numbers.sub_step.dt - fallen
    }

    /// Momentum (N s) at the end of an implicit step.
    fn end<R: Real>(&self, numbers: &StepNumbers<R>) -> Vec3<f64> {
        let before = self.before();
        before + (self.after() - before) * numbers.scheme.beyond
    }
}

/// Kinetic energy (J) that a momentum (N s) of a part has for being seen from elsewhere than from a velocity (m/s).
pub(crate) fn kinetic_of(part: &Part, momentum: Vec3<f64>, from: Vec3<f64>) -> f64 {
    from.dot(&momentum) - 0.5 * part.mass * from.norm_squared()
}

/// What is known of the common motion of a cloth in a sub-step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Common {
    /// By how much what an implicit step minimises (J) is lower where each part goes on as a whole than where the step starts.
    pub(crate) descent: f64,
    /// Energy (J) that common motion gains beside what the medium gives it.
    pub(crate) carried: f64,
    /// What the medium and given forces give common motion (W).
    pub(crate) pushed: f64,
    /// The same of parts that no pin holds alone, and what pushes these (N).
    loose: (f64, Vec3<f64>),
    /// Kinetic energy (J) of what common motion changes by, of parts that no pin holds.
    pub(crate) fallen: f64,
    /// What a method loses of a fall (J): its positions feel another velocity than the mean.
    pub(crate) lost: f64,
    /// Kinetic energy (J) of common motion at the start and at the end, and at the velocities that an implicit step minimises over.
    pub(crate) kinetic: [f64; 2],
    pub(crate) at_solution: f64,
    /// Mean velocity (m/s) of the pins.
    pub(crate) pins: Vec3<f64>,
    /// Of each part: momentum (N s) at the end, and the velocity (m/s) from which it is seen where something holds it.
    pub(crate) momenta: Vec<Vec3<f64>>,
    pub(crate) frames: Vec<Vec3<f64>>,
}

impl Common {
    /// Whether anything of a cloth moves as a whole: what no pin holds, or what pins that move hold.
    pub(crate) fn is_any<R: Real>(model: &Model<R>, state: &State<R>) -> bool {
        model.parts.any_is_loose() || !state.motions.is_empty()
    }

    /// Mean velocity (m/s) of the pins, from the sums of all parts; corners of figures, which hold no cloth by springs, are none of them.
    pub(crate) fn pins<R: Real>(model: &Model<R>, sums: &[Sums]) -> Vec3<f64> {
        let count = model.parts.pins().len().max(1) as f64;
        let of_cloth = model.parts.all().iter().zip(sums).filter(|(part, _)| part.led == 0);
        of_cloth.map(|(_, sums)| sums.of_pins()).sum::<Vec3<f64>>() / count
    }

    /// The velocity from which a part is seen (m/s): that of what holds it, or its own.
    fn frame(part: &Part, momentum: Vec3<f64>, held: Vec3<f64>) -> Vec3<f64> {
        if part.is_held { held } else { momentum / part.mass }
    }

    fn kinetic(&self, parts: &[Part], momenta: impl Iterator<Item = Vec3<f64>>) -> f64 {
        let of = |((part, momentum), frame): ((&Part, _), &Vec3<f64>)| {
            kinetic_of(part, momentum, Self::frame(part, momentum, *frame))
        };
        parts.iter().zip(momenta).zip(&self.frames).map(of).sum()
    }

    /// Forgets what was known.
    pub(crate) fn clear(&mut self) {
        let (mut momenta, mut frames) = (std::mem::take(&mut self.momenta), std::mem::take(&mut self.frames));
        momenta.clear();
        frames.clear();
        *self = Self { momenta, frames, ..Self::default() };
    }

    /// Takes over an implicit step, from the sums of its parts, which are seen from velocities (m/s) where something holds them, the pins from
    /// their mean one.
    pub(crate) fn set_implicit<R: Real>(
        &mut self,
        numbers: &StepNumbers<R>,
        (parts, sums): (&[Part], &[Sums]),
        frames: impl Iterator<Item = Vec3<f64>>,
        pins: Vec3<f64>,
    ) {
        self.clear();
        self.frames.extend(frames);
        let held = || parts.iter().zip(sums).zip(&self.frames);
        self.descent = held().map(|((part, sums), frame)| sums.descent(part, numbers, *frame)).sum();
        self.carried = held().map(|((part, sums), frame)| sums.carried(part, numbers, *frame)).sum();
        let loose = parts.iter().zip(sums).filter(|(part, _)| !part.is_held);
        let fallen = |(part, sums): (&Part, &Sums)| {
            let (before, end) = (sums.before(), sums.end(numbers));
            let lost = (sums.after() - (before + end) * 0.5).dot(&(end - before)) / part.mass;
            [0.5 * (sums.after() - sums.vector(Vector::Base)).norm_squared() / part.mass, lost.max(0.0)]
        };
        [self.fallen, self.lost] =
            loose.map(fallen).fold([0.0; 2], |[a, b], [fallen, lost]| [a + fallen, b + lost]);
        let pushed = |((part, sums), frame): ((&Part, &Sums), &Vec3<f64>)| {
            Self::frame(part, sums.after(), *frame).dot(&sums.vector(Vector::Push))
        };
        self.pushed = held().map(pushed).sum();
        let loose = || held().filter(|((part, _), _)| !part.is_held);
        let push = loose().map(|((_, sums), _)| sums.vector(Vector::Push)).sum();
        self.loose = (loose().map(pushed).sum(), push);
        let before = self.kinetic(parts, sums.iter().map(Sums::before));
        self.momenta.extend(sums.iter().map(|sums| sums.end(numbers)));
        let after = self.kinetic(parts, self.momenta.iter().copied());
        self.at_solution = self.kinetic(parts, sums.iter().map(Sums::after));
        (self.kinetic, self.pins) = ([before, after], pins);
    }

    /// Takes over an explicit step, from the sums of its parts. What pins give is known by what they are pushed with.
    pub(crate) fn set_explicit<R: Real>(&mut self, model: &Model<R>, sums: &[Sums]) {
        self.clear();
        let (parts, pins) = (model.parts.all(), Self::pins(model, sums));
        self.frames.resize(parts.len(), pins);
        self.momenta.extend(sums.iter().map(Sums::after));
        let before = self.kinetic(parts, sums.iter().map(Sums::before));
        let after = self.kinetic(parts, self.momenta.iter().copied());
        (self.kinetic, self.pins) = ([before, after], pins);
    }

    /// Kinetic energy (J) of common motion before a sub-step and after it without contacts. Parts that contacts gave another momentum are
    /// seen from the surfaces that they touched, which move with a velocity (m/s); `sums` are those after contacts.
    pub(crate) fn kinetic_from(&self, parts: &[Part], sums: &[Sums], surfaces: Vec3<f64>) -> [f64; 2] {
        let mut kinetic = [0.0; 2];
        for (((part, sums), without), held) in parts.iter().zip(sums).zip(&self.momenta).zip(&self.frames) {
            let is_touched = sums.after() != *without;
            for (kinetic, momentum) in kinetic.iter_mut().zip([sums.before(), *without]) {
                let frame = if is_touched { surfaces } else { Self::frame(part, momentum, *held) };
                *kinetic += kinetic_of(part, momentum, frame);
            }
        }
        kinetic
    }

    /// What the medium takes (W) of the fall, in an implicit step, of parts that no pin holds, seen from surfaces of a velocity (m/s): not above 0.
    pub(crate) fn slowed(&self, surfaces: Vec3<f64>) -> f64 {
        let (power, push) = self.loose;
        (power - surfaces.dot(&push)).min(0.0)
    }

    /// Takes over that contacts gave parts another momentum, from the sums after them.
    pub(crate) fn touch(&mut self, parts: &[Part], sums: &[Sums], surfaces: Vec3<f64>) {
        self.kinetic = self.kinetic_from(parts, sums, surfaces);
        let of = |((part, sums), without): ((&Part, &Sums), &Vec3<f64>)| {
            let momentum = sums.after();
            let frame = if momentum == *without { Self::frame(part, momentum, self.pins) } else { surfaces };
            kinetic_of(part, momentum, frame)
        };
        self.kinetic[1] = parts.iter().zip(sums).zip(&self.momenta).map(of).sum();
    }
}
