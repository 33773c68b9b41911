//! Rooms: the modules of a folder, each with all that it holds as one. A folder that grows is to stay readable at a glance: few
//! rooms, few arrows between them, and no long way from the one that uses all to the one that uses none.

use std::collections::{BTreeMap, BTreeSet};

use crate::tree;

use super::{
    arrows,
    files::{self, Crate},
    imports,
    names::{Meaning, meaning},
};

/// A folder, and how much it may hold.
struct Bound {
    /// The file that declares its rooms; of a folder without one, the folder with a `/` at its end.
    front: &'static str,
    rooms: usize,
    arrows: usize,
    floors: usize,
}

const BOUNDS: [Bound; 5] = [
    Bound { front: "server/sim/src/cloth/mod.rs", rooms: 12, arrows: 45, floors: 10 },
    Bound { front: "server/sim/src/collide/mod.rs", rooms: 8, arrows: 14, floors: 6 },
    Bound { front: "server/sim/src/world/mod.rs", rooms: 9, arrows: 24, floors: 7 },
    Bound { front: "client/cli/src/main.rs", rooms: 12, arrows: 45, floors: 10 },
    Bound { front: "server/study/src/lib.rs", rooms: 10, arrows: 35, floors: 10 },
];

/// The same of the package for Python, and of the pages.
const OF_PYTHON: Bound =
    Bound { front: "client/python/src/nappe/__init__.py", rooms: 8, arrows: 15, floors: 6 };
const OF_PAGES: Bound = Bound { front: "viewer/web/src/", rooms: 7, arrows: 17, floors: 5 };

/// Folders whose files name the file that defines a thing, and not the file at the front, which passes it on.
const PLAIN_NAMES: [&str; 2] = ["server/sim/src/collide/mod.rs", "server/sim/src/world/mod.rs"];

/// What stands between the rooms of a folder, its front page being one of them.
#[derive(Debug, Default, PartialEq, Eq)]
struct Plan<'a> {
    rooms: BTreeSet<&'a str>,
    arrows: BTreeSet<(&'a str, &'a str)>,
}

impl<'a> Plan<'a> {
    fn of(krate: &'a Crate, front: &str) -> Self {
        let files = krate.modules.iter().map(|module| module.file.as_str());
        Self::between(files, arrows::between_files(krate), front)
    }

    /// The plan of files with arrows between them.
    fn between(
        files: impl Iterator<Item = &'a str>,
        arrows: BTreeSet<(&'a str, &'a str)>,
        front: &str,
    ) -> Self {
        let folder = front.rsplit_once('/').map_or("", |(folder, _)| folder);
        let room = |file: &'a str| -> Option<&'a str> {
            let within = file.strip_prefix(folder)?.strip_prefix('/')?;
            let end = within.find('/').or_else(|| within.find('.'))?;
            Some(if file == front { "" } else { &within[..end] })
        };
        let rooms = files.filter_map(room).collect();
        let between = arrows.into_iter().filter_map(|(from, to)| Some((room(from)?, room(to)?)));
        Self { rooms, arrows: between.filter(|(from, to)| from != to).collect() }
    }

    /// Rooms on the longest way along arrows; as many as there are rooms at most, also where some stand in a circle.
    fn floors(&self) -> usize {
        let mut heights: BTreeMap<&str, usize> = self.rooms.iter().map(|room| (*room, 1)).collect();
        for _ in &self.rooms {
            for (from, to) in &self.arrows {
                let height = heights[to] + 1;
                let own = heights.entry(from).or_default();
                *own = height.max(*own).min(self.rooms.len());
            }
        }
        heights.into_values().max().unwrap_or(0)
    }

    /// Complaints about more than is allowed.
    fn against(&self, bound: &Bound) -> Vec<String> {
        let counts = [
            ("rooms", self.rooms.len(), bound.rooms),
            ("arrows between rooms", self.arrows.len(), bound.arrows),
            ("floors", self.floors(), bound.floors),
        ];
        let told = |(what, count, limit)| format!("{}: {count} {what}, {limit} are allowed", bound.front);
        counts.into_iter().filter(|(_, count, limit)| count > limit).map(told).collect()
    }
}

