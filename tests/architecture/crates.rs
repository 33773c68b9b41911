//! Layers: which crate may use which.

use serde_json::Value;

use crate::{assert_none, tokens, tree};

/// Crates of the workspace and those of them that each may name. Tests and tasks do not ship.
const LAYERS: [(&str, &[&str]); 15] = [
    ("nappe-proto", &[]),
    ("nappe-generate", &[]),
    ("nappe-sim", &[]),
    ("nappe-scene", &["nappe-sim"]),
    ("nappe-study", &["nappe-sim"]),
    ("nappe-cluster", &["nappe-sim"]),
    ("nappe-server", &["nappe-proto", "nappe-sim", "nappe-scene", "nappe-cluster"]),
    ("nappe-client", &["nappe-proto"]),
    ("nappe-charts", &["nappe-sim", "nappe-study"]),
    ("nappe-rerun", &["nappe-client"]),
    ("nappe-viewer", &["nappe-client", "nappe-rerun"]),
    (
        "nappe-cli",
        &[
            "nappe-proto",
            "nappe-sim",
            "nappe-scene",
            "nappe-study",
            "nappe-server",
            "nappe-client",
            "nappe-charts",
        ],
    ),
    (
        "nappe-tests",
        &[
            "nappe-proto",
            "nappe-sim",
            "nappe-scene",
            "nappe-study",
            "nappe-cluster",
            "nappe-server",
            "nappe-client",
        ],
    ),
    ("nappe-architecture", &[]),
    ("xtask", &[]),
];

/// All that the numerics may name outside the workspace: of serde the traits, and no format.
const SIM_DEPENDENCIES: [&str; 8] =
    ["bytemuck", "libm", "nalgebra", "rayon", "robust", "serde", "thiserror", "xxhash-rust"];

/// What must not be linked below the service, directly or not.
const ABOVE_SCENE: [&str; 5] = ["tokio", "tonic", "tracing", "prost", "clap"];

/// What must not be linked by the numerics, directly or not.
const ABOVE_SIM: [&str; 7] = ["tokio", "tonic", "tracing", "prost", "clap", "serde_json", "postcard"];

/// What is linked by the program of ranks alone: servers and commands run where there is no MPI.
const OF_RANKS: [&str; 2] = ["mpi", "mpi-sys"];

/// Programs that must build fast and run anywhere, so that no crate of Rerun may be linked by them.
const WITHOUT_RERUN: [&str; 2] = ["nappe-server", "nappe-cli"];

/// A dependency that ships: from a crate, on a crate.
type Arrow = (String, String);

/// Every dependency of the workspace's crates, tests' own left out.
fn arrows(metadata: &Value) -> Vec<Arrow> {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let name = |value: &Value| value["name"].as_str().unwrap_or_default().to_owned();
    let mut found = Vec::new();
    for package in list(&metadata["packages"]) {
        for dependency in list(&package["dependencies"]) {
            if dependency["kind"] != "dev" {
                found.push((name(&package), name(&dependency)));
            }
        }
    }
    found
}

fn against_layers(arrows: &[Arrow]) -> Vec<String> {
    let ours = |name: &str| LAYERS.iter().find(|(known, _)| *known == name);
    let complain = |(from, to): &Arrow| match ours(from) {
        None => Some(format!("{from}: add it to LAYERS, with the crates that it may use")),
        Some((_, allowed)) if ours(to).is_some() && !allowed.contains(&to.as_str()) => {
            Some(format!("{from} may not depend on {to}"))
        }
        Some(_) => None,
    };
    arrows.iter().filter_map(complain).collect()
}

fn against_sim_dependencies(arrows: &[Arrow]) -> Vec<String> {
    let extra = |(from, to): &&Arrow| from == "nappe-sim" && !SIM_DEPENDENCIES.contains(&to.as_str());
    arrows.iter().filter(extra).map(|(_, to)| format!("nappe-sim may not depend on {to}")).collect()
}

/// Whether a crate is Rerun's: all of its crates have one prefix.
fn belongs_to_rerun(name: &str) -> bool {
    name == "rerun" || name.starts_with("re_")
}

/// The only crate that may name a crate from outside, for those that have one.
fn only_namer(name: &str) -> Option<&'static str> {
    match name {
        "kuva" => Some("nappe-charts"),
        name if belongs_to_rerun(name) => Some("nappe-rerun"),
        _ => None,
    }
}

fn against_second_namers(arrows: &[Arrow]) -> Vec<String> {
    let second = |(from, to): &Arrow| {
        let only = only_namer(to).filter(|only| only != from)?;
        Some(format!("{from} names {to}; {only} alone may"))
    };
    arrows.iter().filter_map(second).collect()
}

