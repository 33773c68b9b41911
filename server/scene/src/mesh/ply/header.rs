//! The header of a PLY: how its numbers are written, and which elements with which properties follow.

use super::{
    lines::{Lines, quoted, words},
    places::{Place, place},
};
use crate::error::{ErrorKind, SceneError};

/// Most elements and properties of a header together, so that it takes little memory.
const MOST_LINES: usize = 256;
/// Bytes of the shortest line that announces one: `element a 1`.
const LEAST_LINE_BYTES: usize = 11;

/// How the numbers of a payload are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// The type of a number, with its bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberType {
    Signed(usize),
    Unsigned(usize),
    Float(usize),
}

/// A property of an element.
#[derive(Clone, Debug)]
pub(super) struct Property<'a> {
    pub(super) name: &'a [u8],
    /// The type of the count of a list; none: a single number.
    pub(super) count: Option<NumberType>,
    pub(super) number: NumberType,
    pub(super) place: Place,
}

/// Elements of one kind.
#[derive(Clone, Debug)]
pub(super) struct Element<'a> {
    pub(super) name: &'a [u8],
    /// As the header announces it: take no memory for it.
    pub(super) count: u64,
    pub(super) properties: Vec<Property<'a>>,
    /// The line of the header that announces them.
    pub(super) line: usize,
}

/// A header that can be read on.
#[derive(Clone, Debug)]
pub(super) struct Header<'a> {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element<'a>>,
    /// What is odd and was ignored.
    pub(super) warnings: Vec<String>,
    /// All that follows the header.
    pub(super) payload: Lines<'a>,
}

/// A line of a header, for messages.
#[derive(Clone, Copy, Debug)]
struct Here<'a> {
    file: &'a str,
    line: usize,
}

impl Here<'_> {
    fn error(self, kind: ErrorKind, message: impl Into<String>) -> SceneError {
        SceneError::new(kind, self.file, message).at_line(self.line)
    }
}

impl NumberType {
    const ALLOWED: &'static str = "char, uchar, short, ushort, int, uint, float, double, int8, uint8, int16, uint16, \
                                   int32, uint32, int64, uint64, float32, float64";

    fn named(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::Signed(1),
            b"uchar" | b"uint8" => Self::Unsigned(1),
            b"short" | b"int16" => Self::Signed(2),
            b"ushort" | b"uint16" => Self::Unsigned(2),
            b"int" | b"int32" => Self::Signed(4),
            b"uint" | b"uint32" => Self::Unsigned(4),
            b"int64" => Self::Signed(8),
            b"uint64" => Self::Unsigned(8),
            b"float" | b"float32" => Self::Float(4),
            b"double" | b"float64" => Self::Float(8),
            _ => return None,
        })
    }

    /// Bytes of a number.
    pub(super) const fn size(self) -> usize {
        match self {
            Self::Signed(size) | Self::Unsigned(size) | Self::Float(size) => size,
        }
    }
}

impl Element<'_> {
    /// Whether a property has this place.
    pub(super) fn has(&self, place: Place) -> bool {
        self.properties.iter().any(|property| property.place == place)
    }

    /// Its elements in a message.
    pub(super) fn plural(&self) -> String {
        match self.name {
            b"vertex" => "vertices".to_owned(),
            b"face" => "faces".to_owned(),
            name => format!("elements '{}'", quoted(name)),
        }
    }

    /// Bytes of one, at least: in a text a number has a digit and what ends it, and a list may be empty.
    pub(super) fn least_bytes(&self, encoding: Encoding) -> usize {
        let size = |number: NumberType| if encoding == Encoding::Text { 2 } else { number.size() };
        self.properties.iter().map(|property| size(property.count.unwrap_or(property.number))).sum()
    }
}

