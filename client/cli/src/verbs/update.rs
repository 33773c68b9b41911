//! `nappe update`: changes gravity, wind, air, springs, pins, forces, pulls or colliders of a session, all at the same step.

use clap::Args;
use nappe_client::v1;
use nappe_server::numbers::{Least, NEWTON_SECONDS_PER_METRE, SECONDS, real, whole};
use serde_json::json;

use crate::{
    options::{
        args::SessionArgs,
        collider_args::ColliderArgs,
        components::{number, vector},
        particles::{self, Named, Particle},
        pull_args::PullArgs,
    },
    outside::remote,
    words::{
        error::{CliError, Result},
        output::{self, Format},
    },
};

/// How fast a pin goes that no time is given for (m/s).
const PIN_SPEED: f64 = 1.0;

/// Change gravity, wind, air, springs, pins, forces, pulls or colliders
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe update first --gravity 0,-1.62,0          the Moon
  nappe update first --wind 3,0,0 --at-step 500   wind before step 500
  nappe update first --stiffness bend=5           springs against folding only
  nappe update first --pin 0=0,1,0.5:2            pinned particle 0 goes there within 2 s; without :2, at 1 m/s
  nappe update first --pin top_left=0,1,0         names of grids and chains; of several bodies flag:top_left
  nappe update first --force sheet:12=0,0.5,0     a force on a particle, until the next one
  nappe update first --force sheet:all=0,0,0      none on any
  nappe update first --pull sheet:12=0,1,0 --frequency 20 --most 30 --for 0.5   a particle is drawn to a point
  nappe update first --collider lid --to 0,1,0 --in 2           a collider goes there within 2 s
  nappe update first --collider lid --turn 0,0.6,0,0.8 --in 2   it turns: x, y, z, w of length 1")]
pub(crate) struct UpdateArgs {
    #[command(flatten)]
    session: SessionArgs,
    /// Change before the step with this index, counted from 0 [default: the next step]
    #[arg(long, value_name = "STEP", default_value_t = 0, hide_default_value = true, value_parser = whole::<u64>(0..))]
    at_step: u64,
    /// Answer only when the change takes effect
    #[arg(long)]
    wait: bool,
    /// Gravity, (0, -9.81, 0) on the Earth (m/s^2)
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    gravity: Option<v1::Vector3>,
    /// Velocity of the medium (m/s)
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    wind: Option<v1::Vector3>,
    /// Linear drag of the medium on every particle (N s/m)
    #[arg(long, value_name = "VALUE", value_parser = real(NEWTON_SECONDS_PER_METRE, Least::From0))]
    drag: Option<f64>,
    /// Stiffness of springs (N/m), of all kinds or of stretch, shear or bend
    #[arg(long, value_name = "[KIND=]VALUE", value_parser = spring_value)]
    stiffness: Vec<SpringValue>,
    /// Damping of springs (N s/m), of all kinds or of stretch, shear or bend
    #[arg(long, value_name = "[KIND=]VALUE", value_parser = spring_value)]
    damping: Vec<SpringValue>,
    /// Body whose springs or air change [default: all]
    #[arg(long, value_name = "NAME")]
    body: Option<String>,
    /// Move a pinned particle to a position (m) within SECONDS of simulated time [default: as long as it takes at 1 m/s from
    /// where the newest frame has it]; a number counts over all bodies, and with BODY: within that one
    #[arg(long, value_name = "[BODY:]PARTICLE=X,Y,Z[:SECONDS]", value_parser = pin)]
    pin: Vec<Pin>,
    /// Force (N) on a particle of a body, by its number there or its name, or on all of them, from then on
    #[arg(long, value_name = "BODY:PARTICLE=X,Y,Z", value_parser = force)]
    force: Vec<Force>,
    /// Density (kg/m^3) or a coefficient of the air: density, normal, lift or tangential
    #[arg(long, value_name = "NAME=VALUE", value_parser = air_value)]
    air: Vec<(String, f64)>,
    #[command(flatten)]
    pull: PullArgs,
    #[command(flatten)]
    collider: ColliderArgs,
}

/// A stiffness (N/m) or a damping (N s/m) for the springs of a kind.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SpringValue {
    kind: v1::SpringKind,
    value: f64,
}

/// Where a pinned particle goes.
#[derive(Clone, Debug, PartialEq)]
struct Pin {
    /// Body whose particles are counted; none: all are.
    body: Option<String>,
    particle: Particle,
    target: v1::Vector3,
    /// None: as long as it takes at [`PIN_SPEED`].
    duration_seconds: Option<f64>,
}

/// A force on particles of a body.
#[derive(Clone, Debug, PartialEq)]
struct Force {
    body: String,
    /// None: all of them.
    particle: Option<Particle>,
    vector: v1::Vector3,
}

