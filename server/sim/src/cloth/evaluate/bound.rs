//! The longest explicit step of a cloth, certified: from the stiffness and the damping of what acts on each particle, at
//! the state as it is. No eigenvalue of the whole is needed.
//!
//! With Y = h² K and C' = h C, stiffness and damping of all particles per mass, a step of symplectic Euler is
//! x₊ - 2 x + x₋ + C' (x - x₋) + Y x = 0. A mode n of it obeys a scalar equation with n.Y n and n.C' n, whose roots lie within
//! the unit circle where n.(Y + 2 C') n <= 4 n.n. One of velocity Verlet is the same with the mass P = (I - C' / 4)⁻¹:
//! P (x₊ - 2 x + x₋) + C' (x - x₋) + Y x = 0, stable for Y + 2 C' <= 4 P. Since 4 / (1 - c / 4) - 2 c is no less than 4 - c, nor
//! than 8 sqrt(2) - 8, from 0 to 4, it is so where Y + C' <= 4, and where Y <= 8 sqrt(2) - 8 and C' <= 4. With the end velocity
//! predicted a mode of one direction is stable for Y <= 4 - 2 C' + C'², C' <= 2: where Y + 2 C' <= 4, and where Y <= 3 and
//! C' <= 2. That these hold where Y and C' have no modes in common too was tried, not proven (docs/laws/integrators.md).
//!
//! Each is an inequality of sums over particles i, which holds where it does for what acts at each:
//! (n.(a - b))² <= 2 (n.a)² + 2 (n.b)² gives w² <= (2 lambda_max(K_i) + e_i) / m_i and
//! c <= (2 lambda_max(C_i) + d_i + drag + 2 lambda_max(B_i)) / m_i. K_i and C_i are the sums of k (u uᵀ + g (I - u uᵀ)), g = max(0, 1 - l0/l), and of
//! nu u uᵀ over its springs; e_i and d_i what elements add: at rest, and with a membrane what the state adds to that. The
//! inverse of the longest step is the greatest over particles for one of the two regions, the lesser of both: a particle in
//! one and another in the other prove nothing.
//!
//! Explicit Euler gives z² - (2 - h c) z + 1 - h c + h² w² = 0: stable for h w² <= c and h c <= 2. Springs along
//! themselves meet the first for h <= nu / k; across themselves, under tension, only the drag of the medium damps.

use crate::{
    cloth::{
        laws::Spring,
        layout::{Model, Parameters},
        settings::Integrator,
    },
    math::{LANES, Pack, Real},
    report::BoundKind,
};

/// Numbers of the laws of sixteen springs that bound a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SpringBounds<R> {
    /// Stiffness along the spring (N/m); 0 where its own damping makes up for it.
    along: [R; LANES],
    /// Stiffness across it (N/m), for g = 1.
    across: [R; LANES],
    /// Damping (N s/m).
    damping: [R; LANES],
}

/// How far the ends of a spring move against each other in a certified step, at most, in rest lengths. The bound on
/// stiffness holds for small motions: where springs turn, or are pressed through their own middle, within a step, energy
/// grows below it.
pub(crate) const MOVES: f64 = 0.25;

/// Where steps of an integrator are stable, h times stiffness w² and damping c at each particle: a line and a corner, one of
/// which is enough for all particles together.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
struct Region {
    /// s of h² w² + 2 s h c <= 4.
    slope: f64,
    /// Or h² w² up to the first, and h c up to the second.
    corner: Option<[f64; 2]>,
}

impl Region {
    fn of(integrator: Integrator) -> Self {
        match integrator {
            Integrator::VelocityVerlet => {
                Self { slope: 0.5, corner: Some([8.0 * std::f64::consts::SQRT_2 - 8.0, 4.0]) }
            }
            Integrator::VelocityVerletPredicted => Self { slope: 1.0, corner: Some([3.0, 2.0]) },
            _ => Self { slope: 1.0, corner: None },
        }
    }
}

/// What bounds the steps of an explicit integrator, from the parameters.
#[derive(Clone, Debug, PartialEq, Default)]
pub(crate) struct Bounds<R: Real> {
    /// For each pattern of laws of the model's springs.
    pub(crate) springs: Vec<SpringBounds<R>>,
    /// What elements add to stiffness (N/m) and damping (N s/m) of each particle, at rest; empty without elements. What they
    /// add beyond that is evaluated with the forces, where it changes with the state.
    shares: Vec<[f64; 2]>,
    /// Drag of the medium (N s/m).
    drag: f64,
    /// Of explicit Euler: the largest k / nu of all laws whose springs are damped enough (1/s).
    own_rate: Option<f64>,
    /// Of the others.
    region: Region,
}

