//! Particles to grid: masses, momenta and impulses of internal forces on the nodes of one block.
//!
//! Reads particles in the order of the block; writes the block's tile. Stomakhin et al. 2013, steps
//! 1 and 3: m_i = sum m w, m_i v_i = sum m w (v + C (x_i - x_p)), and f_i = -sum V0 tau grad w, or
//! -sum V0 D^-1 tau w (x_i - x_p) with the affine field (Hu et al. 2018, eq. 16).
//!
//! Sixteen particles at a time make their coefficients; then one particle at a time adds to rows of
//! four nodes along z, four numbers per node. A cell's rows stay in registers until its last particle.

use std::marker::PhantomData;

use super::{
    scheme::{Scheme, with_scheme},
    weights::{AxisWeights, axis_weights},
};
use crate::{
    math::{LANES, Pack, Real, WithSimd, dispatch},
    parallel::{Own, several_per_block_mut},
    snow::{
        grid::{CELLS, Grid, SIDE, Sorted, TILE_ROW, tile_len},
        model::SnowModel,
        particles::{Group, Particles},
    },
};

/// Fills the tiles of all blocks: momenta and masses, and impulses of forces in `dt` (s).
pub(crate) fn particles_to_grid<R: Real>(
    model: &SnowModel<R>,
    particles: &Particles<R>,
    sorted: Sorted<'_>,
    grid: &mut Grid<R>,
    dt: f64,
) {
    let settings = &model.settings;
    grid.size_for(settings.kernel.width(), settings.transfer.forces());
    let scale = TransferScale {
        inverse_cell: R::of(1.0 / settings.cell),
        cell: R::of(settings.cell),
        dt: R::of(dt),
        inverse_moment: R::of(settings.kernel.inverse_moment()),
    };
    with_scheme!(settings, (S, N) => fill_tiles::<R, S, N>(scale, particles, sorted, grid));
}

/// The particles of every block to its tile.
fn fill_tiles<R: Real, S: Scheme, const N: usize>(
    scale: TransferScale<R>,
    particles: &Particles<R>,
    sorted: Sorted<'_>,
    grid: &mut Grid<R>,
) {
    let (count, len) = (grid.blocks.len(), tile_len(N));
    let Grid { tiles, impulses, .. } = grid;
    let impulses = if S::APART { Some(several_per_block_mut(impulses, len)) } else { None };
    Own::whole(count, 1).each((several_per_block_mut(tiles, len), impulses), |b, (tile, impulses)| {
        let block = BlockParticles { order: sorted.places(b), cells: &sorted.cells[b] };
        let (impulses, scheme) = (impulses.unwrap_or_default(), PhantomData);
        dispatch(BlockToGrid::<R, S, N> { scale, particles, block, tile, impulses, scheme });
    });
}

/// What does not change from block to block.
#[derive(Clone, Copy)]
pub(crate) struct TransferScale<R> {
    /// 1 / h (1/m).
    pub(crate) inverse_cell: R,
    /// h (m).
    pub(crate) cell: R,
    /// Time step (s).
    pub(crate) dt: R,
    /// h² / D of the kernel.
    pub(crate) inverse_moment: R,
}

/// The particles of a block, sorted by cell.
#[derive(Clone, Copy)]
pub(crate) struct BlockParticles<'a> {
    pub(crate) order: &'a [u32],
    /// Where each cell begins in `order`, and the end.
    pub(crate) cells: &'a [u32; CELLS + 1],
}

/// What sixteen particles give to the nodes, one quad or one number each.
pub(crate) struct Contributions<R> {
    /// Momentum at the first node, and mass.
    pub(crate) base: [[R; 4]; LANES],
    /// Change of momentum from node to node along each axis.
    pub(crate) along: [[[R; 4]; LANES]; 3],
    /// Columns of -dt V0 tau / h.
    pub(crate) force: [[[R; 4]; LANES]; 3],
    /// Weights along z.
    pub(crate) wz: [[R; 4]; LANES],
    /// Slopes along z.
    pub(crate) dz: [[R; 4]; LANES],
    /// Products w_x w_y of each row; and with the slope along x, along y.
    pub(crate) rows: [[[R; LANES]; 16]; 3],
}

