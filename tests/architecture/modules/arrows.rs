//! Arrows between the modules of a crate, from the one that names to the one where the name is
//! written; those that point upwards, and the circles that they close.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    files::Crate,
    names::{Meaning, meaning},
};

/// From a module, to a module in another file.
pub(super) type Arrow = (usize, usize);

/// Every arrow of a crate, once for each pair of modules.
pub(super) fn arrows(krate: &Crate) -> BTreeSet<Arrow> {
    let mut found = BTreeSet::new();
    for (from, module) in krate.modules.iter().enumerate() {
        // What a module passes on, it need not use itself.
        let used =
            module.imports.iter().filter(|import| !import.passed_on || module.words.contains(&import.name));
        let imported = used.filter_map(|import| match meaning(krate, from, &import.path)? {
            Meaning::Item(to) => Some(to),
            // The names that stand behind it in the code show where its items are.
            Meaning::Module(_) => None,
        });
        let all = module.globs.iter().filter_map(|path| meaning(krate, from, path));
        let named = module.paths.iter().filter_map(|path| meaning(krate, from, path));
        let named = all.chain(named).map(|(Meaning::Module(to) | Meaning::Item(to))| to);
        let other_file = |to: &usize| krate.modules[*to].file != module.file;
        found.extend(imported.chain(named).filter(other_file).map(|to| (from, to)));
    }
    found
}

/// Modules from the root to this one.
fn line(krate: &Crate, module: usize) -> Vec<usize> {
    let mut line = vec![module];
    let mut at = module;
    while at != 0 {
        at = krate.modules[at].parent;
        line.push(at);
    }
    line.reverse();
    line
}

/// The module that declares both ends of an arrow, or what holds them, and its two children that
/// do; nothing where an end holds the other.
fn fork(krate: &Crate, (from, to): Arrow) -> Option<(usize, usize, usize)> {
    let (from, to) = (line(krate, from), line(krate, to));
    let at = from.iter().zip(&to).position(|(a, b)| a != b)?;
    Some((from[at - 1], from[at], to[at]))
}

/// Complaints about arrows that point to what is declared further down.
pub(super) fn against_order(krate: &Crate) -> Vec<String> {
    let mut complaints = BTreeSet::new();
    for arrow in arrows(krate) {
        let Some((above, own, used)) = fork(krate, arrow) else { continue };
        let place = |child| krate.modules[above].children.iter().position(|c| *c == child);
        if place(used) > place(own) {
            let [file, above] = [arrow.0, above].map(|module| krate.modules[module].file.as_str());
            let used = &krate.modules[used].name;
            complaints.insert(format!("{file} uses {used}, which {above} declares further down"));
        }
    }
    complaints.into_iter().collect()
}

/// Arrows between files.
pub(super) fn between_files(krate: &Crate) -> BTreeSet<(&str, &str)> {
    let file = |module: usize| krate.modules[module].file.as_str();
    arrows(krate).into_iter().map(|(from, to)| (file(from), file(to))).collect()
}

/// Groups of files each of which leads to every other of its group.
pub(super) fn circles<'a>(arrows: &BTreeSet<(&'a str, &'a str)>) -> Vec<BTreeSet<&'a str>> {
    let mut next: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (from, to) in arrows {
        next.entry(from).or_default().push(to);
    }
    let reached = |start: &'a str| {
        let mut found = BTreeSet::new();
        let mut open = vec![start];
        while let Some(file) = open.pop() {
            let unseen = next.get(file).into_iter().flatten().filter(|to| found.insert(**to));
            open.extend(unseen.copied().collect::<Vec<&str>>());
        }
        found
    };
    let reached: BTreeMap<&str, BTreeSet<&str>> = next.keys().map(|file| (*file, reached(file))).collect();
    let leads = |from: &str, to: &str| reached.get(from).is_some_and(|found| found.contains(to));
    let mut groups = BTreeSet::new();
    for file in reached.keys().filter(|file| leads(file, file)) {
        groups.insert(reached[file].iter().copied().filter(|other| leads(other, file)).collect());
    }
    groups.into_iter().collect()
}

/// Complaints about circles, a line each; the files belong to `whole`.
pub(super) fn circle_complaints(whole: &str, arrows: &BTreeSet<(&str, &str)>) -> Vec<String> {
    let told = |circle: &BTreeSet<&str>| {
        let within: Vec<_> = arrows
            .iter()
            .filter(|(from, to)| circle.contains(from) && circle.contains(to))
            .map(|(from, to)| format!("{from} -> {to}"))
            .collect();
        format!("{whole}: {} files use each other in a circle: {}", circle.len(), within.join(", "))
    };
    circles(arrows).iter().map(told).collect()
}

/// Complaints about circles of a crate.
pub(super) fn against_circles(krate: &Crate) -> Vec<String> {
    circle_complaints(&krate.root, &between_files(krate))
}
