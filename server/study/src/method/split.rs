//! Particles of snow split into eight, so that cells can be halved: as many particles per cell as before.

use std::collections::BTreeSet;

use nappe_sim::snow::SnowObject;

/// Into how many particles one is split.
pub const CHILDREN: usize = 8;

/// The same object with each particle split into eight: an eighth of its mass and volume, its velocity and stiffness, a quarter
/// of the edge of its cube away along each axis. Children of a particle follow one another, in the order of particles. Where
/// volumes come from the grid, cubes fill the cells (m) that particles lie in.
#[must_use]
pub fn split(object: &SnowObject, cell: f64) -> SnowObject {
    let even = if object.volume.is_empty() { edge_in(&object.x, cell) } else { 0.0 };
    let edge = |i: usize| object.volume.get(i).map_or(even, |volume| volume.cbrt());
    let place = |(i, x): (usize, &[f64; 3])| {
        let away = 0.25 * edge(i);
        let side = move |child: usize, axis: usize| if child >> axis & 1 == 0 { -away } else { away };
        let x = *x;
        (0..CHILDREN).map(move |child| [0, 1, 2].map(|axis| x[axis] + side(child, axis)))
    };
    let shared =
        |values: &[f64], share: f64| values.iter().flat_map(|value| [share * value; CHILDREN]).collect();
    let eighth = 1.0 / CHILDREN as f64;
    SnowObject {
        name: object.name.clone(),
        x: object.x.iter().enumerate().flat_map(place).collect(),
        v: object.v.iter().flat_map(|v| [*v; CHILDREN]).collect(),
        angular_velocity: object.angular_velocity,
        mass: shared(&object.mass, eighth),
        volume: shared(&object.volume, eighth),
        stiffness: shared(&object.stiffness, 1.0),
        material: object.material,
        attach: object.attach.clone(),
    }
}

/// The edge (m) of as many cubes as there are particles that fill the cells (m) that these lie in.
fn edge_in(x: &[[f64; 3]], cell: f64) -> f64 {
    let cells: BTreeSet<[i64; 3]> = x.iter().map(|x| x.map(|c| (c / cell).floor() as i64)).collect();
    cell * (cells.len() as f64 / x.len().max(1) as f64).cbrt()
}

/// Where particles are that were split so often: the mean of their children's positions (m), x y z per particle.
#[must_use]
pub fn parents(positions: Vec<f64>, halvings: u32) -> Vec<f64> {
    if halvings == 0 {
        return positions;
    }
    let count = CHILDREN.pow(halvings);
    let mean = |children: &[f64]| {
        [0, 1, 2].map(|axis| children.iter().skip(axis).step_by(3).sum::<f64>() / count as f64)
    };
    positions.chunks_exact(3 * count).flat_map(mean).collect()
}
