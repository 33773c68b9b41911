//! A scene with values in place of others, by their keys.

use thiserror::Error;
use toml::{Table, Value};

use crate::{
    error::{SceneError, SceneErrors, nearest},
    scene::Scene,
};

/// A value that cannot be put into a scene.
#[derive(Debug, Error)]
pub enum EditError {
    /// The scene has no such key.
    #[error("{key}: the scene has no such key; {hint}")]
    NoKey {
        /// As it was asked for.
        key: String,
        /// The nearest, or all.
        hint: String,
    },
    /// The key holds other keys, and the value is not of its kind.
    #[error(
        "{key}: is a table or an array; allowed are a whole one, such as [1, 2] or {{ a = 1 }}, or a key of a single value, such as \
         {key}.{inner}"
    )]
    NoValue {
        /// As it was asked for.
        key: String,
        /// A key in it.
        inner: String,
    },
    /// The schema does not allow the value.
    #[error("{key} = {value}: {errors}")]
    NotAllowed {
        /// The key whose value is refused.
        key: String,
        /// As it was written.
        value: String,
        /// What is allowed.
        errors: SceneErrors,
    },
    /// The schema does not allow the values together, each of which it allows alone.
    #[error("{values}, together: {errors}")]
    NotTogether {
        /// All keys with their values, as they were written.
        values: String,
        /// What is allowed.
        errors: SceneErrors,
    },
}

impl Scene {
    /// The same scene with values in place of others: keys are those of the scene file with a dot between them, bodies, objects
    /// and colliders by their names, numbers of a list by their places from 0 on: `body.cloth.springs.bend.stiffness`, `gravity.1`.
    /// An array takes the place of an array, `[0, -1, 0]`, and a table that of a table, `{ grid = [4, 4], spacing = 0.1 }`.
    ///
    /// # Errors
    /// A key that the scene does not have, a single value for a table or an array, and a value that the schema does not allow,
    /// by the name of its key.
    pub fn with_values(&self, values: &[(String, String)]) -> Result<Self, EditError> {
        let mut root = self.table();
        values.iter().try_for_each(|(key, value)| put(&mut root, key, value))?;
        self.read(&root).map_err(|errors| self.not_allowed(values, errors))
    }

    /// All that it holds, as a table.
    fn table(&self) -> Value {
        Value::Table(toml::from_str::<Table>(&self.to_toml()).unwrap_or_default())
    }

    /// The scene that a table holds, as if it was read from the same text.
    fn read(&self, root: &Value) -> Result<Self, SceneErrors> {
        let mut scene = Self::parse(&toml::to_string(root).unwrap_or_default(), "")?;
        scene.source = self.source.clone();
        Ok(scene)
    }

    /// Which of several values is refused: the first that alone has one of the errors that all have, or all of them.
    fn not_allowed(&self, values: &[(String, String)], errors: SceneErrors) -> EditError {
        let is_shared = |alone: &SceneErrors| {
            let same = |error: &SceneError, other: &SceneError| {
                error.key == other.key && error.message == other.message
            };
            alone.iter().any(|error| errors.iter().any(|other| same(error, other)))
        };
        for (key, value) in values {
            let mut root = self.table();
            // A key that is there with the others alone is no reason.
            let Ok(()) = put(&mut root, key, value) else { continue };
            if let Err(alone) = self.read(&root)
                && is_shared(&alone)
            {
                return EditError::NotAllowed { key: key.clone(), value: value.clone(), errors: alone };
            }
        }
        match values {
            [(key, value)] => EditError::NotAllowed { key: key.clone(), value: value.clone(), errors },
            values => {
                let all: Vec<String> = values.iter().map(|(key, value)| format!("{key} = {value}")).collect();
                EditError::NotTogether { values: all.join(", "), errors }
            }
        }
    }
}

/// Puts a value where its key leads.
fn put(root: &mut Value, key: &str, value: &str) -> Result<(), EditError> {
    let value = parsed(value);
    let Some(place) = find(root, key) else {
        return Err(EditError::NoKey { key: key.to_owned(), hint: hint(root, key) });
    };
    let is_alike = match place {
        Value::Table(_) => value.is_table(),
        Value::Array(_) => value.is_array(),
        _ => true,
    };
    match names(place).into_iter().next() {
        Some(inner) if !is_alike => Err(EditError::NoValue { key: key.to_owned(), inner }),
        _ => {
            *place = value;
            Ok(())
        }
    }
}

