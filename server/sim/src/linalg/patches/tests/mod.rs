//! Patches on small cloths without order, against dense factorisations.

mod cloth;

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use self::cloth::{BLOCK_SIZE, Cloth, Numbers};
use super::{PatchLayout, PatchMatrix, Patches};
use crate::{
    linalg::{
        BlockCsr, CgWorkspace, Inverse3, Outcome, PreconditionerKind, Room, SolveReport, SolverSettings,
        Stop, Symmetric3, WholePreconditioner, conjugate_gradient,
    },
    math::{Sixteen, Vec3},
    parallel::{Share, on_threads},
};

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
        let of_elements = cloth
            .elements
            .iter()
            .flat_map(|(corners, _)| (0..16).map(move |k| [corners[k / 4], corners[k % 4]]));
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
        let scale = |i: usize, j: usize| a[(i, j)] / (a[(i, i)] * a[(j, j)]).sqrt();
        let values = SymmetricEigen::new(DMatrix::from_fn(a.nrows(), a.nrows(), scale)).eigenvalues;
        let condition = values.max() / values.min();
        let l = a.cholesky().expect("positive definite").l();
        let similar = l.transpose() * (&inverse + inverse.transpose()) * l * 0.5;
        let found = SymmetricEigen::new(similar).eigenvalues;
        // With eigenvectors below 0.1 as functions, 0.1 w (2 - w c) is proven, which is 0.021 with elements.
        let (least, most) = (found.min(), found.max());
        // The factors of binary32 are off by their rounding times the condition.
        let rounding = (0.5 * f64::from(f32::EPSILON) * condition).min(0.01);
        assert!(least > 1.0 / 52.0 && most < 1.0 + rounding, "{number}: {least} to {most}");
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
