//! The answer of a material: plastic return, hardening, stress, energy, stiffness.
//!
//! Reads singular values of the elastic deformation gradient and J_P; writes the returned singular
//! values, J_P, V0-free Kirchhoff stress in the frame of U, and the energy density. Stomakhin et al.
//! 2013, sections 4 and 5. Everything is in terms of singular values: no F^-T, no division by them,
//! so singular and inverted F are ordinary.

use super::material::{Law, Material, Plasticity};
use crate::math::{LANES, Pack, Real, exp};

/// Materials of a pack's lanes.
#[derive(Clone, Copy)]
pub(crate) struct Moduli<P> {
    pub(crate) mu: P,
    pub(crate) lambda: P,
    /// Hardening, the law's xi.
    hardening: P,
    /// Singular values stay between these.
    lowest: P,
    highest: P,
    /// J_P stays between these.
    least_plastic_ratio: P,
    greatest_plastic_ratio: P,
    /// 1 where the law is Neo-Hookean, 0 elsewhere.
    neo_hookean: P,
}

/// Numbers of a material in the state's precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MaterialConstants<R>([R; 8]);

impl<R: Real> MaterialConstants<R> {
    pub(crate) fn of(material: &Material) -> Self {
        let yielding = material.plasticity.map_or(
            // The largest number bounds nothing.
            [0.0, -R::LARGEST, R::LARGEST, 0.0, R::LARGEST],
            |plasticity| {
                let [low, high] = plasticity.plastic_ratio_range;
                let Plasticity { critical_compression, critical_stretch, hardening, .. } = plasticity;
                [hardening, 1.0 - critical_compression, 1.0 + critical_stretch, low, high]
            },
        );
        let [hardening, lowest, highest, least_ratio, greatest_ratio] = yielding.map(R::of);
        let neo_hookean = R::of(f64::from(u8::from(material.law == Law::NeoHookean)));
        let (mu, lambda) = (R::of(material.mu()), R::of(material.lambda()));
        Self([mu, lambda, hardening, lowest, highest, least_ratio, greatest_ratio, neo_hookean])
    }

    /// Whether no stretch makes it yield.
    pub(crate) fn is_elastic(&self) -> bool {
        self.0[4] >= R::of(R::LARGEST)
    }
}

impl<P: Pack> Moduli<P> {
    /// Moduli of particles of the objects `of`, each stiffer by its factor.
    #[inline(always)]
    pub(crate) fn gather(table: &[MaterialConstants<P::Number>], of: &[u16; LANES], factor: P) -> Self {
        Self {
            mu: coefficient::<P>(table, of, 0) * factor,
            lambda: coefficient::<P>(table, of, 1) * factor,
            hardening: coefficient(table, of, 2),
            lowest: coefficient(table, of, 3),
            highest: coefficient(table, of, 4),
            least_plastic_ratio: coefficient(table, of, 5),
            greatest_plastic_ratio: coefficient(table, of, 6),
            neo_hookean: coefficient(table, of, 7),
        }
    }
}

/// Coefficient `k` of the material of each lane.
#[inline(always)]
fn coefficient<P: Pack>(table: &[MaterialConstants<P::Number>], of: &[u16; LANES], k: usize) -> P {
    if table.len() == 1 {
        return P::splat(table[0].0[k]);
    }
    let mut lanes = [P::Number::default(); LANES];
    for lane in 0..LANES {
        lanes[lane] = table[usize::from(of[lane])].0[k];
    }
    P::load(&lanes)
}

/// Elastic part after plastic return.
#[derive(Clone, Copy)]
pub(crate) struct Returned<P> {
    /// Singular values within the yield limits.
    pub(crate) sigma: [P; 3],
    pub(crate) plastic_ratio: P,
    /// 1 where a singular value was out of the limits, 0 elsewhere.
    pub(crate) yielded: P,
    /// 1 where J_P was held at an end of its range, 0 elsewhere.
    pub(crate) clamped: P,
    /// 1 where det F < 0 or J_P <= 0 before it was held, 0 elsewhere.
    pub(crate) inverted: P,
}

