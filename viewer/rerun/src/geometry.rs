//! What shading and the camera need from bare positions: normals and bounds.
//!
//! Enters: flat positions (m), triangles. Leaves: unit normals at the vertices, a bounding box (m).

/// Unit normal of each vertex: the mean of its triangles' normals, weighted by their areas.
/// A vertex of no triangle, or of flat ones only, points up.
pub(crate) fn vertex_normals(points: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut normals = vec![[0.0_f32; 3]; points.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|index| points[index as usize]);
        // Twice the area times the unit normal.
        let normal = cross(minus(b, a), minus(c, a));
        for &index in triangle {
            let sum = &mut normals[index as usize];
            *sum = [sum[0] + normal[0], sum[1] + normal[1], sum[2] + normal[2]];
        }
    }
    for normal in &mut normals {
        *normal = unit(*normal).unwrap_or([0.0, 1.0, 0.0]);
    }
    normals
}

/// A box around points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    low: [f32; 3],
    high: [f32; 3],
}

impl Bounds {
    /// The box of no point.
    pub(crate) fn empty() -> Self {
        Self { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] }
    }

    /// Grows to hold a point.
    pub(crate) fn add(&mut self, point: [f32; 3]) {
        for axis in 0..3 {
            self.low[axis] = self.low[axis].min(point[axis]);
            self.high[axis] = self.high[axis].max(point[axis]);
        }
    }

    /// The point of the box, grown to `reach` times its radius on every side, that is nearest to `point`.
    pub(crate) fn nearest(&self, point: [f32; 3], reach: f32) -> [f32; 3] {
        let (center, far) = (self.center(), reach * self.radius());
        std::array::from_fn(|axis| point[axis].clamp(center[axis] - far, center[axis] + far))
    }

    /// The eight corners (m), the lowest first; the origin eight times if the box is empty.
    pub(crate) fn corners(&self) -> [[f32; 3]; 8] {
        if self.low[0] > self.high[0] {
            return [[0.0; 3]; 8];
        }
        let ends = [self.low, self.high];
        std::array::from_fn(|i| [ends[i & 1][0], ends[i >> 1 & 1][1], ends[i >> 2][2]])
    }

    /// Centre (m); the origin if the box is empty.
    pub(crate) fn center(&self) -> [f32; 3] {
        if self.low[0] > self.high[0] {
            return [0.0; 3];
        }
        std::array::from_fn(|axis| 0.5 * (self.low[axis] + self.high[axis]))
    }

    /// Half of its smallest extent (m); 0 if the box is empty.
    pub(crate) fn half_width(&self) -> f32 {
        minus(self.high, self.low).into_iter().fold(f32::INFINITY, f32::min).max(0.0) * 0.5
    }

    /// Radius of the ball around it (m); 1 if the box is empty or a point.
    pub(crate) fn radius(&self) -> f32 {
        let radius = 0.5 * length(minus(self.high, self.low));
        if radius.is_finite() && radius > 0.0 { radius } else { 1.0 }
    }
}

/// Two unit vectors that make a right-handed frame with the unit vector `normal`.
pub(crate) fn tangents(normal: [f32; 3]) -> [[f32; 3]; 2] {
    // The axis farthest from the normal, so that the cross product is not small.
    let helper = if normal[1].abs() < 0.9 { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
    let first = unit(cross(helper, normal)).unwrap_or([1.0, 0.0, 0.0]);
    [first, cross(normal, first)]
}

/// `a + s b`.
pub(crate) fn along(a: [f32; 3], s: f32, b: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|axis| a[axis] + s * b[axis])
}

pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    along(a, -1.0, b)
}

pub(crate) fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A vector of the contract in the precision of a picture.
pub(crate) fn narrow(v: [f64; 3]) -> [f32; 3] {
    v.map(|value| value as f32)
}

pub(crate) fn length(a: [f32; 3]) -> f32 {
    dot(a, a).sqrt()
}

pub(crate) fn unit(a: [f32; 3]) -> Option<[f32; 3]> {
    let length = length(a);
    (length > f32::MIN_POSITIVE).then(|| a.map(|value| value / length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_sheet_has_one_normal() {
        let points = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0]];
        let normals = vertex_normals(&points, &[[0, 1, 2], [2, 1, 3]]);
        assert_eq!(normals, [[0.0, 1.0, 0.0]; 4]);
    }

    #[test]
    fn a_large_triangle_weighs_more_than_a_small_one() {
        // One triangle of area 2 facing y, one of area 0.5 facing x, sharing vertex 0.
        let points = [[0.0; 3], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let normals = vertex_normals(&points, &[[0, 1, 2], [0, 3, 4]]);
        let expected = [1.0 / 17.0_f32.sqrt(), 4.0 / 17.0_f32.sqrt(), 0.0];
        for axis in 0..3 {
            assert!((normals[0][axis] - expected[axis]).abs() < 1e-6, "{:?}", normals[0]);
        }
    }

    #[test]
    fn a_vertex_without_area_points_up() {
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [5.0, 5.0, 5.0]];
        assert_eq!(vertex_normals(&points, &[[0, 1, 2]]), [[0.0, 1.0, 0.0]; 4]);
    }

    #[test]
    fn tangents_make_a_right_handed_frame_with_any_normal() {
        for normal in [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 0.6, -0.8]]
        {
            let [first, second] = tangents(normal);
            assert!((length(first) - 1.0).abs() < 1e-6);
            assert!((dot(cross(first, second), normal) - 1.0).abs() < 1e-6, "{normal:?}");
        }
    }

    #[test]
    fn a_box_knows_its_middle_and_its_radius() {
        let mut bounds = Bounds::empty();
        bounds.add([1.0, 1.0, 1.0]);
        bounds.add([3.0, -3.0, 5.0]);
        assert_eq!((bounds.center(), bounds.radius()), ([2.0, -1.0, 3.0], 3.0));
    }

    #[test]
    fn a_point_far_away_is_drawn_near() {
        let mut bounds = Bounds::empty();
        bounds.add([0.0, 0.0, 1.0]);
        bounds.add([0.0, 0.0, 3.0]);
        assert_eq!(bounds.nearest([9.0, 0.5, -9.0], 2.0), [2.0, 0.5, 0.0]);
    }

    #[test]
    fn the_box_of_no_point_is_the_unit_ball_at_the_origin() {
        assert_eq!((Bounds::empty().center(), Bounds::empty().radius()), ([0.0; 3], 1.0));
    }
}
