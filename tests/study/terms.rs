//! What a scene can do without: changes against ordinary runs of scene texts, what can go, and what cannot go together.

use nappe_scene::{NoMeshes, Removal, Scene, SceneLimits};
use nappe_sim::{
    cloth::{ClothSettings, Integrator, Network, SpringKind, SpringLaw, SpringRules},
    math::Precision,
    world::{BodySetup, Simulation, WorldSetup},
};
use nappe_study::{
    Budget, Case, Plan, Request, SceneTerms, Setting, SnowSetting, SnowSteps, Stepped, Steps, Term, Terms,
    plan,
};
use nappe_tests::{
    networks::{scatter, sheet},
    scene::{advance, positions},
};

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];
const DT: f64 = 0.01;
/// Steps of a scene.
const STEPS: u64 = 20;

/// A sheet that hangs at two corners, with bending springs of a stiffness (N/m) and a drag (N s/m).
fn hanging(bend: f64, drag: f64) -> Scene {
    let text = format!(
        "version = 1\ndt = {DT}\nsteps = {STEPS}\nprecision = \"f64\"\nwind = [1, 0, 0.5]\n[[body]]\nname = \"cloth\"\n\
         mesh = {{ grid = [6, 6], spacing = 0.05, ripple = 0.002 }}\nmass = {{ particle = 0.005 }}\n\
         pins = [\"top_left\", \"top_right\"]\ndrag = {drag:e}\nintegrator = \"velocity_verlet\"\n\
         springs = {{ stretch = {{ stiffness = 100 }}, shear = {{ stiffness = 50 }}, bend = {{ stiffness = {bend:e} }} }}\n"
    );
    Scene::parse(&text, "hanging.toml").unwrap_or_else(|error| panic!("{error}"))
}

/// A block of snow that falls freely.
fn falling() -> Scene {
    let text = "version = 1\ndt = 0.01\nsteps = 6\n[snow]\ncell = 0.1\ntransfer = \"pic_flip\"\nflip = 0.9\n[[snow.object]]\n\
        name = \"block\"\nbox = { min = [0, 1, 0], max = [0.1, 1.1, 0.1] }\nsampling = \"lattice\"\nparticles = 8\n\
        density_noise = 0.1\nstiffness_noise = 0.1\n";
    Scene::parse(text, "falling.toml").unwrap_or_else(|error| panic!("{error}"))
}

fn built(scene: &Scene) -> Case {
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    Case::new("scene", built.setup, built.initial_changes, scene.precision).expect("cloth or snow")
}

/// A scene as a row of a plan has it: by velocity Verlet in fixed steps, or by the scene's own transfer in certified steps.
fn stepped_by(scene: &Scene, stepped: &Stepped) -> Scene {
    let mut scene = scene.clone();
    scene.precision = stepped.precision();
    match stepped {
        Stepped::Cloth(Setting { steps: Steps::Fixed(parts), .. }) => {
            scene.bodies[0].integrator = Integrator::VelocityVerlet;
            scene.bodies[0].substeps = Some(*parts);
        }
        Stepped::Snow(SnowSetting { steps: SnowSteps::Share(share), .. }) => {
            let snow = scene.snow.as_mut().expect("snow");
            snow.safety = Some(*share);
        }
        other => panic!("{other:?}"),
    }
    scene
}

/// The same without some of its terms.
fn without(scene: &Scene, stepped: &Stepped, places: &[usize]) -> Scene {
    let scene = stepped_by(scene, stepped);
    let terms = scene.terms();
    let gone: Vec<Removal> = places.iter().map(|place| terms[*place].removal).collect();
    scene.without(&gone)
}

fn planned_by(scene: &Scene, tolerance: f64, method: &str, precision: Precision, wanted: Terms) -> Plan {
    let names = |stepped: &Stepped| -> Vec<String> {
        stepped_by(scene, stepped).terms().into_iter().map(|term| term.name).collect()
    };
    let left = |stepped: &Stepped, places: &[usize]| -> Result<Case, String> {
        Ok(built(&without(scene, stepped, places)))
    };
    let terms = SceneTerms { names: &names, without: &left, grids: &[], wanted };
    let request = Request {
        tolerance,
        end: scene.steps as f64 * scene.dt,
        scene_steps: scene.steps,
        times: None,
        methods: vec![method.to_owned()],
        precisions: vec![precision],
        effort: None,
    };
    plan(&built(scene), &request, &terms, &Budget::new(None), &|_| ())
}

