//! The walker that comes with nappe, in its tunic.

use nappe_scene::{NoMeshes, Scene as SceneFile, SceneLimits, shipped_scenes};
use nappe_sim::{cloth::SurfaceCheck, math::Precision, world::WorldSetup};

use super::tally::{Tally, Watched};

/// What a walk came to.
#[derive(Clone, Copy, Debug)]
pub struct Walked {
    /// What its steps told.
    pub tally: Tally,
    /// The most that anything was stretched, over its rest length.
    pub stretch: f64,
    /// How far (m) the figure gave way at most, and how many corners did at once.
    pub yields: (f64, u64),
}

/// Its world, with a coefficient of friction of cloth.
fn world(friction: f64) -> WorldSetup {
    let (_, text) = shipped_scenes().iter().find(|(name, _)| *name == "walker").expect("it is shipped");
    let scene = SceneFile::parse(text, "walker").unwrap_or_else(|error| panic!("{error}"));
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    let mut setup = built.setup;
    for body in &mut setup.bodies {
        body.settings.contact.friction = friction;
        body.settings.contact.surface = SurfaceCheck::Count;
    }
    setup
}

/// Walks so many steps.
///
/// # Panics
/// Where a step fails.
pub fn walked(precision: Precision, friction: f64, steps: u64) -> Walked {
    let mut watched = Watched::of_world(&world(friction), precision);
    let (mut stretch, mut yields) = (0.0_f64, (0.0_f64, 0));
    for _ in 0..steps {
        let report = watched.step().unwrap_or_else(|error| panic!("{error}; so far {:?}", watched.tally));
        stretch = stretch.max(report.diagnostics.max_stretch);
        let told = report.surface.unwrap_or_default();
        yields = (yields.0.max(told.yield_m), yields.1.max(told.yielding));
    }
    Walked { tally: watched.tally, stretch, yields }
}

impl Walked {
    /// What is wrong with it: crossings, more than a fiftieth of its sub-steps taken again, or a stretch above 1.3.
    pub fn complaint(&self) -> Option<String> {
        let Self { tally, stretch, .. } = self;
        let is_kept =
            [tally.crossings, tally.seen] == [0, 0] && tally.told == tally.steps && tally.active > 0;
        let is_smooth = 50 * tally.rejected <= tally.substeps + tally.rejected;
        (!(is_kept && is_smooth && *stretch <= 1.3)).then(|| format!("{self:?}"))
    }
}