/// A value as it is written in a scene; what is none is a text.
fn parsed(text: &str) -> Value {
    let read = toml::from_str::<Table>(&format!("value = {text}"));
    read.ok().and_then(|mut table| table.remove("value")).unwrap_or_else(|| Value::String(text.to_owned()))
}

/// The place of a value.
fn find<'a>(root: &'a mut Value, key: &str) -> Option<&'a mut Value> {
    key.split('.').try_fold(root, |place, part| match place {
        Value::Table(table) => table.get_mut(part),
        Value::Array(values) => {
            let index = index(values, part)?;
            values.get_mut(index)
        }
        _ => None,
    })
}

/// The place in an array to which a part of a key leads: that of a name, or the one with this number.
fn index(values: &[Value], part: &str) -> Option<usize> {
    values.iter().position(|value| named(value) == Some(part)).or_else(|| part.parse().ok())
}

/// What is near to a key that leads nowhere: at the part that is wrong, or further in, where parts before it are missing.
fn hint(root: &Value, key: &str) -> String {
    let (mut place, mut way, mut rest) = (root, String::new(), key);
    loop {
        let (part, after) = rest.split_once('.').unwrap_or((rest, ""));
        let next = match place {
            Value::Table(table) => table.get(part),
            Value::Array(values) => index(values, part).and_then(|index| values.get(index)),
            _ => None,
        };
        let Some(next) = next else {
            let names = names(place);
            if let Some(name) =
                nearest(part, names.iter().map(String::as_str).filter(|name| !is_number(name)))
            {
                return format!("did you mean '{way}{name}'?");
            }
            break;
        };
        (place, way, rest) = (next, format!("{way}{part}."), after);
    }
    let count = rest.split('.').count();
    let mut keys = Vec::new();
    add_keys(place, "", &mut keys);
    match nearest(rest, keys.iter().map(|key| end(key, count))) {
        Some(near) => {
            let keys = keys.iter().filter(|key| end(key, count) == near);
            let keys: Vec<String> = keys.map(|key| format!("'{way}{key}'")).collect();
            format!("did you mean {}?", keys.join(" or "))
        }
        None if names(place).is_empty() => format!("'{}' is a single value", way.trim_end_matches('.')),
        None => {
            let names: Vec<String> = names(place).iter().map(|name| format!("{way}{name}")).collect();
            format!("allowed: {}", names.join(", "))
        }
    }
}

/// The last parts of a key, so many of them.
fn end(key: &str, count: usize) -> &str {
    key.rmatch_indices('.').nth(count - 1).map_or(key, |(dot, _)| &key[dot + 1..])
}

/// Whether a part of a key is the number of a place, which has nothing near.
fn is_number(part: &str) -> bool {
    part.parse::<usize>().is_ok()
}

/// Adds every key below a place, which the way leads to, but for places in lists.
fn add_keys(place: &Value, way: &str, keys: &mut Vec<String>) {
    let values: Vec<&Value> = match place {
        Value::Table(table) => table.values().collect(),
        Value::Array(values) => values.iter().collect(),
        _ => Vec::new(),
    };
    for (name, value) in names(place).iter().zip(values).filter(|(name, _)| !is_number(name)) {
        let key = format!("{way}{name}");
        add_keys(value, &format!("{key}."), keys);
        keys.push(key);
    }
}

/// The name of a table in an array.
fn named(value: &Value) -> Option<&str> {
    value.get("name").and_then(Value::as_str)
}

