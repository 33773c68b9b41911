//! Numbers as options have them: whole ones in a range, and real ones in a unit.
//!
//! Enters: a word of the command line. Leaves: a number, or what is needed, with what was meant as an example where that
//! can be told: `1e3` is 1000, `12,5` is 12.5, and `5 ms` is 0.005 where seconds are wanted.

use std::ops::{Bound, RangeBounds};

/// A unit that an option wants, and those that can be written instead of it where a text may bring its own.
#[derive(Clone, Copy, Debug)]
pub struct Unit {
    /// What is needed, in words: `a number of seconds`.
    words: &'static str,
    /// A number that makes sense, where it cannot be told what was meant.
    example: f64,
    /// Endings of numbers, the longer ones first, with what each is worth in this unit.
    endings: &'static [(&'static str, f64)],
}

/// Numbers without a unit.
pub const PLAIN: Unit = Unit { words: "a number", example: 1.0, endings: &[("", 1.0)] };
/// Times, in seconds.
pub const SECONDS: Unit = Unit {
    words: "a number of seconds",
    example: 0.5,
    endings: &[("ms", 1e-3), ("min", 60.0), ("h", 3600.0), ("s", 1.0), ("", 1.0)],
};
/// Lengths, in metres.
pub const METRES: Unit = Unit {
    words: "a number of metres",
    example: 0.01,
    endings: &[("mm", 1e-3), ("cm", 1e-2), ("µm", 1e-6), ("um", 1e-6), ("m", 1.0), ("", 1.0)],
};
/// Masses, in kilograms.
pub const KILOGRAMS: Unit =
    Unit { words: "a number of kilograms", example: 0.01, endings: &[("kg", 1.0), ("g", 1e-3), ("", 1.0)] };
/// Frequencies, in hertz.
pub const HERTZ: Unit =
    Unit { words: "a number of hertz", example: 5.0, endings: &[("kHz", 1e3), ("Hz", 1.0), ("", 1.0)] };
/// Drag and damping of springs, in N s/m.
pub const NEWTON_SECONDS_PER_METRE: Unit =
    Unit { words: "a number of N s/m", example: 0.001, endings: &[("N s/m", 1.0), ("Ns/m", 1.0), ("", 1.0)] };

impl Unit {
    /// The number in this unit that a text says with an ending or without, if it is finite.
    pub fn read(self, text: &str) -> Option<f64> {
        let with = |(ending, worth): &(&str, f64)| Some((text.strip_suffix(ending)?, *worth));
        let (number, worth) = self.endings.iter().find_map(with)?;
        let number = number.trim().parse::<f64>().ok().filter(|number| number.is_finite())?;
        // A unit that is a hundredth divides: 0.1 mm is the number that 0.0001 is.
        Some(if worth < 1.0 { number / (1.0 / worth).round() } else { number * worth })
    }
}

/// The least number that an option takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Least {
    /// Any that is above 0.
    Above0,
    /// 0.
    From0,
}

impl Least {
    fn allows(self, number: f64) -> bool {
        match self {
            Self::Above0 => number > 0.0,
            Self::From0 => number >= 0.0,
        }
    }

    const fn words(self) -> &'static str {
        match self {
            Self::Above0 => "above 0",
            Self::From0 => "from 0",
        }
    }
}

/// Reads real numbers in a unit, which is not written.
pub fn real(
    unit: Unit,
    least: Least,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text: &str| {
        let is_allowed = |number: &f64| number.is_finite() && least.allows(*number);
        text.trim().parse::<f64>().ok().filter(is_allowed).ok_or_else(|| {
            let meant = unit.read(&text.trim().replace(',', ".")).filter(is_allowed);
            let example = meant.unwrap_or(unit.example);
            format!("{} {} is needed, such as {example}", unit.words, least.words())
        })
    }
}

