//! Every crate that is linked may be: its licence is one that `.deny.toml` allows, and it comes from the registry.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::{assert_none, tree};

/// The licences between `allow = [` and `]`.
fn allowed(settings: &str) -> BTreeSet<String> {
    let list = settings.split("\nallow = [").nth(1).and_then(|rest| rest.split("\n]").next());
    let lines = list.unwrap_or_default().lines();
    lines.filter_map(|line| Some(line.split('"').nth(1)?.to_owned())).collect()
}

/// Whether `expression` (SPDX; a `/` of old manifests is an OR) can be met with the allowed licences.
fn is_met(expression: &str, allowed: &BTreeSet<String>) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut rest = words.as_slice();
    let met = either(&mut rest, allowed);
    met && rest.is_empty()
}

fn either(rest: &mut &[&str], allowed: &BTreeSet<String>) -> bool {
    let mut met = both(rest, allowed);
    while let ["OR", after @ ..] = *rest {
        *rest = after;
        met |= both(rest, allowed);
    }
    met
}

fn both(rest: &mut &[&str], allowed: &BTreeSet<String>) -> bool {
    let mut met = one(rest, allowed);
    while let ["AND", after @ ..] = *rest {
        *rest = after;
        met &= one(rest, allowed);
    }
    met
}

fn one(rest: &mut &[&str], allowed: &BTreeSet<String>) -> bool {
    match *rest {
        ["(", after @ ..] => {
            *rest = after;
            let met = either(rest, allowed);
            *rest = rest.strip_prefix(&[")"]).unwrap_or_default();
            met
        }
        [name, "WITH", exception, after @ ..] => {
            *rest = after;
            allowed.contains(&format!("{name} WITH {exception}"))
        }
        [name, after @ ..] => {
            *rest = after;
            allowed.contains(*name)
        }
        [] => false,
    }
}

/// Complaints about the packages that cargo resolves.
fn against_packages(metadata: &Value, allowed: &BTreeSet<String>) -> Vec<String> {
    let mut complaints = Vec::new();
    for package in metadata["packages"].as_array().into_iter().flatten() {
        let name = package["name"].as_str().unwrap_or_default();
        let licence = package["license"].as_str().unwrap_or_default();
        if !is_met(licence, allowed) {
            complaints.push(format!("{name}: its licence '{licence}' is not one that .deny.toml allows"));
        }
        if package["source"].as_str().is_some_and(|source| !source.starts_with("registry+")) {
            complaints.push(format!("{name}: comes from {}, not from the registry", package["source"]));
        }
    }
    complaints
}

#[test]
fn every_crate_has_a_licence_that_is_allowed_and_comes_from_the_registry() {
    // Crates of other systems need not have been downloaded.
    let version = tree::run(env!("CARGO"), &["-vV"]);
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).expect("cargo tells its system");
    let arguments = ["metadata", "--offline", "--format-version", "1", "--filter-platform", host];
    let text = tree::run(env!("CARGO"), &arguments);
    let metadata: Value = serde_json::from_str(&text).expect("cargo prints JSON");
    assert!(metadata["packages"].as_array().is_some_and(|packages| packages.len() > 100));
    assert_none(&against_packages(&metadata, &allowed(&tree::text(".deny.toml"))));
}

#[test]
fn the_rules_find_what_they_are_for() {
    let allowed =
        allowed("[licenses]\nallow = [\n    \"MIT\",\n    \"Apache-2.0 WITH LLVM-exception\", # x\n]\n");
    for met in ["MIT", "GPL-3.0 OR MIT", "MIT/Apache-2.0", "(X OR MIT) AND Apache-2.0 WITH LLVM-exception"] {
        assert!(is_met(met, &allowed), "{met}");
    }
    for unmet in ["", "Apache-2.0", "MIT AND GPL-3.0", "(MIT OR X) AND Y", "MIT X"] {
        assert!(!is_met(unmet, &allowed), "{unmet}");
    }
    let metadata = serde_json::json!({ "packages": [
        { "name": "a", "license": "GPL-3.0", "source": "registry+x" },
        { "name": "b", "license": "MIT", "source": "git+x" },
        { "name": "c", "license": "MIT", "source": null },
    ]});
    assert_eq!(against_packages(&metadata, &allowed).len(), 2);
}