fn planned(scene: &Scene, tolerance: f64, wanted: Terms) -> Plan {
    planned_by(scene, tolerance, "velocity_verlet", Precision::F64, wanted)
}

fn term<'a>(plan: &'a Plan, name: &str) -> &'a Term {
    plan.terms.iter().find(|term| term.name == name).unwrap_or_else(|| panic!("{name}: {:?}", plan.terms))
}

fn simulation(scene: &Scene) -> Simulation {
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    Simulation::new(&built.setup, scene.precision).expect("a scene").0
}

/// Where particles are after each step of a scene, and the hash of the last state.
fn ordinary(scene: &Scene, steps: u64) -> (Vec<Vec<[f64; 3]>>, u64) {
    let mut simulation = simulation(scene);
    let states = (0..steps)
        .map(|_| {
            advance(&mut simulation, 1);
            positions(&simulation)
        })
        .collect();
    (states, simulation.state_hash())
}

/// The largest rms distance (m) of states.
fn distance<'a>(
    case: &Case,
    a: impl IntoIterator<Item = &'a [f64]>,
    b: impl IntoIterator<Item = &'a [f64]>,
) -> f64 {
    a.into_iter().zip(b).map(|(a, b)| case.rms(a, b)).fold(0.0, f64::max)
}

fn flat(states: &[Vec<[f64; 3]>]) -> impl Iterator<Item = &[f64]> {
    states.iter().map(|state| state.as_flattened())
}

#[test]
fn a_change_is_the_distance_of_two_ordinary_runs_of_scene_texts() {
    let whole = hanging(2.0, 1e-3);
    let found = planned(&whole, 1e-3, Terms::Kept);
    let stepped = found.row.as_ref().filter(|_| found.is_met).expect("a row").stepped;
    let whole = stepped_by(&whole, &stepped);
    let steps = (found.chart.until() / DT).round() as u64;
    let (before, hash) = ordinary(&whole, steps);
    assert_eq!(found.written().map(|row| row.state_hash), Some(hash));
    let (mut edited, mut calm) = (whole.clone(), whole.clone());
    edited.bodies[0].springs.as_mut().expect("springs").bend = None;
    calm.wind = [0.0; 3];
    for (edited, name) in [(edited, "springs of bend"), (calm, "wind")] {
        let (after, _) = ordinary(&edited, steps);
        let distance = distance(&built(&whole), flat(&before), flat(&after));
        let change = term(&found, name).change.expect("it ran");
        assert!((change / distance - 1.0).abs() < 1e-6, "{name}: {change:e} m, not {distance:e} m");
    }
}

#[test]
fn a_bend_and_a_drag_that_do_nothing_can_go_and_what_is_needed_cannot() {
    let whole = hanging(1e-6, 1e-12);
    let found = planned(&whole, 1e-3, Terms::LeftOut);
    let gone: Vec<&Term> = found.terms.iter().filter(|term| term.is_left_out).collect();
    assert!(found.is_met && term(&found, "springs of bend").is_left_out && term(&found, "drag").is_left_out);
    assert!(term(&found, "springs of shear").is_needed, "{:?}", found.terms);
    assert!(gone.iter().all(|term| !term.is_needed), "{gone:?}");
    let change = found.together_change.expect("they were removed together");
    let verified = found.verified.expect("it was verified");
    assert!(change < 1e-3 - verified.error, "{change:e} m");

    // What is written is the scene without them: its hash, its error against the reference of the whole scene, its end.
    let stepped = found.row.as_ref().expect("a row").stepped;
    let written = without(&whole, &stepped, &gone.iter().map(|term| term.place).collect::<Vec<_>>());
    assert!(written.bodies[0].springs.as_ref().is_some_and(|springs| springs.bend.is_none()));
    let (states, hash) = ordinary(&written, (found.chart.until() / DT).round() as u64);
    let row = found.written().expect("what is written");
    assert_eq!(row.state_hash, hash);
    let reference = found.chart.reference.as_ref().expect("a reference");
    let error = distance(&built(&whole), flat(&states), reference.states.iter().map(Vec::as_slice));
    let said = row.error().expect("an error");
    assert!((error / said - 1.0).abs() < 1e-9 && said <= 1e-3, "{error:e} m, not {said:e} m");
    assert_eq!(found.reach.as_ref().map(|reach| reach.steps), Some(STEPS));
    advance(&mut simulation(&written), STEPS);
}

