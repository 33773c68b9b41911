//! The matrix of a step in parts: masses, springs and elements, one by one.
//!
//! Springs are handed over with the absolute value of what they have across, so that what is made of them is positive
//! semi-definite whatever the matrix makes of compressed ones.

use super::step_matrix::StepMatrix;
use crate::{
    linalg::{MatrixParts, Symmetric3, TakeParts},
    math::{Mat3, Pack, Real, Vec3, WithSimd, dispatch},
};

impl<R: Real> MatrixParts for StepMatrix<'_, R> {
    fn visit(&self, block: usize, take: &mut dyn TakeParts) {
        let first = block * self.model.block_size;
        for row in first..(first + self.model.block_size).min(self.model.count) {
            if self.model.inv_m[row] > R::zero() {
                take.alone(row, &self.alone(row));
                self.hand_over_springs(row, take);
            }
        }
        if !self.model.elements.is_empty() {
            dispatch::<R, _>(HandOver { matrix: *self, block, take });
        }
    }

    fn is_given_up(&self) -> bool {
        self.interrupt.is_requested()
    }
}

impl<R: Real> StepMatrix<'_, R> {
    /// Mass, drag and air of a row.
    fn alone(&self, row: usize) -> Symmetric3 {
        let h = R::of(self.numbers.scheme.h);
        let mass = self.numbers.external.mass(self.model.m[row], h).to_f64();
        let own = Symmetric3 { xx: mass, yy: mass, zz: mass, ..Symmetric3::default() };
        let Some(air) = self.numbers.external.air_of(row) else { return own };
        let air: Mat3<f64> = air.map(|entry| (entry * h).to_f64());
        Symmetric3 {
            xx: mass + air[(0, 0)],
            yy: mass + air[(1, 1)],
            zz: mass + air[(2, 2)],
            xy: air[(0, 1)],
            xz: air[(0, 2)],
            yz: air[(1, 2)],
        }
    }

    /// Hands over the springs of a row.
    fn hand_over_springs(&self, row: usize, take: &mut dyn TakeParts) {
        let springs = &self.model.springs;
        for end in springs.row(row) {
            let other = end.other as usize;
            let d: Vec3<f64> = (self.x[row].vector() - self.x[other].vector()).map(R::to_f64);
            let (slot, lane) = end.place;
            let along = self.numbers.along[springs.pattern_of[slot] as usize][lane].to_f64();
            let square = d.norm_squared();
            let frozen = self.tangent[slot][lane].to_f64();
            let across = along - frozen * square;
            let (a, b) = if across < 0.0 { (-across, (along + across) / square) } else { (across, frozen) };
            let block = Symmetric3 {
                xx: a + b * d.x * d.x,
                yy: a + b * d.y * d.y,
                zz: a + b * d.z * d.z,
                xy: b * d.x * d.y,
                xz: b * d.x * d.z,
                yz: b * d.y * d.z,
            };
            take.spring(row, other, &block);
        }
    }
}

/// The elements of a block.
struct HandOver<'a, R: Real> {
    matrix: StepMatrix<'a, R>,
    block: usize,
    take: &'a mut dyn TakeParts,
}

