//! The laws one matrix at a time, in binary64: through the same kernels as a step.
//!
//! For tests, tools and the curious; a step works on sixteen particles at once.

use super::{
    constitutive::{
        MaterialConstants, Moduli, Returned, energy_density as energy_of, hardened, plastic_return,
        principal_stress, volumetric,
    },
    material::Material,
    tangent::piola_change,
};
use crate::math::{Columns, LANES, Mat3, Pack, Portable, Svd, svd};

type P = Portable<f64>;

/// An elastic predictor after plastic return.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Return {
    /// Elastic deformation gradient F_E.
    pub elastic: Mat3<f64>,
    /// J_P, within its range.
    pub plastic_ratio: f64,
    /// Rotation of F_E's polar decomposition.
    pub rotation: Mat3<f64>,
    /// Kirchhoff stress tau = P F_E^T (Pa).
    pub kirchhoff: Mat3<f64>,
    /// Elastic energy per volume at rest (J/m³).
    pub energy: f64,
    /// Singular values of the predictor; the sign of its determinant is on the last, the least.
    pub singular_values: [f64; 3],
    /// Whether a singular value was beyond the yield limits.
    pub yielded: bool,
    /// Whether det F < 0 or J_P <= 0 before it was held in its range.
    pub inverted: bool,
    /// Whether J_P was held at an end of its range.
    pub clamped: bool,
}

fn columns(f: &Mat3<f64>) -> Columns<P> {
    [0, 1, 2].map(|column| [0, 1, 2].map(|row| P::splat(f[(row, column)])))
}

fn lane(pack: P) -> f64 {
    pack.store()[0]
}

fn matrix(m: &Columns<P>) -> Mat3<f64> {
    Mat3::from_fn(|row, column| lane(m[column][row]))
}

fn moduli(material: &Material) -> Moduli<P> {
    Moduli::gather(&[MaterialConstants::of(material)], &[0; LANES], P::splat(1.0))
}

/// U diag(sigma) V^T.
fn compose(u: &Columns<P>, sigma: [f64; 3], v: &Columns<P>) -> Mat3<f64> {
    matrix(u) * Mat3::from_diagonal(&sigma.into()) * matrix(v).transpose()
}

/// Plastic return of the predictor `trial`, and the answer of the material after it.
pub fn return_map(material: &Material, trial: &Mat3<f64>, plastic_ratio: f64) -> Return {
    let m = moduli(material);
    let Svd { u, sigma, v } = svd(&columns(trial));
    let Returned { sigma: held, plastic_ratio, yielded, clamped, inverted } =
        plastic_return(&sigma, P::splat(plastic_ratio), &m);
    let hardening = hardened(plastic_ratio, &m);
    let elastic = if lane(yielded) > 0.0 { compose(&u, held.map(lane), &v) } else { *trial };
    Return {
        elastic,
        plastic_ratio: lane(plastic_ratio),
        rotation: compose(&u, [1.0; 3], &v),
        kirchhoff: compose(&u, principal_stress(&held, hardening, &m).map(lane), &u),
        energy: lane(energy_of(&held, hardening, &m)),
        singular_values: sigma.map(lane),
        yielded: lane(yielded) > 0.0,
        inverted: lane(inverted) > 0.0,
        clamped: lane(clamped) > 0.0,
    }
}

/// First Piola stress P = dpsi/dF (Pa) of F_E as it is, hardened by J_P.
pub fn piola(material: &Material, f: &Mat3<f64>, plastic_ratio: f64) -> Mat3<f64> {
    let m = moduli(material);
    let Svd { u, sigma, v } = svd(&columns(f));
    let j = sigma[0] * sigma[1] * sigma[2];
    let law = volumetric(j, hardened(P::splat(plastic_ratio), &m), &m);
    let [base, two_rest, g] = [law.base, law.two_rest, law.g].map(lane);
    let s = sigma.map(lane);
    let p = [0, 1, 2].map(|i| base * s[i] - 0.5 * two_rest + g * s[(i + 1) % 3] * s[(i + 2) % 3]);
    compose(&u, p, &v)
}

/// Kirchhoff stress tau = P F^T (Pa) of F_E as it is.
pub fn kirchhoff(material: &Material, f: &Mat3<f64>, plastic_ratio: f64) -> Mat3<f64> {
    let m = moduli(material);
    let Svd { u, sigma, .. } = svd(&columns(f));
    let t = principal_stress(&sigma, hardened(P::splat(plastic_ratio), &m), &m);
    compose(&u, t.map(lane), &u)
}

/// Elastic energy per volume at rest (J/m³) of F_E as it is.
pub fn energy_density(material: &Material, f: &Mat3<f64>, plastic_ratio: f64) -> f64 {
    let m = moduli(material);
    let sigma = svd(&columns(f)).sigma;
    lane(energy_of(&sigma, hardened(P::splat(plastic_ratio), &m), &m))
}

/// Change dP of the first Piola stress with a change dF.
pub fn piola_derivative(
    material: &Material,
    f: &Mat3<f64>,
    plastic_ratio: f64,
    change: &Mat3<f64>,
) -> Mat3<f64> {
    let m = moduli(material);
    let f = svd(&columns(f));
    matrix(&piola_change(&f, &columns(change), hardened(P::splat(plastic_ratio), &m), &m))
}

/// Signed singular value decomposition F = U diag(sigma) V^T: U, sigma, V.
pub fn signed_svd(f: &Mat3<f64>) -> (Mat3<f64>, [f64; 3], Mat3<f64>) {
    let Svd { u, sigma, v } = svd(&columns(f));
    (matrix(&u), sigma.map(lane), matrix(&v))
}
