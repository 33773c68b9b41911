//! Cloth that sleeps while it lies still: how far it comes off the run without sleep, and that this is told. `wakes`: in which step it wakes, and why.
//! `bits`: what a fork, a state that is put back and other threads go on with. `costs`: what it costs, and what is refused.

mod wakes;
mod bits;
mod costs;

use nappe_sim::{
    math::Precision,
    world::{Change, Pull, Simulation},
};
use nappe_tests::scene::{advance, max_distance, of_text, positions};

/// Time step of the scenes (s): a window takes 0.04 s.
const DT: f64 = 0.005;

/// How a sheet of `side` x `side` particles begins.
#[derive(Clone, Copy)]
struct Sheet<'a> {
    name: &'a str,
    side: usize,
    /// Where its first corner is (m).
    at: [f64; 3],
    /// More keys of its body.
    keys: &'a str,
}

impl Sheet<'_> {
    fn text(self) -> String {
        let Self { name, side, at, keys } = self;
        format!(
            "[[body]]\nname = \"{name}\"\nmesh = {{ grid = [{side}, {side}], spacing = 0.05 }}\n\
             transform = {{ translate = {at:?} }}\nmass = {{ particle = 0.005 }}\n{keys}\n\
             springs = {{ stretch = {{ stiffness = 100, damping = 0.02 }}, shear = {{ stiffness = 50, damping = 0.01 }}, \
             bend = {{ stiffness = 5, damping = 0.002 }} }}\n\
             solver = {{ tolerance = 1e-6, max_iterations = 600 }}\n"
        )
    }
}

const FLOOR: &str = "[[collider]]\nname = \"floor\"\nplane = { point = [0, 0, 0], normal = [0, 1, 0] }\n\
    friction = 0.5\nmargin = 0.01\n";

/// A scene of so many steps, with more keys of its root, and its bodies and colliders.
fn scene(steps: u64, root: &str, rest: &str, parts: &str) -> String {
    format!("version = 1\ndt = {DT}\nsteps = {steps}\n{root}\nrest = {{ {rest} }}\n{parts}")
}

/// A scene whose runs with sleep and without are compared.
pub(crate) struct Compared {
    name: &'static str,
    steps: u64,
    root: &'static str,
    parts: String,
    /// Before which step what is changed.
    changes: Vec<(u64, Change)>,
}

/// Draws a particle of a sheet to a point (m) for so long (s).
fn drawn(body: &str, particle: u32, to: [f64; 3], seconds: f64) -> Change {
    Change::Pull(Pull {
        body: body.to_owned(),
        particles: [particle].into(),
        points: [to].into(),
        frequency: 20.0,
        most: 200.0,
        seconds,
    })
}

fn lying() -> Compared {
    let sheet = Sheet { name: "sheet", side: 9, at: [0.0, 0.01, 0.0], keys: "drag = 1e-3" };
    Compared {
        name: "lying, a corner lifted",
        steps: 500,
        root: "",
        parts: sheet.text() + FLOOR,
        changes: vec![(100, drawn("sheet", 0, [0.0, 0.08, 0.0], 0.5))],
    }
}

fn hanging() -> Compared {
    let keys = "pins = [\"top_left\", \"top_right\"]\ndrag = 0.02";
    let sheet = Sheet { name: "sheet", side: 7, at: [0.0, 0.0, 0.0], keys };
    Compared { name: "hanging", steps: 1500, root: "", parts: sheet.text(), changes: Vec::new() }
}

fn drifting() -> Compared {
    let sheet = Sheet { name: "sheet", side: 5, at: [0.0, 0.0, 0.0], keys: "velocity = [2e-4, 0, 1e-4]" };
    Compared {
        name: "drifting",
        steps: 400,
        root: "gravity = [0, 0, 0]",
        parts: sheet.text(),
        changes: Vec::new(),
    }
}

fn beside() -> Compared {
    let sheets =
        [("one", "drag = 1e-3"), ("thrown", "drag = 1e-3\nvelocity = [0, 1, 0]"), ("three", "drag = 1e-3")];
    let sheets = sheets
        .into_iter()
        .enumerate()
        .map(|(place, (name, keys))| Sheet { name, side: 6, at: [place as f64, 0.01, 0.0], keys }.text());
    Compared {
        name: "side by side, one thrown",
        steps: 400,
        root: "",
        parts: sheets.collect::<String>() + FLOOR,
        changes: Vec::new(),
    }
}

fn hit() -> Compared {
    let sheet = Sheet { name: "sheet", side: 9, at: [0.0, 0.01, 0.0], keys: "drag = 1e-3" };
    // Along the floor, 6 cm into the sheet.
    let ball = "[[collider]]\nname = \"ball\"\nsphere = { center = [-0.1, 0.05, 0.2], radius = 0.05 }\nmargin = 0.005\n\
        key = [{ time = 0, position = [-0.1, 0.05, 0.2] }, { time = 0.5, position = [-0.1, 0.05, 0.2] }, \
        { time = 0.7, position = [0.01, 0.05, 0.2] }]\n";
    Compared {
        name: "lying, hit by a ball",
        steps: 300,
        root: "",
        parts: sheet.text() + FLOOR + ball,
        changes: Vec::new(),
    }
}