/// Reads whole numbers in a range, as a type without sign.
pub fn whole<T>(
    range: impl RangeBounds<u64> + Clone + Send + Sync + 'static,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: TryFrom<u64> + 'static,
{
    move |text: &str| {
        let typed = |number: u64| if range.contains(&number) { T::try_from(number).ok() } else { None };
        let number = text.parse::<u64>().ok().and_then(typed);
        number.ok_or_else(|| {
            let meant = meant(text).filter(|number| typed(*number).is_some());
            let such = meant.map_or_else(String::new, |number| format!(", such as {number}"));
            format!("{} is needed{such}", range_in_words::<T>(text, &range))
        })
    }
}

/// The whole number that is written with an exponent, a point or blanks between digits.
fn meant(text: &str) -> Option<u64> {
    let number = text.replace([' ', '_', '\u{a0}', '\u{202f}'], "").parse::<f64>().ok()?;
    // Beyond it not every whole number is an f64.
    let is_whole = number.fract() == 0.0 && (0.0..9e15).contains(&number);
    is_whole.then_some(number as u64)
}

/// A range in words; where it has no upper end, that of the type is told to whoever is above it.
fn range_in_words<T: TryFrom<u64>>(text: &str, range: &impl RangeBounds<u64>) -> String {
    let least = match range.start_bound() {
        Bound::Included(least) => *least,
        Bound::Excluded(below) => below + 1,
        Bound::Unbounded => 0,
    };
    let largest = [64, 32, 16, 8].map(|bits| u64::MAX >> (64 - bits));
    let largest = largest.into_iter().find(|largest| T::try_from(*largest).is_ok()).unwrap_or(0);
    let most = match range.end_bound() {
        Bound::Included(most) => Some(*most),
        Bound::Excluded(above) => Some(above - 1),
        Bound::Unbounded => {
            text.parse::<f64>().is_ok_and(|number| number > largest as f64).then_some(largest)
        }
    };
    match most {
        Some(most) => format!("a whole number from {least} to {most}"),
        None => format!("a whole number from {least}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_whole_number_is_read_or_what_was_meant_is_the_example() {
        let from_1 = whole::<u32>(1..);
        assert_eq!(from_1("1"), Ok(1));
        assert_eq!(from_1("4294967295"), Ok(u32::MAX));
        for (wrong, said) in [
            ("1e3", "a whole number from 1 is needed, such as 1000"),
            ("10 000", "a whole number from 1 is needed, such as 10000"),
            ("2.0", "a whole number from 1 is needed, such as 2"),
            ("12,5", "a whole number from 1 is needed"),
            ("5 ms", "a whole number from 1 is needed"),
            ("-5", "a whole number from 1 is needed"),
            ("0", "a whole number from 1 is needed"),
            ("", "a whole number from 1 is needed"),
            ("inf", "a whole number from 1 to 4294967295 is needed"),
            ("4294967296", "a whole number from 1 to 4294967295 is needed"),
        ] {
            assert_eq!(from_1(wrong), Err(said.to_owned()), "{wrong}");
        }
        let cells = whole::<u16>(2..=64);
        assert_eq!(cells("64"), Ok(64));
        assert_eq!(cells("65"), Err("a whole number from 2 to 64 is needed".to_owned()));
        assert_eq!(whole::<u64>(0..)("18446744073709551615"), Ok(u64::MAX));
    }

    #[test]
    fn a_real_number_is_read_in_its_unit_or_what_was_meant_is_the_example() {
        let seconds = real(SECONDS, Least::Above0);
        assert_eq!(["0.5", " 1e-3", "2"].map(&seconds), [Ok(0.5), Ok(1e-3), Ok(2.0)]);
        for (wrong, said) in [
            ("5 ms", "a number of seconds above 0 is needed, such as 0.005"),
            ("12,5", "a number of seconds above 0 is needed, such as 12.5"),
            ("2min", "a number of seconds above 0 is needed, such as 120"),
            ("-1", "a number of seconds above 0 is needed, such as 0.5"),
            ("0", "a number of seconds above 0 is needed, such as 0.5"),
            ("nan", "a number of seconds above 0 is needed, such as 0.5"),
            ("soon", "a number of seconds above 0 is needed, such as 0.5"),
        ] {
            assert_eq!(seconds(wrong), Err(said.to_owned()), "{wrong}");
        }
        assert_eq!(real(METRES, Least::From0)("0"), Ok(0.0));
        let grams = real(KILOGRAMS, Least::From0)("5 g");
        assert_eq!(grams, Err("a number of kilograms from 0 is needed, such as 0.005".to_owned()));
    }
}
