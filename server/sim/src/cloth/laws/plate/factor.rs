//! What a mesh that may relax makes of the bending stiffness of its elements.
//!
//! A mesh finds softer shapes near those of a plate. Patches of the mesh are held around their rims on a sphere and on two saddles, the rest relaxes, and the energy inside is
//! compared with that of a plate. Spheres and saddles together tell the stiffness, their difference Poisson's ratio.

use std::{cmp::Reverse, collections::VecDeque};

use super::{
    envelope::Envelope,
    patch::{Neighbourhood, Patch, RINGS},
    six_points::{SixPoints, six_points},
};
use crate::{cloth::laws::element::Bending, interrupt};

/// Patches of a mesh, at most.
const PATCHES: usize = 4;
/// Triangles whose energy tells enough; where there are fewer so far inside, those nearer to the rims count too.
const ENOUGH: usize = 64;
/// Triangles without which nothing is told.
const LEAST: usize = 32;

/// Energies of some triangles.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: usize,
    /// Of a plate of unit stiffness, twice: |second derivatives|² times the area (m²).
    plate: f64,
    /// Of the elements, twice: on a sphere and on two saddles (m²).
    relaxed: [f64; 3],
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.plate += other.plate;
        for (sum, other) in self.relaxed.iter_mut().zip(other.relaxed) {
            *sum += other;
        }
    }
}

/// What a mesh makes of a plate, from where its points are at rest (m) and what lies around each triangle.
pub(super) fn factor(points: &[[f64; 3]], around: &[[u32; 6]]) -> Bending {
    let neighbourhood = Neighbourhood::new(points, around);
    let neighbours = &neighbourhood.neighbours;
    let is_at_rim = |triangle: &u32| neighbours[*triangle as usize].contains(&None);
    let mut distances = vec![u32::MAX; around.len()];
    spread(neighbours, &mut distances, (0..around.len() as u32).filter(is_at_rim).collect());

    let mut is_taken = vec![false; around.len()];
    let mut by_depth = [Sums::default(); RINGS + 1];
    for _ in 0..PATCHES {
        // As far as possible from the rim and from the patches so far: of equal ones the first.
        let left = (0..around.len()).filter(|triangle| !is_taken[*triangle]);
        let Some(middle) = left.max_by_key(|triangle| (distances[*triangle], Reverse(*triangle))) else {
            break;
        };
        let patch = neighbourhood.patch(middle as u32);
        for triangle in &patch.triangles {
            is_taken[*triangle as usize] = true;
        }
        spread(neighbours, &mut distances, VecDeque::from([middle as u32]));
        for (sums, found) in by_depth.iter_mut().zip(energies(&patch, heights).unwrap_or_default()) {
            sums.add(&found);
        }
    }
    judge(&by_depth)
}

/// Lowers the distances of triangles to those from further sources, in steps from neighbour to neighbour.
fn spread(neighbours: &[[Option<u32>; 3]], distances: &mut [u32], mut queue: VecDeque<u32>) {
    for source in &queue {
        distances[*source as usize] = 0;
    }
    while let Some(triangle) = queue.pop_front() {
        interrupt::point();
        let next = distances[triangle as usize] + 1;
        for other in neighbours[triangle as usize].into_iter().flatten() {
            if next < distances[other as usize] {
                distances[other as usize] = next;
                queue.push_back(other);
            }
        }
    }
}

/// The factor and Poisson's ratio, from the energies of triangles by how deep inside their patches they are: of those as deep as
/// still tell enough.
fn judge(by_depth: &[Sums; RINGS + 1]) -> Bending {
    let mut sums = Sums::default();
    for of_depth in by_depth.iter().rev() {
        sums.add(of_depth);
        if sums.count >= ENOUGH {
            break;
        }
    }
    let [sphere, one, other] = sums.relaxed.map(|energy| energy / sums.plate);
    let saddle = 0.5 * (one + other);
    let (factor, poisson) = (0.5 * (sphere + saddle), (sphere - saddle) / (sphere + saddle));
    if sums.count >= LEAST && factor.is_finite() && factor > 0.0 {
        Bending { factor, poisson, measured: sums.count, dropped: 0 }
    } else {
        Bending { factor: 1.0, poisson: 0.0, measured: 0, dropped: 0 }
    }
}

