//! Free particles on a square, falling: frames without work.

use nappe_client::{Client, MeshUpload};
use nappe_scene::{Body, Mass, Mesh, Scene};
use nappe_sim::cloth::Integrator;

use crate::words::error::Result;

/// A scene of free particles, whose step is `dt` (s), with a frame every `frame_interval` steps.
///
/// # Errors
/// When the server refuses their number.
pub(super) async fn cloud(
    client: &Client,
    particles: usize,
    dt: f64,
    frame_interval: u32,
) -> Result<nappe_client::Scene> {
    let side = (particles as f64).sqrt().ceil() as usize;
    let points = (0..particles).map(|i| [(i % side) as f64 * 0.01, 0.0, (i / side) as f64 * 0.01]).collect();
    let mesh = MeshUpload { name: "cloud".to_owned(), points, ..MeshUpload::default() };
    // The mesh has no triangles on purpose, so the warnings about that are left out.
    let upload = client.upload_mesh(&mesh).await?.mesh_id;
    let body = Body {
        mass: Some(Mass::Particle(0.01)),
        integrator: Integrator::SymplecticEuler,
        ..Body::new("cloud", Mesh::upload(upload))
    };
    let title = "free particles".to_owned();
    let scene = Scene { title, dt, frame_interval, bodies: vec![body], ..Scene::default() };
    Ok(nappe_client::Scene::Text(scene.to_toml()))
}
