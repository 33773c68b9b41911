//! Every crate that is linked may be: its licence is one that `.deny.toml` allows, it comes from the registry, and no other
//! version of it is linked beside it unless the file says so.

use std::collections::{BTreeMap, BTreeSet};

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

/// The crates of a list of `.deny.toml`, such as `skip`: `name` or `name@version`.
fn listed(settings: &str, list: &str) -> Vec<String> {
    let inside = settings.split(&format!("\n{list} = [")).nth(1).and_then(|rest| rest.split("\n]").next());
    let lines = inside.unwrap_or_default().lines().map(str::trim).filter(|line| line.starts_with('{'));
    lines.filter_map(|line| Some(line.split("crate = \"").nth(1)?.split('"').next()?.to_owned())).collect()
}

/// Names and versions of the crates that the workspace reaches without those of `trees`.
fn reached(metadata: &Value, trees: &[String]) -> BTreeMap<String, BTreeSet<String>> {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let packages: BTreeMap<String, (String, String)> = list(&metadata["packages"])
        .iter()
        .map(|package| (text(&package["id"]), (text(&package["name"]), text(&package["version"]))))
        .collect();
    let needs: BTreeMap<String, Vec<String>> = list(&metadata["resolve"]["nodes"])
        .iter()
        .map(|node| (text(&node["id"]), list(&node["dependencies"]).iter().map(text).collect()))
        .collect();

    let (mut waiting, mut seen): (Vec<String>, BTreeSet<String>) =
        (list(&metadata["workspace_members"]).iter().map(text).collect(), BTreeSet::new());
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    while let Some(id) = waiting.pop() {
        let Some((name, version)) = packages.get(&id).filter(|(name, _)| !trees.contains(name)) else {
            continue;
        };
        if seen.insert(id.clone()) {
            found.entry(name.clone()).or_default().insert(version.clone());
            waiting.extend(needs.get(&id).into_iter().flatten().cloned());
        }
    }
    found
}

/// Complaints about crates that are there in several versions, and about exceptions that nothing needs.
fn against_duplicates(metadata: &Value, settings: &str) -> Vec<String> {
    let skipped = listed(settings, "skip");
    let found = reached(metadata, &listed(settings, "skip-tree"));
    let is_skipped = |name: &str, version: &str| {
        let fits = |entry: &String| {
            let (own, prefix) = entry.split_once('@').unwrap_or((entry, ""));
            own == name && version.starts_with(prefix)
        };
        skipped.iter().any(fits)
    };

    let mut complaints = Vec::new();
    for (name, versions) in &found {
        let left = versions.iter().filter(|version| !is_skipped(name, version)).count();
        if left > 1 {
            complaints
                .push(format!("{name}: the versions {versions:?} are linked, and .deny.toml allows one"));
        }
    }
    for entry in &skipped {
        let (name, prefix) = entry.split_once('@').unwrap_or((entry, ""));
        let versions = found.get(name).cloned().unwrap_or_default();
        if versions.len() < 2 || !versions.iter().any(|version| version.starts_with(prefix)) {
            complaints.push(format!("{entry}: .deny.toml skips it, and it is no duplicate"));
        }
    }
    complaints
}

/// What cargo resolves for this system.
fn metadata() -> Value {
    // Crates of other systems need not have been downloaded.
    let version = tree::run(env!("CARGO"), &["-vV"]);
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).expect("cargo tells its system");
    let arguments = ["metadata", "--offline", "--format-version", "1", "--filter-platform", host];
    let text = tree::run(env!("CARGO"), &arguments);
    serde_json::from_str(&text).expect("cargo prints JSON")
}

#[test]
fn no_crate_is_linked_in_two_versions_unless_it_is_listed() {
    assert_none(&against_duplicates(&metadata(), &tree::text(".deny.toml")));
}

#[test]
fn every_crate_has_a_licence_that_is_allowed_and_comes_from_the_registry() {
    let metadata = metadata();
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

    // A needs both versions of B, and the tree T a third.
    let metadata = serde_json::json!({
        "packages": [
            { "id": "a", "name": "a", "version": "1.0.0" }, { "id": "t", "name": "t", "version": "1.0.0" },
            { "id": "b1", "name": "b", "version": "1.2.0" }, { "id": "b2", "name": "b", "version": "2.0.0" },
            { "id": "b3", "name": "b", "version": "3.0.0" },
        ],
        "workspace_members": ["a"],
        "resolve": { "nodes": [
            { "id": "a", "dependencies": ["b1", "b2", "t"] }, { "id": "t", "dependencies": ["b3"] },
        ]},
    });
    let tree = "\nskip-tree = [\n    { crate = \"t\" },\n]\n";
    assert_eq!(against_duplicates(&metadata, tree).len(), 1);
    assert_eq!(
        against_duplicates(&metadata, &format!("\nskip = [\n    {{ crate = \"b@1\" }},\n]{tree}")).len(),
        0
    );
    assert_eq!(against_duplicates(&metadata, "\nskip = [\n    { crate = \"b@1\" },\n]\n").len(), 1);
    assert_eq!(
        against_duplicates(&metadata, &format!("\nskip = [\n    {{ crate = \"a\" }},\n]{tree}")).len(),
        2
    );
}
