//! A scene with the method, the steps and the precision of a plan, and without what can go.

use nappe_scene::{MeshSource, Removal, Scene, SceneLimits, Snow, TransferName};
use nappe_sim::{
    cloth::{Minimizer, MinimizerKind},
    linalg::Stop,
    snow::{Blend, Transfer},
};
use nappe_study::{Case, End, Plan, Setting, SnowSetting, SnowSteps, Stepped, Steps, Term};

use crate::studies::study::CoarserCopy;

/// The scene as a setting has it, all else as it was.
fn stepped_by(scene: &Scene, stepped: &Stepped) -> Scene {
    let mut scene = scene.clone();
    scene.precision = stepped.precision();
    // Plans are of all of the steps, and few methods can leave out any.
    scene.rest = None;
    match stepped {
        Stepped::Cloth(setting) => scene.bodies.iter_mut().for_each(|body| configure(body, setting)),
        Stepped::Snow(setting) => scene.snow.iter_mut().for_each(|snow| configure_snow(snow, setting)),
    }
    scene
}

/// Names of the terms of a scene that is written with a setting; the last is that of a coarser copy, if there is one.
pub(crate) fn term_names(scene: &Scene, stepped: &Stepped, copy: Option<&CoarserCopy>) -> Vec<String> {
    let terms = stepped_by(scene, stepped).terms().into_iter().map(|term| term.name);
    terms.chain(copy.map(|copy| copy.term.clone())).collect()
}

/// That scene without some of its terms, by their places: the one after all others is the particles that a coarser copy has not.
///
/// # Errors
/// A scene that has no such copy.
fn without(scene: &Scene, stepped: &Stepped, places: &[usize]) -> Result<Scene, String> {
    let scene = stepped_by(scene, stepped);
    let terms = scene.terms();
    let gone: Vec<Removal> = places.iter().filter_map(|place| Some(terms.get(*place)?.removal)).collect();
    let left = scene.without(&gone);
    if places.contains(&terms.len()) {
        left.coarser(CoarserCopy::BY).map_err(|errors| errors.to_string())
    } else {
        Ok(left)
    }
}

/// The case of that scene, with its meshes.
///
/// # Errors
/// A scene that cannot be built without them.
pub(crate) fn case_without(
    (name, scene, meshes): (&str, &Scene, &dyn MeshSource),
    stepped: &Stepped,
    places: &[usize],
) -> Result<Case, String> {
    let left = without(scene, stepped, places)?;
    let built = left.build(meshes, &SceneLimits::default()).map_err(|errors| errors.to_string())?;
    let case = Case::new(name, built.setup, built.initial_changes, left.precision);
    case.map_err(|error| error.to_string())
}

/// The text of the scene as a plan has it, all else as it was but comments; none where nothing is accurate enough.
pub(super) fn planned(scene: &Scene, name: &str, plan: &Plan) -> Option<String> {
    let (row, reach) = (plan.row.as_ref()?, plan.reach.as_ref()?);
    let is_gone = |term: &&Term| term.is_left_out && plan.reduced.is_some();
    let gone: Vec<&Term> = plan.terms.iter().filter(is_gone).collect();
    let mut said = format!(
        "# Method, steps and precision by `nappe plan {name}`, good to {:e} m {}.\n",
        plan.chart.tolerance,
        plan.chart.compared()
    );
    let (fewer, others): (Vec<&Term>, Vec<&Term>) =
        gone.iter().copied().partition(|term| CoarserCopy::is_term(term));
    if !others.is_empty() {
        let names: Vec<&str> = others.iter().map(|term| term.name.as_str()).collect();
        said = format!("{said}# Left out: {}.\n", names.join(", "));
    }
    for term in fewer {
        said = format!(
            "{said}# A copy of the scene with fewer {}, as by `nappe scenes coarser {name} --by {}`.\n",
            term.name,
            CoarserCopy::BY
        );
    }
    match &reach.end {
        End::Reached => {}
        End::Failed(failure) => {
            let cause = failure.cause.split_whitespace().collect::<Vec<_>>().join(" ");
            said = format!("{said}# It ends after {} steps: the next one fails, {cause}.\n", reach.steps);
        }
        End::Cut(_) | End::Costly => {
            said = format!("{said}# It ends after {} steps: it was not run beyond them.\n", reach.steps);
        }
    }
    let places: Vec<usize> = gone.iter().map(|term| term.place).collect();
    let mut written = without(scene, &row.stepped, &places).ok()?;
    written.steps = reach.steps;
    Some(said + &written.to_toml())
}

/// Has a body stepped so.
fn configure(body: &mut nappe_scene::Body, setting: &Setting) {
    body.integrator = setting.method.integrator;
    body.hessian = setting.method.hessian;
    body.minimizer = MinimizerKind::default();
    (body.accuracy, body.newton_tolerance, body.newton_iterations, body.sweeps) = (None, None, None, None);
    (body.substep, body.safety, body.unchecked) = (None, None, false);
    (body.substeps, body.tolerance) = match setting.steps {
        Steps::Controlled(tolerance) => (None, Some(tolerance)),
        Steps::Fixed(parts) => (Some(parts), None),
        Steps::Divided(_) | Steps::Certified(_) | Steps::Own => (None, None),
    };
    if setting.method.integrator.is_implicit() {
        body.minimizer = setting.method.minimizer.kind();
        match setting.method.minimizer {
            Minimizer::Auto { accuracy } => body.accuracy = Some(accuracy),
            Minimizer::OneStep => {}
            Minimizer::Newton(newton) => {
                body.newton_tolerance = Some(newton.tolerance);
                body.newton_iterations = Some(newton.max_iterations);
            }
            Minimizer::VertexBlockDescent { sweeps } => body.sweeps = Some(sweeps),
        }
        if let Stop::Residual { tolerance, max_iterations } =
            setting.stop(body.solver.max_iterations.unwrap_or(0))
        {
            body.solver.fixed_iterations = None;
            (body.solver.tolerance, body.solver.max_iterations) = (Some(tolerance), Some(max_iterations));
        }
    }
}

/// Has snow stepped so, on its cells.
fn configure_snow(snow: &mut Snow, setting: &SnowSetting) {
    snow.kernel = setting.variant.kernel;
    let advection = snow.advection;
    (snow.transfer, snow.flip, snow.flip_time, snow.advection) = match setting.variant.transfer {
        Transfer::PicFlip(Blend::PerStep(share)) => (TransferName::PicFlip, Some(share), None, advection),
        Transfer::PicFlip(Blend::TimeConstant(time)) => (TransferName::PicFlip, None, Some(time), advection),
        Transfer::Apic => (TransferName::Apic, None, None, None),
        Transfer::Mls => (TransferName::Mls, None, None, None),
    };
    if let SnowSteps::Share(share) = setting.steps {
        (snow.safety, snow.substep, snow.unchecked) = (Some(share), None, false);
    }
}
