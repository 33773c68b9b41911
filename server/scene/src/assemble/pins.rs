//! Pins by index or name, and pins that move from the start.

use std::collections::BTreeSet;

use nappe_sim::{
    cloth::Network,
    world::{Change, TimedForce},
};

use crate::{
    body::{Body, ForceText, Mesh, MovingPin, Pin},
    error::{ErrorKind, SceneError, excerpt, suggestion},
    location::Location,
};

const ON_GRIDS: [&str; 8] =
    ["top_left", "top_right", "bottom_left", "bottom_right", "top", "bottom", "left", "right"];
const ON_CHAINS: [&str; 2] = ["first", "last"];

/// Bytes of a particle that a force names: in its list, which grows by doubling, and in that of the cloth.
pub(super) const FORCED_BYTES: u64 = 12;
/// Bytes of a particle that moves from the start: its change, in lists that grow by doubling, and its way.
pub(super) const MOVED_BYTES: u64 = 512;

/// Bytes, at most, of the particles that forces and moving pins of a body name, of so many: a name stands for many of them.
pub(super) fn named_bytes(body: &Body, points: u64) -> u64 {
    let row = match body.mesh {
        Mesh::Grid { grid: [columns, rows], .. } => columns.max(rows),
        Mesh::CourseGrid { course_grid: side } => side,
        _ => 1,
    };
    let count = |pin: &Pin| match pin {
        Pin::Name(name) if name == "all" => points,
        Pin::Name(_) => row.into(),
        Pin::Index(_) => 1,
    };
    let forced = body.forces.iter().map(|force| count(&force.on)).sum::<u64>();
    let moved = body.moving_pins.iter().map(|moving| count(&moving.pin)).sum::<u64>();
    FORCED_BYTES.saturating_mul(forced).saturating_add(MOVED_BYTES.saturating_mul(moved))
}

/// How a body's particles are numbered, which says what names they have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Row by row.
    Grid {
        /// Particles of a row.
        columns: u32,
        /// Rows, the top one first.
        rows: u32,
    },
    /// One after the other.
    Chain,
    /// As a file has them: there are no names.
    Free,
}

impl Layout {
    /// The names that particles have on any body.
    pub fn names() -> impl Iterator<Item = &'static str> {
        ON_GRIDS.into_iter().chain(ON_CHAINS)
    }

    /// The particles of a name on a body of `count`, in ascending order.
    ///
    /// # Errors
    /// What the name is, and which there are: `is 'topp'; did you mean 'top'?`
    pub fn particles(self, name: &str, count: usize) -> Result<Vec<u32>, String> {
        match (self, name) {
            (Self::Grid { columns, rows }, name) => {
                on_grid(name, columns, rows).ok_or_else(|| unknown(name, &ON_GRIDS))
            }
            (Self::Chain, "first") => Ok(vec![0]),
            (Self::Chain, "last") => Ok(vec![count as u32 - 1]),
            (Self::Chain, name) => Err(unknown(name, &ON_CHAINS)),
            (Self::Free, name) => {
                Err(format!("is '{}': names are for grids and chains; allowed here: an index", excerpt(name)))
            }
        }
    }
}

/// The particles of `count` that pins name, in ascending order, each once; `at` is where the pins stand.
pub(super) fn particles(
    pins: &[Pin],
    layout: Layout,
    count: usize,
    at: &Location<'_>,
) -> Result<Vec<u32>, SceneError> {
    let (mut all, mut names) = (Vec::new(), BTreeSet::new());
    for (i, pin) in pins.iter().enumerate() {
        // What a name pins is pinned once, however often it stands there.
        if let Pin::Name(name) = pin
            && !names.insert(name)
        {
            continue;
        }
        all.extend(resolve(pin, layout, count, &at.index(i))?);
    }
    all.sort_unstable();
    all.dedup();
    Ok(all)
}

/// The first changes: one for each particle of each moving pin. Their indices count over all bodies, of
/// which this one begins with `first_particle`; `at` is where the moving pins stand.
pub(super) fn moves(
    moving_pins: &[MovingPin],
    layout: Layout,
    network: &Network,
    first_particle: u64,
    at: &Location<'_>,
) -> Result<Vec<Change>, SceneError> {
    let mut changes = Vec::new();
    for (i, moving) in moving_pins.iter().enumerate() {
        let at = at.index(i);
        let pin = at.key("pin");
        let particles = resolve(&moving.pin, layout, network.x.len(), &pin)?;
        if moving.target.is_some() && particles.len() > 1 {
            let count = particles.len();
            let message = format!("sends {count} particles to one point; allowed for several: offset");
            return at.key("target").inconsistent(message);
        }

        for particle in particles {
            let p = particle as usize;
            if network.masses[p] != 0.0 && network.pins.binary_search(&particle).is_err() {
                return pin.inconsistent(format!("particle {particle} is not pinned: list it in pins"));
            }
            let offset = moving.offset.unwrap_or_default();
            let target = moving.target.unwrap_or([0, 1, 2].map(|i| network.x[p][i] + offset[i]));
            let particle = (first_particle + u64::from(particle)) as u32;
            changes.push(Change::Pin { particle, target, duration: moving.duration });
        }
    }

    Ok(changes)
}

