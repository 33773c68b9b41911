//! Coarser copies against the continuum, and against texts written by hand.

use nappe_sim::{
    cloth::{Network, SpringKind},
    snow::SnowSetup,
};

use super::{CoarserGrid, coarser};
use crate::{Built, NoMeshes, Scene, SceneLimits, shipped_scenes};

/// 81 x 41 particles, with comments, a pin by its index, and forces.
const GRID: &str = "# A sheet.\nversion = 1\ndt = 0.01\nsteps = 10\n\n[[body]]\nname = \"cloth\"   # the only one\n\
    mesh = { grid = [81, 41], spacing = 0.025 }\nmass = { particle = 0.01 }   # kg, each\ndrag = 1e-4\n\
    pins = [\"top_left\", 80]   # the upper corners\nair = { lift = 1.0 }\n\n[body.springs]\n\
    stretch = { stiffness = 100, damping = 0.5 }\nshear = { stiffness = 40 }\nbend = { stiffness = 3 }\n\n\
    [[body.law]]\nname = \"quadratic_bending\"\nstiffness = 1e-4\n\n\
    [[body.force]]\non = \"all\"\nforce = [0, 0.001, 0]\n\n[[body.force]]\non = \"bottom\"\nforce = [0, 0, 0.002]\n\n\
    [[body.force]]\non = 1660   # the middle\nforce = [3, 0, 0]\n";

const CHAIN: &str = "version = 1\ndt = 0.01\nsteps = 10\n[[body]]\nname = \"chain\"\nmesh = { chain = 41, spacing = 0.1 }\n\
    mass = { particle = 0.01 }\ndrag = 0.002\npins = [\"first\", 40]\n\
    springs = { stretch = { stiffness = 1000, damping = 0.5 }, bend = { stiffness = 2 } }\n";

const SNOW: &str = "version = 1\ndt = 0.02\nsteps = 10\n[snow]\ncell = 0.03   # m\n\
    [[snow.object]]\nname = \"ball\"\nsphere = { center = [0, 1, 0], radius = 0.15 }\n\
    [[snow.object]]\nname = \"block\"\nbox = { center = [0, 0, 0], size = [0.3, 0.3, 0.3] }\nparticles = 8000\n";

/// Where a particle is moved to (m).
type Motion = fn([f64; 3]) -> [f64; 3];

fn copy(text: &str, by: u32) -> String {
    coarser(text, "test", by).unwrap_or_else(|errors| panic!("{errors}")).text
}

fn built(text: &str) -> Built {
    let scene = Scene::parse(text, "test").expect("a scene");
    scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|errors| panic!("{errors}"))
}

fn network(text: &str) -> Network {
    built(text).setup.bodies.swap_remove(0).network
}

/// Energy (J) of the springs of a kind where the particles are moved so.
fn energy(network: &Network, kind: SpringKind, moved: Motion) -> f64 {
    let springs = network.springs.iter().filter(|spring| spring.kind == kind);
    let each = springs.map(|spring| {
        let [p, q] = spring.particles.map(|particle| moved(network.x[particle as usize]));
        let length = [0, 1, 2].iter().map(|&axis| (q[axis] - p[axis]).powi(2)).sum::<f64>().sqrt();
        spring.law.stiffness / 2.0 * (length - spring.rest_length).powi(2)
    });
    each.sum()
}

fn stretched([x, y, z]: [f64; 3]) -> [f64; 3] {
    [1.01 * x, y, z]
}

fn sheared([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x + 0.01 * z, y, z]
}

#[test]
fn a_copy_has_other_numbers_and_the_same_text_around_them() {
    let mut expected = GRID.to_owned();
    for (fine, coarse) in [
        ("grid = [81, 41], spacing = 0.025", "grid = [41, 21], spacing = 0.05"),
        ("particle = 0.01", "particle = 0.04"),
        ("drag = 1e-4", "drag = 0.0004"),
        ("\"top_left\", 80]", "\"top_left\", 40]"),
        ("[0, 0.001, 0]", "[0, 0.004, 0]"),
        ("[0, 0, 0.002]", "[0, 0, 0.004]"),
        // Row 20 and column 40 of 81 columns are row 10 and column 20 of 41.
        ("on = 1660", "on = 430"),
    ] {
        assert!(expected.contains(fine), "{fine}");
        expected = expected.replacen(fine, coarse, 1);
    }
    let made = coarser(GRID, "test", 2).expect("a copy");
    assert_eq!(made.text, expected);
    assert_eq!(made.changes, ["cloth has 41 x 21 particles in place of 81 x 41"]);
}

