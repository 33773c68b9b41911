//! Names of prims: letters, digits and `_`, no digit first, and no two alike among those that stand beside each other.
//!
//! Enters: names of a scene. Leaves: names that USD takes, and texts in quotes.

use std::collections::BTreeSet;

use nappe_scene::printable;

/// Names of prims that stand beside each other.
#[derive(Debug, Default)]
pub(super) struct Names {
    taken: BTreeSet<String>,
}

impl Names {
    /// With these names taken.
    pub(super) fn with(taken: &[&str]) -> Self {
        Self { taken: taken.iter().map(|name| (*name).to_owned()).collect() }
    }

    /// A name for what a scene calls so.
    pub(super) fn next(&mut self, name: &str) -> String {
        let mut plain: String =
            name.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' }).collect();
        if plain.is_empty() || plain.starts_with(|first: char| first.is_ascii_digit()) {
            plain.insert(0, '_');
        }
        let numbered = |number: usize| if number == 1 { plain.clone() } else { format!("{plain}_{number}") };
        let mut number = 1;
        while !self.taken.insert(numbered(number)) {
            number += 1;
        }
        numbered(number)
    }
}

/// A text in quotes.
pub(super) fn quoted(text: &str) -> String {
    format!("\"{}\"", printable(text).replace('\\', "\\\\").replace('"', "\\\""))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_identifiers_and_no_two_are_alike() {
        let mut names = Names::with(&["camera"]);
        let found = ["sheet", "camera", "a b", "a-b", "a_b_2", "12", "é<&>", "", "sheet"]
            .map(|name| names.next(name));
        assert_eq!(found, ["sheet", "camera_2", "a_b", "a_b_2", "a_b_2_2", "_12", "____", "_", "sheet_2"]);
        assert_eq!(quoted("a \"b\" \\ c\n"), "\"a \\\"b\\\" \\\\ c\\\\u{a}\"");
    }
}
