//! Colliders that are meshes: what comes out as written, what is mended and told, and what each error is called.

use std::sync::Arc;

use nappe_scene::{Built, ErrorKind, MeshSource, NoMeshes, Scene, SceneError, SceneErrors, SceneLimits};
use nappe_sim::{
    collide::{
        LOAD_BYTES, Shape,
        shape::{MeshSolid, NEAR_BYTES},
    },
    mesh::TriangleMesh,
};

const SMALL: &str = r#"version = 1
dt = 0.01
[[body]]
name = "a"
mesh = { course_grid = 3 }
transform = { translate = [0, 50, 0] }
[[collider]]
name = "c"
mesh = { upload = "m" }
"#;

/// The small scene, with other keys of the mesh.
fn with(keys: &str) -> String {
    SMALL.replace("upload = \"m\"", keys)
}

/// One mesh, under the id `m` and in the file `m.obj`.
struct One(Arc<TriangleMesh>);

impl MeshSource for One {
    fn upload(&self, id: &str) -> Option<Arc<TriangleMesh>> {
        (id == "m").then(|| Arc::clone(&self.0))
    }

    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError> {
        if path == "m.obj" { Ok((*self.0).clone()) } else { NoMeshes.file(path) }
    }
}

fn parse(text: &str) -> Scene {
    Scene::parse(text, "scene.toml").unwrap_or_else(|error| panic!("{error}"))
}

fn build(mesh: &TriangleMesh, keys: &str) -> Result<Built, SceneErrors> {
    parse(&with(keys)).build(&One(Arc::new(mesh.clone())), &SceneLimits::default())
}

fn built(mesh: &TriangleMesh, keys: &str) -> Built {
    build(mesh, keys).unwrap_or_else(|error| panic!("{error}"))
}

/// The solid, and what was told of colliders.
fn solid(built: &Built) -> (&MeshSolid, Vec<&str>) {
    let Shape::Mesh(solid) = &built.setup.colliders[0].shape else { panic!("it is a mesh") };
    let told = built.warnings.iter().map(String::as_str).filter(|told| told.starts_with("collider"));
    (solid, told.collect())
}

fn error(mesh: &TriangleMesh, keys: &str) -> (ErrorKind, String) {
    let errors = build(mesh, keys).expect_err("the mesh is no collider");
    (errors.first().kind, errors.to_string())
}

fn tetrahedron() -> TriangleMesh {
    TriangleMesh {
        points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..TriangleMesh::default()
    }
}

/// A prism over a polygon, 1 m high, without its lower end.
fn open_prism(sides: u32) -> TriangleMesh {
    let corner = |i: u32, z: f64| {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(sides);
        [angle.cos(), angle.sin(), z]
    };
    let mut mesh = TriangleMesh::default();
    for z in [0.0, 1.0] {
        mesh.points.extend((0..sides).map(|i| corner(i, z)));
    }
    mesh.points.push([0.0, 0.0, 1.0]);
    for i in 0..sides {
        let j = (i + 1) % sides;
        mesh.triangles.extend([
            [i, j, i + sides],
            [j, j + sides, i + sides],
            [i + sides, j + sides, 2 * sides],
        ]);
    }
    mesh
}

/// Six times the volume by the divergence theorem: above 0 where triangles are turned outwards.
fn six_volumes(solid: &MeshSolid) -> f64 {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| solid.points()[i as usize]);
        a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    solid.triangles().iter().map(of).sum()
}

#[test]
fn a_mesh_comes_out_as_written_from_an_upload_and_from_a_file() {
    let mesh = TriangleMesh { masses: vec![0.0; 4], ..tetrahedron() };
    for source in ["upload = \"m\"", "file = \"m.obj\""] {
        let built = built(&mesh, source);
        let (solid, told) = solid(&built);
        assert_eq!((solid.points(), solid.triangles()), (&mesh.points[..], &mesh.triangles[..]));
        assert!(told.is_empty(), "masses mean nothing: {told:?}");
        let [facts] = &built.collider_solids[..] else { panic!("one collider is a mesh") };
        assert_eq!((facts.name.as_str(), facts.triangles, facts.holes_closed), ("c", 4, 0));
        assert!((facts.volume - 1.0 / 6.0).abs() < 1e-15, "{}", facts.volume);
    }
}

#[test]
fn a_transform_moves_the_mesh_and_a_scene_with_it_survives_a_round_trip() {
    let keys = "upload = \"m\", close_holes = true, transform = { scale = 2, rotate = { axis = [0, 0, 1], degrees = 90 }, \
                translate = [0, 0, 5] }";
    let built = built(&tetrahedron(), keys);
    let (solid, _) = solid(&built);
    assert_eq!(solid.points(), [[0.0, 0.0, 5.0], [0.0, 2.0, 5.0], [-2.0, 0.0, 5.0], [0.0, 0.0, 7.0]]);
    assert!((built.collider_solids[0].volume - 8.0 / 6.0).abs() < 1e-14);
    let scene = parse(&with(keys));
    assert_eq!(parse(&scene.to_toml()), scene, "{}", scene.to_toml());
}

