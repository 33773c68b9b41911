//! Triangle meshes: edges, pairs of triangles, springs of their own, what is wrong with them. No physics.

mod by_point;
mod corners;
mod springs;
mod groups;
mod repeats;
mod slivers;
mod kept;
mod weld;
mod junctions;
mod survey;
mod around;
#[cfg(test)]
mod tests;

use thiserror::Error;

use crate::math::four_digits;

pub(crate) use self::{by_point::sorted, corners::is_degenerate};
pub use self::{
    groups::Groups,
    junctions::TJunctions,
    springs::{MeshSpring, SpringKind, repeated_spring},
    survey::Survey,
    weld::Welded,
};

use self::{
    corners::corner_edges,
    repeats::{Repeats, crowded_edges, drop_repeats, repeated_triangles},
    slivers::{CANDIDATES, Close, close},
};

/// A triangle mesh as it came from a file, an upload or a formula.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Positions of the points (m).
    pub points: Vec<[f64; 3]>,
    /// Point indices, three per triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Masses (kg), one per point, 0 pins it; empty when the mesh carries none.
    pub masses: Vec<f64>,
    /// Texture coordinates, one pair per point; empty when the mesh carries none.
    pub uv: Vec<[f64; 2]>,
    /// Velocities (m/s), one per point; empty when the mesh carries none.
    pub velocities: Vec<[f64; 3]>,
    /// Springs of its own; empty when the mesh carries none.
    pub springs: Vec<MeshSpring>,
}

/// A mesh that cannot be simulated.
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum MeshError {
    #[error("the mesh has no points")]
    Empty,
    #[error("the mesh has {count} points, more than {allowed}")]
    TooLarge { count: usize, allowed: usize },
    #[error("point {point} is not finite: {value:?}")]
    PointNotFinite { point: usize, value: [f64; 3] },
    #[error("triangle {triangle} names point {point}, but there are only {count} points (0 to {last})", last = count - 1)]
    PointOutOfRange { triangle: usize, point: u32, count: usize },
    #[error("{masses} masses for {points} points: one a point is needed")]
    MassCount { masses: usize, points: usize },
    #[error("the mass of point {point} is {value}: a mass is a finite number, 0 (pinned) or more")]
    BadMass { point: usize, value: f64 },
    #[error("the texture coordinates of point {point} are not finite: {value:?}")]
    UvNotFinite { point: usize, value: [f64; 2] },
    #[error("{uv} texture coordinates for {points} points: one pair a point is needed, or none")]
    UvCount { uv: usize, points: usize },
    #[error("{velocities} velocities for {points} points: one a point is needed, or none")]
    VelocityCount { velocities: usize, points: usize },
    #[error("the velocity of point {point} is not finite: {value:?}")]
    VelocityNotFinite { point: usize, value: [f64; 3] },
    #[error("spring {spring} names point {point}, but there are only {count} points (0 to {last})", last = count - 1)]
    SpringPoint { spring: usize, point: u32, count: usize },
    #[error("spring {spring} joins point {point} to itself: two points are needed")]
    SpringToItself { spring: usize, point: u32 },
    #[error("the {what} of spring {spring} is {value}; allowed: {allowed}")]
    BadSpring { spring: usize, what: &'static str, value: f64, allowed: &'static str },
    #[error(
        "points cannot be joined over {distance} m; allowed for this mesh: {} to {} m, a tenth of its median edge",
        four_digits(*least),
        four_digits(*most)
    )]
    WeldRange { distance: f64, least: f64, most: f64 },
    #[error(
        "points cannot be joined over {distance} m: too many lie about that far from each other to be compared; allowed: less"
    )]
    WeldTooDense { distance: f64 },
}

/// Something odd in a mesh that does not stop a simulation.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum MeshWarning {
    /// Points that no triangle names: they fall freely.
    Isolated { count: usize, first: usize },
    /// Triangles that name a point twice: they give the edges that remain.
    Degenerate { count: usize, first: usize },
    /// Triangles whose three points an earlier one has; `turned` of them run the other way round.
    Repeated { count: usize, first: usize, turned: usize },
    /// Triangles of which no two share a point.
    Scattered { triangles: usize },
    /// Edges with more than two triangles.
    NonManifold { count: usize, first: [u32; 2] },
    /// Edges below 1/50 of the median edge (lengths in m).
    Slivers { count: usize, worst: [u32; 2], length: f64, median: f64 },
    /// Points within 1/50 of the median edge of another that no edge joins to them (distances in m).
    NearPoints { count: usize, worst: [u32; 2], distance: f64, median: f64 },
}