#[test]
fn a_copy_of_a_grid_keeps_mass_and_energy_of_the_continuum() {
    for by in [2, 4, 5] {
        let [fine, coarse] = [GRID.to_owned(), copy(GRID, by)].map(|text| network(&text));
        // A border counts as a whole row: one part in the number of coarse rows, at most on both sides.
        let border = 2.0 * f64::from(by) / 40.0;
        let close = |what: &str, fine: f64, coarse: f64| {
            assert!((coarse / fine - 1.0).abs() < border, "{what} by {by}: {coarse} in place of {fine}");
        };
        close("mass", fine.masses.iter().sum(), coarse.masses.iter().sum());
        close("drag", fine.drag * fine.x.len() as f64, coarse.drag * coarse.x.len() as f64);
        for (what, kind, moved) in [
            ("stretch", SpringKind::Stretch, stretched as Motion),
            ("bend", SpringKind::Bend, stretched as Motion),
            ("shear", SpringKind::Shear, sheared as Motion),
        ] {
            close(what, energy(&fine, kind, moved), energy(&coarse, kind, moved));
        }
        let last = |network: &Network| network.x.last().copied().expect("particles");
        assert!((0..3).all(|axis| (last(&fine)[axis] - last(&coarse)[axis]).abs() < 1e-12), "by {by}");
    }
}

#[test]
fn a_copy_of_a_chain_keeps_the_energy_of_its_stretch() {
    let [fine, coarse] = [CHAIN.to_owned(), copy(CHAIN, 4)].map(|text| network(&text));
    let [of_fine, of_coarse] =
        [&fine, &coarse].map(|network| energy(network, SpringKind::Stretch, stretched));
    assert!((of_coarse / of_fine - 1.0).abs() < 1e-9, "{of_coarse} in place of {of_fine}");
    assert_eq!((coarse.x.len(), coarse.masses[0], coarse.drag), (11, 0.04, 0.008));
    assert_eq!(coarse.pins, [0, 10]);
    let damping =
        coarse.springs.iter().find(|spring| spring.kind == SpringKind::Stretch).map(|s| s.law.damping);
    assert_eq!(damping, Some(0.125));
}

#[test]
fn where_a_number_divides_particles_the_corners_stay_where_they_are() {
    let text = |size: &str, pins: &str| {
        format!(
            "version = 1\ndt = 0.01\nsteps = 10\n[[body]]\nname = \"cloth\"\nmesh = {{ grid = {size}, spacing = 0.025 }}\n\
             mass = {{ particle = 0.01 }}\npins = [{pins}]\nsprings = {{ stretch = {{ stiffness = 100 }} }}\n"
        )
    };
    let ends = |text: &str| {
        let network = network(text);
        let [x, _, z] = network.x.last().copied().expect("particles");
        (x, z, network.masses.iter().sum::<f64>())
    };
    for (size, pins, keeps) in [
        ("[40, 40]", "", [true, true]),
        ("[60, 40]", "\"left\"", [false, true]),
        ("[60, 40]", "\"top_left\", \"top_right\"", [true, false]),
        ("[60, 40]", "", [false, false]),
    ] {
        let fine = text(size, pins);
        let ((x, z, mass), coarse) = (ends(&fine), ends(&copy(&fine, 2)));
        let off = [(coarse.0 / x - 1.0).abs(), (coarse.1 / z - 1.0).abs()];
        assert_eq!(off.map(|off| off < 1e-12), keeps, "{size} {pins}: {off:?}");
        assert!(off.iter().all(|off| *off < 0.01), "{size} {pins}: {off:?}");
        assert!((coarse.2 / mass - 1.0).abs() < 1e-12, "{size} {pins}: {} kg", coarse.2);
        let area = coarse.0 * coarse.1 / (x * z) - 1.0;
        assert!(!pins.is_empty() || area.abs() < 1e-12, "{size}: {area}");
    }
}

#[test]
fn a_copy_of_snow_has_larger_cells_and_the_same_mass() {
    let made = coarser(SNOW, "test", 2).expect("a copy");
    let expected =
        SNOW.replace("cell = 0.03 ", "cell = 0.06 ").replace("particles = 8000", "particles = 1000");
    assert_eq!(made.text, expected);
    assert_eq!(made.changes, ["cells of snow have sides of 0.06 m in place of 0.03 m"]);
    let [fine, coarse] = [SNOW, &made.text].map(|text| built(text).setup.snow.expect("snow"));
    let masses = |snow: &SnowSetup| -> Vec<f64> {
        snow.objects.iter().flat_map(|object| object.mass.iter().copied()).collect()
    };
    let [fine, coarse] = [masses(&fine), masses(&coarse)];
    let [of_fine, of_coarse] = [&fine, &coarse].map(|masses| masses.iter().sum::<f64>());
    assert!((of_coarse / of_fine - 1.0).abs() < 1e-9, "{of_coarse} kg in place of {of_fine} kg");
    let fewer = fine.len() as f64 / coarse.len() as f64;
    assert!((7.0..9.0).contains(&fewer), "{fewer} times fewer");
}

