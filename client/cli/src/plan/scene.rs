//! A scene with the method, the steps and the precision of a plan.

use nappe_scene::Scene;
use nappe_sim::{
    cloth::{Minimizer, MinimizerKind},
    linalg::Stop,
};
use nappe_study::{Plan, Setting, Stepped, Steps};

/// The text of the scene as a plan has it, all else as it was but comments; none where the plan recommends nothing for cloth.
pub(super) fn planned(scene: &Scene, name: &str, plan: &Plan) -> Option<String> {
    let Stepped::Cloth(setting) = plan.row.as_ref()?.stepped else { return None };
    let mut scene = scene.clone();
    scene.precision = setting.precision;
    scene.bodies.iter_mut().for_each(|body| configure(body, &setting));
    let said = format!(
        "# Method, steps and precision by `nappe plan {name}`, good to {:e} m until {:.4} s.\n",
        plan.chart.tolerance,
        plan.chart.until()
    );
    Some(said + &scene.to_toml())
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
