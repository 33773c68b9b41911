//! Sampling against closed forms: counts, volumes, distances, sides of surfaces, seeds.

use nappe_sim::mesh::TriangleMesh;

use crate::{
    mesh::{Closed, NotClosed},
    transform::RigidMotion,
};

use super::{
    lattice::Jitter,
    sample::{self, Arrangement, Count},
    solid::Solid,
};

const STILL: RigidMotion =
    RigidMotion { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], shift: [0.0; 3] };

fn brick(size: [f64; 3]) -> Solid {
    Solid::Box { half: size.map(|s| 0.5 * s), motion: STILL }
}

fn ball(radius: f64) -> Solid {
    Solid::Ball { center: [0.0; 3], radius }
}

/// A box as a mesh, its faces outwards.
fn cube_mesh(low: [f64; 3], high: [f64; 3]) -> TriangleMesh {
    let corner = |i: usize| [0, 1, 2].map(|c| if i >> c & 1 == 1 { high[c] } else { low[c] });
    let faces: [[u32; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    TriangleMesh {
        points: (0..8).map(corner).collect(),
        triangles: faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        ..TriangleMesh::default()
    }
}

/// An octahedron whose triangles are halved `times` times, on a sphere: vertices on the axes, and so
/// below many rays of a lattice.
fn round_mesh(radius: f64, times: usize) -> TriangleMesh {
    let mut points: Vec<[f64; 3]> = vec![
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ];
    let mut triangles: Vec<[u32; 3]> =
        vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    for _ in 0..times {
        let mut middle = |a: u32, b: u32| {
            let m = [0, 1, 2].map(|c| points[a as usize][c] + points[b as usize][c]);
            let length = m.iter().map(|c| c * c).sum::<f64>().sqrt();
            // Each edge twice: points with the same coordinates count as one.
            points.push(m.map(|c| c / length));
            points.len() as u32 - 1
        };
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]| {
                let (ab, bc, ca) =
                    (middle(a.min(b), a.max(b)), middle(b.min(c), b.max(c)), middle(c.min(a), c.max(a)));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }

    for point in &mut points {
        *point = point.map(|c| c * radius);
    }
    TriangleMesh { points, triangles, ..TriangleMesh::default() }
}

fn solid(mesh: &TriangleMesh) -> Solid {
    Solid::from_mesh(Closed::new(mesh).unwrap_or_else(|error| panic!("{error}")))
}

fn fill(solid: &Solid, arrangement: Arrangement, count: Count) -> Vec<[f64; 3]> {
    let expected = sample::estimate(solid, arrangement, count);
    sample::fill(solid, arrangement, count, expected).expect("a solid that fills much of its box")
}

fn jittered(seed: u32) -> Arrangement {
    Arrangement::Lattice(Jitter { amount: 0.5, seed })
}

/// The smallest distance between two points, found over a coarse grid.
fn nearest(points: &[[f64; 3]], edge: f64) -> f64 {
    use std::collections::BTreeMap;
    let cell = |p: &[f64; 3]| p.map(|c| (c / edge).floor() as i64);
    let mut cells: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    for (i, p) in points.iter().enumerate() {
        cells.entry(cell(p)).or_default().push(i);
    }
    let mut least = f64::INFINITY;
    for (i, p) in points.iter().enumerate() {
        let [x, y, z] = cell(p);
        for n in 0..27 {
            let other = [x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1];
            for &j in cells.get(&other).into_iter().flatten().filter(|j| **j != i) {
                let d: f64 = (0..3).map(|c| (points[j][c] - p[c]).powi(2)).sum();
                least = least.min(d.sqrt());
            }
        }
    }

    least
}

#[test]
fn a_box_is_divided_evenly_and_its_particles_stay_in_their_cells() {
    let points = fill(&brick([1.0, 0.5, 0.26]), jittered(1), Count::Spacing(0.05));
    assert_eq!(points.len(), 20 * 10 * 5);
    let edges = [0.05, 0.05, 0.052];
    let size = [1.0, 0.5, 0.26];
    let mut index = 0;
    for i in 0..20 {
        for j in 0..10 {
            for k in 0..5 {
                for (c, n) in [i, j, k].into_iter().enumerate() {
                    let low = f64::from(n) * edges[c] - 0.5 * size[c];
                    let share = (points[index][c] - low) / edges[c];
                    assert!((0.25 - 1e-9..=0.75 + 1e-9).contains(&share), "{share}");
                }
                index += 1;
            }
        }
    }
}

#[test]
fn a_box_has_the_particles_that_are_asked_for_in_cells_like_cubes() {
    for (size, count, divided) in [
        ([1.0, 0.5, 1.0], 4000, [20, 10, 20]),
        ([1.0, 1.0, 1.0], 4000, [16, 16, 16]),
        ([2.0, 1.0, 1.0], 1, [1, 1, 1]),
        // A needle and a leaf, whose cells cannot be cubes.
        ([1e6, 1e-6, 1e-6], 4000, [4000, 1, 1]),
        ([1e-6, 1e6, 1e-6], 1, [1, 1, 1]),
        ([1.0, 1e-9, 2.0], 200, [10, 1, 20]),
        ([1e-150, 1e-150, 1e-150], 8, [2, 2, 2]),
    ] {
        assert_eq!(super::lattice::divided_for(size, count), divided);
        assert_eq!(fill(&brick(size), jittered(0), Count::Exactly(count)).len() as u64, count);
    }

    for count in [2, 7, 97, 1009, 12_347] {
        let size = [1.0, 0.7, 0.3];
        let cells = super::lattice::divided_for(size, count);
        let product: u64 = cells.iter().product();
        assert!(product >= count && product as f64 <= 1.1 * count as f64 + 1.0, "{count}: {cells:?}");
        assert_eq!(fill(&brick(size), jittered(0), Count::Exactly(count)).len() as u64, count);
    }
}

#[test]
fn a_lattice_without_jitter_is_symmetric_in_boxes_and_balls() {
    let still = Arrangement::Lattice(Jitter { amount: 0.0, seed: 9 });
    for solid in [brick([1.0, 0.6, 0.4]), ball(0.5)] {
        let points = fill(&solid, still, Count::Spacing(0.03));
        let key = |p: &[f64; 3]| p.map(|c| (c + 0.0).to_bits());
        let set: std::collections::BTreeSet<_> = points.iter().map(key).collect();
        assert_eq!(set.len(), points.len());
        for p in &points {
            assert!(set.contains(&key(&[-p[0], p[1], -p[2]])), "{p:?}");
        }
    }
}

#[test]
fn balls_and_meshes_have_as_many_particles_as_their_volume_asks_for() {
    let cube = cube_mesh([-0.3, 0.1, 0.2], [0.4, 0.5, 1.1]);
    for solid in [ball(0.5), solid(&cube), solid(&round_mesh(0.5, 4))] {
        let wanted = solid.volume() / 0.02_f64.powi(3);
        for arrangement in [jittered(4), Arrangement::Lattice(Jitter { amount: 0.0, seed: 4 })] {
            let points = fill(&solid, arrangement, Count::Spacing(0.02));
            let share = points.len() as f64 / wanted;
            // 30 to 60 cubes across: the surface's part is about 1 over that, half in, half out.
            assert!((share - 1.0).abs() < 0.03, "{share}");
            assert!(points.iter().all(|p| solid.contains(*p)));
        }
        for count in [1, 10, 4000, 12_345] {
            for arrangement in [jittered(4), Arrangement::Poisson { seed: 4 }] {
                let points = fill(&solid, arrangement, Count::Exactly(count));
                assert_eq!(points.len() as u64, count, "{arrangement:?}");
                assert!(points.iter().all(|p| solid.contains(*p)));
            }
        }
    }
}

#[test]
fn particles_of_a_poisson_disk_keep_their_distance() {
    let bar = cube_mesh([0.0; 3], [2.0, 0.1, 0.05]);
    for solid in [brick([1.0, 0.5, 0.8]), ball(0.4), solid(&bar), solid(&round_mesh(0.5, 3))] {
        for count in [300, 6000] {
            let points = fill(&solid, Arrangement::Poisson { seed: 2 }, Count::Exactly(count));
            let edge = (solid.volume() / count as f64).cbrt();
            let share = nearest(&points, edge) / edge;
            assert!(share >= 0.85, "{count}: {share}");
            assert_eq!(points.len() as u64, count);
        }
    }
}

#[test]
fn the_inside_of_a_mesh_is_that_of_the_formula() {
    // A lattice through vertices and along edges of the mesh: rays meet them exactly.
    let mesh = solid(&round_mesh(1.0, 3));
    let (mut inside, mut near) = (0, 0);
    for i in -24..=24 {
        for j in -24..=24 {
            for k in -24..=24 {
                let p = [i, j, k].map(|n: i32| f64::from(n) / 20.0);
                let r = p.iter().map(|c| c * c).sum::<f64>().sqrt();
                // The sphere's triangles lie up to 1.3 % below it.
                if (0.98..=1.001).contains(&r) {
                    near += 1;
                    continue;
                }
                assert_eq!(mesh.contains(p), r < 1.0, "{p:?}");
                inside += i32::from(r < 1.0);
            }
        }
    }

    assert!(inside > 25_000 && near < 8000, "{inside} {near}");
    let cube = solid(&cube_mesh([0.0; 3], [1.0; 3]));
    for (i, j) in (0..=8).flat_map(|i| (0..=8).map(move |j| (i, j))) {
        let (x, y) = (f64::from(i) / 8.0, f64::from(j) / 8.0);
        let column: Vec<bool> = (0..11).map(|k| cube.contains([x, y, f64::from(k) / 8.0 - 0.0625])).collect();
        // On the border a ray is in or out as a whole; within, it is in.
        let wanted = (1..=8).contains(&0) || column[4];
        assert_eq!(column, (0..11).map(|k| wanted && (1..=8).contains(&k)).collect::<Vec<_>>(), "{x} {y}");
        assert!(column[4] || i == 0 || j == 0 || i == 8 || j == 8);
    }
}

#[test]
fn volumes_and_centres_are_those_of_the_formula() {
    let low = [1e3, -2.0, 0.5];
    let closed = Closed::new(&cube_mesh(low, [1e3 + 0.5, -1.0, 2.5])).expect("a box is closed");
    assert!((closed.volume - 1.0).abs() < 1e-12, "{}", closed.volume);
    for (found, wanted) in closed.center.into_iter().zip([1e3 + 0.25, -1.5, 1.5]) {
        assert!((found - wanted).abs() < 1e-9, "{found} {wanted}");
    }
    let round = Closed::new(&round_mesh(2.0, 5)).expect("an octahedron is closed");
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 8.0;
    assert!((round.volume / exact - 1.0).abs() < 2e-3, "{}", round.volume);
    let mut turned = cube_mesh([0.0; 3], [1.0; 3]);
    for triangle in &mut turned.triangles {
        triangle.swap(1, 2);
    }
    assert!((Closed::new(&turned).expect("all inside out").volume - 1.0).abs() < 1e-15);
    assert!(solid(&turned).contains([0.5; 3]));
}

#[test]
fn a_part_turned_inside_out_is_a_hole_and_overlapping_parts_are_one() {
    let join = |a: &TriangleMesh, b: &TriangleMesh| {
        let mut both = a.clone();
        let shift = a.points.len() as u32;
        both.points.extend(&b.points);
        both.triangles.extend(b.triangles.iter().map(|t| t.map(|i| i + shift)));
        both
    };

    let outer = cube_mesh([0.0; 3], [3.0; 3]);
    let mut hole = cube_mesh([1.0; 3], [2.0; 3]);
    for triangle in &mut hole.triangles {
        triangle.swap(0, 1);
    }
    let hollow = solid(&join(&outer, &hole));
    assert!((hollow.volume() - 26.0).abs() < 1e-12);
    assert!(!hollow.contains([1.5; 3]) && hollow.contains([0.5; 3]) && hollow.contains([1.5, 1.5, 2.5]));
    let two = solid(&join(&outer, &cube_mesh([2.0; 3], [4.0; 3])));
    assert!(two.contains([2.5; 3]) && two.contains([3.5; 3]) && !two.contains([3.5, 3.5, 0.5]));
}

#[test]
fn an_open_mesh_is_refused_by_its_first_open_edge() {
    let mut open = cube_mesh([0.0; 3], [1.0; 3]);
    open.triangles.pop();
    let error = Closed::new(&open).expect_err("a triangle is missing");
    assert_eq!(
        error.to_string(),
        "is not closed: the edge from point 1 at (1, 0, 0) to point 5 at (1, 0, 1) has 1 triangle, and each edge of a closed surface has two; 2 other edges are open too"
    );

    let mut thick = cube_mesh([0.0; 3], [1.0; 3]);
    thick.points.push([2.0, 0.5, 0.5]);
    thick.triangles.push([0, 1, 8]);
    let error = Closed::new(&thick).expect_err("an edge has three triangles");
    assert!(error.to_string().contains("has 3 triangles, and each edge"), "{error}");
    let mut turned = cube_mesh([0.0; 3], [1.0; 3]);
    turned.triangles[3].swap(0, 1);
    let error = Closed::new(&turned).expect_err("a triangle is turned");
    assert!(matches!(error, NotClosed::Turned { .. }), "{error}");
    assert!(error.to_string().contains("one of them is inside out"), "{error}");
    assert_eq!(Closed::new(&TriangleMesh::default()), Err(NotClosed::Empty));
    let flat = TriangleMesh {
        points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 1]],
        ..TriangleMesh::default()
    };

    assert_eq!(Closed::new(&flat), Err(NotClosed::Flat));
}

