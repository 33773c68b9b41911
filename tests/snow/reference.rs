//! What the tests compute for themselves: B-splines by their recursion, matrices, norms.
//!
//! Nothing here calls the kernels that it is held against.

use nappe_sim::{
    math::Mat3,
    snow::{Kernel, Plasticity, Preset, Transfer},
};
use nappe_tests::snow::Variant;

/// Rows as the library has them.
pub(crate) fn rows(m: &Mat3<f64>) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[(i, j)]))
}

/// A matrix of rows.
pub(crate) fn matrix(rows: &[[f64; 3]; 3]) -> Mat3<f64> {
    Mat3::from_fn(|i, j| rows[i][j])
}

/// |a - b| relative to b, or to `floor` where b is smaller; infinite if not finite.
pub(crate) fn relative(a: &Mat3<f64>, b: &Mat3<f64>, floor: f64) -> f64 {
    let off = (a - b).norm() / b.norm().max(floor);
    if off.is_finite() { off } else { f64::INFINITY }
}

/// Snow of Stomakhin et al. 2013 whose J_P is not held in a range.
pub(crate) fn free_snow() -> nappe_sim::snow::Material {
    let mut material = Preset::from_name("stomakhin").expect("a preset").material;
    let plasticity = material.plasticity.expect("snow yields");
    material.plasticity = Some(Plasticity { plastic_ratio_range: [-1e9, 1e9], ..plasticity });
    material
}

/// Degree of a kernel.
fn degree(kernel: Kernel) -> i32 {
    kernel.width() as i32 - 1
}

/// The B-spline of a degree at a distance of `d` cells: Cox and de Boor's recursion.
fn spline(degree: i32, d: f64) -> f64 {
    if degree == 0 {
        return f64::from(u8::from((-0.5..0.5).contains(&d)));
    }
    let (n, half) = (f64::from(degree), 0.5 * f64::from(degree + 1));
    ((half + d) * spline(degree - 1, d + 0.5) + (half - d) * spline(degree - 1, d - 0.5)) / n
}

/// Weight of a node from which a particle is `d` cells away.
pub(crate) fn weight(kernel: Kernel, d: f64) -> f64 {
    spline(degree(kernel), d)
}

/// Its slope, times the cell.
pub(crate) fn slope(kernel: Kernel, d: f64) -> f64 {
    spline(degree(kernel) - 1, d + 0.5) - spline(degree(kernel) - 1, d - 0.5)
}

/// A node near a particle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Near {
    /// Index of the node: it stands at index times h.
    pub(crate) node: [i32; 3],
    /// Share of the particle that the node gets.
    pub(crate) weight: f64,
    /// What a velocity there is multiplied with, for the gradient at the particle (1/m).
    pub(crate) gradient: [f64; 3],
}

/// The nodes near `x` (m) on cells of side `h` (m), with gradients as the transfer has them.
pub(crate) fn nodes_near(variant: Variant, x: [f64; 3], h: f64) -> Vec<Near> {
    let kernel = variant.kernel;
    let inverse_moment = if kernel == Kernel::Cubic { 3.0 } else { 4.0 };
    let low = x.map(|c| (c / h).floor() as i32 - 1);
    let mut found = Vec::new();

    for i in 0..64 {
        let node = [low[0] + i / 16, low[1] + i / 4 % 4, low[2] + i % 4];
        let d = [0, 1, 2].map(|a| x[a] / h - f64::from(node[a]));
        let w = d.map(|d| weight(kernel, d));
        let weight = w[0] * w[1] * w[2];
        let gradient = [0, 1, 2].map(|a| match variant.transfer {
            // D^-1 w (x_i - x_p).
            Transfer::Mls => -inverse_moment * weight * d[a] / h,
            _ => slope(kernel, d[a]) * w[(a + 1) % 3] * w[(a + 2) % 3] / h,
        });

        found.push(Near { node, weight, gradient });
    }

    found
}
