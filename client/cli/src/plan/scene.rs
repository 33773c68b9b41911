//! A scene with the method, the steps and the precision of a plan.

use nappe_scene::{Scene, Springs};
use nappe_sim::{
    cloth::{Minimizer, MinimizerKind, SpringKind},
    linalg::Stop,
    math::Precision,
};
use nappe_study::{Plan, Removal, Setting, Stepped, Steps, Term};

/// Whether what can go is left out of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Terms {
    /// All of them stay.
    Kept,
    /// Those that can go together are left out.
    LeftOut,
}

/// The text of the scene as a plan has it, all else as it was but comments; none where the plan recommends nothing for cloth.
pub(super) fn planned(scene: &Scene, name: &str, plan: &Plan, terms: Terms) -> Option<String> {
    let Stepped::Cloth(setting) = plan.row.as_ref()?.stepped else { return None };
    let mut scene = scene.clone();
    scene.precision = setting.precision;
    scene.bodies.iter_mut().for_each(|body| configure(body, &setting));
    let mut said = format!(
        "# Method, steps and precision by `nappe plan {name}`, good to {:e} m until {:.4} s.\n",
        plan.chart.tolerance,
        plan.chart.until()
    );
    let gone: Vec<&Term> =
        plan.terms.iter().filter(|term| term.is_left_out && terms == Terms::LeftOut).collect();
    if !gone.is_empty() {
        let names: Vec<&str> = gone.iter().map(|term| term.name.as_str()).collect();
        said = format!("{said}# Left out: {}.\n", names.join(", "));
        leave_out(&mut scene, &gone.iter().map(|term| term.removal).collect::<Vec<_>>());
    }
    Some(said + &scene.to_toml())
}

/// Leaves terms out of a scene, as the plan left them out of what is built from it.
fn leave_out(scene: &mut Scene, removals: &[Removal]) {
    for removal in removals {
        let springs = scene.bodies.iter_mut().filter_map(|body| body.springs.as_mut());
        match *removal {
            Removal::Springs(kind) => springs.for_each(|springs| match kind {
                SpringKind::Stretch => {}
                SpringKind::Shear => springs.shear = None,
                SpringKind::Bend => springs.bend = None,
            }),
            Removal::Damping(kind) => {
                let of_kind = |springs: &'_ mut Springs| match kind {
                    SpringKind::Stretch => springs.stretch.damping = 0.0,
                    SpringKind::Shear => springs.shear.iter_mut().for_each(|law| law.damping = 0.0),
                    SpringKind::Bend => springs.bend.iter_mut().for_each(|law| law.damping = 0.0),
                };
                springs.for_each(of_kind);
            }
            Removal::ElementDamping(body, kind) => {
                let laws = scene.bodies[body].laws.iter_mut();
                laws.filter(|law| law.name == kind).for_each(|law| law.damping = 0.0);
            }
            Removal::Drag => scene.bodies.iter_mut().for_each(|body| body.drag = 0.0),
            Removal::Wind => scene.wind = [0.0; 3],
            Removal::Friction(place) => scene.colliders[place].friction = 0.0,
            Removal::Restitution(place) => scene.colliders[place].restitution = 0.0,
            Removal::Digits => scene.precision = Precision::F32,
            Removal::Elements(..) | Removal::Collider(_) => {}
        }
    }
    // Places are those of the whole scene.
    for (place, body) in scene.bodies.iter_mut().enumerate() {
        body.laws.retain(|law| !removals.contains(&Removal::Elements(place, law.name)));
    }
    let mut places = 0..;
    scene
        .colliders
        .retain(|_| places.next().is_some_and(|place| !removals.contains(&Removal::Collider(place))));
}

/// Has a body stepped so.
fn configure(body: &mut nappe_scene::Body, setting: &Setting) {
    body.integrator = setting.method.integrator;
    body.hessian = setting.method.hessian;
    body.minimizer = MinimizerKind::default();
    (body.newton_tolerance, body.newton_iterations, body.sweeps) = (None, None, None);
    (body.substep, body.safety, body.unchecked) = (None, None, false);
    (body.substeps, body.tolerance) = match setting.steps {
        Steps::Controlled(tolerance) => (None, Some(tolerance)),
        Steps::Fixed(parts) => (Some(parts), None),
        Steps::Divided(_) | Steps::Certified(_) | Steps::Own => (None, None),
    };
    if setting.method.integrator.is_implicit() {
        body.minimizer = setting.method.minimizer.kind();
        match setting.method.minimizer {
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
