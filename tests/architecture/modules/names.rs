//! Which file a path means: `crate::`, `super::` and `self::` are followed through what modules
//! declare, import and pass on, to the file where the item is written.

use super::files::Crate;

/// What a path means inside its crate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// A module itself.
    Module(usize),
    /// An item of a module.
    Item(usize),
}

/// Longest chain of imports that is followed: some lead in a circle.
const LONGEST: u32 = 16;

/// What `path`, written in module `from`, means; nothing for a path of another crate.
pub(super) fn meaning(krate: &Crate, from: usize, path: &str) -> Option<Meaning> {
    follow(krate, from, path, LONGEST)
}

fn follow(krate: &Crate, from: usize, path: &str, left: u32) -> Option<Meaning> {
    let left = left.checked_sub(1)?;
    let mut parts = path.split("::");
    let mut at = match parts.next()? {
        "crate" => Meaning::Module(0),
        "self" => Meaning::Module(from),
        "super" => Meaning::Module(krate.modules[from].parent),
        name => named(krate, from, name, left)?,
    };
    for name in parts {
        let Meaning::Module(module) = at else { break };
        at = match name {
            "self" => at,
            "super" => Meaning::Module(krate.modules[module].parent),
            // What no text shows is made by a macro, there.
            _ => named(krate, module, name, left).unwrap_or(Meaning::Item(module)),
        };
    }
    Some(at)
}

/// What `name` means in a module: a module or an item of its own, or one that it imports.
fn named(krate: &Crate, module: usize, name: &str, left: u32) -> Option<Meaning> {
    let here = &krate.modules[module];
    if let Some(child) = here.children.iter().find(|child| krate.modules[**child].name == name) {
        return Some(Meaning::Module(*child));
    }
    if here.items.iter().any(|item| item == name) {
        return Some(Meaning::Item(module));
    }
    // A name may be imported twice, as a module and as a function: the first that is of this crate.
    let mut imports = here.imports.iter().filter(|import| import.name == name && import.path != name);
    if let Some(meaning) = imports.find_map(|import| follow(krate, module, &import.path, left)) {
        return Some(meaning);
    }
    let mut globs = here.globs.iter().filter_map(|path| follow(krate, module, path, left));
    globs.find_map(|meaning| match meaning {
        Meaning::Module(other) if other != module => named(krate, other, name, left.checked_sub(1)?),
        _ => None,
    })
}
