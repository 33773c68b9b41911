//! `--save FILE.usda`: a scene of USD, which is read back without USD and compared with PLY files of the same run.

use std::{fs, path::Path};

use nappe_scene::mesh::read_ply;

use crate::{
    snow::SNOW_SCENE,
    support::{SMALL_SCENE, folder, nappe_in, write_scene},
};

/// What a file holds.
pub(crate) struct Scene(String);

impl Scene {
    pub(crate) fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert!(text.starts_with("#usda 1.0\n") && text.ends_with("\n}\n"), "it is whole");
        for [open, close] in [['{', '}'], ['(', ')'], ['[', ']']] {
            assert_eq!(text.matches(open).count(), text.matches(close).count(), "each {open} is closed");
        }
        Self(text)
    }

    /// The lines of a prim of a kind.
    pub(crate) fn prim(&self, kind: &str, name: &str) -> Vec<&str> {
        let opening = format!("    def {kind} \"{name}\"");
        let lines = self.0.lines().skip_while(|line| !line.starts_with(&opening));
        let lines: Vec<&str> = lines.take_while(|line| *line != "    }").collect();
        assert!(!lines.is_empty(), "no {kind} {name}");
        lines
    }
}

/// The value of an attribute that stays.
pub(crate) fn value<'a>(prim: &[&'a str], declared: &str) -> &'a str {
    let line = prim.iter().find_map(|line| line.trim().strip_prefix(declared)?.strip_prefix(" = "));
    line.unwrap_or_else(|| panic!("no {declared}"))
}

/// Time codes and values of an attribute.
pub(crate) fn samples<'a>(prim: &[&'a str], declared: &str) -> Vec<(f64, &'a str)> {
    let opening = format!("        {declared}.timeSamples = {{");
    let lines =
        prim.iter().skip_while(|line| **line != opening).skip(1).take_while(|line| **line != "        }");
    let sample = |line: &&'a str| {
        let (code, value) = line.trim().split_once(": ")?;
        Some((code.parse().ok()?, value.strip_suffix(',')?))
    };
    lines.map(|line| sample(line).expect("a sample")).collect()
}

/// All numbers of a value.
pub(crate) fn numbers(value: &str) -> Vec<f64> {
    let words = value.split(['(', ')', '[', ']', ',', ' ']).filter(|word| !word.is_empty());
    words.map(|word| word.parse().expect("a number")).collect()
}

/// Bits of the positions and of the velocities of a frame.
fn ply(path: &Path) -> [Vec<u32>; 2] {
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mesh = read_ply(&bytes, "frame.ply").expect("a frame is a mesh").mesh;
    [mesh.points, mesh.velocities].map(|vectors| bits(vectors.as_flattened()))
}

/// The bits of numbers in binary32.
fn bits(numbers: &[f64]) -> Vec<u32> {
    numbers.iter().map(|number| (*number as f32).to_bits()).collect()
}

/// A ball that goes up, whose name USD does not take, and a rod.
const COLLIDERS: &str = r#"
[[collider]]
name = "12 <&> \"é\""
sphere = { center = [0, -2, 0], radius = 0.5 }
velocity = [0, 1, 0]

[[collider]]
name = "rod"
capsule = { start = [0, -6, 0], end = [2, -6, 0], radius = 0.25 }
"#;

#[test]
fn bodies_move_as_in_a_folder_of_the_same_run() {
    let small = format!("{SMALL_SCENE}{COLLIDERS}");
    for (text, kind, name) in [(small.as_str(), "Mesh", "sheet"), (SNOW_SCENE, "Points", "block")] {
        let here = folder();
        let scene = write_scene(here.path(), text);
        let more = ["--steps", "8", "--fields", "velocity,plastic_ratio"];
        for save in ["run.usda", "plain"] {
            nappe_in(here.path(), &[&["run", scene.as_str(), "--save", save][..], &more].concat()).ok();
        }
        let file = Scene::read(&here.path().join("run.usda"));
        let prim = file.prim(kind, name);
        let (points, velocities) =
            (samples(&prim, "point3f[] points"), samples(&prim, "vector3f[] velocities"));
        let frames = fs::read_dir(here.path().join("plain")).expect("a folder").count();
        assert_eq!((points.len(), velocities.len()), (frames, frames));
        for (number, ((code, position), (_, velocity))) in points.iter().zip(&velocities).enumerate() {
            assert_eq!(*code, number as f64, "a time code per frame");
            let own = [position, velocity].map(|value| bits(&numbers(value)));
            assert_eq!(own, ply(&here.path().join(format!("plain/frame-{number:06}.ply"))), "frame {number}");
        }
        for ((_, position), (_, extent)) in points.iter().zip(samples(&prim, "float3[] extent")) {
            let (position, extent) = (numbers(position), numbers(extent));
            let low =
                |axis: usize| position.iter().skip(axis).step_by(3).copied().fold(f64::INFINITY, f64::min);
            assert!((0..3).all(|axis| extent[axis] <= low(axis)), "{extent:?}");
        }
        assert!(file.0.contains(&format!("\n    endTimeCode = {}\n", frames - 1)));
        if kind == "Mesh" {
            assert!(file.0.contains("\n    timeCodesPerSecond = 100\n"), "two steps of 5 ms");
            assert_eq!(numbers(value(&prim, "int[] faceVertexCounts")), [3.0].repeat(242));
            let corners = numbers(value(&prim, "int[] faceVertexIndices"));
            assert!(corners.len() == 3 * 242 && corners.iter().all(|corner| *corner < 144.0));
            assert!(samples(&prim, "float[] primvars:plasticRatio").is_empty());
        } else {
            assert_eq!(samples(&prim, "float[] primvars:plasticRatio").len(), frames);
            assert_eq!(numbers(value(&prim, "int64[] ids")).len(), 216);
        }
    }
}

