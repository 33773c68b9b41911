//! The numbers behind the header of a PLY: one element after the other, as text or binary.

use std::str::FromStr;

use super::{
    header::{Element, Encoding, Header, NumberType, Property},
    lines::{Lines, quoted, words},
    places::{PLACES, Place, may_be},
};
use crate::error::{ErrorKind, SceneError};

/// What is left of a payload.
#[derive(Clone, Debug)]
pub(super) struct Payload<'a> {
    file: &'a str,
    encoding: Encoding,
    lines: Lines<'a>,
}

/// The numbers of an element that a mesh keeps.
#[derive(Clone, Debug, Default)]
pub(super) struct Row {
    /// Those that have a place, as it allows them.
    pub(super) numbers: [f64; PLACES],
    /// Indices of points, as the file has them.
    pub(super) corners: Vec<i64>,
}

/// What is known of lists of points before they are read.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lists {
    /// Triangles that they give, at most.
    pub(super) triangles: usize,
    /// Points of the longest.
    pub(super) longest: usize,
}

impl<'a> Payload<'a> {
    /// All that follows a header; `file` is its name in messages.
    pub(super) fn new(header: &Header<'a>, file: &'a str) -> Self {
        Self { file, encoding: header.encoding, lines: header.payload.clone() }
    }

    /// Reads an element, `index` from 0 among those of its kind.
    ///
    /// # Errors
    /// An element that is not whole, a number that is none.
    pub(super) fn read(
        &mut self,
        element: &Element<'_>,
        index: u64,
        row: &mut Row,
    ) -> Result<(), SceneError> {
        row.corners.clear();
        match self.encoding {
            Encoding::Text => self.read_text(element, index, row),
            Encoding::LittleEndian | Encoding::BigEndian => self.read_binary(element, index, row),
        }
    }

    /// Passes over the elements of a kind and looks at their lists of points. It ends at one that is not whole, at which
    /// reading ends too; no number of a list is read.
    pub(super) fn pass(&mut self, element: &Element<'_>) -> Lists {
        let mut lists = Lists::default();
        let is_fixed = element.properties.iter().all(|property| property.count.is_none());
        if is_fixed && self.encoding != Encoding::Text {
            let size = element.least_bytes(self.encoding);
            let length = usize::try_from(element.count).ok().and_then(|count| count.checked_mul(size));
            if let Some(length) = length {
                self.lines.take_bytes(length);
            }
            return lists;
        }
        for _ in 0..element.count {
            let length = match self.encoding {
                Encoding::Text => self.pass_text(element),
                Encoding::LittleEndian | Encoding::BigEndian => self.pass_binary(element),
            };
            let Some(length) = length else { break };
            lists.triangles += length.saturating_sub(2);
            lists.longest = lists.longest.max(length);
        }
        lists
    }

    /// Passes over an element of a text, and gives the length of its list of points: 0 where it has none.
    fn pass_text(&mut self, element: &Element<'_>) -> Option<usize> {
        let line = self.lines.find(|line| !line.trim_ascii().is_empty())?;
        if !element.has(Place::Corners) {
            return Some(0);
        }
        let mut words = words(line);
        for property in &element.properties {
            let count = if property.count.is_some() { parsed::<u64>(words.next()?)? } else { 1 };
            if property.place == Place::Corners {
                // A number has a digit and what stands before it.
                return Some(usize::try_from(count).unwrap_or(usize::MAX).min(line.len() / 2));
            }
            for _ in 0..count {
                words.next()?;
            }
        }
        Some(0)
    }

    /// The same of a binary element.
    fn pass_binary(&mut self, element: &Element<'_>) -> Option<usize> {
        let mut length = 0;
        for property in &element.properties {
            let count = match property.count {
                None => 1,
                Some(number) => {
                    let bytes = self.lines.take_bytes(number.size())?;
                    usize::try_from(whole(number, bytes, self.encoding)).ok()?
                }
            };
            self.lines.take_bytes(count.checked_mul(property.number.size())?)?;
            if property.place == Place::Corners {
                length = count;
            }
        }
        Some(length)
    }

    /// Bytes that are left; blanks after a text do not count.
    pub(super) fn left_bytes(&self) -> usize {
        match self.encoding {
            Encoding::Text => self.lines.rest.trim_ascii().len(),
            Encoding::LittleEndian | Encoding::BigEndian => self.lines.rest.len(),
        }
    }

    /// The number of the line that was read last, of a text.
    pub(super) fn line(&self) -> Option<usize> {
        (self.encoding == Encoding::Text).then_some(self.lines.number)
    }

    /// An error in the element that was read last: with its line in a text.
    pub(super) fn error(&self, kind: ErrorKind, message: impl Into<String>) -> SceneError {
        let error = SceneError::new(kind, self.file, message);
        match self.encoding {
            Encoding::Text => error.at_line(self.lines.number),
            Encoding::LittleEndian | Encoding::BigEndian => error,
        }
    }

    /// An error in elements of a kind together, at the line of the header that announces them.
    pub(super) fn error_of_all(
        &self,
        element: &Element<'_>,
        kind: ErrorKind,
        message: impl Into<String>,
    ) -> SceneError {
        SceneError::new(kind, self.file, message).at_line(element.line)
    }

