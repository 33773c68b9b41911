//! What `nappe mesh info` says of a mesh: counts, size, parts and borders, volume, masses, what is odd.
//!
//! Enters: a path. Leaves: a description, for programs and as a table.

use std::path::{Path, PathBuf};

use nappe_scene::{
    MeshParts, PartOverlaps, enclosed_volume,
    files::{self, ReadOptions},
    mesh::{EtiOptions, Loaded},
};
use nappe_sim::{
    collide::shape::SelfCrossings,
    math::{
        array::{length, minus},
        four_digits,
    },
    mesh::{MeshWarning, TJunctions, TriangleMesh},
};
use serde::Serialize;

use crate::{
    scenes::meshes,
    words::{
        error::{CliError, Result},
        output::{self, Column},
    },
};

/// A mesh, described.
#[derive(Debug, Serialize)]
pub(crate) struct Info {
    mesh: PathBuf,
    points: usize,
    triangles: usize,
    edges: usize,
    masses: usize,
    missing_masses: usize,
    pinned: usize,
    total_mass: f64,
    texture_coordinates: usize,
    min: [f64; 3],
    max: [f64; 3],
    size: [f64; 3],
    diagonal: f64,
    parts: usize,
    open_edges: usize,
    boundary_loops: usize,
    t_junctions: usize,
    repeated_triangles: usize,
    /// Parts of a closed mesh that are holes in others; the first triangles of those turned the wrong way; what overlaps.
    holes: usize,
    turned: Vec<u32>,
    overlaps: Option<Overlaps>,
    /// How often parts pass through themselves; none where the mesh encloses no volume.
    crossings: Option<PartCrossings>,
    /// Volume (m³) of the union of its parts; none where the mesh encloses none.
    volume: Option<f64>,
    warnings: Vec<String>,
    /// Why there is no volume.
    #[serde(skip)]
    no_volume: String,
    #[serde(skip)]
    first_t_junction: Option<(u32, [u32; 2])>,
}

/// Parts of a mesh that overlap. Names stay.
#[derive(Debug, Serialize)]
pub(crate) struct Overlaps {
    /// Pairs of parts.
    pub(crate) pairs: usize,
    /// The first triangles of the two that share most.
    pub(crate) triangles: [u32; 2],
    /// Volume (m³) that is counted too often where it is counted for each part.
    pub(crate) volume: f64,
}

impl From<PartOverlaps> for Overlaps {
    fn from(PartOverlaps { pairs, triangles, volume }: PartOverlaps) -> Self {
        Self { pairs, triangles, volume }
    }
}

/// How often parts of a mesh pass through themselves. Names stay.
#[derive(Debug, Serialize)]
pub(crate) struct PartCrossings {
    /// Pairs of an edge and a triangle of the same part.
    count: u64,
    /// Whether too many triangles are near each other to look at all of them.
    cut_off: bool,
    /// The first two triangles, of which an edge of one crosses the other, and the place (m); null where the count is 0.
    triangles: Option<[u32; 2]>,
    place: Option<[f64; 3]>,
}

impl From<SelfCrossings> for PartCrossings {
    fn from(SelfCrossings { count, first, is_cut_off }: SelfCrossings) -> Self {
        let (triangles, place) = (first.map(|first| first.triangles), first.map(|first| first.place));
        Self { count, cut_off: is_cut_off, triangles, place }
    }
}

impl PartCrossings {
    /// How many there are, in digits; more where not all triangles were looked at.
    pub(crate) fn counted(&self) -> String {
        let count = output::count(self.count);
        if self.cut_off { format!("{count} or more") } else { count }
    }
}

/// How other programs make one surface of a mesh that passes through itself.
const REPAIR: &str = "programs that make one surface of it: Blender (modifier Boolean with the Exact solver and an empty \
    collection, or Remesh by voxels), MeshLab (Uniform Mesh Resampling); of several parts, none of which passes through itself, \
    also manifold3d in Python (the union of all)";