impl<'a> Header<'a> {
    /// Reads a header; `file` is its name in messages.
    ///
    /// # Errors
    /// The first error, with its line.
    pub(super) fn read(bytes: &'a [u8], file: &str) -> Result<Self, SceneError> {
        let mut lines = Lines::new(bytes);
        let first = lines.next().unwrap_or_default();
        if first.trim_ascii() != b"ply" {
            let message = format!("begins with '{}'; allowed: ply, the first line of a PLY", quoted(first));
            return Err(Here { file, line: 1 }.error(ErrorKind::Syntax, message));
        }

        let mut elements: Vec<Element<'a>> = Vec::new();
        let (mut encoding, mut warnings) = (None, Vec::new());
        let has_last_end = matches!(bytes.last(), Some(b'\n' | b'\r'));
        loop {
            let next = lines.next();
            // A line that the file ends in is a part of one, unless it is the last that is needed.
            let is_part = !has_last_end && lines.rest.is_empty();
            let Some(line) = next.filter(|line| !is_part || line.trim_ascii() == b"end_header") else {
                let message = "ends within its header; allowed: a line end_header before the numbers (the file may be cut)";
                return Err(Here { file, line: lines.number }.error(ErrorKind::Syntax, message));
            };
            let here = Here { file, line: lines.number };
            // One word more than the longest line has, which a comment may have.
            let found: Vec<&[u8]> = words(line).take(6).collect();
            match found[..] {
                [] | [b"comment" | b"obj_info", ..] => {}
                [b"format", name, version] => encoding = Some(format(here, name, version)?),
                [b"element", name, count] => elements.push(element(here, &elements, name, count)?),
                [b"property", b"list", count, number, name] => {
                    add(here, &mut elements, &mut warnings, (Some(count), number, name))?;
                }
                [b"property", number, name] => add(here, &mut elements, &mut warnings, (None, number, name))?,
                [b"end_header"] => break,
                _ => {
                    let message = format!(
                        "says '{}'; allowed in a header: format, comment, obj_info, element NAME COUNT, \
                         property TYPE NAME, property list TYPE TYPE NAME, end_header",
                        quoted(line)
                    );
                    return Err(here.error(ErrorKind::Syntax, message));
                }
            }
            if elements.iter().map(|element| 1 + element.properties.len()).sum::<usize>() > MOST_LINES {
                let message =
                    format!("has more than {MOST_LINES} elements and properties, which are allowed");
                return Err(here.error(ErrorKind::TooLarge, message));
            }
        }

        let end = Here { file, line: lines.number };
        let Some(encoding) = encoding else {
            let message = "ends a header without its format; allowed: a line 'format ascii 1.0', \
                           'format binary_little_endian 1.0' or 'format binary_big_endian 1.0' in it";
            return Err(end.error(ErrorKind::Syntax, message));
        };
        check(end, &elements, &mut warnings)?;
        Ok(Self { encoding, elements, warnings, payload: lines })
    }

    /// Elements that the payload can hold, the last of them perhaps cut; all where they take no place.
    fn most_elements(&self, element: &Element<'_>) -> u64 {
        let whole = self.payload.rest.len().checked_div(element.least_bytes(self.encoding));
        whole.map_or(u64::MAX, |whole| whole as u64 + 1)
    }

    /// Refuses elements that are more than the payload can hold, before memory is taken for them.
    ///
    /// # Errors
    /// The first such element, at the line that announces it.
    pub(super) fn check_counts(&self, file: &str) -> Result<(), SceneError> {
        let too_many = |element: &&Element<'_>| element.count > self.most_elements(element);
        let Some(element) = self.elements.iter().find(too_many) else { return Ok(()) };
        let (what, least) = (element.plural(), element.least_bytes(self.encoding));
        let message = format!(
            "announces {} {what} of {least} bytes or more each, but {} bytes follow the header (the file may be cut)",
            element.count,
            self.payload.rest.len()
        );
        Err(Here { file, line: element.line }.error(ErrorKind::Inconsistent, message))
    }

    /// Bytes that reading it took at most, where a vector that grows takes `growth` times its elements.
    pub(super) fn memory_bytes(&self, growth: u64) -> u64 {
        let of_properties =
            |element: &Element<'_>| vector_bytes::<Property<'_>>(element.properties.len(), growth);
        let own = vector_bytes::<Element<'_>>(self.elements.len(), growth);
        own + self.elements.iter().map(of_properties).sum::<u64>()
    }

    /// The same for any header in a file of so many bytes, also one that is refused.
    pub(super) fn most_bytes(file_bytes: usize, growth: u64) -> u64 {
        let count = MOST_LINES.min(1 + file_bytes / LEAST_LINE_BYTES);
        let of_properties = count as u64 * vector_bytes::<Property<'_>>(1, growth);
        vector_bytes::<Element<'_>>(count, growth) + of_properties
    }
}

/// Bytes of a vector of so many, which has room for four as soon as it has one.
fn vector_bytes<T>(count: usize, growth: u64) -> u64 {
    (growth * count as u64).max(4) * size_of::<T>() as u64
}

fn format(here: Here<'_>, name: &[u8], version: &[u8]) -> Result<Encoding, SceneError> {
    if version != b"1.0" {
        let message = format!("has the version '{}' of PLY; allowed: 1.0", quoted(version));
        return Err(here.error(ErrorKind::Unsupported, message));
    }
    match name {
        b"ascii" => Ok(Encoding::Text),
        b"binary_little_endian" => Ok(Encoding::LittleEndian),
        b"binary_big_endian" => Ok(Encoding::BigEndian),
        _ => {
            let message = format!(
                "has the format '{}'; allowed: ascii, binary_little_endian, binary_big_endian",
                quoted(name)
            );
            Err(here.error(ErrorKind::Unsupported, message))
        }
    }
}

