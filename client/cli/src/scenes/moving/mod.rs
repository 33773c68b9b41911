//! Meshes that move: the skin and the animation of a glTF file, or a folder with a mesh for each frame.
//!
//! Enters: a path, and at which times. Leaves: the mesh at the first frame, and the places of its points in all frames, as
//! figures of scenes have them. Modules in reading order:

mod frame;
mod matrix;
mod asset;
mod bones;
mod clip;
mod skinned;
mod folder;
mod joined;

use std::path::Path;

use nappe_scene::mesh::PointFrames;
use nappe_sim::mesh::TriangleMesh;

pub(crate) use self::frame::Ending;
use self::{
    asset::Asset,
    bones::Bones,
    clip::Clip,
    frame::{Frame, check_size},
    skinned::Skinned,
};
use crate::words::error::{CliError, Result};

/// Which frames are wanted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted {
    /// Frames in a second (1/s), above 0.
    pub(crate) rate: f64,
    /// Number of the animation of a glTF file, from 0; without one the first, which is told where there are others.
    pub(crate) animation: Option<usize>,
    /// What becomes of the last frame.
    pub(crate) ending: Ending,
}

/// A mesh that moves.
#[derive(Debug)]
pub(crate) struct Moving {
    /// The mesh at the first frame.
    pub(crate) mesh: TriangleMesh,
    /// Where its points are.
    pub(crate) frames: PointFrames,
    /// Points that were joined to others, which are in the same place in every frame.
    pub(crate) joined: usize,
    /// What is odd.
    pub(crate) warnings: Vec<String>,
}

/// Reads a glTF file, or a folder with a mesh for each frame.
///
/// # Errors
/// A file that cannot be read, or that has none of what is needed.
pub(crate) fn load(path: &Path, wanted: Wanted) -> Result<Moving> {
    if path.is_dir() {
        let read = folder::read(path, wanted.ending)?;
        return whole(path, read.frames, read.triangles, Vec::new());
    }
    let asset = Asset::read(path)?;
    let skinned = Skinned::read(&asset)?;
    let clip = Clip::read(&asset, wanted.animation.unwrap_or(0))?;
    let bones = Bones::read(&asset)?;
    let count = clip.frames(wanted.rate, wanted.ending);
    check_size(path, skinned.points(), count)?;

    let frame = |number: usize| {
        let moved = clip.moved(number as f64 / wanted.rate, bones.parts());
        skinned.frame(&bones.places(&moved))
    };
    let frames = (0..count).map(frame).collect();
    let mut warnings = Vec::new();
    if clip.others() > 0 && wanted.animation.is_none() {
        warnings.push(format!(
            "{}: has {} animations, of which number 0 is taken; --animation takes another",
            path.display(),
            clip.others() + 1
        ));
    }
    if skinned.still() > 0 {
        warnings.push(format!("{}: meshes without a skin are left out: {}", path.display(), skinned.still()));
    }
    whole(path, frames, skinned.into_triangles(), warnings)
}

/// Joins points, and makes a mesh of the first frame.
fn whole(
    path: &Path,
    mut frames: Vec<Frame>,
    mut triangles: Vec<[u32; 3]>,
    mut warnings: Vec<String>,
) -> Result<Moving> {
    if let Some(number) = frames.iter().position(|frame| frame.iter().flatten().any(|c| !c.is_finite())) {
        let message = format!("{}: a point of frame {number} is not at finite numbers", path.display());
        return Err(CliError::failure(message));
    }
    let found = triangles.len();
    let joined = joined::join(&mut frames, &mut triangles);
    let dropped = found - triangles.len();
    if dropped > 0 {
        warnings.push(format!("{}: triangles with a corner twice are left out: {dropped}", path.display()));
    }
    let first = frames.first().map_or(&[][..], Vec::as_slice);
    if first.is_empty() || triangles.is_empty() {
        return Err(CliError::failure(format!("{}: has no triangles", path.display())));
    }

    let points = first.iter().map(|place| place.map(f64::from)).collect();
    let mesh = TriangleMesh { points, triangles, ..TriangleMesh::default() };
    let places: Vec<[f32; 3]> = frames.concat();
    let frames = PointFrames { points: first.len() as u32, places: places.into() };
    Ok(Moving { mesh, frames, joined, warnings })
}
