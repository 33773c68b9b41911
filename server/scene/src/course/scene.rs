//! Parameter files and meshes to one scene: a body an object, one clock.
//!
//! The course advances each object by its own dt at each iteration, so that their clocks part.
//! Here the scene advances by the largest dt and the others sub-step.

use nappe_sim::{
    cloth::Integrator,
    math::{Precision, number},
};

use super::{
    object::{ObjectIntegration, ObjectParameters},
    simu::{ObjectKind, SimuParameters},
};
use crate::{
    body::{Body, Mesh, SpringLaw, Springs},
    error::{ErrorKind, SceneError},
    scene::Scene,
    solver::Solver,
};

/// What the medium does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Viscosity {
    /// Nothing: the course reads `viscosite` and its mass-spring solvers leave it unused.
    #[default]
    Unused,
    /// `viscosite` (N s/m) is the linear drag on each particle.
    Drag,
}

/// What the parameter files leave open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MecasimOptions {
    /// What `viscosite` does.
    pub viscosity: Viscosity,
    /// Precision of positions and velocities; default: f32.
    pub precision: Precision,
    /// Integrator of every object; none: that of its file.
    pub integrator: Option<Integrator>,
}

impl Default for MecasimOptions {
    fn default() -> Self {
        Self { viscosity: Viscosity::default(), precision: Precision::F32, integrator: None }
    }
}

/// An object of the course: its file and where its mesh is now.
#[derive(Clone, Copy, Debug)]
pub struct CourseObject<'a> {
    /// What its file says.
    pub parameters: &'a ObjectParameters,
    /// Its mesh: usually an upload.
    pub mesh: &'a Mesh,
}

