//! Planes that a particle touches at once, where the faces of a crease meet: the least change that suits all of them.
//!
//! Reads unit normals, and how far a vector must go along each; writes the shortest such vector. It is a sum of the normals
//! with shares of 0 or more (Karush, Kuhn and Tucker): of the at most seven sets of planes that may have a share, tried
//! in a fixed order, one has it.

use crate::math::Vec3;

/// Cosine of the angle between normals, 10 degrees, within which two planes count as one.
const SAME: f64 = 0.984_807_753_012_208;
/// The most planes that hold a particle.
const MOST: usize = 3;
/// Sets of planes, each with one bit per plane: fewer planes first.
const SETS: [usize; 7] = [0b001, 0b010, 0b100, 0b011, 0b101, 0b110, 0b111];
/// Share of the largest bound by which rounding may miss one.
const ROUNDING: f64 = 1e-12;
/// Square of the volume that unit normals span below which they leave no direction of their own.
const FLAT: f64 = 1e-6;

/// Planes with different normals.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Planes {
    normals: [Vec3<f64>; MOST],
    /// How far (m) along each normal a particle must go from where the step led.
    pub(crate) bounds: [f64; MOST],
    count: usize,
}

/// The shortest vector that goes along each of the normals as far as it must, and the planes that made it so long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Least {
    pub(crate) way: Vec3<f64>,
    set: usize,
}

impl Planes {
    /// Takes in that a particle must go by `depth` (m) along a normal from where `shift` (m) brings it. A plane that looks the
    /// way of one before it moves that one on. False where there are three others already.
    pub(crate) fn add(&mut self, normal: Vec3<f64>, depth: f64, shift: &Vec3<f64>) -> bool {
        let known = (0..self.count).find(|k| self.normals[*k].dot(&normal) > SAME);
        if let Some(k) = known {
            self.bounds[k] = self.normals[k].dot(shift) + depth / self.normals[k].dot(&normal);
            return true;
        }
        if self.count == MOST {
            return false;
        }
        self.normals[self.count] = normal;
        self.bounds[self.count] = normal.dot(shift) + depth;
        self.count += 1;
        true
    }

    /// How fast (m/s) a velocity approaches each plane.
    pub(crate) fn approach(&self, v: &Vec3<f64>) -> [f64; MOST] {
        [0, 1, 2].map(|k| if k < self.count { -self.normals[k].dot(v) } else { 0.0 })
    }

    /// The shortest vector that goes along each normal as far as these bounds say; none where no vector does.
    pub(crate) fn least(&self, bounds: [f64; MOST]) -> Option<Least> {
        let bounds = &bounds[..self.count];
        let most = bounds.iter().fold(0.0, |most: f64, bound| most.max(bound.abs()));
        let suits = |way: &Vec3<f64>| {
            let all = self.normals.iter().zip(bounds);
            all.into_iter().all(|(normal, bound)| normal.dot(way) >= bound - ROUNDING * most)
        };
        let none = Least { way: Vec3::zeros(), set: 0 };
        if bounds.iter().all(|bound| *bound <= 0.0) {
            return Some(none);
        }
        SETS.into_iter().filter(|set| set >> self.count == 0).find_map(|set| {
            let way = self.of_set(set, bounds)?;
            suits(&way).then_some(Least { way, set })
        })
    }

    /// The vector that the planes of a set make together; none where one of them would have to pull, or they leave no way.
    fn of_set(&self, set: usize, bounds: &[f64]) -> Option<Vec3<f64>> {
        let mut members = (0..self.count).filter(|k| set >> k & 1 == 1);
        let mut next = || members.next().map(|k| (self.normals[k], bounds[k]));
        let (n, b) = next()?;
        let Some((m, c)) = next() else { return (b > 0.0).then_some(n * b) };
        if let Some((l, d)) = next() {
            let across = [m.cross(&l), l.cross(&n), n.cross(&m)];
            let volume = n.dot(&across[0]);
            let way = (across[0] * b + across[1] * c + across[2] * d) / volume;
            let pushes = across.iter().all(|across| across.dot(&way) / volume >= 0.0);
            return (volume * volume > FLAT && pushes).then_some(way);
        }
        let cosine = n.dot(&m);
        let square = 1.0 - cosine * cosine;
        let [push, other] = [(b - cosine * c) / square, (c - cosine * b) / square];
        (square > FLAT && push >= 0.0 && other >= 0.0).then(|| n * push + m * other)
    }

