//! Mesh colliders beside the frames of a folder: one file, as they stand in the files of the scene.

use std::{fs, path::Path};

use nappe_scene::mesh::read_ply;

use crate::support::{SMALL_SCENE, folder, nappe_in, write_scene};

/// Corners of a box with edges of 0.2 m, and its triangles, turned outwards, counted from 1.
const CORNERS: [[f64; 3]; 8] = [
    [-0.1, -0.1, -0.1],
    [0.1, -0.1, -0.1],
    [0.1, 0.1, -0.1],
    [-0.1, 0.1, -0.1],
    [-0.1, -0.1, 0.1],
    [0.1, -0.1, 0.1],
    [0.1, 0.1, 0.1],
    [-0.1, 0.1, 0.1],
];
const TRIANGLES: [[usize; 3]; 12] = [
    [1, 3, 2],
    [1, 4, 3],
    [5, 6, 7],
    [5, 7, 8],
    [1, 2, 6],
    [1, 6, 5],
    [4, 7, 3],
    [4, 8, 7],
    [1, 5, 8],
    [1, 8, 4],
    [2, 3, 7],
    [2, 7, 6],
];

/// Two boxes of one file, far from the sheet, with a plane between them in the scene.
const COLLIDERS: &str = r#"
[[collider]]
name = "near"
mesh = { file = "box.obj", transform = { translate = [0, -2, 0] } }
velocity = [0, 0, 1]

[[collider]]
name = "floor"
plane = { point = [0, -3, 0], normal = [0, 1, 0] }

[[collider]]
name = "far"
mesh = { file = "box.obj", transform = { translate = [1, -2, 0] } }
"#;

fn write_box(folder: &Path) {
    let points = CORNERS.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = TRIANGLES.iter().map(|[a, b, c]| format!("f {a} {b} {c}\n"));
    fs::write(folder.join("box.obj"), points.chain(faces).collect::<String>()).expect("a mesh");
}

/// The corners of each triangle of a PLY file, whose numbers must be of binary32.
fn corners(path: &Path) -> Vec<[[f64; 3]; 3]> {
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    assert!(String::from_utf8_lossy(&bytes).contains("property float z\n"), "{}", path.display());
    let mesh = read_ply(&bytes, "colliders.ply").expect("a mesh").mesh;
    mesh.triangles.iter().map(|corners| corners.map(|point| mesh.points[point as usize])).collect()
}

#[test]
fn a_folder_of_frames_holds_the_mesh_colliders_once() {
    let here = folder();
    write_box(here.path());
    let scene = write_scene(here.path(), &format!("{SMALL_SCENE}{COLLIDERS}"));
    let run = ["run", scene.as_str(), "--steps", "4", "--save", "frames"];
    nappe_in(here.path(), &run).ok();

    // The scene moves it in binary64, and a stream rounds to binary32.
    let at = |point: usize, by: [f64; 3]| {
        std::array::from_fn(|axis| f64::from((CORNERS[point - 1][axis] + by[axis]) as f32))
    };
    let all = [[0.0, -2.0, 0.0], [1.0, -2.0, 0.0]];
    let expected: Vec<[[f64; 3]; 3]> =
        all.iter().flat_map(|by| TRIANGLES.map(|corners| corners.map(|point| at(point, *by)))).collect();
    assert_eq!(corners(&here.path().join("frames/colliders.ply")), expected);

    // They are files of the run: another one is refused, and takes their place when it is told to.
    let refused = nappe_in(here.path(), &run);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("holds frames already"), "{refused:?}");
    write_scene(here.path(), SMALL_SCENE);
    nappe_in(here.path(), &[&run[..], &["--force"]].concat()).ok();
    let mut names: Vec<_> = fs::read_dir(here.path().join("frames"))
        .expect("the folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    assert_eq!(names, ["frame-000000.ply", "frame-000001.ply", "frame-000002.ply"]);
}
