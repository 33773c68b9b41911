//! The text of a scene in which every grid, every chain and the snow are coarser.

use std::fmt::Write as _;

use nappe_sim::math::four_digits;

use super::{body, edits::Edits, grid::CoarserGrid, snow};
use crate::{
    body::{Body, Mesh},
    error::{ErrorKind, SceneError, SceneErrors},
    scene::Scene,
    source::Path,
};

/// How many numbers a message lists that would divide a grid.
const LISTED: usize = 12;

/// A coarser copy of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CoarserScene {
    /// Its text: that of the fine scene with other values in place of some.
    pub text: String,
    /// What differs, in a sentence for each body and for the snow.
    pub changes: Vec<String>,
}

/// A copy of the scene of a text, coarser by a whole number, 2 or more. `file` is its name in messages.
///
/// Grids and chains have their particles farther apart by this number, and by a little more where it divides particles and not gaps;
/// snow has larger cells. Masses, drag, forces, and the springs of chains follow, so that the continuum stays as it is. Pins,
/// colliders, transforms, air, thickness, steps and limits stay.
///
/// # Errors
/// A text that is no scene, a body whose mesh is no grid and no chain, a grid that the number does not divide, with those that would,
/// and a pin or a force on a particle whose place has none in the coarser grid.
pub fn coarser(text: &str, file: &str, by: u32) -> Result<CoarserScene, SceneErrors> {
    let scene = Scene::parse(text, file)?;
    if by < 2 {
        let message = format!("by is {by}; allowed: a whole number, 2 or more");
        return Err(SceneError::new(ErrorKind::OutOfRange, file, message).into());
    }
    let mut edits = Edits::new(&scene.source);
    let mut changes = Vec::new();
    for (place, body) in scene.bodies.iter().enumerate() {
        let at = Path::default().key("body").index(place);
        match grid_of(body, by, &scene) {
            Ok(grid) => {
                body::edit(body, grid, by, &at, &mut edits);
                changes.push(said(&body.name, grid));
            }
            Err((kind, message)) => edits.refuse(kind, &at.key("mesh"), message),
        }
    }
    if let Some(text) = &scene.snow {
        snow::edit(text, by, &Path::default().key("snow"), &mut edits);
        let [coarse, fine] = [text.cell * f64::from(by), text.cell].map(four_digits);
        changes.push(format!("cells of snow have sides of {coarse} m in place of {fine} m"));
    }
    let text = edits.text()?;
    Scene::parse(&text, file)?;
    Ok(CoarserScene { text, changes })
}

impl Scene {
    /// The same scene, coarser by a whole number, 2 or more, as [`coarser`] makes it.
    ///
    /// # Errors
    /// As [`coarser`], with no lines.
    pub fn coarser(&self, by: u32) -> Result<Self, SceneErrors> {
        let made = coarser(&self.to_toml(), "", by)?;
        let mut scene = Self::parse(&made.text, "")?;
        scene.source = self.source.clone();
        Ok(scene)
    }
}

/// The grid of a body and its coarser one, or why it has none.
fn grid_of(body: &Body, by: u32, scene: &Scene) -> Result<CoarserGrid, (ErrorKind, String)> {
    let Some(fine) = CoarserGrid::sides(&body.mesh) else {
        let what = match body.mesh {
            Mesh::CourseGrid { course_grid: side } => {
                let message = format!(
                    "is a course_grid, whose particles are 0.1 m apart by definition; allowed for a coarser copy: {{ grid = [{side}, \
                     {side}], spacing = 0.1, plane = \"upright\", ripple = 0.1 }} with a mass, pins and springs.pattern = \"edges\""
                );
                return Err((ErrorKind::Unsupported, message));
            }
            Mesh::Upload { .. } => "an upload",
            _ => "a file",
        };
        let message = format!(
            "is {what}, and no grid; a coarser copy is made of bodies that are a grid or a chain, and of snow"
        );
        return Err((ErrorKind::Unsupported, message));
    };
    if fine.into_iter().all(|count| count < 2) {
        return Err((ErrorKind::OutOfRange, "has 1 particle: a coarser copy needs more".to_owned()));
    }
    CoarserGrid::new(fine, by).ok_or_else(|| (ErrorKind::OutOfRange, indivisible(fine, by, scene)))
}

/// Why a grid has no coarser copy by a number, and which numbers all grids of the scene have one by.
fn indivisible([columns, rows]: [u32; 2], by: u32, scene: &Scene) -> String {
    let grids: Vec<[u32; 2]> =
        scene.bodies.iter().filter_map(|body| CoarserGrid::sides(&body.mesh)).collect();
    let longest = grids.iter().flatten().copied().max().unwrap_or(0);
    let works = |by: &u32| grids.iter().all(|grid| CoarserGrid::new(*grid, *by).is_some());
    let numbers: Vec<String> = (2..=longest).filter(works).take(LISTED).map(|by| by.to_string()).collect();
    let mut message = format!("has {columns} x {rows} particles, of which {by} divides neither the numbers ");
    let _ = write!(
        message,
        "nor the gaps between them, {} x {}; ",
        columns.saturating_sub(1),
        rows.saturating_sub(1)
    );
    if numbers.is_empty() {
        let [columns, rows] = [columns, rows].map(|count| match count {
            0 | 1 => count,
            _ => (count - 1).div_ceil(by).saturating_mul(by).saturating_add(1),
        });
        let _ = write!(
            message,
            "no number divides all grids of the scene; {columns} x {rows} particles work by {by}"
        );
    } else {
        let _ = write!(message, "allowed: {}", numbers.join(", "));
    }
    message
}

/// What differs in a body.
fn said(name: &str, CoarserGrid { fine, coarse }: CoarserGrid) -> String {
    format!("{name} has {} x {} particles in place of {} x {}", coarse[0], coarse[1], fine[0], fine[1])
}
