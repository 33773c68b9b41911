//! Numbers of particles to colours.
//!
//! Enters: the arrays of a frame. Leaves: one colour per particle. Every scale is described where its colours are.

use std::str::FromStr;

use nappe_client::{Field, Frame, Vectors};

use crate::{geometry::length, sdk::Color};

/// What the colour of snow shows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum ColorBy {
    /// The plastic ratio J_P: white snow as it fell (1), blue where it is packed (fully so at 0.8 and
    /// below, where it is about seven times as stiff), amber where it came apart (fully so at 1.5 and above).
    /// Linear in ln J_P on either side.
    #[default]
    PlasticRatio,
    /// The speed, from 0 (violet) to the largest seen so far in the recording (yellow).
    Speed,
    /// The Frobenius norm of the Cauchy stress, from a thousandth of the largest seen so far in the recording
    /// and below (violet) to that (yellow), by its logarithm.
    Stress,
    /// The body: one colour each.
    Body,
}

impl ColorBy {
    /// Everything that a colour can show.
    pub const ALL: [Self; 4] = [Self::PlasticRatio, Self::Speed, Self::Stress, Self::Body];

    /// Its name on a command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::PlasticRatio => "plastic_ratio",
            Self::Speed => "speed",
            Self::Stress => "stress",
            Self::Body => "body",
        }
    }

    /// What shows an array; none of those that are shown as arrows.
    pub const fn of(field: Field) -> Option<Self> {
        match field {
            Field::Velocities => Some(Self::Speed),
            Field::PlasticRatios => Some(Self::PlasticRatio),
            Field::StressNorms => Some(Self::Stress),
            Field::Forces | Field::Accelerations => None,
        }
    }

    /// The array that frames must hold for it.
    pub const fn field(self) -> Option<Field> {
        match self {
            Self::PlasticRatio => Some(Field::PlasticRatios),
            Self::Speed => Some(Field::Velocities),
            Self::Stress => Some(Field::StressNorms),
            Self::Body => None,
        }
    }
}

/// A name that no colour has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a colour cannot show '{0}': it shows plastic_ratio, speed, stress or body")]
pub struct ParseColorError(String);

impl FromStr for ColorBy {
    type Err = ParseColorError;

    fn from_str(name: &str) -> Result<Self, ParseColorError> {
        let named = Self::ALL.into_iter().find(|by| by.name() == name);
        named.ok_or_else(|| ParseColorError(name.to_owned()))
    }
}

/// J_P at which the colours end.
const PACKED: f32 = 0.8;
const LOOSE: f32 = 1.5;
const WHITE: [f32; 3] = [240.0, 244.0, 250.0];
const BLUE: [f32; 3] = [38.0, 96.0, 190.0];
const AMBER: [f32; 3] = [222.0, 150.0, 62.0];
/// Decades of stress from violet to yellow.
const STRESS_DECADES: f32 = 3.0;
/// From small to large: dark violet to light yellow, in steps of equal lightness (viridis).
const RAMP: [[f32; 3]; 5] =
    [[68.0, 1.0, 84.0], [59.0, 82.0, 139.0], [33.0, 145.0, 140.0], [94.0, 201.0, 98.0], [253.0, 231.0, 37.0]];
/// The colour of numbers that are not finite.
const NO_NUMBER: [f32; 3] = [255.0, 0.0, 255.0];

/// The colours of a recording.
#[derive(Debug)]
pub(crate) struct Coloring {
    by: ColorBy,
    /// The largest speed or stress seen so far.
    largest: f32,
}

impl Coloring {
    pub(crate) fn new(by: ColorBy) -> Self {
        Self { by, largest: 0.0 }
    }

    /// Colours of all particles of a frame; none if it lacks the array for it.
    pub(crate) fn of(&mut self, frame: &Frame) -> Option<Vec<Color>> {
        let numbers = match self.by {
            ColorBy::PlasticRatio => frame.plastic_ratios.as_ref()?.to_f32().into_owned(),
            ColorBy::Stress => frame.stress_norms.as_ref()?.to_f32().into_owned(),
            ColorBy::Speed => speeds(frame.velocities.as_ref()?),
            ColorBy::Body => return None,
        };
        let finite = numbers.iter().copied().filter(|number| number.is_finite());
        self.largest = finite.fold(self.largest, f32::max);
        Some(numbers.into_iter().map(|number| color(self.by, number, self.largest)).collect())
    }
}

