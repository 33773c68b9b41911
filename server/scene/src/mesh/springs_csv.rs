//! Springs of a mesh as a table of text: a line that names the columns, and a line for each spring.

use std::collections::BTreeSet;

use nappe_sim::mesh::{MeshSpring, SpringKind, repeated_spring};

use crate::error::{ErrorKind, SceneError, excerpt, suggestion};

/// The columns, of which the first three must be there.
const COLUMNS: [&str; 6] = ["particle_a", "particle_b", "stiffness", "damping", "rest_length", "kind"];
/// How many of them must be there.
const NEEDED: usize = 3;

/// What a table may hold at most.
#[derive(Clone, Copy, Debug)]
struct Most {
    springs: usize,
    /// Different pairs of stiffness and damping, those of each kind for themselves.
    laws: usize,
}

/// As many springs as a server takes by default, and the pairs that fit into one cloth.
const MOST: Most = Most { springs: 40_000_000, laws: 65_534 };

/// A value of a line, and the column at which it begins, from 1.
#[derive(Clone, Copy, Debug, Default)]
struct Value<'a> {
    text: &'a str,
    column: usize,
}

/// A line that is not blank.
#[derive(Clone, Copy, Debug)]
struct Row<'a> {
    file: &'a str,
    line: usize,
    text: &'a str,
}

/// Reads the springs of a mesh of so many points from a table: `particle_a`, `particle_b`, `stiffness`, and perhaps `damping` (else
/// 0), `rest_length` (empty or NaN: as the mesh lies) and `kind` (stretch, shear or bend; else stretch), in any order, with commas
/// between them. `file` is its name in messages.
///
/// # Errors
/// The first error, with its line and column.
pub fn read_springs_csv(text: &str, file: &str, points: usize) -> Result<Vec<MeshSpring>, SceneError> {
    read(text, file, points, MOST)
}

/// The same with other limits.
fn read(text: &str, file: &str, points: usize, most: Most) -> Result<Vec<MeshSpring>, SceneError> {
    let mut rows = rows(text, file);
    let Some(header) = rows.next() else {
        let message =
            format!("is empty; allowed: a line such as {}, and a line for each spring", COLUMNS.join(","));
        return Err(SceneError::new(ErrorKind::Syntax, file, message).at_line(1));
    };
    let places = places(&header)?;
    let (mut springs, mut laws) = (Vec::new(), BTreeSet::new());
    for row in rows.clone() {
        if springs.len() == most.springs {
            let message = format!("has more than {0} springs; allowed: {0}", most.springs);
            return Err(row.error(ErrorKind::TooLarge, 1, message));
        }
        let spring = row.spring(&places, points)?;
        laws.insert((spring.kind, spring.stiffness.to_bits(), spring.damping.to_bits()));
        if laws.len() > most.laws {
            let message = format!(
                "has one more pair of stiffness and damping than the {0} before; allowed: {0} different pairs in a cloth",
                most.laws
            );
            return Err(row.error(ErrorKind::TooLarge, 1, message));
        }
        springs.push(spring);
    }
    if springs.is_empty() {
        let message = "names columns, and no springs follow; allowed: a line for each spring, one at least";
        return Err(header.error(ErrorKind::Missing, 1, message));
    }
    let Some([before, after]) = repeated_spring(&springs) else { return Ok(springs) };
    let [a, b] = springs[after].points;
    let line = |place: usize| rows.clone().nth(place).map_or(0, |row| row.line);
    let message = format!(
        "joins the points {a} and {b}, as line {} does; allowed: one spring between two points",
        line(before)
    );
    Err(SceneError::new(ErrorKind::Inconsistent, file, message).at_line(line(after)))
}

/// Springs as such a table, from which [`read_springs_csv`] has the same ones, bit by bit.
pub fn springs_csv(springs: &[MeshSpring]) -> String {
    let line = |spring: &MeshSpring| {
        let MeshSpring { points: [a, b], kind, stiffness, damping, rest_length } = *spring;
        let length = rest_length.map_or_else(String::new, |length| length.to_string());
        format!("{a},{b},{stiffness},{damping},{length},{}\n", kind.name())
    };
    let lines: String = springs.iter().map(line).collect();
    format!("{}\n{lines}", COLUMNS.join(","))
}

/// Lines that are not blank.
fn rows<'a>(text: &'a str, file: &'a str) -> impl Iterator<Item = Row<'a>> + Clone {
    let rows = (1..).zip(text.lines()).map(move |(line, text)| Row { file, line, text });
    rows.filter(|row| !row.text.trim().is_empty())
}

