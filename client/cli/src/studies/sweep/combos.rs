//! Which values a sweep sets: every combination of lists, or samples of lists and ranges.

use std::collections::BTreeSet;

use super::split;
use crate::words::error::{CliError, Result};

/// Combinations, at most.
const MOST: usize = 100_000;

/// A key, and what it is set to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Set {
    pub(crate) key: String,
    values: Values,
}

#[derive(Clone, Debug, PartialEq)]
enum Values {
    List(Vec<String>),
    /// All numbers from the first to the second.
    Range([f64; 2]),
}

impl Set {
    /// `KEY=V,V,...`, or `KEY=LOW..HIGH`. A value may be a list in brackets, a table in braces or a text in quotes.
    pub(crate) fn parse(text: &str) -> std::result::Result<Self, String> {
        let (key, values) = text
            .split_once('=')
            .filter(|(key, values)| !key.trim().is_empty() && !values.trim().is_empty())
            .ok_or_else(|| format!("'{text}' is no KEY=V,V,... and no KEY=LOW..HIGH"))?;
        // A row of the table is a line.
        if text.contains(char::is_control) {
            return Err(format!("{text:?} holds a control character; a value is a line of text"));
        }
        let values = match range(values) {
            Some([Some(low), Some(high)]) if low < high => Values::Range([low, high]),
            Some(_) => {
                return Err(format!("'{values}' is no range: two numbers are needed, the lower first"));
            }
            None => Values::List(distinct(split::parts(values)?)?),
        };
        Ok(Self { key: key.trim().to_owned(), values })
    }

    /// Values that stand for all: each of a list, both ends of a range.
    pub(crate) fn examples(&self) -> Vec<String> {
        match &self.values {
            Values::List(values) => values.clone(),
            Values::Range(ends) => ends.iter().map(|end| format!("{end:?}")).collect(),
        }
    }

    fn sampled(&self, rng: &mut fastrand::Rng) -> String {
        match &self.values {
            Values::List(values) => values[rng.usize(..values.len())].clone(),
            Values::Range([low, high]) => format!("{:?}", low + (high - low) * rng.f64()),
        }
    }
}

/// Both ends of what is written as a range, as far as they are numbers. Without a number at either side it is none: `../a.obj`.
fn range(values: &str) -> Option<[Option<f64>; 2]> {
    let (low, high) = values.split_once("..")?;
    let ends = [low, high].map(|end| end.trim().parse().ok().filter(|end: &f64| end.is_finite()));
    ends.iter().any(Option::is_some).then_some(ends)
}

/// The same values, each of which is there once.
fn distinct(values: Vec<String>) -> std::result::Result<Vec<String>, String> {
    let mut known = BTreeSet::new();
    if let Some(twice) = values.iter().find(|value| !known.insert(value.as_str())) {
        return Err(format!("the value {twice} is there twice: each is needed once"));
    }
    Ok(values)
}

/// The values of all keys in each run: every combination, the last key the fastest, or so many samples that follow from a seed.
///
/// # Errors
/// A key twice, a range without samples, too many combinations.
pub(crate) fn combinations(sets: &[Set], sample: Option<(u32, u64)>) -> Result<Vec<Vec<String>>> {
    let mut keys = BTreeSet::new();
    if let Some(twice) = sets.iter().find(|set| !keys.insert(&set.key)) {
        return Err(CliError::usage(format!("--set {}: the key is set twice", twice.key)));
    }
    if let Some((count, seed)) = sample {
        let mut rng = fastrand::Rng::with_seed(seed);
        return Ok((0..count).map(|_| sets.iter().map(|set| set.sampled(&mut rng)).collect()).collect());
    }
    let mut all = vec![Vec::new()];
    for set in sets {
        let Values::List(values) = &set.values else {
            return Err(CliError::usage(format!(
                "--set {}: a range is sampled; say how often with --sample N",
                set.key
            )));
        };
        if all.len().saturating_mul(values.len()) > MOST {
            return Err(CliError::usage(format!(
                "more than {MOST} combinations: fewer values are needed, or --sample N"
            )));
        }
        let with = |before: &Vec<String>| {
            let before = before.clone();
            values.iter().map(move |value| [before.clone(), vec![value.clone()]].concat())
        };
        all = all.iter().flat_map(with).collect();
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sets(texts: &[&str]) -> Vec<Set> {
        texts.iter().map(|text| Set::parse(text).expect("a set")).collect()
    }

    #[test]
    fn every_combination_comes_once_and_the_last_key_runs_fastest() {
        let all = combinations(&sets(&["a=1,2", "b=x, y,z"]), None).expect("combinations");
        let text: Vec<String> = all.iter().map(|values| values.concat()).collect();
        assert_eq!(text, ["1x", "1y", "1z", "2x", "2y", "2z"]);
    }

    #[test]
    fn samples_follow_from_the_seed_and_lie_in_their_ranges() {
        let sets = sets(&["a=1..2", "b=x,y"]);
        let drawn = |seed| combinations(&sets, Some((50, seed))).expect("samples");
        assert_eq!(drawn(1), drawn(1));
        assert_ne!(drawn(1), drawn(2));
        for values in drawn(1) {
            assert!((1.0..2.0).contains(&values[0].parse::<f64>().expect("a number")), "{values:?}");
            assert!(["x", "y"].contains(&values[1].as_str()), "{values:?}");
        }
    }

    #[test]
    fn what_is_no_set_of_values_is_refused() {
        for wrong in ["a", "=1", "a=", "a=2..1", "a=1..x", "a=1,2,1", "a=[1,2", "a=1,\n2"] {
            assert!(Set::parse(wrong).is_err(), "{wrong}");
        }
        let paths = Set::parse("a=../a.obj,../b.obj").expect("two texts").examples();
        assert_eq!(paths, ["../a.obj", "../b.obj"]);
        let many = (0..400).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
        let many = [format!("a={many}"), format!("b={many}")].map(|text| Set::parse(&text).expect("a set"));
        for (sets, part) in [
            (&many[..], "more than 100000 combinations"),
            (&sets(&["a=1", "a=2"])[..], "the key is set twice"),
            (&sets(&["a=1..2"])[..], "--sample N"),
        ] {
            let error = combinations(sets, None).expect_err("an error").to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