/// The particle at which steps are bounded.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct Bound {
    /// 1 / the longest step (1/s): 0 where nothing acts on any free particle or none moves, infinite where no step is stable.
    pub(crate) rate: f64,
    /// In the model's numbering.
    pub(crate) particle: u32,
    /// Whether the air makes it more than twice what it would be.
    pub(crate) by_air: bool,
}

impl Bound {
    /// The greater of two: of equal ones the first.
    pub(crate) fn or(self, other: Self) -> Self {
        if other.rate > self.rate { other } else { self }
    }

    /// The lesser of two: of equal ones the first.
    pub(crate) fn either(self, other: Self) -> Self {
        if other.rate < self.rate { other } else { self }
    }
}

impl<R: Real> Bounds<R> {
    /// Whether stiffness along what damps bounds nothing beside [`Self::own_rate`], for its own damping makes up for it: of
    /// explicit Euler.
    pub(super) fn is_damped(&self) -> bool {
        self.own_rate.is_some()
    }

    /// Takes over parameters.
    pub(crate) fn refresh(&mut self, model: &Model<R>, parameters: &Parameters, integrator: Integrator) {
        self.drag = parameters.drag;
        self.region = Region::of(integrator);
        self.own_rate = (integrator == Integrator::ExplicitEuler).then(|| own_rate(parameters)).flatten();
        let is_damped = self.is_damped();
        let of_law = |law: u16| parameters.laws[law as usize].law;
        self.springs.clear();
        self.springs.extend(model.springs.patterns.iter().map(|laws| SpringBounds {
            along: laws.map(|law| if is_damped { R::zero() } else { R::of(of_law(law).stiffness) }),
            across: laws.map(|law| R::of(of_law(law).stiffness)),
            damping: laws.map(|law| R::of(of_law(law).damping)),
        }));

        self.shares.clear();
        if model.elements.is_empty() {
            return;
        }
        self.shares.resize(model.m.len(), [0.0; 2]);
        let mut of_list = vec![0.0; model.count];
        for (elements, law) in model.elements.iter().zip(&parameters.elements) {
            of_list.fill(0.0);
            elements.add_shares(&mut of_list);
            for ([stiffness, damping], share) in self.shares.iter_mut().zip(&of_list) {
                *stiffness += if is_damped { 0.0 } else { law.stiffness * share };
                *damping += law.damping * share;
            }
        }
    }

    /// Inverse of the longest step (1/s) at sixteen free particles from `first` on, of these masses (kg), from the
    /// entries of K and C, for each of two regions: a step is stable that is no longer than one of them allows at all
    /// particles.
    #[inline(always)]
    pub(crate) fn rates<W: Pack<Number = f64>>(
        &self,
        first: usize,
        [k, c]: [[W; 6]; 2],
        [m, inv_m]: [W; 2],
        kind: BoundKind,
        air: Option<[W; 6]>,
    ) -> [W; 2] {
        let two = W::of(2.0);
        let (mut stiffness, mut damping) = (two * largest_eigenvalue(k), two * largest_eigenvalue(c));
        damping += W::of(self.drag);
        if let Some(air) = air {
            damping += two * largest_eigenvalue(air);
        }
        if let Some(shares) = self.shares.get(first..first + LANES) {
            stiffness += W::load(&std::array::from_fn(|lane| shares[lane][0]));
            damping += W::load(&std::array::from_fn(|lane| shares[lane][1]));
        }

        if kind == BoundKind::Damping {
            // Without drag the inverse of 0 is to be infinite, where there is stiffness.
            let inverse_drag = W::of(if self.drag > 0.0 { 1.0 / self.drag } else { f64::MAX });
            let growing = (stiffness * inverse_drag).where_positive(stiffness);
            let own = W::of(self.own_rate.unwrap_or(0.0));
            let rate = growing.max(damping * inv_m * W::of(0.5)).max(own).where_positive(inv_m);
            return [rate, rate];
        }
        let part = damping * W::of(self.region.slope);
        let root = (part * part + W::of(4.0) * stiffness * m).sqrt();
        let line = ((part + root) * inv_m * W::of(0.25)).where_positive(inv_m);
        let Some([most_stiffness, most_damping]) = self.region.corner else { return [line, line] };
        let stiff = (stiffness * inv_m * W::of(1.0 / most_stiffness)).sqrt();
        [line, stiff.max(damping * inv_m * W::of(1.0 / most_damping)).where_positive(inv_m)]
    }
}

/// The largest k / nu of all laws; none where a law has stiffness without damping.
fn own_rate(parameters: &Parameters) -> Option<f64> {
    let laws = parameters.laws.iter().map(|entry| entry.law).chain(parameters.elements.iter().copied());
    let mut stiff = laws.filter(|law| law.stiffness > 0.0);
    stiff.try_fold(0.0, |rate, law| (law.damping > 0.0).then(|| f64::max(rate, law.stiffness / law.damping)))
}

