//! Reading order: a module uses only modules declared above it, in every `lib.rs`, `main.rs` and `mod.rs`
//! of every crate; and no two files use each other, however far the way round, in Python and TypeScript too.

mod files;
mod names;
mod arrows;
mod lexer;
mod imports;
mod rooms;

use std::collections::{BTreeMap, BTreeSet};

use crate::{assert_none, tree::Source};

use files::Crate;

/// Arrows upward and files in circles.
fn disorder(krate: &Crate) -> (usize, usize) {
    let circles = arrows::circles(&arrows::between_files(krate));
    (arrows::against_order(krate).len(), circles.iter().map(BTreeSet::len).sum())
}

/// The folder of a file, from its crate's root: `snow/grid`.
fn room<'a>(krate: &Crate, file: &'a str) -> &'a str {
    let source = krate.root.rsplit_once('/').map_or("", |(folder, _)| folder);
    let path = file.strip_prefix(source).unwrap_or(file).trim_start_matches('/');
    path.rsplit_once('/').map_or("", |(folder, _)| folder)
}

/// A line for each room with more than one file: files, arrows within it (its own rooms included), circles.
fn counts(krate: &Crate) -> String {
    let all = arrows::between_files(krate);
    let mut rooms: BTreeMap<&str, usize> = BTreeMap::new();
    let mut files: Vec<_> = krate.modules.iter().map(|module| module.file.as_str()).collect();
    files.sort_unstable();
    files.dedup();

    for file in files {
        let mut at = room(krate, file);
        *rooms.entry(at).or_default() += 1;
        while let Some((above, _)) = at.rsplit_once('/') {
            at = above;
            *rooms.entry(at).or_default() += 1;
        }
        if !at.is_empty() {
            *rooms.entry("").or_default() += 1;
        }
    }

    let (upward, in_circles) = disorder(krate);
    let mut text = format!("{}: {upward} upward, {in_circles} files in circles\n", krate.root);
    for (name, count) in rooms.into_iter().filter(|(_, count)| *count > 1) {
        let within = |file: &str| {
            let at = room(krate, file);
            name.is_empty() || at == name || at.strip_prefix(name).is_some_and(|rest| rest.starts_with('/'))
        };

        let own = all.iter().filter(|(from, to)| within(from) && within(to)).copied().collect();
        let sizes: Vec<_> = arrows::circles(&own).iter().map(|circle| circle.len().to_string()).collect();

        let name = if name.is_empty() { "all" } else { name };
        let circles = if sizes.is_empty() { "none".to_owned() } else { sizes.join(", ") };
        let line = format!("  {name:<20} {count:>3} files {:>4} arrows, circles: {circles}\n", own.len());
        text.push_str(&line);
    }

    text
}

/// The files of all crates as their modules are declared: each after the one that declares it.
pub(crate) fn reading_order(sources: &[Source]) -> Vec<String> {
    let modules = files::crates(sources).into_iter().flat_map(|krate| krate.modules);
    modules.map(|module| module.file).collect()
}

#[test]
fn a_module_uses_only_modules_declared_above_it() {
    let crates = files::of_repository();
    assert_none(&crates.iter().flat_map(arrows::against_order).collect::<Vec<_>>());
}

#[test]
#[allow(clippy::print_stdout, reason = "counts that `--nocapture` shows")]
fn no_files_use_each_other_in_a_circle() {
    let crates = files::of_repository();
    for krate in &crates {
        print!("{}", counts(krate));
    }
    assert_none(&crates.iter().flat_map(arrows::against_circles).collect::<Vec<_>>());
}

/// A crate of three rooms, with other text in `file`.
fn example(file: &str, text: &str) -> Crate {
    let mut sources = vec![
        Source::example("a/src/lib.rs", "//! x\npub mod math;\nmod mesh;\n/// c\npub mod cloth;\n"),
        Source::example("a/src/math/mod.rs", "mod real; mod exp; pub use real::Real; pub struct Vec3;"),
        Source::example("a/src/math/real.rs", "pub trait Real {}"),
        Source::example("a/src/math/exp.rs", "use super::Real; pub fn exp() {}"),
        Source::example("a/src/mesh.rs", "use crate::math::Vec3; pub struct Mesh;"),
        Source::example(
            "a/src/cloth/mod.rs",
            "mod forces; pub mod step; pub use crate::mesh::Mesh; pub struct Cloth;",
        ),
        Source::example("a/src/cloth/forces.rs", "use super::super::mesh::Mesh; pub fn add() {}"),
        Source::example("a/src/cloth/step.rs", "use super::forces; fn f() { forces::add() }"),
    ];
    let place = sources.iter().position(|source| source.path == file).expect("a file of the example");
    sources[place].text.push_str(text);
    files::read("a/src/lib.rs", &sources)
}

#[test]
fn the_rules_find_what_they_are_for() {
    let upward = [
        ("a/src/mesh.rs", "use crate::cloth::Cloth;"),
        ("a/src/mesh.rs", "use crate::{math::Real, cloth};\nfn f() { cloth::step::run() }"),
        ("a/src/math/real.rs", "fn f() { super::super::mesh::g() }"),
        ("a/src/math/real.rs", "use super::exp::exp;"),
        ("a/src/cloth/forces.rs", "mod inner { use super::super::step::Step; }"),
        ("a/src/math/mod.rs", "use crate::cloth::*;"),
    ];
    for (file, text) in upward {
        assert_eq!(arrows::against_order(&example(file, text)).len(), 1, "{file}: {text}");
    }
    let downward = [
        ("a/src/cloth/step.rs", "use crate::{math::Vec3, mesh::Mesh}; use super::super::cloth::forces::add;"),
        ("a/src/cloth/mod.rs", "fn f() { step::run() }"),
        ("a/src/mesh.rs", "use std::mesh::cloth; fn cloth() { mesh() }"),
    ];
    for (file, text) in downward {
        assert_none(&arrows::against_order(&example(file, text)));
        assert_none(&arrows::against_circles(&example(file, text)));
    }
    let circles = [
        // A file that its room uses takes what the room defines.
        ("a/src/cloth/mod.rs", "fn f() { step::run() } mod other { use super::super::mesh::Mesh; }", 0),
        ("a/src/mesh.rs", "use crate::cloth::Cloth; use crate::cloth::Mesh;", 0),
        ("a/src/math/real.rs", "use super::exp::exp;", 2),
        ("a/src/math/exp.rs", "use super::Vec3;", 0),
        ("a/src/math/exp.rs", "use crate::mesh::Mesh;", 0),
        ("a/src/math/mod.rs", "fn f() { crate::mesh::g() }", 2),
    ];
    for (file, text, files) in circles {
        assert_eq!(disorder(&example(file, text)).1, files, "{file}: {text}");
    }
}
