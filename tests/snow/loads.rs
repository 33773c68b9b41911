//! Loads of colliders: what they feel is minus the change that contact makes of the momentum of snow.

use nappe_sim::time_step::TimeStep;
use nappe_sim::{
    collide::Contact,
    linalg::Stop,
    math::Precision,
    report::Load,
    snow::{Integration, Kernel, Transfer},
    world::Simulation,
};
use nappe_tests::{
    networks::scatter,
    scene::norm,
    snow::{SnowScene, Variant, elastic, lattice, object, plane, settle, step_once},
    threads::with_threads,
};

const GRAVITY: f64 = 9.81;
const DENSITY: f64 = 400.0;
const H: f64 = 0.1;
const DT: f64 = 1e-3;
const MLS: Variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };

/// A block of 4 x 4 x 4 cells above the origin, with gravity inclined by `angle` (rad).
fn block(variant: Variant, angle: f64) -> SnowScene {
    let x = lattice([-0.2, 0.0, -0.2], [8; 3], [0.5 * H; 3]);
    let body = object("block", x, (0.5 * H).powi(3), DENSITY, elastic(1.4e5, 0.2));
    let gravity = [GRAVITY * angle.sin(), -GRAVITY * angle.cos(), 0.0];
    SnowScene::new(vec![body], H, DT).by(variant).under(gravity)
}

/// The same on a floor.
fn on_floor(friction: f64, angle: f64) -> SnowScene {
    let mut scene = block(MLS, angle);
    scene.colliders = vec![plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Separating, friction)];
    scene
}

/// The same thrown into a trough with a post in it that moves.
fn thrown(variant: Variant) -> SnowScene {
    let mut scene = block(variant, 0.0);
    scene.objects[0].x.iter_mut().for_each(|x| x[1] += 0.22);
    let noise =
        |x: [f64; 3], c: usize| 0.1 * scatter((1e4 * (x[0] + 3.0 * x[1] + 7.0 * x[2])).abs() as usize + c);
    let mut scene = scene.moving(|x| [1.0 + noise(x, 0), -2.0 + noise(x, 1), 0.3 + noise(x, 2)]);
    let wall = |x: f64, contact, friction| plane([0.0; 3], [x, 0.8, 0.0], contact, friction);
    let mut back = plane([0.0, 0.0, -0.25], [0.0, 0.0, 1.0], Contact::Slip, 0.2);
    back.velocity = [0.0, 0.0, 0.5];
    scene.colliders = vec![wall(0.6, Contact::Separating, 0.3), wall(-0.6, Contact::Slip, 0.1), back];
    scene
}

fn mass(scene: &SnowScene) -> f64 {
    scene.masses().iter().sum()
}

/// By how much the momentum after each step is not what gravity and loads make of that before, at most, of m g dt; and how
/// many contacts each collider had.
fn unexplained(scene: &SnowScene, steps: u32) -> (f64, Vec<u64>) {
    let mut simulation = scene.simulate(Precision::F64);
    let (mut before, mass) = (simulation.diagnose().momentum, mass(scene));
    let (mut worst, mut contacts) = (0.0, vec![0; scene.colliders.len()]);
    for _ in 0..steps {
        let report = step_once(&mut simulation);
        let after = report.diagnostics.momentum;
        let felt = [0, 1, 2].map(|c| report.loads.iter().map(|load| load.force[c]).sum::<f64>());
        let off = [0, 1, 2].map(|c| after[c] - before[c] - (mass * scene.gravity[c] - felt[c]) * DT);
        let dropped = report.snow.expect("a report of the snow").dropped_momentum;
        worst = f64::max(worst, (norm(off) - dropped) / (mass * GRAVITY * DT));
        contacts.iter_mut().zip(&report.loads[..]).for_each(|(sum, load)| *sum += load.contacts);
        before = after;
    }
    (worst, contacts)
}

#[test]
fn gravity_and_loads_are_all_that_changes_the_momentum() {
    for variant in Variant::all() {
        let mut scene = thrown(variant);
        // At whole steps some variants fly apart in the trough.
        scene.settings.time_step = TimeStep::Certified { safety: 0.9 };
        let (worst, contacts) = unexplained(&scene, 200);
        assert!(worst < 1e-10, "{}: off by {worst:e} of m g dt", variant.name());
        assert!(contacts.iter().all(|contacts| *contacts > 100), "{}: {contacts:?}", variant.name());
    }
}

#[test]
fn what_a_solve_presses_on_colliders_is_part_of_their_loads() {
    let stop = Stop::Residual { tolerance: 1e-9, max_iterations: 1000 };
    for variant in Variant::affine() {
        let mut scene = thrown(variant);
        scene.settings.integration = Integration::SemiImplicit { beta: 1.0, stop };
        let (worst, contacts) = unexplained(&scene, 200);
        assert!(worst < 1e-6, "{}: off by {worst:e} of m g dt", variant.name());
        assert!(contacts.iter().all(|contacts| *contacts > 100), "{}: {contacts:?}", variant.name());
    }
}

