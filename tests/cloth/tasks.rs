//! The tasks of a step, each by itself: all that its methods have, in their order, with the state as it was.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    math::Precision,
    report::Task,
};
use nappe_tests::{
    Method, Scene,
    networks::{sheet, sheet_rules},
    scene::advance,
};

#[test]
fn tasks_are_those_of_the_method_and_leave_the_state_as_it_is() {
    let explicit = vec![Task::Room, Task::Force, Task::Acceleration, Task::Velocity, Task::Position];
    let implicit: Vec<_> = explicit.iter().copied().chain([Task::ForceAndMatrix, Task::Solve]).collect();
    for integrator in Integrator::ALL {
        let network = sheet(9, 0.05, &sheet_rules(200.0, 0.01), 0.01);
        let method = Method::new(integrator, Hessian::Absolute);
        let scene = Scene::new(network, 1e-4).by(method).under([0.3, -9.81, 0.0]);
        for precision in Precision::ALL {
            let mut simulation = scene.simulate(precision);
            let mut beside = scene.simulate(precision);
            advance(&mut simulation, 3);
            advance(&mut beside, 3);

            let before = simulation.state_hash();
            let mut done = Vec::new();
            simulation.tasks(&mut |task| done.push(task));
            assert_eq!(&done, if integrator.is_implicit() { &implicit } else { &explicit }, "{integrator:?}");
            assert_eq!(simulation.state_hash(), before, "{integrator:?}");

            advance(&mut simulation, 3);
            advance(&mut beside, 3);
            assert_eq!(simulation.state_hash(), beside.state_hash(), "{integrator:?}");
        }
    }
}
