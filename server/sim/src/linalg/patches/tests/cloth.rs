//! Small cloths without order: masses, springs and elements, part by part and as a dense matrix.

use nalgebra::DMatrix;

use crate::{
    linalg::{
        Symmetric3,
        patches::{MatrixParts, TakeParts, gather::square},
    },
    math::Vec3,
};

pub(super) const BLOCK_SIZE: usize = 32;

/// Numbers from 0 to 1 without an order.
pub(super) struct Numbers(pub(super) u64);

impl Numbers {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 31)
    }
}

/// The matrix of masses, springs and elements.
#[derive(Clone, Default)]
pub(super) struct Cloth {
    pub(super) x: Vec<[f64; 3]>,
    pub(super) is_free: Vec<bool>,
    pub(super) masses: Vec<f64>,
    /// The ends of each spring, its stiffness along and across.
    pub(super) springs: Vec<([u32; 2], [f64; 2])>,
    /// Four corners and the factor of each: s s^T in each axis.
    pub(super) elements: Vec<([u32; 4], [f64; 4])>,
}

impl Cloth {
    /// A rippled sheet of so many particles a side, with some springs and pins at random.
    pub(super) fn sheet(side: u32, seed: u64) -> Self {
        let mut numbers = Numbers(seed);
        let mut cloth = Self::default();
        for i in 0..side * side {
            let ripple = 0.25 * f64::from(i % 3) + 0.05 * numbers.next();
            cloth.x.push([f64::from(i % side), f64::from(i / side), ripple]);
            cloth.is_free.push(numbers.next() > 0.04);
            cloth.masses.push(0.01 + 0.1 * numbers.next());
        }
        for i in 0..side * side {
            let (x, y) = (i % side, i / side);
            for (x, y, bends) in
                [(x + 1, y, 1.0), (x, y + 1, 1.0), (x + 1, y + 1, 1.0), (x + 2, y, 0.02), (x, y + 2, 0.02)]
            {
                if x < side && y < side && numbers.next() > 0.05 {
                    let along = 1e4 * bends * (1.0 + numbers.next());
                    cloth.springs.push(([i, y * side + x], [along, 0.01 * along * numbers.next()]));
                }
            }
        }
        cloth
    }

    /// The same with elements between the corners of squares.
    pub(super) fn bending(side: u32, seed: u64) -> Self {
        let mut cloth = Self::sheet(side, seed);
        for i in 0..side * (side - 1) {
            if i % side + 1 < side {
                cloth.elements.push(([i, i + side + 1, i + 1, i + side], [30.0, 30.0, -35.0, -25.0]));
            }
        }
        cloth
    }

    /// Particles in a row, each joined to the next one.
    pub(super) fn chain(count: u32, stiffness: f64) -> Self {
        Self {
            x: (0..count).map(|i| [f64::from(i), 0.0, 0.1 * f64::from(i % 2)]).collect(),
            is_free: (0..count).map(|i| i > 0).collect(),
            masses: vec![0.01; count as usize],
            springs: (1..count).map(|i| ([i - 1, i], [stiffness, 0.0])).collect(),
            elements: Vec::new(),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.x.len()
    }

    /// The block of a spring.
    fn block(&self, spring: usize) -> Symmetric3 {
        let ([i, j], [along, across]) = self.springs[spring];
        let d: Vec3<f64> = Vec3::from(self.x[i as usize]) - Vec3::from(self.x[j as usize]);
        let length = d.norm();
        let u = if length > 0.0 { d / length } else { Vec3::zeros() };
        let (a, b) = if length > 0.0 { (across, along - across) } else { (along, 0.0) };
        Symmetric3 {
            xx: a + b * u.x * u.x,
            yy: a + b * u.y * u.y,
            zz: a + b * u.z * u.z,
            xy: b * u.x * u.y,
            xz: b * u.x * u.z,
            yz: b * u.y * u.z,
        }
    }

    /// The matrix, 0 in rows and columns of pins.
    pub(super) fn matrix(&self) -> DMatrix<f64> {
        struct Sum<'a>(&'a Cloth, DMatrix<f64>);
        impl Sum<'_> {
            fn add(&mut self, i: usize, j: usize, sign: f64, block: &[[f64; 3]; 3]) {
                if self.0.is_free[i] && self.0.is_free[j] {
                    for r in 0..3 {
                        for c in 0..3 {
                            self.1[(3 * i + r, 3 * j + c)] += sign * block[r][c];
                        }
                    }
                }
            }
        }
        impl TakeParts for Sum<'_> {
            fn alone(&mut self, row: usize, block: &Symmetric3) {
                self.add(row, row, 1.0, &square(block));
            }
            fn spring(&mut self, row: usize, other: usize, block: &Symmetric3) {
                self.add(row, row, 1.0, &square(block));
                self.add(row, other, -1.0, &square(block));
            }
            fn element(&mut self, corners: &[u32], own: usize, blocks: &[[[f64; 3]; 3]]) {
                for (corner, block) in corners.iter().zip(blocks) {
                    self.add(corners[own] as usize, *corner as usize, 1.0, block);
                }
            }
        }
        let mut sum = Sum(self, DMatrix::zeros(3 * self.len(), 3 * self.len()));
        for block in 0..self.len().div_ceil(BLOCK_SIZE) {
            self.visit(block, &mut sum);
        }
        sum.1
    }
}

impl MatrixParts for Cloth {
    fn visit(&self, block: usize, take: &mut dyn TakeParts) {
        for row in block * BLOCK_SIZE..((block + 1) * BLOCK_SIZE).min(self.len()) {
            let mass = self.masses[row];
            take.alone(row, &Symmetric3 { xx: mass, yy: mass, zz: mass, ..Symmetric3::default() });
            for (spring, ([i, j], _)) in self.springs.iter().enumerate() {
                let (i, j) = (*i as usize, *j as usize);
                if i == row || j == row {
                    take.spring(row, i + j - row, &self.block(spring));
                }
            }
            for (corners, factors) in &self.elements {
                if let Some(own) = corners.iter().position(|corner| *corner as usize == row) {
                    let blocks = factors.map(|factor| {
                        let entry = factor * factors[own];
                        [[entry, 0.0, 0.0], [0.0, entry, 0.0], [0.0, 0.0, entry]]
                    });
                    take.element(corners, own, &blocks);
                }
            }
        }
    }
}
