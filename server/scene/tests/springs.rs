//! Springs that a mesh carries: written to a PLY and read back, taken by a scene, and refused.

use std::{env, fmt::Write as _, fs, process, sync::Arc};

use nappe_scene::{
    Built, ErrorKind, MeshSource, NoMeshes, Scene, SceneError, SceneLimits,
    files::{Existing, Folder, ReadOptions, save_mesh},
    mesh::{course_grid, read_ply, springs_csv, write_ply},
};
use nappe_sim::{
    math::Precision,
    mesh::{MeshSpring, SpringKind, TriangleMesh},
    report::NoStopwatch,
    world::Simulation,
};

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

/// A text of the points of a square, with edges of six numbers: points, stiffness, damping, rest length, kind.
fn square(edges: &[&str]) -> String {
    let mut text =
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
            .to_owned();
    let _ = writeln!(text, "element edge {}", edges.len());
    text += "property int vertex1\nproperty int vertex2\nproperty float stiffness\nproperty double damping\n\
        property double rest_length\nproperty uchar kind\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    for edge in edges {
        let _ = writeln!(text, "{edge}");
    }
    text
}

fn read(text: &str) -> TriangleMesh {
    let loaded = read_ply(text.as_bytes(), "a.ply").unwrap_or_else(|error| panic!("{error}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.mesh
}

fn scene(mesh: &str, springs: &str, keys: &str) -> String {
    format!(
        "version = 1\ndt = 0.0025\ngravity = [0, -9.8, 0]\n[[body]]\nname = \"cloth\"\nmesh = {{ {mesh} }}\n\
         springs = {{ {springs} }}\nintegrator = \"symplectic_euler\"\n{keys}\n"
    )
}

fn build(text: &str, meshes: &dyn MeshSource) -> Result<Built, String> {
    let built =
        Scene::parse(text, "scene.toml").and_then(|scene| scene.build(meshes, &SceneLimits::default()));
    built.map_err(|errors| errors.first().to_string())
}

/// The hash after 40 steps.
fn hash(built: &Built) -> u64 {
    let (mut simulation, _) = Simulation::new(&built.setup, Precision::F64).expect("a good scene");
    for _ in 0..40 {
        simulation.step(&mut NoStopwatch).expect("a stable step");
    }
    simulation.state_hash()
}

#[test]
fn springs_of_a_text_come_out_as_written() {
    let mesh = read(&square(&["0 1 10 0.5 2.5 0", "2 1 20 0 nan 1", "3 0 0 0 NaN 2"]));
    let spring = |points, kind, stiffness, damping, rest_length| MeshSpring {
        points,
        kind,
        stiffness,
        damping,
        rest_length,
    };
    assert_eq!(
        mesh.springs,
        [
            spring([0, 1], SpringKind::Stretch, 10.0, 0.5, Some(2.5)),
            spring([2, 1], SpringKind::Shear, 20.0, 0.0, None),
            spring([3, 0], SpringKind::Bend, 0.0, 0.0, None),
        ]
    );

    // Without the numbers that need not be there, and before the points.
    let short = "ply\nformat ascii 1.0\nelement edge 1\nproperty int vertex2\nproperty int vertex1\nproperty int stiffness\n\
        element vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 0 7\n0 0 0\n1 0 0\n";
    assert_eq!(read(short).springs, [spring([0, 1], SpringKind::Stretch, 7.0, 0.0, None)]);
    // Lines that a program drew.
    let drawn = short.replace("property int stiffness", "property int red");
    assert_eq!((read(&drawn).springs.len(), read(&drawn).points.len()), (0, 2));
}

#[test]
fn an_edge_that_is_no_spring_is_named_with_its_line() {
    let cases = [
        ("1 4 5 0 nan 0", "edge 1 names point 4; allowed: 0 to 3, the points of this mesh"),
        ("-1 2 5 0 nan 0", "edge 1 names point -1; allowed: 0 to 3, the points of this mesh"),
        ("1.5 2 5 0 nan 0", "edge 1 names point 1.5; allowed: 0 to 3, the points of this mesh"),
        ("2 2 5 0 nan 0", "edge 1 joins point 2 to itself; allowed: two points"),
        ("1 2 nan 0 nan 0", "the 'stiffness' of edge 1 is 'nan'; allowed: a finite number"),
        ("1 2 -5 0 nan 0", "the stiffness of edge 1 is -5; allowed: a finite number, 0 or more"),
        ("1 2 5 -0.5 nan 0", "the damping of edge 1 is -0.5; allowed: a finite number, 0 or more"),
        ("1 2 5 0 inf 0", "the 'rest_length' of edge 1 is 'inf'; allowed: a finite number"),
        (
            "1 2 5 0 0 0",
            "the rest length of edge 1 is 0; allowed: a finite number above 0, or none: as the mesh lies",
        ),
        ("1 2 5 0 nan 3", "the 'kind' of edge 1 is 3; allowed: 0 (stretch), 1 (shear), 2 (bend)"),
    ];
    for (edge, told) in cases {
        let error = read_ply(square(&["0 1 10 0 nan 0", edge]).as_bytes(), "a.ply").expect_err(edge);
        assert_eq!((error.line, error.message.as_str()), (20, told), "{edge}");
    }
    let error = read_ply(square(&["0 1 5 0 nan 0", "2 3 5 0 nan 0", "1 0 5 0 nan 0"]).as_bytes(), "a.ply");
    let error = error.expect_err("two springs between two points");
    let told = "edge 2 joins the points 1 and 0, as edge 0 does; allowed: one spring between two points";
    // The line that announces edges.
    assert_eq!((error.line, error.message.as_str(), error.kind), (7, told, ErrorKind::Inconsistent));
}

#[test]
fn a_cloth_with_its_edges_in_a_ply_is_the_same_to_the_bit() {
    let law = "stretch = { stiffness = 15000, damping = 0.01 }, bend = { stiffness = 100 }";
    let formula = build(&scene("course_grid = 10", law, ""), &NoMeshes).expect("a scene");
    let network = &formula.setup.bodies[0].network;
    let mut mesh = course_grid(10, 10, 0.1);
    mesh.springs = network
        .springs
        .iter()
        .map(|spring| MeshSpring {
            points: spring.particles,
            kind: spring.kind,
            stiffness: spring.law.stiffness,
            damping: spring.law.damping,
            rest_length: None,
        })
        .collect();
    let mut bytes = Vec::new();
    write_ply(&mesh, &mut bytes).expect("it is written into memory");
    let loaded = read_ply(&bytes, "drap10.ply").expect("it was just written");
    assert!(loaded.mesh == mesh && loaded.warnings.is_empty());

    let text = scene("upload = \"m\"", "pattern = \"file\"", "");
    let meshes = One(Arc::new(loaded.mesh));
    let built = build(&text, &meshes).expect("a scene");
    assert_eq!(built.setup.bodies[0].network, *network);
    assert_eq!(hash(&built), hash(&formula));
    let size = Scene::parse(&text, "scene.toml").expect("a scene").size(&meshes);
    assert_eq!((size.springs, size.cloth_particles), (network.springs.len() as u64, 100));
    let again = Scene::parse(&text, "scene.toml").expect("a scene").to_toml();
    assert_eq!(build(&again, &meshes).expect("a scene").setup, built.setup);
}

#[test]
fn a_cloth_with_its_edges_in_a_table_is_the_same_to_the_bit() {
    let law = "stretch = { stiffness = 15000, damping = 0.01 }, bend = { stiffness = 100 }";
    let formula = build(&scene("course_grid = 10", law, ""), &NoMeshes).expect("a scene");
    let network = &formula.setup.bodies[0].network;
    let springs: Vec<MeshSpring> = network
        .springs
        .iter()
        .map(|spring| MeshSpring {
            points: spring.particles,
            kind: spring.kind,
            stiffness: spring.law.stiffness,
            damping: spring.law.damping,
            rest_length: Some(spring.rest_length),
        })
        .collect();
    let folder = env::temp_dir().join(format!("nappe-springs-{}", process::id()));
    fs::create_dir_all(&folder).expect("a folder");
    save_mesh(&folder.join("drap10.ply"), &course_grid(10, 10, 0.1), Existing::Overwritten).expect("written");
    let table = springs_csv(&springs);
    fs::write(folder.join("springs.csv"), &table).expect("written");
    fs::write(folder.join("far.csv"), format!("{table}99,100,5,0,,stretch\n")).expect("written");

    let meshes = Folder { folder: folder.clone(), options: ReadOptions::default() };
    let of = |name: &str| scene("file = \"drap10.ply\"", &format!("file = \"{name}\""), "");
    let built = build(&of("springs.csv"), &meshes).expect("a scene");
    let far = build(&of("far.csv"), &meshes).expect_err("no point 100");
    let absent = build(&of("none.csv"), &meshes).expect_err("no such file");
    fs::remove_dir_all(&folder).expect("it was just made");

    assert_eq!(built.setup.bodies[0].network, *network);
    assert_eq!(hash(&built), hash(&formula));
    let line = springs.len() + 2;
    let told = format!("far.csv:{line}:4: names point '100'; allowed: 0 to 99, the points of the mesh");
    assert!(far.ends_with(&told), "{far}, not {told}");
    assert!(
        absent.contains("scene.toml:7:") && absent.contains("none.csv, which cannot be read"),
        "{absent}"
    );
}

#[test]
fn a_table_of_springs_goes_with_a_mesh_file_and_with_no_other_springs() {
    let file = "file = \"springs.csv\"";
    let mesh = "file = \"a.ply\"";
    for (text, told) in [
        (
            scene(mesh, &format!("{file}, pattern = \"edges\""), ""),
            "body[0].springs.pattern: does not go with `file`",
        ),
        (
            scene(mesh, &format!("{file}, bend = {{ stiffness = 1 }}"), ""),
            "body[0].springs.bend: does not go with `file`",
        ),
        (scene("grid = [2, 2], spacing = 1", file, ""), "body[0].springs.file: is a table of springs"),
        (scene("upload = \"m\"", file, ""), "body[0].springs.file: is a table of springs"),
    ] {
        let error = build(&text, &NoMeshes).expect_err(told);
        assert!(error.starts_with("scene.toml:7:") && error.contains(told), "{error}, not {told}");
    }
    let refused = One(Arc::new(TriangleMesh::grid(2, 2, 1.0)));
    let error = build(&scene(mesh, file, ""), &refused).expect_err("no tables are opened there");
    assert!(error.contains("no tables of springs are opened here"), "{error}");
}

#[test]
fn a_rest_length_goes_with_the_scale_of_its_mesh_and_others_are_as_it_lies() {
    let mesh = read(&square(&["0 1 10 0 2.5 0", "1 2 10 0 nan 0"]));
    let keys = "mass = { particle = 1 }\ntransform = { scale = 0.1, translate = [5, 0, 0] }";
    let built =
        build(&scene("upload = \"m\"", "pattern = \"file\"", keys), &One(Arc::new(mesh))).expect("a scene");
    let lengths: Vec<f64> =
        built.setup.bodies[0].network.springs.iter().map(|spring| spring.rest_length).collect();
    assert!((lengths[0] - 0.25).abs() < 1e-15 && (lengths[1] - 0.1).abs() < 1e-15, "{lengths:?}");
    // Point 3 has no spring and no triangle.
    assert!(
        built.warnings.iter().any(|told| told.contains("1 isolated points, the first is 3")),
        "{:?}",
        built.warnings
    );
}

#[test]
fn springs_of_a_mesh_are_refused_where_they_do_not_fit() {
    let mesh = read(&square(&["0 1 10 0 nan 0"]));
    let bare = TriangleMesh { springs: Vec::new(), ..mesh.clone() };
    let mass = "mass = { particle = 1 }";
    let upload = "upload = \"m\"";
    let file = "pattern = \"file\"";
    for (of, text, told) in [
        (
            &mesh,
            scene(upload, &format!("{file}, stretch = {{ stiffness = 1 }}"), mass),
            "body[0].springs.stretch: does not go with pattern = \"file\"",
        ),
        (
            &mesh,
            scene("grid = [2, 2], spacing = 1", file, mass),
            "body[0].springs.pattern: is 'file': a mesh by formula carries no springs",
        ),
        (
            &bare,
            scene(upload, file, mass),
            "body[0].springs.pattern: is 'file', and the mesh carries no springs",
        ),
        (
            &mesh,
            scene(upload, "pattern = \"edges\"", mass),
            "body[0].springs.stretch: is missing: springs that resist change of length",
        ),
        (&mesh, scene("chain = 4, spacing = 1", "", mass), "body[0].springs.stretch: is missing"),
    ] {
        let error = build(&text, &One(Arc::new(of.clone()))).expect_err(told);
        assert!(error.contains(told), "{error}, not {told}");
    }
}

#[test]
fn snow_says_that_it_leaves_springs_unused() {
    let spring = MeshSpring {
        points: [0, 1],
        kind: SpringKind::Stretch,
        stiffness: 1.0,
        damping: 0.0,
        rest_length: None,
    };
    let mesh = TriangleMesh {
        points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        springs: vec![spring],
        ..TriangleMesh::default()
    };
    let text = "version = 1\ndt = 0.01\n[snow]\ncell = 0.2\n[[snow.object]]\nname = \"s\"\nmesh = { upload = \"m\" }\n";
    let built = build(text, &One(Arc::new(mesh))).expect("a scene");
    let told = "snow 's': its mesh carries springs (1), which snow leaves unused";
    assert!(built.warnings.iter().any(|warning| warning == told), "{:?}", built.warnings);
}