impl Pin {
    /// The change, of which the session may have to say which particle it is.
    async fn update(&self, session: &mut Named<'_>) -> Result<v1::PinUpdate> {
        let Self { body, particle, target, duration_seconds } = self.clone();
        let particle = match (body, particle) {
            (None, Particle::Number(number)) => number,
            (body, particle) => {
                let body = particles::body(session.topology().await?, body.as_deref(), &particle)?;
                match particle.on(body)?.as_slice() {
                    [one] => body.first_particle as u32 + one,
                    several => {
                        return Err(CliError::usage(format!(
                            "--pin {particle}: sends {} particles to one point; name one of them",
                            several.len()
                        )));
                    }
                }
            }
        };
        let duration_seconds = match duration_seconds {
            Some(seconds) => seconds,
            None => session.distance(particle, target).await? / PIN_SPEED,
        };
        Ok(v1::PinUpdate { particle, target: Some(target), duration_seconds })
    }

    /// What is said of it once it is on its way, for that time (s).
    fn told(&self, seconds: f64) -> String {
        let body = self.body.as_ref().map(|body| format!("{body}:")).unwrap_or_default();
        let time = if seconds > 0.0 { format!("{seconds:.3} s") } else { "one step".to_owned() };
        format!("pin {body}{} gets there in {time}", self.particle)
    }
}

impl Force {
    /// The change, of which the session may have to say which particles are meant.
    async fn update(&self, session: &mut Named<'_>) -> Result<v1::ForceUpdate> {
        let Self { body, particle, vector } = self.clone();
        let on = match &particle {
            None => Vec::new(),
            Some(Particle::Number(number)) => vec![*number],
            Some(name) => name.on(particles::body(session.topology().await?, Some(&body), name)?)?,
        };
        let particles_u32: Vec<u8> = on.into_iter().flat_map(u32::to_le_bytes).collect();
        let particles_u32 = particles_u32.into();
        Ok(v1::ForceUpdate { body, particles_u32, force: Some(vector), ..v1::ForceUpdate::default() })
    }
}

/// Runs `nappe update`.
///
/// # Errors
/// When nothing is to be changed, a change is refused, or there is no such session or no server.
pub(crate) fn run(args: &UpdateArgs) -> Result<()> {
    let mut request = request(args)?;
    let SessionArgs { id, server, output } = &args.session;
    remote::block_on(async {
        let client = remote::connect(server).await?;
        let mut session = Named::new(&client, id);
        for pin in &args.pin {
            request.pins.push(pin.update(&mut session).await?);
        }
        for force in &args.force {
            request.forces.push(force.update(&mut session).await?);
        }
        request.pulls = args.pull.updates(&mut session).await?;
        let pins = request.pins.clone();
        let accepted = Box::pin(remote::answer(id, client.update(request))).await?;
        let v1::UpdateParametersResponse { effective_step, order } = accepted;
        match output.format() {
            Format::Json => {
                let pins: Vec<_> = pins
                    .iter()
                    .map(|pin| json!({ "particle": pin.particle, "seconds": pin.duration_seconds }))
                    .collect();
                output::json(&json!({
                    "session_id": id, "effective_step": effective_step, "order": order, "pins": pins,
                }))
            }
            Format::Text => {
                let told = args.pin.iter().zip(&pins).map(|(pin, sent)| pin.told(sent.duration_seconds));
                let first = format!("{id}: change {order} takes effect before step {effective_step}");
                let lines: Vec<String> = std::iter::once(first).chain(told).collect();
                output::line(&lines.join("; "))
            }
        }
    })
}

/// What is asked for, but for pins, forces and pulls.
fn request(args: &UpdateArgs) -> Result<v1::UpdateParametersRequest> {
    let springs: Vec<_> = args
        .stiffness
        .iter()
        .map(|&SpringValue { kind, value }| spring(args, kind, Some(value), None))
        .chain(args.damping.iter().map(|&SpringValue { kind, value }| spring(args, kind, None, Some(value))))
        .collect();

    if args.body.is_some() && springs.is_empty() && args.air.is_empty() {
        let words = "--body says whose springs or air change: it needs --stiffness, --damping or --air";
        return Err(CliError::usage(words));
    }

    let collider = args.collider.update()?;
    let nothing = args.gravity.is_none()
        && args.wind.is_none()
        && args.drag.is_none()
        && springs.is_empty()
        && args.air.is_empty()
        && args.force.is_empty()
        && args.pull.is_empty()
        && args.pin.is_empty()
        && collider.is_none();
    if nothing {
        return Err(CliError::usage("nothing to change").hint(
            "give one or more of --gravity, --wind, --drag, --air, --stiffness, --damping, --pin, --force, --pull, --collider",
        ));
    }

    Ok(v1::UpdateParametersRequest {
        at_step: args.at_step,
        gravity: args.gravity,
        wind: args.wind,
        springs,
        drag: args.drag,
        air: air(args),
        colliders: collider.into_iter().collect(),
        wait: args.wait,
        ..v1::UpdateParametersRequest::of(&args.session.id)
    })
}

/// The new numbers of the air, as one change.
fn air(args: &UpdateArgs) -> Vec<v1::AirUpdate> {
    if args.air.is_empty() {
        return Vec::new();
    }
    let body = args.body.clone().unwrap_or_default();
    let mut update = v1::AirUpdate { body, ..v1::AirUpdate::default() };
    for (name, value) in &args.air {
        let number = match name.as_str() {
            "density" => &mut update.density,
            "normal" => &mut update.normal,
            "lift" => &mut update.lift,
            _ => &mut update.tangential,
        };
        *number = Some(*value);
    }
    vec![update]
}

