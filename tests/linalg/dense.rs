//! Dense symmetric systems with one mass per node: their solution by elimination, and the smallest
//! residual that a method of so many products can have.

use nappe_sim::{
    linalg::{MinresWorkspace, SolveReport, Stop, WholeOperator, minres},
    math::{Real, Vec3, array3, vec3},
};
use nappe_tests::{
    Random,
    systems::{System, size},
};

/// Rows of a symmetric matrix.
pub(super) type Matrix = Vec<Vec<f64>>;

/// A dense matrix, applied in the precision of its vectors.
pub(super) struct Dense(Matrix);

impl<R: Real> WholeOperator<R> for Dense {
    fn apply(&mut self, x: &[Vec3<R>], out: &mut [Vec3<R>]) {
        for (i, out) in out.iter_mut().enumerate() {
            for c in 0..3 {
                let terms = self.0[3 * i + c].iter().enumerate().map(|(j, a)| R::of(*a) * x[j / 3][j % 3]);
                out[c] = terms.fold(R::zero(), |sum, term| sum + term);
            }
        }
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn times(a: &Matrix, x: &[f64]) -> Vec<f64> {
    a.iter().map(|row| dot(row, x)).collect()
}

/// a + s b.
pub(super) fn plus(a: &[f64], s: f64, b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + s * b).collect()
}

pub(super) fn matrix(side: usize, entry: impl Fn(usize, usize) -> f64) -> Matrix {
    (0..side).map(|i| (0..side).map(|j| entry(i, j)).collect()).collect()
}

/// The solution by elimination with row pivots.
pub(super) fn eliminate(a: &Matrix, b: &[f64]) -> Vec<f64> {
    let side = b.len();
    let mut rows: Matrix = a.iter().zip(b).map(|(row, b)| [&row[..], &[*b]].concat()).collect();
    for k in 0..side {
        let pivot = (k..side).max_by(|i, j| rows[*i][k].abs().total_cmp(&rows[*j][k].abs()));
        rows.swap(k, pivot.expect("rows are left"));
        let (done, left) = rows.split_at_mut(k + 1);
        for row in left {
            let share = row[k] / done[k][k];
            row.iter_mut().zip(&done[k]).for_each(|(entry, pivot)| *entry -= share * pivot);
        }
    }

    let mut x = vec![0.0; side];
    for k in (0..side).rev() {
        x[k] = (rows[k][side] - dot(&rows[k][k + 1..side], &x[k + 1..])) / rows[k][k];
    }

    x
}

/// Negative eigenvalues: as many as negative pivots of an elimination without exchanges (Sylvester).
pub(super) fn negative_eigenvalues(a: &Matrix) -> usize {
    let mut rows = a.clone();
    for k in 0..rows.len() {
        let (done, left) = rows.split_at_mut(k + 1);
        for row in left {
            let share = row[k] / done[k][k];
            row.iter_mut().zip(&done[k]).for_each(|(entry, pivot)| *entry -= share * pivot);
        }
    }

    rows.iter().enumerate().filter(|(k, row)| row[*k] < 0.0).count()
}

/// Random numbers in -1..1.
pub(super) fn noise(seed: u64, count: usize) -> Vec<f64> {
    let mut random = Random::seeded(seed);
    (0..count).map(|_| random.number()).collect()
}

/// A symmetric system with one mass per node.
pub(super) struct Case {
    pub(super) a: Matrix,
    pub(super) mass: Vec<f64>,
    pub(super) b: Vec<f64>,
}

impl Case {
    pub(super) fn of(system: &System) -> Self {
        Self { a: system.a.clone(), mass: vec![1.0; system.b.len() / 3], b: system.b.clone() }
    }

