//! What a scene can do without: each of its terms removed in turn, and how far that moves the answer.

use nappe_sim::{
    cloth::{ElementKind, Network, SpringKind},
    collide::Collider,
    math::Precision,
    world::{BodySetup, WorldSetup},
};

use crate::{
    budget::Phase,
    case::Case,
    row::median_seconds,
    run::{End, Run, run},
    setting::Setting,
    times::Times,
};

/// The least share of the time that counts as saved, where terms are put in order.
const LEAST_SAVING: f64 = 0.01;

/// A part of what a scene states that can be removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Removal {
    /// All springs of a kind.
    Springs(SpringKind),
    /// The damping of all springs of a kind.
    Damping(SpringKind),
    /// Elements of a law of a body, which is known by its place.
    Elements(usize, ElementKind),
    /// The damping of elements of a law of a body.
    ElementDamping(usize, ElementKind),
    /// Drag of the medium on all bodies.
    Drag,
    /// The motion of the medium.
    Wind,
    /// A collider, by its place.
    Collider(usize),
    /// The friction of a collider.
    Friction(usize),
    /// The restitution of a collider.
    Restitution(usize),
    /// Half of the digits: f64 becomes f32.
    Digits,
}

/// A term of a scene, and what becomes of the answer without it.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// In words: `springs of bend`, `friction of table`.
    pub name: String,
    /// What is removed.
    pub removal: Removal,
    /// How far (m) the answer moves: the largest over the comparison times of the rms distance; none where a run without it
    /// fails.
    pub change: Option<f64>,
    /// The share of evaluations and products that is saved.
    pub saved_counts: f64,
    /// The share of seconds that is saved.
    pub saving: f64,
    /// Whether the answer moves by more than the tolerance leaves.
    pub is_needed: bool,
    /// Whether it is among those that can go together.
    pub is_left_out: bool,
}

/// Terms of the cloths of a setup. A field that is added later does not compile here until it is, or has, a term.
fn removals(setup: &WorldSetup, precision: Precision) -> Vec<(String, Removal)> {
    let WorldSetup { dt: _, gravity: _, wind, colliders, bodies, snow: _ } = setup;
    let mut found = Vec::new();
    let has = |is_one: &dyn Fn(&Network) -> bool| bodies.iter().any(|body| is_one(&body.network));
    for kind in SpringKind::ALL {
        let is_kind = |network: &Network| network.springs.iter().any(|spring| spring.kind == kind);
        let is_damped =
            |network: &Network| network.springs.iter().any(|s| s.kind == kind && s.law.damping > 0.0);
        let name = kind.name();
        if kind != SpringKind::Stretch && has(&is_kind) {
            found.push((format!("springs of {name}"), Removal::Springs(kind)));
        }
        if has(&is_damped) {
            found.push((format!("damping of {name}"), Removal::Damping(kind)));
        }
    }
    let mut has_drag = false;
    for (place, BodySetup { name, network, settings: _ }) in bodies.iter().enumerate() {
        let Network { x: _, v: _, masses: _, pins: _, springs: _, elements, drag, triangles: _, uv: _ } =
            network;
        has_drag |= *drag > 0.0;
        for list in elements {
            let kind = list.kind.name();
            found.push((format!("{kind} of {name}"), Removal::Elements(place, list.kind)));
            if list.law.damping > 0.0 {
                found.push((
                    format!("damping of {kind} of {name}"),
                    Removal::ElementDamping(place, list.kind),
                ));
            }
        }
    }
    if has_drag {
        found.push(("drag".to_owned(), Removal::Drag));
        if wind.iter().any(|c| *c != 0.0) {
            found.push(("wind".to_owned(), Removal::Wind));
        }
    }
    for (place, collider) in colliders.iter().enumerate() {
        let Collider {
            name,
            shape: _,
            velocity: _,
            friction,
            restitution,
            margin: _,
            contact: _,
            recovery: _,
            on_start_inside: _,
        } = collider;
        found.push((format!("collider {name}"), Removal::Collider(place)));
        if *friction > 0.0 {
            found.push((format!("friction of {name}"), Removal::Friction(place)));
        }
        if *restitution > 0.0 {
            found.push((format!("restitution of {name}"), Removal::Restitution(place)));
        }
    }
    if precision == Precision::F64 {
        found.push(("f64: half of its digits".to_owned(), Removal::Digits));
    }
    found
}