/// Mean loads over 0.5 s.
fn mean(simulation: &mut Simulation) -> Vec<Load> {
    let count = 500;
    let mut sums = vec![Load::default(); simulation.colliders().len()];
    for _ in 0..count {
        for (sum, load) in sums.iter_mut().zip(&step_once(simulation).loads[..]) {
            for c in 0..3 {
                sum.force[c] += load.force[c] / f64::from(count);
                sum.torque[c] += load.torque[c] / f64::from(count);
            }
        }
    }
    sums
}

fn settled(scene: &SnowScene) -> Simulation {
    let mut simulation = scene.simulate(Precision::F64);
    settle(&mut simulation, 40, 20_000, |_| {});
    simulation
}

#[test]
fn a_block_at_rest_loads_a_plane_with_its_weight() {
    let scene = on_floor(0.5, 0.0);
    let weight = mass(&scene) * GRAVITY;
    let [load] = mean(&mut settled(&scene))[..] else { panic!("one load") };
    let off = [load.force[0], load.force[1] + weight, load.force[2]].map(|c| c / weight);
    assert!(norm(off) < 1e-3, "{load:?}, not {weight} N");
    // Its middle is above the plane's point but for half a spacing.
    assert!(norm(load.torque) < 0.03 * weight, "{load:?}");
}

#[test]
fn a_block_in_a_trough_loads_both_sides_with_its_weight_together() {
    let mut scene = block(MLS, 0.0);
    scene.objects[0].x.iter_mut().for_each(|x| x[1] += 0.26);
    scene.colliders = [0.6, -0.6].map(|x| plane([0.0; 3], [x, 0.8, 0.0], Contact::Separating, 0.0)).to_vec();
    let weight = mass(&scene) * GRAVITY;
    let [left, right] = mean(&mut settled(&scene))[..] else { panic!("two loads") };
    let sum = [0, 1, 2].map(|c| left.force[c] + right.force[c]);
    let off = [sum[0], sum[1] + weight, sum[2]].map(|c| c / weight);
    assert!(norm(off) < 1e-3, "{left:?} and {right:?}, not {weight} N");
    assert!(left.force[0] < -0.2 * weight && right.force[0] > 0.2 * weight, "{left:?}, {right:?}");
}

#[test]
fn an_incline_feels_friction_as_far_as_it_goes() {
    let angle = 24.0_f64.to_radians();
    let held = 30.0_f64.to_radians().tan();
    let at_rest = settled(&on_floor(held, angle)).snow_particles();
    for (friction, slides) in [(15.0_f64.to_radians().tan(), true), (held, false)] {
        let scene = on_floor(friction, angle);
        let weight = mass(&scene) * GRAVITY;
        let mut simulation = scene.simulate(Precision::F64);
        simulation.restore_snow(&at_rest);
        if slides {
            simulation.kick_snow(|_, _, _| [1.0, 0.0, 0.0]);
        }
        let [load] = mean(&mut simulation)[..] else { panic!("one load") };
        let normal = weight * angle.cos();
        let along = if slides { friction * normal } else { weight * angle.sin() };
        let off = [load.force[0] / along - 1.0, load.force[1] / normal + 1.0];
        assert!(off.iter().all(|off| off.abs() < 0.01), "slides: {slides}: {load:?}, off by {off:?}");
    }
}

#[test]
fn a_collider_behind_sixty_four_others_has_a_load_of_its_own() {
    let far = |k: i32| plane([0.0, -50.0 - f64::from(k), 0.0], [0.0, 1.0, 0.0], Contact::Separating, 0.0);
    let alone = on_floor(0.5, 0.0);
    let mut among = alone.clone();
    among.colliders = (0..66).map(far).chain(alone.colliders.clone()).chain((70..73).map(far)).collect();
    let [mut alone, mut among] = [alone, among].map(|scene| scene.simulate(Precision::F64));
    for _ in 0..20 {
        let (alone, among) = (step_once(&mut alone), step_once(&mut among));
        assert_eq!(among.loads[66], alone.loads[0]);
        assert!(alone.loads[0].contacts > 0 && alone.loads[0].force[1] < 0.0, "{:?}", alone.loads);
        assert!(among.loads.iter().enumerate().all(|(k, load)| k == 66 || *load == Load::default()));
    }
}

#[test]
fn loads_have_the_same_bits_on_any_number_of_threads() {
    let run = |threads| {
        with_threads(threads, || {
            let mut simulation = thrown(MLS).simulate(Precision::F32);
            (0..150).flat_map(|_| step_once(&mut simulation).loads.to_vec()).collect::<Vec<Load>>()
        })
    };
    let alone = run(1);
    assert!(alone.iter().filter(|load| load.contacts > 0).count() > 50);
    (2..=4).for_each(|threads| assert!(run(threads) == alone, "{threads} threads"));
}
