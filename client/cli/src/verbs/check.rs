//! `nappe check`: a scene is read and built and not computed; what it holds, and what is wrong with it.

use std::fmt::Write;

use clap::Args;
use nappe_scene::{Built, Scene, SceneLimits};
use nappe_sim::{
    cloth::{Bending, Crossed, ElementList},
    math::four_digits,
    world::{BodySetup, SetupError, Simulation, WorldSetup},
};
use serde::Serialize;

use crate::{
    error::{CliError, Result},
    mesh_info::{Overlaps, PartCrossings},
    meshes,
    output::{self, Column, Format, OutputArgs},
    study::Source,
};

/// Check a scene without computing it
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe check my.toml          every error with its line; else particles, springs and meshes of colliders
  nappe check my.toml --json   one object, with the warnings

Of each collider that is a mesh it says the triangles, the holes that close_holes filled, the parts that no edge joins, and
the volume of their union; it warns of parts that overlap, pass through themselves or are turned the wrong way. Of each body
it says how often an edge crosses a triangle at the start, and the first such pair; with a thickness that is an error. Of each
body under the law plate it says what its mesh makes of the bending stiffness, which the law makes up for.")]
pub(crate) struct CheckArgs {
    /// A shipped scene's name, or a scene file (.toml) with its meshes beside it
    scene: String,
    #[command(flatten)]
    output: OutputArgs,
}

/// What a scene without errors holds. Names stay.
#[derive(Debug, Serialize)]
struct Checked<'a> {
    scene: &'a str,
    particles: usize,
    springs: usize,
    colliders: Vec<Collider>,
    /// Bodies whose surfaces cross themselves at the start.
    crossings: Vec<Crossing>,
    /// Bodies that bend as plates.
    bending: Vec<PlateBending>,
    warnings: Vec<String>,
}

/// What the mesh of a body makes of the stiffness of a plate.
#[derive(Debug, Serialize)]
struct PlateBending {
    body: String,
    /// The stiffness that its elements alone would have, in that of the plate; 1 where nothing was measured.
    factor: f64,
    /// Poisson's ratio that the mesh brings.
    poisson: f64,
    /// Triangles by which both were measured.
    measured_triangles: usize,
    /// Curvatures of elements that nothing resists.
    dropped: usize,
}

/// A body whose surface crosses itself.
#[derive(Debug, Serialize)]
struct Crossing {
    body: String,
    /// Pairs of an edge and a triangle.
    count: u64,
    /// The particles of the first pair: ends of its edge, corners of its triangle.
    edge: [u32; 2],
    triangle: [u32; 3],
}

/// A collider that is a mesh.
#[derive(Debug, Serialize)]
struct Collider {
    name: String,
    triangles: usize,
    holes_closed: usize,
    /// Parts that no edge joins, and those of them that are holes in others.
    parts: usize,
    holes: usize,
    /// The first triangles of the parts that were turned round.
    turned: Vec<u32>,
    overlaps: Option<Overlaps>,
    /// How often parts pass through themselves.
    crossings: PartCrossings,
    /// Volume (m³) of the union.
    volume: f64,
}

/// Runs `nappe check`.
///
/// # Errors
/// When the scene or a mesh of it cannot be read, or no simulation can be made of it.
pub(crate) fn run(args: &CheckArgs) -> Result<()> {
    let scene = Scene::parse(&Source::text(&args.scene)?, &args.scene)?;
    let Built { setup, initial_changes: _, collider_solids, mut warnings } =
        scene.build(&Source::meshes(&args.scene), &SceneLimits::default())?;
    // Steps that are too long are known once a simulation is made.
    let made = Simulation::new(&setup, scene.precision);
    let (simulation, odd) = made.map_err(|error| refused(&error, &setup))?;
    warnings.extend(odd);

    let colliders = collider_solids.into_iter().map(|solid| Collider {
        name: solid.name,
        triangles: solid.triangles,
        holes_closed: solid.holes_closed,
        parts: solid.parts.count,
        holes: solid.parts.holes,
        turned: solid.parts.turned,
        overlaps: solid.parts.overlaps.map(Overlaps::from),
        crossings: solid.parts.crossings.into(),
        volume: solid.volume,
    });
    let checked = Checked {
        scene: &args.scene,
        particles: simulation.particle_count(),
        springs: setup.bodies.iter().map(|body| body.network.springs.len()).sum(),
        colliders: colliders.collect(),
        crossings: crossings(&setup),
        bending: bending(&setup),
        warnings,
    };
    meshes::note(&checked.warnings);
    match args.output.format() {
        Format::Json => output::json(&checked),
        Format::Text => output::line(&in_words(&checked)),
    }
}

