//! What acts on each particle by itself, beside gravity: the medium, by its drag and by the air frozen at a state, and given forces.
//!
//! A particle feels f - (c I + B) (v - w): f a force that is constant over the step, c the drag, w the velocity of the medium, and B
//! a third of D of each of its triangles (`laws/air.rs`), symmetric and never negative.

use crate::{
    cloth::layout::Parameters,
    linalg::load_six,
    math::{LANES, Mat3, Pack, Real, Sixteen, Vec3, array::dot, three},
};

/// Of all particles, sixteen at a time.
#[derive(Clone, Debug, PartialEq, Default)]
pub(crate) struct External<R: Real> {
    /// c (N s/m).
    drag: R,
    /// w (m/s).
    pub(super) wind: Vec3<R>,
    /// Factors of the air, where it acts on triangles (kg/m³).
    pub(super) factors: Option<[R; 3]>,
    /// B (N s/m): xx, yy, zz, xy, xz, yz; empty without air.
    pub(super) air: Vec<[[R; LANES]; 6]>,
    /// f (N); empty where there are none.
    pub(super) forces: Vec<Sixteen<R>>,
    /// Sum of the lengths of all f (N).
    pub(crate) force_sum: f64,
}

impl<R: Real> External<R> {
    /// Takes over what the medium is, and its velocity (m/s).
    pub(super) fn refresh(&mut self, parameters: &Parameters, wind: Vec3<R>) {
        (self.drag, self.wind) = (R::of(parameters.drag), wind);
        self.factors = parameters.air.map(|air| air.factors());
    }

    /// Whether nothing acts on any particle.
    pub(crate) fn is_still(&self) -> bool {
        self.drag == R::zero() && !self.has_air() && self.forces.is_empty()
    }

    /// Whether there is a B.
    pub(crate) fn has_air(&self) -> bool {
        !self.air.is_empty()
    }

    /// What acts on sixteen particles.
    #[inline(always)]
    #[allow(clippy::manual_map, reason = "a closure is not compiled for the kernel's instructions")]
    pub(crate) fn at<P: Pack<Number = R>>(&self, place: usize) -> Medium<P> {
        let air = match self.air.get(place) {
            Some(air) => Some(load_six(air)),
            None => None,
        };
        let force = match self.forces.get(place) {
            Some(force) => force.load(),
            None => [P::zero(); 3],
        };
        Medium { drag: P::splat(self.drag), wind: three!(|c| P::splat(self.wind[c])), air, force }
    }

    /// f - (c I + B) (v - w) of a particle (N), at a velocity (m/s).
    pub(crate) fn force_on(&self, particle: usize, v: Vec3<f64>) -> Vec3<f64> {
        let off = self.wind.map(R::to_f64) - v;
        let group = self.forces.get(particle / LANES);
        let given = group.map_or(Vec3::zeros(), |group| group.get(particle % LANES).map(R::to_f64));
        let by_air = self.air_of(particle).map_or(Vec3::zeros(), |air| air.map(R::to_f64) * off);
        given + off * self.drag.to_f64() + by_air
    }

    /// B (N s/m) of a particle, where there is air.
    pub(crate) fn air_of(&self, particle: usize) -> Option<Mat3<R>> {
        let [xx, yy, zz, xy, xz, yz] = self.air.get(particle / LANES)?.map(|lanes| lanes[particle % LANES]);
        Some(symmetric([xx, yy, zz, xy, xz, yz]))
    }

    /// m + h c (kg): what the matrix of an implicit step has for a particle by itself, beside h B.
    pub(crate) fn mass(&self, m: R, h: R) -> R {
        m + h * self.drag
    }

    /// h c (kg) of so many particles together.
    pub(crate) fn drag_of(&self, count: f64, h: f64) -> f64 {
        h * self.drag.to_f64() * count
    }
}

