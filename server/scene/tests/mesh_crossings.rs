//! Meshes whose parts pass through themselves: what is counted and told of them, and that of others nothing is.

use std::{f64::consts::TAU, sync::Arc};

use nappe_scene::{Built, MeshParts, MeshSource, NoMeshes, Scene, SceneError, SceneLimits, shipped_scenes};
use nappe_sim::{
    collide::shape::{FirstCrossing, SelfCrossings},
    mesh::TriangleMesh,
};

/// A prism over a star of five points that is drawn in one line: its walls cross each other, and it goes round its middle twice.
fn star() -> TriangleMesh {
    let rim = |z: f64| (0..5_u32).map(move |k| f64::from(k) * TAU / 5.0).map(move |t| [t.cos(), t.sin(), z]);
    let points = rim(-0.4).chain(rim(0.4)).chain([[0.0, 0.0, -0.4], [0.0, 0.0, 0.4]]);
    let lines = [[0, 2], [2, 4], [4, 1], [1, 3], [3, 0]];
    let triangles =
        lines.iter().flat_map(|&[a, b]| [[a, b, b + 5], [a, b + 5, a + 5], [10, b, a], [11, a + 5, b + 5]]);
    TriangleMesh { points: points.collect(), triangles: triangles.collect(), ..TriangleMesh::default() }
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

fn built(mesh: TriangleMesh, transform: &str) -> Built {
    let text = format!(
        "version = 1\ndt = 0.01\n[[body]]\nname = \"a\"\nmesh = {{ course_grid = 3 }}\ntransform = {{ translate = [0, 50, 0] }}\n\
         [[collider]]\nname = \"c\"\nmesh = {{ upload = \"m\"{transform} }}\n"
    );
    let scene = Scene::parse(&text, "scene.toml").unwrap_or_else(|error| panic!("{error}"));
    let built = scene.build(&One(Arc::new(mesh)), &SceneLimits::default());
    built.unwrap_or_else(|error| panic!("{error}"))
}

/// The one thing that is told.
fn only(told: &[String]) -> &str {
    let [told] = told else { panic!("one sentence: {told:?}") };
    told
}

#[test]
fn a_part_that_passes_through_itself_is_told_with_the_first_crossing() {
    let found = MeshParts::new(&star()).expect("it is closed");
    let SelfCrossings { count, first, is_cut_off } = found.crossings;
    let FirstCrossing { triangles: [a, b], .. } = first.expect("there is one");
    assert!(count > 10 && !is_cut_off && a < b, "{found:?}");
    assert_eq!((found.count, found.overlaps), (1, None));
    let told = found.told();
    let told = only(&told);
    let start = format!(
        "{count} times an edge crosses a triangle of the same part, first those of triangles {a} and {b} at ("
    );
    assert!(told.starts_with(&start) && told.ends_with(" m: inside is what the part goes round"), "{told}");
    assert_eq!(found.told_of_crossings().as_deref(), Some(told));
}

#[test]
fn triangles_are_named_as_the_file_numbers_them_and_places_as_the_collider_stands() {
    let plain = MeshParts::new(&star()).expect("it is closed").crossings;
    // The first triangle names a point twice and is left out.
    let mut mesh = star();
    mesh.triangles.insert(0, [0, 0, 2]);
    let built = built(mesh, ", transform = { scale = 0.5, translate = [3, 0, 0] }");
    let [solid] = &built.collider_solids[..] else { panic!("one collider is a mesh") };
    let (found, first) = (solid.parts.crossings, plain.first.expect("there is one"));
    let moved = found.first.expect("there is one");
    assert_eq!((found.count, moved.triangles), (plain.count, first.triangles.map(|t| t + 1)));
    for (c, place) in moved.place.into_iter().enumerate() {
        let expected = 0.5 * first.place[c] + if c == 0 { 3.0 } else { 0.0 };
        assert!((place - expected).abs() < 1e-12, "{moved:?}, not {expected}");
    }
    let is_told = |told: &&String| told.starts_with("collider 'c': ") && told.contains("of the same part");
    assert_eq!(built.warnings.iter().filter(is_told).count(), 1, "{:?}", built.warnings);
}

#[test]
fn meshes_that_pass_through_nothing_have_no_crossings() {
    let mut ring = 0;
    for (name, text) in shipped_scenes() {
        let scene = Scene::parse(text, name).unwrap_or_else(|error| panic!("{error}"));
        if scene.colliders.iter().all(|collider| collider.mesh().is_none()) {
            continue;
        }
        let built = scene.build(&NoMeshes, &SceneLimits::default());
        for solid in built.unwrap_or_else(|error| panic!("{error}")).collider_solids {
            ring += 1;
            assert_eq!(solid.parts.crossings, SelfCrossings::default(), "{name}: {}", solid.name);
        }
    }
    assert!(ring > 0, "a shipped scene has a mesh");
}