/// Adds springs to the entries of K and C of their rows: xx, yy, zz, xy, xz, yz. A lane without a spring counts for
/// nothing; nor does, for the moment, a spring at rest length 0 whose ends coincide.
#[inline(always)]
pub(crate) fn add_spring<P: Pack>(
    [k, c]: &mut [[P; 6]; 2],
    spring: &Spring<P>,
    bounds: &SpringBounds<P::Number>,
) {
    let across = P::load(&bounds.across) * spring.transverse();
    let (along, damping) = (P::load(&bounds.along) - across, P::load(&bounds.damping));
    let [x, y, z] = spring.direction();
    let squares = [x * x, y * y, z * z, x * y, x * z, y * z];
    for entry in 0..6 {
        k[entry] += along * squares[entry];
        c[entry] += damping * squares[entry];
    }
    for entry in 0..3 {
        k[entry] += across;
    }
}

/// The largest eigenvalue of symmetric matrices that have no negative one, by Newton's method from above: never less
/// than it but for rounding, and more by 1 % at most.
#[inline(always)]
fn largest_eigenvalue<W: Pack<Number = f64>>([xx, yy, zz, xy, xz, yz]: [W; 6]) -> W {
    let [a, b, c] = [xy.abs(), xz.abs(), yz.abs()];
    let trace = xx + yy + zz;
    let mut value = (xx + a + b).max(yy + a + c).max(zz + b + c).min(trace);
    let minors = xx * yy + xx * zz + yy * zz - xy * xy - xz * xz - yz * yz;
    let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    for _ in 0..8 {
        let polynomial = ((value - trace) * value + minors) * value - determinant;
        let slope = (W::of(3.0) * value - W::of(2.0) * trace) * value + minors;
        // At a double eigenvalue both vanish: what is left of the slope must be more than its rounding.
        let change =
            (polynomial * slope.inverse_or_zero()).where_positive(slope - W::of(1e-6) * value * value);
        value -= change.max(W::zero());
    }
    value
}

/// The greatest rate of a block in each lane, and the group of sixteen in which it was.
#[derive(Clone, Copy)]
pub(crate) struct Fastest<W> {
    rate: W,
    group: W,
    /// What the rate would be without air.
    in_vacuum: W,
}

impl<W: Pack<Number = f64>> Fastest<W> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        Self { rate: W::zero(), group: W::zero(), in_vacuum: W::zero() }
    }

    /// Looks at the rates of a group, and at what they would be without air.
    #[inline(always)]
    pub(crate) fn look(&mut self, group: usize, rate: W, in_vacuum: W) {
        self.group = self.rate.if_less(rate, W::of(group as f64), self.group);
        self.in_vacuum = self.rate.if_less(rate, in_vacuum, self.in_vacuum);
        self.rate = self.rate.max(rate);
    }

    /// The bound of a block whose first row is given: of equal ones that of the first row.
    #[inline(always)]
    pub(crate) fn bound(self, first: usize) -> Bound {
        let (rates, groups, in_vacuum) = (self.rate.store(), self.group.store(), self.in_vacuum.store());
        (0..LANES).fold(Bound { particle: first as u32, ..Bound::default() }, |best, lane| {
            let particle = (first + groups[lane] as usize * LANES + lane) as u32;
            let is_first = rates[lane] == best.rate && particle < best.particle;
            if rates[lane] > best.rate || is_first {
                Bound { rate: rates[lane], particle, by_air: rates[lane] > 2.0 * in_vacuum[lane] }
            } else {
                best
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::largest_eigenvalue;
    use crate::math::{Pack, Portable};
    use nalgebra::{Matrix3, SymmetricEigen};

    #[test]
    fn the_largest_eigenvalue_is_bounded_from_above() {
        // Multiples of an irrational number, as numbers from 0 to 1.
        let mut drawn = 0.0;
        let mut draw = || {
            drawn += 0.754_877_666_246_692_7;
            drawn % 1.0
        };
        for case in 0..20_000 {
            let mut k = Matrix3::<f64>::zeros();
            // Of one direction, of two that are equal, and of many.
            for _ in 0..=case % 7 {
                let mut u = [0, 1, 2].map(|_| draw() - 0.5);
                if case % 3 == 0 {
                    u[case as usize % 3] = 0.0;
                }
                let u = nalgebra::Vector3::from(u);
                k += u * u.transpose() * 10f64.powi(case % 9);
            }
            if case % 5 == 0 {
                k += Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0, 1.0, 0.0));
            }
            let entries = [k.m11, k.m22, k.m33, k.m12, k.m13, k.m23].map(Portable::splat);
            let found = largest_eigenvalue(entries).store()[0];
            let exact = SymmetricEigen::new(k).eigenvalues.max();
            let ratio = found / exact;
            assert!((1.0 - 1e-9..1.01).contains(&ratio), "case {case}: {found} for {exact}");
        }
    }
}
