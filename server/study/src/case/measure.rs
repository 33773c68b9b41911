//! What of a scene is compared: its motion, its end, or one number that can have a limit where the motion has none.

use thiserror::Error;

use super::times::{Times, TimesError};

/// What of a scene is compared, all of it as lengths (m).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Measure {
    /// Where all free particles are, as long as that can be predicted.
    #[default]
    Motion,
    /// Where all free particles are at the end.
    End,
    /// The total energy over the weight of all free particles: the height that it could lift them by.
    Energy,
    /// How far the lowest particle lies below the highest one, along gravity.
    Sag,
    /// A coordinate of a particle.
    Coordinate {
        /// What the particle is called.
        name: String,
        /// Its place among those of the scene.
        particle: usize,
        /// 0 to 2.
        axis: usize,
    },
}

/// What cannot be compared on a scene.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum NoMeasure {
    /// It is a height.
    #[error(
        "it is told as a height, and nothing that is free has a weight; allowed: motion, end, particle.NAME.y"
    )]
    NoWeight,
    /// The scene has no such particle, or space no such axis.
    #[error(
        "there is no coordinate {axis} of particle {particle}; allowed: 0 to 2 of particles below {count}"
    )]
    NoCoordinate {
        /// What was asked for.
        particle: usize,
        /// What was asked for.
        axis: usize,
        /// How many particles there are.
        count: usize,
    },
}

impl Measure {
    /// Names of the axes.
    pub const AXES: [&str; 3] = ["x", "y", "z"];

    /// Whether runs are compared by where all free particles are, and not by one number.
    pub const fn is_of_positions(&self) -> bool {
        matches!(self, Self::Motion | Self::End)
    }

    /// As options and files name it.
    pub fn name(&self) -> String {
        match self {
            Self::Motion => "motion".to_owned(),
            Self::End => "end".to_owned(),
            Self::Energy => "energy".to_owned(),
            Self::Sag => "sag".to_owned(),
            Self::Coordinate { name, axis, .. } => format!("particle.{name}.{}", Self::AXES[*axis]),
        }
    }

    /// As a sentence names it.
    pub fn words(&self) -> String {
        match self {
            Self::Motion => "the motion".to_owned(),
            Self::End => "the end".to_owned(),
            Self::Energy => "the height of the energy".to_owned(),
            Self::Sag => "the sag".to_owned(),
            Self::Coordinate { name, axis, .. } => format!("{} of particle {name}", Self::AXES[*axis]),
        }
    }

    /// The times until an end (s) at which it is compared, of a scene in steps of `dt` (s): that end alone, or 16 to 31 times.
    ///
    /// # Errors
    /// An end that is no multiple of the time step.
    pub fn times(&self, end: f64, dt: f64) -> Result<Times, TimesError> {
        let times = Times::until(end, dt)?;
        Ok(match self {
            Self::End => Times { marks: vec![times.count()], ..times },
            Self::Motion | Self::Energy | Self::Sag | Self::Coordinate { .. } => times,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_measure_is_named_as_it_is_asked_for() {
        let corner = Measure::Coordinate { name: "top_left".to_owned(), particle: 0, axis: 1 };
        assert_eq!(
            (corner.name().as_str(), corner.words().as_str()),
            ("particle.top_left.y", "y of particle top_left")
        );
        assert_eq!([Measure::default(), Measure::Sag].map(|measure| measure.name()), ["motion", "sag"]);
        assert!(
            Measure::End.is_of_positions() && !Measure::Energy.is_of_positions() && !corner.is_of_positions()
        );
    }

    #[test]
    fn the_end_is_one_time_and_numbers_are_compared_on_the_way_to_it() {
        let times = |measure: Measure| measure.times(1.0, 0.01).expect("100 steps");
        let [end, sag] = [Measure::End, Measure::Sag].map(times);
        assert_eq!((end.marks.len(), end.interval, end.end()), (1, sag.interval, sag.end()));
        assert!((16..=31).contains(&sag.marks.len()) && (end.end() - 1.0).abs() < 1e-12, "{sag:?}");
        assert!(Measure::End.times(1.005, 0.01).is_err());
    }
}