/// Elastic predictor to yield surface: what is beyond goes into J_P (eq. 11, 12).
#[inline(always)]
pub(crate) fn plastic_return<P: Pack>(sigma: &[P; 3], plastic_ratio: P, m: &Moduli<P>) -> Returned<P> {
    let (zero, one) = (P::zero(), P::one());
    let held = [
        sigma[0].max(m.lowest).min(m.highest),
        sigma[1].max(m.lowest).min(m.highest),
        sigma[2].max(m.lowest).min(m.highest),
    ];
    let beyond = (sigma[0] - held[0]).abs();
    let beyond = beyond + (sigma[1] - held[1]).abs() + (sigma[2] - held[2]).abs();
    let yielded = zero.if_less(beyond, one, zero);

    // What is beyond the limits goes from F_E into J_P.
    let ratio = sigma[0] * sigma[1] * sigma[2] / (held[0] * held[1] * held[2]);
    let moved = zero.if_less(beyond, plastic_ratio * ratio, plastic_ratio);
    let plastic_ratio = moved.max(m.least_plastic_ratio).min(m.greatest_plastic_ratio);
    let clamped = zero.if_less((moved - plastic_ratio).abs(), one, zero);

    // The signed decomposition leaves the sign of det F on the last singular value.
    let flat = zero.if_less(moved, zero, one);
    let inverted = sigma[2].if_less(zero, one, flat);
    Returned { sigma: held, plastic_ratio, yielded, clamped, inverted }
}

/// exp(xi (1 - J_P)).
#[inline(always)]
pub(crate) fn hardened<P: Pack>(plastic_ratio: P, m: &Moduli<P>) -> P {
    exp(m.hardening * (P::one() - plastic_ratio))
}

/// Kirchhoff stress along the columns of U: tau = U diag(t) U^T, t_i = sigma_i dpsi/dsigma_i.
#[inline(always)]
pub(crate) fn principal_stress<P: Pack>(sigma: &[P; 3], hardening: P, m: &Moduli<P>) -> [P; 3] {
    let one = P::one();
    let (mu, lambda) = (m.mu * hardening, m.lambda * hardening);
    let two_mu = mu + mu;
    let j = sigma[0] * sigma[1] * sigma[2];
    let pressure = lambda * (j - one) * j;
    let mut t = [pressure; 3];
    for i in 0..3 {
        t[i] = two_mu * (sigma[i] - one) * sigma[i] + pressure;
    }

    if m.neo_hookean.any() {
        let (log, slope) = logarithm(j);
        let volumetric = (lambda * log - mu) * slope;
        for i in 0..3 {
            let other = mu * sigma[i] * sigma[i] + volumetric;
            t[i] = P::zero().if_less(m.neo_hookean, other, t[i]);
        }
    }

    t
}

/// Elastic energy per volume at rest (J/m³).
#[inline(always)]
pub(crate) fn energy_density<P: Pack>(sigma: &[P; 3], hardening: P, m: &Moduli<P>) -> P {
    let (one, half) = (P::one(), P::of(0.5));
    let (mu, lambda) = (m.mu * hardening, m.lambda * hardening);
    let j = sigma[0] * sigma[1] * sigma[2];
    let e = [sigma[0] - one, sigma[1] - one, sigma[2] - one];
    let squares = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
    let volume = j - one;
    let corotated = mu * squares + half * lambda * volume * volume;
    if !m.neo_hookean.any() {
        return corotated;
    }

    let (log, _) = logarithm(j);
    let norm2 = sigma[0] * sigma[0] + sigma[1] * sigma[1] + sigma[2] * sigma[2];
    let shear = half * mu * (norm2 - P::of(3.0)) - mu * log;
    let neo_hookean = shear + half * lambda * log * log;
    P::zero().if_less(m.neo_hookean, neo_hookean, corotated)
}

