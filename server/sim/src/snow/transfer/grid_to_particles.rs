//! Grid to particles: velocity, affine velocity and velocity gradient from the nodes around.
//!
//! Reads the tiles of a stencil; writes lanes of what sixteen
//! particles gather (Stomakhin et al. 2013, step 8; Jiang et al. 2015, eq. 8). Sixteen particles in
//! the sorted order may belong to several blocks, so that lanes are full where snow is thin.

use std::marker::PhantomData;

use super::{
    scheme::Scheme,
    stencil::{Stencil, TILE},
    weights::{AxisWeights, axis_weights},
};
use crate::{
    math::{LANES, Pack, Real, WithSimd},
    snow::{
        grid::{SIDE, TILE_ROW},
        particles::{Lanes, Motion},
        settings::{Advection, SnowSettings},
    },
};

/// What sixteen particles brought from the grid.
#[derive(Clone, Copy)]
pub(crate) struct Arrival<R> {
    /// New velocity (m/s).
    pub(crate) v: [Lanes<R>; 3],
    /// Velocity that moves the position (m/s).
    pub(crate) drift: [Lanes<R>; 3],
    /// C to be kept (1/s), by columns.
    pub(crate) c: [[Lanes<R>; 3]; 3],
    /// Velocity gradient (1/s), by columns.
    pub(crate) gradient: [[Lanes<R>; 3]; 3],
    /// Mass on the grid around the particle over h³ (kg/m³).
    pub(crate) density: Lanes<R>,
    /// Coordinates of the block that it comes from.
    pub(crate) block: [Lanes<R>; 3],
}

impl<R: Real> Arrival<R> {
    pub(crate) fn new() -> Self {
        let zero = [R::zero(); LANES];
        Self {
            v: [zero; 3],
            drift: [zero; 3],
            c: [[zero; 3]; 3],
            gradient: [[zero; 3]; 3],
            density: zero,
            block: [zero; 3],
        }
    }
}

/// What sixteen particles gather; the fourth lane of a velocity is the mass density, times h³.
#[derive(Clone, Copy)]
pub(crate) struct Interpolated<P> {
    /// sum w v, and sum w m.
    pub(crate) v: [P; 4],
    /// sum w v (index of the node) along each axis.
    pub(crate) moments: [[P; 4]; 3],
    /// sum v (slope times h) along each axis.
    pub(crate) slopes: [[P; 4]; 3],
    /// sum w (change of v).
    pub(crate) change: [P; 4],
}

/// Weights of sixteen particles, to be read one at a time.
struct Weights<R> {
    /// Weight and slope along x and along y.
    x: [[[R; LANES]; 4]; 2],
    y: [[[R; LANES]; 4]; 2],
    /// Weight, index times weight, slope along z: a quad per particle.
    z: [[[R; 4]; LANES]; 3],
}

/// Index of each node along an axis times its weight.
#[inline(always)]
fn moments<P: Pack>(w: &[P; 4]) -> [P; 4] {
    [P::zero(), w[1], w[2] + w[2], P::of(3.0) * w[3]]
}

impl<R: Real> Weights<R> {
    #[inline(always)]
    fn of<P: Pack<Number = R>, S: Scheme, const N: usize>(axes: &[AxisWeights<P>; 3]) -> Self {
        let (lane, quads) = ([[[R::zero(); LANES]; 4]; 2], [[R::zero(); 4]; LANES]);
        let mut out = Self { x: lane, y: lane, z: [quads; 3] };
        for i in 0..N {
            (out.x[0][i], out.y[0][i]) = (axes[0].w[i].store(), axes[1].w[i].store());
            if S::SLOPES {
                (out.x[1][i], out.y[1][i]) = (axes[0].d[i].store(), axes[1].d[i].store());
            }
        }

        out.z[0] = P::rows(axes[2].w);
        if S::AFFINE {
            out.z[1] = P::rows(moments(&axes[2].w));
        }

        if S::SLOPES {
            out.z[2] = P::rows(axes[2].d);
        }

        out
    }
}

/// Sums of one particle, a quad each.
struct Sums<R> {
    v: [[R; 4]; LANES],
    moments: [[[R; 4]; LANES]; 3],
    slopes: [[[R; 4]; LANES]; 3],
    change: [[R; 4]; LANES],
}

