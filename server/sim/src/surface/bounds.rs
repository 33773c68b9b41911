//! Boxes along the axes in binary32, rounded outwards: one, and four of which another one may meet some.
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
        let bit = |lane: usize| (gap[lane].to_bits() >> 31) << lane;
        bit(0) | bit(1) | bit(2) | bit(3)
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