/// Heights on a sphere and on two saddles, whose second derivatives have the square 2.
fn heights([x, y]: [f64; 2]) -> [f64; 3] {
    [0.5 * (x * x + y * y), 0.5 * (x * x - y * y), x * y]
}

/// An element of a patch.
struct Element {
    /// Its points, by their number in the patch.
    points: [usize; 6],
    /// How deep inside it is.
    depth: usize,
    made: SixPoints,
}

impl Element {
    /// Second derivatives (1/m) of three fields of heights (m).
    fn curvatures(&self, z: &[[f64; 3]]) -> [[f64; 3]; 3] {
        self.made.numbers.map(|numbers| {
            let mut sums = [0.0; 3];
            for (number, point) in numbers.iter().zip(self.points) {
                for (sum, z) in sums.iter_mut().zip(z[point]) {
                    *sum += number * z;
                }
            }
            sums
        })
    }
}

/// Energies by depth of the triangles of a patch that is held at three fields of heights, whose second derivatives have the
/// square 2, and has relaxed; none where it cannot.
fn energies(patch: &Patch, heights: impl Fn([f64; 2]) -> [f64; 3]) -> Option<[Sums; RINGS + 1]> {
    let element = |(particles, depth): (&[u32; 6], &usize)| {
        interrupt::point();
        let points = particles.map(|particle| particle as usize);
        let x = points.map(|point| [patch.places[point][0], patch.places[point][1], 0.0]);
        six_points(*particles, x).map(|made| Element { points, depth: *depth, made })
    };
    let elements: Vec<Element> = patch.whole.iter().zip(&patch.depths).filter_map(element).collect();
    let mut z: Vec<[f64; 3]> = patch.places.iter().map(|place| heights(*place)).collect();
    relax(patch, &elements, &mut z)?;

    let mut by_depth = [Sums::default(); RINGS + 1];
    for element in &elements {
        let mut found = Sums { count: 1, plate: 2.0 * element.made.area, relaxed: [0.0; 3] };
        for of_one in element.curvatures(&z) {
            for (sum, curvature) in found.relaxed.iter_mut().zip(of_one) {
                *sum += element.made.area * curvature * curvature;
            }
        }
        by_depth[element.depth].add(&found);
    }
    Some(by_depth)
}

