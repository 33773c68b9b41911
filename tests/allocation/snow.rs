//! Worlds of snow whose steps are counted: blocks that slide over a floor.

use nappe_sim::{
    collide::Contact,
    linalg::Stop,
    math::Precision,
    snow::{Integration, Preset},
    time_step::TimeStep,
    world::Simulation,
};
use nappe_tests::snow::{SnowScene, Variant, lattice, object, plane};

/// What is counted: name and simulation, for every transfer, kernel and integration.
pub(crate) fn simulations(precision: Precision) -> Vec<(String, Simulation)> {
    let stop = Stop::Residual { tolerance: 1e-3, max_iterations: 200 };
    let implicit = Integration::SemiImplicit { beta: 1.0, stop };
    let mut all = Vec::new();
    for variant in Variant::all() {
        all.push((
            format!("{} explicit", variant.name()),
            simulation(variant, Integration::Explicit, precision),
        ));
    }

    for variant in Variant::affine() {
        all.push((format!("{} semi-implicit", variant.name()), simulation(variant, implicit, precision)));
    }

    all
}

/// What ranks can step of that: name and scene, for every transfer and kernel.
pub(crate) fn scenes_for_ranks() -> Vec<(String, SnowScene)> {
    let named = |variant: Variant| (variant.name(), scene(variant, Integration::Explicit));
    Variant::all().into_iter().map(named).collect()
}

fn simulation(variant: Variant, integration: Integration, precision: Precision) -> Simulation {
    scene(variant, integration).simulate(precision)
}

fn scene(variant: Variant, integration: Integration) -> SnowScene {
    let h = 0.05;
    let snow = Preset::from_name("stomakhin").expect("a preset");
    let x = lattice([0.01, 0.0, 0.02], [16, 10, 14], [0.5 * h; 3]);
    let mut body = object("snow", x, (0.5 * h).powi(3), snow.density, snow.material);
    // Fast enough to change cells and blocks while steps are counted.
    body.v.fill([3.0, -0.5, 1.0]);
    let mut scene = SnowScene::new(vec![body], h, 4e-3).by(variant).under([0.0, -9.81, 0.0]);
    scene.settings.time_step = TimeStep::default();
    scene.settings.integration = integration;
    scene.colliders = vec![plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Separating, 0.3)];
    scene
}
