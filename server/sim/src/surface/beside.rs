//! How far apart parts of triangles that share a particle certainly are, where a surface bends little.
//!
//! Reads places (m) and ways (m); gives a distance (m). Most pairs of parts that come into each other's boxes belong to triangles that share a
//! particle. One look per triangle tells that none of its pairs with those beside it is near: seen from the triangle, the particles about
//! it lie where an affine map of their places at rest has them, but for a deviation. So no pair is nearer than at rest,
//! times the least stretch of the map, less the largest deviation.

use super::{
    distance::{PairKind, closest},
    faces::Faces,
};
use crate::{interrupt, math::Vec3};

/// Triangles that share particles with one, about each of its corners, beyond which nothing is kept of it: each has some twenty on a good mesh.
const MANY: usize = 64;
/// Area over the square of an edge, below which a triangle is a needle.
const NARROW: f64 = 1e-4;

/// What is known at rest of a surface about each triangle and those of greater number that share a particle with it.
#[derive(Clone, Debug, Default)]
pub struct Beside {
    of_each: Vec<One>,
    /// Triangles beside each, ascending, and particles of theirs that are not its own.
    triangles: Vec<u32>,
    particles: Vec<Around>,
}

#[derive(Clone, Copy, Debug)]
struct One {
    /// Where its triangles and its particles end: they begin where those of the one before end.
    ends: [u32; 2],
    /// The least distance (m) at rest, in its plane, of a pair of parts that share no particle; 0 where its plane is not known.
    least: f64,
    /// Inverse of the Cholesky factor of the products of its two edges at rest (1/m): by rows, 3 numbers.
    inverse: [f64; 3],
}

/// A particle about a triangle: the shares of the triangle's two edges that lead to its place at rest, from the first corner.
#[derive(Clone, Copy, Debug)]
struct Around {
    particle: u32,
    shares: [f32; 2],
}

impl Beside {
    /// About each of the faces, with places at rest (m). About those of figures, which do not meet each other, nothing is kept.
    pub fn new(faces: &Faces, rest: &[Vec3<f64>]) -> Self {
        let triangles = faces.triangles();
        let mut beside = Self::default();
        for (number, corners) in triangles.iter().enumerate() {
            interrupt::point();
            let first = beside.particles.len();
            let meeting = corners.map(|corner| faces.about(corner));
            let is_many = meeting.iter().map(|others| others.len()).sum::<usize>() > MANY;
            let all = if is_many || faces.is_figure(number) { [[].as_slice(); 3] } else { meeting }.concat();
            let mut others: Vec<u32> = all.into_iter().filter(|other| *other as usize > number).collect();
            others.sort_unstable();
            others.dedup();
            let mut points: Vec<u32> = others.iter().flat_map(|other| triangles[*other as usize]).collect();
            points.sort_unstable();
            points.dedup();
            points.retain(|point| !corners.contains(point));
            let plane = Plane::of(corners.map(|corner| rest[corner as usize]));
            beside.particles.extend(points.iter().map(|point| plane.around(*point, &rest[*point as usize])));
            let around = &beside.particles[first..];
            let least = others.iter().map(|other| plane.least(*corners, triangles[*other as usize], around));
            let least = least.fold(f64::INFINITY, f64::min);
            beside.triangles.extend(others);
            let ends = [beside.triangles.len() as u32, beside.particles.len() as u32];
            let least = if plane.is_sound() { least } else { 0.0 };
            beside.of_each.push(One { ends, least, inverse: plane.inverse });
        }
        beside
    }

    /// The triangles of greater number that share a particle with one, ascending.
    pub fn triangles(&self, face: usize) -> &[u32] {
        let [from, to] = self.range(face, 0);
        &self.triangles[from..to]
    }

    fn range(&self, face: usize, which: usize) -> [usize; 2] {
        let from = if face == 0 { 0 } else { self.of_each[face - 1].ends[which] };
        [from as usize, self.of_each[face].ends[which] as usize]
    }

