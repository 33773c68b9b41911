//! Figures: bodies that frames lead.

use std::f64::consts::PI;

use nappe_sim::{
    cloth::{Frames, Network, Repeat},
    mesh::TriangleMesh,
    world::WorldSetup,
};

use super::bodies::of_bodies;
use crate::{Scene, scene::difference, sheets::Sheet};

/// How high (m) the plate rises of [`sheet_on_a_plate`].
pub const RISE: f64 = 0.1;
/// The thickness (m) of that plate and of the sheet on it.
pub const THICKNESS: f64 = 2e-3;

/// A figure of these triangles whose points are there in each frame (m), so many frames in a second from the start on.
pub fn figure(triangles: &[[u32; 3]], frames: &[Vec<[f64; 3]>], rate: f64, repeat: Repeat) -> Network {
    let places: Vec<[f32; 3]> = frames.iter().flatten().map(|place| place.map(|c| c as f32)).collect();
    let count = frames[0].len();
    let corners = count as u32;
    let frames =
        Frames { places: places.clone().into(), corners, rate, start: 0.0, repeat, masses: [].into() };
    Network {
        x: places[..count].iter().map(|place| place.map(f64::from)).collect(),
        v: vec![[0.0; 3]; count],
        masses: vec![0.0; count],
        triangles: triangles.to_vec(),
        frames: Some(frames),
        ..Network::default()
    }
}

/// A level plate that rises within half a second, softly, and a sheet of 100 particles that lies on it, the first body.
pub fn sheet_on_a_plate(scene: &Scene) -> WorldSetup {
    let plate = TriangleMesh::grid(6, 6, 0.06);
    let frame = |number: u32| {
        let height = 0.5 * RISE * (1.0 - (PI * f64::from(number) / 10.0).cos());
        plate.points.iter().map(|[x, _, z]| [x - 0.15, height, z - 0.15]).collect::<Vec<[f64; 3]>>()
    };
    let frames: Vec<Vec<[f64; 3]>> = (0..=10).map(frame).collect();
    let plate = figure(&plate.triangles, &frames, 20.0, Repeat::Hold);
    let middle = [0.004, 1.2 * THICKNESS, 0.007];
    let sheet = Sheet { ripple: 2e-4, ..Sheet::level(10, 0.02, middle, 0.2) }.network();
    of_bodies(scene, vec![("sheet", sheet, THICKNESS), ("plate", plate, THICKNESS)])
}

/// The same world with figures that give way, of a firmness (N/m³).
#[must_use]
pub fn giving_way(mut setup: WorldSetup, firmness: f64) -> WorldSetup {
    let dt = setup.dt;
    for body in &mut setup.bodies {
        let network = &mut body.network;
        let frames = network.frames.take();
        network.frames = frames.map(|frames| frames.giving_way(&network.triangles, firmness, dt));
    }
    setup
}

/// How far (m) each corner of the last body of a world, a figure, is off its frame at a time (s).
///
/// # Panics
/// If it is no figure.
pub fn off_frames(setup: &WorldSetup, x: &[[f64; 3]], time: f64) -> Vec<[f64; 3]> {
    let frames = setup.bodies.last().and_then(|body| body.network.frames.as_ref()).expect("a figure");
    let corners = &x[x.len() - frames.corners as usize..];
    corners.iter().zip(frames.at(time)).map(|(corner, place)| difference(*corner, place)).collect()
}
