//! The page of stability: the gallery, linear systems, and what is judged before the first step.

mod markdown;
mod systems;
mod refusals;

use std::{env, fs, path::PathBuf};

use markdown::table;
use nappe_study::{
    Budget, Verdict,
    gallery::{Exhibit, Family, Finding, Table, gallery},
};
use nappe_tests::threads::pool;

/// A table of the gallery; what was lost without a word is gathered.
fn markdown_of(tables: &[Table], family: Family, lost: &mut Vec<String>) -> String {
    let table_of_family = tables.iter().find(|table| table.family == family).expect("a table per family");
    let head: Vec<_> = table_of_family.methods.iter().map(|method| format!("`{method}`")).collect();
    let line = |exhibit: &Exhibit| {
        let what = format!("{}. {}", exhibit.number, exhibit.what);
        for (name, found) in head.iter().zip(&exhibit.findings) {
            if found.verdict == Verdict::Lost {
                lost.push(format!("{what} by {name}: {found}"));
            }
        }
        std::iter::once(what).chain(exhibit.findings.iter().map(Finding::to_string)).collect()
    };
    let lines: Vec<Vec<String>> = table_of_family.scenes.iter().map(line).collect();
    let head: Vec<_> = std::iter::once("scene".to_owned()).chain(head).collect();
    table(&head, &lines)
}

/// The page, and what was lost without a word.
fn page() -> (String, Vec<String>) {
    let tables = gallery(&Budget::new(None), &|_| ());
    let mut lost = Vec::new();
    let mut text = include_str!("page.txt").to_owned();
    for (place, family) in [
        ("{explicit}", Family::Explicit),
        ("{implicit}", Family::Implicit),
        ("{squeezed}", Family::Squeezed),
        ("{snow}", Family::Snow),
    ] {
        text = text.replace(place, &markdown_of(&tables, family, &mut lost));
    }
    text = text.replace("{systems}", &systems::table(&mut lost)).replace("{refusals}", &refusals::table());
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
