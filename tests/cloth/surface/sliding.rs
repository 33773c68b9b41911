//! A card of cloth slides on a table of cloth: without friction it keeps its speed, with friction it stops and gets faster as Coulomb's law says,
//! whatever the mesh and the step.

use std::fmt::Write as _;

use nappe_sim::{math::Precision, world::Simulation};
use nappe_tests::{
    scene::{advance, of_text, positions, velocities},
    surface::GRAVITY,
};

const FRICTION: f64 = 0.3;

/// A card on a table of pins, and the number of these.
struct Card {
    simulation: Simulation,
    pins: usize,
}

/// Mesh and step of a card.
#[derive(Clone, Copy, Debug)]
struct Case {
    spacing: f64,
    dt: f64,
    friction: f64,
    /// How fast (m/s) it comes.
    speed: f64,
    /// How steep the table is: gravity leans.
    slope: f64,
    /// Length of the table (m).
    length: f64,
    precision: Precision,
}

impl Case {
    fn card(&self) -> Card {
        let Self { spacing, dt, friction, speed, slope, length, precision } = *self;
        let size = |length: f64| (length / spacing).ceil() as usize + 1;
        let [columns, rows, side] = [size(length + 0.3), size(0.2), size(0.12)];
        let pins = columns * rows;
        let (sin, cos) = slope.atan().sin_cos();
        let mut text = format!(
            "version = 1\ndt = {dt}\ngravity = [{}, {}, 0]\ncontact = {{ friction = {friction} }}\n",
            GRAVITY * sin,
            -GRAVITY * cos,
        );
        let body = |name: &str, grid: [usize; 2], place: [f64; 3], more: &str| {
            format!(
                "[[body]]\nname = \"{name}\"\nmesh = {{ grid = {grid:?}, spacing = {spacing} }}\n\
                 transform = {{ translate = {place:?} }}\nmass = {{ density = 0.3 }}\nthickness = 0.004\n{more}\n\
                 springs = {{ stretch = {{ stiffness = 200, damping = 0.02 }}, shear = {{ stiffness = 50, damping = 0.01 }}, \
                 bend = {{ stiffness = 1, damping = 0.002 }} }}\n"
            )
        };
        let all: Vec<usize> = (0..pins).collect();
        let table = body("table", [columns, rows], [-0.0933, 0.0, -0.0371], &format!("pins = {all:?}"));
        let card = body("card", [side, side], [0.0, 0.004, 0.0], &format!("velocity = [{speed}, 0, 0]"));
        write!(text, "{table}{card}").expect("a text");
        Card { simulation: of_text(&text, precision), pins }
    }
}

impl Card {
    fn mean(&self, field: fn(&Simulation) -> Vec<[f64; 3]>) -> f64 {
        let rows = field(&self.simulation);
        rows[self.pins..].iter().map(|row| row[0]).sum::<f64>() / (rows.len() - self.pins) as f64
    }

    fn place(&self) -> f64 {
        self.mean(positions)
    }

    fn speed(&self) -> f64 {
        self.mean(velocities)
    }
}

/// A card that neither comes nor slides.
const AT_REST: Case = Case {
    spacing: 0.02,
    dt: 5e-3,
    friction: FRICTION,
    speed: 0.0,
    slope: 0.0,
    length: 0.3,
    precision: Precision::F64,
};

#[test]
fn without_friction_a_card_keeps_its_speed_on_every_mesh_and_at_every_step() {
    for (spacing, precision) in [(0.03, Precision::F32), (0.02, Precision::F64), (0.011, Precision::F64)] {
        for dt in [0.01, 0.005, 0.0025] {
            let case = Case { spacing, dt, friction: 0.0, speed: 1.0, precision, ..AT_REST };
            let mut card = case.card();
            advance(&mut card.simulation, (0.3 / dt).round() as u64);
            let speed = card.speed();
            assert!((speed - 1.0).abs() < 2e-3, "{case:?}: {speed} m/s of 1");
        }
    }
}

#[test]
fn a_card_stops_after_the_way_that_coulomb_s_law_gives() {
    for (spacing, dt, speed) in [(0.03, 0.01, 1.0), (0.02, 0.005, 1.0), (0.03, 0.005, 3.0)] {
        let deceleration = FRICTION * GRAVITY;
        let right = speed * speed / (2.0 * deceleration);
        let case = Case { spacing, dt, speed, length: right, ..AT_REST };
        let mut card = case.card();
        let start = card.place();
        let most = (2.0 * speed / deceleration / dt) as usize;
        let stops = (0..most).any(|_| {
            advance(&mut card.simulation, 1);
            card.speed() <= 2e-3
        });
        assert!(stops, "{case:?}: it goes at {} m/s still", card.speed());
        // Implicit Euler goes by the velocity at the end of each step.
        let way = card.place() - start;
        let expected = right - 0.5 * speed * dt;
        assert!((way / expected - 1.0).abs() < 0.01, "{case:?}: {way} m, not {expected}");
        assert!((way / right - 1.0).abs() < 0.03, "{case:?}: {way} m, not {right}");
    }
}

#[test]
fn a_slope_below_the_friction_holds_and_on_one_above_it_a_card_gets_faster_as_it_should() {
    for (share, precision) in
        [(0.9, Precision::F32), (0.98, Precision::F64), (1.02, Precision::F32), (1.2, Precision::F64)]
    {
        let case = Case { slope: share * FRICTION, length: 0.6, precision, ..AT_REST };
        let mut card = case.card();
        advance(&mut card.simulation, 50);
        let first = card.speed();
        if share < 1.0 {
            assert!((first / (1e-3 * share) - 1.0).abs() < 0.01, "{share}: it creeps at {first} m/s");
            continue;
        }
        advance(&mut card.simulation, 100);
        let (sin, cos) = case.slope.atan().sin_cos();
        let expected = GRAVITY * (sin - FRICTION * cos);
        let found = (card.speed() - first) / 0.5;
        assert!((found / expected - 1.0).abs() < 0.02, "{share}: {found} m/s², not {expected}");
    }
}
