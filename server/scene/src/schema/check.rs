//! Holds a scene's text against the schema: the first fault, with its place.

use std::ops::Range as Span;

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::key::{Field, Kind, Presence, Range, Section, number};
use crate::{
    error::{Fault, SceneError, excerpt, suggestion},
    source::{Path, Source},
};

type Value<'a> = Spanned<DeValue<'a>>;

/// Refuses unknown fields, wrong types, values out of range, missing and contradicting fields.
pub(crate) fn check(
    section: &Section,
    table: &DeTable<'_>,
    span: &Span<usize>,
    path: &Path,
    source: &Source,
) -> Result<(), SceneError> {
    for (key, value) in table {
        let here = path.key(key.get_ref());
        let Some(field) = section.fields.iter().find(|f| f.name == key.get_ref().as_ref()) else {
            let known = section.fields.iter().map(|f| f.name);
            let message = format!(
                "{} has no field '{}'; {}",
                section.name,
                excerpt(key.get_ref()),
                suggestion(key.get_ref(), known)
            );
            return Err(source.error_at(Fault::UnknownField, &here, &key.span(), message));
        };
        check_value(field, value, &here, source)?;
    }
    for field in section.fields.iter().filter(|f| f.presence == Presence::Required) {
        if !table.contains_key(field.name) {
            let message = format!("is missing: {} ({})", field.about, field.kind.allowed());
            return Err(source.error_at(Fault::Missing, &path.key(field.name), span, message));
        }
    }
    check_alternatives(section, table, span, path, source)
}

fn check_alternatives(
    section: &Section,
    table: &DeTable<'_>,
    span: &Span<usize>,
    path: &Path,
    source: &Source,
) -> Result<(), SceneError> {
    if section.alternatives.is_empty() {
        return Ok(());
    }
    let keys: Vec<&str> = section.alternatives.iter().map(|a| a.key).collect();
    let given: Vec<_> = section.alternatives.iter().filter(|a| table.contains_key(a.key)).collect();
    let [chosen] = given[..] else {
        let found: Vec<&str> = given.iter().map(|a| a.key).collect();
        let found = if found.is_empty() { "none".to_owned() } else { found.join(" and ") };
        let message = format!("has {found} of {}: exactly one is needed", keys.join(", "));
        let fault = if given.is_empty() { Fault::Missing } else { Fault::Inconsistent };
        return Err(source.error_at(fault, path, span, message));
    };
    if let Some(missing) = chosen.needs.iter().find(|name| !table.contains_key(**name)) {
        let message = format!("is missing: it is needed with '{}'", chosen.key);
        return Err(source.error_at(Fault::Missing, &path.key(missing), span, message));
    }
    for (key, value) in table {
        let name = key.get_ref().as_ref();
        if name != chosen.key && !chosen.needs.contains(&name) && !chosen.may.contains(&name) {
            let message = format!("does not go with '{}'", chosen.key);
            return Err(source.error_at(Fault::Inconsistent, &path.key(name), &value.span(), message));
        }
    }
    Ok(())
}

fn check_value(field: &Field, value: &Value<'_>, path: &Path, source: &Source) -> Result<(), SceneError> {
    match (field.kind, value.get_ref()) {
        (Kind::Table(section), DeValue::Table(table)) => check(section, table, &value.span(), path, source),
        (Kind::Tables(section, most), DeValue::Array(items)) => {
            if items.len() > most || (items.is_empty() && field.presence == Presence::Required) {
                let found = format!("{} tables", items.len());
                return Err(fault(Fault::OutOfRange, field.kind, &found, value, path, source));
            }
            for (i, item) in items.iter().enumerate() {
                let here = path.index(i);
                let DeValue::Table(table) = item.get_ref() else {
                    return Err(wrong_type(field.kind, item, &here, source));
                };
                check(section, table, &item.span(), &here, source)?;
            }
            Ok(())
        }
        (Kind::Pair(range), DeValue::Array(items)) => {
            check_items(field.kind, Kind::Number(range), Some(2), items, value, path, source)
        }
        (Kind::Vector(range), DeValue::Array(items)) => {
            check_items(field.kind, Kind::Number(range), Some(3), items, value, path, source)
        }
        (Kind::WholePair(low, high), DeValue::Array(items)) => {
            check_items(field.kind, Kind::Whole(low, high), Some(2), items, value, path, source)
        }
        (Kind::Pins, DeValue::Array(items)) => {
            check_items(field.kind, Kind::Pin, None, items, value, path, source)
        }
        _ => check_scalar(field.kind, value, path, source),
    }
}

