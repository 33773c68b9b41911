//! Rooms: the modules of a folder, each with all that it holds as one. A folder that grows is to stay readable at a glance: few
//! rooms, few arrows between them, and no long way from the one that uses all to the one that uses none.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    arrows,
    files::{self, Crate},
};

/// A folder, and how much it may hold.
struct Bound {
    /// The file that declares its rooms.
    front: &'static str,
    rooms: usize,
    arrows: usize,
    floors: usize,
}

const BOUNDS: [Bound; 2] = [
    Bound { front: "server/sim/src/cloth/mod.rs", rooms: 12, arrows: 45, floors: 10 },
    Bound { front: "server/study/src/lib.rs", rooms: 10, arrows: 35, floors: 10 },
];

/// What stands between the rooms of a folder, its front page being one of them.
#[derive(Debug, Default, PartialEq, Eq)]
struct Plan<'a> {
    rooms: BTreeSet<&'a str>,
    arrows: BTreeSet<(&'a str, &'a str)>,
}

impl<'a> Plan<'a> {
    fn of(krate: &'a Crate, front: &str) -> Self {
        let folder = front.rsplit_once('/').map_or("", |(folder, _)| folder);
        let room = |file: &'a str| -> Option<&'a str> {
            let within = file.strip_prefix(folder)?.strip_prefix('/')?;
            let end = within.find('/').or_else(|| within.find('.'))?;
            Some(if file == front { "" } else { &within[..end] })
        };
        let rooms = krate.modules.iter().filter_map(|module| room(&module.file)).collect();
        let between = arrows::between_files(krate).into_iter();
        let between = between.filter_map(|(from, to)| Some((room(from)?, room(to)?)));
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
