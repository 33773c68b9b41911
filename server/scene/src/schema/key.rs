//! A scene's keys as data: each with what it holds, its unit, default, range and meaning.

use nappe_sim::math::number;

use super::range::Range;

/// What a key holds.
#[derive(Clone, Copy)]
pub(crate) enum ValueKind {
    /// A whole number, from the first to the second.
    Whole(u64, u64),
    /// Two whole numbers, each from the first to the second.
    WholePair(u64, u64),
    /// A finite number.
    Number(Range),
    /// Two numbers, each in the range.
    Pair(Range),
    /// Three numbers, each in the range.
    Vector(Range),
    /// Four numbers, each in the range.
    Four(Range),
    /// A number, or three, each in the range.
    OneOrThree(Range),
    /// One of a few names, or three numbers, each in the range.
    NameOrVector(fn() -> Vec<&'static str>, Range),
    /// A text of at most so many bytes.
    Text(usize),
    /// One of a few names.
    Choice(fn() -> Vec<&'static str>),
    /// True or false.
    Flag,
    /// The index or name of a particle or of a row of particles.
    Pin,
    /// Any number of pins.
    Pins,
    /// A table with the keys of a section.
    Table(&'static Section),
    /// An array of tables, of at most so many.
    Tables(&'static Section, usize),
}

impl ValueKind {
    /// What a key of this kind allows, in words.
    pub(crate) fn allowed(self) -> String {
        match self {
            Self::Whole(low, high) if low == high => format!("{low}"),
            Self::Whole(low, high) => format!("a whole number, {low} to {high}"),
            Self::WholePair(low, high) => format!("two whole numbers, each {low} to {high}"),
            Self::Number(range) => format!("a number, {range}"),
            Self::Pair(range) => format!("two numbers, each {range}"),
            Self::Vector(range) => format!("three numbers, each {}", in_size(range)),
            Self::Four(range) => format!("four numbers, each {}", in_size(range)),
            Self::OneOrThree(range) => format!("a number or three numbers, each {range}"),
            Self::NameOrVector(names, range) => {
                format!("{}, or three numbers, each {}", names().join(", "), in_size(range))
            }
            Self::Text(most) => format!("a text of at most {most} bytes, without control characters"),
            Self::Choice(names) => names().join(", "),
            Self::Flag => "true or false".to_owned(),
            Self::Pin => "the index of a particle or a name".to_owned(),
            Self::Pins => "an array of indices and names".to_owned(),
            Self::Table(_) => "a table".to_owned(),
            Self::Tables(_, most) => format!("an array of tables, at most {most}"),
        }
    }
}

/// A range in words; one about 0 as a bound on size.
fn in_size(range: Range) -> String {
    match range {
        Range(low, high) if low.to_bits() == (-high).to_bits() => {
            format!("at most {} in size", number(high))
        }
        range => range.to_string(),
    }
}

/// Whether a key must be there.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Presence {
    /// It must be there.
    Required,
    /// It may be absent; its default, as one writes it in a scene.
    Default(&'static str),
    /// It may be absent, which means what is said here.
    Absent(&'static str),
    /// The alternatives of its section decide.
    Chosen,
}

/// A key of a scene file.
pub(crate) struct SceneKey {
    pub name: &'static str,
    pub kind: ValueKind,
    /// SI, `m/s`; empty for a number without a unit, and for what is no number.
    pub unit: &'static str,
    pub presence: Presence,
    /// What it means, in one sentence.
    pub about: &'static str,
    /// A name that it had earlier, which is still read, with a warning.
    pub old_name: Option<&'static str>,
}

impl SceneKey {
    /// The same key, which is read under an old name too.
    pub(crate) const fn once_called(self, old_name: &'static str) -> Self {
        assert!(
            matches!(self.presence, Presence::Default(_) | Presence::Absent(_)),
            "what must be there, and which keys exclude each other, is checked by the new name alone"
        );
        Self { old_name: Some(old_name), ..self }
    }

    /// A value that it allows, as one writes it in a scene.
    fn example(&self) -> String {
        let near = |Range(low, high): Range, value: f64| number(value.clamp(low, high));
        match self.kind {
            ValueKind::Whole(low, high) => 2_u64.clamp(low, high).to_string(),
            ValueKind::WholePair(low, high) => format!("[{0}, {0}]", 2_u64.clamp(low, high)),
            // A turn of one degree is nothing that one sees.
            ValueKind::Number(range) if self.unit == "degrees" => near(range, 90.0),
            ValueKind::Number(range) | ValueKind::OneOrThree(range) => near(range, 1.0),
            ValueKind::Pair(range) => format!("[{0}, {0}]", near(range, 1.0)),
            ValueKind::Vector(range) | ValueKind::NameOrVector(_, range) => {
                format!("[{0}, {1}, {0}]", near(range, 0.0), near(range, 1.0))
            }
            ValueKind::Four(range) => format!("[{0}, {0}, {0}, {1}]", near(range, 0.0), near(range, 1.0)),
            ValueKind::Text(_) => "\"name\"".to_owned(),
            ValueKind::Choice(names) => format!("\"{}\"", names().first().copied().unwrap_or_default()),
            ValueKind::Flag => "true".to_owned(),
            ValueKind::Pin => "0".to_owned(),
            ValueKind::Pins => "[0]".to_owned(),
            ValueKind::Table(section) => section.example(),
            ValueKind::Tables(section, _) => format!("[{}]", section.example()),
        }
    }
}

/// Which of a section's keys exclude each other.
pub(crate) enum Alternatives {
    /// No keys exclude each other.
    None,
    /// Exactly one of the keys that are [`Presence::Chosen`] must be there; the others go with each of them.
    OneChosen,
    /// Exactly one of these must be there, with what it needs and may have.
    OneOf(&'static [Alternative]),
}

/// A key that excludes others.
pub(crate) struct Alternative {
    pub key: &'static str,
    /// Keys that must come with it.
    pub needs: &'static [&'static str],
    /// Keys that may come with it.
    pub may: &'static [&'static str],
}

/// A table of a scene.
pub(crate) struct Section {
    /// How it is called in messages and in the reference: `body.mesh`.
    pub name: &'static str,
    pub about: &'static str,
    pub keys: &'static [SceneKey],
    pub alternatives: Alternatives,
}

impl Section {
    /// The names of the keys of which exactly one must be there; empty: no keys exclude each other.
    pub(crate) fn choices(&self) -> Vec<&'static str> {
        match self.alternatives {
            Alternatives::None => Vec::new(),
            Alternatives::OneChosen => {
                let chosen = self.keys.iter().filter(|key| key.presence == Presence::Chosen);
                chosen.map(|key| key.name).collect()
            }
            Alternatives::OneOf(list) => list.iter().map(|alternative| alternative.key).collect(),
        }
    }

    /// A table that it allows, as one writes it in a scene: the keys that must be there, or else its first.
    pub(crate) fn example(&self) -> String {
        let chosen: Vec<&str> = match self.alternatives {
            Alternatives::OneOf([first, ..]) => [&[first.key][..], first.needs].concat(),
            _ => self.choices().into_iter().take(1).collect(),
        };
        let is_needed = |key: &&SceneKey| key.presence == Presence::Required || chosen.contains(&key.name);
        let mut keys: Vec<&SceneKey> = self.keys.iter().filter(is_needed).collect();
        if keys.is_empty() {
            keys.extend(self.keys.first());
        }
        let pairs: Vec<String> = keys.iter().map(|key| format!("{} = {}", key.name, key.example())).collect();
        format!("{{ {} }}", pairs.join(", "))
    }

    /// Whether the header of a table, `body.springs`, names an array of tables.
    pub(crate) fn is_array(&self, header: &str) -> bool {
        let (mut section, mut is_array) = (self, false);
        for name in header.split('.') {
            let key = section.keys.iter().find(|key| key.name == name.trim());
            (section, is_array) = match key.map(|key| key.kind) {
                Some(ValueKind::Table(inner)) => (inner, false),
                Some(ValueKind::Tables(inner, _)) => (inner, true),
                _ => return false,
            };
        }
        is_array
    }
}

/// A key in one line of a table.
pub(crate) const fn key(
    name: &'static str,
    kind: ValueKind,
    unit: &'static str,
    presence: Presence,
    about: &'static str,
) -> SceneKey {
    SceneKey { name, kind, unit, presence, about, old_name: None }
}
