//! The user's numbering of particles, and the order and direction of springs, change no bit.

use nappe_sim::math::Precision;
use nappe_tests::{
    Method, Scene,
    numbering::{renumbered, shuffled},
    scene::{advance, positions, velocities},
};

use crate::scenes::scene;

#[test]
fn another_numbering_gives_the_same_bits() {
    for name in ["hung_sheet", "course_cloth"] {
        for method in Method::all() {
            for precision in Precision::ALL {
                let first = scene(name, method);
                let to = shuffled(first.network.x.len());
                let second = Scene { network: renumbered(&first.network, &to), ..first.clone() };
                let [first, second] = [first, second].map(|scene| {
                    let mut simulation = scene.simulate(precision);
                    advance(&mut simulation, 10);
                    (positions(&simulation), velocities(&simulation))
                });
                for (i, &new) in to.iter().enumerate() {
                    let same = (first.0[i], first.1[i]) == (second.0[new], second.1[new]);
                    assert!(same, "{name} by {} in {precision}: particle {i}", method.name());
                }
            }
        }
    }
}
