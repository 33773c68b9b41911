//! Sixteen particles at a time, a lane each.

use crate::math::{Columns, LANES};

/// A number of each particle of a group, in memory.
pub(crate) type Lanes<R> = [R; LANES];

/// Places of sixteen particles; past `count` the last is repeated.
#[derive(Clone, Copy)]
pub(crate) struct Group {
    pub(crate) at: [u32; LANES],
    pub(crate) count: usize,
}

impl Group {
    /// Places `start..` of a list, sixteen at most; where there are none, its last, and a count of 0.
    #[inline(always)]
    pub(crate) fn from(list: &[u32], start: usize) -> Self {
        if start < list.len() {
            Self::of(&list[start..])
        } else {
            Self { count: 0, ..Self::of(&list[list.len() - 1..]) }
        }
    }

    /// The first sixteen of a list that is not empty, or all of it.
    #[inline(always)]
    pub(crate) fn of(list: &[u32]) -> Self {
        let count = list.len().min(LANES);
        let mut at = [list[count - 1]; LANES];
        at[..count].copy_from_slice(&list[..count]);
        Self { at, count }
    }
}

/// What never changes of the particles of a group.
#[derive(Clone, Copy)]
pub(crate) struct Constants<R> {
    /// Volume at rest V0 (m³).
    pub(crate) volume: Lanes<R>,
    /// Factor on the stiffness.
    pub(crate) stiffness: Lanes<R>,
    /// Index of the object.
    pub(crate) object: [u16; LANES],
}

/// What a step gives to a group.
#[derive(Clone, Copy)]
pub(crate) struct NewLanes<P> {
    /// Position (m).
    pub(crate) x: [P; 3],
    /// Mass (kg), which stays.
    pub(crate) mass: P,
    /// Velocity (m/s).
    pub(crate) v: [P; 3],
    /// Plastic volume ratio J_P.
    pub(crate) plastic_ratio: P,
    /// F_E by columns.
    pub(crate) f_e: Columns<P>,
    /// C (1/s) by columns.
    pub(crate) c: Columns<P>,
    /// V0 tau (J): xx yy zz xy xz yz.
    pub(crate) v0_tau: [P; 6],
}