/// Values between commas, without the blanks around them.
fn values(text: &str) -> impl Iterator<Item = Value<'_>> {
    let mut column = 1;
    text.split(',').map(move |raw| {
        let blanks = raw.chars().take_while(|c| c.is_whitespace()).count();
        let value = Value { text: raw.trim(), column: column + blanks };
        column += raw.chars().count() + 1;
        value
    })
}

/// For each column of the table its place among [`COLUMNS`].
fn places(header: &Row<'_>) -> Result<Vec<usize>, SceneError> {
    if !header.text.contains(',') && header.text.contains([';', '\t']) {
        let message =
            "has other marks than commas between its values; allowed: commas, and points within numbers";
        return Err(header.error(ErrorKind::Syntax, 1, message));
    }
    let mut places = Vec::new();
    for value in values(header.text) {
        let Some(place) = COLUMNS.iter().position(|name| *name == value.text) else {
            let near = suggestion(value.text, COLUMNS);
            let message = format!("has no meaning for a column '{}'; {near}", excerpt(value.text));
            return Err(header.error(ErrorKind::UnknownField, value.column, message));
        };
        if places.contains(&place) {
            let message = format!("has the column '{}' a second time; allowed: once", value.text);
            return Err(header.error(ErrorKind::Inconsistent, value.column, message));
        }
        places.push(place);
    }
    match (0..NEEDED).find(|place| !places.contains(place)) {
        None => Ok(places),
        Some(missing) => {
            let message =
                format!("has no column '{}'; needed: particle_a, particle_b, stiffness", COLUMNS[missing]);
            Err(header.error(ErrorKind::Missing, 1, message))
        }
    }
}

