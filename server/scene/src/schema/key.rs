//! A scene's keys as data: each with its kind, unit, default, range and meaning.

/// The numbers that a field allows: from the first to the second, both included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range(pub f64, pub f64);

impl Range {
    pub(super) fn holds(self, value: f64) -> bool {
        (self.0..=self.1).contains(&value)
    }
}

impl std::fmt::Display for Range {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} to {}", number(self.0), number(self.1))
    }
}

/// Short and exact: 1e-6, 200, 0.5.
pub(crate) fn number(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e5).contains(&value.abs()) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}

/// What a field holds.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    /// A whole number.
    Whole(u64, u64),
    /// Two whole numbers.
    WholePair(u64, u64),
    /// A number.
    Number(Range),
    /// Two numbers.
    Pair(Range),
    /// Three numbers.
    Vector(Range),
    /// A text of at most so many bytes.
    Text(usize),
    /// One of a few names.
    Choice(fn() -> Vec<&'static str>),
    /// true or false.
    Flag,
    /// The index or name of a particle or row of particles.
    Pin,
    /// Several of them.
    Pins,
    /// A table.
    Table(&'static Section),
    /// An array of tables, of at most so many.
    Tables(&'static Section, usize),
}

/// Whether a field must be there.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Presence {
    Required,
    /// Its default, as one writes it in a scene.
    Default(&'static str),
    /// Absent means something of its own.
    Absent(&'static str),
    /// Decided by the rules of its section.
    Chosen,
}

/// A field.
pub(crate) struct Field {
    pub name: &'static str,
    pub kind: Kind,
    pub unit: &'static str,
    pub presence: Presence,
    pub about: &'static str,
}

/// Fields that exclude each other: exactly one key of a section's choices must be there.
pub(crate) struct Alternative {
    pub key: &'static str,
    /// Fields that must come with it.
    pub needs: &'static [&'static str],
    /// Fields that may come with it.
    pub may: &'static [&'static str],
}

/// A table of a scene.
pub(crate) struct Section {
    pub name: &'static str,
    pub about: &'static str,
    pub fields: &'static [Field],
    pub alternatives: &'static [Alternative],
}

/// A field in one line of a table.
pub(crate) const fn field(
    name: &'static str,
    kind: Kind,
    unit: &'static str,
    presence: Presence,
    about: &'static str,
) -> Field {
    Field { name, kind, unit, presence, about }
}
