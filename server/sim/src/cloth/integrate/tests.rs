//! Newton's method iterate by iterate.

use super::{
    mix::Mix,
    newton::{Iterate, Search, Tried},
    solver::Solver,
    update::Step,
    vectors::Vectors,
};
use crate::{
    cloth::{
        ClothSettings, Hessian, Minimizer, Model, Network, NewtonSettings, SpringLaw, SpringRules, State,
        contact::Contact,
        evaluate::{Common, Evaluated, Evaluation, PartSums, Total},
        settings::Purpose,
    },
    collide::Kept,
    interrupt::Interrupt,
    linalg::Outcome,
    mesh::TriangleMesh,
    parallel::hash_numbers,
    report::NoStopwatch,
    surroundings::Surroundings,
};

/// A sheet that is pressed together by a fifth and crumpled, at rest, two corners held.
fn crumpled(stiffness: f64, damping: f64) -> Network {
    let mesh = TriangleMesh::grid(6, 6, 0.1);
    let law = |share: f64| SpringLaw { stiffness: stiffness * share, damping };
    let rules = SpringRules { stretch: law(1.0), shear: Some(law(0.5)), bend: Some(law(0.1)) };
    let mut network = Network::from_lattice(&mesh, [6, 6], &rules, 0.01);
    network.pins = vec![0, 5];
    for (i, x) in network.x.iter_mut().flatten().enumerate() {
        let drawn = (hash_numbers(i as u64, [0.0]) >> 11) as f64 / (1_u64 << 53) as f64;
        *x = 0.8 * *x + 0.06 * (drawn - 0.5);
    }
    network
}

/// Looks at the minimisation of a step of 0.01 s of the crumpled sheet.
fn of_crumpled(
    [number, damping]: [f64; 2],
    hessian: Hessian,
    look: impl FnOnce(&mut Search<'_, '_, f64>, Iterate),
) {
    let dt = 0.01;
    let stiffness = 0.01 * f64::powi(number / dt, 2);
    let minimizer = Minimizer::Newton(NewtonSettings::default());
    let settings = ClothSettings { minimizer, hessian, ..ClothSettings::default() };
    let network = crumpled(stiffness, damping);
    let (model, parameters, _) = Model::<f64>::new(&network, &settings).expect("a good network");
    let state = State { x: model.arrange(&network.x), v: model.arrange(&network.v), ..State::default() };
    let interrupt = Interrupt::default();
    let (gravity, wind) = ([0.0; 3], [0.0; 3]);
    let interrupt = &interrupt;
    let around = Surroundings { dt, gravity, wind, colliders: &[], time: 0.0, steps: 1.0, interrupt };
    let mut evaluated = Evaluated::default();
    evaluated.size_for(&model, Purpose::Iterate(settings.solver.preconditioner));
    evaluated.numbers.refresh(&model, &parameters, &settings, &around, (around.whole(), 0.0));
    let mut vectors = Vectors::default();
    vectors.size_for(&model, &settings);
    let mut solver = Solver::default();
    solver.size_for(&model);
    let mut next = State::default();
    next.succeed(&state);

    let mut step = Step {
        model: &model,
        state: &state,
        start: &Total::default(),
        next: &mut next,
        evaluated: &mut evaluated,
        solver: &mut solver,
        vectors: &mut vectors,
        contact: &mut Contact::default(),
        contacts: &mut Kept::default(),
        common: &mut Common::default(),
        of_parts: &mut PartSums::default(),
        watch: &mut NoStopwatch,
    };
    step.predict();
    let mut search =
        Search { step: &mut step, settings: &settings, interrupt, report: None, mix: Mix::EXACT, taken: 0.0 };
    let first = search.evaluate(Tried::Next);
    look(&mut search, first);
}

#[test]
fn what_is_minimised_falls_from_iterate_to_iterate_also_of_damped_cloth() {
    for hessian in [Hessian::Full, Hessian::Absolute] {
        for number in [2.0, 10.0, 200.0] {
            for damping in [0.0, 1e-9, 1e-3, 1.0] {
                of_crumpled([number, damping], hessian, |search, mut now| {
                    let (mut iterates, mut rises, mut is_done) = (0, 0, false);
                    while iterates < 50 && !is_done {
                        search.solve();
                        let new = search.search(&now).expect("a change that is downhill");
                        is_done = new.is_none();
                        if let Some(new) = new {
                            iterates += 1;
                            rises += u32::from(new.value_on_the_way() > now.value() + search.slack(&now));
                            now = new;
                        }
                    }
                    let case = format!("{}, {number}, {damping}", hessian.name());
                    assert!(rises == 0, "{case}: {rises} of {iterates} rose");
                    // Much damping lags behind; a little must not keep it from coming as far as rounding lets it.
                    assert!(is_done || damping == 1.0, "{case}: not done after {iterates}");
                });
            }
        }
    }
}

#[test]
fn a_solve_that_meets_negative_curvature_is_made_again_with_more_of_the_absolute_tangent() {
    for number in [2.0, 10.0, 200.0] {
        of_crumpled([number, 0.0], Hessian::Absolute, |search, mut now| {
            // Springs are compressed at the start, by a fifth and more.
            let tangent = search.step.evaluated.evaluation.tangent.clone();
            let inverse = search.step.evaluated.evaluation.inverse.clone();
            let report = search.solve();
            let first = search.mix;
            assert!(first > Mix::EXACT, "{number}: {report:?}");
            assert!(!matches!(report.outcome, Outcome::NegativeCurvature { .. }), "{number}: {report:?}");
            assert_eq!(u64::from(report.products), search.step.solver.products, "what was given up counts");
            let Evaluation { tangent: mixed, inverse: same, .. } = &search.step.evaluated.evaluation;
            assert!(*same == inverse, "the absolute tangent preconditions");
            // As it was evaluated, where all of it is absolute.
            assert_eq!(*mixed == tangent, first == Mix::ABSOLUTE);

            while let Some(new) = search.search(&now).expect("a change that is downhill") {
                now = new;
                search.solve();
            }
            assert!(search.mix == Mix::EXACT, "{number}: a minimum has a positive tangent, {:?}", search.mix);
        });
    }
}

#[test]
fn springs_are_frozen_as_an_evaluation_freezes_them() {
    of_crumpled([10.0, 1e-3], Hessian::Absolute, |search, _| {
        let tangent = search.step.evaluated.evaluation.tangent.clone();
        for (mix, is_same) in [(Mix::EXACT, false), (Mix::ABSOLUTE, true)] {
            let Step { model, next, evaluated, .. } = &mut *search.step;
            let Evaluated { evaluation, numbers, scratches, .. } = &mut **evaluated;
            evaluation.freeze_again(model, numbers, &next.x, mix.mirror(), scratches);
            assert_eq!(evaluation.tangent == tangent, is_same, "{mix:?}");
        }
    });
}
