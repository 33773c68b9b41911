//! Small linear systems with known outcomes, of `tests/golden/linalg/cg_systems.json`.

use nappe_sim::{
    linalg::{
        BlockCsr, BlockJacobi, CgWorkspace, Identity, Inverse3, Preconditioner, PreconditionerKind,
        SolveReport, SolverSettings, Stop, Symmetric3, conjugate_gradient,
    },
    math::{Mat3, Real, Sixteen, Vec3, vec3},
    parallel::Share,
};
use serde::Deserialize;

use crate::golden::document;

#[derive(Deserialize)]
struct Systems {
    systems: Vec<System>,
}

/// A system A x = b.
#[derive(Deserialize)]
pub struct System {
    /// What the table calls it.
    pub name: String,
    /// A, row by row.
    #[serde(rename = "A")]
    pub a: Vec<Vec<f64>>,
    /// The right-hand side.
    pub b: Vec<f64>,
    eigenvalues: Vec<f64>,
    /// A⁻¹ b, where A is regular.
    pub x_exact: Option<Vec<f64>>,
    /// What conjugate gradient does without rounding.
    #[serde(rename = "cg_exact_arithmetic")]
    pub exact: Exact,
    /// |r| after 0, 1, ... iterations with the inverse diagonal blocks.
    pub block_jacobi_pcg_residual_norms: Option<Vec<f64>>,
}

/// Conjugate gradient without rounding and without preconditioner.
#[derive(Deserialize)]
pub struct Exact {
    /// `converged`, or how it broke down.
    pub status: String,
    /// Iterations until then.
    pub iterations: u32,
    /// |r| after 0, 1, ... of them.
    pub residual_norms: Vec<f64>,
    /// The first iteration, from 0, whose curvature is not positive.
    #[serde(rename = "first_iteration_with_pAp_le_0")]
    pub first_bad: Option<u32>,
}

impl System {
    /// All of the table.
    pub fn all() -> Vec<Self> {
        document::<Systems>("linalg/cg_systems.json").systems
    }

    /// One by its name.
    pub fn named(name: &str) -> Self {
        Self::all()
            .into_iter()
            .find(|s| s.name == name)
            .unwrap_or_else(|| panic!("no system is named {name}"))
    }

    fn diagonal_block(&self, i: usize) -> Symmetric3 {
        let at = |a: usize, b: usize| self.a[3 * i + a][3 * i + b];
        Symmetric3 { xx: at(0, 0), yy: at(1, 1), zz: at(2, 2), xy: at(0, 1), xz: at(0, 2), yz: at(1, 2) }
    }

    /// Solves from 0; gives the solution too.
    pub fn solve<R: Real>(&self, kind: PreconditionerKind, stop: Stop) -> (SolveReport, Vec<f64>) {
        let a = BlockCsr::<R>::from_dense(&self.a);
        let b: Vec<Vec3<R>> = self.b.as_chunks::<3>().0.iter().map(|b| vec3(*b)).collect();
        let count = b.len();
        let b = Sixteen::from_vectors(&b);
        let mut x = vec![Sixteen::default(); b.len()];
        let settings = SolverSettings { stop, preconditioner: kind, ..SolverSettings::default() };
        let (share, mut work) = (Share::whole(count, 32), CgWorkspace::new(count, 32));
        let blocks: Vec<_> = (0..count).map(|i| self.diagonal_block(i)).collect();
        let inverse = Inverse3::of(&blocks, kind, 1.0);
        let jacobi = BlockJacobi(&inverse);
        let m: &dyn Preconditioner<R> =
            if kind == PreconditionerKind::Identity { &Identity } else { &jacobi };
        let report = conjugate_gradient(&a, m, &b, &mut x, &settings, &share, &mut work);

        let x = Sixteen::to_vectors(&x, count);
        (report, x.iter().flat_map(|x| x.iter().map(|c| c.to_f64()).collect::<Vec<_>>()).collect())
    }

    /// |b - A x| / |b|, recomputed.
    pub fn residual(&self, x: &[f64]) -> f64 {
        let row = |(row, b): (&Vec<f64>, &f64)| b - row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        size(&self.a.iter().zip(&self.b).map(row).collect::<Vec<_>>()) / size(&self.b)
    }

    /// sqrt(r.z / b.c) of r = b - A x, with z = M⁻¹ r and c = M⁻¹ b, M the diagonal blocks of A.
    pub fn natural_residual(&self, x: &[f64]) -> f64 {
        let row = |(row, b): (&Vec<f64>, &f64)| b - row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        let r: Vec<f64> = self.a.iter().zip(&self.b).map(row).collect();
        let square = |r: &[f64]| {
            let block = |(i, r): (usize, &[f64; 3])| {
                let block = Mat3::from_fn(|c, d| self.a[3 * i + c][3 * i + d]);
                let r = Vec3::from(*r);
                r.dot(&block.lu().solve(&r).expect("a block is regular"))
            };
            r.as_chunks::<3>().0.iter().enumerate().map(block).sum::<f64>()
        };
        (square(&r) / square(&self.b)).sqrt()
    }

    /// Largest over smallest magnitude of an eigenvalue.
    pub fn condition(&self) -> f64 {
        let magnitude = |e: &f64| e.abs();
        let sizes = || self.eigenvalues.iter().map(magnitude);
        sizes().fold(0.0, f64::max) / sizes().fold(f64::INFINITY, f64::min)
    }
}

/// Length of a vector.
pub fn size(v: &[f64]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// Distance of two vectors.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    size(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
}
