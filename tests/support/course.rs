//! The course's data, which the project does not ship: looked for beside the repository.

use std::path::PathBuf;

use nappe_scene::{
    Scene, SceneLimits,
    files::{Folder, ReadOptions, load_mesh},
};
use nappe_sim::collide::Collider;

/// The folder `../shared/course` beside the repository, or nothing after a message.
#[allow(clippy::print_stderr, reason = "a test that is skipped says so")]
pub fn folder(test: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/course");
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("{test}: skipped, ../shared/course is absent");
    None
}

/// An object of the course as a scene makes a collider of it: its holes closed, 1 m high, its middle above the origin and its
/// lowest point at the height 0. Nothing after a message.
pub fn solid(test: &str, name: &str, friction: f64, margin: f64) -> Option<Collider> {
    let folder = folder(test)?.join("data");
    let options = ReadOptions::default();
    let loaded = load_mesh(&folder.join(name), &options).unwrap_or_else(|error| panic!("{error}"));
    let end = |c: usize, least: fn(f64, f64) -> f64, from: f64| {
        loaded.mesh.points.iter().map(|point| point[c]).fold(from, least)
    };
    let low = [0, 1, 2].map(|c| end(c, f64::min, f64::INFINITY));
    let high = [0, 1, 2].map(|c| end(c, f64::max, f64::NEG_INFINITY));
    let scale = 1.0 / (high[1] - low[1]);
    let [x, z] = [0, 2].map(|c| -scale * f64::midpoint(low[c], high[c]));
    let y = -scale * low[1];
    let text = format!(
        "version = 1\ndt = 0.01\n[[body]]\nname = \"grain\"\nmesh = {{ chain = 1, spacing = 1 }}\n\
         transform = {{ translate = [0, 100, 0] }}\nmass = {{ particle = 1 }}\n[[collider]]\nname = \"{name}\"\n\
         mesh = {{ file = \"{name}\", close_holes = true, transform = {{ scale = {scale}, translate = [{x}, {y}, {z}] }} }}\n\
         friction = {friction}\nmargin = {margin}\n"
    );
    let scene = Scene::parse(&text, name).unwrap_or_else(|error| panic!("{error}"));
    let built = scene.build(&Folder { folder, options }, &SceneLimits::default());
    let setup = built.unwrap_or_else(|error| panic!("{error}")).setup;
    setup.colliders.into_iter().next()
}