/// Moves the points that are not held to where the energy is least; none where all are held, and where no such place is the
/// only one.
fn relax(patch: &Patch, elements: &[Element], z: &mut [[f64; 3]]) -> Option<()> {
    let mut order: Vec<usize> = (0..z.len()).filter(|point| !patch.is_held[*point]).collect();
    order.sort_by(|one, other| patch.places[*one][0].total_cmp(&patch.places[*other][0]));
    if order.is_empty() {
        return None;
    }
    let mut rows = vec![None; z.len()];
    for (row, point) in order.iter().enumerate() {
        rows[*point] = Some(row);
    }

    let mut first: Vec<usize> = (0..order.len()).collect();
    for element in elements {
        let of_points = element.points.map(|point| rows[point]);
        let Some(least) = of_points.iter().flatten().min() else { continue };
        for row in of_points.iter().flatten() {
            first[*row] = first[*row].min(*least);
        }
    }

    let (mut matrix, mut pull) = (Envelope::zeros(first), vec![[0.0; 3]; order.len()]);
    for element in elements {
        interrupt::point();
        let (area, numbers, curvatures) = (element.made.area, &element.made.numbers, element.curvatures(z));
        for (j, point) in element.points.iter().enumerate() {
            let Some(row) = rows[*point] else { continue };
            for (numbers, of_one) in numbers.iter().zip(curvatures) {
                for (pull, curvature) in pull[row].iter_mut().zip(of_one) {
                    *pull -= area * numbers[j] * curvature;
                }
            }
            for (k, other) in element.points.iter().enumerate() {
                let Some(column) = rows[*other].filter(|column| *column <= row) else { continue };
                let entry: f64 = numbers.iter().map(|numbers| numbers[j] * numbers[k]).sum();
                matrix.add(row, column, area * entry);
            }
        }
    }

    matrix.factor()?.solve(&mut pull);
    for (point, moved) in order.iter().zip(pull) {
        for (z, moved) in z[*point].iter_mut().zip(moved) {
            *z += moved;
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::array::{cross, dot, length, minus},
        mesh::TriangleMesh,
    };

    const CELLS: usize = 40;

    /// A sheet of square cells in the plane y = 0, each cut along the diagonal that `is_first` chooses by column and row.
    fn sheet(cells: [usize; 2], is_first: impl Fn(usize, usize) -> bool) -> TriangleMesh {
        let [columns, rows] = cells.map(|count| count + 1);
        let mut mesh = TriangleMesh::grid(columns, rows, 0.01);
        for (cell, pair) in mesh.triangles.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            let (column, row) = (cell % cells[0], cell / cells[0]);
            if !is_first(column, row) {
                let a = (row * columns + column) as u32;
                let [b, c, d] = [a + 1, a + columns as u32, a + columns as u32 + 1];
                *pair = [[a, b, d], [a, d, c]];
            }
        }
        mesh
    }

    /// Numbers of [-1, 1], the same in every run.
    fn noise(i: usize) -> f64 {
        let mut hash = (i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        hash = (hash ^ (hash >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        hash = (hash ^ (hash >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((hash ^ (hash >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn one_way() -> TriangleMesh {
        sheet([CELLS; 2], |_, _| true)
    }

    fn alternating() -> TriangleMesh {
        sheet([CELLS; 2], |column, row| (column + row) % 2 == 0)
    }

    fn random() -> TriangleMesh {
        sheet([CELLS; 2], |column, row| noise(CELLS * row + column) > 0.0)
    }

    /// A mesh whose inner points are moved along each axis by up to so much (m).
    fn moved(mut mesh: TriangleMesh, most: f64) -> TriangleMesh {
        for row in 1..CELLS {
            for column in 1..CELLS {
                let point = row * (CELLS + 1) + column;
                mesh.points[point][0] += most * noise(3 * point);
                mesh.points[point][2] += most * noise(3 * point + 1);
            }
        }
        mesh
    }

    /// Points are moved by up to a quarter of a cell, and edges are those of Delaunay.
    fn irregular() -> TriangleMesh {
        let mut mesh = moved(one_way(), 0.0025);
        while turn_edges(&mut mesh) > 0 {}
        mesh
    }

    /// Turns edges whose opposite angles are more than half a circle together (Lawson 1977), of each triangle one at most; gives
    /// how many.
    fn turn_edges(mesh: &mut TriangleMesh) -> usize {
        let around = mesh.surrounded();
        let neighbours = Neighbourhood::new(&mesh.points, &around).neighbours;
        let points = &mesh.points;
        let angle = |at: u32, one: u32, other: u32| {
            let [at, one, other] = [at, one, other].map(|point| points[point as usize]);
            let (first, second) = (minus(one, at), minus(other, at));
            libm::atan2(length(cross(first, second)), dot(first, second))
        };
        let (mut is_turned, mut count) = (vec![false; around.len()], 0);
        for (triangle, particles) in around.iter().enumerate() {
            for k in 0..3 {
                let Some(other) = neighbours[triangle][k].map(|other| other as usize) else { continue };
                let [c, a, b, d] = [k, (k + 1) % 3, (k + 2) % 3, 3 + k].map(|corner| particles[corner]);
                let opposite = angle(c, a, b) + angle(d, a, b);
                if opposite > std::f64::consts::PI + 1e-9 && !is_turned[triangle] && !is_turned[other] {
                    (mesh.triangles[triangle], mesh.triangles[other]) = ([a, d, c], [d, b, c]);
                    (is_turned[triangle], is_turned[other], count) = (true, true, count + 1);
                }
            }
        }
        count
    }

    fn of(mesh: &TriangleMesh) -> Bending {
        factor(&mesh.points, &mesh.surrounded())
    }

    #[test]
    fn meshes_whose_factors_are_known_have_them() {
        // Diagonals one way: exact. Alternating ones: half the stiffness on spheres, all of it on saddles.
        let Bending { factor, poisson, measured, dropped } = of(&one_way());
        assert!((factor - 1.0).abs() < 1e-9 && poisson.abs() < 1e-9, "{factor}, {poisson}");
        assert!(measured > 1000, "{measured}");
        assert_eq!(dropped, 0);

        let Bending { factor, poisson, .. } = of(&alternating());
        assert!((factor - 0.75).abs() < 0.012, "{factor}");
        assert!((poisson + 1.0 / 3.0).abs() < 0.02, "{poisson}");
    }

    #[test]
    fn every_direction_bends_with_the_stiffness_that_the_factor_tells() {
        for (name, mesh) in [
            ("one way", one_way()),
            ("alternating", alternating()),
            ("random", random()),
            ("moved", moved(random(), 0.0015)),
            ("irregular", irregular()),
        ] {
            let around = mesh.surrounded();
            let neighbourhood = Neighbourhood::new(&mesh.points, &around);
            let middle = mesh.triangles.len() / 2 + CELLS;
            let patch = neighbourhood.patch(middle as u32);
            let rolled = |angles: [f64; 3], [x, y]: [f64; 2]| {
                angles.map(|angle: f64| {
                    let (sine, cosine) = angle.to_radians().sin_cos();
                    std::f64::consts::FRAC_1_SQRT_2 * (x * cosine + y * sine).powi(2)
                })
            };
            let (told, mut shares) = (of(&mesh).factor, Vec::new());
            for angles in [[0.0, 30.0, 45.0], [60.0, 90.0, 120.0], [135.0, 150.0, 15.0]] {
                let found = energies(&patch, |place| rolled(angles, place)).expect("a patch that is held");
                let inside = found[RINGS];
                assert!(inside.count > 500, "{name}: {}", inside.count);
                shares.extend(inside.relaxed.map(|energy| energy / inside.plate / told));
            }
            let least = shares.iter().copied().fold(f64::INFINITY, f64::min);
            let most = shares.iter().copied().fold(0.0, f64::max);
            let mean = shares.iter().sum::<f64>() / shares.len() as f64;
            assert!(most / least < 1.02, "{name}: {shares:?}");
            assert!((mean - 1.0).abs() < 0.02, "{name}: {mean}");
        }
    }

    #[test]
    fn a_mesh_is_measured_as_it_is_unfolded() {
        // Rolled on a cylinder, and all but closed around it.
        let flat = alternating();
        let mut rolled = flat.clone();
        let radius = 0.4 / 6.2;
        for point in &mut rolled.points {
            let (sine, cosine) = (point[0] / radius).sin_cos();
            *point = [radius * sine, radius * cosine, point[2]];
        }
        let [flat, rolled] = [flat, rolled].map(|mesh| of(&mesh).factor);
        assert!((flat - rolled).abs() < 0.01, "{flat}, {rolled}");
    }

    #[test]
    fn a_mesh_too_narrow_to_tell_keeps_its_stiffness() {
        let ribbon = sheet([CELLS, 1], |column, row| (column + row) % 2 == 0);
        let expected = Bending { factor: 1.0, poisson: 0.0, measured: 0, dropped: 0 };
        assert_eq!(of(&ribbon), expected);
        assert_eq!(factor(&[], &[]), expected);
        // One of eight cells across tells it less well, by triangles nearer to its rims.
        let strip = of(&sheet([CELLS, 8], |column, row| (column + row) % 2 == 0));
        assert!((strip.factor - 0.75).abs() < 0.05, "{strip:?}");
    }
}
