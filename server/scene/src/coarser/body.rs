//! A body with fewer particles: the numbers of its continuum are kept.
//!
//! With n by which it is coarser, and for a grid: a particle stands for n² of before, with their mass and their drag. A spring
//! between neighbours is n times as long, and there are n times fewer beside it: its stiffness and its damping per width stay if those
//! of the spring stay. A spring over two gaps stays likewise, and laws of elements hold per area. In a chain a particle stands for n,
//! and stiffness times length stays: a spring has an n-th of its stiffness.

use super::{edits::Edits, grid::CoarserGrid};
use crate::{
    body::{Body, ForceText, Mass, Mesh, Pin, SpringLaw},
    error::ErrorKind,
    source::Path,
};

/// Makes a body coarser; `at` is where it stands, and its grid is that of its mesh.
pub(super) fn edit(body: &Body, grid: CoarserGrid, by: u32, at: &Path, edits: &mut Edits<'_>) {
    let spacing = grid.spacing(held(&body.pins));
    let sides = grid.extended().into_iter().filter(|is_extended| *is_extended).count() as i32;
    let share = f64::from(by).powi(sides);
    edit_mesh(&body.mesh, grid, spacing, &at.key("mesh"), edits);
    if let Some(Mass::Particle(mass)) = body.mass {
        edits.scaled(at.key("mass").key("particle"), mass, share);
    }
    edits.scaled(at.key("drag"), body.drag, share);
    if sides == 1 {
        edit_springs(body, 1.0 / spacing, at, edits);
    }

    for (place, pin) in body.pins.iter().enumerate() {
        edit_pin(pin, grid, by, &at.key("pins").index(place), edits);
    }
    for (place, moving) in body.moving_pins.iter().enumerate() {
        edit_pin(&moving.pin, grid, by, &at.key("moving_pin").index(place).key("pin"), edits);
    }
    for (place, force) in body.forces.iter().enumerate() {
        edit_force(force, grid, by, &at.key("force").index(place), edits);
    }
}

fn edit_mesh(mesh: &Mesh, grid: CoarserGrid, factor: f64, at: &Path, edits: &mut Edits<'_>) {
    let [columns, rows] = grid.coarse;
    match mesh {
        Mesh::Grid { spacing, .. } => {
            edits.whole(at.key("grid").index(0), columns);
            edits.whole(at.key("grid").index(1), rows);
            edits.scaled(at.key("spacing"), *spacing, factor);
        }
        Mesh::Chain { spacing, .. } => {
            edits.whole(at.key("chain"), columns);
            edits.scaled(at.key("spacing"), *spacing, factor);
        }
        // These are no grids by themselves.
        Mesh::CourseGrid { .. } | Mesh::Upload { .. } | Mesh::File { .. } => {}
    }
}

/// The springs of a chain, or of a grid of one row or column.
fn edit_springs(body: &Body, factor: f64, at: &Path, edits: &mut Edits<'_>) {
    let Some(springs) = &body.springs else { return };
    let laws = [("stretch", springs.stretch), ("shear", springs.shear), ("bend", springs.bend)];
    for (name, law) in laws {
        let Some(SpringLaw { stiffness, damping }) = law else { continue };
        let at = at.key("springs").key(name);
        edits.scaled(at.key("stiffness"), stiffness, factor);
        edits.scaled(at.key("damping"), damping, factor);
    }
}

/// A particle by its index gets that of the coarser grid at the same place; names stay.
fn edit_pin(pin: &Pin, grid: CoarserGrid, by: u32, at: &Path, edits: &mut Edits<'_>) {
    let &Pin::Index(index) = pin else { return };
    if let Some(coarse) = grid.coarse_particle(index) {
        edits.whole(at.clone(), coarse);
        return;
    }
    let is_nested = grid.gaps().into_iter().all(|gap| gap == 1.0 || gap == f64::from(by));
    let which = if is_nested {
        format!("particles whose column and row, from 0 on, {by} divides")
    } else {
        "corners".to_owned()
    };
    let message = format!(
        "is {index}: the coarser grid has no particle at its place; allowed: {which}, and names such as \"top\""
    );
    edits.refuse(ErrorKind::Inconsistent, at, message);
}

/// A force on each of some particles: together they feel what they felt.
fn edit_force(text: &ForceText, grid: CoarserGrid, by: u32, at: &Path, edits: &mut Edits<'_>) {
    edit_pin(&text.on, grid, by, &at.key("on"), edits);
    let [columns, rows] = grid.extended();
    let sides = match &text.on {
        Pin::Name(name) => match name.as_str() {
            "all" => i32::from(columns) + i32::from(rows),
            "top" | "bottom" => i32::from(columns),
            "left" | "right" => i32::from(rows),
            _ => 0,
        },
        Pin::Index(_) => 0,
    };
    for (place, force) in text.force.into_iter().enumerate() {
        edits.scaled(at.key("force").index(place), force, f64::from(by).powi(sides));
    }
}

/// Whether named pins hold both ends of rows of particles, so that their length is given, and both ends of columns.
fn held(pins: &[Pin]) -> [bool; 2] {
    let is_held = |name: &str| pins.iter().any(|pin| matches!(pin, Pin::Name(held) if held == name));
    let are_held = |one: &str, other: &str| is_held(one) && is_held(other);
    let along_rows = is_held("top")
        || is_held("bottom")
        || are_held("top_left", "top_right")
        || are_held("bottom_left", "bottom_right");
    let along_columns = is_held("left")
        || is_held("right")
        || are_held("top_left", "bottom_left")
        || are_held("top_right", "bottom_right");
    [along_rows, along_columns]
}
