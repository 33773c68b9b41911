//! What becomes of the properties of a PLY: which elements and properties are read, and where their numbers go.

/// What becomes of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// It is skipped.
    Nothing,
    /// A number of a vertex: 0 to 2 its coordinates, 3 and 4 its texture coordinates, 5 its mass, 6 to 8 its velocity. Of an edge: 0
    /// and 1 its points, 2 its stiffness, 3 its damping, 4 its rest length, 5 its kind.
    Number(usize),
    /// The points of a face, a strip or a fan.
    Corners,
}

/// How many places numbers of an element have.
pub(super) const PLACES: usize = 9;
/// The place of the first texture coordinate.
pub(super) const U: Place = Place::Number(3);
/// The place of the second texture coordinate.
pub(super) const V: Place = Place::Number(4);
/// The place of the mass.
pub(super) const MASS: Place = Place::Number(5);

/// The places of the velocity.
pub(super) const VELOCITY: [Place; 3] = [Place::Number(6), Place::Number(7), Place::Number(8)];

/// The name of the element that may hold springs.
pub(super) const EDGE: &[u8] = b"edge";
/// The places without which an edge is no spring: its points, and its stiffness.
pub(super) const SPRING: [Place; 3] = [Place::Number(0), Place::Number(1), Place::Number(2)];
/// The index of the rest length of an edge, the one number that may be NaN.
pub(super) const REST_LENGTH: usize = 4;

/// The place of a property by its name and that of its element.
pub(super) fn place(element: &[u8], property: &[u8]) -> Place {
    match (element, property) {
        (b"vertex", b"x") => Place::Number(0),
        (b"vertex", b"y") => Place::Number(1),
        (b"vertex", b"z") => Place::Number(2),
        (b"vertex", b"u" | b"s" | b"texture_u") => U,
        (b"vertex", b"v" | b"t" | b"texture_v") => V,
        (b"vertex", b"mass") => MASS,
        (b"vertex", b"vx") => VELOCITY[0],
        (b"vertex", b"vy") => VELOCITY[1],
        (b"vertex", b"vz") => VELOCITY[2],
        (EDGE, b"vertex1") => SPRING[0],
        (EDGE, b"vertex2") => SPRING[1],
        (EDGE, b"stiffness") => SPRING[2],
        (EDGE, b"damping") => Place::Number(3),
        (EDGE, b"rest_length") => Place::Number(REST_LENGTH),
        (EDGE, b"kind") => Place::Number(5),
        (b"face" | b"tristrips" | b"trifans", b"vertex_indices" | b"vertex_index") => Place::Corners,
        _ => Place::Nothing,
    }
}

/// Whether a number may stand at a place of an element.
pub(super) fn may_be(element: &[u8], place: usize, number: f64) -> bool {
    number.is_finite() || number.is_nan() && element == EDGE && place == REST_LENGTH
}
