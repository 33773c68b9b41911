//! An error is told by type, particle and cause, and recovered from where that is possible: numbers
//! that are not finite, particles out of range, singular and inverted deformations, nodes of hardly
//! any mass, hardly any particles, and snow that is torn apart on the grid.

use nappe_sim::{
    math::Precision,
    report::{StepError, StepFailure},
    snow::{Blend, Kernel, ParticleState, Preset, Transfer},
    world::{Simulation, WorldSetup},
};
use nappe_tests::{
    scene::{norm, try_advance},
    snow::{SnowScene, Variant, elastic, lattice, momentum, object, rework, step_once},
};

const H: f64 = 0.1;

/// A cube of four cells.
fn cube() -> SnowScene {
    let snow = Preset::from_name("stomakhin").expect("a preset");
    let x = lattice([-0.2, 0.0, 0.1], [8; 3], [0.5 * H; 3]);
    let body = object("cube", x, (0.5 * H).powi(3), snow.density, snow.material);
    SnowScene::new(vec![body], H, 1e-4)
}

fn failure(simulation: &mut Simulation) -> StepError {
    match try_advance(simulation, 1) {
        Err(error) => error,
        Ok(_) => panic!("the step was taken"),
    }
}

fn finite(particles: &[ParticleState]) -> bool {
    let numbers = |p: &ParticleState| {
        let tensors = p.elastic.iter().chain(&p.affine).flatten();
        p.x.iter().chain(&p.v).chain(tensors).chain([&p.plastic_ratio]).copied().collect::<Vec<_>>()
    };
    particles.iter().all(|p| numbers(p).iter().all(|n| n.is_finite()))
}

type Poison = fn(&mut ParticleState, f64);

#[test]
fn a_number_that_is_not_finite_is_named_within_one_step() {
    let poisons: [(&str, Poison); 4] = [
        ("position", |p, bad| p.x[1] = bad),
        ("velocity", |p, bad| p.v[2] = bad),
        ("deformation gradient", |p, bad| p.elastic[0][1] = bad),
        ("affine velocity", |p, bad| p.affine[2][0] = bad),
    ];

    for variant in Variant::all() {
        for (name, poison) in poisons {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut simulation = cube().by(variant).simulate(Precision::F64);
                rework(&mut simulation, |i, p| {
                    if i == 77 {
                        poison(p, bad);
                    }
                });

                // A velocity gradient that PIC/FLIP only shows is not read by its next step.
                let read = name != "affine velocity" || !matches!(variant.transfer, Transfer::PicFlip(_));
                let error = match try_advance(&mut simulation, 1) {
                    Err(error) => error,
                    Ok(_) if !read && finite(&simulation.snow_particles()) => continue,
                    Ok(_) => panic!("{}: a {name} of {bad} went unseen", variant.name()),
                };

                let what = format!("{}, {name} {bad}: {error}", variant.name());
                let StepFailure::NotFinite { particle, quantity, value } = error.failure else {
                    panic!("{what}")
                };
                assert_eq!((particle, &*quantity), (77, name), "{what}");
                assert!(!value.is_finite(), "{what}");
                assert_eq!(error.body, "cube");
            }
        }
    }
}

#[test]
fn a_kick_that_is_not_finite_is_named_and_a_later_restore_goes_on() {
    let mut simulation = cube().simulate(Precision::F64);
    let good = simulation.snow_particles();
    simulation.kick_snow(|particle, _, _| if particle == 5 { [0.0, f64::NAN, 0.0] } else { [0.0; 3] });
    let error = failure(&mut simulation);
    let StepFailure::NotFinite { particle, ref quantity, .. } = error.failure else { panic!("{error}") };
    assert_eq!((particle, &**quantity), (5, "velocity"), "{error}");
    assert_eq!(error.failure.reason(), "NOT_FINITE");
    simulation.restore_snow(&good);
    let report = step_once(&mut simulation).snow.expect("there is snow");
    assert!(report.grid_mass_error.abs() < 1e-13);
}

