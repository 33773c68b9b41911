//! What a frame can hold besides positions: arrays over the particles, nodes of the snow's grid.
//!
//! Enters: the caller's choices, perhaps as text. Leaves: their part of a request. Whether a session has snow says
//! which of them hold anything.

use std::{fmt, str::FromStr};

use nappe_proto::v1;

/// Whether a session holds snow.
pub fn holds_snow(session: &v1::Session) -> bool {
    session.snow_particle_count > 0
}

/// An array over the particles that frames hold on demand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Field {
    /// Velocities (m/s).
    Velocities,
    /// Plastic ratios J_P of snow; 1 for particles of cloth.
    PlasticRatios,
    /// Frobenius norms of the Cauchy stress of snow (Pa); 0 for particles of cloth.
    StressNorms,
    /// What acts on each particle at the state that the frame shows (N), contacts left out; of a pin what it holds.
    Forces,
    /// The same over the mass of each particle (m/s²); 0 for pins.
    Accelerations,
}

impl Field {
    /// Every field, in the order of [`Fields`].
    pub const ALL: [Self; 5] =
        [Self::Velocities, Self::PlasticRatios, Self::StressNorms, Self::Forces, Self::Accelerations];

    /// Its name, for messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Velocities => "velocities",
            Self::PlasticRatios => "plastic ratios",
            Self::StressNorms => "stress norms",
            Self::Forces => "forces",
            Self::Accelerations => "accelerations",
        }
    }

    /// Its name on a command line.
    pub const fn option(self) -> &'static str {
        match self {
            Self::Velocities => "velocity",
            Self::PlasticRatios => "plastic_ratio",
            Self::StressNorms => "stress",
            Self::Forces => "force",
            Self::Accelerations => "acceleration",
        }
    }

    const fn wire(self) -> v1::Field {
        match self {
            Self::Velocities => v1::Field::Velocities,
            Self::PlasticRatios => v1::Field::PlasticRatio,
            Self::StressNorms => v1::Field::StressNorm,
            Self::Forces => v1::Field::Forces,
            Self::Accelerations => v1::Field::Accelerations,
        }
    }
}

/// A name that no array has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "no array of a frame is called '{0}': there are velocity, plastic_ratio, stress, force and acceleration"
)]
pub struct ParseFieldError(String);

impl FromStr for Field {
    type Err = ParseFieldError;

    /// The array of a name on a command line, [`Field::option`].
    fn from_str(name: &str) -> Result<Self, ParseFieldError> {
        let named = Self::ALL.into_iter().find(|field| field.option() == name);
        named.ok_or_else(|| ParseFieldError(name.to_owned()))
    }
}

/// Arrays in each frame: positions always, and those that were added.
///
/// ```
/// use nappe_client::{Field, Fields};
///
/// let fields: Fields = [Field::Velocities, Field::PlasticRatios].into_iter().collect();
/// assert!(fields.contains(Field::Velocities) && !fields.contains(Field::StressNorms));
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Fields {
    /// In the order of [`Field::ALL`].
    added: [bool; Field::ALL.len()],
}

impl Fields {
    /// No array besides positions.
    pub fn positions() -> Self {
        Self::default()
    }

    /// Positions and every other array.
    pub fn all() -> Self {
        Field::ALL.into_iter().collect()
    }

    /// These arrays and one more.
    #[must_use]
    pub fn with(mut self, field: Field) -> Self {
        self.added[field as usize] = true;
        self
    }

    /// Whether frames hold this array.
    pub fn contains(self, field: Field) -> bool {
        self.added[field as usize]
    }

    /// Their numbers on the wire.
    pub(crate) fn request(self) -> Vec<i32> {
        let added = Field::ALL.into_iter().filter(|&field| self.contains(field)).map(Field::wire);
        std::iter::once(v1::Field::Positions).chain(added).map(i32::from).collect()
    }
}

impl FromIterator<Field> for Fields {
    fn from_iter<I: IntoIterator<Item = Field>>(fields: I) -> Self {
        fields.into_iter().fold(Self::positions(), Self::with)
    }
}