/// A setup without some of its terms: removed, and not set to 0 where that costs what it cost before.
#[must_use]
pub fn without(setup: &WorldSetup, removals: &[Removal]) -> WorldSetup {
    let mut left = setup.clone();
    // Places are those of the whole scene.
    let is_kept = |removal: Removal| !removals.contains(&removal);
    for removal in removals {
        let bodies = left.bodies.iter_mut();
        match *removal {
            Removal::Damping(kind) => {
                let springs = bodies.flat_map(|body| &mut body.network.springs);
                springs.filter(|spring| spring.kind == kind).for_each(|spring| spring.law.damping = 0.0);
            }
            Removal::ElementDamping(body, kind) => {
                let elements = left.bodies[body].network.elements.iter_mut();
                elements.filter(|list| list.kind == kind).for_each(|list| list.law.damping = 0.0);
            }
            Removal::Drag => bodies.for_each(|body| body.network.drag = 0.0),
            Removal::Wind => left.wind = [0.0; 3],
            Removal::Friction(place) => left.colliders[place].friction = 0.0,
            Removal::Restitution(place) => left.colliders[place].restitution = 0.0,
            Removal::Springs(kind) => {
                bodies.for_each(|body| body.network.springs.retain(|spring| spring.kind != kind));
            }
            Removal::Elements(..) | Removal::Collider(_) | Removal::Digits => {}
        }
    }
    for (place, body) in left.bodies.iter_mut().enumerate() {
        body.network.elements.retain(|list| is_kept(Removal::Elements(place, list.kind)));
    }
    let mut place = 0;
    left.colliders.retain(|_| {
        place += 1;
        is_kept(Removal::Collider(place - 1))
    });
    left
}

/// A run without some terms.
fn run_without(case: &Case, setting: &Setting, times: &Times, removals: &[Removal], phase: &Phase) -> Run {
    let mut left = case.clone();
    left.setup = without(&case.setup, removals);
    let is_halved = removals.contains(&Removal::Digits);
    let precision = if is_halved { Precision::F32 } else { setting.precision };
    run(&left, &Setting { precision, ..*setting }, times, phase)
}

/// How far (m) a run is from another that reached the end; none where it did not.
fn change(case: &Case, whole: &Run, left: &Run) -> Option<f64> {
    (left.end == End::Reached).then(|| {
        let pairs = whole.states.iter().zip(&left.states);
        pairs.map(|(whole, left)| case.rms(whole, left)).fold(0.0, f64::max)
    })
}

/// The terms of a case that is run by a setting, whose error (m) leaves the rest of a tolerance (m); what is not run when a phase
/// is over has no change, and is needed.
pub(super) fn terms(
    case: &Case,
    setting: &Setting,
    times: &Times,
    [error, tolerance]: [f64; 2],
    phase: &Phase,
    tell: &dyn Fn(&str),
) -> Vec<Term> {
    let whole = run(case, setting, times, phase);
    if whole.end != End::Reached {
        return Vec::new();
    }
    let seconds = |run: &Run| median_seconds(&run.seconds).unwrap_or(f64::INFINITY);
    let counts = |run: &Run| (run.work.force_evaluations + run.work.matrix_products) as f64;
    let allowed = tolerance - error;
    let mut terms = Vec::new();
    for (name, removal) in removals(&case.setup, setting.precision) {
        if phase.is_over() {
            break;
        }
        tell(&format!("without {name}"));
        let left = run_without(case, setting, times, &[removal], phase);
        let change = change(case, &whole, &left);
        terms.push(Term {
            name,
            removal,
            change,
            saved_counts: 1.0 - counts(&left) / counts(&whole),
            saving: 1.0 - seconds(&left) / seconds(&whole),
            is_needed: change.is_none_or(|change| change >= allowed),
            is_left_out: false,
        });
    }
    let together = together(case, setting, (times, &whole), &terms, allowed, phase);
    for term in &mut terms {
        term.is_left_out = together.contains(&term.removal);
    }
    terms
}

/// Terms that move the answer by less than what is allowed (m) when all of them are removed: those that move it least for what
/// they save, as many as are.
fn together(
    case: &Case,
    setting: &Setting,
    (times, whole): (&Times, &Run),
    terms: &[Term],
    allowed: f64,
    phase: &Phase,
) -> Vec<Removal> {
    let mut small: Vec<&Term> = terms.iter().filter(|term| !term.is_needed).collect();
    let price = |term: &Term| term.change.unwrap_or(f64::INFINITY) / term.saving.max(LEAST_SAVING);
    small.sort_by(|a, b| price(a).total_cmp(&price(b)));
    let mut removals: Vec<Removal> = small.iter().map(|term| term.removal).collect();
    while !removals.is_empty() {
        let left = run_without(case, setting, times, &removals, phase);
        if change(case, whole, &left).is_some_and(|change| change < allowed) {
            break;
        }
        removals.pop();
        if phase.is_over() {
            removals.clear();
        }
    }
    removals
}