#[test]
fn what_is_there_twice_counts_once_and_what_is_inside_out_is_turned_round() {
    let mut mesh = tetrahedron();
    // The seam of a texture, a triangle on its other side, one without an area, and a point that nothing names.
    mesh.points.extend([[0.0; 3], [1.0, 0.0, 0.0], [9.0; 3]]);
    mesh.triangles[1] = [4, 5, 3];
    mesh.triangles.extend([[0, 1, 2], [0, 4, 1]]);
    for triangle in &mut mesh.triangles {
        triangle.swap(1, 2);
    }
    let built = built(&mesh, "upload = \"m\"");
    let (solid, told) = solid(&built);
    assert_eq!(told, ["collider 'c': 1 repeated triangle, 4: it counts once"]);
    assert_eq!((solid.points().len(), solid.triangles().len()), (4, 4));
    assert!((six_volumes(solid) - 1.0).abs() < 1e-15);

    let mut twice = tetrahedron();
    twice.triangles.extend(tetrahedron().triangles);
    let built = self::built(&twice, "upload = \"m\"");
    assert_eq!(
        self::solid(&built).1,
        ["collider 'c': 4 repeated triangles, the first is 4: each counts once"]
    );
}

/// The triangles of a mesh, each with points of its own, which are off by some nanometres.
fn in_pieces(mesh: &TriangleMesh) -> TriangleMesh {
    let mut apart = TriangleMesh::default();
    for (piece, corners) in (0_u32..).zip(&mesh.triangles) {
        apart.triangles.push([0, 1, 2].map(|corner| 3 * piece + corner));
        apart.points.extend(corners.map(|corner| {
            let [x, y, z] = mesh.points[corner as usize];
            [x + 1e-9 * f64::from(piece), y, z]
        }));
    }
    apart
}

#[test]
fn pieces_that_touch_without_sharing_points_are_one_solid_once_they_are_welded() {
    let apart = in_pieces(&tetrahedron());
    let (kind, told) = error(&apart, "upload = \"m\"");
    assert!(kind == ErrorKind::BadMesh && told.contains("is not closed"), "{told}");
    let hint = "; where pieces of it touch and share no points, weld = 1e-6 joins these";
    assert!(told.ends_with(hint), "{told}");
    // It does not help again where it was tried.
    let mut open = tetrahedron();
    open.triangles.truncate(3);
    let (kind, told) = error(&open, "upload = \"m\", weld = 1e-6");
    assert!(kind == ErrorKind::BadMesh && !told.contains("; where pieces"), "{told}");

    let keys = "upload = \"m\", weld = 1e-6, transform = { scale = 2, translate = [0, 0, 5] }";
    let welded = built(&apart, keys);
    let (surface, told) = solid(&welded);
    assert_eq!(told, ["collider 'c': weld = 1e-6 joins 8 points to earlier ones, 4 are left"]);
    assert_eq!((surface.points().len(), surface.triangles().len()), (4, 4));
    assert!((welded.collider_solids[0].volume - 8.0 / 6.0).abs() < 1e-7);
    assert!((six_volumes(surface) - 8.0).abs() < 1e-6);
    let scene = parse(&with(keys));
    assert_eq!(parse(&scene.to_toml()), scene, "{}", scene.to_toml());
    // A file is welded as an upload is.
    let file = built(&apart, &keys.replace("upload = \"m\"", "file = \"m.obj\""));
    assert_eq!(file.setup.colliders, welded.setup.colliders);

    let whole = built(&tetrahedron(), "upload = \"m\", weld = 1e-6");
    assert_eq!(
        solid(&whole).1,
        ["collider 'c': weld = 1e-6 joins no points: no two are that near to each other"]
    );
    let (kind, told) = error(&tetrahedron(), "upload = \"m\", weld = 0.5");
    let wanted =
        "scene.toml:9:31: collider[0].mesh.weld: points cannot be joined over 0.5 m; allowed for this mesh: ";
    assert!(kind == ErrorKind::OutOfRange && told.starts_with(wanted), "{told}");
}