fn check_items(
    whole: Kind,
    kind: Kind,
    count: Option<usize>,
    items: &[Value<'_>],
    value: &Value<'_>,
    path: &Path,
    source: &Source,
) -> Result<(), SceneError> {
    if count.is_some_and(|count| items.len() != count) {
        let found = format!("an array of {}", items.len());
        return Err(fault(Fault::WrongType, whole, &found, value, path, source));
    }
    items.iter().enumerate().try_for_each(|(i, item)| check_scalar(kind, item, &path.index(i), source))
}

fn check_scalar(kind: Kind, value: &Value<'_>, path: &Path, source: &Source) -> Result<(), SceneError> {
    let fits = match (kind, value.get_ref()) {
        (Kind::Whole(low, high), DeValue::Integer(_)) => {
            whole(value).is_some_and(|n| (low..=high).contains(&n))
        }
        (Kind::Number(range), DeValue::Integer(_) | DeValue::Float(_)) => {
            numeric(value).is_some_and(|x| range.holds(x))
        }
        (Kind::Text(most), DeValue::String(text)) => text.len() <= most,
        (Kind::Choice(names), DeValue::String(text)) => {
            if names().contains(&text.as_ref()) {
                return Ok(());
            }
            let message = format!("is '{}'; {}", excerpt(text), suggestion(text, names()));
            return Err(source.error_at(Fault::OutOfRange, path, &value.span(), message));
        }
        (Kind::Flag, DeValue::Boolean(_)) => true,
        (Kind::Pin, DeValue::Integer(_)) => whole(value).is_some_and(|n| u32::try_from(n).is_ok()),
        (Kind::Pin, DeValue::String(text)) => text.len() <= 64,
        _ => return Err(wrong_type(kind, value, path, source)),
    };
    if fits {
        return Ok(());
    }
    Err(fault(Fault::OutOfRange, kind, &found(value.get_ref()), value, path, source))
}

fn wrong_type(kind: Kind, value: &Value<'_>, path: &Path, source: &Source) -> SceneError {
    fault(Fault::WrongType, kind, &found(value.get_ref()), value, path, source)
}

fn fault(
    fault: Fault,
    kind: Kind,
    found: &str,
    value: &Value<'_>,
    path: &Path,
    source: &Source,
) -> SceneError {
    source.error_at(fault, path, &value.span(), format!("is {found}; allowed: {}", kind.allowed()))
}

/// What stands there, in a few words.
fn found(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("'{}'", excerpt(text)),
        DeValue::Integer(n) => excerpt(n.as_str()),
        DeValue::Float(x) => excerpt(x.as_str()),
        DeValue::Boolean(b) => b.to_string(),
        DeValue::Datetime(date) => date.to_string(),
        DeValue::Array(items) => format!("an array of {}", items.len()),
        DeValue::Table(_) => "a table".to_owned(),
    }
}

fn whole(value: &Value<'_>) -> Option<u64> {
    let DeValue::Integer(n) = value.get_ref() else { return None };
    u64::from_str_radix(n.as_str(), n.radix()).ok()
}

fn numeric(value: &Value<'_>) -> Option<f64> {
    match value.get_ref() {
        DeValue::Integer(n) => i64::from_str_radix(n.as_str(), n.radix()).ok().map(|n| n as f64),
        DeValue::Float(x) => x.as_str().parse().ok(),
        _ => None,
    }
}

impl Kind {
    /// What a field of this kind allows.
    pub(crate) fn allowed(self) -> String {
        match self {
            Self::Whole(low, high) if low == high => format!("{low}"),
            Self::Whole(low, high) => format!("a whole number, {low} to {high}"),
            Self::WholePair(low, high) => format!("two whole numbers, each {low} to {high}"),
            Self::Number(range) => format!("a number, {range}"),
            Self::Pair(range) => format!("two numbers, each {range}"),
            Self::Vector(Range(low, high)) if low.to_bits() == (-high).to_bits() => {
                format!("three numbers, each at most {} in size", number(high))
            }
            Self::Vector(range) => format!("three numbers, each {range}"),
            Self::Text(most) => format!("a text of at most {most} bytes"),
            Self::Choice(names) => names().join(", "),
            Self::Flag => "true or false".to_owned(),
            Self::Pin => "the index of a particle or a name".to_owned(),
            Self::Pins => "an array of indices and names".to_owned(),
            Self::Table(_) => "a table".to_owned(),
            Self::Tables(_, most) => format!("an array of tables, at most {most}"),
        }
    }
}