/// The parts of keys that lead on from a place.
fn names(place: &Value) -> Vec<String> {
    match place {
        Value::Table(table) => table.keys().cloned().collect(),
        Value::Array(values) => {
            let name = |(place, value): (usize, &Value)| {
                named(value).map_or_else(|| place.to_string(), str::to_owned)
            };
            values.iter().enumerate().map(name).collect()
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Mesh;

    const TEXT: &str = "version = 1\ndt = 0.01\nsteps = 10\n[[body]]\nname = \"cloth\"\npins = [\"top\"]\nmesh = { grid = [4, 4], spacing = 0.1 }\n\
        springs = { stretch = { stiffness = 100 }, bend = { stiffness = 5 } }\n";

    fn with(key: &str, value: &str) -> Result<Scene, String> {
        let scene = Scene::parse(TEXT, "small.toml").expect("a scene");
        scene.with_values(&[(key.to_owned(), value.to_owned())]).map_err(|error| error.to_string())
    }

    #[test]
    fn values_are_put_where_keys_lead() {
        let scene = with("body.cloth.springs.bend.stiffness", "7.5").expect("a value");
        let springs = scene.bodies[0].springs.as_ref().expect("springs");
        assert_eq!(springs.bend.map(|law| law.stiffness), Some(7.5));
        assert_eq!(with("gravity.1", "-1").expect("a value").gravity, [0.0, -1.0, 0.0]);
        assert_eq!(with("body.0.drag", "0.5").expect("a value").bodies[0].drag, 0.5);
        let named = with("body.cloth.integrator", "bdf2").expect("a name without quotes");
        assert_eq!(named.bodies[0].integrator.name(), "bdf2");
    }

    #[test]
    fn an_array_and_a_table_take_the_place_of_their_like() {
        assert_eq!(with("wind", "[1, 0.5, 0]").expect("an array").wind, [1.0, 0.5, 0.0]);
        let scene = with("body.cloth.mesh", "{ grid = [3, 5], spacing = 0.2 }").expect("a table");
        let Mesh::Grid { grid, spacing, .. } = scene.bodies[0].mesh else { panic!("it is a grid") };
        assert_eq!((grid, spacing), ([3, 5], 0.2));
        let scene = with("body.cloth.pins", "[\"top_left\", 3]").expect("an array of names and numbers");
        assert_eq!(scene.bodies[0].pins.len(), 2);
    }

    #[test]
    fn the_key_whose_value_is_refused_is_named_wherever_it_stands() {
        let scene = Scene::parse(TEXT, "small.toml").expect("a scene");
        let with = |values: &[(&str, &str)]| {
            let values: Vec<(String, String)> =
                values.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
            scene.with_values(&values).expect_err("an error").to_string()
        };
        let [wrong, right, other] = [("body.cloth.drag", "-1"), ("gravity.1", "-1"), ("dt", "0.02")];
        for values in [[wrong, right, other], [right, wrong, other], [right, other, wrong]] {
            let error = with(&values);
            assert!(error.starts_with("body.cloth.drag = -1: "), "{error}");
        }
    }

    #[test]
    fn what_cannot_be_set_says_why() {
        for (key, value, part) in [
            ("body.cloth.springs.bend.stifness", "1", "did you mean 'body.cloth.springs.bend.stiffness'?"),
            ("body.sail.drag", "1", "the scene has no such key; allowed: body.cloth"),
            ("drga", "1", "did you mean 'body.cloth.drag'?"),
            ("cloth.drag", "1", "did you mean 'body.cloth.drag'?"),
            ("springs.bend.stifness", "1", "did you mean 'body.cloth.springs.bend.stiffness'?"),
            ("body.0.stiffness", "1", "did you mean 'body.0.springs.bend.stiffness' or 'body.0.springs.s"),
            ("body.cloth.springs.twist", "1", "allowed: body.cloth.springs.bend, "),
            ("Gravity.1", "1", "did you mean 'gravity'?"),
            ("gravity.y", "1", "allowed: gravity.0, gravity.1, gravity.2"),
            ("x", "1", "allowed: body, "),
            ("dt.x", "1", "'dt' is a single value"),
            ("body.cloth.springs", "1", "is a table or an array"),
            ("gravity", "1", "such as gravity.0"),
            ("gravity", "[1, 2]", "gravity = [1, 2]"),
            ("body.cloth.mesh", "[4, 4]", "is a table or an array"),
            ("body.cloth.drag", "-1", "drag"),
            ("dt", "soon", "dt = soon"),
        ] {
            let error = with(key, value).expect_err("an error");
            assert!(error.contains(part), "{key}: {error}");
        }
    }
}
