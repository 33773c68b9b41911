//! Names are unique among bodies, figures and objects of snow, and among colliders.

use std::collections::BTreeMap;

use crate::{
    error::{ErrorKind, Found},
    location::Location,
    scene::Scene,
};

/// A named thing: what it is, where it stands, its name.
type Named<'a> = (&'static str, Location<'a>, &'a str);

/// Finds names that are empty or taken.
pub(super) fn check(scene: &Scene, root: &Location<'_>, found: &mut Found) {
    let list = root.key("body");
    let bodies = scene.bodies.iter().enumerate().map(|(i, b)| ("body", list.index(i), b.name.as_str()));
    let list = root.key("snow").key("object");
    let objects = scene.snow.iter().flat_map(|snow| &snow.objects).enumerate();
    let objects = objects.map(|(i, o)| ("object of snow", list.index(i), o.name.as_str()));
    let list = root.key("figure");
    let figures = scene.figures.iter().enumerate().map(|(i, f)| ("figure", list.index(i), f.name.as_str()));
    check_unique(bodies.chain(objects).chain(figures), found);

    let list = root.key("collider");
    let colliders = scene.colliders.iter().enumerate();
    check_unique(colliders.map(|(i, c)| ("collider", list.index(i), c.name.as_str())), found);
}

fn check_unique<'a>(all: impl Iterator<Item = Named<'a>>, found: &mut Found) {
    let mut seen = BTreeMap::new();
    for (what, at, name) in all {
        let at = at.key("name");
        if name.trim().is_empty() {
            found.add(at.error(ErrorKind::OutOfRange, "is empty: a name is needed"));
        } else if let Some(owner) = seen.insert(name, what) {
            let owner = if owner == what { format!("another {owner}") } else { format!("a {owner}") };
            let message = format!("'{name}' is the name of {owner}: a name may be used once");
            found.add(at.error(ErrorKind::Inconsistent, message));
        }
    }
}
