//! Air, wind over time, forces and velocities of meshes, as scenes write them.

use std::sync::Arc;

use nappe_scene::{MeshSource, NoMeshes, Scene, SceneError, SceneLimits, mesh::read_ply};
use nappe_sim::{cloth::Air, mesh::TriangleMesh, world::TimedForce};

const SHEET: &str = "version = 1\ndt = 0.01\nROOT\n[[body]]\nname = \"sheet\"\nmesh = { grid = [3, 2], spacing = 0.1 }\n\
    mass = { particle = 0.01 }\npins = [\"top_left\"]\nBODY\n";

fn text(root: &str, body: &str) -> String {
    SHEET.replace("ROOT", root).replace("BODY", body)
}

/// The first error of a scene.
fn refused(root: &str, body: &str) -> String {
    let text = text(root, body);
    let built =
        Scene::parse(&text, "scene.toml").and_then(|scene| scene.build(&NoMeshes, &SceneLimits::default()));
    let errors = built.expect_err("refused");
    errors.first().to_string()
}

#[test]
fn air_forces_and_wind_over_time_are_read_with_their_defaults() {
    let body = "air = { lift = 0.5 }\n[[body.force]]\non = \"top\"\nforce = [0, 1, 0]\nfrom = 0.5\nuntil = 2\n\
        [[body.force]]\non = \"all\"\nforce = [1, 0, 0]\n[[body.force]]\non = 4\nforce = [0, 0, 1]";
    let body = body.replace("\"top\"", "\"bottom\"");
    let root = "[[wind_at]]\ntime = 0\nvelocity = [1, 0, 0]\n[[wind_at]]\ntime = 2\nvelocity = [5, 0, 0]";
    let scene = Scene::parse(&text(root, &body), "scene.toml").expect("a scene");
    assert_eq!(Scene::parse(&scene.to_toml(), "again.toml").expect("a scene").bodies, scene.bodies);
    let setup = scene.build(&NoMeshes, &SceneLimits::default()).expect("it builds").setup;
    assert_eq!(setup.wind_at, [(0.0, [1.0, 0.0, 0.0]), (2.0, [5.0, 0.0, 0.0])]);
    let sheet = &setup.bodies[0];
    assert_eq!(sheet.network.air, Some(Air { lift: 0.5, ..Air::default() }));
    let force = |particles: &[u32], force: [f64; 3], from: f64, until: f64| TimedForce {
        particles: particles.to_vec(),
        force,
        from,
        until,
    };
    // All but the pin.
    let expected = [
        force(&[3, 4, 5], [0.0, 1.0, 0.0], 0.5, 2.0),
        force(&[1, 2, 3, 4, 5], [1.0, 0.0, 0.0], 0.0, f64::INFINITY),
        force(&[4], [0.0, 0.0, 1.0], 0.0, f64::INFINITY),
    ];
    assert_eq!(sheet.forces, expected);
}

#[test]
fn what_acts_on_a_body_is_refused_with_its_key_where_it_does_not_fit() {
    let force = |keys: &str| format!("[[body.force]]\n{keys}");
    for (root, body, told) in [
        ("", "air = { density = -1 }".to_owned(), "body[0].air.density: is -1"),
        ("", "air = { normal = 101 }".to_owned(), "body[0].air.normal: is 101"),
        ("", "air = { drag = 1 }".to_owned(), "body[0].air.drag"),
        ("", force("on = 0\nforce = [0, 1, 0]"), "body[0].force[0].on: particle 0 is pinned"),
        ("", force("on = 6\nforce = [0, 1, 0]"), "body[0].force[0].on: is 6"),
        ("", force("on = 5\nforce = [0, 2e9, 0]"), "body[0].force[0].force[1]: is 2e9"),
        ("", force("on = 5\nforce = [0, 1, 0]\nfrom = 2\nuntil = 1"), "body[0].force[0].until: is 1"),
        (
            "wind = [1, 0, 0]\n[[wind_at]]\ntime = 0\nvelocity = [0, 0, 0]",
            String::new(),
            "wind: does not go with wind_at",
        ),
        (
            "[[wind_at]]\ntime = 1\nvelocity = [0, 0, 0]\n[[wind_at]]\ntime = 1\nvelocity = [0, 0, 0]",
            String::new(),
            "wind_at[1].time: is 1",
        ),
    ] {
        let error = refused(root, &body);
        assert!(error.contains(told), "{error}, not {told}");
    }
    let chain = text("", "air = {}").replace("grid = [3, 2]", "chain = 3").replace("top_left", "first");
    let scene = Scene::parse(&chain, "scene.toml").expect("a scene");
    let error = scene.build(&NoMeshes, &SceneLimits::default()).expect_err("a chain").first().to_string();
    assert!(error.contains("body[0].air: acts on triangles"), "{error}");
}

/// One mesh under every id.
struct One(Arc<TriangleMesh>);

impl MeshSource for One {
    fn upload(&self, _: &str) -> Option<Arc<TriangleMesh>> {
        Some(Arc::clone(&self.0))
    }

    fn file(&self, _: &str) -> Result<TriangleMesh, SceneError> {
        Ok((*self.0).clone())
    }
}

#[test]
fn a_mesh_with_velocities_gives_them_to_its_free_particles_turned_as_it_is() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property double vx\nproperty double vy\nproperty double vz\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n0 0 0 1 2 3\n1 0 0 4 5 6\n0 1 0 7 8 9\n3 0 1 2\n";
    let mesh = read_ply(ply.as_bytes(), "moving.ply").expect("a mesh").mesh;
    assert_eq!(mesh.velocities, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]);
    let body = "velocity = [0.5, 0, 0]\ntransform = { rotate = { axis = [0, 0, 1], degrees = 90 }, translate = [9, 9, 9] }";
    let text =
        text("", body).replace("grid = [3, 2], spacing = 0.1", "upload = \"m\"").replace("\"top_left\"", "0");
    let scene = Scene::parse(&text, "scene.toml").expect("a scene");
    let built = scene.build(&One(Arc::new(mesh)), &SceneLimits::default()).expect("it builds");
    let expected = [[0.0; 3], [-4.5, 4.0, 6.0], [-7.5, 7.0, 9.0]];
    for (found, expected) in built.setup.bodies[0].network.v.iter().zip(expected) {
        for c in 0..3 {
            assert!((found[c] - expected[c]).abs() < 1e-12, "{found:?}, not {expected:?}");
        }
    }

    // Two of three are no velocity.
    let two = ply.replace("property double vz", "property double w");
    assert!(read_ply(two.as_bytes(), "moving.ply").expect("a mesh").mesh.velocities.is_empty());
}
