//! What a server tells ranks, and what rank 0 tells it.

use nappe_sim::{
    field::Field,
    math::Precision,
    report::{StepError, StepReport},
    world::{Change, TakenField, WorldSetup, WorldState},
};
use serde::{Deserialize, Serialize};

/// Version of the messages: both ends are of the same program.
pub const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), ", link 10");

/// What shows that a connection is the one that was expected.
pub type Token = [u8; 16];

/// The first message of a connection, from rank 0, after the token.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// [`VERSION`] of rank 0.
    pub version: String,
    /// The name of the host of each rank.
    pub hosts: Vec<String>,
    /// Threads of each rank.
    pub threads: u32,
}

/// What ranks are told, one after another: each but an interrupt is answered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Order {
    /// Build a simulation.
    Build(Box<WorldSetup>, Precision),
    /// Apply changes, all or none.
    Apply(Vec<Change>),
    /// Take a step.
    Step,
    /// Hand over what further steps depend on.
    Take,
    /// Go on from what further steps of a simulation of this setup depend on.
    Put(Box<WorldState>),
    /// Hand over a field.
    Look(Field),
    /// Give up the step in progress, and all that follow.
    Interrupt,
    /// Forget the simulation, and end the job.
    End,
}

/// What rank 0 answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Answer {
    /// A simulation, with warnings; or why there is none.
    Built(Result<Vec<String>, String>),
    /// Whether changes were applied, or why not; or that a state was taken over.
    Applied(Result<(), String>),
    /// A step, or why it was not taken.
    Stepped(Box<Stepped>),
    /// What further steps depend on.
    Taken(Box<WorldState>),
    /// What particles have of the field that was asked for.
    Looked(TakenField),
    /// The last message.
    Ended,
    /// A sign of life, which answers nothing.
    Alive {
        /// Whether rank 0 is in one call to the other ranks since the sign before.
        waits: bool,
    },
}

/// A step that ranks took together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stepped {
    /// What it reports; the same on every rank.
    pub result: Result<StepReport, StepError>,
    /// Seconds of rank 0 in each stage, in the order of [`nappe_sim::report::Stage::ALL`].
    pub seconds: Vec<f64>,
    /// What rank 0 asked of the others so far.
    pub asked: Asked,
}

/// What a rank asked of the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Asked {
    /// Short lists that all gathered.
    pub gathers: u64,
    /// Messages to neighbours.
    pub messages: u64,
    /// Bytes of these.
    pub bytes: u64,
}
