//! Deformation: elastic predictor, plastic return, stress (Stomakhin et al. 2013, step 7 and 8).
//!
//! Reads F_E, J_P and the velocity gradient of sixteen particles; writes F_E, J_P and V0 tau.

use super::constitutive::{
    Moduli, Returned, energy_density, hardened, plastic_return, principal_stress, stiffness,
};
use crate::math::{Columns, Pack, Svd, cross3, dot3, orthogonalize, svd};

/// F_E and J_P after a step.
#[derive(Clone, Copy)]
pub(crate) struct Deformed<P> {
    /// F_E by columns.
    pub(crate) elastic: Columns<P>,
    pub(crate) plastic_ratio: P,
    /// exp(xi (1 - J_P)).
    pub(crate) hardening: P,
    /// V0 tau (J): xx yy zz xy xz yz.
    pub(crate) volume_stress: [P; 6],
    pub(crate) yielded: P,
    pub(crate) clamped: P,
    pub(crate) inverted: P,
    /// Elastic energy (J) that hardening adds in the return, where that is more than yielding takes.
    pub(crate) given: P,
}

/// (I + dt grad v) F, by columns; the gradient by columns too: `gradient[axis][component]`.
#[inline(always)]
pub(crate) fn predict<P: Pack>(f: &Columns<P>, gradient: &Columns<P>, dt: P) -> Columns<P> {
    let change = product(gradient, f);
    let mut out = *f;
    for column in 0..3 {
        for row in 0..3 {
            out[column][row] = f[column][row] + dt * change[column][row];
        }
    }
    out
}

/// Product of two matrices, by columns.
#[inline(always)]
pub(crate) fn product<P: Pack>(a: &Columns<P>, b: &Columns<P>) -> Columns<P> {
    let mut out = *b;
    for column in 0..3 {
        for row in 0..3 {
            let sum = a[0][row] * b[column][0] + a[1][row] * b[column][1];
            out[column][row] = sum + a[2][row] * b[column][2];
        }
    }
    out
}

/// Singular values from here on are far from 0: their directions are exact without V.
const REGULAR: f64 = 0.1;

/// Plastic return of trial F_E, and the stress after it, of several packs at once.
///
/// F_E = U diag(held) V^T = (I + U diag(held / sigma - 1) U^T) F: where nothing yields, F_E stays as
/// it is, and V is not needed. Lanes with a singular value near 0 or det F < 0 take the full
/// decomposition.
#[inline(always)]
pub(crate) fn deform<P: Pack, const K: usize>(
    trial: &[Columns<P>; K],
    plastic_ratio: &[P; K],
    volume: &[P; K],
    m: &[Moduli<P>; K],
) -> [Deformed<P>; K] {
    let mut turned = *trial;
    orthogonalize(&mut turned);
    let mut out = [Deformed::of(&trial[0], plastic_ratio[0]); K];
    for k in 0..K {
        out[k] = from_left(&trial[k], &turned[k], plastic_ratio[k], volume[k], &m[k]);
        let irregular = irregular(&trial[k], &turned[k]);
        if irregular.any() {
            let full = from_svd(&trial[k], plastic_ratio[k], volume[k], &m[k]);
            out[k] = Deformed::pick(irregular, &full, &out[k]);
        }
    }

    out
}

/// 1 where a singular value is near 0 or det F < 0, else 0.
#[inline(always)]
fn irregular<P: Pack>(trial: &Columns<P>, turned: &Columns<P>) -> P {
    let (zero, one) = (P::zero(), P::one());
    let least = dot3(&turned[0], &turned[0]).min(dot3(&turned[1], &turned[1]));
    let least = least.min(dot3(&turned[2], &turned[2]));
    let flat = least.if_less(P::of(REGULAR * REGULAR), one, zero);
    dot3(&trial[0], &cross3(&trial[1], &trial[2])).if_less(zero, one, flat)
}

/// From the columns U diag(sigma), where all singular values are regular.
#[inline(always)]
fn from_left<P: Pack>(
    trial: &Columns<P>,
    turned: &Columns<P>,
    plastic_ratio: P,
    volume: P,
    m: &Moduli<P>,
) -> Deformed<P> {
    let one = P::one();
    let mut u = *turned;
    let (mut sigma, mut inverse) = ([one; 3], [one; 3]);
    for k in 0..3 {
        sigma[k] = dot3(&turned[k], &turned[k]).sqrt();
        inverse[k] = one / sigma[k];
        for row in 0..3 {
            u[k][row] = turned[k][row] * inverse[k];
        }
    }

    let before = plastic_ratio;
    let Returned { sigma: held, plastic_ratio, yielded, clamped, inverted } =
        plastic_return(&sigma, plastic_ratio, m);

    let mut change = [one; 3];
    let hardening = hardened(plastic_ratio, m);
    let given = given([&sigma, &held], [before, hardening], yielded, m) * volume;
    let t = principal_stress(&held, hardening, m);
    let mut force = t;
    for k in 0..3 {
        change[k] = (held[k] - sigma[k]) * inverse[k];
        force[k] = t[k] * volume;
    }

    // F_E = (I + U diag(change) U^T) F.
    let [xx, yy, zz, xy, xz, yz] = in_frame(&u, &change);
    let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let mut elastic = *trial;
    for column in 0..3 {
        for row in 0..3 {
            elastic[column][row] = trial[column][row] + dot3(&rows[row], &trial[column]);
        }
    }

    let volume_stress = in_frame(&u, &force);
    Deformed { elastic, plastic_ratio, hardening, volume_stress, yielded, clamped, inverted, given }
}

