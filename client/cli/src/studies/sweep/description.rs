//! What a sweep was asked for and made from, and in what it differs from another one: the contents of sweep.json.

use std::collections::BTreeMap;

use serde_json::Value;

use super::part::Part;

/// Keys of a description, and the options that they come from.
const OPTIONS: [(&str, &str); 7] = [
    ("keys", "keys of --set"),
    ("values", "values of --set"),
    ("steps", "--steps"),
    ("until_s", "--until"),
    ("save", "--save"),
    ("measures", "--measure"),
    ("part", "--part"),
];

/// A sweep that was asked for: an object of JSON.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Description(Value);

impl Description {
    pub(crate) fn new(object: Value) -> Self {
        Self(object)
    }

    /// What the text of a sweep.json says was asked for; none if it is none.
    pub(crate) fn read(text: &str) -> Option<Self> {
        let mut value = serde_json::from_str::<Value>(text).ok()?;
        value.as_object_mut()?.remove("complete");
        Some(Self(value))
    }

    /// The part that it asks for; none where it is of a whole sweep.
    pub(crate) fn part(&self) -> Option<Part> {
        Part::parse(self.0["part"].as_str()?).ok()
    }

    /// The same of the whole sweep.
    pub(crate) fn of_whole(&self) -> Self {
        let mut value = self.0.clone();
        if let Some(object) = value.as_object_mut() {
            object.remove("part");
        }
        Self(value)
    }

    /// The scene, as it was named.
    pub(crate) fn scene(&self) -> &str {
        self.0["scene"].as_str().unwrap_or_default()
    }

    /// A list of texts, by the key that it stands under.
    pub(crate) fn texts(&self, key: &str) -> Option<Vec<String>> {
        self.0[key].as_array()?.iter().map(|text| text.as_str().map(str::to_owned)).collect()
    }

    /// How many runs the whole sweep has.
    pub(crate) fn run_count(&self) -> Option<usize> {
        self.0["values"].as_array().map(Vec::len)
    }

    /// The text of sweep.json when so many of its runs have their rows. Whether all have is no part of what was asked for.
    pub(crate) fn text(&self, rows: usize, runs: usize) -> String {
        let mut value = self.0.clone();
        value["complete"] = Value::Bool(rows == runs);
        format!("{value:#}\n")
    }

    /// In what a sweep that was begun, by its sweep.json, differs from this one: clauses; none where it is the same.
    pub(crate) fn differences(&self, begun: &str) -> Vec<String> {
        let Ok(mut begun) = serde_json::from_str::<Value>(begun) else {
            return vec!["its sweep.json cannot be read".to_owned()];
        };
        if let Some(object) = begun.as_object_mut() {
            object.remove("complete");
        }
        let asked = &self.0;
        if begun == *asked {
            return Vec::new();
        }
        let is_other = |key: &str| begun[key] != asked[key];
        let mut differences = Vec::new();
        if is_other("version") {
            differences.push(format!("its rows were made by version {} of nappe", word(&begun["version"])));
        }
        let scene = word(&begun["scene"]);
        if is_other("scene") {
            differences.push(format!("its rows were made with the scene {scene}"));
        } else if is_other("scene_hash") {
            differences.push(format!(
                "{scene} changed since the sweep began: its rows were made with another text of it"
            ));
        }
        differences.extend(of_files(&files(&begun["files"]), &files(&asked["files"])));
        let others: Vec<&str> =
            OPTIONS.iter().filter(|(key, _)| is_other(key)).map(|(_, option)| *option).collect();
        if !others.is_empty() {
            differences.push(format!("the arguments are others ({})", others.join(", ")));
        }
        if differences.is_empty() {
            differences.push("its sweep.json has other entries".to_owned());
        }
        differences
    }
}