#[test]
fn what_has_no_coarser_copy_says_what_works() {
    let grid = |size: &str| GRID.replacen("[81, 41]", size, 1);
    let mesh = |mesh: &str| GRID.replacen("{ grid = [81, 41], spacing = 0.025 }", mesh, 1);
    for (text, by, parts) in [
        (
            grid("[81, 41]"),
            3,
            ["test:8:8: body[0].mesh: has 81 x 41 particles, of which 3", "allowed: 2, 4, 5, 8, 10, 20, 40"],
        ),
        (grid("[60, 40]"), 3, ["nor the gaps between them, 59 x 39", "allowed: 2, 4, 5, 10, 20"]),
        (
            grid("[3, 4]"),
            2,
            ["has 3 x 4", "no number divides all grids of the scene; 3 x 5 particles work by 2"],
        ),
        (grid("[1, 1]"), 2, ["has 1 particle", "a coarser copy needs more"]),
        (
            GRID.replacen("on = 1660", "on = 1702", 1),
            2,
            ["body[0].force[2].on: is 1702: ", "column and row, from 0 on, 2 divides"],
        ),
        (GRID.to_owned(), 1, ["by is 1", "allowed: a whole number, 2 or more"]),
        (GRID.to_owned(), 0, ["by is 0", "allowed: a whole number, 2 or more"]),
        (
            mesh("{ file = \"cow.obj\" }"),
            2,
            ["is a file, and no grid", "bodies that are a grid or a chain, and of snow"],
        ),
        (
            mesh("{ upload = \"torus\" }"),
            2,
            ["is an upload, and no grid", "bodies that are a grid or a chain"],
        ),
        (
            mesh("{ course_grid = 11 }"),
            2,
            ["is a course_grid", "{ grid = [11, 11], spacing = 0.1, plane = \"upright\""],
        ),
    ] {
        let error = coarser(&text, "test", by).expect_err("no copy").to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "by {by}: {error}\nin place of {parts:?}");
    }
}

#[test]
fn every_shipped_scene_of_grids_and_snow_has_a_copy_that_can_be_built() {
    for (name, text) in shipped_scenes() {
        match coarser(text, name, 2) {
            Ok(made) => {
                built(&made.text);
                assert!(
                    !name.starts_with("drap") && made.text.lines().count() == text.lines().count(),
                    "{name}"
                );
            }
            Err(errors) => {
                let what = if *name == "walker" { "is an upload" } else { "course_grid" };
                let is_no_grid = *name == "walker" || name.starts_with("drap");
                assert!(is_no_grid && errors.first().message.contains(what), "{errors}");
            }
        }
    }
}

#[test]
fn a_scene_and_its_text_have_the_same_copy() {
    for text in [CHAIN, SNOW] {
        let scene = Scene::parse(text, "test").expect("a scene");
        let of_scene = scene.coarser(4).expect("a copy");
        assert_eq!(of_scene, Scene::parse(&copy(text, 4), "test").expect("a scene"));
        assert_ne!(of_scene, scene);
    }
}

#[test]
fn particles_of_both_grids_are_found() {
    let grid = CoarserGrid::new([5, 3], 2).expect("a grid");
    assert_eq!((grid.coarse, grid.gaps()), ([3, 2], [2.0, 2.0]));
    let found: Vec<Option<u32>> = (0..16).map(|particle| grid.coarse_particle(particle)).collect();
    let mut expected = [None; 16];
    for (fine, coarse) in [(0, 0), (2, 1), (4, 2), (10, 3), (12, 4), (14, 5)] {
        expected[fine] = Some(coarse);
    }
    assert_eq!(found, expected);
    let grid = CoarserGrid::new([6, 4], 2).expect("a grid");
    assert_eq!((grid.coarse, grid.gaps()), ([3, 2], [2.5, 3.0]));
    let found: Vec<u32> = (0..24).filter(|particle| grid.coarse_particle(*particle).is_some()).collect();
    assert_eq!(found, [0, 5, 18, 23]);
}