#[test]
fn a_particle_that_leaves_the_range_of_the_grid_is_named_with_its_place() {
    // The linear kernel alone turns the rounding of places as far as this into strain.
    for variant in Variant::all().into_iter().filter(|v| v.kernel != Kernel::Linear) {
        // Two particles: one stays, one is a step away from the end of the range.
        let end = f64::from((1 << 20) - 2) * 4.0 * H;
        for sign in [-1.0, 1.0] {
            let x = vec![[0.0; 3], [0.3, sign * (end - 0.05), 0.2]];
            let body = object("far", x, H.powi(3), 400.0, elastic(1.4e5, 0.2));
            let mut simulation = SnowScene::new(vec![body], H, 1e-3).by(variant).simulate(Precision::F64);

            // Nine tenths of a cell a step: the last two blocks are a margin.
            simulation.kick_snow(|i, _, _| [0.0, if i == 1 { sign * 90.0 } else { 0.0 }, 0.0]);
            let error = try_advance(&mut simulation, 20).expect_err("it is out of range by then");
            let StepFailure::OutOfRange { particle, position, limit } = error.failure else {
                panic!("{error}")
            };
            assert_eq!(particle, 1);
            assert!(sign * position[1] >= limit && (limit - end).abs() < 1e-6, "{error}");
        }
    }
}

#[test]
fn a_scene_beyond_the_range_of_the_grid_is_refused() {
    for (bad, word) in [(1e7, "range"), (f64::NAN, "finite"), (f64::INFINITY, "finite")] {
        let body = object("far", vec![[0.0; 3], [0.0, bad, 0.0]], H.powi(3), 400.0, elastic(1.4e5, 0.2));
        let setup = SnowScene::new(vec![body], H, 1e-3).setup();
        let error =
            Simulation::new(&setup, Precision::F64).map(|_| ()).expect_err("it is out of range").to_string();
        assert!(error.contains(word) && error.contains("particle 1"), "{error}");
    }
}

/// One step of the cube with a particle's deformation put in place; what it reports, and the particle.
fn with_deformation(
    variant: Variant,
    elastic: [[f64; 3]; 3],
) -> (nappe_sim::report::SnowReport, ParticleState) {
    let mut simulation = cube().by(variant).simulate(Precision::F64);
    rework(&mut simulation, |i, p| {
        if i == 9 {
            p.elastic = elastic;
        }
    });
    let report = step_once(&mut simulation).snow.expect("there is snow");
    let particles = simulation.snow_particles();
    assert!(finite(&particles));
    (report, particles[9])
}

#[test]
fn singular_deformations_are_returned_counted_and_finite() {
    let flat = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    let line = [[0.5, 0.5, 0.5], [0.5, 0.5, 0.5], [0.5, 0.5, 0.5]];
    for variant in Variant::all() {
        for singular in [flat, line, [[0.0; 3]; 3]] {
            let (report, particle) = with_deformation(variant, singular);
            assert_eq!(
                (report.clamped_count, report.plastic_count),
                (1, 1),
                "{}: {report:?}",
                variant.name()
            );
            assert_eq!(particle.plastic_ratio, 0.6, "{}", variant.name());
            let f = crate::reference::matrix(&particle.elastic);
            assert!(f.determinant() > 0.9, "{}: det F_E = {}", variant.name(), f.determinant());
        }
    }
}

#[test]
fn an_inverted_particle_is_counted_held_and_turned_right_side_out() {
    let inverted = [[1.0, 0.1, 0.0], [0.0, -0.9, 0.2], [0.0, 0.0, 1.0]];
    for variant in Variant::all() {
        let (report, particle) = with_deformation(variant, inverted);
        assert_eq!((report.inverted_count, report.clamped_count), (1, 1), "{}: {report:?}", variant.name());
        assert!(crate::reference::matrix(&particle.elastic).determinant() > 0.9, "{}", variant.name());
        assert_eq!((particle.plastic_ratio, report.plastic_ratio_range[0]), (0.6, 0.6), "{}", variant.name());
        // The cube goes on.
        let mut simulation = cube().by(variant).simulate(Precision::F64);
        rework(&mut simulation, |i, p| {
            if i == 9 {
                *p = particle;
            }
        });
        let report = step_once(&mut simulation).snow.expect("there is snow");
        assert_eq!(report.inverted_count, 0, "{}", variant.name());
    }
}