/// Complaints about files below a front that take from it what it only passes on.
fn against_faces(krate: &Crate, front: &str) -> Vec<String> {
    let folder = front.strip_suffix("mod.rs").unwrap_or(front);
    let face = krate.modules.iter().position(|module| module.file == front).expect("a crate has the front");
    let mut complaints = BTreeSet::new();
    for (from, module) in krate.modules.iter().enumerate() {
        if module.file == front || !module.file.starts_with(folder) {
            continue;
        }
        for path in module.imports.iter().map(|import| &import.path).chain(&module.paths) {
            for (end, separator) in path.match_indices("::") {
                let name = path[end + separator.len()..].split("::").next().unwrap_or_default();
                let is_passed_on = || krate.modules[face].imports.iter().any(|import| import.name == name);
                if meaning(krate, from, &path[..end]) == Some(Meaning::Module(face)) && is_passed_on() {
                    complaints.insert(format!(
                        "{} takes {name} from {front}, which only passes it on",
                        module.file
                    ));
                }
            }
        }
    }
    complaints.into_iter().collect()
}

#[test]
#[allow(clippy::print_stdout, reason = "counts that `--nocapture` shows")]
fn rooms_stay_few_and_so_do_the_arrows_between_them() {
    let crates = files::of_repository();
    for bound in &BOUNDS {
        let holds = |krate: &&Crate| krate.modules.iter().any(|module| module.file == bound.front);
        let krate = crates.iter().find(holds).expect("a crate declares the rooms");
        let plan = Plan::of(krate, bound.front);
        println!("{}: {:?}, {} arrows, {} floors", bound.front, plan.rooms, plan.arrows.len(), plan.floors());
        assert!(plan.rooms.len() > 5, "{plan:?}");
        crate::assert_none(&plan.against(bound));
    }
}

#[test]
#[allow(clippy::print_stdout, reason = "counts that `--nocapture` shows")]
fn rooms_of_other_languages_stay_few() {
    let in_python = |path: &str| path.starts_with(imports::PYTHON) && tree::has_extension(path, "py");
    let in_pages = |path: &str| path.starts_with(OF_PAGES.front) && tree::has_extension(path, "ts");
    let [python, pages] = [tree::sources(in_python), tree::sources(in_pages)];
    let arrows = [imports::of_python(&python), imports::of_typescript(&pages)];
    for ((bound, sources), arrows) in [(OF_PYTHON, &python), (OF_PAGES, &pages)].into_iter().zip(arrows) {
        let plan = Plan::between(sources.iter().map(|source| source.path.as_str()), arrows, bound.front);
        println!("{}: {:?}, {} arrows, {} floors", bound.front, plan.rooms, plan.arrows.len(), plan.floors());
        assert!(plan.rooms.len() > 5, "{plan:?}");
        crate::assert_none(&plan.against(&bound));
    }
}

#[test]
fn files_take_things_from_where_they_are_defined() {
    let crates = files::of_repository();
    for front in PLAIN_NAMES {
        let holds = |krate: &&Crate| krate.modules.iter().any(|module| module.file == front);
        crate::assert_none(&against_faces(crates.iter().find(holds).expect("a crate has the folder"), front));
    }
    let complaints =
        |text: &str| against_faces(&super::example("a/src/cloth/forces.rs", text), "a/src/cloth/mod.rs");
    for text in ["use super::Mesh;", "fn f() { crate::cloth::Mesh::new() }"] {
        assert_eq!(complaints(text).len(), 1, "{text}");
    }
    for text in ["use super::Cloth;", "use crate::mesh::Mesh;", "fn f() { super::step::run() }"] {
        crate::assert_none(&complaints(text));
    }
}

#[test]
fn rooms_arrows_and_floors_are_counted() {
    let krate = super::example("a/src/mesh.rs", "use crate::math::exp::exp;");
    let plan = Plan::of(&krate, "a/src/lib.rs");
    assert_eq!(plan.rooms, BTreeSet::from(["", "cloth", "math", "mesh"]));
    assert_eq!(plan.arrows, BTreeSet::from([("cloth", "mesh"), ("mesh", "math")]));
    assert_eq!(plan.floors(), 3);

    let bound = |rooms, arrows, floors| Bound { front: "a/src/lib.rs", rooms, arrows, floors };
    assert_eq!(plan.against(&bound(4, 2, 3)), Vec::<String>::new());
    for (bound, word) in
        [(bound(3, 2, 3), "4 rooms"), (bound(4, 1, 3), "2 arrows"), (bound(4, 2, 2), "3 floors")]
    {
        let complaints = plan.against(&bound);
        assert!(complaints.len() == 1 && complaints[0].contains(word), "{complaints:?}");
    }
    let circle = Plan { arrows: BTreeSet::from([("mesh", "math"), ("math", "mesh")]), ..plan };
    assert_eq!(circle.floors(), 4, "a circle has no end");
}