/// A symmetric matrix from its entries: xx, yy, zz, xy, xz, yz.
pub(crate) fn symmetric<R: Real>([xx, yy, zz, xy, xz, yz]: [R; 6]) -> Mat3<R> {
    Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// What acts on sixteen particles.
#[derive(Clone, Copy)]
pub(crate) struct Medium<P> {
    drag: P,
    wind: [P; 3],
    /// B (N s/m): xx, yy, zz, xy, xz, yz; none without air.
    pub(crate) air: Option<[P; 6]>,
    force: [P; 3],
}

impl<P: Pack> Medium<P> {
    #[inline(always)]
    #[allow(clippy::manual_map, reason = "a closure is not compiled for the kernel's instructions")]
    pub(crate) fn widen(&self) -> Medium<P::Wide> {
        let air = match self.air {
            Some([a, b, c, d, e, f]) => {
                Some([a.widen(), b.widen(), c.widen(), d.widen(), e.widen(), f.widen()])
            }
            None => None,
        };
        let [wind, force] = [P::widen3(self.wind), P::widen3(self.force)];
        Medium { drag: self.drag.widen(), wind, air, force }
    }

    /// The same without the drag.
    #[inline(always)]
    pub(crate) fn without_drag(&self) -> Self {
        Self { drag: P::zero(), ..*self }
    }

    /// The same with a drag on free particles alone, whose inverse masses are above 0.
    #[inline(always)]
    pub(crate) fn on_free(&self, inv_m: P) -> Self {
        Self { drag: self.drag.where_positive(inv_m), ..*self }
    }

    /// f - (c I + B) (v - w).
    #[inline(always)]
    pub(crate) fn force(&self, v: [P; 3]) -> [P; 3] {
        let off = three!(|c| v[c] - self.wind[c]);
        let slowing = self.slowing(off);
        three!(|c| (self.force[c] - slowing[c]) - off[c] * self.drag)
    }

    /// B v: what the air takes of a velocity (N).
    #[inline(always)]
    fn slowing(&self, [x, y, z]: [P; 3]) -> [P; 3] {
        let Some([xx, yy, zz, xy, xz, yz]) = self.air else { return [P::zero(); 3] };
        [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z]
    }

    /// h v.(c I + B) v and h v.(f + (c I + B) w): what the medium takes at a velocity, and what it and given forces give.
    #[inline(always)]
    pub(crate) fn powers(&self, v: [P; 3], h: P) -> [P; 2] {
        let [of_velocity, of_wind] = [self.slowing(v), self.slowing(self.wind)];
        let (push, drag) = (three!(|c| self.force[c] + of_wind[c]), h * self.drag);
        [drag * dot(v, v) + h * dot(v, of_velocity), drag * dot(self.wind, v) + h * dot(v, push)]
    }

    /// h v.((c I + B) (v / 2 - w) - f): h times the potential of the force.
    #[inline(always)]
    pub(crate) fn potential(&self, v: [P; 3], h: P) -> P {
        let (half, [taken, given]) = (P::of(0.5), self.without_drag().powers(v, P::one()));
        h * self.drag * (half * dot(v, v) - dot(v, self.wind)) + h * (half * taken - given)
    }

    /// Adds (m + h c) I + h B to the entries of symmetric matrices: xx, yy, zz, xy, xz, yz.
    #[inline(always)]
    pub(crate) fn add_to(&self, matrix: &mut [P; 6], m: P, h: P) {
        let own = m + h * self.drag;
        for c in 0..3 {
            matrix[c] += own;
        }
        if let Some(air) = self.air {
            for c in 0..6 {
                matrix[c] += air[c] * h;
            }
        }
    }

    /// A sum with ((m + h c) I + h B) v.
    #[inline(always)]
    pub(crate) fn add_product(&self, sum: [P; 3], v: [P; 3], m: P, h: P::Number) -> [P; 3] {
        let own = m + self.drag * h;
        let sum = three!(|c| sum[c] + v[c] * own);
        if self.air.is_none() {
            return sum;
        }
        let slowing = self.slowing(v);
        three!(|c| sum[c] + slowing[c] * h)
    }
}
