//! What tears by numerics alone is told: particles that are stretched farther than cells can bear, of objects that may not break as
//! a warning, of others as a number.

use nappe_sim::{
    collide::Contact,
    math::{Mat3, Precision, Vec3},
    report::StepReport,
    snow::{Material, Plasticity},
    world::{Change, ChangeError, Simulation},
};
use nappe_tests::{
    Random,
    scene::{advance, difference, norm},
    snow::{SnowScene, Variant, elastic, lattice, object, plane, rework, step_once},
};

use crate::reference::rows;

/// Side of a cell (m).
const H: f64 = 0.1;

/// A material that yields, but not by what particles are stretched here.
fn loose() -> Material {
    let plasticity = Plasticity {
        critical_compression: 0.5,
        critical_stretch: 9.0,
        hardening: 0.0,
        plastic_ratio_range: [0.5, 20.0],
    };
    Material { plasticity: Some(plasticity), ..elastic(1e4, 0.2) }
}

/// A step of two blocks of so many particles along a cell, elastic and loose, of which particles 3 and 70 of each are stretched.
fn stepped(variant: Variant, along: f64, stretch: f64) -> StepReport {
    let spacing = H / along;
    let block = |name: &str, low: [f64; 3], material: Material| {
        object(name, lattice(low, [5, 5, 4], [spacing; 3]), spacing.powi(3), 400.0, material)
    };
    let objects =
        vec![block("loose", [0.0; 3], loose()), block("elastic", [2.0, 0.0, 0.0], elastic(1e4, 0.2))];
    let mut simulation = SnowScene::new(objects, H, 1e-7).by(variant).simulate(Precision::F64);
    let mut random = Random::seeded(11);
    let [before, after] = [random.rotation(), random.rotation()];
    rework(&mut simulation, |particle, p| {
        let f = Mat3::from_diagonal(&Vec3::new(stretch, 0.9, 1.0));
        let is_stretched = [3, 70, 103, 170].contains(&particle);
        p.elastic = rows(&(after * if is_stretched { f } else { Mat3::identity() } * before));
    });
    step_once(&mut simulation)
}

#[test]
fn particles_that_cells_cannot_bear_are_counted_and_the_first_elastic_one_is_named() {
    for variant in Variant::all() {
        // The cube of the stretch times the spacing is at most four cells.
        for (along, limit) in [(1.0, 4.0_f64), (2.0, 8.0), (3.0, 12.0)] {
            for (share, torn) in [(0.98, 0), (1.02, 2)] {
                let report = stepped(variant, along, share * limit.cbrt());
                let label = format!("{}, {along} along a cell, {share} of the limit", variant.name());
                let snow = report.snow.expect("the snow's report");
                assert_eq!(snow.torn_count, 2 * torn, "{label}");
                let first = (torn > 0).then_some(103);
                assert_eq!((report.notices.torn_count, report.notices.first_torn), (torn, first), "{label}");
            }
        }
    }
}

/// A bar under a ceiling to which it sticks, so close that its first particles are a quarter of a cell away, and attached.
fn hung(variant: Variant) -> SnowScene {
    let x = lattice([0.0, -5.0 * H, 0.0], [4, 10, 4], [0.5 * H; 3]);
    let mut bar = object("bar", x, (0.5 * H).powi(3), 400.0, elastic(2e4, 0.3));
    let ceiling = plane([0.0; 3], [0.0, -1.0, 0.0], Contact::Sticky, 0.0);
    bar.attach = Some(ceiling.name.clone());
    let mut scene = SnowScene::new(vec![bar], H, 5e-4).by(variant).under([0.5, -9.81, 0.2]);
    scene.colliders = vec![ceiling];
    scene
}

#[test]
fn particles_that_are_attached_go_with_their_deformation_about_the_surface() {
    for variant in Variant::all() {
        for precision in Precision::ALL {
            let scene = hung(variant);
            let mut simulation = scene.simulate(precision);
            advance(&mut simulation, 60);
            let rounding = if precision == Precision::F64 { 1e-13 } else { 1e-6 };
            let mut stretched = 0.0_f64;
            for (p, x) in simulation.snow_particles().iter().zip(&scene.objects[0].x) {
                if x[1] > -0.5 * H {
                    // Of F by rows, the second column times the way from the surface.
                    let expected =
                        [0, 1, 2].map(|c| if c == 1 { 0.0 } else { x[c] } + p.elastic[c][1] * x[1]);
                    assert!(norm(difference(p.x, expected)) < rounding, "{}: {:?}", variant.name(), p.x);
                    stretched = stretched.max(p.elastic[1][1]);
                }
            }
            assert!(stretched > 1.001, "{}: it hangs by them", variant.name());
        }
    }
}

#[test]
fn what_is_attached_and_its_collider_are_not_moved_by_calls() {
    let scene = hung(Variant::all()[0]);
    let mut simulation = scene.simulate(Precision::F64);
    let positions = scene.objects[0].x.clone();
    let put = Change::State { body: "bar".to_owned(), positions: positions.into(), velocities: None };
    let refused = simulation.apply(&[put]).expect_err("it is attached");
    assert!(matches!(refused, ChangeError::Attached { .. }), "{refused}");
    simulation.apply(&[Change::Reset]).expect("a reset puts it where it was");
}

#[test]
fn an_object_is_attached_to_a_collider_that_stands_and_holds_it_alone() {
    let message = |scene: &SnowScene| {
        let refused = Simulation::new(&scene.setup(), Precision::F64).expect_err("it cannot be attached");
        refused.to_string()
    };
    let scene = hung(Variant::all()[0]);
    let mut other = scene.clone();
    other.objects[0].attach = Some("floor".to_owned());
    assert!(message(&other).contains("no collider has that name"), "{}", message(&other));
    let mut moving = scene.clone();
    moving.colliders[0].velocity = [0.0, 1.0, 0.0];
    assert!(message(&moving).contains("which moves"), "{}", message(&moving));
    let mut slipping = scene.clone();
    slipping.colliders[0].contact = Contact::Separating;
    assert!(message(&slipping).contains("sticky"), "{}", message(&slipping));
    let mut far = scene.clone();
    for x in &mut far.objects[0].x {
        x[1] -= H;
    }
    assert!(message(&far).contains("within half a cell"), "{}", message(&far));
    let mut weak = scene;
    weak.objects[0].material = loose();
    assert!(message(&weak).contains("may yield"), "{}", message(&weak));
}