fn element<'a>(
    here: Here<'_>,
    before: &[Element<'a>],
    name: &'a [u8],
    count: &[u8],
) -> Result<Element<'a>, SceneError> {
    if before.iter().any(|element| element.name == name) {
        let message = format!("has the element '{}' a second time; allowed: once", quoted(name));
        return Err(here.error(ErrorKind::Inconsistent, message));
    }
    let number = std::str::from_utf8(count).ok().and_then(|count| count.parse::<u64>().ok());
    let count = number.ok_or_else(|| {
        let message = format!(
            "announces '{}' elements '{}'; allowed: a whole number, 0 or more",
            quoted(count),
            quoted(name)
        );
        here.error(ErrorKind::Syntax, message)
    })?;
    Ok(Element { name, count, properties: Vec::new(), line: here.line })
}

/// Adds a property to the last element, from the types of its count and its numbers, and its name.
fn add<'a>(
    here: Here<'_>,
    elements: &mut [Element<'a>],
    warnings: &mut Vec<String>,
    (count, number, name): (Option<&[u8]>, &[u8], &'a [u8]),
) -> Result<(), SceneError> {
    let Some(element) = elements.last_mut() else {
        let message = "has a property before any element; allowed: element NAME COUNT first";
        return Err(here.error(ErrorKind::Syntax, message));
    };
    let named = |name: &[u8]| {
        NumberType::named(name).ok_or_else(|| {
            let message = format!("has the type '{}'; allowed: {}", quoted(name), NumberType::ALLOWED);
            here.error(ErrorKind::Unsupported, message)
        })
    };
    let (count, number) = (count.map(named).transpose()?, named(number)?);
    if matches!(count, Some(NumberType::Float(_))) {
        let message = format!(
            "counts the numbers of '{}' by a type of fractions; allowed: a type of whole numbers such as uchar",
            quoted(name)
        );
        return Err(here.error(ErrorKind::Syntax, message));
    }

    let mut place = place(element.name, name);
    let wrong = match (place, count, number) {
        (Place::Number(_), Some(_), _) => Some("is a list; allowed: one number"),
        (Place::Corners, None, _) => {
            Some("is one number; allowed: a list, as in property list uchar int NAME")
        }
        (Place::Corners, Some(_), NumberType::Float(_)) => {
            Some("names points by fractions; allowed: a type of whole numbers such as int")
        }
        _ => None,
    };
    if let Some(wrong) = wrong {
        let message = format!("the property '{}' of '{}' {wrong}", quoted(name), quoted(element.name));
        return Err(here.error(ErrorKind::WrongType, message));
    }
    if let Some(first) = element.properties.iter().find(|property| property.place == place)
        && place != Place::Nothing
    {
        let (Here { file, line }, name, first) = (here, quoted(name), quoted(first.name));
        warnings.push(format!("{file}:{line}: '{name}' says again what '{first}' says, which is kept"));
        place = Place::Nothing;
    }
    element.properties.push(Property { name, count, number, place });
    Ok(())
}

/// The elements make a mesh, whole or as points alone.
fn check(end: Here<'_>, elements: &[Element<'_>], warnings: &mut Vec<String>) -> Result<(), SceneError> {
    let Some(vertex) = elements.iter().find(|element| element.name == b"vertex") else {
        let message = "has no element 'vertex'; allowed: one with the properties x, y and z";
        return Err(end.error(ErrorKind::BadMesh, message));
    };
    let missing = ["x", "y", "z"].into_iter().enumerate().find(|(at, _)| !vertex.has(Place::Number(*at)));
    if let Some((_, missing)) = missing {
        let message = format!("the element 'vertex' has no property '{missing}'; allowed: x, y and z");
        return Err(Here { line: vertex.line, ..end }.error(ErrorKind::BadMesh, message));
    }

    let of_triangles = |element: &&Element<'_>| matches!(element.name, b"face" | b"tristrips" | b"trifans");
    if let Some(bare) = elements.iter().filter(of_triangles).find(|e| e.count > 0 && !e.has(Place::Corners)) {
        let message = format!(
            "the element '{}' has no list of points; allowed: property list uchar int vertex_indices",
            quoted(bare.name)
        );
        return Err(Here { line: bare.line, ..end }.error(ErrorKind::BadMesh, message));
    }
    if elements.iter().any(|element| of_triangles(&element)) {
        return Ok(());
    }

    let has_list =
        |element: &&Element<'_>| element.properties.iter().any(|property| property.count.is_some());
    for other in elements.iter().filter(has_list).filter(|element| element.name != b"vertex") {
        if other.name == b"range_grid" {
            let message = "holds a range scan (the element 'range_grid'), which has no triangles: convert it to a mesh first, \
                           for instance with MeshLab";
            return Err(Here { line: other.line, ..end }.error(ErrorKind::Unsupported, message));
        }
        let (Here { file, .. }, line, name) = (end, other.line, quoted(other.name));
        warnings.push(format!(
            "{file}:{line}: the element '{name}' is not read, and there is no element 'face': points alone are read"
        ));
    }
    Ok(())
}