/// What is wrong with a scene, and how often its surfaces cross themselves: where they may not, the first pair alone is named.
fn refused(error: &SetupError, setup: &WorldSetup) -> CliError {
    let mut message = error.to_string();
    for crossing in crossings(setup) {
        let _ = write!(message, "\n{}", told(&crossing));
    }
    CliError::failure(message)
}

fn told(Crossing { body, count, edge, triangle }: &Crossing) -> String {
    format!("body '{body}': {}", Crossed { count: *count, edge: *edge, triangle: *triangle })
}

fn crossings(setup: &WorldSetup) -> Vec<Crossing> {
    let of_body = |body: &BodySetup| {
        let Crossed { count, edge, triangle } = body.network.crossed()?;
        Some(Crossing { body: body.name.clone(), count, edge, triangle })
    };
    setup.bodies.iter().filter_map(of_body).collect()
}

fn bending(setup: &WorldSetup) -> Vec<PlateBending> {
    let of_body = |body: &BodySetup| -> Vec<PlateBending> {
        let found = body.network.elements.iter().filter_map(ElementList::bending);
        let told = |Bending { factor, poisson, measured, dropped }| PlateBending {
            body: body.name.clone(),
            factor,
            poisson,
            measured_triangles: measured,
            dropped,
        };
        found.map(told).collect()
    };
    setup.bodies.iter().flat_map(of_body).collect()
}

fn in_a_sentence(PlateBending { body, factor, poisson, measured_triangles, .. }: &PlateBending) -> String {
    if *measured_triangles == 0 {
        return format!(
            "body '{body}': its mesh is too narrow to tell what it makes of the stiffness of plate, which is taken as it is"
        );
    }
    // Never -0.
    let poisson = (100.0 * *poisson).round() / 100.0 + 0.0;
    format!(
        "body '{body}': its mesh alone would bend with {} of the stiffness of plate, which is made up for, and it brings \
         Poisson's ratio {poisson:.2}",
        four_digits(*factor)
    )
}

/// A sentence, one for each body that crosses itself or bends as a plate, and a table of the meshes of colliders.
fn in_words(checked: &Checked<'_>) -> String {
    let count = |count: usize| output::count(count as u64);
    let Checked { scene, particles, springs, colliders, crossings, bending, .. } = checked;
    let particles = output::several(*particles as u64, "particle");
    let springs = output::several(*springs as u64, "spring");
    let mut sentence = format!("{scene}: no errors; {particles}, {springs}");
    for crossing in crossings {
        let _ = write!(sentence, "\n{}", told(crossing));
    }
    for of_body in bending {
        let _ = write!(sentence, "\n{}", in_a_sentence(of_body));
    }
    if colliders.is_empty() {
        return sentence;
    }
    let row = |collider: &Collider| {
        let Collider { name, triangles, holes_closed, parts, crossings, volume, .. } = collider;
        let volume = format!("{} m^3", four_digits(*volume));
        let [triangles, holes_closed, parts] = [triangles, holes_closed, parts].map(|number| count(*number));
        vec![name.clone(), triangles, holes_closed, parts, crossings.counted(), volume]
    };
    let columns = [
        Column::Left("collider"),
        Column::Right("triangles"),
        Column::Right("holes closed"),
        Column::Right("parts"),
        Column::Right("crossings"),
        Column::Right("volume"),
    ];
    let rows: Vec<Vec<String>> = colliders.iter().map(row).collect();
    format!("{sentence}\n\n{}", output::table(&columns, &rows))
}
