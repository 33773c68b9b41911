//! One step of the snow, in the paper's order (Stomakhin et al. 2013, section 4).
//!
//! Reads particles in sorted order; writes them after the step, with the bound on the next one. A
//! step that would diverge is refused before it touches a particle: velocities on the grid decide,
//! and a particle whose nodes are finite and move by less than a cell stays finite.

use std::marker::PhantomData;

use rayon::prelude::*;

use super::{
    Blend, Kernel as Spline, SnowSettings, Transfer,
    bound::{Extremes, Worst},
    diagnose::SUMS,
    grid::{
        blocks::{Grid, tile_len},
        sort::Sorter,
    },
    law::constitutive::Coefficients,
    particles::{Group, Particles},
    transfer::{
        grid_to_particles::{Gather, GatherGroup},
        grid_update::{GridFigures, GridStep},
        implicit_solve::{self, ImplicitWorkspace, Material},
        particle_collision::{Nearness, collide},
        particle_update::{Arrival, Deformation, RunFigures, TOGETHER, Tally, Update, motion},
        particles_to_grid::{BlockParticles, Scatter, ScatterBlock},
        scheme::{ApicScheme, FlipScheme, MlsScheme, Scheme},
        stencil::{TILE, Walk},
    },
};
use crate::{
    collide::Collider,
    linalg::{Outcome, SolveReport},
    math::{LANES, Real, dispatch},
    report::{Stage, Stopwatch},
};

/// Whether forces are mixed with momenta on the nodes, or kept apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Forces {
    /// One tile.
    Fused,
    /// Two tiles.
    Apart,
}

/// Snow on its grid: what a step works on.
#[derive(Debug)]
pub(super) struct Engine<R: Real> {
    pub(super) settings: SnowSettings,
    pub(super) coefficients: Vec<Coefficients<R>>,
    pub(super) particles: Particles<R>,
    pub(super) sorter: Sorter,
    pub(super) grid: Grid<R>,
    /// Of each block of particles after the last step.
    pub(super) figures: Vec<RunFigures>,
    pub(super) extremes: Extremes,
    pub(super) grid_figures: GridFigures,
    pub(super) block_figures: Vec<GridFigures>,
    /// Smallest mass of a particle (kg).
    pub(super) least_mass: f64,
    /// First nodes, for sorting from nothing.
    pub(super) first_nodes: Vec<[i32; 3]>,
    /// A quad of each particle while places are renewed.
    pub(super) spare: Vec<[R; 4]>,
    /// Whether a particle went further than a block in the last step.
    pub(super) strayed: bool,
    /// The particles of the extremes, where they were looked for.
    pub(super) worst: Option<Worst>,
    pub(super) implicit: ImplicitWorkspace<R>,
    /// Sums of blocks.
    pub(super) partials: Vec<[f64; SUMS]>,
}

/// What surrounds one step of the snow.
#[derive(Clone, Copy)]
pub(super) struct StepContext<'a> {
    pub(super) dt: f64,
    /// Time at the end of the step (s).
    pub(super) time: f64,
    pub(super) gravity: [f64; 3],
    pub(super) colliders: &'a [Collider],
    /// Whether it ends a step of the world, which is reported.
    pub(super) last: bool,
}

/// The same expression for the transfer and kernel of the settings.
macro_rules! with_scheme {
    ($settings:expr, ($scheme:ident, $width:ident) => $body:expr) => {{
        macro_rules! of {
            ($s:ty, $n:literal) => {{
                type $scheme = $s;
                const $width: usize = $n;
                $body
            }};
        }
        match ($settings.transfer, $settings.kernel) {
            (Transfer::PicFlip(_), Spline::Linear) => of!(FlipScheme, 2),
            (Transfer::PicFlip(_), Spline::Quadratic) => of!(FlipScheme, 3),
            (Transfer::PicFlip(_), Spline::Cubic) => of!(FlipScheme, 4),
            (Transfer::Apic, Spline::Cubic) => of!(ApicScheme, 4),
            (Transfer::Apic, _) => of!(ApicScheme, 3),
            (Transfer::Mls, Spline::Cubic) => of!(MlsScheme, 4),
            (Transfer::Mls, _) => of!(MlsScheme, 3),
        }
    }};
}

