//! Newton's method iterate by iterate.

use super::{
    iterate::Start,
    mix::Mix,
    newton::{Search, Tried},
    update::Step,
};
use crate::{
    cloth::{
        ClothSettings, Hessian, Minimizer, Model, Network, NewtonSettings, SpringLaw, SpringRules, State,
        Workspace, settings::Purpose,
    },
    interrupt::Interrupt,
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

#[test]
fn what_is_minimised_falls_from_iterate_to_iterate_also_of_damped_cloth() {
    let dt = 0.01;
    for number in [2.0, 10.0, 200.0] {
        for damping in [0.0, 1e-9, 1e-3, 1.0] {
            let stiffness = 0.01 * f64::powi(number / dt, 2);
            let minimizer = Minimizer::Newton(NewtonSettings::default());
            let settings = ClothSettings { minimizer, hessian: Hessian::Full, ..ClothSettings::default() };
            let network = crumpled(stiffness, damping);
            let (model, parameters, _) = Model::<f64>::new(&network, &settings).expect("a good network");
            let state =
                State { x: model.arrange(&network.x), v: model.arrange(&network.v), ..State::default() };
            let interrupt = Interrupt::default();
            let (gravity, wind) = ([0.0; 3], [0.0; 3]);
            let around = Surroundings { dt, gravity, wind, colliders: &[], time: 0.0, interrupt: &interrupt };
            let mut work = Workspace::new();
            work.size_for(&model, &settings, Purpose::of(&settings));
            work.numbers.refresh(&model, &parameters, &settings, &around, [dt, 0.0]);
            work.begin(&state);
            work.make_room(&state);

            let Workspace { next, inertias, numbers, .. } = &mut work;
            Start::new(&model, &state, numbers).predict([&mut next.x, &mut next.v], inertias);
            let mut step = Step { model: &model, state: &state, work: &mut work, watch: &mut NoStopwatch };
            let mut search = Search {
                step: &mut step,
                settings: &settings,
                interrupt: &interrupt,
                report: None,
                mix: Mix::EXACT,
            };
            let mut now = search.evaluate(Tried::Next);
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
            assert!(rises == 0, "{number}, {damping}: {rises} of {iterates} rose");
            // Much damping lags behind; a little must not keep it from coming as far as rounding lets it.
            assert!(is_done || damping == 1.0, "{number}, {damping}: not done after {iterates}");
        }
    }
}
