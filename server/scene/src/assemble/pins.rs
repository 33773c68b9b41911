//! Pins by index or name, and pins that move from the start.

use nappe_sim::world::Change;

use super::body::{Context, Layout, Made};
use crate::{
    body::Pin,
    error::{Fault, SceneError, excerpt, suggestion},
    source::Path,
};

const ON_GRIDS: [&str; 8] =
    ["top_left", "top_right", "bottom_left", "bottom_right", "top", "bottom", "left", "right"];
const ON_CHAINS: [&str; 2] = ["first", "last"];

/// The particles of the body that its pins name, in ascending order, each once.
pub(super) fn particles(context: &Context<'_>, layout: Layout, count: usize) -> Result<Vec<u32>, SceneError> {
    let mut all = Vec::new();
    for (i, pin) in context.body.pins.iter().enumerate() {
        all.extend(resolve(context, pin, layout, count, &context.path.key("pins").index(i))?);
    }
    all.sort_unstable();
    all.dedup();
    Ok(all)
}

/// The first changes: one for each particle of each moving pin, indices over all bodies.
pub(super) fn moves(
    context: &Context<'_>,
    made: &Made,
    first_particle: u64,
) -> Result<Vec<Change>, SceneError> {
    let network = &made.setup.network;
    let mut changes = Vec::new();
    for (i, moving) in context.body.moving_pins.iter().enumerate() {
        let path = context.path.key("moving_pin").index(i);
        let pin = path.key("pin");
        let particles = resolve(context, &moving.pin, made.layout, network.x.len(), &pin)?;
        if moving.target.is_some() && particles.len() > 1 {
            let message =
                format!("sends {} particles to one point; allowed for several: offset", particles.len());
            return Err(context.source.error(Fault::Inconsistent, &path.key("target"), message));
        }
        for particle in particles {
            let p = particle as usize;
            if network.masses[p] != 0.0 && network.pins.binary_search(&particle).is_err() {
                let message = format!("particle {particle} is not pinned: list it in pins");
                return Err(context.source.error(Fault::Inconsistent, &pin, message));
            }
            let offset = moving.offset.unwrap_or_default();
            let target = moving.target.unwrap_or([0, 1, 2].map(|i| network.x[p][i] + offset[i]));
            let particle = (first_particle + u64::from(particle)) as u32;
            changes.push(Change::Pin { particle, target, duration: moving.duration });
        }
    }
    Ok(changes)
}

fn resolve(
    context: &Context<'_>,
    pin: &Pin,
    layout: Layout,
    count: usize,
    path: &Path,
) -> Result<Vec<u32>, SceneError> {
    let error = |fault, message: String| Err(context.source.error(fault, path, message));
    match (pin, layout) {
        (Pin::Index(index), _) if (*index as usize) < count => Ok(vec![*index]),
        (Pin::Index(index), _) => {
            let last = count.saturating_sub(1);
            error(Fault::OutOfRange, format!("is {index}; allowed: 0 to {last}, the particles of this body"))
        }
        (Pin::Name(name), Layout::Grid { columns, rows }) => match on_grid(name, columns, rows) {
            Some(particles) => Ok(particles),
            None => error(Fault::OutOfRange, unknown(name, &ON_GRIDS)),
        },
        (Pin::Name(name), Layout::Chain) => match name.as_str() {
            "first" => Ok(vec![0]),
            "last" => Ok(vec![count as u32 - 1]),
            _ => error(Fault::OutOfRange, unknown(name, &ON_CHAINS)),
        },
        (Pin::Name(name), Layout::Free) => error(
            Fault::Inconsistent,
            format!("is '{}': names are for grids and chains; allowed here: an index", excerpt(name)),
        ),
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
