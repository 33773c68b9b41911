//! Scenes in which the step is what fails.

use nappe_sim::{
    cloth::{Hessian, Integrator, Minimizer, Network},
    math::Precision,
    report::NoStopwatch,
    time_step::TimeStep,
};

use super::{
    finding::Finding,
    networks::{DrapSprings, chain, drap, scatter, sheet, sheet_rules},
    row::{GRAVITY, Row, stepped},
    scene::positions,
    trial::Trial,
};
use crate::{
    method::{Method, NEWTON},
    run::Verdict,
};

/// The critical step of the course's cloth at rest (s), of which its linear motion bears 2 / w.
const CRITICAL: f64 = 6.71e-3;

pub(super) const SCENES: [Row<Method>; 9] = [
    Row {
        number: 1,
        what: "a step 1.5 times the critical one (course cloth, small velocities)",
        run: beyond_the_critical_step,
    },
    Row { number: 2, what: "tension that stiffens: 0.95 of the critical step at rest, loaded", run: loaded },
    Row { number: 3, what: "an undamped spring", run: undamped },
    Row { number: 4, what: "springs damped beyond measure (1000 N s/m)", run: overdamped },
    Row {
        number: 5,
        what: "compressed springs with their exact tangent, dt = 1/30 s",
        run: compressed_with_its_exact_tangent,
    },
    Row { number: 6, what: "a chain with an end 1000 times as heavy", run: heavy_end },
    Row { number: 7, what: "order on a damped spring", run: order },
    Row { number: 8, what: "20 000 steps in f32", run: long },
    Row {
        number: 41,
        what: "the undamped cloth of the course, in steps of 10 ms for 4 s",
        run: undamped_cloth,
    },
];

fn probed(damping: f64) -> Network {
    let mut network = drap(10, DrapSprings::Faces, damping);
    let pins = network.pins.clone();
    for (i, v) in network.v.iter_mut().enumerate().filter(|(i, _)| !pins.contains(&(*i as u32))) {
        *v = [0, 1, 2].map(|c| 1e-3 * scatter(3 * i + c));
    }
    network
}

fn beyond_the_critical_step(method: Method) -> Finding {
    Trial::new(stepped(probed(0.0), 1.5 * CRITICAL, method), 200).run()
}

fn undamped_cloth(method: Method) -> Finding {
    let network = drap(10, DrapSprings::Faces, 0.0);
    Trial::new(stepped(network, 0.01, method).under(GRAVITY), 400).run()
}

fn loaded(method: Method) -> Finding {
    let network = drap(10, DrapSprings::Faces, 0.0);
    Trial::new(stepped(network, 0.95 * CRITICAL, method).under(GRAVITY), 200).run()
}

/// A particle of 1 kg on a spring of 1 m and 100 N/m, pulled by 1 cm.
fn spring(damping: f64) -> Network {
    let mut network = chain(&[[0.0; 3], [1.01, 0.0, 0.0]], 1.0, 100.0, damping, 1.0);
    network.pins = vec![0];
    network
}

fn undamped(method: Method) -> Finding {
    Trial::new(stepped(spring(0.0), 0.01, method), 1000).run()
}

fn overdamped(method: Method) -> Finding {
    Trial::new(stepped(probed(1000.0), 0.005, method), 100).run()
}

fn compressed_with_its_exact_tangent(method: Method) -> Finding {
    if !method.integrator.is_implicit() {
        return Finding::NONE;
    }
    let method = Method { hessian: Hessian::Full, ..method };
    let network = drap(10, DrapSprings::Faces, 0.0);
    Trial::new(stepped(network, 1.0 / 30.0, method).under(GRAVITY), 60).run()
}

fn heavy_end(method: Method) -> Finding {
    let x: Vec<_> = (0..20).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.1, 1.5e4, 0.0, 0.01);
    network.masses[19] = 10.0;
    network.pins = vec![0];
    Trial::new(stepped(network, 1.0 / 60.0, method).under(GRAVITY), 60).run()
}

fn order(method: Method) -> Finding {
    let (damping, time) = (2.0, 0.5_f64);
    let minimizer = if matches!(method.minimizer, Minimizer::Newton(_)) { NEWTON } else { method.minimizer };
    let method = Method { minimizer, ..method };
    let error = |steps: u32| {
        let mut scene = stepped(spring(damping), time / f64::from(steps), method);
        scene.settings.time_step = TimeStep::Unchecked(f64::INFINITY);
        let mut simulation = scene.simulate(Precision::F64);
        if (0..steps).any(|_| simulation.step(&mut NoStopwatch).is_err()) {
            return f64::NAN;
        }
        // Let go at rest: x = e^(-c t / 2) (cos w t + c sin w t / (2 w)), c per kg.
        let w = (100.0 - damping * damping / 4.0).sqrt();
        let exact =
            (-damping * time / 2.0).exp() * ((w * time).cos() + damping * (w * time).sin() / (2.0 * w));
        (positions(&simulation)[1][0] - 1.0 - 0.01 * exact).abs()
    };
    let order = (error(512) / error(1024)).log2();
    let expected = method.order(damping);
    Finding::new(Verdict::Survived, format!("{order:.1}"))
        .only_if(|| (order - expected).abs() < 0.05, || format!("{order:.2}, not {expected}"))
}

fn long(method: Method) -> Finding {
    let mut network = sheet(4, 0.1, &sheet_rules(20.0, 0.0), 0.01);
    // Explicit Euler takes steps in damped motion alone.
    network.drag = if method.integrator == Integrator::ExplicitEuler { 0.01 } else { 0.0 };
    let held: Vec<_> = network.pins.iter().map(|pin| (*pin as usize, network.x[*pin as usize])).collect();
    let trial = Trial::new(stepped(network, 2e-3, method).under(GRAVITY), 20_000);
    let trial = Trial { precision: Precision::F32, ..trial };
    let mut strayed = 0.0;
    let finding = trial.run_with(|simulation, _| {
        let x = positions(simulation);
        let distance = held.iter().map(|(pin, at)| (x[*pin][0] - at[0]).abs() + (x[*pin][1] - at[1]).abs());
        strayed = distance.fold(strayed, f64::max);
    });
    finding.only_if(|| strayed < 1e-7, || format!("a pin strayed by {strayed:e} m"))
}
