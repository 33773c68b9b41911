//! Snow at random: clumps and blocks of every law, transfer and kernel.

use nappe_scene::{AdvectionName, BoxText, MaterialText, Sampling, Snow, SnowBody, SnowSource, TransferName};
use nappe_sim::snow::{Kernel, Law};

use super::Case;
use crate::Random;

const PRESETS: [&str; 6] =
    ["stomakhin", "taichi_snow", "genesis_snow", "newton_snowball", "elastic", "brasseur_neo_hookean"];

/// Adds snow to a scene; returns its size (m).
pub(super) fn add(random: &mut Random, case: &mut Case) -> f64 {
    let cell = random.decades(0.01, 0.2);
    let objects: Vec<_> = (0..random.whole(1, 2)).map(|number| object(random, cell, number)).collect();
    let mut snow = Snow::new(cell, objects);
    snow.kernel = random.pick(&[Kernel::Quadratic, Kernel::Quadratic, Kernel::Cubic]);
    snow.transfer =
        random.pick(&[TransferName::Mls, TransferName::Mls, TransferName::Apic, TransferName::PicFlip]);
    if snow.transfer == TransferName::PicFlip {
        snow.flip = Some(random.pick(&[0.0, 0.5, 0.95, 1.0]));
        snow.advection = random.chance(0.5).then_some(AdvectionName::Grid);
    }
    if random.chance(0.25) {
        snow.beta = random.pick(&[0.5, 1.0]);
    }
    snow.max_substeps = 300;
    case.scene.snow = Some(snow);
    // A step of the scene is a few of the snow.
    4.0 * cell
}

fn object(random: &mut Random, cell: f64, number: u32) -> SnowBody {
    let center = random.vector().map(|c| 3.0 * cell * c);
    let source = match random.whole(0, 1) {
        0 => SnowSource::Sphere { center, radius: cell * random.between(0.9, 1.8) },
        _ => SnowSource::Box(BoxText::Centered {
            center,
            size: [0; 3].map(|_| cell * random.between(0.5, 4.0)),
        }),
    };
    let mut body = SnowBody::new(format!("s{number}"), source);
    body.sampling = random.pick(&[Sampling::Jittered, Sampling::Lattice, Sampling::Poisson]);
    body.particles_per_cell = Some(random.pick(&[2.0, 4.0, 8.0]));
    body.seed = random.whole(0, 1000);
    let speed = if random.chance(0.4) { 0.0 } else { random.decades(0.01, 3.0) };
    body.velocity = random.direction().map(|c| speed * c);
    if random.chance(0.2) {
        body.angular_velocity = random.direction().map(|c| random.decades(0.1, 10.0) * c);
    }
    body.material = MaterialText {
        preset: random.pick(&PRESETS).to_owned(),
        law: random.chance(0.3).then(|| random.pick(&[Law::FixedCorotated, Law::NeoHookean])),
        young: Some(random.decades(1e3, 1e6)),
        ..MaterialText::default()
    };
    body
}