impl<R: Real> Engine<R> {
    pub(super) fn new(
        settings: SnowSettings,
        coefficients: Vec<Coefficients<R>>,
        particles: Particles<R>,
    ) -> Self {
        let masses = (0..particles.len()).map(|at| particles.mass(at).to_f64());
        Self {
            settings,
            coefficients,
            least_mass: masses.fold(f64::INFINITY, f64::min),
            particles,
            sorter: Sorter::default(),
            grid: Grid::default(),
            figures: Vec::new(),
            extremes: Extremes::default(),
            grid_figures: GridFigures::default(),
            block_figures: Vec::new(),
            first_nodes: Vec::new(),
            spare: Vec::new(),
            strayed: false,
            worst: None,
            implicit: ImplicitWorkspace::default(),
            partials: Vec::new(),
        }
    }

    /// Momenta, masses and impulses to the grid, and velocities from them.
    pub(super) fn onto_grid(&mut self, context: &StepContext<'_>, watch: &mut dyn Stopwatch) -> GridFigures {
        let width = self.settings.kernel.width();
        let forces = self.forces();
        self.grid.size_for(width, forces);
        with_scheme!(self.settings, (S, N) => self.scatter::<S, N>(context.dt));
        watch.lap(Stage::ParticlesToGrid);
        let step = self.grid_step(context);
        self.grid_figures = step.run(&mut self.grid, &mut self.block_figures);
        watch.lap(Stage::GridUpdate);
        self.grid_figures
    }