impl<R: Real> Contributions<R> {
    pub(crate) fn new() -> Self {
        let quads = [[R::zero(); 4]; LANES];
        let rows = [[R::zero(); LANES]; 16];
        Self { base: quads, along: [quads; 3], force: [quads; 3], wz: quads, dz: quads, rows: [rows; 3] }
    }
}

impl<R: Real> TransferScale<R> {
    /// Fills a block's tile, and the tile of impulses where they are kept apart.
    #[inline(always)]
    pub(crate) fn block<P: Pack<Number = R>, S: Scheme, const N: usize>(
        &self,
        particles: &Particles<R>,
        block: BlockParticles<'_>,
        tile: &mut [R],
        impulses: &mut [R],
    ) {
        tile.fill(R::zero());
        impulses.fill(R::zero());
        let mut c = Contributions::new();
        let zero = P::zero();
        let (mut sums, mut forces) = ([[zero; N]; N], [[zero; N]; N]);
        let (mut cell, mut cell_end) = (0, 0);

        for first in (0..block.order.len()).step_by(LANES) {
            let group = Group::of(&block.order[first..]);
            self.prepare::<P, S, N>(particles, &group, &mut c);
            for lane in 0..group.count {
                if first + lane >= cell_end {
                    flush::<P, N>(&mut sums, tile, cell);
                    if S::APART {
                        flush::<P, N>(&mut forces, impulses, cell);
                    }
                    while block.cells[cell + 1] as usize <= first + lane {
                        cell += 1;
                    }
                    cell_end = block.cells[cell + 1] as usize;
                }
                add::<P, S, N>(&c, lane, &mut sums, &mut forces);
            }
        }

        flush::<P, N>(&mut sums, tile, cell);
        if S::APART {
            flush::<P, N>(&mut forces, impulses, cell);
        }
    }

    /// What a group gives.
    #[inline(always)]
    fn prepare<P: Pack<Number = R>, S: Scheme, const N: usize>(
        &self,
        particles: &Particles<R>,
        group: &Group,
        out: &mut Contributions<R>,
    ) {
        let zero = P::zero();
        let ([x, y, z], m) = particles.x_and_mass::<P>(group);
        let ([vx, vy, vz], _) = particles.v_and_plastic_ratio::<P>(group);

        let axes = [
            axis_weights::<P, N>(x * self.inverse_cell),
            axis_weights::<P, N>(y * self.inverse_cell),
            axis_weights::<P, N>(z * self.inverse_cell),
        ];

        // Columns of C and of V0 tau, each along the nodes of one axis.
        let (c, [sxx, syy, szz, sxy, sxz, syz]) = if S::AFFINE {
            particles.c_columns_and_v0_tau::<P>(group)
        } else {
            ([[zero; 3]; 3], particles.v0_tau_lanes::<P>(group))
        };
        let tau = [[sxx, sxy, sxz], [sxy, syy, syz], [sxz, syz, szz]];

        // Momentum at the first node, and how it grows from node to node.
        let mut base = [vx * m, vy * m, vz * m];
        if S::AFFINE {
            let inertia = m * self.cell;
            let impulse = -self.dt * self.inverse_moment * self.inverse_cell;
            for axis in 0..3 {
                let mut step = [zero; 3];
                for k in 0..3 {
                    step[k] = c[axis][k] * inertia;
                    if !S::SLOPES {
                        step[k] += tau[axis][k] * impulse;
                    }
                    base[k] -= step[k] * axes[axis].offset;
                }
                out.along[axis] = P::rows([step[0], step[1], step[2], zero]);
            }
        }

        out.base = P::rows([base[0], base[1], base[2], m]);
        out.wz = P::rows(axes[2].w);
        if S::SLOPES {
            out.dz = P::rows(axes[2].d);
            let impulse = -self.dt * self.inverse_cell;
            for axis in 0..3 {
                let [a, b, c] = tau[axis];
                out.force[axis] = P::rows([a * impulse, b * impulse, c * impulse, zero]);
            }
        }

        row_weights::<P, S, N>(&axes, &mut out.rows);
    }
}

