//! Which error a scene allows cloth that lies still, as a table of a scene.

use nappe_sim::cloth::RestSettings;
use serde::{Deserialize, Serialize};

use crate::{
    error::{ErrorKind, SceneError},
    location::Location,
};

/// What of cloth counts as calm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rest {
    /// Error (m) that leaving out what is calm may make.
    pub error: f64,
    /// Time (s) over which it may add up; none: as long as the scene lasts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within: Option<f64>,
    /// Whether what is calm sleeps; none: it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sleep: Option<bool>,
}

impl Rest {
    /// As the simulation takes it, in a scene that lasts so long (s); one that never ends has no such time.
    ///
    /// # Errors
    /// Where neither says over which time the error may add up.
    pub(crate) fn settings(self, lasts: Option<f64>, at: &Location<'_>) -> Result<RestSettings, SceneError> {
        let within = self.within.or(lasts).ok_or_else(|| {
            let message =
                "is missing: a scene without an end says over how many seconds the error may add up";
            at.key("within").error(ErrorKind::Missing, message)
        })?;
        Ok(RestSettings { error: self.error, within, sleep: self.sleep.unwrap_or(true) })
    }
}
