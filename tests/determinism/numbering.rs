//! The user's numbering of particles, and the order and direction of springs, change no bit.

use nappe_sim::{cloth::Network, math::Precision};
use nappe_tests::{
    Method, Scene,
    scene::{advance, positions, velocities},
};

use crate::scenes::scene;

/// A permutation of `count` numbers: multiples of a number prime to the count.
fn shuffled(count: usize) -> Vec<usize> {
    let stride = (count / 3..count).find(|s| gcd(*s, count) == 1).expect("count - 1 is prime to it");
    (0..count).map(|i| (i * stride + 7) % count).collect()
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// The same network with particle i called `to[i]`, springs reversed and in another order.
fn renumbered(network: &Network, to: &[usize]) -> Network {
    let mut other = network.clone();
    for (i, &new) in to.iter().enumerate() {
        (other.x[new], other.v[new], other.masses[new]) = (network.x[i], network.v[i], network.masses[i]);
    }
    other.pins = network.pins.iter().map(|&pin| to[pin as usize] as u32).collect();
    for spring in &mut other.springs {
        let [a, b] = spring.particles.map(|p| to[p as usize] as u32);
        spring.particles = [b, a];
    }
    let order = shuffled(other.springs.len());
    other.springs = order.iter().map(|&i| other.springs[i]).collect();
    other
}

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
