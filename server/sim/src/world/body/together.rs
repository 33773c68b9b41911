//! Which bodies are stepped as one cloth: those with a thickness, which meet each other.

use crate::{
    cloth::{
        Air, ClothSettings, Joined, Minimizer, Network, NewtonSettings, RestSettings, StateLimits,
        SurfaceSettings,
    },
    linalg::{SolverSettings, Stop},
    surface::Crossing,
    time_step::TimeStep,
    world::setup::{BodySetup, SetupError},
};

/// When surfaces that are refused with a setup meet.
const AT_START: &str = "at the start";

/// A body of a cloth, and its first particle among all.
pub(crate) type Member<'a> = (&'a BodySetup, u32);

/// The cloths of a world, in the order of the first body of each.
///
/// # Errors
/// The first body that cannot be stepped with another one, and why.
pub(crate) fn groups(bodies: &[BodySetup]) -> Result<Vec<Vec<Member<'_>>>, SetupError> {
    let mut groups: Vec<Vec<Member<'_>>> = Vec::new();
    let (mut thick, mut first_particle) = (None::<usize>, 0);
    for body in bodies {
        let is_thick = body.network.thickness > 0.0;
        if let Some(place) = thick.filter(|_| is_thick) {
            check_alike(groups[place][0].0, body)?;
            groups[place].push((body, first_particle));
        } else {
            if is_thick {
                thick = Some(groups.len());
            }
            groups.push(vec![(body, first_particle)]);
        }
        first_particle += body.network.x.len() as u32;
    }
    Ok(groups)
}

/// Refuses a body that has a thickness as another one has, if they are to be stepped in different ways.
fn check_alike(one: &BodySetup, body: &BodySetup) -> Result<(), SetupError> {
    let mut common = shared(one).into_iter().zip(shared(body));
    let Some(((what, there), (_, here))) = common.find(|((_, there), (_, here))| there != here) else {
        return Ok(());
    };
    let other = &one.name;
    let message = format!(
        "it has a thickness, as body '{other}' has, and its {what} is {here}, while that of '{other}' is {there}: bodies with a \
         thickness meet each other, are stepped together, and need the same"
    );
    Err(SetupError::Body { body: body.name.clone(), message })
}