fn spring(
    args: &UpdateArgs,
    kind: v1::SpringKind,
    stiffness: Option<f64>,
    damping: Option<f64>,
) -> v1::SpringUpdate {
    v1::SpringUpdate { body: args.body.clone().unwrap_or_default(), kind: kind.into(), stiffness, damping }
}

fn spring_value(text: &str) -> std::result::Result<SpringValue, String> {
    let (kind, value) = match text.split_once('=') {
        None => (v1::SpringKind::Unspecified, text),
        Some(("stretch", value)) => (v1::SpringKind::Stretch, value),
        Some(("shear", value)) => (v1::SpringKind::Shear, value),
        Some(("bend", value)) => (v1::SpringKind::Bend, value),
        Some((kind, _)) => return Err(format!("'{kind}' is not a kind of spring: stretch, shear, bend")),
    };
    Ok(SpringValue { kind, value: number(value)? })
}

fn pin(text: &str) -> std::result::Result<Pin, String> {
    let (particle, position) =
        text.split_once('=').ok_or("a pin is PARTICLE=X,Y,Z or PARTICLE=X,Y,Z:SECONDS")?;
    let (body, particle) = match particle.rsplit_once(':') {
        None => (None, particle),
        Some((body, particle)) => (Some(body.to_owned()), particle),
    };
    let particle = Particle::parse(particle)?;
    let (target, duration_seconds) = match position.split_once(':') {
        None => (vector(position)?, None),
        Some((target, seconds)) => (vector(target)?, Some(real(SECONDS, Least::From0)(seconds)?)),
    };
    Ok(Pin { body, particle, target, duration_seconds })
}

fn air_value(text: &str) -> std::result::Result<(String, f64), String> {
    match text.split_once('=') {
        Some((name @ ("density" | "normal" | "lift" | "tangential"), value)) => {
            Ok((name.to_owned(), number(value)?))
        }
        _ => Err(format!("'{text}' is not NAME=VALUE with density, normal, lift or tangential")),
    }
}

fn force(text: &str) -> std::result::Result<Force, String> {
    let parts = text.rsplit_once('=').and_then(|(on, force)| Some((on.rsplit_once(':')?, force)));
    let ((body, particle), force) = parts.ok_or("a force is BODY:PARTICLE=X,Y,Z or BODY:all=X,Y,Z")?;
    let particle = match particle {
        "all" => None,
        particle => Some(Particle::parse(particle).map_err(|error| format!("neither all nor one: {error}"))?),
    };
    Ok(Force { body: body.to_owned(), particle, vector: vector(force)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pin_has_a_particle_a_position_and_perhaps_a_duration() {
        let target = v1::Vector3 { x: 0.5, y: -1.0, z: 2.0 };
        let seven = Pin { body: None, particle: Particle::Number(7), target, duration_seconds: None };
        assert_eq!(pin("7=0.5,-1,2"), Ok(seven.clone()));
        assert_eq!(pin("7=0.5,-1,2:1.5"), Ok(Pin { duration_seconds: Some(1.5), ..seven.clone() }));
        assert_eq!(pin("7=0.5,-1,2:0"), Ok(Pin { duration_seconds: Some(0.0), ..seven.clone() }));
        assert_eq!(pin("a:7=0.5,-1,2"), Ok(Pin { body: Some("a".to_owned()), ..seven.clone() }));
        let left = Particle::Name("left".to_owned());
        assert_eq!(pin("left=0.5,-1,2"), Ok(Pin { particle: left, ..seven }));
        for wrong in
            ["7", "x=0,0,0", "-1=0,0,0", "7=0,0", "7=0,0,nan", "7=0,0,0:x", "7=0,0,0:-1", "lft=0,0,0"]
        {
            assert!(pin(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_force_names_a_body_and_one_of_its_particles_or_all() {
        let one = force("a:b:7=0,-1,2").expect("a force");
        assert_eq!((one.body.as_str(), one.particle), ("a:b", Some(Particle::Number(7))));
        assert_eq!(one.vector, v1::Vector3 { x: 0.0, y: -1.0, z: 2.0 });
        assert_eq!(force("sheet:all=1,2,3").expect("a force").particle, None);
        for wrong in ["sheet=1,2,3", "sheet:1", "sheet:x=1,2,3", "sheet:1=1,2", "sheet:-1=0,0,0"] {
            assert!(force(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_value_of_springs_names_a_kind_or_means_all() {
        assert_eq!(spring_value("12.5"), Ok(SpringValue { kind: v1::SpringKind::Unspecified, value: 12.5 }));
        assert_eq!(spring_value("bend=3"), Ok(SpringValue { kind: v1::SpringKind::Bend, value: 3.0 }));
        assert!(spring_value("twist=3").is_err_and(|message| message.contains("stretch, shear, bend")));
    }
}