    /// A distance (m) below which no parts of a triangle and of one of [`Self::triangles`] lie that share no particle, and another (m) that is
    /// no less than what a corner of one goes beside one of the other: of places (m) and ways (m) of all particles.
    #[inline]
    pub fn apart(&self, face: usize, corners: &[u32; 3], [x, ways]: [&[Vec3<f64>]; 2]) -> [f64; 2] {
        let One { least, inverse: [p, q, r], .. } = self.of_each[face];
        let [a, b, c] = corners.map(|corner| corner as usize);
        let (e, f) = (x[b] - x[a], x[c] - x[a]);
        // The products of the edges, seen from those at rest: their least eigenvalue is the square of the least stretch.
        let [ee, ef, ff] = [e.dot(&e), e.dot(&f), f.dot(&f)];
        let (one, both) = (p * p * ee, p * (q * ee + r * ef));
        let other = q * q * ee + 2.0 * q * r * ef + r * r * ff;
        let spread = ((one - other) * (one - other) + 4.0 * both * both).sqrt();
        let stretch = (0.5 * (one + other - spread)).max(0.0).sqrt();

        let travel = |to: usize| (ways[to] - ways[a]).norm_squared();
        let (mut farthest, mut deviation) = (travel(b).max(travel(c)), 0.0_f64);
        let [from, to] = self.range(face, 1);
        for Around { particle, shares: [s, t] } in &self.particles[from..to] {
            let point = *particle as usize;
            let off = x[point] - x[a] - e * f64::from(*s) - f * f64::from(*t);
            deviation = deviation.max(off.norm_squared());
            farthest = farthest.max(travel(point));
        }
        [stretch * least - deviation.sqrt(), 2.0 * farthest.sqrt()]
    }
}

/// The plane of a triangle at rest.
struct Plane {
    origin: Vec3<f64>,
    edges: [Vec3<f64>; 2],
    inverse: [f64; 3],
}

impl Plane {
    fn of([a, b, c]: [Vec3<f64>; 3]) -> Self {
        let edges = [b - a, c - a];
        let along = edges[0].norm();
        let aside = edges[1].dot(&edges[0]) / along;
        let across = edges[0].cross(&edges[1]).norm() / along;
        let inverse = [1.0 / along, -aside / (along * across), 1.0 / across];
        Self { origin: a, edges, inverse }
    }

    /// Whether its triangle is not so narrow that nothing follows from how it is stretched.
    fn is_sound(&self) -> bool {
        let [e, f] = self.edges;
        e.cross(&f).norm() > NARROW * e.norm_squared().max(f.norm_squared())
    }

    /// Where a particle lies, seen along the normal.
    fn around(&self, particle: u32, x: &Vec3<f64>) -> Around {
        let [e, f] = self.edges;
        let way = x - self.origin;
        let [p, q, r] = self.inverse;
        // (L Lᵀ)⁻¹ times the products with the edges.
        let [first, second] = [p * way.dot(&e), q * way.dot(&e) + r * way.dot(&f)];
        Around { particle, shares: [(p * first + q * second) as f32, (r * second) as f32] }
    }

    /// The least distance in the plane of parts of two triangles that share no particle.
    fn least(&self, own: [u32; 3], other: [u32; 3], around: &[Around]) -> f64 {
        let at = |point: u32| match own.iter().position(|corner| *corner == point) {
            Some(0) => Vec3::zeros(),
            Some(corner) => self.edges[corner - 1],
            None => {
                let place = around.binary_search_by_key(&point, |around| around.particle);
                let [s, t] = around[place.expect("a particle about it")].shares.map(f64::from);
                self.edges[0] * s + self.edges[1] * t
            }
        };
        let mut least = f64::INFINITY;
        let mut look = |kind, corners: [u32; 4]| {
            least = least.min(closest(kind, corners.map(at)).difference.norm());
        };
        for (one, [a, b, c]) in [(own, other), (other, own)] {
            for v in one.into_iter().filter(|v| ![a, b, c].contains(v)) {
                look(PairKind::VertexTriangle, [v, a, b, c]);
            }
        }
        let edges = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];
        for [a, b] in edges(own) {
            for [c, d] in edges(other) {
                if a != c && a != d && b != c && b != d {
                    look(PairKind::Edges, [a, b, c, d]);
                }
            }
        }
        least
    }
}

#[cfg(test)]
mod tests {
    use super::{super::numbers::Numbers, *};

    /// Faces of a grid of so many particles along each side, 1 m apart, and their places.
    fn sheet(side: u32) -> (Faces, Vec<Vec3<f64>>) {
        let place = |i: u32| Vec3::new(f64::from(i % side), f64::from(i / side), 0.0);
        let cells = (0..side * (side - 1)).filter(|i| i % side + 1 < side);
        let both = |i| [[i, i + 1, i + side], [i + 1, i + side + 1, i + side]];
        let triangles: Vec<[u32; 3]> = cells.flat_map(both).collect();
        (Faces::new(&triangles, (side * side) as usize), (0..side * side).map(place).collect())
    }

