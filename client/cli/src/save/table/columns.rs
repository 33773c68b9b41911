//! The columns of a table: what the step of a frame reported, under names that stay. The package for Python has the same ones.
//!
//! Enters: diagnostics. Leaves: a number, a count or a word of each column, or nothing where there is none.

use nappe_client::{components, v1};

use self::Cell::{Count, Number, Word};

/// What stands in a column.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cell {
    /// A number, with all its digits.
    Number(f64),
    /// A count, or an index.
    Count(u64),
    /// A word of a closed set.
    Word(String),
}

/// A column: its name, and its value in a step.
type Column = (&'static str, fn(&v1::Diagnostics) -> Option<Cell>);

/// Why cloth woke last, if any did.
fn wake_cause(rest: &v1::RestReport) -> Option<String> {
    rest.wake_cause.map(|_| rest.wake_cause().word())
}

/// The columns after those of the frame, in their order; loads of colliders follow.
pub(super) const COLUMNS: [Column; 73] = [
    ("kinetic_energy", |d| Some(Number(d.kinetic_energy))),
    ("elastic_energy", |d| Some(Number(d.elastic_energy))),
    ("gravitational_energy", |d| Some(Number(d.gravitational_energy))),
    ("momentum_x", |d| Some(Number(components(d.momentum)[0]))),
    ("momentum_y", |d| Some(Number(components(d.momentum)[1]))),
    ("momentum_z", |d| Some(Number(components(d.momentum)[2]))),
    ("max_stretch", |d| Some(Number(d.max_stretch))),
    ("contact_count", |d| Some(Count(d.contact_count))),
    ("solve_outcome", |d| Some(Word(d.solve.as_ref()?.outcome().word()))),
    ("solve_iterations", |d| Some(Count(d.solve.as_ref()?.iterations.into()))),
    ("solve_relative_residual", |d| Some(Number(d.solve.as_ref()?.relative_residual))),
    ("step_seconds", |d| Some(Number(d.step_seconds))),
    ("snow_substeps", |d| Some(Count(d.snow.as_ref()?.substeps.into()))),
    ("snow_dt_seconds", |d| Some(Number(d.snow.as_ref()?.dt_seconds))),
    ("snow_bound", |d| Some(Word(d.snow.as_ref()?.bound().word()))),
    ("snow_bound_particle", |d| Some(Count(d.snow.as_ref()?.bound_particle?))),
    ("snow_bound_seconds", |d| Some(Number(d.snow.as_ref()?.bound_seconds))),
    ("snow_mass", |d| Some(Number(d.snow.as_ref()?.mass))),
    ("snow_grid_mass_error", |d| Some(Number(d.snow.as_ref()?.grid_mass_error))),
    ("snow_plastic_count", |d| Some(Count(d.snow.as_ref()?.plastic_count))),
    ("snow_inverted_count", |d| Some(Count(d.snow.as_ref()?.inverted_count))),
    ("snow_clamped_count", |d| Some(Count(d.snow.as_ref()?.clamped_count))),
    ("snow_ballistic_count", |d| Some(Count(d.snow.as_ref()?.ballistic_count))),
    ("snow_min_plastic_ratio", |d| Some(Number(d.snow.as_ref()?.min_plastic_ratio))),
    ("snow_max_plastic_ratio", |d| Some(Number(d.snow.as_ref()?.max_plastic_ratio))),
    ("snow_max_speed", |d| Some(Number(d.snow.as_ref()?.max_speed))),
    ("snow_dropped_momentum", |d| Some(Number(d.snow.as_ref()?.dropped_momentum))),
    ("snow_angular_momentum_x", |d| Some(Number(components(d.snow.as_ref()?.angular_momentum)[0]))),
    ("snow_angular_momentum_y", |d| Some(Number(components(d.snow.as_ref()?.angular_momentum)[1]))),
    ("snow_angular_momentum_z", |d| Some(Number(components(d.snow.as_ref()?.angular_momentum)[2]))),
    ("snow_block_count", |d| Some(Count(d.snow.as_ref()?.block_count))),
    ("snow_torn_count", |d| Some(Count(d.snow.as_ref()?.torn_count))),
    ("notices_capped_solves", |d| Some(Count(d.notices.as_ref()?.capped_solves))),
    ("notices_indefinite_solves", |d| Some(Count(d.notices.as_ref()?.indefinite_solves))),
    ("notices_passed_particles", |d| Some(Count(d.notices.as_ref()?.passed_particles))),
    ("notices_rejected_steps", |d| Some(Count(d.notices.as_ref()?.rejected_steps))),
    ("notices_pinched_particles", |d| Some(Count(d.notices.as_ref()?.pinched_particles))),
    ("notices_yielding_corners", |d| Some(Count(d.notices.as_ref()?.yielding_corners))),
    ("notices_torn_particles", |d| Some(Count(d.notices.as_ref()?.torn_particles))),
    ("notices_first_torn_particle", |d| Some(Count(d.notices.as_ref()?.first_torn_particle?))),
    ("notices_first_torn_seconds", |d| Some(Number(d.notices.as_ref()?.first_torn_seconds?))),
    ("cloth_substeps", |d| Some(Count(d.cloth.as_ref()?.substeps.into()))),
    ("cloth_rejected", |d| Some(Count(d.cloth.as_ref()?.rejected.into()))),
    ("cloth_dt_seconds", |d| Some(Number(d.cloth.as_ref()?.dt_seconds))),
    ("cloth_bound", |d| Some(Word(d.cloth.as_ref()?.bound().word()))),
    ("cloth_bound_particle", |d| Some(Count(d.cloth.as_ref()?.bound_particle?))),
    ("cloth_bound_seconds", |d| Some(Number(d.cloth.as_ref()?.bound_seconds))),
    ("cloth_error_rms", |d| Some(Number(d.cloth.as_ref()?.error_rms))),
    ("cloth_error_largest", |d| Some(Number(d.cloth.as_ref()?.error_largest))),
    ("cloth_preconditioner", |d| Some(Word(d.cloth.as_ref()?.preconditioner.clone()?))),
    ("cloth_solve_error_m", |d| Some(Number(d.cloth.as_ref()?.solve_error_m))),
    ("cloth_solves", |d| Some(Count(d.cloth.as_ref()?.solves.into()))),
    ("external_work", |d| Some(Number(d.external_work))),
    ("surface_pairs", |d| Some(Count(d.surface.as_ref()?.pairs))),
    ("surface_active", |d| Some(Count(d.surface.as_ref()?.active))),
    ("surface_rounds", |d| Some(Count(d.surface.as_ref()?.rounds.into()))),
    ("surface_least_gap_m", |d| Some(Number(d.surface.as_ref()?.least_gap_m?))),
    ("surface_failed", |d| Some(Count(d.surface.as_ref()?.failed))),
    ("surface_crossings", |d| Some(Count(d.surface.as_ref()?.crossings?))),
    ("surface_yield_m", |d| Some(Number(d.surface.as_ref()?.yield_m))),
    ("surface_yielding", |d| Some(Count(d.surface.as_ref()?.yielding))),
    ("surface_largest_push_n", |d| Some(Number(d.surface.as_ref()?.largest_push_n))),
    ("rest_calm_share", |d| Some(Number(d.rest.as_ref()?.calm_share))),
    ("rest_pieces", |d| Some(Count(d.rest.as_ref()?.pieces))),
    ("rest_calm_pieces", |d| Some(Count(d.rest.as_ref()?.calm_pieces))),
    ("rest_way_m", |d| Some(Number(d.rest.as_ref()?.way_m))),
    ("rest_change_m", |d| Some(Number(d.rest.as_ref()?.change_m))),
    ("rest_awake_share", |d| Some(Number(d.rest.as_ref()?.awake_share))),
    ("rest_pieces_asleep", |d| Some(Count(d.rest.as_ref()?.pieces_asleep))),
    ("rest_told_m", |d| Some(Number(d.rest.as_ref()?.told_m))),
    ("rest_long_steps", |d| Some(Count(d.rest.as_ref()?.long_steps))),
    ("rest_wakes", |d| Some(Count(d.rest.as_ref()?.wakes))),
    ("rest_wake_cause", |d| Some(Word(wake_cause(d.rest.as_ref()?)?))),
];
