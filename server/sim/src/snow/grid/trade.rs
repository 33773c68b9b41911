//! Particles that go from rank to rank, before they are sorted.
//!
//! Reads where particles of a block went; writes who is gone, and who comes, by block and cell.

use super::{
    blocks::{CELLS, key_and_cell},
    migration::{FAR, GONE},
    sort::Sorter,
    sparse_grid::Grid,
};
use crate::math::Real;

impl Sorter {
    /// Lets those go to others whose new block is not own: hands over the place and the new key of each.
    pub(crate) fn let_go<R: Real>(
        &mut self,
        grid: &Grid<R>,
        periodic: [u32; 3],
        mut hand_over: impl FnMut(u32, u64),
    ) {
        let mut gone = std::mem::take(&mut self.gone);
        gone.clear();
        let leavers = self.leavers(&grid.blocks, periodic);
        gone.extend(leavers.filter(|(key, ..)| !grid.own_keys.contains(key)));
        for &(key, block, to) in &gone {
            let first = self.starts[block] as usize + self.settled[block][CELLS] as usize;
            for at in first..self.starts[block + 1] as usize {
                if usize::from(self.codes[at]) / CELLS == to && self.codes[at] != FAR {
                    hand_over(self.order[at], key);
                    self.codes[at] = GONE;
                }
            }
            self.leaving[block][to] = 0;
        }
        self.gone = gone;
    }

    /// The same after a step in which particles went too far to be followed: `key_of` tells where each is, if it is anywhere.
    pub(crate) fn let_far_go<R: Real>(
        &mut self,
        grid: &Grid<R>,
        key_of: impl Fn(u32) -> Option<u64>,
        mut hand_over: impl FnMut(u32, u64),
    ) {
        for (place, code) in self.order.iter().zip(&mut self.codes) {
            if let Some(key) = key_of(*place).filter(|key| !grid.own_keys.contains(key)) {
                hand_over(*place, key);
                *code = GONE;
            }
        }
    }

    /// Takes in a particle at a place, by its first node.
    pub(crate) fn take_in(&mut self, place: u32, node: [i32; 3], periodic: [u32; 3]) {
        let (key, cell) = key_and_cell(node, periodic);
        self.arrivals.push((key, cell as u16, place));
    }

    /// Places of all particles that are here, those taken in included and those let go not.
    pub(crate) fn places(&self) -> impl Iterator<Item = u32> {
        let own = self.order.iter().zip(&self.codes).filter(|(_, code)| **code != GONE);
        own.map(|(place, _)| *place).chain(self.arrivals.iter().map(|(.., place)| *place))
    }
}
