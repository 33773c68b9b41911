//! What the tests ask of every shape: an example and its definition, apart from its distance.

/// Axes of the examples, at right angles to each other and to none of the world's.
pub(super) const TURNED: [[f64; 3]; 3] = [
    [2.0 / 3.0, 2.0 / 3.0, -1.0 / 3.0],
    [-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0],
    [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0],
];
/// Where the examples are (m).
pub(super) const MIDDLE: [f64; 3] = [0.3, -0.2, 0.1];

/// A shape that the tests know by its definition.
pub(super) trait Sample: Sized {
    /// One of them, about `MIDDLE` and no larger than 2 m unless it is endless.
    fn example() -> Self;

    /// Whether a point is inside, from the definition of the solid alone.
    fn contains(&self, point: [f64; 3]) -> bool;

    /// Points of the surface from its definition, no further than 0.02 m from each other.
    fn surface(&self) -> Vec<[f64; 3]>;

    /// Numbers that make no such shape, and a word of the message.
    fn invalid_examples() -> Vec<(Self, &'static str)>;
}

/// The middle and a sum of lengths along directions.
pub(super) fn along(parts: &[(f64, [f64; 3])]) -> [f64; 3] {
    parts.iter().fold(MIDDLE, |sum, (length, way)| [0, 1, 2].map(|c| sum[c] + length * way[c]))
}

/// The point of a surface of revolution about the first axis: `height` along it, `radius` away from it.
#[allow(clippy::disallowed_methods, reason = "points of the tests, not of a step")]
pub(super) fn turned(height: f64, radius: f64, angle: f64) -> [f64; 3] {
    let [x, y, z] = TURNED;
    along(&[(height, x), (radius * angle.cos(), y), (radius * angle.sin(), z)])
}

/// All pairs of `a + 1` and `b + 1` numbers that divide 0 to 1 evenly.
pub(super) fn pairs(a: i32, b: i32) -> impl Iterator<Item = (f64, f64)> {
    let even = |count: i32| (0..=count).map(move |i| f64::from(i) / f64::from(count));
    even(a).flat_map(move |s| even(b).map(move |t| (s, t)))
}

/// A capsule's or a cylinder's ends, along the first axis and beside the middle by `ASIDE`.
pub(super) fn ends() -> [[f64; 3]; 2] {
    let [x, y, _] = TURNED;
    [along(&[(-0.7, x), (ASIDE, y)]), along(&[(0.9, x), (ASIDE, y)])]
}

/// A point of a surface about the line through `ends`, as in [`turned`].
pub(super) fn turned_aside(height: f64, radius: f64, angle: f64) -> [f64; 3] {
    let point = turned(height, radius, angle);
    [0, 1, 2].map(|c| point[c] + ASIDE * TURNED[1][c])
}

const ASIDE: f64 = 0.1;

/// Ends and radii that make no rod.
pub(super) fn invalid_rods() -> impl Iterator<Item = ([f64; 3], [f64; 3], f64)> {
    [(f64::NAN, 1.0, 1.0), (0.0, 0.0, 1.0), (0.0, f64::INFINITY, 1.0), (0.0, 1e-170, 1.0)]
        .into_iter()
        .chain([0.0, -1.0, f64::NAN, f64::INFINITY].map(|radius| (0.0, 1.0, radius)))
        .map(|(start, end, radius)| ([start; 3], [end; 3], radius))
}
