//! Checks a scene's text against its keys: every error, each with its position.

use std::ops::Range as Span;

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::key::{Alternatives, Presence, SceneKey, Section, ValueKind};
use crate::{
    error::{ErrorKind, Found, excerpt, nearest, suggestion},
    printable::is_printable,
    source::{OldKey, Path, Source},
};

type Value<'a> = Spanned<DeValue<'a>>;

/// Finds unknown keys, wrong types, values out of range, keys that are missing or contradict each other; gives
/// the keys that stand under an old name.
pub(crate) fn check(root: &Section, table: &DeTable<'_>, source: &Source, found: &mut Found) -> Vec<OldKey> {
    let at = At { path: Path::default(), span: 0..0 };
    let mut checker = Checker { source, found, old_keys: Vec::new() };
    checker.section(root, table, &at);
    checker.old_keys
}

/// Where a value stands.
struct At {
    path: Path,
    span: Span<usize>,
}

impl At {
    fn key(&self, name: &str, span: Span<usize>) -> Self {
        Self { path: self.path.key(name), span }
    }

    fn index(&self, index: usize, span: Span<usize>) -> Self {
        Self { path: self.path.index(index), span }
    }
}

/// Keys of a table that its section does not have.
#[derive(Default)]
struct Unknown {
    count: usize,
    /// Keys that they seem to mean.
    meant: Vec<&'static str>,
}

struct Checker<'a> {
    source: &'a Source,
    found: &'a mut Found,
    old_keys: Vec<OldKey>,
}