/// Gathers for the particles at positions `first..first + count` of the order, and notes their blocks.
#[inline(always)]
fn gather<P: Pack, S: Scheme, const N: usize>(
    stencil: &mut Stencil<'_, P::Number>,
    [first, count]: [usize; 2],
    blocks: &mut [[P::Number; LANES]; 3],
    axes: &[AxisWeights<P>; 3],
) -> Interpolated<P> {
    let weights = Weights::of::<P, S, N>(axes);
    let quads = [[P::Number::default(); 4]; LANES];
    let mut sums = Sums { v: quads, moments: [quads; 3], slopes: [quads; 3], change: quads };

    for lane in 0..count {
        let cell = stencil.cell_of::<S, N>(first + lane);
        for axis in 0..3 {
            blocks[axis][lane] = stencil.place()[axis];
        }
        let tiles = stencil.tiles();
        one::<P, S, N>(&tiles[0], cell, &weights, lane, &mut sums);
        if S::APART {
            sums.change[lane] = velocity::<P, N>(&tiles[1], cell, &weights, lane);
        }
    }

    // From quads to lanes.
    let zero = P::zero();
    let mut out = Interpolated {
        v: P::columns(&sums.v),
        moments: [[zero; 4]; 3],
        slopes: [[zero; 4]; 3],
        change: [zero; 4],
    };
    for axis in 0..3 {
        if S::AFFINE {
            out.moments[axis] = P::columns(&sums.moments[axis]);
        }
        if S::SLOPES {
            out.slopes[axis] = P::columns(&sums.slopes[axis]);
        }
    }

    if S::APART {
        out.change = P::columns(&sums.change);
    }

    out
}

/// Four nodes along z in row (i, j) of a cell's neighbourhood.
#[inline(always)]
fn row<P: Pack, const N: usize>(tile: &[P::Number; TILE], cell: usize, i: usize, j: usize) -> P {
    let [x, y, z] = [cell / (SIDE * SIDE), cell / SIDE % SIDE, cell % SIDE];
    let start = ((x + i) * (SIDE + N - 1) + y + j) * TILE_ROW + 4 * z;
    P::load((&tile[start..start + LANES]).try_into().expect("sixteen numbers"))
}

/// All sums of one particle.
#[inline(always)]
fn one<P: Pack, S: Scheme, const N: usize>(
    tile: &[P::Number; TILE],
    cell: usize,
    w: &Weights<P::Number>,
    lane: usize,
    sums: &mut Sums<P::Number>,
) {
    let zero = P::zero();

    // Along y, then along x: sums of weighted rows, of index times these, and with slopes.
    let (mut v, mut by_x, mut by_y) = (zero, [zero; 2], [zero; 2]);
    for i in 0..N {
        let (mut plain, mut moment, mut slope) = (zero, zero, zero);
        for j in 0..N {
            let nodes = row::<P, N>(tile, cell, i, j);
            let weighted = P::splat(w.y[0][j][lane]) * nodes;
            plain += weighted;
            if S::AFFINE {
                moment = add_times(moment, weighted, j);
            }
            if S::SLOPES {
                slope += P::splat(w.y[1][j][lane]) * nodes;
            }
        }
        let weight = P::splat(w.x[0][i][lane]);
        let weighted = weight * plain;
        v += weighted;
        if S::AFFINE {
            by_x[0] = add_times(by_x[0], weighted, i);
            by_y[0] += weight * moment;
        }
        if S::SLOPES {
            by_x[1] += P::splat(w.x[1][i][lane]) * plain;
            by_y[1] += weight * slope;
        }
    }

    let along_z = P::spread(&w.z[0][lane]);
    sums.v[lane] = (along_z * v).fold();
    if S::AFFINE {
        sums.moments[0][lane] = (along_z * by_x[0]).fold();
        sums.moments[1][lane] = (along_z * by_y[0]).fold();
        sums.moments[2][lane] = (P::spread(&w.z[1][lane]) * v).fold();
    }

    if S::SLOPES {
        sums.slopes[0][lane] = (along_z * by_x[1]).fold();
        sums.slopes[1][lane] = (along_z * by_y[1]).fold();
        sums.slopes[2][lane] = (P::spread(&w.z[2][lane]) * v).fold();
    }
}