#[test]
fn colliders_have_their_shapes_and_go_where_the_frames_say() {
    let here = folder();
    let scene = write_scene(here.path(), &format!("{SMALL_SCENE}{COLLIDERS}"));
    nappe_in(here.path(), &["run", &scene, "--steps", "8", "--save", "run.usda"]).ok();
    let file = Scene::read(&here.path().join("run.usda"));
    let ball = file.prim("Sphere", &format!("_12{}", "_".repeat(8)));
    assert_eq!(value(&ball, "string name"), "\"12 <&> \\\"é\\\"\"");
    assert_eq!(value(&ball, "double radius"), "0.5");
    for (code, matrix) in samples(&ball, "matrix4d xformOp:transform") {
        let matrix = numbers(matrix);
        assert_eq!(matrix[..12], [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        assert!((matrix[13] - (-2.0 + 0.01 * code)).abs() < 1e-12, "{matrix:?}");
        assert_eq!([matrix[12], matrix[14], matrix[15]], [0.0, 0.0, 1.0]);
    }
    let rod = file.prim("Capsule", "rod");
    assert_eq!((value(&rod, "double height"), value(&rod, "uniform token axis")), ("2.0", "\"Y\""));
    let placed = samples(&rod, "matrix4d xformOp:transform");
    assert_eq!(placed.len(), 5);
    let matrix = numbers(placed[0].1);
    // Its own y points along x, and its middle is where it is.
    assert_eq!(matrix[4..8], [1.0, 0.0, 0.0, 0.0]);
    assert_eq!(matrix[12..], [1.0, -6.0, 0.0, 1.0]);
    assert!(file.0.contains("def Camera \"camera\""));
}

#[test]
fn endings_are_read_in_any_case_and_names_that_become_one_stay_apart() {
    let here = folder();
    let alike = COLLIDERS.replace("\"rod\"", "\"12_<&>_'é'\"");
    let scene = write_scene(here.path(), &format!("{SMALL_SCENE}{alike}"));
    for save in ["run.tar.usda", "LOUD.USDA"] {
        nappe_in(here.path(), &["run", &scene, "--steps", "2", "--save", save]).ok();
        let file = Scene::read(&here.path().join(save));
        let name = format!("_12{}", "_".repeat(8));
        let [ball, rod] = [file.prim("Sphere", &name), file.prim("Capsule", &format!("{name}_2"))];
        assert_eq!(value(&ball, "string name"), "\"12 <&> \\\"é\\\"\"");
        assert_eq!(value(&rod, "string name"), "\"12_<&>_'é'\"");
    }
    nappe_in(here.path(), &["run", &scene, "--steps", "2", "--save", "usda"]).ok();
    assert!(here.path().join("usda/frame-000001.ply").is_file(), "without an ending it is a folder");
}

#[test]
fn nothing_is_left_beside_a_scene_and_what_does_not_fit_is_told() {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    nappe_in(here.path(), &["run", &scene, "--steps", "2", "--save", "run.usda"]).ok();
    let again = nappe_in(here.path(), &["run", &scene, "--save", "run.usda"]);
    assert!(again.code == Some(1) && again.stderr.contains("run.usda is there already"), "{again:?}");
    for (option, value) in [("--grid", "smoke"), ("--color", "speed"), ("--max-error", "0.1")] {
        let done = nappe_in(here.path(), &["run", &scene, "--save", "b.usda", option, value]);
        assert!(done.code == Some(2) && done.stderr.contains(option), "{done:?}");
    }
    write_scene(here.path(), &SMALL_SCENE.replace("\"top_left\", \"top_right\"", "0, 144"));
    let refused = nappe_in(here.path(), &["run", &scene, "--save", "c.usda"]);
    assert_eq!(refused.code, Some(5), "{refused:?}");
    let mut names: Vec<_> = fs::read_dir(here.path())
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    assert_eq!(names, ["run.usda", "scene.toml"]);
}