impl std::fmt::Display for MeshWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Isolated { count, first } => {
                write!(
                    f,
                    "{count} isolated points, the first is {first}: no triangle names them, so they fall freely; \
                     unused = \"drop\" in the body's mesh leaves them out"
                )
            }
            Self::Degenerate { count, first } => {
                write!(f, "{count} degenerate triangles, the first is {first}: they name a point twice")
            }
            Self::Repeated { count, first, turned } => {
                write!(f, "{count} repeated triangles, the first is {first}: each counts once")?;
                match turned {
                    0 => Ok(()),
                    _ => {
                        write!(f, "; {turned} of them run the other way round, as on a sheet with two sides")
                    }
                }
            }
            Self::Scattered { triangles } => write!(
                f,
                "no two of the {triangles} triangles share a point, so that a cloth of them falls apart: weld = 1e-6 in the \
                 body's mesh joins points at the same place"
            ),
            Self::NonManifold { count, first } => {
                write!(
                    f,
                    "{count} edges with more than two triangles, the first is {} to {}",
                    first[0], first[1]
                )
            }
            Self::Slivers { count, worst: [a, b], length, median } => write!(
                f,
                "{}{count} edges shorter than 1/50 of the median edge ({} m), the shortest is {a} to {b}: {} m; \
                 they make the largest stretch mean little, and explicit steps tiny",
                if *count < CANDIDATES { "" } else { "at least " },
                four_digits(*median),
                four_digits(*length)
            ),
            Self::NearPoints { count, worst: [a, b], distance, median } => write!(
                f,
                "{count} points nearly coincide with others (1/50 of the median edge, {} m) and no edge joins them, \
                 the closest are {a} and {b}, {} m apart: points of a seam that was to be closed?",
                four_digits(*median),
                four_digits(*distance)
            ),
        }
    }
}

impl MeshWarning {
    fn repeated(Repeats { count, first, turned }: Repeats) -> Self {
        Self::Repeated { count, first, turned }
    }
}

/// Two triangles that share an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pair {
    /// The shared edge.
    pub edge: [u32; 2],
    /// The two points opposite to it, the smaller first.
    pub opposite: [u32; 2],
}

impl TriangleMesh {
    /// The largest number of points: indices are 32 bits, and a vector's offset must fit too.
    pub const MAX_POINTS: usize = (u32::MAX / 4) as usize;

    /// A flat sheet of `columns` x `rows` points, `spacing` (m) apart, in the plane y = 0:
    /// point `r * columns + c` at (c, 0, r) spacing. Two triangles per cell, seen from above.
    pub fn grid(columns: usize, rows: usize, spacing: f64) -> Self {
        let mut mesh = Self::default();
        for r in 0..rows {
            for c in 0..columns {
                mesh.points.push([c as f64 * spacing, 0.0, r as f64 * spacing]);
                mesh.uv.push([
                    c as f64 / columns.saturating_sub(1).max(1) as f64,
                    1.0 - r as f64 / rows.saturating_sub(1).max(1) as f64,
                ]);
            }
        }
        mesh.triangles = grid_triangles(columns, rows);
        mesh
    }

    /// Checks ranges and numbers; what does not stop a simulation is a warning.
    ///
    /// # Errors
    /// The first error that makes the mesh unusable.
    pub fn check(&self) -> Result<Vec<MeshWarning>, MeshError> {
        self.validate()?;
        Ok(self.warnings())
    }

    /// Checks ranges and numbers alone.
    ///
    /// # Errors
    /// The first error that makes the mesh unusable.
    pub fn validate(&self) -> Result<(), MeshError> {
        let count = self.points.len();
        if count == 0 {
            return Err(MeshError::Empty);
        }
        if count > Self::MAX_POINTS {
            return Err(MeshError::TooLarge { count, allowed: Self::MAX_POINTS });
        }

        if let Some(point) = self.points.iter().position(|p| p.iter().any(|c| !c.is_finite())) {
            return Err(MeshError::PointNotFinite { point, value: self.points[point] });
        }

        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(&point) = corners.iter().find(|&&p| p as usize >= count) {
                return Err(MeshError::PointOutOfRange { triangle, point, count });
            }
        }

        if !self.masses.is_empty() && self.masses.len() != count {
            return Err(MeshError::MassCount { masses: self.masses.len(), points: count });
        }
        if let Some(point) = self.masses.iter().position(|m| !m.is_finite() || *m < 0.0) {
            return Err(MeshError::BadMass { point, value: self.masses[point] });
        }

