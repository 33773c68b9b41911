//! Reading order: a module uses only modules that its crate's `lib.rs` declares above it.

use proc_macro2::TokenTree;

use crate::{
    assert_none, tokens,
    tree::{self, Source},
};

/// Crates whose order is held.
const CRATES: [&str; 1] = ["server/sim/src"];

/// The modules that a `lib.rs` declares, in order.
fn declared(lib: &Source) -> Vec<String> {
    let tokens: Vec<_> = tokens::parse(lib).into_iter().collect();
    let declaration = |three: &[TokenTree]| match three {
        [TokenTree::Ident(keyword), TokenTree::Ident(name), TokenTree::Punct(end)]
            if keyword == "mod" && end.as_char() == ';' =>
        {
            Some(name.to_string())
        }
        _ => None,
    };
    tokens.windows(3).filter_map(declaration).collect()
}

/// The names that a file's path has below `src`: `cloth/mod.rs` gives `cloth`.
fn module_path(path: &str) -> Vec<&str> {
    let mut parts: Vec<_> = path.trim_end_matches(".rs").split('/').collect();
    if parts.last() == Some(&"mod") {
        parts.pop();
    }
    parts
}

/// The top-level module that `path`, written in a module `depth` deep, names in its own crate.
fn top_level(path: &str, depth: usize) -> Option<&str> {
    let mut parts = path.split("::");
    let first = parts.next()?;
    if first == "crate" {
        return parts.next();
    }
    let ups = path.split("::").take_while(|part| *part == "super").count();
    (ups >= depth).then(|| path.split("::").nth(ups)).flatten()
}

/// Complaints about a file at `path` below `src`.
fn against_order(modules: &[String], path: &str, source: &Source) -> Vec<String> {
    let own_path = module_path(path);
    let place = |name: &str| modules.iter().position(|module| module == name);
    let Some(own) = own_path.first().and_then(|name| place(name)) else { return Vec::new() };
    let mut complaints: Vec<_> = tokens::paths(tokens::parse(source))
        .iter()
        .filter_map(|used| top_level(used, own_path.len()))
        .filter(|used| place(used).is_some_and(|used| used > own))
        .map(|used| format!("{}: {} uses {used}, which lib.rs declares below it", source.path, modules[own]))
        .collect();
    complaints.dedup();
    complaints
}

#[test]
fn a_module_uses_only_modules_declared_above_it() {
    for folder in CRATES {
        let lib = Source::example("lib.rs", &tree::text(&format!("{folder}/lib.rs")));
        let modules = declared(&lib);
        assert!(modules.len() > 3, "{folder}/lib.rs declares {modules:?}");
        let prefix = format!("{folder}/");
        for source in tree::rust_sources() {
            if let Some(path) = source.path.clone().strip_prefix(&prefix) {
                assert_none(&against_order(&modules, path, &source));
            }
        }
    }
}

#[test]
fn the_rule_finds_what_it_is_for() {
    let lib = Source::example("lib.rs", "//! x\npub mod math;\nmod mesh;\n/// c\npub mod cloth;\n");
    let modules = declared(&lib);
    assert_eq!(modules, ["math", "mesh", "cloth"]);
    let upwards = [
        ("mesh.rs", "use crate::cloth::Model;"),
        ("mesh.rs", "use crate::{math::Vec3, cloth};"),
        ("math/real.rs", "fn f() { super::super::mesh::g() }"),
    ];
    for (path, text) in upwards {
        assert_eq!(against_order(&modules, path, &Source::example(path, text)).len(), 1, "{text}");
    }
    let downwards = [
        ("cloth/forces/mod.rs", "use crate::math::Vec3; use super::super::cloth::x; use super::mesh;"),
        ("cloth/mod.rs", "mod mesh_of; use crate::mesh::TriangleMesh;"),
    ];
    for (path, text) in downwards {
        assert_none(&against_order(&modules, path, &Source::example(path, text)));
    }
}
