//! A stranger 100 m away, at rest or on its way: nothing here knows of it, to the bit.

use nappe_sim::{
    cloth::{ClothSettings, Network},
    collide::{Collider, Contact, Shape, StartInside, shape::Sphere},
    world::BodySetup,
};
use nappe_tests::{Random, at_random::World};

use crate::law::{Law, Verdict, WORK, alike};

pub(crate) const LAW: Law = Law { name: "stranger", judge };

fn judge(world: &World) -> Result<Verdict, String> {
    let (world, first) = world.run_within(WORK)?;
    let same = |stranger: World| -> Result<Verdict, String> {
        let second = stranger.run()?;
        Ok(alike(&first, &second, |_| [0.0; 3], |_| 0.0))
    };
    let mut strangers = world.clone();
    strangers.setup.colliders.extend([[0.0; 3], [0.0, 1e-3, 0.0], [-3.0, 0.5, 2.0]].map(ball));
    if let Verdict::Broken(why) = same(strangers)? {
        return Ok(Verdict::Broken(format!("balls: {why}")));
    }
    if world.setup.bodies.is_empty() {
        return Ok(Verdict::Holds);
    }
    let mut stranger = world.clone();
    stranger.setup.bodies.push(body());
    Ok(match same(stranger)? {
        Verdict::Broken(why) => Verdict::Broken(format!("a body: {why}")),
        verdict => verdict,
    })
}

fn ball(velocity: [f64; 3]) -> Collider {
    Collider {
        name: "stranger".into(),
        shape: Shape::Sphere(Sphere { center: [70.0, 10.0, -70.0], radius: 0.1 }),
        velocity,
        way: None,
        friction: 0.3,
        restitution: 0.5,
        margin: 0.01,
        contact: Contact::Separating,
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    }
}

/// A particle that flies by itself, which no step is too long for.
fn body() -> BodySetup {
    let mut random = Random::seeded(3);
    let network = Network {
        x: vec![[70.0, 10.0, 70.0]],
        v: vec![random.vector()],
        masses: vec![1.0],
        ..Network::default()
    };
    let settings = ClothSettings::default();
    BodySetup { name: "stranger".into(), network, settings, forces: Vec::new() }
}