#[test]
fn a_sheet_that_needs_its_bending_keeps_it() {
    let found = planned(&hanging(30.0, 0.0), 1e-3, Terms::Kept);
    let bend = term(&found, "springs of bend");
    assert!(bend.is_needed && !bend.is_left_out && bend.is_looked_at, "{bend:?}");
    assert!(bend.change.is_some_and(|change| change > 1e-4), "{bend:?}");
}

#[test]
fn nothing_is_left_out_where_a_term_was_not_looked_at() {
    let whole = hanging(1e-6, 1e-12);
    let method = ["velocity_verlet".to_owned()].to_vec();
    let names = |_: &Stepped| -> Vec<String> { whole.terms().into_iter().map(|term| term.name).collect() };
    let left = |stepped: &Stepped, places: &[usize]| -> Result<Case, String> {
        Ok(built(&without(&whole, stepped, places)))
    };
    let terms = SceneTerms { names: &names, without: &left, grids: &[], wanted: Terms::LeftOut };
    let request = Request {
        tolerance: 1e-3,
        end: STEPS as f64 * DT,
        scene_steps: STEPS,
        times: None,
        methods: method,
        precisions: vec![Precision::F64],
        effort: None,
    };
    // It ends when the third term is looked at.
    let budget = Budget::new(None);
    let stop = budget.stop();
    let count = std::cell::Cell::new(0);
    let tell = |what: &str| {
        count.set(count.get() + u32::from(what.starts_with("without ")));
        if count.get() == 3 {
            stop.stop();
        }
    };
    let found = plan(&built(&whole), &request, &terms, &budget, &tell);
    assert!(found.terms.iter().any(|term| !term.is_looked_at) && found.is_terms_cut, "{:?}", found.terms);
    assert!(found.terms.iter().all(|term| !term.is_left_out), "{:?}", found.terms);
    assert!(found.reduced.is_none() && found.together_change.is_none());
}

/// A sheet that hangs, by its network, without bending springs.
fn damped() -> Network {
    let law = |stiffness: f64, damping: f64| SpringLaw { stiffness, damping };
    let rules = SpringRules { stretch: law(100.0, 4e-3), shear: Some(law(50.0, 2e-3)), bend: None };
    let mut network = sheet(6, 0.05, &rules, 0.005);
    for (i, x) in network.x.iter_mut().enumerate().skip(6) {
        x[1] += 2e-3 * scatter(i);
    }
    network
}

#[test]
fn terms_that_are_small_alone_and_large_together_do_not_both_go() {
    let kinds = [SpringKind::Stretch, SpringKind::Shear];
    let undamped = |places: &[usize]| {
        let mut network = damped();
        for place in places {
            let springs = network.springs.iter_mut().filter(|spring| spring.kind == kinds[*place]);
            springs.for_each(|spring| spring.law.damping = 0.0);
        }
        let body = BodySetup {
            name: "cloth".to_owned(),
            network,
            settings: ClothSettings::default(),
            forces: Vec::new(),
        };
        let (wind, colliders) = ([1.0, 0.0, 0.5], Vec::new());
        let setup = WorldSetup {
            dt: DT,
            gravity: GRAVITY,
            wind_at: Vec::new(),
            wind,
            colliders,
            bodies: vec![body],
            snow: None,
        };
        Case::new("sheet", setup, Vec::new(), Precision::F64).expect("a cloth")
    };
    let names = |_: &Stepped| -> Vec<String> { kinds.map(|kind| kind.name().to_owned()).to_vec() };
    let left = |_: &Stepped, places: &[usize]| -> Result<Case, String> { Ok(undamped(places)) };
    let terms = SceneTerms { names: &names, without: &left, grids: &[], wanted: Terms::Kept };
    let planned = |tolerance: f64| {
        let request = Request {
            tolerance,
            end: STEPS as f64 * DT,
            scene_steps: STEPS,
            times: None,
            methods: vec!["velocity_verlet".to_owned()],
            precisions: vec![Precision::F64],
            effort: None,
        };
        plan(&undamped(&[]), &request, &terms, &Budget::new(None), &|_| ())
    };
    let largest = |plan: &Plan| {
        let changes: Vec<f64> = plan.terms.iter().filter_map(|term| term.change).collect();
        assert!((0.3..3.0).contains(&(changes[0] / changes[1])), "{changes:?}");
        changes[0].max(changes[1])
    };
    let change = largest(&planned(1e-4));
    // Both move the answer the same way, by nearly as much: a tolerance that leaves room for each of them, and not for both.
    let tolerances = (10..80).map(|tenths| 0.1 * f64::from(tenths) * change);
    let found = tolerances.map(planned).find(|found| {
        let allowed = found.chart.tolerance - found.verified.expect("verified").error;
        (1.02..1.2).contains(&(allowed / largest(found)))
    });
    let found = found.expect("a tolerance between");
    assert!(found.terms.iter().all(|term| !term.is_needed), "{:?}", found.terms);
    // The one that moves it less goes.
    let least = found.terms.iter().min_by(|a, b| a.change.partial_cmp(&b.change).expect("numbers"));
    let gone: Vec<&Term> = found.terms.iter().filter(|term| term.is_left_out).collect();
    assert_eq!(gone, least.into_iter().collect::<Vec<_>>(), "{:?}", found.terms);
}

