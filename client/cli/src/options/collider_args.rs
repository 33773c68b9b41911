//! A collider that `nappe update` sends somewhere, as options have it.

use clap::Args;
use nappe_client::v1;
use nappe_server::numbers::{Least, SECONDS, real};

use crate::{
    options::components::{turn, vector},
    words::error::{CliError, Result},
};

/// A collider, where it goes, how it is turned there, and when it arrives.
#[derive(Args, Debug)]
pub(crate) struct ColliderArgs {
    /// Move or turn a collider, by its name in the scene, from where it is: with --to, --turn or both
    #[arg(long, value_name = "NAME")]
    collider: Option<String>,
    /// Where the collider goes (m): its centre, the middle of its segment, or its point [default: it stays there]
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, requires = "collider")]
    to: Option<v1::Vector3>,
    /// How the collider is turned then since time 0, as a quaternion of length 1 [default: it keeps its turn]
    #[arg(long, value_name = "X,Y,Z,W", value_parser = turn, allow_hyphen_values = true, requires = "collider")]
    turn: Option<v1::Quaternion>,
    /// Simulated time that the collider takes [default: one step]
    #[arg(long = "in", value_name = "SECONDS", value_parser = real(SECONDS, Least::From0), requires = "collider")]
    within: Option<f64>,
}

impl ColliderArgs {
    /// Where a collider is sent, if one is named.
    ///
    /// # Errors
    /// If it is named, and neither moves nor turns.
    pub(crate) fn update(&self) -> Result<Option<v1::ColliderUpdate>> {
        let Self { collider, to, turn, within } = self;
        let Some(name) = collider.clone() else { return Ok(None) };
        if to.is_none() && turn.is_none() {
            return Err(CliError::usage(format!("--collider {name} needs --to, --turn or both")));
        }
        let duration_seconds = within.unwrap_or_default();
        Ok(Some(v1::ColliderUpdate { name, position: *to, turn: *turn, duration_seconds }))
    }
}