impl Row<'_> {
    fn error(&self, kind: ErrorKind, column: usize, message: impl Into<String>) -> SceneError {
        SceneError::new(kind, self.file, message).at_line(self.line).at_column(column)
    }

    /// The spring of this line.
    fn spring(&self, places: &[usize], points: usize) -> Result<MeshSpring, SceneError> {
        let mut found = [Value::default(); COLUMNS.len()];
        let mut count = 0;
        for (at, value) in values(self.text).enumerate() {
            if let Some(place) = places.get(at) {
                found[*place] = value;
            }
            count = at + 1;
        }
        if count != places.len() {
            let message = format!("has {count} values; allowed: {}, one for each column", places.len());
            return Err(self.error(ErrorKind::Syntax, 1, message));
        }

        let [a, b, stiffness, damping, length, kind] = found;
        let ends = [self.point(a, points)?, self.point(b, points)?];
        if ends[0] == ends[1] {
            let message = format!("joins point {} to itself; allowed: two points", ends[0]);
            return Err(self.error(ErrorKind::OutOfRange, b.column, message));
        }
        let kind = match kind.text {
            "" => SpringKind::Stretch,
            name => SpringKind::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
                let message = format!("is of the kind '{}'; allowed: stretch, shear, bend", excerpt(name));
                self.error(ErrorKind::OutOfRange, kind.column, message)
            })?,
        };
        let rest_length = self.number(length, Some(f64::NAN))?;
        let spring = MeshSpring {
            points: ends,
            kind,
            stiffness: self.number(stiffness, None)?,
            damping: self.number(damping, Some(0.0))?,
            rest_length: (!rest_length.is_nan()).then_some(rest_length),
        };
        match spring.wrong_number() {
            None => Ok(spring),
            Some((what, value, allowed)) => {
                let column = match what {
                    "stiffness" => stiffness.column,
                    "damping" => damping.column,
                    _ => length.column,
                };
                let message = format!("has the {what} {value}; allowed: {allowed}");
                Err(self.error(ErrorKind::OutOfRange, column, message))
            }
        }
    }

    /// The index of a point, below `count`.
    fn point(&self, value: Value<'_>, count: usize) -> Result<u32, SceneError> {
        let point = value.text.parse::<u32>().ok().filter(|point| (*point as usize) < count);
        point.ok_or_else(|| {
            let allowed = match count.checked_sub(1) {
                None => "none, there are no points".to_owned(),
                Some(last) => format!("0 to {last}, the points of the mesh"),
            };
            let message = format!("names point '{}'; allowed: {allowed}", excerpt(value.text));
            self.error(ErrorKind::OutOfRange, value.column, message)
        })
    }

    /// A number; where nothing is written, that which is `absent`, if one may be.
    fn number(&self, value: Value<'_>, absent: Option<f64>) -> Result<f64, SceneError> {
        let found = if value.text.is_empty() { absent } else { value.text.parse().ok() };
        found.ok_or_else(|| {
            let found = excerpt(value.text);
            let message = format!("has '{found}'; allowed: a number, with a point for fractions");
            self.error(ErrorKind::Syntax, value.column, message)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn springs_come_out_as_written_in_any_order_of_columns() {
        let spring = |points, kind, damping, rest_length| MeshSpring {
            points,
            kind,
            stiffness: 10.0,
            damping,
            rest_length,
        };
        let text = "\nkind, stiffness,particle_b,particle_a,rest_length,damping\r\n\
            shear,10, 1, 0,2.5, 0.5\n\n, 1e1,3,2,, \nbend,10,1,3,NaN,0\n";
        let expected = [
            spring([0, 1], SpringKind::Shear, 0.5, Some(2.5)),
            spring([2, 3], SpringKind::Stretch, 0.0, None),
            spring([3, 1], SpringKind::Bend, 0.0, None),
        ];
        assert_eq!(read_springs_csv(text, "a.csv", 4).expect("good springs"), expected);
        let short = read_springs_csv("particle_a,particle_b,stiffness\n0,1,10\n", "a.csv", 2);
        assert_eq!(short.expect("good springs"), [spring([0, 1], SpringKind::Stretch, 0.0, None)]);
    }

    #[test]
    fn an_error_names_file_line_column_and_what_is_allowed() {
        let head = "particle_a,particle_b,stiffness,damping,rest_length,kind";
        let with = |row: &str| format!("{head}\n0,1,5,,,\n{row}\n");
        for (text, told) in [
            (String::new(), "a.csv:1: is empty; allowed: a line such as particle_a,"),
            (head.to_owned(), "a.csv:1:1: names columns, and no springs follow; allowed: a line"),
            (head.replace(',', ";"), "a.csv:1:1: has other marks than commas"),
            (
                "particle_a,particle_b,stifness\n".to_owned(),
                "a.csv:1:23: has no meaning for a column 'stifness'; did you mean 'stiffness'?",
            ),
            ("particle_a,stiffness\n".to_owned(), "a.csv:1:1: has no column 'particle_b'"),
            ("particle_a,particle_a\n".to_owned(), "a.csv:1:12: has the column 'particle_a' a second time"),
            (with("1,2"), "a.csv:3:1: has 2 values; allowed: 6, one for each column"),
            (with("4,2,5,,,"), "a.csv:3:1: names point '4'; allowed: 0 to 3, the points of the mesh"),
            (with("1, -2,5,,,"), "a.csv:3:4: names point '-2'; allowed: 0 to 3"),
            (with("2,2,5,,,"), "a.csv:3:3: joins point 2 to itself; allowed: two points"),
            (with("1,2,nan,,,"), "a.csv:3:5: has the stiffness NaN; allowed: a finite number, 0 or more"),
            (with("1,2,,,,"), "a.csv:3:5: has ''; allowed: a number, with a point for fractions"),
            (with("1,2,-5,,,"), "a.csv:3:5: has the stiffness -5; allowed: a finite number, 0 or more"),
            (with("1,2,5,-1,,"), "a.csv:3:7: has the damping -1; allowed"),
            (with("1,2,5,,0,"), "a.csv:3:8: has the rest length 0; allowed: a finite number above 0"),
            (with("1,2,5,,x,"), "a.csv:3:8: has 'x'; allowed: a number"),
            (with("1,2,5,,,twist"), "a.csv:3:9: is of the kind 'twist'; allowed: stretch, shear, bend"),
            (with("\n1,0,5,,,"), "a.csv:4: joins the points 1 and 0, as line 2 does; allowed: one spring"),
        ] {
            let error = read_springs_csv(&text, "a.csv", 4).expect_err(told).to_string();
            assert!(error.starts_with(told), "{error}, not {told}");
        }
    }

    #[test]
    fn more_springs_or_pairs_than_a_cloth_holds_are_told_where_they_begin() {
        let text = "particle_a,particle_b,stiffness,kind\n0,1,5,\n1,2,5,\n2,3,6,\n3,0,6,bend\n";
        let most = |springs, laws| {
            read(text, "a.csv", 4, Most { springs, laws })
                .map_err(|error| error.to_string())
                .map(|read| read.len())
        };
        assert_eq!(most(4, 3), Ok(4));
        let told = "a.csv:5:1: has more than 3 springs; allowed: 3";
        assert_eq!(most(3, 3), Err(told.to_owned()));
        let told = "a.csv:5:1: has one more pair of stiffness and damping than the 2 before; \
                    allowed: 2 different pairs in a cloth";
        assert_eq!(most(4, 2), Err(told.to_owned()));
    }
}