/// Describes the mesh in a file.
///
/// # Errors
/// When it cannot be read, or not be simulated.
pub(crate) fn describe(path: &Path) -> Result<Info> {
    let (loaded, missing_masses) = load_incomplete(path)?;
    let mesh = &loaded.mesh;
    let odd = mesh.check().map_err(|error| CliError::failure(format!("{}: {error}", path.display())))?;
    let survey = mesh.survey();
    let TJunctions { count: t_junctions, first: first_t_junction, is_cut_off } = survey.t_junctions;
    let mut warnings = loaded.warnings;
    warnings.extend(odd.iter().map(ToString::to_string));
    if is_cut_off {
        warnings.push("not all open edges were searched for T-junctions: there may be more".to_owned());
    }
    if mesh.masses.is_empty() {
        warnings.push("no masses: a scene must give them".to_owned());
    }

    // One that is not closed has parts too, of which nothing else is known.
    let enclosed = enclosed_volume(mesh);
    let parts = if survey.parts > 1 || enclosed.is_ok() { MeshParts::new(mesh).ok() } else { None };
    let enclosed = parts.as_ref().map_or(enclosed, |parts| Ok(parts.volume));
    if let Some(told) = parts.as_ref().and_then(MeshParts::told_of_crossings) {
        warnings.push(format!("{told}; {REPAIR}"));
    }
    let crossings = parts.as_ref().map(|parts| PartCrossings::from(parts.crossings));
    let MeshParts { holes, turned, overlaps, .. } = parts.unwrap_or_default();
    let (volume, no_volume) = match enclosed {
        Ok(volume) => (Some(volume), String::new()),
        Err(reason) => (None, reason),
    };
    // The missing ones stand at the end.
    let masses = &mesh.masses[..mesh.masses.len() - missing_masses];
    let [min, max] = corners(mesh);
    let size = minus(max, min);
    Ok(Info {
        mesh: path.to_owned(),
        points: mesh.points.len(),
        triangles: mesh.triangles.len(),
        edges: mesh.edges().len(),
        masses: masses.len(),
        missing_masses,
        pinned: masses.iter().filter(|mass| **mass == 0.0).count(),
        total_mass: masses.iter().fold(0.0, |sum, mass| sum + mass),
        texture_coordinates: mesh.uv.len(),
        min,
        max,
        size,
        diagonal: length(size),
        parts: survey.parts,
        open_edges: survey.open_edges,
        boundary_loops: survey.boundary_loops,
        t_junctions,
        repeated_triangles: odd.iter().map(repeats).sum(),
        holes,
        turned,
        overlaps: overlaps.map(Overlaps::from),
        crossings,
        volume,
        warnings: of_file(path, warnings),
        no_volume,
        first_t_junction,
    })
}

/// Lower and upper corner of the box around a mesh (m).
fn corners(mesh: &TriangleMesh) -> [[f64; 3]; 2] {
    let corner = |pick: fn(f64, f64) -> f64, start: f64| {
        [0, 1, 2].map(|axis| mesh.points.iter().map(|point| point[axis]).fold(start, pick))
    };
    [corner(f64::min, f64::INFINITY), corner(f64::max, f64::NEG_INFINITY)]
}

fn repeats(warning: &MeshWarning) -> usize {
    if let MeshWarning::Repeated { count, .. } = warning { *count } else { 0 }
}

/// Warnings with the name of their file, each once.
fn of_file(path: &Path, warnings: Vec<String>) -> Vec<String> {
    let name = path.display().to_string();
    let mut named: Vec<String> = Vec::new();
    for warning in warnings {
        let warning = if warning.starts_with(&name) { warning } else { format!("{name}: {warning}") };
        if !named.contains(&warning) {
            named.push(warning);
        }
    }
    named
}

