//! The force of moving air on a triangle, as on a flat plate (docs/laws/medium.md):
//!
//!   f = -rho A / 2 ((C_n |u.n| + C_l |u_t|) (u.n) n + C_t |u_t| u_t)
//!
//! u is the mean velocity of its corners less that of the air, u_t what of it is along the triangle. Each corner feels
//! -(1/3) D (v_i - w), D = rho A / 2 ((C_n |u.n| + C_l |u_t|) n nᵀ + C_t |u_t| (I - n nᵀ)): all together f, and with D frozen a
//! drag that is symmetric and never negative.

use serde::{Deserialize, Serialize};

use crate::math::{
    Pack, Real,
    array::{cross, dot},
    three,
};

/// The air around a body, and how its triangles feel it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Air {
    /// Density rho (kg/m³).
    pub density: f64,
    /// C_n: of the velocity across a triangle.
    pub normal: f64,
    /// C_l: of the velocity across a triangle that slides through the air.
    pub lift: f64,
    /// C_t: of the velocity along a triangle.
    pub tangential: f64,
}

impl Default for Air {
    /// Air at 20 °C, and a flat plate: both faces of it pushed, and a thin boundary layer.
    fn default() -> Self {
        Self { density: 1.2, normal: 1.2, lift: 2.0, tangential: 0.02 }
    }
}

impl Air {
    /// Densities that are allowed (kg/m³).
    pub const DENSITY: [f64; 2] = [0.0, 1e5];
    /// C_n, C_l and C_t that are allowed.
    pub const COEFFICIENT: [f64; 2] = [0.0, 100.0];

    /// Its numbers with their names.
    pub fn numbers(&self) -> [(&'static str, f64); 4] {
        [
            ("density", self.density),
            ("normal", self.normal),
            ("lift", self.lift),
            ("tangential", self.tangential),
        ]
    }

    /// Numbers that are allowed for a name of [`numbers`](Self::numbers), both ends included.
    pub fn allowed(name: &str) -> [f64; 2] {
        if name == "density" { Self::DENSITY } else { Self::COEFFICIENT }
    }

    /// What stands before twice the area of a triangle in a third of D: rho / 12 times C_n, C_l and C_t (kg/m³).
    pub(crate) fn factors<R: Real>(&self) -> [R; 3] {
        [self.normal, self.lift, self.tangential].map(|coefficient| R::of(self.density / 12.0 * coefficient))
    }
}

/// A third of D (N s/m) of sixteen triangles, by the places (m) and the velocities (m/s) of their corners, the velocity of the
/// air and the factors of [`Air::factors`]: xx, yy, zz, xy, xz, yz. Nothing for a triangle without an area.
#[inline(always)]
pub(crate) fn third<P: Pack>(
    [normal, lift, tangential]: [P::Number; 3],
    wind: [P::Number; 3],
    [a, b, c]: [[P; 3]; 3],
    [va, vb, vc]: [[P; 3]; 3],
) -> [P; 6] {
    let across = cross(three!(|k| b[k] - a[k]), three!(|k| c[k] - a[k]));
    let area = dot(across, across).sqrt();
    let inverse = area.inverse_or_zero();
    let n = three!(|k| across[k] * inverse);
    let third = P::Number::of(1.0 / 3.0);
    let u = three!(|k| (va[k] + vb[k] + vc[k]) * third - P::splat(wind[k]));
    let through = dot(u, n);
    let along = three!(|k| u[k] - through * n[k]);
    let along = dot(along, along).sqrt();

    let slide = area * along * tangential;
    let push = area * (through.abs() * normal + along * lift) - slide;
    let pushed = three!(|k| push * n[k]);
    [
        slide + pushed[0] * n[0],
        slide + pushed[1] * n[1],
        slide + pushed[2] * n[2],
        pushed[0] * n[1],
        pushed[0] * n[2],
        pushed[1] * n[2],
    ]
}