#[test]
fn a_solid_that_is_large_in_every_direction_is_asked_for_its_units_and_a_wide_ground_is_not() {
    let keys =
        |scale: &str| format!("upload = \"m\", transform = {{ scale = {scale}, translate = [0, -2000, 0] }}");
    assert_eq!(
        solid(&built(&tetrahedron(), &keys("1000"))).1,
        [
            "collider 'c': the box around it is 1000 by 1000 by 1000 m, and its volume 166700000 m^3: is it meant to be so \
          large? Lengths are metres: transform.scale = 0.001 reads millimetres"
        ]
    );
    assert!(solid(&built(&tetrahedron(), &keys("99"))).1.is_empty());
    let mut ground = tetrahedron();
    for point in &mut ground.points {
        point[1] *= 0.09;
    }
    assert!(solid(&built(&ground, &keys("1000"))).1.is_empty(), "it is 90 m thick");
}

#[test]
fn holes_of_at_most_64_edges_are_filled_where_that_is_asked_for() {
    let mesh = open_prism(64);
    let filled = built(&mesh, "upload = \"m\", close_holes = true");
    let (surface, told) = solid(&filled);
    assert_eq!(told, ["collider 'c': 1 hole is filled (close_holes = true)"]);
    assert_eq!(surface.triangles().len(), 3 * 64 + 62);
    let exact = 32.0 * (std::f64::consts::TAU / 64.0).sin();
    assert!((filled.collider_solids[0].volume - exact).abs() < 1e-12);
    assert!((six_volumes(surface) / 6.0 - exact).abs() < 1e-12);

    // Both ends of a tube.
    let mut tube = open_prism(7);
    tube.triangles.retain(|corners| !corners.contains(&14));
    let filled = built(&tube, "upload = \"m\", close_holes = true");
    assert_eq!(solid(&filled).1, ["collider 'c': 2 holes are filled (close_holes = true)"]);
    assert_eq!(
        (filled.collider_solids[0].holes_closed, filled.collider_solids[0].triangles),
        (2, 14 + 2 * 5)
    );

    let closed = built(&tetrahedron(), "upload = \"m\", close_holes = true");
    assert!(solid(&closed).1.is_empty());
}

#[test]
fn a_mesh_that_encloses_nothing_is_refused_with_what_and_where() {
    let spoilt = |spoil: fn(&mut TriangleMesh)| {
        let mut mesh = tetrahedron();
        spoil(&mut mesh);
        mesh
    };
    let open = spoilt(|mesh| mesh.triangles.truncate(3));
    let turned = spoilt(|mesh| mesh.triangles[3].swap(0, 1));
    let flat = spoilt(|mesh| mesh.points[3] = [0.2, 0.2, 0.0]);
    let flat_part = spoilt(|mesh| {
        mesh.points.extend([[5.0, 5.0, 5.0], [6.0, 5.0, 5.0], [5.0, 6.0, 5.0], [5.25, 5.25, 5.0]]);
        mesh.triangles.extend([[4, 6, 5], [4, 5, 7], [4, 7, 6], [5, 6, 7]]);
    });
    let empty = spoilt(|mesh| mesh.triangles.clear());
    let not_finite = spoilt(|mesh| mesh.points[2][0] = f64::NAN);
    let crowded = spoilt(|mesh| {
        mesh.points.push([2.0, 2.0, 2.0]);
        mesh.triangles.push([0, 1, 4]);
    });
    let edge = "is not closed: the edge from point 1 at (1, 0, 0) to point 2 at (0, 1, 0) has 1 triangle, and each edge of a \
                closed surface has two; 2 other edges are open too; close_holes = true fills holes of at most 64 edges; \
                where pieces of it touch and share no points, weld = 1e-6 joins these";
    let side = "has triangles 0 and 3 that run along their edge from (1, 0, 0) to (0, 1, 0) in the same direction: one of \
                them is inside out";
    for (mesh, wanted) in [
        (open, edge),
        (turned, side),
        (flat, "encloses no volume"),
        (flat_part, "has a part that encloses no volume: that of triangle 4"),
        (empty, "has no triangles with an area: only a closed surface has an inside"),
        (not_finite, "point 2 is not finite: [NaN, 1.0, 0.0]"),
    ] {
        let wanted = format!("scene.toml:9:8: collider[0].mesh: {wanted}");
        assert_eq!(error(&mesh, "upload = \"m\""), (ErrorKind::BadMesh, wanted));
    }
    // No hole is where an edge has three triangles.
    let (_, told) = error(&crowded, "upload = \"m\", close_holes = true");
    assert!(
        told.contains("to point 1 at (1, 0, 0) has 3 triangles") && !told.contains("close_holes"),
        "{told}"
    );
}

#[test]
fn a_hole_that_is_too_long_is_refused_with_its_length() {
    let wanted = "scene.toml:9:8: collider[0].mesh: has a hole of 70 open edges, which begins at point 0 at (1, 0, 0); holes \
                  of at most 64 edges are closed";
    let found = error(&open_prism(70), "upload = \"m\", close_holes = true");
    assert_eq!(found, (ErrorKind::BadMesh, wanted.to_owned()));
    assert!(build(&open_prism(65), "upload = \"m\", close_holes = true").is_err());
}

