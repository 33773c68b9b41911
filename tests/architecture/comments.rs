//! Comments earn their place: one of one or two words says nothing that the name beside it does not,
//! unless it gives a unit or a formula.

use crate::{
    assert_none,
    tree::{self, Source},
};

/// Fewest words of a comment without a unit or a formula.
const FEWEST_WORDS: usize = 3;

/// Characters of units, `(m)`, and of formulas.
const OF_FORMULAS: &str = "()=_|^<>+*/²³⁻·0123456789";

/// The text of a line that is a comment of one kind alone; files' headers are held by another rule.
fn comment(line: &str) -> Option<(&str, &str)> {
    let line = line.trim_start();
    ["///", "//"]
        .into_iter()
        .find_map(|mark| Some((mark, line.strip_prefix(mark)?)))
        .filter(|(_, text)| !text.starts_with(['!', '/']))
}

/// Complaints about comments that say too little, a line each.
fn against_few_words(source: &Source) -> Vec<String> {
    let mut complaints = Vec::new();
    let mut block: Option<(usize, &str, String)> = None;
    let lines = source.text.lines().map(comment).chain([None]);
    for (index, line) in lines.enumerate() {
        match (&mut block, line) {
            (Some((_, mark, text)), Some((next, more))) if *mark == next => {
                text.push(' ');
                text.push_str(more);
                continue;
            }
            _ => {}
        }
        if let Some((start, _, text)) = block.take() {
            let says_little = text.split_whitespace().count() < FEWEST_WORDS;
            if says_little && !text.contains(|c| OF_FORMULAS.contains(c)) {
                complaints.push(format!("{}:{}: says too little:{text}", source.path, start + 1));
            }
        }
        block = line.map(|(mark, text)| (index, mark, text.to_owned()));
    }
    complaints
}

#[test]
fn every_comment_says_something() {
    let sources = tree::rust_sources();
    assert_none(&sources.iter().flat_map(against_few_words).collect::<Vec<_>>());
}

#[test]
fn the_rule_finds_what_it_is_for() {
    let of = |text: &str| against_few_words(&Source::example("x.rs", text));
    assert_eq!(of("/// Why.\nwhy: Error,\n"), ["x.rs:1: says too little: Why."]);
    assert_eq!(of("fn f() {\n    // Its\n    // name.\n}\n/// All.\n").len(), 2);
    assert_none(&of(
        "/// Radius (m).\n/// Each of them\n/// once.\n//! A header.\nlet x = 1; // two\n////\n",
    ));
    assert_none(&of("// F_E\n/// 1 / dt\n"));
}
