//! Parts of closed meshes: what is counted and told of those that overlap, touch, are holes or are turned the wrong way.

use std::sync::Arc;

use nappe_scene::{MeshParts, MeshSource, NoMeshes, Scene, SceneError, SceneLimits};
use nappe_sim::mesh::TriangleMesh;

/// A box between two corners (m): 8 points, 12 triangles turned outwards.
fn cuboid(low: [f64; 3], high: [f64; 3]) -> TriangleMesh {
    let points = (0..8_u32).map(|i| [0, 1, 2].map(|c| if i >> c & 1 == 1 { high[c] } else { low[c] }));
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    TriangleMesh { points: points.collect(), triangles: triangles.collect(), ..TriangleMesh::default() }
}

fn cube(half: f64) -> TriangleMesh {
    cuboid([-half; 3], [half; 3])
}

/// The same box, each face cut along its other diagonal.
fn cut_otherwise(mut mesh: TriangleMesh) -> TriangleMesh {
    for pair in mesh.triangles.chunks_exact_mut(2) {
        let ([a, b, c], [_, _, d]) = (pair[0], pair[1]);
        pair.copy_from_slice(&[[b, c, d], [b, d, a]]);
    }
    mesh
}

fn inside_out(mut mesh: TriangleMesh) -> TriangleMesh {
    for corners in &mut mesh.triangles {
        corners.swap(1, 2);
    }
    mesh
}

fn joined(parts: &[TriangleMesh]) -> TriangleMesh {
    let mut whole = TriangleMesh::default();
    for part in parts {
        let first = whole.points.len() as u32;
        whole.triangles.extend(part.triangles.iter().map(|corners| corners.map(|corner| corner + first)));
        whole.points.extend(&part.points);
    }
    whole
}

fn parts(of: &[TriangleMesh]) -> MeshParts {
    MeshParts::new(&joined(of)).unwrap_or_else(|why| panic!("the mesh {why}"))
}

/// Two boxes that share 0.36 m³ of their 1 m³ each.
fn two_boxes() -> [TriangleMesh; 2] {
    [cube(0.5), cuboid([0.0, -0.3, -0.4], [1.0, 0.7, 0.6])]
}

#[test]
fn parts_that_overlap_are_told_with_what_they_share_and_the_volume_is_that_of_the_union() {
    let found = parts(&two_boxes());
    let overlaps = found.overlaps.expect("they overlap");
    assert_eq!((found.count, found.holes, overlaps.pairs, overlaps.triangles), (2, 0, 1, [0, 12]));
    assert!((overlaps.volume / 0.36 - 1.0).abs() < 0.02, "{} m³", overlaps.volume);
    assert!((found.volume / 1.64 - 1.0).abs() < 0.02, "{} m³", found.volume);
    let [told] = &found.told()[..] else { panic!("one sentence: {:?}", found.told()) };
    assert!(told.starts_with("the parts that begin with triangles 0 and 12 overlap by 0.3"), "{told}");

    let apart = parts(&[cube(0.5), cuboid([2.0; 3], [3.0; 3])]);
    assert_eq!((apart.count, apart.overlaps, apart.told()), (2, None, Vec::new()));
    assert!((apart.volume - 2.0).abs() < 1e-12);
}

#[test]
fn parts_that_are_turned_are_turned_round_and_told_unless_all_of_them_are() {
    let [first, second] = two_boxes();
    for (first, second, turned) in [
        (first.clone(), inside_out(second.clone()), vec![12]),
        (inside_out(first.clone()), second.clone(), vec![0]),
        (inside_out(first), inside_out(second), vec![]),
    ] {
        let found = parts(&[first, second]);
        assert_eq!((found.count, found.holes, &found.turned), (2, 0, &turned));
        assert!((found.volume / 1.64 - 1.0).abs() < 0.02, "{} m³", found.volume);
        let told = found.told().iter().filter(|told| told.contains("turned round")).count();
        assert_eq!(told, turned.len(), "{:?}", found.told());
    }
}