fn speeds(velocities: &Vectors) -> Vec<f32> {
    let flat = velocities.to_f32();
    let (vectors, _) = flat.as_chunks::<3>();
    vectors.iter().map(|velocity| length(*velocity)).collect()
}

fn color(by: ColorBy, number: f32, largest: f32) -> Color {
    let [red, green, blue] = match by {
        _ if !number.is_finite() => NO_NUMBER,
        ColorBy::PlasticRatio => packing(number),
        ColorBy::Stress => ramp(1.0 + (number / largest).max(0.0).log10() / STRESS_DECADES),
        ColorBy::Speed | ColorBy::Body => ramp(number / largest),
    };
    Color::from_rgb(red.round() as u8, green.round() as u8, blue.round() as u8)
}

/// White at 1, blue below, amber above.
fn packing(ratio: f32) -> [f32; 3] {
    let logarithm = ratio.max(f32::MIN_POSITIVE).ln();
    if logarithm < 0.0 {
        mix(WHITE, BLUE, logarithm / PACKED.ln())
    } else {
        mix(WHITE, AMBER, logarithm / LOOSE.ln())
    }
}

/// From the first colour (0) to the last (1); what is no number counts as 0.
fn ramp(share: f32) -> [f32; 3] {
    let last = RAMP.len() - 1;
    let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    let at = share * last as f32;
    let step = (at as usize).min(last - 1);
    mix(RAMP[step], RAMP[step + 1], at - step as f32)
}

fn mix(from: [f32; 3], to: [f32; 3], share: f32) -> [f32; 3] {
    let share = share.clamp(0.0, 1.0);
    std::array::from_fn(|channel| from[channel] + share * (to[channel] - from[channel]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rgb([red, green, blue]: [f32; 3]) -> Color {
        Color::from_rgb(red as u8, green as u8, blue as u8)
    }

    #[test]
    fn snow_is_white_as_it_fell_blue_when_packed_and_amber_when_loose() {
        let of = |ratio| color(ColorBy::PlasticRatio, ratio, 20.0);
        assert_eq!(
            [of(1.0), of(0.8), of(0.6), of(1.5), of(20.0)],
            [WHITE, BLUE, BLUE, AMBER, AMBER].map(rgb)
        );
        assert_eq!(of(0.0), rgb(BLUE));
        assert_eq!(of(0.8_f32.sqrt()), rgb(mix(WHITE, BLUE, 0.5)));
    }

    #[test]
    fn a_name_gives_its_colour_and_another_the_names_that_there_are() {
        for by in ColorBy::ALL {
            assert_eq!(by.name().parse(), Ok(by));
        }
        let message = "mass".parse::<ColorBy>().expect_err("none").to_string();
        assert!(ColorBy::ALL.iter().all(|by| message.contains(by.name())), "{message}");
    }

    #[test]
    fn a_scale_ends_at_the_largest_so_far_and_survives_zero() {
        let of = |by, number, largest| color(by, number, largest);
        assert_eq!(of(ColorBy::Speed, 0.0, 4.0), rgb(RAMP[0]));
        assert_eq!(of(ColorBy::Speed, 2.0, 4.0), rgb(RAMP[2]));
        assert_eq!(of(ColorBy::Speed, 4.0, 4.0), rgb(RAMP[4]));
        assert_eq!(of(ColorBy::Speed, 0.0, 0.0), rgb(RAMP[0]), "nothing moves");
        assert_eq!(of(ColorBy::Stress, 1000.0, 1000.0), rgb(RAMP[4]));
        assert_eq!(of(ColorBy::Stress, 1.0, 1000.0), rgb(RAMP[0]));
        assert_eq!(of(ColorBy::Stress, 0.0, 1000.0), rgb(RAMP[0]));
        assert_eq!(of(ColorBy::Stress, f32::NAN, 1000.0), rgb(NO_NUMBER));
    }
}
