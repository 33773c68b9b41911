//! How numbers of a state are stored.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::names::names;

/// How positions and velocities are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Precision {
    /// IEEE 754 binary32, 24 bits of significand.
    F32,
    /// IEEE 754 binary64, 53 bits of significand.
    F64,
}

names!(Precision { F32: "f32", F64: "f64" });

impl Precision {
    /// The precision of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|precision| precision.name() == name)
    }
}

impl fmt::Display for Precision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
