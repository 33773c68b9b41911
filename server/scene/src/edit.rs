//! A scene with values in place of others, by their keys.

use thiserror::Error;
use toml::{Table, Value};

use crate::{
    error::{SceneErrors, suggestion},
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
    /// The key holds other keys, and no value.
    #[error("{key}: is a table or an array; a key of a single value is needed, such as {key}.{inner}")]
    NoValue {
        /// As it was asked for.
        key: String,
        /// A key in it.
        inner: String,
    },
    /// The schema does not allow the value.
    #[error("{key} = {value}: {errors}")]
    NotAllowed {
        /// The key that was set last.
        key: String,
        /// As it was written.
        value: String,
        /// What is allowed.
        errors: SceneErrors,
    },
}

impl Scene {
    /// The same scene with values in place of others: keys are those of the scene file with a dot between them, bodies, objects
    /// and colliders by their names, numbers of a list by their places from 0 on: `body.cloth.springs.bend.stiffness`, `gravity.1`.
    ///
    /// # Errors
    /// A key that the scene does not have, one of no single value, and a value that the schema does not allow.
    pub fn with_values(&self, values: &[(String, String)]) -> Result<Self, EditError> {
        let mut root = Value::Table(toml::from_str::<Table>(&self.to_toml()).unwrap_or_default());
        for (key, value) in values {
            let place = find(&mut root, key)?;
            *place = parsed(value);
        }
        let text = toml::to_string(&root).unwrap_or_default();
        let mut scene = Self::parse(&text, "").map_err(|errors| {
            let (key, value) = values.last().cloned().unwrap_or_default();
            EditError::NotAllowed { key, value, errors }
        })?;
        scene.source = self.source.clone();
        Ok(scene)
    }
}

/// A value as it is written in a scene; what is none is a text.
fn parsed(text: &str) -> Value {
    let read = toml::from_str::<Table>(&format!("value = {text}"));
    read.ok().and_then(|mut table| table.remove("value")).unwrap_or_else(|| Value::String(text.to_owned()))
}

/// The place of a value.
fn find<'a>(root: &'a mut Value, key: &str) -> Result<&'a mut Value, EditError> {
    let mut place = root;
    let mut way = String::new();
    for part in key.split('.') {
        let names = names(place);
        place = entry(place, part).ok_or_else(|| {
            let names: Vec<String> = names.iter().map(|name| format!("{way}{name}")).collect();
            let hint = suggestion(&format!("{way}{part}"), names.iter().map(String::as_str));
            EditError::NoKey { key: key.to_owned(), hint }
        })?;
        way = format!("{way}{part}.");
    }
    match names(place).into_iter().next() {
        Some(inner) => Err(EditError::NoValue { key: key.to_owned(), inner }),
        None => Ok(place),
    }
}

/// What a part of a key leads to.
fn entry<'a>(place: &'a mut Value, part: &str) -> Option<&'a mut Value> {
    match place {
        Value::Table(table) => table.get_mut(part),
        Value::Array(values) => {
            let index =
                values.iter().position(|value| named(value) == Some(part)).or_else(|| part.parse().ok());
            values.get_mut(index?)
        }
        _ => None,
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

    const TEXT: &str = "version = 1\ndt = 0.01\nsteps = 10\n[[body]]\nname = \"cloth\"\nmesh = { grid = [4, 4], spacing = 0.1 }\n\
        springs = { stretch = { stiffness = 100 }, bend = { stiffness = 5 } }\n";

    fn with(key: &str, value: &str) -> Result<Scene, String> {
        let scene = Scene::parse(TEXT, "small.toml").expect("a scene");
        scene.with_values(&[(key.to_owned(), value.to_owned())]).map_err(|error| error.to_string())
    }

    #[test]
    fn values_are_put_where_keys_lead() {
        let scene = with("body.cloth.springs.bend.stiffness", "7.5").expect("a value");
        let springs = scene.bodies[0].springs.expect("springs");
        assert_eq!(springs.bend.map(|law| law.stiffness), Some(7.5));
        assert_eq!(with("gravity.1", "-1").expect("a value").gravity, [0.0, -1.0, 0.0]);
        assert_eq!(with("body.0.drag", "0.5").expect("a value").bodies[0].drag, 0.5);
        let named = with("body.cloth.integrator", "bdf2").expect("a name without quotes");
        assert_eq!(named.bodies[0].integrator.name(), "bdf2");
    }

    #[test]
    fn what_cannot_be_set_says_why() {
        for (key, value, part) in [
            ("body.cloth.springs.bend.stifness", "1", "did you mean 'body.cloth.springs.bend.stiffness'?"),
            ("body.sail.drag", "1", "the scene has no such key"),
            ("body.cloth.springs", "1", "is a table or an array"),
            ("gravity", "1", "such as gravity.0"),
            ("body.cloth.drag", "-1", "drag"),
            ("dt", "soon", "dt = soon"),
        ] {
            let error = with(key, value).expect_err("an error");
            assert!(error.contains(part), "{key}: {error}");
        }
    }
}