/// What bodies that are stepped together have in common: what it is called, and how each body has it.
fn shared(body: &BodySetup) -> [(&'static str, String); 19] {
    let Network { drag, air, .. } = &body.network;
    let ClothSettings {
        integrator,
        minimizer,
        hessian,
        solver: SolverSettings { stop, preconditioner, operator, warm_start, at_cap: _, floor: _ },
        time_step,
        tolerance,
        on_pass,
        contact: SurfaceSettings { friction, recovery, surface },
        limits: StateLimits { max_stretch, max_energy },
        rest,
        block_size,
    } = &body.settings;
    [
        ("drag", format!("{drag} N s/m")),
        ("air", air.map_or_else(|| "none".to_owned(), of_air)),
        ("integrator", integrator.name().to_owned()),
        ("minimizer", of_minimizer(*minimizer)),
        ("hessian", hessian.name().to_owned()),
        ("stop of the solver", of_stop(*stop)),
        ("preconditioner", preconditioner.name().to_owned()),
        ("operator", operator.name().to_owned()),
        ("warm_start", warm_start.to_string()),
        ("time step", of_time_step(*time_step)),
        ("tolerance", or_none(*tolerance, " m")),
        ("on_pass", on_pass.name().to_owned()),
        ("friction of cloth on cloth", friction.to_string()),
        ("recovery of the thickness", format!("{recovery} m/s")),
        ("check of the surface", surface.name().to_owned()),
        ("limit of the stretch", or_none(*max_stretch, "")),
        ("limit of the energy", or_none(*max_energy, " J")),
        ("rest", rest.map_or_else(|| "none".to_owned(), of_rest)),
        ("block_size", block_size.to_string()),
    ]
}

/// A number with its unit, where there is one.
fn or_none(number: Option<f64>, unit: &str) -> String {
    number.map_or_else(|| "none".to_owned(), |number| format!("{number}{unit}"))
}

fn of_air(air: Air) -> String {
    let Air { density, normal, lift, tangential } = air;
    format!(
        "{density} kg/m³ with coefficients {normal} (normal), {lift} (lift) and {tangential} (tangential)"
    )
}

fn of_minimizer(minimizer: Minimizer) -> String {
    match minimizer {
        // Of cloth with a thickness both are the same.
        Minimizer::Auto { .. } | Minimizer::OneStep => Minimizer::OneStep.kind().name().to_owned(),
        Minimizer::Newton(NewtonSettings { tolerance, max_iterations }) => {
            format!("{} to {tolerance} m/s² in {max_iterations} solves at most", minimizer.kind().name())
        }
        Minimizer::VertexBlockDescent { sweeps } => format!("{} in {sweeps} sweeps", minimizer.kind().name()),
    }
}

fn of_rest(RestSettings { error, within, sleep }: RestSettings) -> String {
    let does = if sleep { "sleeps" } else { "is watched" };
    format!("what is calm {does}, with {error} m within {within} s")
}

fn of_stop(stop: Stop) -> String {
    match stop {
        Stop::Residual { tolerance, max_iterations } => {
            format!("a residual of {tolerance} or {max_iterations} iterations")
        }
        Stop::Iterations(count) => format!("{count} iterations"),
    }
}

fn of_time_step(time_step: TimeStep) -> String {
    match time_step {
        TimeStep::Certified { safety } => format!("{safety} of what is certified"),
        TimeStep::Fixed(length) => format!("{length} s"),
        TimeStep::Unchecked(length) => format!("{length} s, unchecked"),
    }
}

/// Refuses surfaces with a thickness that cross or touch themselves or each other at the start.
pub(crate) fn check_apart(group: &[Member<'_>], joined: &Joined<'_>) -> Result<(), SetupError> {
    if joined.whole.thickness == 0.0 {
        return Ok(());
    }
    let Some(Crossing { edge, triangle }) = joined.first_crossing() else {
        return joined.touching().map_or(Ok(()), |touching| Err(touched(group, joined, touching)));
    };
    let [one, other] = [edge[0], triangle[0]].map(|particle| joined.part_of(particle));
    let edge = edge.map(|particle| particle - joined.particles(one).start);
    let triangle = triangle.map(|particle| particle - joined.particles(other).start);
    let [one, other] = [one, other].map(|part| &group[part].0.name);
    let message = crossing([one, other], &Crossing { edge, triangle }, AT_START);
    Err(SetupError::Body { body: one.clone(), message })
}

/// That parts touch that have these particles.
fn touched(group: &[Member<'_>], joined: &Joined<'_>, particles: [u32; 2]) -> SetupError {
    let parts = particles.map(|particle| joined.part_of(particle));
    let own = [0, 1].map(|i| particles[i] - joined.particles(parts[i]).start);
    let [one, other] = parts.map(|part| &group[part].0.name);
    let touch = touch([one, other], own, AT_START);
    let message = format!("{touch} (leave a gap, or join points in one place by weld = 1e-6)");
    SetupError::Body { body: one.clone(), message }
}

/// What a sentence says of a surface that crosses that of another body, or its own, `when`: the edge is of the first body, the
/// triangle of the second, each with the numbers of its body. It is the first pair that was found: nobody counted the others.
pub(crate) fn crossing([one, other]: [&str; 2], first: &Crossing, when: &str) -> String {
    let Crossing { edge: [p, q], triangle: [a, b, c] } = first;
    let (whose, there) = if one == other {
        ("itself".to_owned(), "")
    } else {
        (format!("that of body '{other}', which has one too,"), " there")
    };
    format!(
        "it has a thickness, and its surface crosses {whose} {when}: its edge of particles {p} and {q} crosses the triangle of \
         {a}, {b} and {c}{there} (at least 1 pair of an edge and a triangle crosses)"
    )
}

/// What a sentence says of a surface that touches that of another body, or itself, `when`: at a particle of each.
pub(crate) fn touch([one, other]: [&str; 2], [p, q]: [u32; 2], when: &str) -> String {
    let whose = if one == other { "itself".to_owned() } else { format!("that of body '{other}'") };
    format!(
        "it has a thickness, and its surface touches {whose} {when}, at particles {p} and {q} there: what touches has no side \
         to be kept on"
    )
}