/// A mesh, and how many masses it lacks: a mesh without some of its masses is described all the same.
fn load_incomplete(path: &Path) -> Result<(Loaded, usize)> {
    let error = match files::load_mesh(path, &ReadOptions::default()) {
        Ok(loaded) => return Ok((loaded, 0)),
        Err(error) if meshes::lacks_masses(&error) => error,
        Err(error) => return Err(error.into()),
    };

    // Where two fillings differ, there was nothing.
    let filled = |mass: f64| {
        let eti = EtiOptions { missing_mass: Some(mass) };
        files::load_mesh(path, &ReadOptions { eti, ..ReadOptions::default() })
    };

    let (mut loaded, other) = (filled(0.0)?, filled(1.0)?);
    let missing = loaded.mesh.masses.iter().zip(&other.mesh.masses).filter(|(a, b)| a != b).count();
    loaded.warnings = vec![error.to_string()];
    Ok((loaded, missing))
}

/// How many parts there are, and what of them is told of a closed mesh.
fn of_parts(info: &Info) -> String {
    let mut told = vec![output::count(info.parts as u64)];
    if info.holes > 0 {
        told.push(format!("holes: {}", output::count(info.holes as u64)));
    }
    if let Some(first) = info.turned.first() {
        let count = output::count(info.turned.len() as u64);
        told.push(format!("turned the wrong way: {count}, the first begins with triangle {first}"));
    }
    if let Some(Overlaps { pairs, triangles: [a, b], volume }) = &info.overlaps {
        told.push(format!(
            "overlapping pairs: {}, most those that begin with triangles {a} and {b}, in all by {} m^3",
            output::count(*pairs as u64),
            four_digits(*volume)
        ));
    }
    told.join("; ")
}

/// How often parts pass through themselves, and where they do first.
fn of_crossings(info: &Info) -> String {
    match &info.crossings {
        None => "not counted: the mesh encloses no volume".to_owned(),
        Some(crossings) => match (crossings.triangles, crossings.place) {
            (Some([a, b]), Some(place)) => {
                let place = place.map(four_digits).join(", ");
                format!("{}, the first: triangles {a} and {b} at ({place}) m", crossings.counted())
            }
            _ => crossings.counted(),
        },
    }
}

/// The description as a table.
pub(crate) fn table(info: &Info) -> String {
    let count = |count: usize| output::count(count as u64);
    let point = |[x, y, z]: [f64; 3]| format!("({x}, {y}, {z}) m");
    let [x, y, z] = info.size;
    let masses = format!(
        "{}, {} kg, {} pinned by mass 0, {} missing",
        count(info.masses),
        info.total_mass,
        info.pinned,
        info.missing_masses
    );
    let open_edges = match info.open_edges {
        0 => "0".to_owned(),
        edges => format!("{}, in loops: {}", count(edges), count(info.boundary_loops)),
    };
    let t_junctions = match info.first_t_junction {
        Some((point, [a, b])) => {
            format!("{}, the first: point {point} on the edge {a} to {b}", count(info.t_junctions))
        }
        None => count(info.t_junctions),
    };
    let volume = match info.volume {
        Some(volume) => format!("{volume} m^3"),
        None => format!("none: the mesh {}", info.no_volume),
    };

    let mut rows = vec![
        ("file", info.mesh.display().to_string()),
        ("points", count(info.points)),
        ("triangles", format!("{}, repeated: {}", count(info.triangles), count(info.repeated_triangles))),
        ("edges", count(info.edges)),
        ("open edges", open_edges),
        ("T-junctions", t_junctions),
        ("parts", of_parts(info)),
        ("crossings", of_crossings(info)),
        ("volume", volume),
        ("masses", masses),
        ("texture", format!("{} coordinates", info.texture_coordinates)),
        ("from", point(info.min)),
        ("to", point(info.max)),
        ("size", format!("{x} x {y} x {z} m, diagonal {} m", info.diagonal)),
    ];
    rows.extend(info.warnings.iter().map(|warning| ("warning", warning.clone())));
    let rows: Vec<Vec<String>> = rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]).collect();
    output::table(&[Column::Left("mesh"), Column::Left(" ")], &rows)
}