#[test]
fn snow_has_terms_and_the_state_that_a_plan_says_is_that_of_the_scene() {
    let whole = falling();
    for wanted in [Terms::Kept, Terms::LeftOut] {
        let found = planned_by(&whole, 5e-3, "pic_flip_quadratic", Precision::F32, wanted);
        let row = found.row.as_ref().filter(|_| found.is_met).expect("a row");
        let half = found.verified.and_then(|verified| verified.half_step_error);
        assert!(half.is_some_and(|half| half <= 5e-3), "{half:?}");
        let names: Vec<&str> = found.terms.iter().map(|term| term.name.as_str()).collect();
        assert_eq!(
            names,
            ["plasticity", "hardening", "noise of density", "noise of stiffness", "share of FLIP"]
        );
        // What falls freely feels none of them.
        assert!(found.terms.iter().all(|term| term.is_left_out), "{:?}", found.terms);
        let places: Vec<usize> = if wanted == Terms::Kept {
            Vec::new()
        } else {
            found.terms.iter().map(|term| term.place).collect()
        };
        let written = without(&whole, &row.stepped, &places);
        let (_, hash) = ordinary(&written, (found.chart.until() / DT).round() as u64);
        assert_eq!(found.written().map(|row| row.state_hash), Some(hash), "{wanted:?}");
        assert_eq!(found.reach.as_ref().map(|reach| reach.steps), Some(6));
    }
}

#[test]
fn a_term_of_snow_moves_the_answer_by_the_distance_of_two_ordinary_runs() {
    let mut whole = falling();
    // It begins to spin, which PIC stops.
    whole.snow.as_mut().expect("snow").objects[0].angular_velocity = [0.0, 0.0, 2.0];
    let found = planned_by(&whole, 2e-2, "pic_flip_quadratic", Precision::F32, Terms::Kept);
    let row = found.row.as_ref().filter(|_| found.is_met).expect("a row");
    let before = stepped_by(&whole, &row.stepped);
    let mut after = before.clone();
    after.snow.as_mut().expect("snow").flip = Some(0.0);
    let steps = (found.chart.until() / DT).round() as u64;
    let [(before, _), (after, _)] = [&before, &after].map(|scene| ordinary(scene, steps));
    let marks = &found.chart.reference.as_ref().expect("a reference").times;
    let ratio = (marks.interval / DT).round() as usize;
    let at = |states: &[Vec<[f64; 3]>]| -> Vec<Vec<f64>> {
        let kept = marks.marks.iter().map(|mark| states[ratio * *mark as usize - 1].as_flattened().to_vec());
        kept.collect()
    };
    let (before, after) = (at(&before), at(&after));
    let distance =
        distance(&built(&whole), before.iter().map(Vec::as_slice), after.iter().map(Vec::as_slice));
    let change = term(&found, "share of FLIP").change.expect("it ran");
    assert!(distance > 0.0 && (change / distance - 1.0).abs() < 1e-6, "{change:e} m, not {distance:e} m");
}
