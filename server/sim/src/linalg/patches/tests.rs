//! Patches on small cloths without order, against dense factorisations.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::{MatrixParts, PatchLayout, PatchMatrix, Patches, TakeParts};
use crate::{
    linalg::{
        BlockCsr, CgWorkspace, Inverse3, Outcome, PreconditionerKind, Room, SolveReport, SolverSettings, Stop,
        Symmetric3, WholePreconditioner, conjugate_gradient,
    },
    math::{Sixteen, Vec3},
    parallel::{Share, on_threads},
};

const BLOCK_SIZE: usize = 32;

/// Numbers from 0 to 1 without an order.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 31)
    }
}

/// The matrix of masses, springs and elements.
#[derive(Clone, Default)]
struct Cloth {
    x: Vec<[f64; 3]>,
    is_free: Vec<bool>,
    masses: Vec<f64>,
    /// The ends of each spring, its stiffness along and across.
    springs: Vec<([u32; 2], [f64; 2])>,
    /// Four corners and the factor of each: s s^T in each axis.
    elements: Vec<([u32; 4], [f64; 4])>,
}

impl Cloth {
    /// A rippled sheet of so many particles a side, with some springs and pins at random.
    fn sheet(side: u32, seed: u64) -> Self {
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
    fn bending(side: u32, seed: u64) -> Self {
        let mut cloth = Self::sheet(side, seed);
        for i in 0..side * (side - 1) {
            if i % side + 1 < side {
                cloth.elements.push(([i, i + side + 1, i + 1, i + side], [30.0, 30.0, -35.0, -25.0]));
            }
        }
        cloth
    }

    /// Particles in a row, each joined to the next one.
    fn chain(count: u32, stiffness: f64) -> Self {
        Self {
            x: (0..count).map(|i| [f64::from(i), 0.0, 0.1 * f64::from(i % 2)]).collect(),
            is_free: (0..count).map(|i| i > 0).collect(),
            masses: vec![0.01; count as usize],
            springs: (1..count).map(|i| ([i - 1, i], [stiffness, 0.0])).collect(),
            elements: Vec::new(),
        }
    }

    fn len(&self) -> usize {
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
    fn matrix(&self) -> DMatrix<f64> {
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
                self.add(row, row, 1.0, &super::gather::square(block));
            }
            fn spring(&mut self, row: usize, other: usize, block: &Symmetric3) {
                self.add(row, row, 1.0, &super::gather::square(block));
                self.add(row, other, -1.0, &super::gather::square(block));
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

/// All that a solve needs.
struct Ready {
    cloth: Cloth,
    matrix: DMatrix<f64>,
    operator: BlockCsr<f64>,
    inverse: Vec<Inverse3>,
    layout: PatchLayout,
    patches: PatchMatrix,
}

impl Ready {
    fn new(cloth: Cloth) -> Self {
        let matrix = cloth.matrix();
        let entry = |i: usize, r: usize, c: usize| matrix[(3 * i + r, 3 * i + c)];
        let diagonal = |i: usize| Symmetric3 {
            xx: entry(i, 0, 0),
            yy: entry(i, 1, 1),
            zz: entry(i, 2, 2),
            xy: entry(i, 0, 1),
            xz: entry(i, 0, 2),
            yz: entry(i, 1, 2),
        };
        let diagonals: Vec<_> = (0..cloth.len()).map(diagonal).collect();
        let inverse = Inverse3::of(&diagonals, PreconditionerKind::BlockJacobi, 0.0);
        let rows: Vec<Vec<f64>> = matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
        let operator = BlockCsr::from_dense(&rows);

        let rings: Vec<_> =
            cloth.springs.iter().filter(|(_, [along, _])| *along > 1e3).map(|(ends, _)| *ends).collect();
        let of_elements = cloth.elements.iter().flat_map(|(corners, _)| {
            (0..16).map(|k| [corners[k / 4], corners[k % 4]])
        });
        let pairs: Vec<_> = cloth.springs.iter().map(|(ends, _)| *ends).chain(of_elements).collect();
        let joined = if cloth.elements.is_empty() { 2 } else { 4 };
        let layout = PatchLayout::new(&cloth.x, &cloth.is_free, BLOCK_SIZE, [&rings, &pairs], joined);
        let layout = layout.expect("few patches meet");
        let mut patches = PatchMatrix::default();
        patches.set_up(&layout, &cloth, &inverse);
        Self { cloth, matrix, operator, inverse, layout, patches }
    }

    fn preconditioner(&self) -> Patches<'_> {
        Patches::new(&self.inverse, &self.layout, &self.patches)
    }

    /// M⁻¹ r, and r.z.
    fn apply(&self, r: &DVector<f64>) -> (DVector<f64>, f64) {
        let count = self.cloth.len();
        let r = sixteens(r);
        let mut z = vec![Sixteen::default(); r.len()];
        let share = Share::whole(count, BLOCK_SIZE);
        let mut partials = vec![[0.0; 2]; count.div_ceil(BLOCK_SIZE)];
        let (patches, mut room) = (self.preconditioner(), Room::default());
        WholePreconditioner::<f64>::apply(
            &patches,
            &self.operator,
            &share,
            &r,
            &mut z,
            &mut partials,
            &mut room,
        );
        (vector(&z, count), partials.iter().map(|[square, _]| square).sum())
    }

    /// Solves to a tolerance.
    fn solve(&self, b: &DVector<f64>, tolerance: f64) -> (DVector<f64>, SolveReport) {
        let count = self.cloth.len();
        let b = sixteens(b);
        let mut x = vec![Sixteen::default(); b.len()];
        let stop = Stop::Residual { tolerance, max_iterations: 400 };
        let settings = SolverSettings { stop, ..SolverSettings::default() };
        let share = Share::whole(count, BLOCK_SIZE);
        let mut work = CgWorkspace::new(count, BLOCK_SIZE);
        let m = self.preconditioner();
        let report = conjugate_gradient(&self.operator, &m, &b, &mut x, &settings, &share, &mut work);
        (vector(&x, count), report)
    }

    /// A right-hand side without order, 0 at pins.
    fn right_hand_side(&self, seed: u64) -> DVector<f64> {
        let mut numbers = Numbers(seed);
        let is_free = &self.cloth.is_free;
        DVector::from_fn(3 * self.cloth.len(), |i, _| {
            let number = numbers.next() - 0.5;
            if is_free[i / 3] { number } else { 0.0 }
        })
    }

    /// Numbers of particles that may change.
    fn free(&self) -> Vec<usize> {
        (0..3 * self.cloth.len()).filter(|i| self.cloth.is_free[i / 3]).collect()
    }
}

fn sixteens(v: &DVector<f64>) -> Vec<Sixteen<f64>> {
    let vectors: Vec<_> = v.as_slice().chunks(3).map(Vec3::from_column_slice).collect();
    Sixteen::from_vectors(&vectors)
}

fn vector(sixteens: &[Sixteen<f64>], count: usize) -> DVector<f64> {
    let vectors = Sixteen::to_vectors(sixteens, count);
    DVector::from_iterator(3 * count, vectors.iter().flat_map(|v| [v.x, v.y, v.z]))
}

/// Cloths of all sorts; half of them have elements.
fn cloths() -> impl Iterator<Item = Cloth> {
    (0..20).map(|seed| {
        let side = 5 + seed as u32 % 5;
        if seed % 2 == 0 { Cloth::sheet(side, seed) } else { Cloth::bending(side, seed) }
    })
}

#[test]
fn solutions_are_those_of_a_dense_factorisation() {
    for (number, cloth) in cloths().enumerate() {
        let ready = Ready::new(cloth);
        let free = ready.free();
        let a = ready.matrix.select_rows(&free).select_columns(&free);
        let b = ready.right_hand_side(number as u64);
        let expected = a.clone().cholesky().expect("positive definite").solve(&b.select_rows(&free));
        let (x, report) = ready.solve(&b, 1e-9);
        assert_eq!(report.outcome, Outcome::Converged, "{number}");
        assert!(report.iterations <= 80, "{number}: {report:?}");
        let error = x.select_rows(&free) - &expected;
        let [error, all] = [&error, &expected].map(|v| v.dot(&(&a * v)).sqrt());
        assert!(error < 1e-7 * all, "{number}: {error:e} of {all:e}");
    }
}

#[test]
fn it_is_symmetric_and_what_it_makes_of_the_matrix_lies_within_its_bounds() {
    for (number, cloth) in cloths().enumerate().filter(|(number, _)| number % 4 < 2) {
        let ready = Ready::new(cloth);
        let free = ready.free();
        let size = ready.matrix.nrows();
        let mut inverse = DMatrix::zeros(size, size);
        for column in &free {
            let mut unit = DVector::zeros(size);
            unit[*column] = 1.0;
            inverse.set_column(*column, &ready.apply(&unit).0);
        }
        let inverse = inverse.select_rows(&free).select_columns(&free);
        let asymmetry = (&inverse - inverse.transpose()).amax();
        assert!(asymmetry < 1e-5 * inverse.amax(), "{number}: {asymmetry:e} of {:e}", inverse.amax());

        let a = ready.matrix.select_rows(&free).select_columns(&free);
        let l = a.cholesky().expect("positive definite").l();
        let similar = l.transpose() * (&inverse + inverse.transpose()) * l * 0.5;
        let found = SymmetricEigen::new(similar).eigenvalues;
        // With eigenvectors below 0.1 as functions, 0.1 w (2 - w c) is proven, which is 0.021 with elements.
        let (least, most) = (found.min(), found.max());
        assert!(least > 1.0 / 52.0 && most < 1.0 + 1e-4, "{number}: {least} to {most}");
        // The coarse space does it: the blocks alone leave what is soft.
        assert!(ready.patches.len() < free.len(), "fewer functions than numbers");
    }
}

#[test]
fn the_square_of_a_residual_is_what_it_says_and_positive() {
    for cloth in cloths().take(6) {
        let ready = Ready::new(cloth);
        for seed in 0..5 {
            let r = ready.right_hand_side(seed);
            let (z, square) = ready.apply(&r);
            assert!(square > 0.0 && (square - r.dot(&z)).abs() < 1e-10 * square);
        }
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    let on = |threads: usize| {
        on_threads(threads, || {
            let ready = Ready::new(Cloth::bending(30, 3));
            let (x, report) = ready.solve(&ready.right_hand_side(7), 1e-6);
            (x.iter().map(|x| x.to_bits()).collect::<Vec<_>>(), report)
        })
    };
    let one = on(1);
    assert_eq!(one.1.outcome, Outcome::Converged);
    for threads in [2, 3, 8] {
        assert_eq!(on(threads), one, "{threads} threads");
    }
}

#[test]
fn a_set_up_forgets_the_one_before() {
    let mut ready = Ready::new(Cloth::sheet(9, 1));
    let r = ready.right_hand_side(2);
    let (fresh, _) = ready.apply(&r);
    let mut other = ready.cloth.clone();
    other.springs.iter_mut().for_each(|(_, stiffness)| stiffness[1] *= 30.0);
    ready.patches.set_up(&ready.layout, &other, &ready.inverse);
    ready.patches.set_up(&ready.layout, &ready.cloth, &ready.inverse);
    assert_eq!(ready.apply(&r).0, fresh);
}

#[test]
fn small_pinned_and_loose_bodies_are_solved() {
    let mut pinned = Cloth::sheet(7, 4);
    pinned.is_free.fill(false);
    let mut some_blocks = Cloth::sheet(8, 4);
    some_blocks.is_free[BLOCK_SIZE..].fill(false);
    let mut loose = Cloth::sheet(6, 9);
    loose.springs.clear();
    let mut slack = Cloth::sheet(6, 9);
    slack.springs.iter_mut().for_each(|(_, stiffness)| *stiffness = [0.0; 2]);
    let mut coincident = Cloth::sheet(6, 11);
    (1..36).step_by(5).for_each(|i| coincident.x[i] = coincident.x[i - 1]);
    let few = [Cloth::chain(1, 1.0), Cloth::chain(3, 1e4), Cloth::chain(100, 1e4)];
    for cloth in few.into_iter().chain([pinned, some_blocks, loose, slack, coincident]) {
        let ready = Ready::new(cloth);
        let b = ready.right_hand_side(3);
        let (x, report) = ready.solve(&b, 1e-8);
        assert_eq!(report.outcome, Outcome::Converged);
        let left = &b - &ready.matrix * &x;
        assert!(left.norm() <= 1e-5 * b.norm().max(1e-300), "{:e} of {:e}", left.norm(), b.norm());
    }
}

#[test]
fn every_stiffness_makes_something_positive() {
    for power in -3..=12 {
        let mut cloth = Cloth::sheet(8, 5);
        let stiffness = 10_f64.powi(power);
        cloth.springs.iter_mut().for_each(|(_, of_spring)| {
            *of_spring = of_spring.map(|number| number * 1e-4 * stiffness);
        });
        let ready = Ready::new(cloth);
        let r = ready.right_hand_side(1);
        let (z, square) = ready.apply(&r);
        assert!(z.iter().all(|z| z.is_finite()) && square > 0.0 && square.is_finite(), "1e{power}");
        if power <= 6 {
            let (_, report) = ready.solve(&r, 1e-4);
            assert!(report.outcome == Outcome::Converged && report.iterations <= 40, "1e{power}: {report:?}");
        }
    }
}