#[test]
fn too_many_triangles_are_refused_before_anything_is_made_of_them() {
    let many = |count| TriangleMesh { triangles: vec![[0, 2, 1]; count], ..tetrahedron() };
    let wanted =
        "scene.toml:9:8: collider[0].mesh: this collider has 200001 triangles; allowed: at most 200000";
    let (kind, told) = error(&many(200_001), "upload = \"m\"");
    assert_eq!((kind, told.as_str()), (ErrorKind::TooLarge, wanted));

    // What colliders have together is counted too.
    let text =
        format!("{}[[collider]]\nname = \"d\"\nmesh = {{ upload = \"m\" }}\n", with("upload = \"torus\""));
    let refused = parse(&text).build(&One(Arc::new(many(199_000))), &SceneLimits::default());
    let told = refused.expect_err("too many together").to_string();
    let wanted =
        "this collider has 199000 triangles, 200024 with the colliders before it; allowed: at most 200000";
    assert!(told.contains("collider[1].mesh: ") && told.ends_with(wanted), "{told}");
}

#[test]
fn a_mesh_that_is_not_there_and_keys_that_do_not_fit_are_named() {
    let told = |keys: &str| {
        let scene = Scene::parse(&with(keys), "scene.toml");
        let built =
            scene.and_then(|scene| scene.build(&One(Arc::new(tetrahedron())), &SceneLimits::default()));
        built.expect_err("an error").to_string()
    };
    for (keys, wanted) in [
        (
            "upload = \"n\"",
            "scene.toml:9:19: collider[0].mesh.upload: no mesh with the id 'n' was uploaded, or it is no longer kept",
        ),
        ("file = \"n.obj\"", "n.obj: scenes may not name files here: upload the mesh"),
        (
            "upload = \"m\", file = \"m.obj\"",
            "scene.toml:9:8: collider[0].mesh: has file and upload of file, upload: exactly one is needed",
        ),
        (
            "upload = \"m\", unused = \"drop\"",
            "scene.toml:9:24: collider[0].mesh.unused: collider.mesh has no key 'unused'; allowed: file, upload, weld, \
             transform, close_holes",
        ),
        (
            "upload = \"m\", close_holes = 1",
            "scene.toml:9:38: collider[0].mesh.close_holes: is 1; allowed: true or false",
        ),
        (
            "upload = \"m\", transform = { rotate = { axis = [0, 0, 0], degrees = 1 } }",
            "scene.toml:9:56: collider[0].mesh.transform.rotate.axis: is zero: an axis needs a direction",
        ),
    ] {
        assert_eq!(told(keys), wanted);
    }
}

#[test]
fn the_torus_that_comes_with_nappe_is_there_without_an_upload() {
    let scene = parse(&with("upload = \"torus\""));
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    let (torus, told) = solid(&built);
    assert_eq!((torus.points().len(), torus.triangles().len(), told.len()), (512, 1024, 0));
    // Also as a body.
    let body =
        with("upload = \"m\"").replace("course_grid = 3 }", "upload = \"torus\" }\nmass = { total = 1 }");
    let built = parse(&body).build(&One(Arc::new(tetrahedron())), &SceneLimits::default());
    assert_eq!(built.unwrap_or_else(|error| panic!("{error}")).setup.bodies[0].network.x.len(), 512);
}

#[test]
fn the_size_of_a_scene_has_its_colliders_before_they_are_made() {
    let size = |mesh: TriangleMesh| parse(&with("upload = \"m\"")).size(&One(Arc::new(mesh)));
    let found = size(tetrahedron());
    assert_eq!((found.collider_points, found.collider_triangles), (4, 4));
    let kept = NEAR_BYTES * found.cloth_particles + LOAD_BYTES;
    assert_eq!(found.collider_bytes, MeshSolid::bytes(4, 4) + kept);
    assert!(found.collider_bytes > 4 * 24 + 4 * 12);
    // What is refused takes nothing.
    let refused = TriangleMesh { triangles: vec![[0, 2, 1]; 200_001], ..tetrahedron() };
    assert_eq!(size(refused).collider_bytes, LOAD_BYTES);
    // Each block of particles has a load for each collider.
    let ball = |i: u32| {
        format!("[[collider]]\nname = \"ball {i}\"\nsphere = {{ center = [0, -9, 0], radius = 1 }}\n")
    };
    let many = with("upload = \"m\"") + "\n" + &(0..999).map(ball).collect::<String>();
    let with_balls = parse(&many).size(&One(Arc::new(tetrahedron())));
    assert_eq!(with_balls.collider_bytes, found.collider_bytes + 999 * LOAD_BYTES);
}