    /// An element is a line that is not blank.
    fn read_text(&mut self, element: &Element<'_>, index: u64, row: &mut Row) -> Result<(), SceneError> {
        let line = self.lines.find(|line| !line.trim_ascii().is_empty());
        let mut words = words(line.ok_or_else(|| self.ended(element, index))?);
        for property in &element.properties {
            let count = if property.count.is_none() {
                1
            } else {
                let word = words.next().unwrap_or_default();
                parsed::<u64>(word).ok_or_else(|| {
                    let (who, name) = (named(element, index), quoted(property.name));
                    let message = format!(
                        "{who} says that '{name}' has '{}' numbers; allowed: 0 or more",
                        quoted(word)
                    );
                    self.error(ErrorKind::Syntax, message)
                })?
            };

            for read in 0..count {
                let Some(word) = words.next() else {
                    let (who, name) = (named(element, index), quoted(property.name));
                    let message = match property.count {
                        None => {
                            format!("{who} ends before its '{name}'; allowed: every number of the header")
                        }
                        Some(_) => format!("{who} says that '{name}' has {count} numbers, but {read} follow"),
                    };
                    return Err(self.error(ErrorKind::Inconsistent, message));
                };
                match property.place {
                    Place::Nothing => {}
                    Place::Number(place) => {
                        let number =
                            parsed::<f64>(word).filter(|number| may_be(element.name, place, *number));
                        row.numbers[place] = number
                            .ok_or_else(|| self.no_number(&named(element, index), property, &quoted(word)))?;
                    }
                    Place::Corners => row.corners.push(parsed::<i64>(word).ok_or_else(|| {
                        let who = named(element, index);
                        let message =
                            format!("{who} names point '{}'; allowed: a whole number", quoted(word));
                        self.error(ErrorKind::Syntax, message)
                    })?),
                }
            }
        }

        let Some(word) = words.next() else { return Ok(()) };
        let message = format!(
            "{} goes on with '{}'; allowed: the numbers of the header, and a line for each element",
            named(element, index),
            quoted(word)
        );
        Err(self.error(ErrorKind::Inconsistent, message))
    }

    fn read_binary(&mut self, element: &Element<'_>, index: u64, row: &mut Row) -> Result<(), SceneError> {
        let encoding = self.encoding;
        for property in &element.properties {
            let count = match property.count {
                None => 1,
                Some(number) => {
                    let bytes = self.lines.take_bytes(number.size());
                    let count = whole(number, bytes.ok_or_else(|| self.ended(element, index))?, encoding);
                    usize::try_from(count).ok().ok_or_else(|| {
                        let (who, name) = (named(element, index), quoted(property.name));
                        let message =
                            format!("{who} says that '{name}' has {count} numbers; allowed: 0 or more");
                        self.error(ErrorKind::OutOfRange, message)
                    })?
                }
            };

            let size = property.number.size();
            let bytes = count.checked_mul(size).and_then(|length| self.lines.take_bytes(length));
            let bytes = bytes.ok_or_else(|| self.ended(element, index))?;
            match property.place {
                Place::Nothing => {}
                Place::Number(place) => {
                    let number = real(property.number, bytes, encoding);
                    if !may_be(element.name, place, number) {
                        return Err(self.no_number(&named(element, index), property, &number.to_string()));
                    }
                    row.numbers[place] = number;
                }
                Place::Corners => {
                    let numbers = bytes.chunks_exact(size);
                    row.corners.extend(numbers.map(|bytes| whole(property.number, bytes, encoding)));
                }
            }
        }
        Ok(())
    }

    fn no_number(&self, who: &str, property: &Property<'_>, found: &str) -> SceneError {
        let name = quoted(property.name);
        let message = format!("the '{name}' of {who} is '{found}'; allowed: a finite number");
        self.error(ErrorKind::BadMesh, message)
    }

    fn ended(&self, element: &Element<'_>, read: u64) -> SceneError {
        let (count, what) = (element.count, element.plural());
        let message = format!("announces {count} {what}, but the file ends after {read}");
        self.error_of_all(element, ErrorKind::Inconsistent, message)
    }
}

/// An element in a message.
pub(super) fn named(element: &Element<'_>, index: u64) -> String {
    format!("{} {index}", quoted(element.name))
}

fn parsed<T: FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The bits of a number, in the lowest places.
fn bits(bytes: &[u8], encoding: Encoding) -> u64 {
    let add = |bits: u64, byte: &u8| (bits << 8) | u64::from(*byte);
    match encoding {
        Encoding::BigEndian => bytes.iter().fold(0, add),
        Encoding::LittleEndian | Encoding::Text => bytes.iter().rev().fold(0, add),
    }
}

fn signed(bits: u64, size: usize) -> i64 {
    let unused = 64 - 8 * size;
    ((bits << unused) as i64) >> unused
}

/// A number of any type.
fn real(number: NumberType, bytes: &[u8], encoding: Encoding) -> f64 {
    let bits = bits(bytes, encoding);
    match number {
        NumberType::Signed(size) => signed(bits, size) as f64,
        NumberType::Unsigned(_) => bits as f64,
        NumberType::Float(4) => f64::from(f32::from_bits(bits as u32)),
        NumberType::Float(_) => f64::from_bits(bits),
    }
}

/// A whole number, at most the largest of 63 bits, which is no point of any mesh.
fn whole(number: NumberType, bytes: &[u8], encoding: Encoding) -> i64 {
    let bits = bits(bytes, encoding);
    match number {
        NumberType::Signed(size) => signed(bits, size),
        // A header in which fractions count or name points was refused.
        NumberType::Unsigned(_) | NumberType::Float(_) => i64::try_from(bits).unwrap_or(i64::MAX),
    }
}
