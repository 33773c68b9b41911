//! Unions of boxes, balls and rings at random: distances are those of all triangles of the parts, one part after the other.

use nappe_tests::{
    Random,
    meshes::{Surface, axes, icosphere, torus, turned_box12},
    scene::norm,
};

/// A part, and the box around it (m).
struct Part {
    surface: Surface,
    bounds: [[f64; 3]; 2],
}

/// How many points were looked at: inside the union, outside of it, and inside more than one part.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counts {
    pub(crate) inside: u32,
    pub(crate) outside: u32,
    pub(crate) shared: u32,
}

impl Part {
    /// A box, a ball or a ring somewhere within a cube of 2 m.
    fn at_random(random: &mut Random) -> Self {
        let center = random.vector().map(|c| 0.5 * c);
        let size = random.between(0.15, 0.5);
        let surface = match random.whole(0, 2) {
            0 => {
                let half = [0, 1, 2].map(|_| random.between(0.1, 0.5));
                turned_box12(center, half, axes(random.number(), random.number()))
            }
            1 => icosphere(center, size, 1),
            _ => torus(center, size, 0.4 * size, [9, 6]),
        };
        let bounds = [f64::min, f64::max].map(|of: fn(f64, f64) -> f64| {
            let first = surface.points[0];
            surface.points.iter().fold(first, |most, point| [0, 1, 2].map(|c| of(most[c], point[c])))
        });
        Self { surface, bounds }
    }

    /// A distance (m) that a point outside certainly has; 0 in the box around the part.
    fn at_least(&self, p: [f64; 3]) -> f64 {
        let [low, high] = self.bounds;
        norm([0, 1, 2].map(|c| (low[c] - p[c]).max(p[c] - high[c]).max(0.0)))
    }

    fn holds(&self, p: [f64; 3]) -> bool {
        self.at_least(p) == 0.0 && self.surface.winding(p) > 0.5
    }
}

/// The least of the signed distances (m) of a point from parts.
fn least(parts: &[Part], p: [f64; 3]) -> f64 {
    let mut nearest: Vec<(f64, &Part)> = parts.iter().map(|part| (part.at_least(p), part)).collect();
    nearest.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut least = f64::INFINITY;
    for (at_least, part) in nearest {
        // Several boxes may hold the point, and the part in any of them may be the deepest.
        if at_least > least.max(0.0) {
            break;
        }
        least = least.min(part.surface.distance(p));
    }
    least
}

/// A point anywhere, or near a corner of a surface.
fn point_about(surface: &Surface, random: &mut Random) -> [f64; 3] {
    let corner = surface.points[random.whole(0, surface.points.len() as u32 - 1) as usize];
    let away = random.vector();
    if random.chance(0.5) { away } else { [0, 1, 2].map(|c| corner[c] + 0.05 * away[c]) }
}

/// Compares distances from so many unions of 2 to `most` parts with those of the parts, at so many points each: outside they
/// are the least of these, and inside no part is deeper, and the union is no less deep.
///
/// # Panics
/// When one is not.
pub(crate) fn distances_are_those_of_unions(cases: u32, most: u32, points: u32) -> Counts {
    let mut random = Random::seeded(77);
    let mut counts = Counts::default();
    for case in 0..cases {
        let parts: Vec<Part> = (0..random.whole(2, most)).map(|_| Part::at_random(&mut random)).collect();
        let surfaces: Vec<Surface> = parts.iter().map(|part| part.surface.clone()).collect();
        let whole = Surface::joined(&surfaces);
        let collider = whole.collider(0.0, 0.0);
        for _ in 0..points {
            let p = point_about(&whole, &mut random);
            let (distance, normal) = collider.distance(p, 0.0);
            let expected = least(&parts, p);
            let label = format!("case {case} at {p:?}: {distance}, of the parts {expected}");
            assert!((norm(normal) - 1.0).abs() < 1e-12, "{label}: {normal:?}");
            if expected.abs() < 1e-9 {
                continue;
            }
            if expected > 0.0 {
                counts.outside += 1;
                assert!((distance - expected).abs() < 1e-12, "{label}");
                continue;
            }
            counts.inside += 1;
            counts.shared += u32::from(parts.iter().filter(|part| part.holds(p)).count() > 1);
            assert!(distance <= expected + 1e-12, "{label}");
            // What is no deeper than that in the union is within it.
            let away = random.vector();
            let size = 0.999 * distance / norm(away);
            let near = [0, 1, 2].map(|c| p[c] + size * away[c]);
            assert!(least(&parts, near) < 1e-9, "{label}, and {near:?} is outside");
        }
    }
    counts
}