    /// 50 nodes: masses over six decades, and `A = M^1/2 (1 + size S) M^1/2` with S symmetric, of
    /// eigenvalues from about -14 to 14.
    pub(super) fn dense(size: f64) -> Self {
        let (nodes, side) = (50, 150);
        let numbers = noise(2, nodes + side * side + side);
        let (decades, numbers) = numbers.split_at(nodes);
        let (parts, loads) = numbers.split_at(side * side);
        let mass: Vec<f64> = decades.iter().map(|decade| 10.0_f64.powf(3.0 * decade)).collect();
        let a = matrix(side, |i, j| {
            let unit = if i == j { 1.0 } else { 0.0 };
            let part = size * parts[side * i.min(j) + i.max(j)];
            (mass[i / 3] * mass[j / 3]).sqrt() * (unit + part)
        });
        let b = loads.iter().enumerate().map(|(i, load)| mass[i / 3] * load).collect();
        Self { a, mass, b }
    }

    /// Components times the root of their mass to a power.
    pub(super) fn weigh(&self, x: &[f64], power: i32) -> Vec<f64> {
        x.iter().enumerate().map(|(i, x)| x * self.mass[i / 3].sqrt().powi(power)).collect()
    }

    /// `M^-1/2 A M^-1/2` and `M^-1/2 b`: the same system, in which the norm is the usual one.
    pub(super) fn scaled(&self) -> (Matrix, Vec<f64>) {
        let root = |i: usize| self.mass[i / 3].sqrt();
        (matrix(self.b.len(), |i, j| self.a[i][j] / root(i) / root(j)), self.weigh(&self.b, -1))
    }

    /// Solves from a start.
    pub(super) fn solve_from<R: Real>(&self, start: &[f64], stop: Stop) -> (SolveReport, Vec<f64>) {
        let vectors = |v: &[f64]| -> Vec<Vec3<R>> { v.as_chunks::<3>().0.iter().map(|v| vec3(*v)).collect() };
        let (b, mut x) = (vectors(&self.b), vectors(start));
        let mass: Vec<R> = self.mass.iter().map(|m| R::of(*m)).collect();
        let mut operator = Dense(self.a.clone());
        let report = minres(&mut operator, &mass, &b, &mut x, stop, &mut MinresWorkspace::default());
        (report, x.iter().flat_map(array3).collect())
    }

    pub(super) fn solve<R: Real>(&self, stop: Stop) -> (SolveReport, Vec<f64>) {
        self.solve_from::<R>(&vec![0.0; self.b.len()], stop)
    }

    /// |b - A x| / |b| in the norm of the inverse mass.
    pub(super) fn residual(&self, x: &[f64]) -> f64 {
        let rest = plus(&self.b, -1.0, &times(&self.a, x));
        size(&self.weigh(&rest, -1)) / size(&self.weigh(&self.b, -1))
    }

    /// The smallest relative residual of any combination of b, A b, ... after 1, 2, ... products.
    pub(super) fn least_residuals(&self, products: usize) -> Vec<f64> {
        let (a, b) = self.scaled();

        // Twice: once leaves rounding of what it took away.
        let orthogonal = |v: Vec<f64>, basis: &[Vec<f64>]| {
            basis.iter().chain(basis).fold(v, |v, e| plus(&v, -dot(e, &v), e))
        };

        let unit = |v: &[f64]| v.iter().map(|c| c / size(v)).collect::<Vec<_>>();
        let (mut space, mut images): (Matrix, Matrix) = (vec![unit(&b)], Vec::new());
        (0..products)
            .map(|_| {
                if let Some(last) = space.last().filter(|_| images.len() < b.len()) {
                    let image = times(&a, last);
                    let new_image = orthogonal(image.clone(), &images);
                    if size(&new_image) > 1e-10 {
                        images.push(unit(&new_image));
                    }

                    // Where the space ends its last vector's image is one of it, and adds nothing.
                    let further = orthogonal(image, &space);
                    if size(&further) > 1e-10 {
                        space.push(unit(&further));
                    }
                }

                size(&orthogonal(b.clone(), &images)) / size(&b)
            })
            .collect()
    }
}