#[test]
fn nodes_of_hardly_any_mass_throw_nothing_and_what_they_lose_is_told() {
    for variant in Variant::all().into_iter().filter(|v| v.kernel != Kernel::Linear) {
        let edge = if variant.kernel == Kernel::Cubic { 0.0 } else { 0.5 };
        for delta in [1e-3, 1e-5, 1e-8, 1e-12, 0.0] {
            let x = vec![[(edge + delta) * H; 3], [(edge + 1.0 - delta) * H; 3]];
            let body = object("pair", x, H.powi(3), 400.0, elastic(1.4e5, 0.2));
            let scene = SnowScene::new(vec![body], H, 1e-4).by(variant).moving(|_| [0.4, -0.3, 0.2]);
            let mut simulation = scene.simulate(Precision::F64);
            rework(&mut simulation, |_, p| {
                p.elastic = [[1.02, 0.01, 0.0], [0.0, 0.98, 0.0], [0.0, 0.0, 1.01]];
            });
            let start = simulation.snow_particles();
            let report = step_once(&mut simulation).snow.expect("there is snow");
            let (end, masses) = (simulation.snow_particles(), scene.masses());
            let what = format!("{} at {delta:e} of a cell", variant.name());

            // Stress moves a particle by c² dt / h strain at most: some metres a second here.
            assert!(finite(&end) && report.max_speed < 2.0, "{what}: {} m/s", report.max_speed);
            let [before, after] = [&start, &end].map(|p| momentum(p, &masses));
            let lost = norm([0, 1, 2].map(|a| after[a] - before[a]));
            assert!(
                lost <= report.dropped_momentum + 1e-13 * norm(before),
                "{what}: {lost:e} kg m/s are lost"
            );
            assert!(report.dropped_momentum < 1e-15, "{what}: {:e} kg m/s", report.dropped_momentum);
        }
    }
}

#[test]
fn no_particles_are_refused_and_one_is_enough() {
    let error = |setup: &WorldSetup| {
        Simulation::new(setup, Precision::F64).map(|_| ()).expect_err("refused").to_string()
    };
    let none = SnowScene::new(Vec::new(), H, 1e-4).setup();
    assert!(error(&none).contains("0 objects"), "{}", error(&none));
    let empty = object("empty", Vec::new(), 1.0, 400.0, elastic(1.4e5, 0.2));
    let empty = SnowScene::new(vec![empty], H, 1e-4).setup();
    assert!(error(&empty).contains("0 particles"), "{}", error(&empty));

    for variant in Variant::all() {
        let mut body = object("alone", vec![[0.317, -2.43, 0.05]], 1.0, 400.0, elastic(1.4e5, 0.2));
        body.volume = Vec::new();
        let mut simulation = SnowScene::new(vec![body], H, 1e-4)
            .by(variant)
            .moving(|_| [1.0, 2.0, 3.0])
            .simulate(Precision::F64);
        for _ in 0..100 {
            let report = step_once(&mut simulation);
            let snow = report.snow.expect("there is snow");
            let energy = report.diagnostics.elastic_energy;
            let what = format!("{}: {:e}, {energy:e} J", variant.name(), snow.grid_mass_error);
            assert!(snow.grid_mass_error.abs() < 1e-13 && energy.abs() < 1e-15, "{what}");
        }

        assert!(finite(&simulation.snow_particles()), "{}", variant.name());
    }
}