/// Products of weights along x and y.
#[inline(always)]
pub(crate) fn row_weights<P: Pack, S: Scheme, const N: usize>(
    axes: &[AxisWeights<P>; 3],
    rows: &mut [[[P::Number; LANES]; 16]; 3],
) {
    for i in 0..N {
        for j in 0..N {
            rows[0][i * N + j] = (axes[0].w[i] * axes[1].w[j]).store();
            if S::SLOPES {
                rows[1][i * N + j] = (axes[0].d[i] * axes[1].w[j]).store();
                rows[2][i * N + j] = (axes[0].w[i] * axes[1].d[j]).store();
            }
        }
    }
}

/// Adds what one particle gives to the rows of its cell.
#[inline(always)]
pub(crate) fn add<P: Pack, S: Scheme, const N: usize>(
    c: &Contributions<P::Number>,
    lane: usize,
    sums: &mut [[P; N]; N],
    forces: &mut [[P; N]; N],
) {
    let wz = P::spread(&c.wz[lane]);
    let steps =
        P::spread(&[P::Number::default(), P::Number::of(1.0), P::Number::of(2.0), P::Number::of(3.0)]);

    // Along z at the first row, and what each step along x and y adds.
    let mut row = wz * P::repeat(&c.base[lane]);
    let (mut along_x, mut along_y) = (row, row);
    if S::AFFINE {
        row = wz * (P::repeat(&c.base[lane]) + steps * P::repeat(&c.along[2][lane]));
        along_x = wz * P::repeat(&c.along[0][lane]);
        along_y = wz * P::repeat(&c.along[1][lane]);
    }

    let (mut fx, mut fy, mut fz) = (row, row, row);
    if S::SLOPES {
        fx = wz * P::repeat(&c.force[0][lane]);
        fy = wz * P::repeat(&c.force[1][lane]);
        fz = P::spread(&c.dz[lane]) * P::repeat(&c.force[2][lane]);
    }

    if S::SLOPES && !S::APART {
        row += fz;
    }

    for i in 0..N {
        let mut value = row;
        for j in 0..N {
            let weight = P::splat(c.rows[0][i * N + j][lane]);
            sums[i][j] += weight * value;
            if S::SLOPES {
                let (by_x, by_y) = (c.rows[1][i * N + j][lane], c.rows[2][i * N + j][lane]);
                let slopes = P::splat(by_x) * fx + P::splat(by_y) * fy;
                if S::APART {
                    forces[i][j] += slopes + weight * fz;
                } else {
                    sums[i][j] += slopes;
                }
            }
            if S::AFFINE {
                value += along_y;
            }
        }
        if S::AFFINE {
            row += along_x;
        }
    }
}

/// Adds a cell's rows to the tile and clears them.
#[inline(always)]
pub(crate) fn flush<P: Pack, const N: usize>(sums: &mut [[P; N]; N], tile: &mut [P::Number], cell: usize) {
    let [x, y, z] = [cell / (SIDE * SIDE), cell / SIDE % SIDE, cell % SIDE];
    for i in 0..N {
        for j in 0..N {
            let start = ((x + i) * (SIDE + N - 1) + y + j) * TILE_ROW + 4 * z;
            let row: &mut [P::Number; LANES] =
                (&mut tile[start..start + LANES]).try_into().expect("sixteen numbers");
            *row = (P::load(row) + sums[i][j]).store();
            sums[i][j] = P::zero();
        }
    }
}

/// The particles of one block to its tile.
pub(crate) struct BlockToGrid<'a, R: Real, S, const N: usize> {
    pub(crate) scale: TransferScale<R>,
    pub(crate) particles: &'a Particles<R>,
    pub(crate) block: BlockParticles<'a>,
    pub(crate) tile: &'a mut [R],
    pub(crate) impulses: &'a mut [R],
    pub(crate) scheme: PhantomData<S>,
}

impl<R: Real, S: Scheme, const N: usize> WithSimd<R> for BlockToGrid<'_, R, S, N> {
    const WIDE_BINARY64: bool = false;
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        self.scale.block::<P, S, N>(self.particles, self.block, self.tile, self.impulses);
    }
}