/// Forces on particles of a body, which `is_free` says the free ones of; `at` is where they stand.
pub(super) fn forces(
    texts: &[ForceText],
    layout: Layout,
    is_free: &[bool],
    at: &Location<'_>,
) -> Result<Vec<TimedForce>, SceneError> {
    let mut forces = Vec::new();
    for (i, ForceText { on, force, from, until }) in texts.iter().enumerate() {
        let at = at.index(i);
        let of_all = matches!(on, Pin::Name(name) if name == "all");
        let particles = if of_all {
            (0..is_free.len() as u32).filter(|particle| is_free[*particle as usize]).collect()
        } else {
            resolve(on, layout, is_free.len(), &at.key("on"))?
        };
        if let Some(pinned) = particles.iter().find(|particle| !is_free[**particle as usize]) {
            return at.key("on").inconsistent(format!("particle {pinned} is pinned, and feels no force"));
        }
        let until = until.unwrap_or(f64::INFINITY);
        if until <= *from {
            return at.key("until").inconsistent(format!("is {until}: a time after from = {from} is needed"));
        }
        forces.push(TimedForce { particles, force: *force, from: *from, until });
    }
    Ok(forces)
}

fn resolve(pin: &Pin, layout: Layout, count: usize, at: &Location<'_>) -> Result<Vec<u32>, SceneError> {
    let error = |kind, message: String| Err(at.error(kind, message));
    match (pin, layout) {
        (Pin::Index(index), _) if (*index as usize) < count => Ok(vec![*index]),
        (Pin::Index(index), _) => {
            let allowed = match count {
                0 => "none, this body has no particles".to_owned(),
                _ => format!("0 to {}, the particles of this body", count - 1),
            };
            error(ErrorKind::OutOfRange, format!("is {index}; allowed: {allowed}"))
        }
        (Pin::Name(name), _) => layout.particles(name, count).or_else(|message| {
            let kind = if layout == Layout::Free { ErrorKind::Inconsistent } else { ErrorKind::OutOfRange };
            error(kind, message)
        }),
    }
}

fn unknown(name: &str, known: &[&'static str]) -> String {
    format!("is '{}'; {}", excerpt(name), suggestion(name, known.iter().copied()))
}

fn on_grid(name: &str, columns: u32, rows: u32) -> Option<Vec<u32>> {
    let (right, bottom) = (columns - 1, (rows - 1) * columns);
    Some(match name {
        "top_left" => vec![0],
        "top_right" => vec![right],
        "bottom_left" => vec![bottom],
        "bottom_right" => vec![bottom + right],
        "top" => (0..columns).collect(),
        "bottom" => (bottom..bottom + columns).collect(),
        "left" => (0..rows).map(|r| r * columns).collect(),
        "right" => (0..rows).map(|r| r * columns + right).collect(),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{NoMeshes, Scene, SceneLimits};

    fn scene(more: &str) -> Scene {
        let text = format!(
            "version = 1\ndt = 0.001\n[[body]]\nname = \"b\"\nmesh = {{ grid = [20, 5], spacing = 0.1 }}\n\
             mass = {{ particle = 0.1 }}\n{more}"
        );
        Scene::parse(&text, "test").expect("a scene")
    }

    #[test]
    fn a_name_that_stands_there_often_pins_once() {
        let scene = scene("pins = [\"top\", 30, \"top\", \"top_left\", \"top\", 30, \"top\"]\n");
        let built = scene.build(&NoMeshes, &SceneLimits::default()).expect("it can be built");
        let pins: Vec<u32> = (0..20).chain([30]).collect();
        assert_eq!(built.setup.bodies[0].network.pins, pins);
    }

    #[test]
    fn particles_that_forces_and_moving_pins_name_are_counted_before_they_are_listed() {
        let force = |on: &str| format!("[[body.force]]\non = {on}\nforce = [0, 1, 0]\n");
        let moving =
            |pin: &str| format!("[[body.moving_pin]]\npin = {pin}\noffset = [0, 1, 0]\nduration = 1\n");
        let bytes = |more: &str| scene(more).size(&NoMeshes).named_bytes;
        assert_eq!(bytes(""), 0);
        let forces = force("\"all\"").repeat(1000) + &force("\"top\"") + &force("7");
        assert_eq!(bytes(&forces), FORCED_BYTES * (100 * 1000 + 20 + 1));
        assert_eq!(bytes(&moving("\"left\"").repeat(3)), MOVED_BYTES * 60, "the longer side, at most");
    }
}
