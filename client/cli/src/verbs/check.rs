//! `nappe check`: a scene is read and built and not computed; what it holds, and what is wrong with it.

use std::fmt::Write;

use clap::Args;
use nappe_scene::{Built, Scene, SceneLimits};
use nappe_sim::{
    cloth::{Bending, Crossed, ElementKind, ElementList, Integrator, Network, Repeat},
    math::{
        array::{cross, length, minus},
        four_digits,
    },
    world::{BodySetup, SetupError, Simulation, StepBound, WorldSetup},
};
use serde::Serialize;

use crate::{
    scenes::{
        mesh_info::{Overlaps, PartCrossings},
        meshes,
    },
    studies::study::Source,
    words::{
        error::{CliError, Result},
        output::{self, Column, Format, OutputArgs},
    },
};

/// Gravity (m/s²) by which the length of folds is told.
const GRAVITY: f64 = 9.81;

/// Check a scene without computing it
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe check my.toml          every error with its line; else particles, springs and meshes of colliders
  nappe check my.toml --json   one object, with the warnings

Of each collider that is a mesh it says the triangles, the holes that close_holes filled, the parts that no edge joins, and
the volume of their union; it warns of parts that overlap, pass through themselves or are turned the wrong way. Of each body
it says how often an edge crosses a triangle at the start, and the first such pair; with a thickness that is an error. Of each
body under the law plate it says what its mesh makes of the bending stiffness, which the law makes up for, at which length it
folds under its own weight, and how long an explicit step may be; it warns where edges are longer than folds.")]
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
    /// Their fabrics, and how they fold.
    fabric: Vec<Folding>,
    /// How long explicit steps of bodies may be.
    bound: Vec<Bound>,
    /// Bodies that frames lead.
    figures: Vec<Figure>,
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

/// How a body folds that bends as a plate.
#[derive(Debug, Serialize)]
struct Folding {
    body: String,
    /// Name of its fabric, where it has one.
    preset: Option<String>,
    /// The length (m) at which it folds under its own weight.
    fold_length_m: f64,
    /// The longest edge of its mesh (m).
    longest_edge_m: f64,
}

/// How long an explicit step of a body may be at the start.
#[derive(Debug, Serialize)]
struct Bound {
    body: String,
    /// The longest stable step (s).
    seconds: f64,
    /// What a scene may say as its `substep` (s): 0.9 of it.
    suggested_substep_s: f64,
}

