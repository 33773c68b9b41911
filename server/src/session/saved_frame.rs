//! A saved frame at which a session begins, instead of at the start of its scene.
//!
//! Enters: what a request says of the frame. Leaves: a simulation that stands there, and by what its later frames may differ from
//! those of the run that was saved; or why none can stand there.

use nappe_proto::v1;
use nappe_sim::world::{BeginError, Beginning, CarriedError, Missing, Simulation, Vectors};

use crate::error::ServiceError;

/// Steps before a frame, at most: with more, times would no longer be exact.
const MOST_STEPS: u64 = 1 << 53;
/// By what share of itself the time of a frame may differ from that of its step.
const SAME_TIME: f64 = 1e-9;
/// What becomes of a run that lacks something of the one that was saved.
const MAY_DIFFER: &str = "later frames may differ from those of a run that was not cut";

/// A frame to begin at.
#[derive(Clone, Debug)]
pub(crate) struct SavedFrame {
    at: Beginning,
    /// Its time (s), if that is to be compared.
    time_seconds: Option<f64>,
    missing: Vec<Missing>,
}

impl SavedFrame {
    /// The frame that a request names, of which an upload has the positions (m) and the velocities (m/s).
    ///
    /// # Errors
    /// A field that is out of range, or an upload without velocities.
    pub(crate) fn of(asked: &v1::Begin, [positions, velocities]: [Vectors; 2]) -> Result<Self, ServiceError> {
        let v1::Begin { step, time_seconds, carried, .. } = asked;
        if *step > MOST_STEPS {
            let problem = format!("is {step}: allowed are at most {MOST_STEPS}");
            let refused = ServiceError::field("begin.step", problem);
            return Err(refused.with("value", step).with("allowed", MOST_STEPS));
        }
        if velocities.is_empty() {
            let problem = "has no velocities: those of the frame are needed";
            return Err(ServiceError::field("begin.upload_id", problem));
        }
        let mut missing = Vec::new();
        for name in carried.iter().flat_map(|carried| &carried.missing) {
            let known = Missing::ALL.into_iter().find(|known| known.name() == name);
            missing.push(known.ok_or_else(|| {
                let known = Missing::ALL.map(Missing::name).join(", ");
                ServiceError::field("begin.carried.missing", format!("has '{name}'; there are: {known}"))
            })?);
        }
        let numbers = carried.as_ref().map(|carried| carried.numbers.clone());
        let at = Beginning { step: *step, positions, velocities, numbers };
        Ok(Self { at, time_seconds: *time_seconds, missing })
    }

    /// Puts a simulation there that is built, and of which the changes before the first step were applied; it is to end after so
    /// many steps (0: never). The strings say by what later frames may differ. Runs on the rayon pool that the caller installed.
    ///
    /// # Errors
    /// What of the frame does not fit the simulation: that is not to be stepped then.
    pub(super) fn put(
        &self,
        simulation: &mut Simulation,
        step_limit: u64,
    ) -> Result<Vec<String>, ServiceError> {
        let (step, dt) = (self.at.step, simulation.dt());
        if step_limit > 0 && step >= step_limit {
            let problem = format!("is {step}, and the session ends after {step_limit} steps");
            let refused = ServiceError::field("begin.step", problem);
            return Err(refused.with("value", step).with("step_limit", step_limit));
        }
        let time = step as f64 * dt;
        let off = self.time_seconds.map_or(0.0, |told| (told - time).abs());
        if let Some(told) = self.time_seconds
            && (off > SAME_TIME * time || off.is_nan())
        {
            let problem =
                format!("is {told}, and step {step} of the scene, whose dt is {dt} s, is at {time} s");
            return Err(ServiceError::field("begin.time_seconds", problem).with("value", told));
        }
        if self.missing.contains(&Missing::Calls) {
            let problem = "has 'calls': gravity, wind, parameters, forces, pulls or ways of colliders were others than those of the scene, \
                           since calls had changed them, and no frame holds them";
            return Err(ServiceError::field("begin.carried.missing", problem));
        }
        simulation.begin(&self.at).map_err(|error| refused(&error))?;
        Ok(self.warnings())
    }

    /// By what later frames may differ.
    fn warnings(&self) -> Vec<String> {
        if self.at.numbers.is_none() && self.at.step > 0 {
            let said = "the frame does not say what steps depend on beside positions and velocities";
            return vec![format!("{said}: {MAY_DIFFER}")];
        }
        self.missing.iter().map(|missing| format!("{}: {MAY_DIFFER}", lacks(*missing))).collect()
    }
}

/// What a frame does not hold, as a sentence begins.
fn lacks(missing: Missing) -> &'static str {
    match missing {
        Missing::Calls => "the frame does not hold what calls had changed",
        Missing::Past => "the frame does not hold the step before, which bdf2 and implicit_midpoint know of",
        Missing::WarmStart => {
            "the frame does not hold the change of velocity of the step before, from which solves begin (warm_start)"
        }
        Missing::Patches => "the frame does not hold what the preconditioner patches was set up for",
        Missing::Pins => "the frame does not hold how far so many pins are within a sub-step",
        Missing::Rest => "the frame does not hold how still cloth lies, and what of it sleeps",
    }
}

fn refused(error: &BeginError) -> ServiceError {
    let field = match error {
        BeginError::Snow { .. } => "begin",
        BeginError::Count { .. } | BeginError::Change(_) => "begin.upload_id",
        BeginError::Carried(CarriedError::Numbers) => "begin.carried.numbers",
        BeginError::Carried(CarriedError::Pins { .. }) => "begin.carried",
    };
    let refused = ServiceError::field(field, error.to_string());
    match error {
        BeginError::Count { found, needed, .. } => refused.with("value", found).with("needed", needed),
        _ => refused,
    }
}