#[test]
fn a_part_within_a_hole_within_a_part_is_solid() {
    for whole in [
        joined(&[cube(1.0), inside_out(cube(0.8)), cube(0.5)]),
        joined(&[cube(0.5), cube(1.0), inside_out(cube(0.8))]),
        inside_out(joined(&[cube(1.0), inside_out(cube(0.8)), cube(0.5)])),
    ] {
        let found = MeshParts::new(&whole).expect("it is closed");
        assert_eq!((found.count, found.holes, found.turned.len(), found.overlaps), (3, 1, 0, None));
        let exact = 8.0 * (1.0 - 0.8_f64.powi(3) + 0.5_f64.powi(3));
        assert!((found.volume - exact).abs() < 1e-12, "{} m³, not {exact}", found.volume);
    }
}

#[test]
fn parts_may_touch_in_a_face_an_edge_or_a_point() {
    let beside = |from: [f64; 3]| cuboid(from, from.map(|c| c + 1.0));
    for from in [[0.5, -0.5, -0.5], [0.5, 0.5, -0.5], [0.5, 0.5, 0.5], [0.5, -0.2, -0.1]] {
        for other in [beside(from), cut_otherwise(beside(from))] {
            let found = parts(&[cube(0.5), other]);
            assert_eq!((found.count, found.overlaps, found.told()), (2, None, Vec::new()), "from {from:?}");
            assert!((found.volume - 2.0).abs() < 1e-12, "from {from:?}: {} m³", found.volume);
        }
    }
}

#[test]
fn two_parts_that_are_the_same_count_once() {
    let found = parts(&[cube(0.5), cut_otherwise(cube(0.5))]);
    assert_eq!((found.count, found.overlaps.map(|overlaps| overlaps.pairs)), (2, Some(1)));
    assert!((found.volume - 1.0).abs() < 0.02, "{} m³", found.volume);
}

#[test]
fn a_part_of_no_volume_is_refused_beside_others() {
    let flat = cuboid([2.0; 3], [3.0, 3.0, 2.0]);
    let mut flat = joined(&[cube(0.5), flat]);
    // Its sides have no area, and its points no two at one place.
    for (number, point) in flat.points.iter_mut().enumerate().skip(12) {
        point[0] += 1e-3 * number as f64;
    }
    let why = MeshParts::new(&flat).expect_err("one part is flat");
    assert!(why.contains("a part that encloses no volume: that of triangle 12"), "{why}");
}

/// One mesh, under the id `m`.
struct One(Arc<TriangleMesh>);

impl MeshSource for One {
    fn upload(&self, id: &str) -> Option<Arc<TriangleMesh>> {
        (id == "m").then(|| Arc::clone(&self.0))
    }

    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError> {
        NoMeshes.file(path)
    }
}

#[test]
fn a_collider_of_parts_is_warned_of_once_with_its_name() {
    let text = "version = 1\ndt = 0.01\n[[body]]\nname = \"a\"\nmesh = { course_grid = 3 }\n\
                transform = { translate = [0, 50, 0] }\n[[collider]]\nname = \"c\"\nmesh = { upload = \"m\" }\n";
    let scene = Scene::parse(text, "scene.toml").unwrap_or_else(|error| panic!("{error}"));
    let built = scene.build(&One(Arc::new(joined(&two_boxes()))), &SceneLimits::default());
    let built = built.unwrap_or_else(|error| panic!("{error}"));
    let of_collider =
        |told: &&String| told.starts_with("collider 'c': the parts that begin with triangles 0 and 12");
    assert_eq!(built.warnings.iter().filter(of_collider).count(), 1, "{:?}", built.warnings);
    let [solid] = &built.collider_solids[..] else { panic!("one collider is a mesh") };
    assert_eq!((solid.parts.count, solid.volume), (2, solid.parts.volume));
}
