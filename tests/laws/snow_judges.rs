//! Judges of steps of snow: what colliders carry, lift and press goes on, for what they give is their load times their way.

use nappe_scene::{NoMeshes, Scene, SceneLimits};
use nappe_sim::math::array::dot;
use nappe_tests::at_random::{Run, World};

fn world(text: &str) -> World {
    let scene = Scene::parse(text, "scene.toml").expect("a scene");
    let built = scene.build(&NoMeshes, &SceneLimits::default()).expect("a scene");
    World {
        setup: built.setup,
        changes: built.initial_changes,
        precision: scene.precision,
        steps: scene.steps,
    }
}

fn run(world: &World) -> Run {
    world.run().unwrap_or_else(|refused| panic!("{refused}"))
}

/// A block of snow on a box that moves at a velocity, by a transfer and so much of the semi-implicit step.
fn carried(velocity: [f64; 3], transfer: &str, beta: f64, contact: &str, precision: &str) -> World {
    let [x, y, z] = velocity;
    world(&format!(
        "version = 1\ndt = 0.005\nsteps = 40\nprecision = \"{precision}\"\n[snow]\ncell = 0.03\ntransfer = \"{transfer}\"\nbeta = {beta:?}
        [[snow.object]]\nname = \"b\"\nbox = {{ center = [0.01, 0.04, 0.02], size = [0.12, 0.1, 0.12] }}
        [[collider]]\nname = \"c\"\nbox = {{ center = [0, -0.06, 0], size = [0.6, 0.1, 0.6] }}\nfriction = 0.3
        contact = \"{contact}\"\nvelocity = [{x:?}, {y:?}, {z:?}]\n"
    ))
}

#[test]
fn what_a_box_carries_lifts_and_drops_goes_on() {
    let mut asked = 0;
    for transfer in ["mls", "apic", "pic_flip"] {
        for contact in ["separating", "slip", "sticky"] {
            for (beta, precision) in [(0.0, "f32"), (0.0, "f64"), (1.0, "f64")] {
                for speed in [0.02, 0.5, 2.0] {
                    for direction in [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.6, 0.8, 0.0]] {
                        asked += 1;
                        if asked % 3 != 0 && speed != 0.5 {
                            continue;
                        }
                        let world = carried(direction.map(|c| speed * c), transfer, beta, contact, precision);
                        let found = run(&world);
                        let label = format!(
                            "{transfer}, {contact}, beta {beta}, {precision}, {speed} m/s along {direction:?}"
                        );
                        assert_eq!(found.reason(), "ran", "{label}: {:?}", found.end);
                    }
                }
            }
        }
    }
}

#[test]
fn a_plate_that_presses_elastic_snow_gives_it_its_load_times_its_way() {
    for speed in [0.02, 0.05, 0.2] {
        let text = format!(
            "version = 1\ndt = 0.02\nsteps = {}\nprecision = \"f64\"\ngravity = [0, 0, 0]\n[snow]\ncell = 0.025
            [[snow.object]]\nname = \"s\"\nbox = {{ min = [0, 0, 0], max = [0.1, 0.2, 0.1] }}\nsampling = \"lattice\"
            material = {{ preset = \"elastic\" }}\n",
            (0.012 / speed / 0.02) as u32
        );
        let walls = [
            ("f", [0.0, 0.0, 0.0], [0, 1, 0], 0.0),
            ("lid", [0.0, 0.2, 0.0], [0, -1, 0], -speed),
            ("a", [0.0; 3], [1, 0, 0], 0.0),
            ("b", [0.1, 0.0, 0.0], [-1, 0, 0], 0.0),
            ("c", [0.0; 3], [0, 0, 1], 0.0),
            ("d", [0.0, 0.0, 0.1], [0, 0, -1], 0.0),
        ];
        let wall = |(name, point, normal, fall): (&str, [f64; 3], [i32; 3], f64)| {
            format!(
                "[[collider]]\nname = \"{name}\"\nplane = {{ point = {point:?}, normal = {normal:?} }}\ncontact = \"slip\"\nvelocity = [0, {fall:?}, 0]\n"
            )
        };
        let text = text + &walls.map(wall).concat();
        let world = world(&text);
        let found = run(&world);
        assert_eq!(found.reason(), "ran", "{speed} m/s: {:?}", found.end);
        let given: f64 = found.frames[1..]
            .iter()
            .map(|frame| -0.02 * dot(frame.report.loads[1].force, [0.0, -speed, 0.0]))
            .sum();
        let gained = found.frames.last().expect("frames").report.diagnostics.total_energy();
        assert!(
            given > 0.0 && gained < 1.02 * given && gained > 0.5 * given,
            "{speed} m/s: {gained} of {given} J"
        );
    }
}
