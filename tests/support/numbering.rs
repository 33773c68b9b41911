//! Other numberings of the particles of a network, and other orders of its springs and triangles.

use nappe_sim::cloth::{Network, Spring};

/// How particles are called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Numbering {
    /// As they were built.
    AsBuilt,
    /// The last one first.
    Reversed,
    /// In leaps that visit each particle once.
    Shuffled,
}

impl Numbering {
    /// Every numbering, the one that meshes are built with first.
    pub const ALL: [Self; 3] = [Self::AsBuilt, Self::Reversed, Self::Shuffled];

    /// The new number of each of `count` particles.
    pub fn of(self, count: usize) -> Vec<usize> {
        match self {
            Self::AsBuilt => (0..count).collect(),
            Self::Reversed => (0..count).rev().collect(),
            Self::Shuffled => shuffled(count),
        }
    }
}

/// A permutation of `count` numbers: multiples of a number prime to the count.
pub fn shuffled(count: usize) -> Vec<usize> {
    let stride = (count / 3..count).find(|s| gcd(*s, count) == 1).unwrap_or(1);
    (0..count).map(|i| (i * stride + 7) % count).collect()
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// The same network with particle i called `to[i]`, springs reversed and in another order, triangles turned on and in another
/// order.
pub fn renumbered(network: &Network, to: &[usize]) -> Network {
    assert!(network.elements.is_empty(), "a network of springs alone");
    let mut other = network.clone();
    for (i, &new) in to.iter().enumerate() {
        (other.x[new], other.v[new], other.masses[new]) = (network.x[i], network.v[i], network.masses[i]);
    }
    for (i, &new) in to.iter().enumerate().take(network.uv.len()) {
        other.uv[new] = network.uv[i];
    }

    other.pins = network.pins.iter().map(|&pin| to[pin as usize] as u32).collect();
    let spring = |i: usize| {
        let old = &network.springs[i];
        let [a, b] = old.particles.map(|p| to[p as usize] as u32);
        Spring { particles: [b, a], ..*old }
    };
    other.springs = shuffled(network.springs.len()).into_iter().map(spring).collect();
    let triangle = |i: usize| {
        let [a, b, c] = network.triangles[i].map(|p| to[p as usize] as u32);
        [b, c, a]
    };
    other.triangles = shuffled(network.triangles.len()).into_iter().map(triangle).collect();
    other
}