/// The scene of a simulation file and its objects, in their order, with warnings.
///
/// # Errors
/// No objects; a kind that is not done here; `k` or `nu` missing for springs; time steps whose
/// ratio is not whole.
pub fn mecasim_scene(
    simu: &SimuParameters,
    objects: &[CourseObject<'_>],
    options: &MecasimOptions,
) -> Result<(Scene, Vec<String>), SceneError> {
    let mut warnings = simu.warnings.clone();
    let Some(slowest) = objects.iter().max_by(|a, b| a.parameters.dt.total_cmp(&b.parameters.dt)) else {
        return Err(SceneError::new(
            ErrorKind::Missing,
            &simu.file,
            "has no objects: one object file or more is needed",
        ));
    };

    let dt = slowest.parameters.dt;
    let drag = viscosity(simu, options.viscosity, &mut warnings);
    let mut bodies: Vec<Body> = Vec::new();
    for (number, object) in (1..).zip(objects) {
        let parameters = object.parameters;
        warnings.extend(parameters.warnings.iter().cloned());
        let mut body = Body::new(name(parameters, number, &bodies), object.mesh.clone());
        body.drag = drag;
        body.substeps = Some(substeps(dt, slowest.parameters, parameters)?).filter(|count| *count > 1);
        body.springs = springs(simu, number, parameters, &mut warnings)?;
        (body.integrator, body.solver) = solver(parameters, options.integrator, &mut warnings);
        bodies.push(body);
    }

    let names: Vec<&str> = bodies.iter().map(|body| body.name.as_str()).collect();
    let scene = Scene {
        title: format!("MecaSim: {}", names.join(", ")).chars().take(100).collect(),
        dt,
        steps: simu.steps,
        // About 60 frames per second of simulated time.
        frame_interval: (1.0 / 60.0 / dt).round().clamp(1.0, 1e6) as u32,
        precision: options.precision,
        gravity: simu.gravity,
        bodies,
        ..Scene::default()
    };

    Ok((scene, warnings))
}

fn viscosity(simu: &SimuParameters, viscosity: Viscosity, warnings: &mut Vec<String>) -> f64 {
    match (simu.viscosity, viscosity) {
        (Some(value), Viscosity::Drag) => value,
        (Some(value), Viscosity::Unused) => {
            warnings.push(format!(
                "{}: viscosite={value} is read and left unused, as the course does; an option makes it the drag of the medium",
                simu.file
            ));
            0.0
        }
        (None, _) => 0.0,
    }
}

/// The folder of its points (`drap70`), made unique.
fn name(parameters: &ObjectParameters, number: usize, before: &[Body]) -> String {
    let folder =
        parameters.points.rsplit(['/', '\\']).nth(1).filter(|f| !f.is_empty() && *f != "." && *f != "..");
    let name: String = folder.map_or(format!("objet{number}"), |f| f.chars().take(15).collect());
    if before.iter().any(|body| body.name == name) { format!("{name}-{number}") } else { name }
}

fn substeps(
    largest: f64,
    slowest: &ObjectParameters,
    parameters: &ObjectParameters,
) -> Result<u32, SceneError> {
    let ratio = largest / parameters.dt;
    let whole = ratio.round();
    // dt has a few digits in the file: their quotient is whole to rounding, or not at all.
    if (ratio - whole).abs() > 1e-9 * ratio || whole > 10_000.0 {
        let message = format!(
            "is {}, and the largest, of {}, is {}: {} times as long; allowed: a whole number of times, up to 10000",
            number(parameters.dt),
            slowest.file,
            number(largest),
            number(ratio)
        );
        return Err(SceneError::new(ErrorKind::Inconsistent, &parameters.file, message).for_key("dt"));
    }
    Ok(whole as u32)
}

fn springs(
    simu: &SimuParameters,
    number: usize,
    parameters: &ObjectParameters,
    warnings: &mut Vec<String>,
) -> Result<Option<Springs>, SceneError> {
    let kind = match simu.kinds.get(&number) {
        Some((kind @ (ObjectKind::Fluid | ObjectKind::Rigid), line)) => {
            let message = format!("is {}, which is not done here; allowed: mss, particule", kind.name());
            let error = SceneError::new(ErrorKind::Unsupported, &simu.file, message);
            return Err(error.at_line(*line).for_key(format!("objet{number}")));
        }
        Some((kind, _)) => *kind,
        None => {
            warnings.push(format!("{}: objet{number} is not set: mss is taken", simu.file));
            ObjectKind::MassSpring
        }
    };

    if kind == ObjectKind::Particles {
        return Ok(None);
    }
    let needed = |value: Option<f64>, key: &str, what: &str| {
        let message = format!("is missing: {what} of the springs of an mss object");
        value.ok_or_else(|| SceneError::new(ErrorKind::Missing, &parameters.file, message).for_key(key))
    };

    if parameters.faceset.is_none() {
        let message = "is missing: the springs of an mss object are the edges of its triangles";
        return Err(SceneError::new(ErrorKind::Missing, &parameters.file, message).for_key("FaceSet"));
    }

    let stiffness = needed(parameters.stiffness, "k", "the stiffness (N/m)")?;
    let damping = needed(parameters.damping, "nu", "the damping (N s/m)")?;
    let stretch = Some(SpringLaw { stiffness, damping });
    Ok(Some(Springs { file: None, pattern: None, stretch, shear: None, bend: None }))
}

fn solver(
    parameters: &ObjectParameters,
    chosen: Option<Integrator>,
    warnings: &mut Vec<String>,
) -> (Integrator, Solver) {
    let (own, fixed_iterations) = match parameters.integration {
        ObjectIntegration::SymplecticEuler => (Integrator::SymplecticEuler, None),
        ObjectIntegration::ImplicitEuler { iterations } => (Integrator::ImplicitEuler, iterations),
    };
    let integrator = chosen.unwrap_or(own);
    if !integrator.is_implicit() {
        return (integrator, Solver::default());
    }
    if own.is_implicit() && fixed_iterations.is_none() {
        warnings.push(format!(
            "{}: NbIterVitImpl is not set: the solver stops by its tolerance",
            parameters.file
        ));
    }
    (integrator, Solver { fixed_iterations, ..Solver::default() })
}
