//! The snow that is timed: a ball of the snow of Stomakhin et al. 2013, in flight towards a surface. It has eight
//! particles per cell.
//!
//! Reads a number of particles and the side of a cell (m); writes a world ready to be built.

use std::f64::consts::PI;

use nappe_sim::{
    collide::{Collider, Contact, Shape, StartInside, shape::Plane},
    snow::{Preset, SnowObject, SnowSettings, SnowSetup},
    world::WorldSetup,
};

use crate::words::error::{CliError, Result};

/// Particles per cell.
const PER_CELL: f64 = 8.0;
/// Distance between the ball and the surface that it flies to (cells).
const GAP_CELLS: f64 = 1.0;

/// A ball of snow in flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Throw {
    /// Number of particles, above 0.
    pub(crate) particles: usize,
    /// Side of a cell (m).
    pub(crate) cell: f64,
    /// Velocity of every particle (m/s).
    pub(crate) velocity: [f64; 3],
    /// Time step of the world (s).
    pub(crate) dt: f64,
    /// Unit normals of the surfaces, each a cell away from the ball.
    pub(crate) normals: &'static [[f64; 3]],
}

impl Throw {
    /// Radius of the ball (m): particles / 8 cells fill it.
    pub(crate) fn radius(&self) -> f64 {
        let volume = self.particles as f64 / PER_CELL * self.cell.powi(3);
        (3.0 * volume / (4.0 * PI)).cbrt()
    }

    /// The world, with the ball around the origin.
    ///
    /// # Errors
    /// When the program has no snow of Stomakhin et al., which would be an error in it.
    pub(crate) fn world(&self) -> Result<WorldSetup> {
        let preset = Preset::from_name("stomakhin")
            .ok_or_else(|| CliError::failure("the preset 'stomakhin' of snow is missing"))?;
        let volume = self.cell.powi(3) / PER_CELL;
        let count = self.particles;

        let ball = SnowObject {
            name: "ball".to_owned(),
            x: self.points(),
            v: vec![self.velocity; count],
            angular_velocity: [0.0; 3],
            mass: vec![preset.density * volume; count],
            volume: vec![volume; count],
            stiffness: Vec::new(),
            material: preset.material,
            attach: None,
        };
        Ok(WorldSetup {
            dt: self.dt,
            gravity: [0.0, -9.81, 0.0],
            wind_at: Vec::new(),
            wind: [0.0; 3],
            colliders: self.normals.iter().map(|normal| self.surface(*normal)).collect(),
            bodies: Vec::new(),
            snow: Some(SnowSetup { objects: vec![ball], settings: SnowSettings::new(self.cell) }),
        })
    }

    fn surface(&self, normal: [f64; 3]) -> Collider {
        let distance = self.radius() + GAP_CELLS * self.cell;
        Collider {
            name: format!("surface {normal:?}"),
            shape: Shape::Plane(Plane { point: normal.map(|c| -c * distance), normal }),
            velocity: [0.0; 3],
            way: None,
            friction: 0.4,
            restitution: 0.0,
            margin: 0.0,
            contact: Contact::Separating,
            recovery: Collider::RECOVERY,
            on_start_inside: StartInside::Warn,
        }
    }

    /// The points of a lattice that are nearest to its middle, each moved within the cube that it has to itself.
    fn points(&self) -> Vec<[f64; 3]> {
        let spacing = self.cell / PER_CELL.cbrt();
        // Enough of the lattice for the ball and what its corners cut off.
        let half = (self.radius() / spacing).ceil() as i32 + 1;
        let line = -half..half;
        let mut lattice: Vec<[i32; 3]> = line
            .clone()
            .flat_map(|x| line.clone().flat_map(move |y| (-half..half).map(move |z| [x, y, z])))
            .collect();

        // Twice the distance from the middle, which is between points: whole numbers, so no two ways to sort.
        let far = |point: &[i32; 3]| (point.map(|i| (2 * i + 1).pow(2)).iter().sum::<i32>(), *point);
        lattice.select_nth_unstable_by_key(self.particles - 1, far);
        lattice.truncate(self.particles);
        lattice.sort_unstable();

        let mut random = fastrand::Rng::with_seed(self.particles as u64);
        lattice.into_iter().map(|point| point.map(|i| spacing * (f64::from(i) + random.f64()))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_has_its_particles_its_radius_and_its_middle() {
        let throw = Throw {
            particles: 20_000,
            cell: 0.01,
            velocity: [0.0; 3],
            dt: 1e-3,
            normals: &[[0.0, 1.0, 0.0]],
        };
        let world = throw.world().expect("the preset is there");
        let ball = &world.snow.expect("snow").objects[0];
        assert_eq!((ball.x.len(), ball.v.len(), ball.mass.len()), (20_000, 20_000, 20_000));

        let far = |point: &[f64; 3]| point.iter().map(|c| c * c).sum::<f64>().sqrt();
        let reach = ball.x.iter().map(far).fold(0.0, f64::max);
        // A point may stand half a spacing beyond the ball, and be moved by a diagonal half of its cube.
        assert!((reach - throw.radius()).abs() < 0.01, "{reach} for {}", throw.radius());

        let middle: Vec<f64> =
            (0..3).map(|axis| ball.x.iter().map(|x| x[axis]).sum::<f64>() / 20_000.0).collect();
        // The last shell may be full on one side only: well below a tenth of the spacing of 5 mm.
        assert!(middle.iter().all(|c| c.abs() < 5e-4), "{middle:?}");

        let mass: f64 = ball.mass.iter().sum();
        let expected = 400.0 * 4.0 / 3.0 * PI * throw.radius().powi(3);
        assert!((mass / expected - 1.0).abs() < 1e-12, "{mass} kg");
    }
}
