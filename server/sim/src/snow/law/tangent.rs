//! How the first Piola stress changes with F: what a semi-implicit step needs.
//!
//! Reads F by its signed singular value decomposition and a change dF; writes dP. With p_i =
//! dpsi/dsigma_i = base (sigma_i - rest) + g sigma_j sigma_k the differences (p_i - p_j) /
//! (sigma_i - sigma_j) have no denominator left; the sums (p_i + p_j) / (sigma_i + sigma_j) keep
//! one for the corotated law, which is indefinite under compression (Stomakhin et al. 2012).

use super::constitutive::{Moduli, Volumetric, volumetric};
use crate::math::{Columns, Pack, Real, Svd};

/// Least |sigma_i + sigma_j|: the rotation is not defined where it vanishes.
const LEAST_SUM: f64 = 1e-6;

/// dP of sixteen particles, by columns; Jp enters through the hardening.
#[inline(always)]
pub(crate) fn piola_change<R: Real, P: Pack<R>>(
    f: &Svd<P>,
    change: &Columns<P>,
    hardening: P,
    m: &Moduli<P>,
) -> Columns<P> {
    let Svd { u, sigma, v } = f;
    let a = into_frame(u, v, change);
    let half = P::splat(R::of(0.5));
    let j = sigma[0].mul(sigma[1]).mul(sigma[2]);
    let Volumetric { base, two_rest, g, slope } = volumetric(j, hardening, m);
    let mut p = a;
    for i in 0..3 {
        let (j1, k1) = ((i + 1) % 3, (i + 2) % 3);
        let (sj, sk) = (sigma[j1], sigma[k1]);
        // Along the principal directions.
        let own = base.add(slope.mul(sj.mul(sk)).mul(sj.mul(sk)));
        let coupled = slope.mul(j).add(g);
        let others = sk.mul(a[j1][j1]).add(sj.mul(a[k1][k1]));
        p[i][i] = own.mul(a[i][i]).add(coupled.mul(others));
        // Between directions j1 and k1, across i.
        let difference = base.sub(g.mul(sigma[i]));
        let sum = sj.add(sk);
        let sum = sum.abs().max(P::splat(R::of(LEAST_SUM))).with_sign_of(sum);
        let total = base.sub(two_rest.div(sum)).add(g.mul(sigma[i]));
        let (mean, rest) = (half.mul(difference.add(total)), half.mul(difference.sub(total)));
        // a[column][row]: entry (row j1, column k1) is a[k1][j1].
        let (jk, kj) = (a[k1][j1], a[j1][k1]);
        p[k1][j1] = mean.mul(jk).add(rest.mul(kj));
        p[j1][k1] = mean.mul(kj).add(rest.mul(jk));
    }
    out_of_frame(u, v, &p)
}

/// U^T M V, by columns.
#[inline(always)]
fn into_frame<R: Real, P: Pack<R>>(u: &Columns<P>, v: &Columns<P>, m: &Columns<P>) -> Columns<P> {
    let mut out = *m;
    for column in 0..3 {
        // M v_column.
        let mut image = [P::splat(R::zero()); 3];
        for row in 0..3 {
            image[row] = m[0][row].mul(v[column][0]);
            image[row] = image[row].add(m[1][row].mul(v[column][1])).add(m[2][row].mul(v[column][2]));
        }
        for row in 0..3 {
            out[column][row] = crate::math::dot3(&u[row], &image);
        }
    }
    out
}

/// U M V^T, by columns.
#[inline(always)]
fn out_of_frame<R: Real, P: Pack<R>>(u: &Columns<P>, v: &Columns<P>, m: &Columns<P>) -> Columns<P> {
    let mut out = *m;
    for column in 0..3 {
        // M (V^T e_column).
        let mut image = [P::splat(R::zero()); 3];
        for row in 0..3 {
            image[row] = m[0][row].mul(v[0][column]);
            image[row] = image[row].add(m[1][row].mul(v[1][column])).add(m[2][row].mul(v[2][column]));
        }
        for row in 0..3 {
            out[column][row] = u[0][row].mul(image[0]);
            out[column][row] = out[column][row].add(u[1][row].mul(image[1])).add(u[2][row].mul(image[2]));
        }
    }
    out
}