/// From the full decomposition.
#[inline(always)]
fn from_svd<P: Pack>(trial: &Columns<P>, plastic_ratio: P, volume: P, m: &Moduli<P>) -> Deformed<P> {
    let zero = P::zero();
    let Svd { u, sigma: stretched, v } = svd(trial);
    let before = plastic_ratio;
    let Returned { sigma, plastic_ratio, yielded, clamped, inverted } =
        plastic_return(&stretched, plastic_ratio, m);

    let mut elastic = *trial;
    for column in 0..3 {
        for row in 0..3 {
            let product = u[0][row] * sigma[0] * v[0][column];
            let product = product + u[1][row] * sigma[1] * v[1][column];
            let product = product + u[2][row] * sigma[2] * v[2][column];
            elastic[column][row] = zero.if_less(yielded, product, trial[column][row]);
        }
    }

    let hardening = hardened(plastic_ratio, m);
    let given = given([&stretched, &sigma], [before, hardening], yielded, m) * volume;
    let t = principal_stress(&sigma, hardening, m);
    let volume_stress = in_frame(&u, &[t[0] * volume, t[1] * volume, t[2] * volume]);
    Deformed { elastic, plastic_ratio, hardening, volume_stress, yielded, clamped, inverted, given }
}

/// Energy density (J/m³) by which a return from one deformation to another, of J_P before and hardening after it, adds to
/// what was there; 0 where it takes.
#[inline(always)]
fn given<P: Pack>(
    [from, to]: [&[P; 3]; 2],
    [plastic_ratio, hardening]: [P; 2],
    yielded: P,
    m: &Moduli<P>,
) -> P {
    let zero = P::zero();
    if !yielded.any() {
        return zero;
    }
    let change = energy_density(to, hardening, m) - energy_density(from, hardened(plastic_ratio, m), m);
    zero.if_less(yielded, change.max(zero), zero)
}

impl<P: Pack> Deformed<P> {
    #[inline(always)]
    fn of(elastic: &Columns<P>, plastic_ratio: P) -> Self {
        let zero = P::zero();
        Self {
            elastic: *elastic,
            plastic_ratio,
            hardening: zero,
            volume_stress: [zero; 6],
            yielded: zero,
            clamped: zero,
            inverted: zero,
            given: zero,
        }
    }

    /// Lanes of `a` where `gate` > 0, else of `b`.
    #[inline(always)]
    fn pick(gate: P, a: &Self, b: &Self) -> Self {
        let zero = P::zero();
        let mut out = *b;
        for column in 0..3 {
            for row in 0..3 {
                out.elastic[column][row] = zero.if_less(gate, a.elastic[column][row], b.elastic[column][row]);
            }
        }

        for k in 0..6 {
            out.volume_stress[k] = zero.if_less(gate, a.volume_stress[k], b.volume_stress[k]);
        }

        out.plastic_ratio = zero.if_less(gate, a.plastic_ratio, b.plastic_ratio);
        out.hardening = zero.if_less(gate, a.hardening, b.hardening);
        out.yielded = zero.if_less(gate, a.yielded, b.yielded);
        out.clamped = zero.if_less(gate, a.clamped, b.clamped);
        out.inverted = zero.if_less(gate, a.inverted, b.inverted);
        out.given = zero.if_less(gate, a.given, b.given);
        out
    }
}

/// F_E and J_P as they are, with their stress.
#[inline(always)]
pub(crate) fn undeformed<P: Pack, const K: usize>(
    f: &[Columns<P>; K],
    plastic_ratio: &[P; K],
    volume: &[P; K],
    m: &[Moduli<P>; K],
) -> [Deformed<P>; K] {
    let mut out = [Deformed::of(&f[0], plastic_ratio[0]); K];
    for k in 0..K {
        out[k] = Deformed::of(&f[k], plastic_ratio[k]);
        let Svd { u, sigma, .. } = svd(&f[k]);
        out[k].hardening = hardened(plastic_ratio[k], &m[k]);
        let t = principal_stress(&sigma, out[k].hardening, &m[k]);
        let t = [t[0] * volume[k], t[1] * volume[k], t[2] * volume[k]];
        out[k].volume_stress = in_frame(&u, &t);
    }
    out
}

/// U diag(t) U^T: xx yy zz xy xz yz.
#[inline(always)]
fn in_frame<P: Pack>(u: &Columns<P>, t: &[P; 3]) -> [P; 6] {
    let zero = P::zero();
    let mut out = [zero; 6];
    for k in 0..3 {
        let scaled = [u[k][0] * t[k], u[k][1] * t[k], u[k][2] * t[k]];
        out[0] += scaled[0] * u[k][0];
        out[1] += scaled[1] * u[k][1];
        out[2] += scaled[2] * u[k][2];
        out[3] += scaled[0] * u[k][1];
        out[4] += scaled[0] * u[k][2];
        out[5] += scaled[1] * u[k][2];
    }

    out
}

/// Upper bounds of the stiffnesses (Pa) of F_E as it is stored, in closed form: the square of the
/// largest singular value is at most the largest absolute row sum of F^T F.
#[inline(always)]
pub(crate) fn stiffness_of<P: Pack>(f: &Columns<P>, hardening: P, m: &Moduli<P>) -> ([P; 2], P) {
    let (xx, yy, zz) = (dot3(&f[0], &f[0]), dot3(&f[1], &f[1]), dot3(&f[2], &f[2]));
    let (xy, xz, yz) = (dot3(&f[0], &f[1]).abs(), dot3(&f[0], &f[2]).abs(), dot3(&f[1], &f[2]).abs());
    let largest2 = (xx + xy + xz).max(yy + xy + yz).max(zz + xz + yz);
    let j = dot3(&f[0], &cross3(&f[1], &f[2]));
    (stiffness(largest2, j, hardening, m), largest2)
}