    /// What of a vector lies along all planes that made a shortest one.
    pub(crate) fn along(&self, of: &Least, v: &Vec3<f64>) -> Vec3<f64> {
        let mut members = (0..self.count).filter(|k| of.set >> k & 1 == 1).map(|k| self.normals[k]);
        match [members.next(), members.next(), members.next()] {
            [None, ..] => *v,
            [Some(n), None, _] => v - n * v.dot(&n),
            [Some(n), Some(m), None] => {
                let line = n.cross(&m).normalize();
                line * v.dot(&line)
            }
            [Some(_), Some(_), Some(_)] => Vec3::zeros(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers from -1 to 1.
    fn numbers(mut random: u64) -> impl FnMut() -> f64 {
        move || {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            (random >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    fn planes(normals: &[Vec3<f64>]) -> Planes {
        let mut planes = Planes::default();
        for normal in normals {
            planes.add(*normal, 0.0, &Vec3::zeros());
        }
        planes
    }

    #[test]
    fn no_shorter_vector_suits_all_planes() {
        let mut number = numbers(5);
        let mut vector = || Vec3::new(number(), number(), number());
        let (mut moved, mut held) = (0, 0);
        for case in 0..20_000 {
            let normals: Vec<_> = (0..=case % 3).map(|_| vector().normalize()).collect();
            let planes = planes(&normals);
            let bounds = array(vector());
            let Some(Least { way, set }) = planes.least(bounds) else { continue };
            let suits = |way: &Vec3<f64>, spare: f64| {
                let all = planes.normals[..planes.count].iter().zip(bounds);
                all.into_iter().all(|(n, bound)| n.dot(way) >= bound - spare)
            };
            assert!(suits(&way, 1e-11), "case {case}: {way} does not suit");
            moved += usize::from(set != 0);
            held += usize::from(set.count_ones() > 1);
            for _ in 0..20 {
                // Around the one that was found, by steps of every size.
                let other = way + vector() * 10.0_f64.powi(case % 5 - 4);
                assert!(
                    !suits(&other, 0.0) || other.norm() >= way.norm() - 1e-12,
                    "case {case}: {other} is shorter than {way}"
                );
            }
        }
        assert!(moved > 10_000 && held > 2_000, "{moved} moved, {held} by several");
    }

    fn array(v: Vec3<f64>) -> [f64; MOST] {
        v.into()
    }

    #[test]
    fn walls_that_face_each_other_leave_no_way() {
        let x = Vec3::x();
        let planes = planes(&[x, -x]);
        assert_eq!(planes.least([0.1, 0.1, 0.0]), None);
        assert_eq!(planes.least([0.1, -0.2, 0.0]).map(|least| least.way), Some(x * 0.1));
    }

    #[test]
    fn planes_that_look_one_way_are_one_and_three_are_the_most() {
        let mut planes = Planes::default();
        let tilted = Vec3::new(0.05, 1.0, 0.0).normalize();
        assert!(
            planes.add(Vec3::y(), 0.2, &Vec3::zeros()) && planes.add(tilted, 0.1, &Vec3::new(0.0, 0.2, 0.0))
        );
        assert_eq!(planes.count, 1);
        // What was cleared stays so, and the other is cleared too.
        let way = planes.least(planes.bounds).expect("there is a way").way;
        assert!(way.y > 0.3 && (way - Vec3::new(0.0, 0.2, 0.0)).dot(&tilted) > 0.1 - 1e-12, "{way}");
        assert!(planes.add(Vec3::x(), 0.1, &way) && planes.add(Vec3::z(), 0.1, &way));
        assert!(!planes.add(-Vec3::x(), 0.1, &way), "a fourth one");
    }

    #[test]
    fn what_lies_along_planes_approaches_none_of_them() {
        let mut number = numbers(9);
        let mut vector = || Vec3::new(number(), number(), number());
        for case in 0..3_000 {
            let normals: Vec<_> = (0..=case % 3).map(|_| vector().normalize()).collect();
            let planes = planes(&normals);
            let v = vector();
            let Some(least) = planes.least(planes.approach(&v)) else { continue };
            let left = v + least.way;
            let along = planes.along(&least, &left);
            // What is left after the push lies along the planes that push.
            assert!((along - left).norm() < 1e-9, "case {case}: {left} is left, {along} along");
        }
    }
}