/// sum + n x, for a small number.
#[inline(always)]
fn add_times<P: Pack>(sum: P, x: P, n: usize) -> P {
    match n {
        0 => sum,
        1 => sum + x,
        2 => sum + (x + x),
        _ => sum + (x + x + x),
    }
}

/// sum w v of one particle.
#[inline(always)]
fn velocity<P: Pack, const N: usize>(
    tile: &[P::Number; TILE],
    cell: usize,
    w: &Weights<P::Number>,
    lane: usize,
) -> [P::Number; 4] {
    let mut v = P::zero();
    for i in 0..N {
        let mut plain = P::zero();
        for j in 0..N {
            plain += P::splat(w.y[0][j][lane]) * row::<P, N>(tile, cell, i, j);
        }
        v += P::splat(w.x[0][i][lane]) * plain;
    }
    (P::spread(&w.z[0][lane]) * v).fold()
}

/// What does not change from group to group: powers of the cell size h, and the share of FLIP.
#[derive(Clone, Copy)]
pub(crate) struct InterpolationScale<R> {
    /// 1 / h (1/m).
    inverse_cell: R,
    /// h / D (1/m), D the second moment of the kernel.
    inverse_moment: R,
    /// 1 / h³ (1/m³).
    inverse_volume: R,
    /// Share of FLIP, 0 to 1.
    flip: R,
    advection: Advection,
}

impl<R: Real> InterpolationScale<R> {
    pub(crate) fn of(settings: &SnowSettings, flip: f64) -> Self {
        let h = settings.cell;
        Self {
            inverse_cell: R::of(1.0 / h),
            inverse_moment: R::of(settings.kernel.inverse_moment() / h),
            inverse_volume: R::of(1.0 / (h * h * h)),
            flip: R::of(flip),
            advection: settings.advection,
        }
    }
}

/// What a group gathers, made into its new velocities.
pub(crate) struct GridToGroup<'a, 'b, R: Real, S, const N: usize> {
    pub(crate) scale: InterpolationScale<R>,
    /// The group before the step.
    pub(crate) motion: &'a Motion<R>,
    /// Where the group begins in the order, and how many particles it has.
    pub(crate) start: usize,
    pub(crate) count: usize,
    pub(crate) stencil: &'a mut Stencil<'b, R>,
    pub(crate) arrival: &'a mut Arrival<R>,
    pub(crate) scheme: PhantomData<S>,
}

impl<R: Real, S: Scheme, const N: usize> WithSimd<R> for GridToGroup<'_, '_, R, S, N> {
    const WIDE_BINARY64: bool = false;
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let InterpolationScale { inverse_cell, inverse_moment, inverse_volume, flip, advection } = self.scale;
        let ([x, y, z], _) = self.motion.x_and_mass::<P>();
        let (old, _) = self.motion.v_and_plastic_ratio::<P>();
        let axes = [
            axis_weights::<P, N>(x * inverse_cell),
            axis_weights::<P, N>(y * inverse_cell),
            axis_weights::<P, N>(z * inverse_cell),
        ];

        let range = [self.start, self.count];
        let sums = gather::<P, S, N>(self.stencil, range, &mut self.arrival.block, &axes);
        self.arrival.density = (sums.v[3] * inverse_volume).store();

        // C and the velocity gradient: the same for MLS.
        for axis in 0..3 {
            for k in 0..3 {
                let mut value = sums.slopes[axis][k] * inverse_cell;
                if S::SLOPES {
                    self.arrival.gradient[axis][k] = value.store();
                }
                if S::AFFINE {
                    value = (sums.moments[axis][k] - axes[axis].offset * sums.v[k]) * inverse_moment;
                }
                self.arrival.c[axis][k] = value.store();
                if !S::SLOPES {
                    self.arrival.gradient[axis][k] = value.store();
                }
            }
        }

        // PIC/FLIP blends the grid's velocity with its change.
        let (flip, pic) = (P::splat(flip), P::splat(R::one() - flip));
        for k in 0..3 {
            let mut v = sums.v[k];
            if S::APART {
                v = pic * v + flip * (old[k] + sums.change[k]);
            }
            self.arrival.v[k] = v.store();
            let own = advection == Advection::Particle;
            self.arrival.drift[k] = if own { v.store() } else { sums.v[k].store() };
        }
    }
}