        if !self.velocities.is_empty() && self.velocities.len() != count {
            return Err(MeshError::VelocityCount { velocities: self.velocities.len(), points: count });
        }
        if let Some(point) = self.velocities.iter().position(|v| v.iter().any(|c| !c.is_finite())) {
            return Err(MeshError::VelocityNotFinite { point, value: self.velocities[point] });
        }
        if !self.uv.is_empty() && self.uv.len() != count {
            return Err(MeshError::UvCount { uv: self.uv.len(), points: count });
        }
        if let Some(point) = self.uv.iter().position(|uv| uv.iter().any(|c| !c.is_finite())) {
            return Err(MeshError::UvNotFinite { point, value: self.uv[point] });
        }
        self.validate_springs()
    }

    /// Checks the points and the numbers of its springs.
    fn validate_springs(&self) -> Result<(), MeshError> {
        let count = self.points.len();
        for (spring, of) in self.springs.iter().enumerate() {
            if let Some(&point) = of.points.iter().find(|&&point| point as usize >= count) {
                return Err(MeshError::SpringPoint { spring, point, count });
            }
            if of.points[0] == of.points[1] {
                return Err(MeshError::SpringToItself { spring, point: of.points[0] });
            }
            if let Some((what, value, allowed)) = of.wrong_number() {
                return Err(MeshError::BadSpring { spring, what, value, allowed });
            }
        }
        Ok(())
    }

    /// Leaves out triangles whose points an earlier one has, whatever their order; the warning says how many are gone.
    ///
    /// # Panics
    /// On a mesh that [`TriangleMesh::validate`] refuses.
    pub fn drop_repeated(&mut self) -> Option<MeshWarning> {
        let repeats = repeated_triangles(&self.triangles, self.points.len())?;
        drop_repeats(&mut self.triangles, self.points.len());
        Some(MeshWarning::repeated(repeats))
    }

    /// Edges of the triangles, each once, the smaller index first, in ascending order.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let edges = self.triangles.iter().flat_map(corner_edges).map(|[a, b]| (a, b));
        let mut edges = sorted(edges, self.points.len());
        edges.dedup();
        edges.into_iter().map(|(a, b)| [a, b]).collect()
    }

    /// Pairs of triangles that share an edge, in the order of their edges. Where more than two
    /// triangles meet, neighbours in the order of their opposite points are paired.
    pub fn pairs(&self) -> Vec<Pair> {
        let sides = self.sides();
        let next = |pair: &[(u32, (u32, u32))]| {
            let [(p, (q, first)), (r, (s, second))] = [pair[0], pair[1]];
            ([p, q] == [r, s]).then_some(Pair { edge: [p, q], opposite: [first, second] })
        };
        sides.windows(2).filter_map(next).collect()
    }

    /// The sides of all triangles, in the order of their edges: an edge, the smaller point first, and the point opposite to
    /// it. Sides of the same three points are one.
    fn sides(&self) -> Vec<(u32, (u32, u32))> {
        let sound = self.triangles.iter().filter(|t| !is_degenerate(t));
        let sides = sound.flat_map(|&[a, b, c]| {
            [(a, b, c), (b, c, a), (c, a, b)].map(|(p, q, opposite)| (p.min(q), (p.max(q), opposite)))
        });
        let mut sides = sorted(sides, self.points.len());
        sides.dedup();
        sides
    }

    fn warnings(&self) -> Vec<MeshWarning> {
        let mut warnings = Vec::new();
        let mut used = vec![false; self.points.len()];
        let mut share_points = false;
        for corners in &self.triangles {
            share_points |= corners.iter().any(|&p| used[p as usize]);
            for &p in corners {
                used[p as usize] = true;
            }
        }

        for &point in self.springs.iter().flat_map(|spring| &spring.points) {
            used[point as usize] = true;
        }

        let isolated = used.iter().filter(|u| !**u).count();
        if let Some(first) = used.iter().position(|u| !u) {
            warnings.push(MeshWarning::Isolated { count: isolated, first });
        }

        let degenerate = self.triangles.iter().filter(|t| is_degenerate(t)).count();
        if let Some(first) = self.triangles.iter().position(is_degenerate) {
            warnings.push(MeshWarning::Degenerate { count: degenerate, first });
        }

        let points = self.points.len();
        warnings.extend(repeated_triangles(&self.triangles, points).map(MeshWarning::repeated));
        if self.triangles.len() > 1 && !share_points {
            warnings.push(MeshWarning::Scattered { triangles: self.triangles.len() });
        }
        if let Some((count, first)) = crowded_edges(&self.triangles, points) {
            warnings.push(MeshWarning::NonManifold { count, first });
        }

        let [edges, near] = close(&self.points, &self.triangles);
        if let Some(Close { count, points: worst, distance: length, median }) = edges {
            warnings.push(MeshWarning::Slivers { count, worst, length, median });
        }
        if let Some(Close { count, points: worst, distance, median }) = near {
            warnings.push(MeshWarning::NearPoints { count, worst, distance, median });
        }
        warnings
    }
}

/// The triangles of a grid of points numbered row by row: two per cell, (a, a+1, a+n) and
/// (a+1, a+n+1, a+n).
pub fn grid_triangles(columns: usize, rows: usize) -> Vec<[u32; 3]> {
    let mut triangles = Vec::new();
    for r in 0..rows.saturating_sub(1) {
        for c in 0..columns.saturating_sub(1) {
            let (a, n) = ((r * columns + c) as u32, columns as u32);
            triangles.push([a, a + 1, a + n]);
            triangles.push([a + 1, a + n + 1, a + n]);
        }
    }
    triangles
}