/// A figure, and its frames.
#[derive(Debug, Serialize)]
struct Figure {
    name: String,
    corners: usize,
    triangles: usize,
    frames: usize,
    /// From its first frame to its last one, or to the first one again where it loops (s).
    seconds: f64,
    /// Memory of its frames.
    bytes: usize,
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
    let fabric = foldings(&scene, &setup);
    warnings.extend(fabric.iter().filter(|folding| !folding.is_fine()).map(too_coarse));
    let checked = Checked {
        scene: &args.scene,
        particles: simulation.particle_count(),
        springs: setup.bodies.iter().map(|body| body.network.springs.len()).sum(),
        colliders: colliders.collect(),
        crossings: crossings(&setup),
        bending: bending(&setup),
        fabric,
        bound: bounds(&simulation, &setup),
        figures: setup.bodies.iter().filter_map(figure).collect(),
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

fn figure(body: &BodySetup) -> Option<Figure> {
    let frames = body.network.frames.as_ref()?;
    let count = frames.count();
    let passed = match frames.repeat {
        Repeat::Hold => count.saturating_sub(1),
        Repeat::Loop => count,
    };
    Some(Figure {
        name: body.name.clone(),
        corners: body.network.x.len(),
        triangles: body.network.triangles.len(),
        frames: count,
        seconds: passed as f64 / frames.rate,
        bytes: size_of_val(&*frames.places),
    })
}

/// Bounds of all bodies but those by `explicit_euler`: its steps are bounded by what damps them.
fn bounds(simulation: &Simulation, setup: &WorldSetup) -> Vec<Bound> {
    let is_told = |found: &StepBound| {
        let is_other = |body: &BodySetup| {
            body.name == found.body && body.settings.integrator == Integrator::ExplicitEuler
        };
        !setup.bodies.iter().any(is_other)
    };
    simulation.step_bounds().into_iter().filter(is_told).filter_map(bound).collect()
}

fn bound(StepBound { body, dt, .. }: StepBound) -> Option<Bound> {
    dt.is_finite().then_some(Bound { body, seconds: dt, suggested_substep_s: 0.9 * dt })
}

impl Folding {
    /// Whether its edges are short enough to fold as the cloth does.
    fn is_fine(&self) -> bool {
        self.longest_edge_m <= self.fold_length_m
    }
}

fn foldings(scene: &Scene, setup: &WorldSetup) -> Vec<Folding> {
    let of_body = |body: &BodySetup| {
        let mut laws = body.network.elements.iter();
        let plate = laws.find(|list| list.kind == ElementKind::Plate && list.law.stiffness > 0.0)?;
        let stiffness = plate.law.stiffness;
        let text = scene.bodies.iter().find(|text| text.name == body.name);
        let (density, longest_edge_m) = density_and_longest_edge(&body.network)?;
        Some(Folding {
            body: body.name.clone(),
            preset: text.and_then(|text| text.material.as_ref()).map(|material| material.preset.clone()),
            fold_length_m: (stiffness / (GRAVITY * density)).cbrt(),
            longest_edge_m,
        })
    };
    setup.bodies.iter().filter_map(of_body).collect()
}

/// Mass per area (kg/m²) and the longest edge (m) of triangles as they lie; none without a mass or an area.
fn density_and_longest_edge(network: &Network) -> Option<(f64, f64)> {
    let (mut area, mut longest) = (0.0, 0.0);
    for triangle in &network.triangles {
        let [a, b, c] = triangle.map(|corner| network.x[corner as usize]);
        let sides = [minus(b, a), minus(c, b), minus(a, c)];
        area += 0.5 * length(cross(sides[0], sides[1]));
        longest = sides.map(length).into_iter().fold(longest, f64::max);
    }
    let density = network.masses.iter().sum::<f64>() / area;
    (density > 0.0 && density.is_finite()).then_some((density, longest))
}

fn too_coarse(Folding { body, fold_length_m, longest_edge_m, .. }: &Folding) -> String {
    format!(
        "body '{body}': edges are up to {} m long, more than the {} m at which it folds under its own weight: a finer mesh shows \
         folds that this one cannot",
        four_digits(*longest_edge_m),
        four_digits(*fold_length_m)
    )
}

fn folds(Folding { body, preset, fold_length_m, longest_edge_m }: &Folding, bounds: &[Bound]) -> String {
    let of = preset.as_ref().map_or_else(String::new, |preset| format!("{preset}, which "));
    let bound = bounds.iter().find(|bound| bound.body == *body);
    let steps = bound.map_or_else(String::new, |Bound { seconds, suggested_substep_s, .. }| {
        format!(
            "; explicit steps are stable up to {} s: substep = {}",
            four_digits(*seconds),
            four_digits(*suggested_substep_s)
        )
    });
    format!(
        "body '{body}': {of}folds at {} m, with edges of up to {} m{steps}",
        four_digits(*fold_length_m),
        four_digits(*longest_edge_m)
    )
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
    let Checked { scene, particles, springs, colliders, crossings, bending, fabric, bound, figures, .. } =
        checked;
    let particles = output::several(*particles as u64, "particle");
    let springs = output::several(*springs as u64, "spring");
    let mut sentence = format!("{scene}: no errors; {particles}, {springs}");
    for crossing in crossings {
        let _ = write!(sentence, "\n{}", told(crossing));
    }
    for Figure { name, corners, triangles, frames, seconds, .. } in figures {
        let [corners, triangles, frames] = [corners, triangles, frames].map(|number| count(*number));
        let seconds = four_digits(*seconds);
        let _ = write!(
            sentence,
            "\nfigure '{name}': {corners} corners, {triangles} triangles, {frames} frames of {seconds} s in all"
        );
    }
    for of_body in bending {
        let _ = write!(sentence, "\n{}", in_a_sentence(of_body));
    }
    for folding in fabric {
        let _ = write!(sentence, "\n{}", folds(folding, bound));
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
