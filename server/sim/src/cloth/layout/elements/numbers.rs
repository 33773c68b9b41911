//! What a block of elements is evaluated with, and what comes of it beside its rows.

use crate::math::Padded;

/// What the stiffness and the damping of a list of elements multiply in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ElementNumbers<R> {
    /// Of W in the energy: k.
    pub(crate) energy: f64,
    /// Of dW/dx in the row: explicit k, implicit h k.
    pub(crate) gradient: R,
    /// Of H v in the row: explicit nu, of an iterate h nu.
    pub(crate) velocity: R,
    /// Of H in the matrix, and of H v in the row of a step from the state: h nu + h² k.
    pub(crate) matrix: R,
    /// The share of the stiffness in that, which loads have a part in: h k / (nu + h k); 0 of an explicit step.
    pub(crate) elastic: R,
    /// Of an explicit step, which all stiffness bounds, or that of loads alone: of the one k, of the other 0.
    pub(crate) bounded: [R; 2],
    /// Whether the directions in which it damps change with the state.
    pub(crate) is_turning: bool,
}

/// Energy (J) of the elements of a block, what they say beside it, and the greatest length over that at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ElementFigures {
    pub(crate) energy: f64,
    /// h F.v (J) of a step from the state; of an iterate the potential of damping (J), h nu v.H v / 2.
    pub(crate) power: f64,
    /// 0 under laws that do not resist stretching.
    pub(crate) stretch: f64,
}

impl ElementFigures {
    /// Of two lists together.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            energy: self.energy + other.energy,
            power: self.power + other.power,
            stretch: self.stretch.max(other.stretch),
        }
    }
}

/// A block: its number, how many rows it has, the group that is asked for if not all are, and what its elements read.
#[derive(Clone, Copy)]
pub(crate) struct BlockOfRows<'a, R> {
    pub(crate) block: usize,
    pub(crate) rows: usize,
    pub(crate) group: Option<usize>,
    pub(crate) fields: [&'a [Padded<R>]; 2],
}
