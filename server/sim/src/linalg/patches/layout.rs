//! What of patches follows from the body as it begins: which there are, which meet, their tree.

use std::ops::Range;

use super::{choose::choose, graph::Graph, plan::Plan, tree::divide};
use crate::{interrupt, linalg::precondition::Symmetric3};

/// The place of a row that nothing may change.
pub(super) const NONE: u32 = u32::MAX;

/// Functions of a patch over its numbers, as a rule: of a rippled sheet 0.44, of a wavy one 0.24.
const SOFT: f64 = 0.48;
/// What is kept per particle beside the factors (bytes): functions, what is beside the diagonal, what fronts pass on.
const BESIDE: f64 = 1_200.0;

/// Memory that the patches of so many particles take at most (bytes). What a sheet takes by the rule above grows with the depth of its
/// tree: 3 000 bytes per particle of 19 500, 3 860 of 160 000, 5 200 of 4 million. A quarter more is left for other meshes, and 32 768 bytes
/// for each of the first 256 particles, since small bodies may be entangled; bodies that would take more are refused.
pub fn patch_bytes(particles: u64) -> f64 {
    let doublings = libm::log2(particles.max(1000) as f64 / 19_500.0);
    particles as f64 * 1.25 * (2_980.0 + 290.0 * doublings) + particles.min(256) as f64 * 32_768.0
}

/// A matrix as the parts that it is the sum of, a block of rows at a time.
pub(crate) trait MatrixParts: Sync {
    /// Hands over all parts that have to do with rows of a block, in a fixed order: springs and elements at each of their
    /// ends in the block.
    fn visit(&self, block: usize, take: &mut dyn TakeParts);

    /// Whether nobody waits for it any more.
    fn is_given_up(&self) -> bool {
        false
    }
}

/// Who takes the parts of a matrix.
pub(crate) trait TakeParts {
    /// What acts on a row by itself: masses, drag.
    fn alone(&mut self, row: usize, block: &Symmetric3);
    /// What a spring adds to the diagonal block of a row, and takes from that beside it at another row.
    fn spring(&mut self, row: usize, other: usize, block: &Symmetric3);
    /// What an element adds to the row of one of its corners: a block, by rows, at each corner.
    fn element(&mut self, corners: &[u32], own: usize, blocks: &[[[f64; 3]; 3]]);
}

/// Patches and the tree in which they are eliminated.
#[derive(Clone, Debug)]
pub struct PatchLayout {
    pub(super) block_size: usize,
    /// First patch of each block, and one more.
    pub(super) block_starts: Vec<u32>,
    /// First row of each patch among `members`, and one more.
    pub(super) starts: Vec<u32>,
    pub(super) members: Vec<u32>,
    /// The patch of each row, or none, and which of its members it is.
    pub(super) patches: Vec<u32>,
    pub(super) numbers: Vec<u8>,
    /// First later patch of each, and one more; the patches that meet it and are eliminated after it, in that order.
    pub(super) later_starts: Vec<u32>,
    pub(super) later: Vec<u32>,
    pub(super) plan: Plan,
    /// What a smoothing step multiplies the inverse diagonal blocks by.
    pub(super) damping: f64,
}

impl PatchLayout {
    /// From the place (m) of each row as the body begins and whether it may change, in blocks of a size; pairs that make
    /// rings, all pairs of rows that the matrix joins, and the most rows that a part of the matrix joins: 2 of springs alone.
    ///
    /// # Errors
    /// When so many patches meet that the factors would be larger than what they are made for.
    pub(crate) fn new(
        rest: &[[f64; 3]],
        is_free: &[bool],
        block_size: usize,
        [rings, pairs]: [&[[u32; 2]]; 2],
        joined: usize,
    ) -> Result<Self, String> {
        let size = block_size as u32;
        let within = rings.iter().copied().filter(|[i, j]| i / size == j / size);
        let of_blocks = choose(&Graph::new(rest.len(), within), is_free, block_size);

        let (mut block_starts, mut starts, mut members) = (vec![0], vec![0], Vec::new());
        let (mut patches, mut numbers) = (vec![NONE; rest.len()], vec![0; rest.len()]);
        let mut centres = Vec::new();
        for of_block in &of_blocks {
            for patch in of_block {
                let mut centre = [0.0; 3];
                for (number, row) in (0..).zip(patch) {
                    (patches[*row as usize], numbers[*row as usize]) = (centres.len() as u32, number);
                    (0..3).for_each(|c| centre[c] += rest[*row as usize][c]);
                }
                members.extend(patch);
                starts.push(members.len() as u32);
                centres.push(centre.map(|sum| sum / patch.len() as f64));
            }
            block_starts.push(centres.len() as u32);
        }

        let of_patches = pairs.iter().map(|pair| pair.map(|row| patches[row as usize]));
        let meets = Graph::new(centres.len(), of_patches.filter(|[i, j]| *i != NONE && *j != NONE));
        let plan = Plan::new(&meets, &divide(&meets, &centres));
        let (mut later_starts, mut later) = (vec![0], Vec::new());
        for patch in 0..meets.len() as u32 {
            interrupt::point();
            let (first, place) = (later.len(), |other: &u32| plan.places[*other as usize]);
            later.extend(meets.of(patch).iter().copied().filter(|other| place(other) > place(&patch)));
            later[first..].sort_unstable_by_key(place);
            later_starts.push(later.len() as u32);
        }
        let damping = 1.4 / joined.max(2) as f64;
        let made = Self {
            block_size,
            block_starts,
            starts,
            members,
            patches,
            numbers,
            later_starts,
            later,
            plan,
            damping,
        };
        if made.expected_bytes() > patch_bytes(rest.len() as u64) {
            let message = "springs or elements join so many patches of its particles that the factors of their \
                           matrix would not be small: too entangled for the preconditioner patches";
            return Err(message.to_owned());
        }
        Ok(made)
    }

    /// Number of blocks.
    pub(super) fn blocks(&self) -> usize {
        self.block_starts.len() - 1
    }

    /// The patches of a block.
    pub(super) fn of_block(&self, block: usize) -> Range<usize> {
        self.block_starts[block] as usize..self.block_starts[block + 1] as usize
    }

    /// The rows of a patch.
    pub(super) fn rows(&self, patch: usize) -> &[u32] {
        &self.members[self.starts[patch] as usize..self.starts[patch + 1] as usize]
    }

    /// The patches that meet one and are eliminated after it.
    pub(super) fn later(&self, patch: usize) -> &[u32] {
        &self.later[self.later_starts[patch] as usize..self.later_starts[patch + 1] as usize]
    }

    /// Memory that solves will take (bytes), with as many functions as crumpled cloth has: of the body as it begins, nobody
    /// knows.
    fn expected_bytes(&self) -> f64 {
        let functions = |patch: u32| (SOFT * (3 * self.rows(patch as usize).len()) as f64).ceil() as usize;
        let [_, numbers] = self.plan.estimate(&functions);
        4.0 * numbers + BESIDE * self.members.len() as f64
    }
}