    fn grid_step<'a>(&self, context: &StepContext<'a>) -> GridStep<'a> {
        GridStep {
            width: self.settings.kernel.width(),
            forces: self.forces(),
            dt: context.dt,
            time: context.time,
            cell: self.settings.cell,
            gravity: context.gravity,
            colliders: context.colliders,
            least_mass: self.least_mass * R::ROUNDING * R::ROUNDING,
            lightest: self.least_mass,
        }
    }

    /// Velocities at the end of a semi-implicit step, if it is one. Where the solve fails, nothing has
    /// moved.
    pub(super) fn solve(
        &mut self,
        context: &StepContext<'_>,
        watch: &mut dyn Stopwatch,
    ) -> Result<Option<SolveReport>, Outcome> {
        let step = self.grid_step(context);
        let Self { settings, coefficients, particles, sorter, grid, implicit: work, .. } = self;
        let material = Material { settings, coefficients, particles, sorter };
        let solved = implicit_solve::solve(&material, &step, grid, work);
        if matches!(solved, Ok(None)) {
            return solved;
        }
        watch.lap(Stage::Solve);
        solved
    }

    /// Velocities back to particles, deformation, positions; then the new order.
    pub(super) fn onto_particles(&mut self, context: &StepContext<'_>, watch: &mut dyn Stopwatch) {
        with_scheme!(self.settings, (S, N) => self.gather::<S, N>(context));
        watch.lap(Stage::GridToParticles);
        self.extremes = self.figures.iter().fold(Extremes::default(), |all, block| all.max(block.extremes));
        // Figures are those of blocks as they were: looked up before particles change their blocks.
        self.worst = context.last.then(|| self.worst());
        let periodic = self.settings.periodic;
        self.strayed = !self.sorter.renew(&self.particles.id, &mut self.grid, periodic);
        if self.strayed {
            self.sort_anew();
        }
        if 4 * self.sorter.moved > self.particles.len() {
            self.renew_places();
        }
        watch.lap(Stage::Sort);
    }

    fn forces(&self) -> Forces {
        if matches!(self.settings.transfer, Transfer::PicFlip(_)) { Forces::Apart } else { Forces::Fused }
    }

    fn scatter<S: Scheme, const N: usize>(&mut self, dt: f64) {
        let Self { settings, particles, sorter, grid, .. } = self;
        let h = settings.cell;
        let scatter = Scatter {
            inverse_cell: R::of(1.0 / h),
            cell: R::of(h),
            dt: R::of(dt),
            inverse_moment: R::of(settings.kernel.inverse_moment()),
        };
        let (count, len) = (grid.blocks.len(), tile_len(N));
        let particles = &*particles;
        let block = |b: usize| BlockParticles {
            order: &sorter.order[sorter.starts[b] as usize..sorter.starts[b + 1] as usize],
            cells: &sorter.cells[b],
        };
        let tiles = grid.tiles[..count * len].par_chunks_mut(len).enumerate();
        if S::APART {
            let impulses = grid.impulses[..count * len].par_chunks_mut(len);
            tiles.zip(impulses).for_each(|((b, tile), impulses)| {
                dispatch(ScatterBlock::<R, S, N> {
                    scatter,
                    particles,
                    block: block(b),
                    tile,
                    impulses,
                    scheme: PhantomData,
                });
            });
        } else {
            tiles.for_each(|(b, tile)| {
                let impulses = &mut [];
                dispatch(ScatterBlock::<R, S, N> {
                    scatter,
                    particles,
                    block: block(b),
                    tile,
                    impulses,
                    scheme: PhantomData,
                });
            });
        }
    }

    fn gather<S: Scheme, const N: usize>(&mut self, context: &StepContext<'_>) {
        let Self { settings, coefficients, particles, sorter, grid, figures, .. } = self;
        let h = settings.cell;
        let gather = Gather::of(settings, flip_share(settings.transfer, context.dt));
        let (planes, fixed, object) = particles.planes();
        let (sorted, departures) = sorter.depart();
        figures.resize(sorted.run_count(), RunFigures::default());
        let scratch = || [[R::zero(); TILE]; 2];
        figures.par_iter_mut().enumerate().for_each_init(scratch, |tiles, (run, figures)| {
            let (block, first, list) = sorted.run(run);
            let mut walk = Walk::new(sorted, grid.around(tiles), block);
            let mut contact = Nearness::new(context, h, block);
            let (mut tally, mut arrivals) = (Tally::new(), [Arrival::new(); TOGETHER]);
            let (mut moving, mut codes) = ([[[[R::zero(); 4]; LANES]; 2]; TOGETHER], [[0; LANES]; TOGETHER]);
            for start in (0..list.len()).step_by(LANES * TOGETHER) {
                let groups: [Group; TOGETHER] = std::array::from_fn(|k| Group::from(list, start + k * LANES));
                planes.prefetch(list, start);
                for (k, group) in groups.iter().enumerate().filter(|(_, group)| group.count > 0) {
                    motion(&planes, group, &mut moving[k]);
                    dispatch(GatherGroup::<R, S, N> {
                        gather,
                        motion: &moving[k],
                        start: first + start + k * LANES,
                        count: group.count,
                        walk: &mut walk,
                        arrival: &mut arrivals[k],
                        scheme: PhantomData,
                    });
                    if contact.reaches(&grid.blocks, walk.block) {
                        collide(context, &moving[k][0][..group.count], &mut arrivals[k]);
                    }
                }
                dispatch(Update {
                    groups: &groups,
                    moving: &moving,
                    arrivals: &arrivals,
                    fixed,
                    object,
                    planes: &planes,
                    coefficients,
                    dt: R::of(context.dt),
                    inverse_cell: R::of(1.0 / h),
                    ballistic_below: R::of(settings.ballistic_below),
                    deformation: Deformation::Step,
                    width: N,
                    tally: &mut tally,
                    periodic: settings.periodic,
                    codes: &mut codes,
                });
                for (k, group) in groups.iter().enumerate() {
                    departures.note(first + start + k * LANES, &codes[k][..group.count]);
                }
            }
            *figures = tally.finish();
        });
    }
}

/// Share of FLIP in a step.
fn flip_share(transfer: Transfer, dt: f64) -> f64 {
    match transfer {
        Transfer::PicFlip(Blend::PerStep(share)) => share,
        Transfer::PicFlip(Blend::TimeConstant(tau)) => libm::exp(-dt / tau),
        Transfer::Apic | Transfer::Mls => 0.0,
    }
}