#[test]
fn snow_torn_further_than_the_kernel_reaches_is_apart_and_depends_on_the_cell() {
    for variant in Variant::all() {
        // Nodes in common: up to `width` cells between two particles.
        let reach = variant.kernel.width() as f64;
        for (gap, together) in [(reach - 1.2, true), (reach + 0.01, false)] {
            let x = vec![[0.05 * H, 0.3 * H, 0.2 * H], [(0.05 + gap) * H, 0.3 * H, 0.2 * H]];
            let body = object("torn", x, H.powi(3), 400.0, elastic(1.4e5, 0.2));
            let scene = SnowScene::new(vec![body], H, 1e-5).by(variant);
            let mut simulation = scene.simulate(Precision::F64);
            simulation.kick_snow(|i, _, _| if i == 1 { [0.3, 0.0, 0.0] } else { [0.0; 3] });
            step_once(&mut simulation);
            let felt = norm(simulation.snow_particles()[0].v) > 1e-9;
            assert_eq!(felt, together, "{}: {gap} cells apart", variant.name());
        }

        // What is alone on its nodes is counted, so that a scene sees that it came apart.
        let mut x = lattice([0.0; 3], [8; 3], [0.5 * H; 3]);
        x.push([3.0, 3.0, 3.0]);
        let body = object("torn", x, (0.5 * H).powi(3), 400.0, elastic(1.4e5, 0.2));
        let mut scene = SnowScene::new(vec![body], H, 1e-5).by(variant);
        scene.settings.transfer = match variant.transfer {
            Transfer::PicFlip(_) => Transfer::PicFlip(Blend::PerStep(0.95)),
            other => other,
        };
        scene.settings.ballistic_below = 0.13;
        let report = step_once(&mut scene.simulate(Precision::F64)).snow.expect("there is snow");
        assert_eq!(report.ballistic_count, 1, "{}", variant.name());
    }
}

#[test]
fn snow_that_flies_apart_has_a_bound_on_its_grid() {
    let count = 28_usize.pow(3);
    let x = lattice([-0.7; 3], [28; 3], [0.5 * H; 3]);
    let body = object("cloud", x.clone(), (0.5 * H).powi(3), 400.0, elastic(1.4e5, 0.2));
    let mut simulation = SnowScene::new(vec![body], H, 1e-6).simulate(Precision::F32);

    let (mut most, mut refused) = (0, None);
    for factor in [1.0, 2.0, 4.0, 6.0, 8.0, 12.0, 16.0, 32.0, 300.0] {
        rework(&mut simulation, |i, p| p.x = x[i].map(|c| factor * c));
        let stepped = try_advance(&mut simulation, 2);
        let bytes = simulation.snow_memory_bytes() / count;
        match stepped {
            Ok(_) => most = most.max(bytes),
            Err(error) => refused = refused.or(Some((factor, bytes, error))),
        }
    }

    let (factor, bytes, error) = refused.expect("so far apart, a particle has a block of its own");
    assert!((1000..2500).contains(&most), "{most} bytes per particle, grid and particle, are used");
    assert!(factor > 4.0 && bytes < 3500, "{factor}: {bytes} bytes per particle");

    // It is named, with its place; the particles are as they were, and nearer they go on.
    let StepFailure::GridMemory { particle, position, bytes, limit } = error.failure else {
        panic!("{error}")
    };
    assert_eq!(error.failure.reason(), "GRID_MEMORY");
    let placed = x[particle as usize].map(|c| factor * c);
    assert!(norm([0, 1, 2].map(|a| position[a] - placed[a])) < 1e-3 * factor, "{error}");
    assert!((norm(position) - norm(x[0].map(|c| factor * c))).abs() < 1e-3 * factor, "a corner: {error}");
    assert!(bytes > limit && limit == 2000 * count as u64, "{error}");
    rework(&mut simulation, |i, p| p.x = x[i]);
    step_once(&mut simulation);

    // So far apart from the start, the snow is refused.
    let far =
        object("far", x.iter().map(|x| x.map(|c| 300.0 * c)).collect(), 1e-3, 400.0, elastic(1.4e5, 0.2));
    let setup = SnowScene::new(vec![far], H, 1e-6).setup();
    let error = Simulation::new(&setup, Precision::F32).map(|_| ()).expect_err("too far apart").to_string();
    assert!(error.contains("flies apart"), "{error}");
}