/// A text without its quotes.
fn word(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// The hashes of files by their names.
fn files(value: &Value) -> BTreeMap<&str, Option<&str>> {
    let files = value.as_array().map(Vec::as_slice).unwrap_or_default();
    files.iter().filter_map(|file| Some((file["file"].as_str()?, file["hash"].as_str()))).collect()
}

/// What became of files since a sweep began.
fn of_files(begun: &BTreeMap<&str, Option<&str>>, now: &BTreeMap<&str, Option<&str>>) -> Vec<String> {
    let mut clauses = Vec::new();
    for (name, before) in begun {
        let what = match (before, now.get(name)) {
            (before, Some(now)) if before == now => continue,
            (Some(_), Some(Some(_))) => "changed since the sweep began: its rows were made with another mesh",
            (Some(_), Some(None)) => "cannot be read any more: rows were made with it",
            (None, Some(_)) => "could not be read when the sweep began, and can be now",
            (_, None) => "is no longer among its meshes: rows were made with it",
        };
        clauses.push(format!("{name} {what}"));
    }
    let new = now.keys().filter(|name| !begun.contains_key(*name));
    clauses.extend(new.map(|name| format!("{name} was not among its meshes when the sweep began")));
    clauses
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn description(scene_hash: &str, files: &[(&str, Option<&str>)], steps: u64) -> Description {
        let files: Vec<Value> =
            files.iter().map(|(file, hash)| json!({ "file": file, "hash": hash })).collect();
        Description::new(json!({
            "scene": "a.toml",
            "scene_hash": scene_hash,
            "version": "1",
            "steps": steps,
            "until_s": 0.2,
            "files": files,
        }))
    }

    #[test]
    fn a_part_differs_from_another_one_and_not_in_what_the_whole_was_asked_for() {
        let whole = description("1", &[], 5);
        let part = |part: &str| {
            let mut value = whole.0.clone();
            value["part"] = json!(part);
            Description(value)
        };
        let [first, second] = ["1/2", "2/2"].map(part);
        assert_eq!(second.differences(&first.text(0, 1)), ["the arguments are others (--part)"]);
        assert_eq!(whole.differences(&first.text(0, 1)), ["the arguments are others (--part)"]);
        let read = Description::read(&first.text(0, 1)).expect("a description");
        assert_eq!((read.part(), whole.part()), (Part::parse("1/2").ok(), None));
        assert_eq!([read.of_whole(), second.of_whole()], [whole.clone(), whole]);
        assert!(Description::read("[1]").is_none() && Description::read("").is_none());
    }

    #[test]
    fn a_sweep_is_the_same_whether_it_is_complete_or_not() {
        let asked = description("1", &[("m.obj", Some("2"))], 5);
        for rows in [0, 3] {
            assert!(asked.differences(&asked.text(rows, 3)).is_empty());
        }
        assert!(asked.text(3, 3).contains("\"complete\": true"));
        assert!(asked.text(2, 3).contains("\"complete\": false"));
    }

    #[test]
    fn what_differs_is_told_by_its_name() {
        let begun = description("1", &[("a", Some("1")), ("b", Some("1")), ("c", Some("1")), ("d", None)], 5);
        let begun = begun.text(1, 2);
        let same = [("a", Some("1")), ("b", Some("1")), ("c", Some("1")), ("d", None)];
        let [mut changed, mut unread, mut read] = [same; 3];
        (changed[0].1, unread[1].1, read[3].1) = (Some("2"), None, Some("1"));
        for (asked, clause) in [
            (description("2", &same, 5), "a.toml changed since the sweep began"),
            (description("1", &changed, 5), "a changed since the sweep began"),
            (description("1", &unread, 5), "b cannot be read any more"),
            (description("1", &read, 5), "d could not be read when the sweep began"),
            (description("1", &same[..2], 5), "c is no longer among its meshes"),
            (description("1", &same, 6), "the arguments are others (--steps)"),
        ] {
            let found = asked.differences(&begun).join("; ");
            assert!(found.starts_with(clause), "{clause}: {found}");
        }
        let more = [&same[..], &[("e", Some("1"))]].concat();
        let found = description("1", &more, 5).differences(&begun);
        assert_eq!(found, ["e was not among its meshes when the sweep began"]);
        for other in ["", "[1]", "{}"] {
            assert!(!description("1", &same, 5).differences(other).is_empty(), "{other}");
        }
    }
}