/// ln J and J d(ln J)/dJ; below [`Law::MIN_J`] the tangent there and its J-fold slope.
#[inline(always)]
fn logarithm<P: Pack>(j: P) -> (P, P) {
    let (mut log, mut slope) = (j.store(), [P::Number::of(1.0); LANES]);
    for lane in 0..LANES {
        let j = log[lane].to_f64();
        let least = Law::MIN_J;
        if j < least {
            log[lane] = P::Number::of(libm::log(least) + (j - least) / least);
            slope[lane] = P::Number::of(j / least);
        } else {
            log[lane] = P::Number::of(libm::log(j));
        }
    }

    (P::load(&log), P::load(&slope))
}

/// Upper bounds of the stiffnesses (Pa) that bound the time step (docs/laws/snow.md), from the
/// square of the largest singular value and J: rho c_p² of the elastic wave, and that of a particle
/// alone, in which all directions act at once. Each part is the greater of its form in compression
/// and of the tangent of the Kirchhoff stress, d tau / d ln s, which is more in tension.
#[inline(always)]
pub(crate) fn stiffness<P: Pack>(largest2: P, j: P, hardening: P, m: &Moduli<P>) -> [P; 2] {
    let (one, three) = (P::one(), P::of(3.0));
    let (mu, lambda) = (m.mu * hardening, m.lambda * hardening);

    // d tau / d ln s = 2 mu (2 s² - s) + lambda J (2 J - 1).
    let shear = (mu + mu) * largest2.max(largest2 + largest2 - largest2.sqrt());
    let volumetric = lambda * (j * j).max(j * (j + j - one));
    let corotated = [shear + volumetric, shear + three * volumetric];
    if !m.neo_hookean.any() {
        return corotated;
    }

    let (log, slope) = logarithm(j);

    // s² psi'' = mu (s² + 1) + lambda (1 - ln J), d tau / d ln s = 2 mu s² + lambda; where the
    // logarithm is its tangent, no more.
    let shear = mu * (largest2 + largest2.max(slope.max(one)));
    let volumetric = lambda * ((one - log).max(one) * (slope * slope));
    let neo_hookean = [shear + volumetric, shear + three * volumetric];
    let zero = P::zero();
    [
        zero.if_less(m.neo_hookean, neo_hookean[0], corotated[0]),
        zero.if_less(m.neo_hookean, neo_hookean[1], corotated[1]),
    ]
}

/// The part of a law that depends on J, and what multiplies the singular values.
#[derive(Clone, Copy)]
pub(crate) struct Volumetric<P> {
    /// p_i = base sigma_i - two_rest / 2 + g sigma_j sigma_k.
    pub(crate) base: P,
    pub(crate) two_rest: P,
    pub(crate) g: P,
    /// dg/dJ.
    pub(crate) slope: P,
}

/// Coefficients of dpsi/dsigma_i at volume ratio J.
#[inline(always)]
pub(crate) fn volumetric<P: Pack>(j: P, hardening: P, m: &Moduli<P>) -> Volumetric<P> {
    let (zero, one) = (P::zero(), P::one());
    let (mu, lambda) = (m.mu * hardening, m.lambda * hardening);
    let two_mu = mu + mu;
    let corotated =
        Volumetric { base: two_mu, two_rest: two_mu + two_mu, g: lambda * (j - one), slope: lambda };
    if !m.neo_hookean.any() {
        return corotated;
    }

    // ln J' = 1 / max(J, least): the tangent goes on below.
    let (log, _) = logarithm(j);
    let least = P::of(Law::MIN_J);
    let inverse = one / j.max(least);
    let g = (lambda * log - mu) * inverse;
    let bend = j.if_less(least, zero, g * inverse);
    let slope = lambda * inverse * inverse - bend;
    let pick = m.neo_hookean;
    Volumetric {
        base: zero.if_less(pick, mu, corotated.base),
        two_rest: zero.if_less(pick, zero, corotated.two_rest),
        g: zero.if_less(pick, g, corotated.g),
        slope: zero.if_less(pick, slope, corotated.slope),
    }
}