impl Checker<'_> {
    fn error(&mut self, kind: ErrorKind, at: &At, message: impl Into<String>) {
        self.found.add(self.source.error_at(kind, &at.path, &at.span, message));
    }

    fn section(&mut self, section: &Section, table: &DeTable<'_>, at: &At) {
        // What a misspelt key seems to mean is not also said to be missing.
        let mut unknown = Unknown::default();
        for (name, value) in table {
            let found: &str = name.get_ref().as_ref();
            let is_called = |key: &&SceneKey| key.name == found || key.old_name == Some(found);
            if let Some(key) = section.keys.iter().find(is_called) {
                let here = at.key(key.name, value.span());
                if key.name != found {
                    self.old_name(key.name, table, &at.key(found, name.span()), &here);
                }
                self.value(key, value, &here);
            } else {
                let known = || section.keys.iter().map(|key| key.name);
                let (name_of, near) = (section.name, suggestion(found, known()));
                let message = format!("{name_of} has no key '{}'; {near}", excerpt(found));
                self.error(ErrorKind::UnknownField, &at.key(found, name.span()), message);
                unknown.count += 1;
                unknown.meant.extend(nearest(found, known()));
            }
        }

        for key in section.keys.iter().filter(|key| key.presence == Presence::Required) {
            if !table.contains_key(key.name) && !unknown.meant.contains(&key.name) {
                let message = format!("is missing: {} ({})", key.about, key.kind.allowed());
                self.error(ErrorKind::Missing, &at.key(key.name, at.span.clone()), message);
            }
        }

        self.alternatives(section, table, &unknown, at);
    }

    /// A key under its old name is read with a warning; under both names it is an error.
    fn old_name(&mut self, name: &str, table: &DeTable<'_>, old: &At, new: &At) {
        let message = format!("the key is now called '{name}'");
        if table.contains_key(name) {
            let message = format!("{message}, which is here too: only one of them may be given");
            self.error(ErrorKind::Inconsistent, old, message);
        } else {
            let warning = self.source.warning_at(&old.path, &old.span, message);
            self.old_keys.push(OldKey { path: new.path.clone(), span: new.span.clone(), warning });
        }
    }

    fn alternatives(&mut self, section: &Section, table: &DeTable<'_>, unknown: &Unknown, at: &At) {
        let choices = section.choices();
        if choices.is_empty() {
            return;
        }

        let given: Vec<&str> = choices.iter().copied().filter(|name| table.contains_key(*name)).collect();
        if given.is_empty() && unknown.count > 0 {
            return;
        }
        let [chosen] = given[..] else {
            let found = if given.is_empty() { "none".to_owned() } else { given.join(" and ") };
            let message = format!("has {found} of {}: exactly one is needed", choices.join(", "));
            let kind = if given.is_empty() { ErrorKind::Missing } else { ErrorKind::Inconsistent };
            return self.error(kind, at, message);
        };

        let Alternatives::OneOf(list) = section.alternatives else { return };
        let Some(chosen) = list.iter().find(|alternative| alternative.key == chosen) else { return };
        let is_there = |name: &str| {
            let required = |key: &SceneKey| key.name == name && key.presence == Presence::Required;
            table.contains_key(name) || unknown.meant.contains(&name) || section.keys.iter().any(required)
        };

        for missing in chosen.needs.iter().filter(|name| !is_there(name)) {
            let message = format!("is missing: it is needed with '{}'", chosen.key);
            self.error(ErrorKind::Missing, &at.key(missing, at.span.clone()), message);
        }

        for (name, value) in table {
            let name = name.get_ref().as_ref();
            let fits = name == chosen.key || chosen.needs.contains(&name) || chosen.may.contains(&name);
            // A key that does not exist is an error of its own.
            if !fits && section.keys.iter().any(|key| key.name == name) {
                let message = format!("does not go with '{}'", chosen.key);
                self.error(ErrorKind::Inconsistent, &at.key(name, value.span()), message);
            }
        }
    }

    fn value(&mut self, key: &SceneKey, value: &Value<'_>, at: &At) {
        match (key.kind, value.get_ref()) {
            (ValueKind::Table(section), DeValue::Table(table)) => self.section(section, table, at),
            (ValueKind::Table(section), value) => self.not_a_table(key, section, value, at),
            (ValueKind::Tables(..), DeValue::Table(_)) => {
                let (allowed, header) = (key.kind.allowed(), at.path.header());
                let message =
                    format!("is a table; allowed: {allowed}: write [[{header}]], in double brackets");
                self.error(ErrorKind::WrongType, at, message);
            }
            (ValueKind::Tables(section, most), DeValue::Array(items)) => {
                if items.len() > most || (items.is_empty() && key.presence == Presence::Required) {
                    let tables = format!("{} tables", items.len());
                    return self.not_allowed(ErrorKind::OutOfRange, key.kind, &tables, at);
                }
                for (i, item) in items.iter().enumerate() {
                    let here = at.index(i, item.span());
                    match item.get_ref() {
                        DeValue::Table(table) => self.section(section, table, &here),
                        other => self.not_allowed(ErrorKind::WrongType, key.kind, &in_words(other), &here),
                    }
                }
            }
            (ValueKind::Pair(range), DeValue::Array(items)) => {
                self.items(key.kind, ValueKind::Number(range), Some(2), items, at);
            }
            (
                ValueKind::Vector(range) | ValueKind::OneOrThree(range) | ValueKind::NameOrVector(_, range),
                DeValue::Array(items),
            ) => {
                self.items(key.kind, ValueKind::Number(range), Some(3), items, at);
            }
            (ValueKind::Four(range), DeValue::Array(items)) => {
                self.items(key.kind, ValueKind::Number(range), Some(4), items, at);
            }
            (ValueKind::WholePair(low, high), DeValue::Array(items)) => {
                self.items(key.kind, ValueKind::Whole(low, high), Some(2), items, at);
            }
            (ValueKind::Pins, DeValue::Array(items)) => {
                self.items(key.kind, ValueKind::Pin, None, items, at);
            }
            (kind, value) => self.scalar(kind, value, at),
        }
    }

    /// A value of a key that holds a table: the message says how a table is written.
    fn not_a_table(&mut self, key: &SceneKey, section: &Section, value: &DeValue<'_>, at: &At) {
        let of_tables =
            matches!(value, DeValue::Array(items) if items.iter().any(|item| item.get_ref().is_table()));
        let message = if of_tables {
            format!(
                "is an array of tables; allowed: a table: write [{}], in single brackets",
                at.path.header()
            )
        } else {
            let (name, example) = (key.name, section.example());
            format!("is {}; allowed: a table, such as {name} = {example}", in_words(value))
        };
        self.error(ErrorKind::WrongType, at, message);
    }

    fn items(
        &mut self,
        whole: ValueKind,
        each: ValueKind,
        count: Option<usize>,
        items: &[Value<'_>],
        at: &At,
    ) {
        if count.is_some_and(|count| items.len() != count) {
            let array = format!("an array of {}", items.len());
            return self.not_allowed(ErrorKind::WrongType, whole, &array, at);
        }
        for (i, item) in items.iter().enumerate() {
            self.scalar(each, item.get_ref(), &at.index(i, item.span()));
        }
    }

    fn scalar(&mut self, kind: ValueKind, value: &DeValue<'_>, at: &At) {
        let fits = match (kind, value) {
            (ValueKind::Whole(low, high), DeValue::Integer(_)) => {
                whole(value).is_some_and(|n| (low..=high).contains(&n))
            }
            (
                ValueKind::Number(range) | ValueKind::OneOrThree(range),
                DeValue::Integer(_) | DeValue::Float(_),
            ) => numeric(value).is_some_and(|x| range.holds(x)),
            (ValueKind::Text(most), DeValue::String(text)) => text.len() <= most && is_printable(text),
            (ValueKind::Choice(names) | ValueKind::NameOrVector(names, _), DeValue::String(text)) => {
                if !names().contains(&text.as_ref()) {
                    let message = format!("is '{}'; {}", excerpt(text), suggestion(text, names()));
                    self.error(ErrorKind::OutOfRange, at, message);
                }
                return;
            }
            (ValueKind::Flag, DeValue::Boolean(_)) => true,
            (ValueKind::Pin, DeValue::Integer(_)) => whole(value).is_some_and(|n| u32::try_from(n).is_ok()),
            (ValueKind::Pin, DeValue::String(text)) => text.len() <= 64,
            _ => return self.not_allowed(ErrorKind::WrongType, kind, &in_words(value), at),
        };

        if !fits {
            self.not_allowed(ErrorKind::OutOfRange, kind, &in_words(value), at);
        }
    }

    fn not_allowed(&mut self, error: ErrorKind, kind: ValueKind, found: &str, at: &At) {
        self.error(error, at, format!("is {found}; allowed: {}", kind.allowed()));
    }
}

/// What a key holds, in a few words.
fn in_words(value: &DeValue<'_>) -> String {
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

fn whole(value: &DeValue<'_>) -> Option<u64> {
    let DeValue::Integer(n) = value else { return None };
    u64::from_str_radix(n.as_str(), n.radix()).ok()
}

fn numeric(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(n) => i64::from_str_radix(n.as_str(), n.radix()).ok().map(|n| n as f64),
        DeValue::Float(x) => x.as_str().parse().ok(),
        _ => None,
    }
}
