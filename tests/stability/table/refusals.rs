//! Scenes that are judged before their first step.

use nappe_sim::{cloth::Network, math::Precision, world::Simulation};
use nappe_tests::{
    Scene,
    networks::{sheet, sheet_rules, spring},
};

/// The step of the scene (s), and what is spoilt of its sheet.
type Spoil = fn(&mut Network, &mut f64);

const SCENES: [(&str, Spoil); 12] = [
    ("10. a mass below 0", |n, _| n.masses[4] = -0.01),
    ("10. a mass that is not a number", |n, _| n.masses[4] = f64::NAN),
    ("10. a particle without springs", |n, _| n.springs.retain(|s| !s.particles.contains(&4))),
    ("11. a position that is not a number", |n, _| n.x[4][1] = f64::NAN),
    ("11. a stiffness below 0", |n, _| n.springs[3].law.stiffness = -1.0),
    ("11. a stiffness that is not finite", |n, _| n.springs[3].law.stiffness = f64::INFINITY),
    ("11. a time step below 0", |_, dt| *dt = -1e-3),
    ("11. a time step that is not a number", |_, dt| *dt = f64::NAN),
    ("11. a spring to a particle that is not there", |n, _| n.springs[3].particles[1] = 99),
    ("11. a spring from a particle to itself", |n, _| n.springs.push(spring([4, 4], 0.1, 50.0, 0.0))),
    ("11. a spring twice", |n, _| n.springs.push(n.springs[3])),
    ("16. 100 km from the origin in f32", |n, _| n.x.iter_mut().for_each(|x| x[0] += 1e5)),
];

/// Rows: what is wrong, and what is said.
pub(super) fn table() -> String {
    let row = |(what, spoil): &(&str, Spoil)| {
        let (mut network, mut dt) = (sheet(3, 0.1, &sheet_rules(50.0, 0.0), 0.01), 1e-3);
        spoil(&mut network, &mut dt);
        let says = match Simulation::new(&Scene::new(network, dt).setup(), Precision::F32) {
            Ok((_, warnings)) => format!("warns: {}", warnings.join("; ")),
            Err(error) => format!("refuses: {error}"),
        };
        format!("| {what} | {says} |\n")
    };
    SCENES.iter().map(row).collect()
}