/// Complaints about a `cargo tree` listing that links what it must not.
fn against_linking(top: &str, listing: &str, banned: &[&str]) -> Vec<String> {
    let linked = |name: &&&str| listing.lines().any(|line| line.split(' ').next() == Some(**name));
    banned.iter().filter(linked).map(|name| format!("{top} links {name}")).collect()
}

fn workspace_arrows() -> Vec<Arrow> {
    let text = tree::run(env!("CARGO"), &["metadata", "--no-deps", "--offline", "--format-version", "1"]);
    let metadata: Value = serde_json::from_str(&text).expect("cargo prints JSON");
    let arrows = arrows(&metadata);
    assert!(arrows.len() > 20, "the workspace has dependencies");
    arrows
}

#[test]
fn crates_depend_only_on_the_layers_below_them() {
    assert_none(&against_layers(&workspace_arrows()));
}

#[test]
fn the_numerics_depend_on_few_crates() {
    assert_none(&against_sim_dependencies(&workspace_arrows()));
}

#[test]
fn one_crate_alone_names_rerun_and_one_the_plotter() {
    assert_none(&against_second_namers(&workspace_arrows()));
    let outside = |source: &tree::Source| !source.path.starts_with("viewer/rerun/");
    for source in tree::rust_sources().iter().filter(|source| outside(source)) {
        let named = tokens::paths(tokens::parse(source))
            .iter()
            .any(|path| path.split_once("::").is_some_and(|(first, _)| belongs_to_rerun(first)));
        assert!(!named, "{} names a crate of the Rerun SDK", source.path);
    }
}

#[test]
fn nothing_below_the_service_links_what_belongs_to_it_and_no_server_links_mpi() {
    let rules = [
        ("nappe-sim", &ABOVE_SIM[..]),
        ("nappe-scene", &ABOVE_SCENE[..]),
        ("nappe-server", &OF_RANKS[..]),
        ("nappe-cli", &OF_RANKS[..]),
    ];
    for (top, banned) in rules {
        let arguments = ["tree", "--offline", "-p", top, "-e", "normal", "--prefix", "none"];
        let listing = tree::run(env!("CARGO"), &arguments);
        assert!(listing.starts_with(top), "{listing}");
        assert_none(&against_linking(top, &listing, banned));
    }
}

/// Complaints about a `cargo tree` listing that names a crate of Rerun.
fn against_rerun(top: &str, listing: &str) -> Vec<String> {
    let names = listing.lines().filter_map(|line| line.split(' ').next());
    let of_rerun = names.filter(|name| belongs_to_rerun(name) || *name == "nappe-rerun");
    of_rerun.map(|name| format!("{top} links {name}")).collect()
}

#[test]
fn rerun_is_linked_by_the_viewer_alone() {
    for top in WITHOUT_RERUN {
        let listing = tree::run(env!("CARGO"), &["tree", "--offline", "-p", top, "--prefix", "none"]);
        assert!(listing.starts_with(top), "{listing}");
        assert_none(&against_rerun(top, &listing));
    }
    let listing = tree::run(env!("CARGO"), &["tree", "--offline", "-p", "nappe-viewer", "--prefix", "none"]);
    assert!(against_rerun("nappe-viewer", &listing).len() > 10, "the rule knows the crates of Rerun");
}

#[test]
fn the_rules_find_what_they_are_for() {
    let arrow = |from: &str, to: &str| (from.to_owned(), to.to_owned());
    assert_eq!(against_layers(&[arrow("nappe-cli", "nappe-rerun")]).len(), 1);
    let bad = [arrow("nappe-sim", "nappe-scene"), arrow("nappe-sim", "toml"), arrow("nappe-cli", "re_sdk")];
    assert_eq!(
        against_second_namers(&[arrow("nappe-cli", "kuva"), arrow("nappe-charts", "kuva")]),
        ["nappe-cli names kuva; nappe-charts alone may"]
    );
    assert_eq!(against_layers(&bad), ["nappe-sim may not depend on nappe-scene"]);
    assert_eq!(against_layers(&[arrow("nappe-new", "rayon")]).len(), 1);
    assert_eq!(against_sim_dependencies(&bad).len(), 2);
    assert_eq!(against_second_namers(&bad).len(), 1);
    assert_eq!(
        against_linking("nappe-sim", "nappe-sim v0.1.0\nserde_json v1.0.0\n", &ABOVE_SIM),
        ["nappe-sim links serde_json"]
    );
}
