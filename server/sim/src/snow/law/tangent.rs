//! How the first Piola stress changes with F: what a semi-implicit step needs.
//!
//! Reads F by its signed singular value decomposition and a change dF; writes dP. With p_i =
//! dpsi/dsigma_i = base (sigma_i - rest) + g sigma_j sigma_k the differences (p_i - p_j) /
//! (sigma_i - sigma_j) have no denominator left; the sums (p_i + p_j) / (sigma_i + sigma_j) keep
//! one for the corotated law, which is indefinite under compression (Stomakhin et al. 2012).

use super::constitutive::{Moduli, Volumetric, volumetric};
use crate::math::{Columns, Pack, Svd};

/// Least |sigma_i + sigma_j|: the rotation is not defined where it vanishes.
const LEAST_SUM: f64 = 1e-6;

/// dP of sixteen particles, by columns; J_P enters through the hardening.
#[inline(always)]
pub(crate) fn piola_change<P: Pack>(
    f: &Svd<P>,
    change: &Columns<P>,
    hardening: P,
    m: &Moduli<P>,
) -> Columns<P> {
    let Svd { u, sigma, v } = f;
    let a = into_frame(u, v, change);
    let half = P::of(0.5);
    let j = sigma[0] * sigma[1] * sigma[2];
    let Volumetric { base, two_rest, g, slope } = volumetric(j, hardening, m);
    let mut p = a;
    for i in 0..3 {
        let (j1, k1) = ((i + 1) % 3, (i + 2) % 3);
        let (sj, sk) = (sigma[j1], sigma[k1]);

        // Along the principal directions.
        let own = base + slope * (sj * sk) * (sj * sk);
        let coupled = slope * j + g;
        let others = sk * a[j1][j1] + sj * a[k1][k1];
        p[i][i] = own * a[i][i] + coupled * others;

        // Between directions j1 and k1, across i.
        let difference = base - g * sigma[i];
        let sum = sj + sk;
        let sum = sum.abs().max(P::of(LEAST_SUM)).with_sign_of(sum);
        let total = base - two_rest / sum + g * sigma[i];
        let (mean, rest) = (half * (difference + total), half * (difference - total));
        // a[column][row]: entry (row j1, column k1) is a[k1][j1].
        let (jk, kj) = (a[k1][j1], a[j1][k1]);
        p[k1][j1] = mean * jk + rest * kj;
        p[j1][k1] = mean * kj + rest * jk;
    }

    out_of_frame(u, v, &p)
}

/// U^T M V, by columns.
#[inline(always)]
fn into_frame<P: Pack>(u: &Columns<P>, v: &Columns<P>, m: &Columns<P>) -> Columns<P> {
    let mut out = *m;
    for column in 0..3 {
        // M v_column.
        let mut image = [P::zero(); 3];
        for row in 0..3 {
            image[row] = m[0][row] * v[column][0];
            image[row] = image[row] + m[1][row] * v[column][1] + m[2][row] * v[column][2];
        }
        for row in 0..3 {
            out[column][row] = crate::math::dot3(&u[row], &image);
        }
    }

    out
}

/// U M V^T, by columns.
#[inline(always)]
fn out_of_frame<P: Pack>(u: &Columns<P>, v: &Columns<P>, m: &Columns<P>) -> Columns<P> {
    let mut out = *m;
    for column in 0..3 {
        // M (V^T e_column).
        let mut image = [P::zero(); 3];
        for row in 0..3 {
            image[row] = m[0][row] * v[0][column];
            image[row] = image[row] + m[1][row] * v[1][column] + m[2][row] * v[2][column];
        }
        for row in 0..3 {
            out[column][row] = u[0][row] * image[0];
            out[column][row] = out[column][row] + u[1][row] * image[1] + u[2][row] * image[2];
        }
    }

    out
}