    /// The least distance of parts of a triangle and of those beside it that share no particle, and the farthest that a corner goes beside another.
    fn found(faces: &Faces, beside: &Beside, face: usize, [x, ways]: [&[Vec3<f64>]; 2]) -> [f64; 2] {
        let own = faces.triangles()[face];
        let (mut least, mut farthest) = (f64::INFINITY, 0.0_f64);
        for other in beside.triangles(face) {
            let other = faces.triangles()[*other as usize];
            let mut look = |kind, corners: [u32; 4]| {
                least = least.min(closest(kind, corners.map(|c| x[c as usize])).difference.norm());
            };
            for (one, [a, b, c]) in [(own, other), (other, own)] {
                for v in one.into_iter().filter(|v| ![a, b, c].contains(v)) {
                    look(PairKind::VertexTriangle, [v, a, b, c]);
                }
            }
            for i in 0..3 {
                for j in 0..3 {
                    let [a, b, c, d] = [own[i], own[(i + 1) % 3], other[j], other[(j + 1) % 3]];
                    if a != c && a != d && b != c && b != d {
                        look(PairKind::Edges, [a, b, c, d]);
                    }
                }
            }
            for a in own {
                farthest = other
                    .iter()
                    .map(|b| (ways[a as usize] - ways[*b as usize]).norm())
                    .fold(farthest, f64::max);
            }
        }
        [least, farthest]
    }

    #[test]
    fn no_pair_is_nearer_than_what_is_certain() {
        let (faces, flat) = sheet(7);
        let mut numbers = Numbers(3);
        let mut count = 0;
        for round in 0..200 {
            let [rough, crumpled] =
                [[0.0, 0.0], [0.0, 0.01], [0.1, 0.01], [0.3, 0.1], [1.0, 0.0], [0.2, 0.5]][round % 6];
            let rest: Vec<Vec3<f64>> = flat.iter().map(|x| x + numbers.place() * rough).collect();
            let beside = Beside::new(&faces, &rest);
            let [along, across, up, turn] = [(); 4].map(|()| numbers.place());
            let mut moved =
                |x: &Vec3<f64>| along * x.x + across * x.y + up * x.z + turn + numbers.place() * crumpled;
            let x: Vec<Vec3<f64>> = rest.iter().map(&mut moved).collect();
            let ways: Vec<Vec3<f64>> = rest.iter().map(|_| numbers.place()).collect();
            for (face, corners) in faces.triangles().iter().enumerate() {
                let [certain, travel] = beside.apart(face, corners, [&x, &ways]);
                let [least, farthest] = found(&faces, &beside, face, [&x, &ways]);
                let is_sure = certain <= least * (1.0 + 1e-9) + 1e-12;
                assert!(is_sure && travel >= farthest, "{certain} {least} {travel} {farthest}");
                count += usize::from(certain > 0.5 * least && least.is_finite());
            }
        }
        assert!(count > 500, "{count}");
    }

    #[test]
    fn on_a_flat_sheet_what_is_certain_is_the_distance_times_the_stretch() {
        let (faces, rest) = sheet(7);
        let beside = Beside::new(&faces, &rest);
        let still = vec![Vec3::zeros(); rest.len()];
        let turned: Vec<Vec3<f64>> = rest.iter().map(|x| Vec3::new(1.0, 2.0 * x.y, -2.0 * x.x)).collect();
        let mut count = 0;
        for (face, corners) in faces.triangles().iter().enumerate() {
            let [least, _] = found(&faces, &beside, face, [&turned, &still]);
            let [certain, travel] = beside.apart(face, corners, [&turned, &still]);
            assert!(certain == least || (certain - least).abs() < 1e-6 && travel == 0.0, "{certain} {least}");
            count += usize::from(least.is_finite());
        }
        assert!(count > 60, "{count}");
    }

    #[test]
    fn of_a_needle_nothing_is_certain() {
        let mut numbers = Numbers(8);
        let faces = Faces::new(&[[0, 1, 2], [0, 3, 4], [1, 4, 2]], 5);
        let still = vec![Vec3::zeros(); 5];
        for share in [0.0, 0.5, 1.0, 3.0] {
            for _ in 0..50 {
                let [start, way] = [numbers.place(), numbers.place()];
                let rest = [start, start + way, start + way * share, numbers.place(), numbers.place()];
                let folded = [start, start - way * 0.1, start + way * share, rest[3], rest[4]];
                for x in [&rest, &folded] {
                    let [certain, _] = Beside::new(&faces, &rest).apart(0, &[0, 1, 2], [x, &still]);
                    assert!(certain.is_nan() || certain <= 0.0, "{certain}");
                }
            }
        }
    }

    #[test]
    fn a_fan_of_many_triangles_takes_no_more_memory_than_others() {
        let count = 1000;
        let rim: Vec<[u32; 3]> = (1..count).map(|i| [0, i, i + 1]).collect();
        let faces = Faces::new(&rim, count as usize + 1);
        let mut numbers = Numbers(2);
        let rest: Vec<_> = (0..=count).map(|_| numbers.place()).collect();
        let beside = Beside::new(&faces, &rest);
        assert_eq!([beside.triangles.len(), beside.particles.len()], [0; 2]);
        let [certain, _] = beside.apart(0, &faces.triangles()[0], [&rest, &rest]);
        assert!(!certain.is_finite() || certain <= 0.0 || beside.triangles(0).is_empty());
    }
}
