//! Scenes in which methods fail, over every method that applies, in the settings that a scene has that says nothing of them:
//! the tables of docs/stability.md.

mod scene;
mod markdown;
mod steps;
mod states;
mod motions;
mod snow;
mod systems;
mod refusals;

use std::{env, fs, path::PathBuf};

use markdown::table;
use nappe_sim::cloth::{Hessian, Integrator, Minimizer, NewtonSettings};
use nappe_tests::{Method, threads::pool};
use rayon::prelude::*;

use crate::verdict::Verdict;

fn explicit() -> Vec<Method> {
    let all = Integrator::ALL.into_iter().filter(|integrator| !integrator.is_implicit());
    all.map(|integrator| Method::new(integrator, Hessian::Absolute)).collect()
}

fn implicit() -> Vec<Method> {
    let ways = [
        Minimizer::OneStep,
        Minimizer::Newton(NewtonSettings::default()),
        Minimizer::VertexBlockDescent { sweeps: Minimizer::DEFAULT_SWEEPS },
    ];
    let all = Integrator::ALL.into_iter().filter(|integrator| integrator.is_implicit());
    let of = |integrator| Method::new(integrator, Hessian::Absolute);
    all.flat_map(|integrator| ways.map(|minimizer| Method { minimizer, ..of(integrator) })).collect()
}

/// A row: what it is about, and what becomes of a method in it.
struct Row<'a> {
    what: String,
    run: Box<dyn Fn(Method) -> Verdict + Sync + 'a>,
}

/// Rows over methods, all cells side by side; what was lost without a word is gathered.
fn over(methods: &[Method], rows: &[Row<'_>], lost: &mut Vec<String>) -> String {
    let head: Vec<_> = methods
        .iter()
        .map(|method| {
            let way = method.minimizer.kind().name();
            let name = method.integrator.name();
            if method.integrator.is_implicit() { format!("`{name}`, `{way}`") } else { format!("`{name}`") }
        })
        .collect();
    let cells: Vec<(usize, usize)> =
        (0..rows.len()).flat_map(|row| (0..methods.len()).map(move |column| (row, column))).collect();
    let verdicts: Vec<Verdict> =
        cells.par_iter().map(|&(row, column)| (rows[row].run)(methods[column])).collect();
    let lines: Vec<Vec<String>> = rows
        .iter()
        .zip(verdicts.chunks(methods.len()))
        .map(|(Row { what, .. }, verdicts)| {
            for (name, verdict) in head.iter().zip(verdicts) {
                if matches!(verdict, Verdict::Lost(_)) {
                    lost.push(format!("{what} by {name}: {verdict}"));
                }
            }
            std::iter::once(what.clone()).chain(verdicts.iter().map(Verdict::to_string)).collect()
        })
        .collect();
    let head: Vec<_> = std::iter::once("scene".to_owned()).chain(head).collect();
    table(&head, &lines)
}

/// The page, and what was lost without a word.
fn page() -> (String, Vec<String>) {
    let scenes = steps::SCENES.iter().chain(&states::SCENES).chain(&motions::SCENES);
    let rows: Vec<_> = scenes
        .map(|scene| {
            let what = format!("{}. {}", scene.number, scene.what);
            Row { what, run: Box::new(scene.run) }
        })
        .collect();
    let squashed: Vec<_> = crate::squash::NUMBERS
        .iter()
        .enumerate()
        .map(|(place, number)| {
            let what = format!("dt sqrt(k/m) = {number}");
            Row { what, run: Box::new(move |method| crate::squash::verdict(method, place)) }
        })
        .collect();

    let mut lost = Vec::new();
    let explicit = over(&explicit(), &rows, &mut lost);
    let squash = over(&implicit(), &squashed, &mut lost);
    let implicit = over(&implicit(), &rows, &mut lost);
    let snow = snow::rows(&mut lost);
    let (systems, refusals) = (systems::table(&mut lost), refusals::table());
    let text = include_str!("page.txt")
        .replace("{explicit}", &explicit)
        .replace("{implicit}", &implicit)
        .replace("{squash}", &squash)
        .replace("{snow}", &snow)
        .replace("{systems}", &systems)
        .replace("{refusals}", &refusals);
    (text, lost)
}

#[test]
fn the_page_of_stability_is_what_methods_do() {
    let (text, lost) = pool(0).install(page);
    assert!(lost.is_empty(), "lost without a word:\n{}", lost.join("\n"));
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/stability.md");
    if env::var_os("NAPPE_BLESS").is_some_and(|value| value == "1") {
        fs::write(&file, &text).expect("docs/stability.md can be written");
    }
    let written = fs::read_to_string(&file).expect("docs/stability.md is there");
    for (found, written) in text.lines().zip(written.lines()) {
        assert_eq!(found, written, "docs/stability.md (cargo xtask bless pages writes it)");
    }
    assert_eq!(text.lines().count(), written.lines().count(), "docs/stability.md has other rows");
}