#[test]
fn points_at_one_place_are_one_so_that_seams_are_no_gaps() {
    let cube = cube_mesh([0.0, -0.0, 0.0], [1.0; 3]);
    let soup = TriangleMesh {
        points: cube.triangles.iter().flatten().map(|i| cube.points[*i as usize].map(|c| -c)).collect(),
        triangles: (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        ..TriangleMesh::default()
    };
    assert!((Closed::new(&soup).expect("corners meet").volume - 1.0).abs() < 1e-15);
}

#[test]
fn a_seed_gives_the_same_particles_and_another_others() {
    for solid in [brick([0.3; 3]), ball(0.2), solid(&round_mesh(0.2, 2))] {
        for arrangement in [jittered, |seed| Arrangement::Poisson { seed }] {
            let of = |seed| fill(&solid, arrangement(seed), Count::Exactly(500));
            assert_eq!(of(5), of(5));
            assert_ne!(of(5), of(6));
        }
    }
}

#[test]
fn a_solid_in_a_box_that_is_nearly_empty_is_refused_before_it_takes_long() {
    let mut far = cube_mesh([0.0; 3], [1.0; 3]);
    let second = cube_mesh([1e5; 3], [1e5 + 1.0; 3]);
    far.points.extend(&second.points);
    far.triangles.extend(second.triangles.iter().map(|t| t.map(|i| i + 8)));
    let far = solid(&far);
    for arrangement in [jittered(0), Arrangement::Poisson { seed: 0 }] {
        assert!(sample::fill(&far, arrangement, Count::Spacing(0.1), 2000).is_err());
    }
}