/// Which nodes of the snow's grid a frame holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridOptions {
    /// Nodes that are sent.
    pub selection: GridSelection,
    /// Most nodes per frame; 0: as many as the server allows. Of more, the server sends every second, third ... node
    /// along each axis.
    pub max_nodes: u32,
    /// Whether the forces on nodes come with them.
    pub force: bool,
}

/// Nodes of the snow's grid. Nodes without mass are never sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GridSelection {
    /// All: the mass field.
    All,
    /// The plane of nodes nearest to a plane across an axis.
    Slice {
        /// Axis that the plane crosses.
        axis: Axis,
        /// Coordinate along it (m).
        coordinate: f64,
    },
}

/// An axis of the world: right-handed, y up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say everything")]
pub enum Axis {
    X,
    Y,
    Z,
}

impl GridOptions {
    /// All nodes, as many as the server allows.
    pub const fn all() -> Self {
        Self { selection: GridSelection::All, max_nodes: 0, force: false }
    }

    /// The plane of nodes nearest to `coordinate` (m) along `axis`.
    pub const fn slice(axis: Axis, coordinate: f64) -> Self {
        Self { selection: GridSelection::Slice { axis, coordinate }, max_nodes: 0, force: false }
    }

    /// Their part of a request for frames.
    pub(crate) fn request(self) -> v1::GridRequest {
        use v1::grid_request::Selection;
        let selection = match self.selection {
            GridSelection::All => Selection::All(v1::AllNodes {}),
            GridSelection::Slice { axis, coordinate } => {
                let axis = match axis {
                    Axis::X => v1::Axis::X,
                    Axis::Y => v1::Axis::Y,
                    Axis::Z => v1::Axis::Z,
                };
                Selection::Slice(v1::SliceNodes { axis: axis.into(), coordinate })
            }
        };
        v1::GridRequest { selection: Some(selection), max_nodes: self.max_nodes, force: self.force }
    }
}

impl fmt::Display for GridOptions {
    /// The text of the selection, as [`GridOptions::from_str`] reads it; the most nodes are not in it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.selection {
            GridSelection::All => f.write_str("smoke"),
            GridSelection::Slice { axis, coordinate } => {
                let axis = match axis {
                    Axis::X => 'x',
                    Axis::Y => 'y',
                    Axis::Z => 'z',
                };
                write!(f, "slice:{axis}={coordinate}")
            }
        }
    }
}

/// A text that selects no nodes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "'{0}' selects no nodes: give 'smoke' for all, or 'slice:' with x, y or z, '=' and a coordinate in metres, for example slice:y=0.5"
)]
pub struct ParseGridError(String);

impl FromStr for GridOptions {
    type Err = ParseGridError;

    /// `smoke`: all nodes. `slice:y=0.5`: the plane of nodes nearest to y = 0.5 m.
    fn from_str(text: &str) -> Result<Self, ParseGridError> {
        let wrong = || ParseGridError(text.to_owned());
        if text == "smoke" {
            return Ok(Self::all());
        }

        let slice = text.strip_prefix("slice:").and_then(|rest| rest.split_once('='));
        let (axis, coordinate) = slice.ok_or_else(wrong)?;
        let axis = match axis {
            "x" => Axis::X,
            "y" => Axis::Y,
            "z" => Axis::Z,
            _ => return Err(wrong()),
        };

        let coordinate = coordinate.parse::<f64>().ok().filter(|metres| metres.is_finite());
        Ok(Self::slice(axis, coordinate.ok_or_else(wrong)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_is_smoke_or_a_slice() {
        assert_eq!("smoke".parse(), Ok(GridOptions::all()));
        assert_eq!("slice:y=-0.5".parse(), Ok(GridOptions::slice(Axis::Y, -0.5)));
        for text in ["smoke", "slice:x=0", "slice:y=-0.5", "slice:z=0.1"] {
            assert_eq!(text.parse().map(|grid: GridOptions| grid.to_string()), Ok(text.to_owned()));
        }
        for wrong in ["", "mass", "slice", "slice:w=1", "slice:x", "slice:x=", "slice:x=inf", "slice:x=1m"] {
            let message = wrong.parse::<GridOptions>().expect_err("wrong").to_string();
            assert!(message.contains(wrong) && message.contains("slice:y=0.5"), "{message}");
        }
    }
}