impl<R: Real> WithSimd<R> for HandOver<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let Self { matrix, block, take } = self;
        let mut first = 0;
        for (elements, numbers) in matrix.model.elements.iter().zip(&matrix.numbers.elements) {
            let range = elements.frozen(block);
            let frozen = &matrix.frozen[first + range.start..first + range.end];
            elements.hand_over::<P>(block, numbers.matrix.to_f64(), frozen, &mut *take);
            first += elements.frozen_count();
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        cloth::{
            ClothSettings, ElementKind, ElementList, Model, Network, SpringLaw, SpringRules,
            evaluate::{Evaluated, step_matrix::StepMatrix},
            settings::Purpose,
        },
        interrupt::Interrupt,
        linalg::{LinearOperator, MatrixParts, Symmetric3, TakeParts},
        math::{LANES, Mat3, Padded, Sixteen, Vec3},
        mesh::TriangleMesh,
        surroundings::Surroundings,
    };

    const BLOCK_SIZE: usize = 32;

    /// Adds up products with a vector.
    struct Products<'a> {
        p: &'a [Vec3<f64>],
        sums: Vec<Vec3<f64>>,
    }

    fn square(block: &Symmetric3) -> Mat3<f64> {
        let Symmetric3 { xx, yy, zz, xy, xz, yz } = *block;
        Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }

    impl TakeParts for Products<'_> {
        fn alone(&mut self, row: usize, block: &Symmetric3) {
            self.sums[row] += square(block) * self.p[row];
        }
        fn spring(&mut self, row: usize, other: usize, block: &Symmetric3) {
            self.sums[row] += square(block) * (self.p[row] - self.p[other]);
        }
        fn element(&mut self, corners: &[u32], own: usize, blocks: &[[[f64; 3]; 3]]) {
            for (corner, block) in corners.iter().zip(blocks) {
                let block = Mat3::from_fn(|r, c| block[r][c]);
                self.sums[corners[own] as usize] += block * self.p[*corner as usize];
            }
        }
    }

    #[test]
    fn the_parts_make_the_matrix() {
        let mesh = TriangleMesh::grid(13, 11, 0.1);
        let law = SpringLaw { stiffness: 300.0, damping: 0.2 };
        let rules = SpringRules { stretch: law, shear: Some(law), bend: Some(law) };
        let mut network = Network::from_mesh(&mesh, &rules, 0.01);
        let bending = SpringLaw { stiffness: 0.5, damping: 0.01 };
        network.elements = ElementKind::ALL.map(|kind| ElementList::new(kind, bending, &mesh)).to_vec();
        network.drag = 0.03;
        network.pins = (0..35).chain([77]).collect();

        let settings = ClothSettings { block_size: BLOCK_SIZE, ..ClothSettings::default() };
        let (model, parameters, _) = Model::<f64>::new(&network, &settings).expect("a good network");
        let crumpled = network
            .x
            .iter()
            .enumerate()
            .map(|(i, [x, y, z])| [x * 0.9, y + 0.01 * (i * i % 7) as f64, z + 0.005 * (i % 5) as f64]);
        let (x, v) = (model.arrange(&crumpled.collect::<Vec<_>>()), model.arrange(&network.v));
        let mut evaluated = Evaluated::<f64>::default();
        let purpose = Purpose::of(&settings);
        evaluated.size_for(&model, purpose);
        let interrupt = &Interrupt::default();
        let around = Surroundings {
            dt: 0.02,
            gravity: [0.0; 3],
            wind: [0.0; 3],
            colliders: &[],
            time: 0.0,
            steps: 1.0,
            interrupt,
        };
        evaluated.numbers.refresh(&model, &parameters, &settings, &around, (around.whole(), 0.0));
        evaluated.evaluation.look(&model, &evaluated.numbers, purpose, [&x, &v], &evaluated.scratches);
        let Evaluated { numbers, evaluation, scratches, .. } = &evaluated;
        let matrix = StepMatrix::new((&model, numbers), &x, evaluation, scratches, interrupt);

        let number = |i: usize| ((i * i * 37 + i) % 101) as f64 / 50.0 - 1.0;
        let is_free = |row: usize| row < model.count && model.inv_m[row] > 0.0;
        let vector = |row: usize| {
            let p = Vec3::new(number(row), number(row + 7), number(3 * row));
            if is_free(row) { p } else { Vec3::zeros() }
        };
        let p: Vec<Vec3<f64>> = (0..x.len()).map(vector).collect();
        let padded: Vec<Padded<f64>> = p.iter().map(Padded::new).collect();
        let mut products = Products { p: &p, sums: vec![Vec3::zeros(); p.len()] };
        let mut q = vec![Sixteen::default(); p.len() / LANES];
        for (block, q) in q.chunks_mut(BLOCK_SIZE / LANES).enumerate() {
            matrix.visit(block, &mut products);
            matrix.apply(block * BLOCK_SIZE, &padded, q);
        }
        for row in (0..model.count).filter(|row| is_free(*row)) {
            let (found, expected) = (products.sums[row], q[row / LANES].get(row % LANES));
            assert!((found - expected).norm() < 1e-13 * (1.0 + expected.norm()), "{row}: {found} {expected}");
        }
    }
}