fn pile() -> Compared {
    let keys = "drag = 1e-3\nthickness = 0.004";
    let sheets = [("lower", 0.01), ("upper", 0.0145)]
        .map(|(name, y)| Sheet { name, side: 7, at: [0.0, y, 0.0], keys }.text());
    Compared {
        name: "two on each other, the upper pulled",
        // Until it is let go: what slides back then makes more of each difference, by three times what is told.
        steps: 560,
        root: "",
        parts: sheets.concat() + FLOOR,
        changes: vec![(500, drawn("upper", 0, [0.0, 0.05, 0.0], 0.3))],
    }
}

/// Scenes of one step after the other, and of sheets that something happens to.
pub(crate) fn all() -> [Compared; 4] {
    [lying(), hanging(), drifting(), beside()]
}

/// Steps a scene with sleep and without, and compares positions after each step: they are off by no more than is told, nor than the
/// scene allows. Some of it sleeps.
pub(crate) fn is_off_by_no_more_than_is_told(compared: &Compared, error: f64, precision: Precision) {
    let Compared { name, steps, root, parts, changes } = compared;
    let text = |sleep: bool| scene(*steps, root, &format!("error = {error}, sleep = {sleep}"), parts);
    let [mut sleeps, mut awake] = [true, false].map(|sleep| of_text(&text(sleep), precision));
    // What two runs round otherwise.
    let rounding = if precision == Precision::F32 { 2e-6 } else { 1e-12 };
    let (mut most, mut asleep) = (0.0_f64, 0);
    for step in 0..*steps {
        for (_, change) in changes.iter().filter(|(at, _)| *at == step) {
            sleeps.apply(std::slice::from_ref(change)).expect("a fair change");
            awake.apply(std::slice::from_ref(change)).expect("a fair change");
        }
        let rest = advance(&mut sleeps, 1).rest.expect("it is watched");
        let still = advance(&mut awake, 1).rest.expect("it is watched");
        assert_eq!((still.pieces_asleep, still.long_steps, still.told), (0, 0, 0.0), "{name}");
        let off = max_distance(&positions(&sleeps), &positions(&awake));
        let told = rest.told;
        assert!(
            off <= told + rounding,
            "{name} in {precision}, {error:e} m, step {step}: {off:e} m, told {told:e} m"
        );
        assert!(off <= error, "{name} in {precision}, {error:e} m, step {step}: {off:e} m");
        most = most.max(off);
        asleep = asleep.max(rest.pieces_asleep);
    }
    assert!(asleep > 0, "{name} in {precision}, {error:e} m: nothing slept; off by {most:e} m");
}

#[test]
fn what_sleeps_is_off_by_no_more_than_is_told_and_than_the_scene_allows() {
    for compared in all() {
        for precision in Precision::ALL {
            is_off_by_no_more_than_is_told(&compared, 1e-3, precision);
        }
    }
}

#[test]
fn what_sleeps_and_is_hit_or_lies_in_a_pile_is_off_by_no_more_than_is_told() {
    for precision in Precision::ALL {
        is_off_by_no_more_than_is_told(&hit(), 1e-3, precision);
    }
    is_off_by_no_more_than_is_told(&pile(), 1e-3, Precision::F64);
}

#[test]
fn what_slides_faster_and_faster_is_off_by_no_more_than_is_told() {
    // Friction leaves 0.4 mm/s² of what pulls it aside: after 2 s it is 0.8 mm away.
    let sheet = Sheet { name: "sheet", side: 5, at: [0.0, 0.01, 0.0], keys: "" };
    let compared = Compared {
        name: "sliding",
        steps: 400,
        root: "gravity = [4.9054, -9.81, 0]",
        parts: sheet.text() + FLOOR,
        changes: Vec::new(),
    };
    is_off_by_no_more_than_is_told(&compared, 1e-3, Precision::F64);
}

/// A sheet that lies on the floor with a pinned corner, and air; a ball stands far above.
fn pinned() -> String {
    let sheet = Sheet { name: "sheet", side: 5, at: [0.0, 0.01, 0.0], keys: "pins = [0]\ndrag = 1e-3" };
    let ball = "[[collider]]\nname = \"ball\"\nsphere = { center = [0.1, 3, 0.1], radius = 0.1 }\n";
    sheet.text() + FLOOR + ball
}

/// The simulation of that, after so many steps that it sleeps.
fn asleep(root: &str, steps: u64) -> Simulation {
    let text = scene(400, root, "error = 1e-3", &pinned());
    let mut simulation = of_text(&text, Precision::F64);
    let rest = advance(&mut simulation, steps).rest.expect("it is watched");
    assert_eq!((rest.pieces_asleep, rest.wakes, rest.awake_share()), (1, 0, 0.0), "{root}: {rest:?}");
    simulation
}
