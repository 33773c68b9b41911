//! Boxes along the axes in binary32, rounded outwards: one, and four at once that another may meet.
//!
//! Boxes (m) enter in binary64. Lanes are compared by the sign of a difference, which compilers make vector instructions of.

/// Boxes of a node.
pub(super) const WIDTH: usize = 4;
/// By how much more than its own rounding a number is moved outwards, as a share of it, and what is added for the smallest.
const ROUNDING: f64 = f32::EPSILON as f64;
const LEAST: f64 = f32::MIN_POSITIVE as f64;

/// Lower and upper corner of a box (m), with a fourth axis on which all boxes meet.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub(super) struct Bounds {
    low: [f32; WIDTH],
    high: [f32; WIDTH],
}

impl Bounds {
    /// A box that meets none.
    pub(super) const NONE: Self = Self { low: [f32::INFINITY; WIDTH], high: [f32::NEG_INFINITY; WIDTH] };

    /// The box around one that is given (m), as a place (m) sees it: at least as large.
    #[inline]
    pub(super) fn around([low, high]: [[f64; 3]; 2], origin: [f64; 3]) -> Self {
        let mut bounds = Self { low: [-1.0; WIDTH], high: [1.0; WIDTH] };
        for c in 0..3 {
            let (from, to) = (low[c] - origin[c], high[c] - origin[c]);
            let (from, to) = (from - (ROUNDING * from.abs() + LEAST), to + (ROUNDING * to.abs() + LEAST));
            // What binary32 cannot hold is at its end, what is no number at both: differences of boxes are numbers.
            bounds.low[c] = least(greatest(from as f32, f32::MIN), f32::MAX);
            bounds.high[c] = greatest(least(to as f32, f32::MAX), f32::MIN);
        }
        bounds
    }

    /// The box around both.
    #[inline(always)]
    pub(super) fn and(self, other: Self) -> Self {
        let mut both = self;
        for c in 0..WIDTH {
            both.low[c] = least(self.low[c], other.low[c]);
            both.high[c] = greatest(self.high[c], other.high[c]);
        }
        both
    }

    /// Whether they have more than a border in common.
    #[inline(always)]
    pub(super) fn meets(&self, other: &Self) -> bool {
        let mut all = u32::MAX;
        for c in 0..WIDTH {
            all &= (self.low[c] - other.high[c]).to_bits() & (other.low[c] - self.high[c]).to_bits();
        }
        all >> 31 == 1
    }
}

/// Four boxes, number by number.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub(super) struct Four {
    low: [[f32; WIDTH]; 3],
    high: [[f32; WIDTH]; 3],
}

impl Four {
    /// Boxes that meet none.
    pub(super) const NONE: Self =
        Self { low: [[f32::INFINITY; WIDTH]; 3], high: [[f32::NEG_INFINITY; WIDTH]; 3] };

    /// Puts a box into a lane.
    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, bounds: &Bounds) {
        for c in 0..3 {
            self.low[c][lane] = bounds.low[c];
            self.high[c][lane] = bounds.high[c];
        }
    }

    /// The box in a lane.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> Bounds {
        let mut bounds = Bounds { low: [-1.0; WIDTH], high: [1.0; WIDTH] };
        for c in 0..3 {
            bounds.low[c] = self.low[c][lane];
            bounds.high[c] = self.high[c][lane];
        }
        bounds
    }

    /// The box around all of them.
    #[inline(always)]
    pub(super) fn all(&self) -> Bounds {
        (1..WIDTH).fold(self.get(0), |all, lane| all.and(self.get(lane)))
    }

    /// Which of them have more than a border in common with a box: a bit each.
    #[inline(always)]
    pub(super) fn met_by(&self, other: &Bounds) -> u32 {
        let mut gap = [-1.0_f32; WIDTH];
        for c in 0..3 {
            for lane in 0..WIDTH {
                let below = self.low[c][lane] - other.high[c];
                let above = other.low[c] - self.high[c][lane];
                gap[lane] = greatest(gap[lane], greatest(below, above));
            }
        }
        let mut bits = [1, 2, 4, 8];
        for lane in 0..WIDTH {
            bits[lane] &= (gap[lane].to_bits().cast_signed() >> 31).cast_unsigned();
        }
        (bits[0] | bits[2]) | (bits[1] | bits[3])
    }
}

#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greatest(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::{super::numbers::Numbers, *};

    fn boxes(count: usize) -> Vec<Bounds> {
        let mut numbers = Numbers(5);
        let of = |_| {
            let (at, size) = (numbers.place() * 3.0, numbers.place().abs());
            Bounds::around([(at - size).into(), (at + size).into()], [0.1, 0.2, 0.3])
        };
        (0..count).map(of).collect()
    }

    #[test]
    fn a_box_is_larger_than_what_it_is_around() {
        let mut numbers = Numbers(2);
        for (i, scale) in [1.0, 1e-3, 1e-30, 1e-40, 1e8, 1e30].into_iter().cycle().take(600).enumerate() {
            let place: [f64; 3] = (numbers.place() * scale).into();
            let origin: [f64; 3] = if i % 2 == 0 { [0.0; 3] } else { (numbers.place() * scale).into() };
            let bounds = Bounds::around([place, place], origin);
            for c in 0..3 {
                let (low, high) = (f64::from(bounds.low[c]), f64::from(bounds.high[c]));
                let seen = place[c] - origin[c];
                assert!(low < seen && seen < high, "{low} {seen} {high}");
                assert!(high - low <= 1e-6 * seen.abs() + 1e-37, "{low} {seen} {high}");
            }
        }
    }

    #[test]
    fn boxes_meet_where_they_overlap_on_every_axis() {
        let boxes = boxes(200);
        let mut count = 0;
        for a in &boxes {
            for four in boxes.chunks_exact(WIDTH) {
                let mut node = Four::NONE;
                for (lane, bounds) in four.iter().enumerate() {
                    node.set(lane, bounds);
                }
                let met = node.met_by(a);
                for (lane, b) in four.iter().enumerate() {
                    let overlap = (0..3).all(|c| a.low[c] < b.high[c] && b.low[c] < a.high[c]);
                    assert_eq!((a.meets(b), (met >> lane) & 1 == 1), (overlap, overlap), "{a:?} {b:?}");
                    assert_eq!(node.get(lane), *b);
                    count += usize::from(overlap);
                }
                let all = node.all();
                assert!(four.iter().all(|bounds| bounds.and(all) == all));
            }
        }
        assert!(count > 500 && count < 39_000, "{count}");
    }

    #[test]
    fn a_box_of_nothing_meets_none_and_what_is_not_finite_all() {
        let far = |x: f64| Bounds::around([[-x; 3], [x; 3]], [0.0; 3]);
        for bounds in [Bounds::NONE, far(1.0), far(1e300), far(f64::INFINITY), far(f64::NAN)] {
            assert!(!Bounds::NONE.meets(&bounds) && !bounds.meets(&Bounds::NONE));
            assert_eq!(Four::NONE.met_by(&bounds), 0);
            assert_eq!(bounds.and(Bounds::NONE), bounds);
        }
        for bounds in [far(1e300), far(f64::INFINITY), far(f64::NAN)] {
            assert!(boxes(20).iter().all(|other| other.meets(&bounds)));
        }
    }
}
