//! Scenes in which what happens on the way is what fails: falls, contact, pins that are moved.

use nappe_sim::{
    cloth::OnPass,
    collide::{Collider, Contact, Shape, StartInside, shape::Cuboid},
    world::Change,
};

use super::{
    finding::Finding,
    networks::{sheet, sheet_rules},
    row::{GRAVITY, Row, stepped},
    scene::{difference, norm, positions},
    trial::Trial,
};
use crate::method::Method;

pub(super) const SCENES: [Row<Method>; 4] = [
    Row { number: 27, what: "a stiff sheet that falls upright: how far of g t² / 2", run: upright },
    Row { number: 28, what: "a sheet that falls onto a table", run: onto_a_table },
    Row { number: 29, what: "a rag flung over a thin table in long steps", run: flung },
    Row { number: 30, what: "a hung sheet whose pins are moved by its width", run: moved_pins },
];

fn upright(method: Method) -> Finding {
    let mut network = sheet(16, 0.05, &sheet_rules(1e4, 0.01), 0.005);
    network.pins.clear();
    network.x.iter_mut().for_each(|x| x.swap(1, 2));
    // Explicit Euler takes steps in damped motion alone.
    let dt = 1.0 / 60.0;
    let height = |x: &[[f64; 3]]| x.iter().map(|x| x[1]).sum::<f64>() / x.len() as f64;
    let (start, mut fallen) = (height(&network.x), 0.0);
    let trial = Trial::new(stepped(network, dt, method).under(GRAVITY), 60);
    let finding = trial.run_with(|simulation, _| fallen = start - height(&positions(simulation)));
    let share = fallen / (0.5 * 9.81);
    // Methods of order 1 fall g t h / 2 farther.
    finding
        .with(&format!("{share:.3}"))
        .only_if(|| (share - 1.0).abs() < 1.01 * dt, || format!("{share:.3} of it"))
}

/// A table whose top is at y = 0.
fn table(half_extent: [f64; 3]) -> Collider {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let top = Cuboid { center: [0.0, -half_extent[1], 0.0], half_extent, axes };
    Collider {
        name: "table".to_owned(),
        shape: Shape::Box(top),
        velocity: [0.0; 3],
        way: None,
        friction: 0.3,
        restitution: 0.0,
        margin: 5e-3,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    }
}

fn onto_a_table(method: Method) -> Finding {
    let mut network = sheet(10, 0.05, &sheet_rules(100.0, 0.02), 0.005);
    network.pins.clear();
    network.x.iter_mut().for_each(|x| *x = [x[0] - 0.225, 0.1, x[2] - 0.225]);
    network.drag = 0.005;
    let mut scene = stepped(network, 1.0 / 60.0, method).under(GRAVITY);
    scene.colliders = vec![table([1.0, 0.1, 1.0])];
    let (mut lowest, mut passed) = (f64::INFINITY, 0);
    let finding = Trial::new(scene, 60).run_with(|simulation, report| {
        lowest = positions(simulation).iter().map(|x| x[1]).fold(lowest, f64::min);
        passed += report.notices.passed_count;
    });
    finding.only_if(|| lowest > 4e-3 && passed == 0, || format!("at {lowest:.1e} m, {passed} passed"))
}

fn flung(method: Method) -> Finding {
    let mut network = sheet(10, 0.05, &sheet_rules(100.0, 0.02), 0.005);
    network.pins.clear();
    network.x.iter_mut().for_each(|x| *x = [x[0] - 0.225, 0.3, x[2] - 0.225]);
    network.v = vec![[0.0, -4.0, 0.0]; network.x.len()];
    network.drag = 0.005;
    let mut scene = stepped(network, 0.1, method).under(GRAVITY);
    scene.colliders = vec![table([1.0, 0.02, 1.0])];
    scene.settings.on_pass = OnPass::Reject;
    let mut lowest = f64::INFINITY;
    let finding = Trial::new(scene, 10)
        .run_with(|simulation, _| lowest = positions(simulation).iter().map(|x| x[1]).fold(lowest, f64::min));
    finding.only_if(|| lowest > 4e-3, || format!("at {lowest:.1e} m"))
}

fn moved_pins(method: Method) -> Finding {
    let side = 8;
    let network = sheet(side, 0.1, &sheet_rules(200.0, 0.05), 0.01);
    let pins = network.pins.clone();
    let targets: Vec<_> =
        pins.iter().map(|pin| network.x[*pin as usize]).map(|[x, y, z]| [x, y + 0.7, z]).collect();
    let weight = 9.81 * network.masses.iter().sum::<f64>();
    let mut trial = Trial::new(stepped(network, 1.0 / 60.0, method).under(GRAVITY), 90);
    trial.changes = pins
        .iter()
        .zip(&targets)
        .map(|(pin, target)| (10, Change::Pin { particle: *pin, target: *target, duration: 0.5 }))
        .collect();
    // They lift it by their way at most, against twice its weight.
    trial.given = 2.0 * 0.7 * weight;
    let mut off = f64::INFINITY;
    let finding = trial.run_with(|simulation, _| {
        let x = positions(simulation);
        let distance = |pin: u32, target: [f64; 3]| norm(difference(x[pin as usize], target));
        let distances = pins.iter().zip(&targets).map(|(pin, target)| distance(*pin, *target));
        off = distances.fold(0.0, f64::max);
    });
    finding.only_if(|| off < 1e-12, || format!("{off:.1e} m from where they are sent"))
}
