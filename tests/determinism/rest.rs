//! The same bits with cloth watched for rest and without; the same reports for any number of threads.

use nappe_sim::{
    cloth::{Hessian, Integrator, RestSettings},
    math::Precision,
    report::RestReport,
};
use nappe_tests::{
    Method, Scene,
    scene::advance,
    threads::{THREAD_COUNTS, with_threads},
};

use crate::scenes::scene;

/// Steps of every run: four whole windows and a part of one.
const STEPS: u64 = 34;

/// What every step tells, and the hash of the state after it.
fn told(scene: &Scene, precision: Precision) -> Vec<(Option<RestReport>, u64)> {
    let mut simulation = scene.simulate(precision);
    let mut step = || (advance(&mut simulation, 1).rest, simulation.state_hash());
    (0..STEPS).map(|_| step()).collect()
}

/// Scenes of several blocks by an implicit and an explicit method, by name.
fn worlds() -> Vec<(String, Scene)> {
    let methods = [Integrator::ImplicitEuler, Integrator::SymplecticEuler];
    let all = ["hung_sheet", "sheet_on_sphere"].into_iter().flat_map(|name| {
        methods.map(|integrator| {
            let method = Method::new(integrator, Hessian::Absolute);
            (format!("{name} by {}", method.name()), scene(name, method))
        })
    });
    all.collect()
}

#[test]
fn watching_for_rest_changes_no_bit() {
    for (name, plain) in worlds() {
        let mut watched = plain.clone();
        watched.settings.rest = Some(RestSettings { error: 1e-3, within: 1.0, sleep: false });
        for precision in Precision::ALL {
            let [plain, watched] = [&plain, &watched].map(|scene| told(scene, precision));
            assert!(plain.iter().all(|(rest, _)| rest.is_none()), "{name} in {precision}");
            assert!(watched.iter().all(|(rest, _)| rest.is_some()), "{name} in {precision}");
            let hashes = |told: &[(Option<RestReport>, u64)]| told.iter().map(|(_, hash)| *hash).collect();
            let [plain, watched]: [Vec<u64>; 2] = [hashes(&plain), hashes(&watched)];
            assert_eq!(plain, watched, "{name} in {precision}");
        }
    }
}

#[test]
fn what_is_told_of_rest_is_the_same_for_any_number_of_threads() {
    for (name, mut scene) in worlds() {
        scene.settings.rest = Some(RestSettings { error: 1e-3, within: 1.0, sleep: false });
        for precision in Precision::ALL {
            let alone = with_threads(1, || told(&scene, precision));
            let ways = alone.iter().filter_map(|(rest, _)| Some(rest.as_ref()?.way));
            assert!(ways.fold(0.0, f64::max) > 0.0, "{name} in {precision}: it moves");
            for threads in THREAD_COUNTS {
                let found = with_threads(threads, || told(&scene, precision));
                assert_eq!(found, alone, "{name} in {precision} on {threads} threads");
            }
        }
    }
}
