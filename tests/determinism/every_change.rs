//! A state taken after every kind of change, and put into another simulation: the same hash, and the same bits from there.

use nappe_sim::{
    cloth::Integrator,
    collide::{Collider, Contact, Shape, StartInside, shape::Sphere},
    math::Precision,
    world::{Change, ColliderMove, Forces, MoveKey, Pull, Simulation, WorldSetup},
};
use nappe_tests::{
    scene::advance,
    snow::{SnowScene, elastic, lattice, object},
};

use crate::scenes::{methods, scene};

/// Steps before the change, after it, and from there on.
const STEPS: [u64; 3] = [5, 3, 12];

/// A sheet in air, a block of snow beside it, and a ball that calls may move.
fn setup(integrator: Integrator) -> WorldSetup {
    let method = methods("sheet_in_air").find(|method| method.integrator == integrator).expect("a method");
    let mut setup = scene("sheet_in_air", method).setup();
    let x = lattice([3.0, 0.0, 0.0], [8, 6, 8], [0.05; 3]);
    let block = object("block", x, 0.05_f64.powi(3), 400.0, elastic(1.4e5, 0.2));
    setup.snow = SnowScene::new(vec![block], 0.1, setup.dt).setup().snow;
    setup.colliders = vec![Collider {
        name: "ball".to_owned(),
        shape: Shape::Sphere(Sphere { center: [3.2, -0.3, 0.2], radius: 0.25 }),
        velocity: [0.0; 3],
        way: None,
        friction: 0.3,
        restitution: 0.1,
        margin: 0.004,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    }];
    setup
}

/// A body lifted by so much (m) from where it begins.
fn lifted(body: &str, x: &[[f64; 3]], by: f64) -> Change {
    let positions: Vec<[f64; 3]> = x.iter().map(|[x, y, z]| [*x, y + by, *z]).collect();
    Change::State { body: body.to_owned(), positions: positions.into(), velocities: None }
}

/// The change after another one: a kind of change that is new needs a place here.
fn next(setup: &WorldSetup, change: &Change) -> Option<Change> {
    let one = |body: &str, force: [f64; 3]| Change::Force {
        body: body.to_owned(),
        particles: [7, 9, 200].into(),
        forces: Forces::One(force),
    };
    Some(match change {
        Change::Gravity(_) => Change::Wind([3.0, 1.0, 0.0]),
        Change::Wind(_) => Change::Drag(0.004),
        Change::Drag(_) => {
            let (body, density, normal) = (Some("body".to_owned()), Some(2.0), Some(0.7));
            Change::Air { body, density, normal, lift: Some(0.4), tangential: None }
        }
        Change::Air { .. } => {
            Change::Springs { body: None, kind: None, stiffness: Some(80.0), damping: Some(0.01) }
        }
        Change::Springs { .. } => Change::Pin { particle: 0, target: [0.02, 0.03, 0.0], duration: 0.011 },
        Change::Pin { .. } => {
            let points = [(0.004, [0.94, 0.01, 0.0]), (0.013, [0.95, 0.0, 0.02])].into();
            Change::PinPath { particle: 19, points }
        }
        Change::PinPath { .. } => {
            let keys = [MoveKey { time: 0.01, position: Some([3.2, -0.27, 0.25]), turn: None }].into();
            Change::Collider(ColliderMove { collider: "ball".to_owned(), keys })
        }
        Change::Collider(_) => one("body", [0.01, 0.0, 0.02]),
        Change::Force { body, .. } if body == "body" => one("block", [3.0, 1.0, 0.0]),
        Change::Force { .. } => Change::Pull(Pull {
            body: "body".to_owned(),
            particles: [7, 200].into(),
            points: [[0.3, 0.1, 0.2], [0.5, 0.2, 0.4]].into(),
            frequency: 40.0,
            most: 50.0,
            seconds: 0.02,
        }),
        Change::Pull(_) => lifted("body", &setup.bodies[0].network.x, 0.01),
        Change::State { body, .. } if body == "body" => {
            lifted("block", &setup.snow.as_ref().expect("snow").objects[0].x, 0.02)
        }
        Change::State { .. } => Change::Reset,
        Change::Reset => return None,
    })
}

fn made(setup: &WorldSetup, precision: Precision) -> Simulation {
    Simulation::new(setup, precision).expect("a good setup").0
}

/// Another simulation that goes on from where this one is, with its hash.
fn put(setup: &WorldSetup, before: &Simulation, told: &str) -> Simulation {
    let (state, mut after) = (before.take(), made(setup, before.precision()));
    assert_eq!(state.check(&after), Ok(()), "{told}");
    after.put(&state);
    assert_eq!(after.state_hash(), before.state_hash(), "{told}");
    after
}

/// Takes and puts the state at once after a change, and after some steps with it.
fn check(setup: &WorldSetup, precision: Precision, change: &Change) {
    let told: String = format!("{precision}, {change:.2?}").chars().take(80).collect();
    let mut whole = made(setup, precision);
    advance(&mut whole, STEPS[0]);
    let before = whole.state_hash();
    whole.apply(std::slice::from_ref(change)).unwrap_or_else(|error| panic!("{told}: {error}"));
    assert_ne!(whole.state_hash(), before, "{told}: it changes something");

    let mut at_once = put(setup, &whole, &told);
    for simulation in [&mut whole, &mut at_once] {
        advance(simulation, STEPS[1]);
    }
    let mut later = put(setup, &whole, &told);
    let hashes = [&mut whole, &mut at_once, &mut later].map(|simulation| {
        advance(simulation, STEPS[2]);
        let stepped = simulation.state_hash();
        simulation.apply(&[Change::Reset]).expect("a reset");
        advance(simulation, 1);
        [stepped, simulation.state_hash()]
    });
    assert_eq!([hashes[1], hashes[2]], [hashes[0]; 2], "{told}");
}

#[test]
fn a_state_after_every_kind_of_change_goes_on_with_the_same_bits() {
    for (integrator, precision) in
        [(Integrator::ImplicitEuler, Precision::F32), (Integrator::Bdf2, Precision::F64)]
    {
        let setup = setup(integrator);
        let first = Change::Gravity([1.0, -5.0, 0.5]);
        let changes: Vec<Change> =
            std::iter::successors(Some(first), |change| next(&setup, change)).collect();
        assert_eq!(changes.len(), 14, "twelve kinds, and two of them for snow too");
        for change in &changes {
            check(&setup, precision, change);
        }
    }
}
