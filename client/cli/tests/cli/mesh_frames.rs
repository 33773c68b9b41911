//! `nappe mesh frames`: skin and animation of glTF files against closed forms, folders of meshes, and what is refused.

use std::{f64::consts::FRAC_PI_2, fs, path::Path};

use base64::{Engine as _, engine::general_purpose::STANDARD};
use serde_json::{Value, json};

use crate::support::{Folder, folder, nappe_in};

/// A file in the making: its numbers, and who reads them.
#[derive(Default)]
struct Numbers {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Numbers {
    /// Adds an accessor of numbers of binary32; returns its number.
    fn add(&mut self, kind: &str, width: usize, numbers: &[f32]) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let (first, count) = (numbers.chunks_exact(width), numbers.len() / width);
        let bound = |better: fn(f32, f32) -> f32, from: f32| -> Vec<f32> {
            let along = |c: usize| first.clone().map(|element| element[c]).fold(from, better);
            (0..width).map(along).collect()
        };
        let (least, most) = (bound(f32::min, f32::INFINITY), bound(f32::max, f32::NEG_INFINITY));
        self.add_bytes(
            &bytes,
            &json!({ "componentType": 5126, "type": kind, "count": count, "min": least, "max": most }),
        )
    }

    /// Adds an accessor of these bytes.
    fn add_bytes(&mut self, bytes: &[u8], accessor: &Value) -> usize {
        let mut accessor = accessor.clone();
        accessor["bufferView"] = self.views.len().into();
        self.views.push(json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() }));
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}

/// Where the points of a cube of 1 m are without its skin, four for each side, and the triangles of its sides.
fn cube() -> (Vec<[f32; 3]>, Vec<u16>) {
    let (mut points, mut corners) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for side in [-0.5, 0.5] {
            let first = points.len() as u16;
            for [a, b] in [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]] {
                let mut point = [side; 3];
                point[(axis + 1) % 3] = a;
                point[(axis + 2) % 3] = b;
                points.push(point);
            }
            corners.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
        }
    }
    (points, corners)
}

/// The share of the second bone in a point.
fn share([x, _, z]: [f32; 3]) -> f32 {
    match (x > 0.0, z > 0.0) {
        (true, true) => 0.75,
        (true, false) => 1.0,
        (false, _) => 0.0,
    }
}

/// When the first bone jumps, and when the second has turned by a right angle (s).
const JUMPS: f32 = 0.5;
const ENDS: f32 = 0.9;

/// A cube on two bones below a node that moves both: the first jumps by 0.25 m along y, the second turns about z. The
/// buffer is the file's own unless it has a place.
fn document(place: Option<&str>) -> (Value, Vec<u8>) {
    let mut numbers = Numbers::default();
    let (points, corners) = cube();
    let normals: Vec<f32> = points.iter().flat_map(|_| [0.0, 0.0, 1.0]).collect();
    let joints: Vec<u8> = points.iter().flat_map(|_| [0, 1, 0, 0]).collect();
    let weights: Vec<f32> =
        points.iter().flat_map(|point| [1.0 - share(*point), share(*point), 0.0, 0.0]).collect();
    // Without the skin the first bone stands at x = -0.5 m, the second at 0.
    let matrix = |x: f32| [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, 0.0, 0.0, 1.0];
    let half = std::f32::consts::FRAC_1_SQRT_2;

    let position = numbers.add("VEC3", 3, points.as_flattened());
    let normal = numbers.add("VEC3", 3, &normals);
    let joint =
        numbers.add_bytes(&joints, &json!({ "componentType": 5121, "type": "VEC4", "count": points.len() }));
    let weight = numbers.add("VEC4", 4, &weights);
    let corner_bytes: Vec<u8> = corners.iter().flat_map(|corner| corner.to_le_bytes()).collect();
    let corner = numbers.add_bytes(
        &corner_bytes,
        &json!({ "componentType": 5123, "type": "SCALAR", "count": corners.len() }),
    );
    let bind = numbers.add("MAT4", 16, [matrix(0.5), matrix(0.0)].as_flattened());
    let jump_times = numbers.add("SCALAR", 1, &[0.0, JUMPS]);
    let jumps = numbers.add("VEC3", 3, &[-0.5, 0.0, 0.0, -0.5, 0.25, 0.0]);
    let turn_times = numbers.add("SCALAR", 1, &[0.0, ENDS]);
    let turns = numbers.add("VEC4", 4, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half]);

    let mut buffer = json!({ "byteLength": numbers.bytes.len() });
    if let Some(place) = place {
        buffer["uri"] = place.into();
    }
    let document = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0, 3] }],
        "nodes": [
            { "translation": [1.0, 2.0, 3.0], "children": [1] },
            { "translation": [-0.5, 0.0, 0.0], "children": [2] },
            { "translation": [0.5, 0.0, 0.0] },
            { "translation": [9.0, 9.0, 9.0], "mesh": 0, "skin": 0 },
        ],
        "skins": [{ "joints": [1, 2], "inverseBindMatrices": bind }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": position, "NORMAL": normal, "JOINTS_0": joint, "WEIGHTS_0": weight },
            "indices": corner,
        }] }],
        "animations": [{
            "samplers": [
                { "input": jump_times, "output": jumps, "interpolation": "STEP" },
                { "input": turn_times, "output": turns, "interpolation": "LINEAR" },
            ],
            "channels": [
                { "sampler": 0, "target": { "node": 1, "path": "translation" } },
                { "sampler": 1, "target": { "node": 2, "path": "rotation" } },
            ],
        }],
        "accessors": numbers.accessors,
        "bufferViews": numbers.views,
        "buffers": [buffer],
    });
    (document, numbers.bytes)
}

/// A binary file of both.
fn glb(document: &Value, bytes: &[u8]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let word = |number: usize| (number as u32).to_le_bytes();
    let mut file = b"glTF".to_vec();
    file.extend([word(2), word(12 + 8 + text.len() + 8 + bytes.len()), word(text.len())].concat());
    file.extend(b"JSON");
    file.extend(text);
    file.extend(word(bytes.len()));
    file.extend(b"BIN\0");
    file.extend(bytes);
    file
}

/// The cube as `man.glb` in a folder of its own.
fn man() -> Folder {
    let folder = folder();
    let (document, bytes) = document(None);
    fs::write(folder.path().join("man.glb"), glb(&document, &bytes)).expect("written");
    folder
}

/// The points of the cube in the order in which each comes first.
fn joined_points() -> Vec<[f32; 3]> {
    let mut joined: Vec<[f32; 3]> = Vec::new();
    for point in cube().0 {
        if !joined.contains(&point) {
            joined.push(point);
        }
    }
    joined
}

/// Where a point of the cube is at a time (s): first and second bone, each by its share.
fn exact(rest: [f32; 3], time: f64) -> [f64; 3] {
    let [x, y, z] = rest.map(f64::from);
    let jumped = if time < f64::from(JUMPS) { 0.0 } else { 0.25 };
    let (sin, cos) = (FRAC_PI_2 * time / f64::from(ENDS)).min(FRAC_PI_2).sin_cos();
    let share = f64::from(share(rest));
    let mixed = |still: f64, turned: f64| (1.0 - share) * still + share * turned;
    [1.0 + mixed(x, cos * x - sin * y), 2.0 + jumped + mixed(y, sin * x + cos * y), 3.0 + z]
}

/// The frames of a file, after its header, which is to be of so many points.
fn frames(path: &Path, points: usize) -> Vec<Vec<[f32; 3]>> {
    let bytes = fs::read(path).expect("it is written");
    assert_eq!(&bytes[..12], b"POINTCACHE2\0");
    let (places, rest) = bytes[32..].as_chunks::<12>();
    assert!(rest.is_empty());
    let number = |place: &[u8; 12], c: usize| f32::from_le_bytes(place[c..c + 4].try_into().expect("four"));
    let places: Vec<[f32; 3]> = places.iter().map(|place| [0, 4, 8].map(|c| number(place, c))).collect();
    places.chunks_exact(points).map(<[_]>::to_vec).collect()
}

/// Checks each point of each frame, at ten in a second, to 1e-6 m.
fn assert_exact(frames: &[Vec<[f32; 3]>]) {
    let rest = joined_points();
    for (number, frame) in frames.iter().enumerate() {
        for (point, place) in rest.iter().zip(frame) {
            let expected = exact(*point, number as f64 / 10.0);
            for (found_c, expected_c) in place.iter().zip(&expected) {
                let off = (f64::from(*found_c) - expected_c).abs();
                assert!(off < 1e-6, "frame {number}: {place:?}, not {expected:?}");
            }
        }
    }
}

#[test]
fn a_skin_moves_as_its_bones_do_and_points_in_one_place_are_one() {
    let folder = man();
    let run = |args: &[&str]| nappe_in(folder.path(), args);
    let made = run(&["mesh", "frames", "man.glb", "--rate", "10", "--out", "man", "--json"]).ok();
    assert_eq!(made.stderr, "");
    let told = made.json();
    assert_eq!(
        told,
        json!({
            "out": "man", "files": ["man.ply", "man.pc2"], "points": 8, "joined": 16, "triangles": 12,
            "frames": 10, "seconds": 0.9, "bytes": 960,
        })
    );
    let found = frames(&folder.path().join("man.pc2"), 8);
    assert_eq!(found.len(), 10);
    assert_exact(&found);

    // The mesh is closed, and stands where the first frame does.
    let info = run(&["mesh", "info", "man.ply", "--json"]).ok().json();
    assert_eq!(
        (&info["points"], &info["triangles"], &info["open_edges"]),
        (&8.into(), &12.into(), &0.into())
    );
    assert_eq!((&info["min"], &info["max"]), (&json!([0.5, 1.5, 2.5]), &json!([1.5, 2.5, 3.5])));
    let scene = "version = 1\ndt = 0.005\n[[body]]\nname = \"sheet\"\nmesh = { grid = [5, 5], spacing = 0.1 }\n\
                 mass = { particle = 0.01 }\nsprings = { stretch = { stiffness = 50, damping = 0.02 } }\n\
                 thickness = 0.004\n[[figure]]\nname = \"cube\"\nmesh = { file = \"man.ply\" }\nthickness = 0.004\n\
                 frames = { file = \"man.pc2\", rate = 10 }\n";
    fs::write(folder.path().join("scene.toml"), scene).expect("written");
    let checked = run(&["check", "scene.toml", "--json"]).ok().json();
    let figure = &checked["figures"][0];
    assert_eq!((&figure["corners"], &figure["frames"]), (&8.into(), &10.into()), "{checked}");

    // What is there stays; a loop ends before the frame at 0.9 s.
    let again = ["mesh", "frames", "man.glb", "--rate", "10", "--loop", "--out", "man"];
    let refused = run(&again);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("man.ply is there already: --force overwrites it"), "{}", refused.stderr);
    run(&[&again[..], &["--force"]].concat()).ok();
    let looped = frames(&folder.path().join("man.pc2"), 8);
    assert_eq!(looped[..], found[..9]);
}

#[test]
fn buffers_stand_in_the_text_or_beside_it() {
    let folder = folder();
    let run = |args: &[&str]| nappe_in(folder.path(), args);
    let (_, bytes) = document(None);
    let inside = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&bytes));
    for (name, place) in [("inside", inside.as_str()), ("beside", "man.bin")] {
        let file = format!("{name}.gltf");
        fs::write(folder.path().join(&file), document(Some(place)).0.to_string()).expect("written");
        let words = ["mesh", "frames", &file, "--rate", "10", "--out", name];
        if name == "beside" {
            let refused = run(&words);
            assert_eq!(refused.code, Some(1), "{refused:?}");
            assert!(refused.stderr.contains("man.bin"), "{}", refused.stderr);
            assert!(refused.stderr.contains("beside.gltf has buffer 0 there"), "{}", refused.stderr);
            fs::write(folder.path().join("man.bin"), &bytes).expect("written");
        }
        run(&words).ok();
        let found = frames(&folder.path().join(format!("{name}.pc2")), 8);
        assert_eq!(found.len(), 10);
        assert_exact(&found);
    }
}

#[test]
fn a_folder_has_a_frame_in_each_file() {
    let folder = folder();
    let run = |args: &[&str]| nappe_in(folder.path(), args);
    let rest = joined_points();
    fs::create_dir(folder.path().join("walk")).expect("made");
    for number in 0..4_u8 {
        let points = rest.iter().map(|point| {
            let [x, y, z] = exact(*point, f64::from(number) / 10.0);
            format!("v {x} {y} {z}\n")
        });
        let text = format!("{}f 1 2 3\nf 1 3 4\n", points.collect::<Vec<String>>().concat());
        fs::write(folder.path().join(format!("walk/{number:03}.obj")), text).expect("written");
    }
    fs::write(folder.path().join("walk/notes.txt"), "not a mesh").expect("written");
    let words = ["mesh", "frames", "walk", "--rate", "10", "--out", "man", "--json"];
    let told = run(&words).ok().json();
    assert_eq!((&told["points"], &told["frames"]), (&8.into(), &4.into()), "{told}");
    assert_eq!((&told["triangles"], &told["joined"]), (&2.into(), &0.into()), "{told}");
    assert_exact(&frames(&folder.path().join("man.pc2"), 8));

    fs::write(folder.path().join("walk/004.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");
    let refused = run(&[&words[..], &["--force"]].concat());
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("004.obj: has 3 points"), "{}", refused.stderr);
    fs::create_dir(folder.path().join("none")).expect("made");
    let refused = run(&["mesh", "frames", "none", "--out", "other"]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("none: has no meshes; allowed: .obj or .ply"), "{}", refused.stderr);
}

#[test]
fn what_a_file_lacks_or_has_too_much_is_named() {
    let folder = folder();
    let refused = |change: &dyn Fn(&mut Value), told: &str| {
        let (mut document, bytes) = document(None);
        change(&mut document);
        fs::write(folder.path().join("man.glb"), glb(&document, &bytes)).expect("written");
        let done = nappe_in(folder.path(), &["mesh", "frames", "man.glb", "--out", "man"]);
        assert_eq!(done.code, Some(1), "{told}: {done:?}");
        assert!(done.stderr.contains("man.glb: ") && done.stderr.contains(told), "{told}: {}", done.stderr);
        assert!(!folder.path().join("man.ply").exists(), "{told}");
    };
    let part = "/meshes/0/primitives/0";
    let at = |document: &mut Value, place: &str, value: Value| {
        let (parent, key) = place.rsplit_once('/').expect("a place");
        document.pointer_mut(parent).expect("it is there")[key] = value;
    };

    refused(&|document| at(document, "/animations", json!([])), "has no animation");
    refused(
        &|document| {
            document["nodes"][3] = json!({ "mesh": 0 });
        },
        "has no mesh with a skin",
    );
    let targets = json!([{ "POSITION": 0 }]);
    refused(&|document| at(document, &format!("{part}/targets"), targets.clone()), "has morph targets");
    refused(&|document| at(document, &format!("{part}/mode"), json!(1)), "is of Lines; allowed: Triangles");
    let sparse = json!({
        "count": 1,
        "indices": { "bufferView": 4, "componentType": 5123 },
        "values": { "bufferView": 0 },
    });
    refused(&|document| at(document, "/accessors/0/sparse", sparse.clone()), "accessor 0 is sparse");
    refused(
        &|document| document["accessors"][3]["count"] = json!(23),
        "has joints or weights for another number of points",
    );
    refused(
        &|document| document["accessors"][0]["count"] = json!(2400),
        "accessor 0 has no element, or goes",
    );
    refused(
        &|document| document["bufferViews"][0]["byteLength"] = json!(1 << 20),
        "accessor 0 has no element",
    );
    refused(&|document| document["buffers"][0]["byteLength"] = json!(1 << 20), "where 1048576 are needed");
    refused(&|document| document["skins"][0]["joints"] = json!([1]), "names joint 1; allowed: below 1");
    refused(&|document| document["nodes"][2]["children"] = json!([1]), "has two parents");
    refused(&|document| document["asset"]["version"] = json!(2), "is no glTF 2 that can be read");

    let (document, bytes) = document(None);
    fs::write(folder.path().join("man.glb"), glb(&document, &bytes)).expect("written");
    let run = |more: &[&str]| nappe_in(folder.path(), &[&["mesh", "frames", "man.glb"][..], more].concat());
    let other = run(&["--out", "man", "--animation", "1"]);
    assert_eq!(other.code, Some(1), "{other:?}");
    assert!(other.stderr.contains("has no animation 1; allowed: 0 to 0"), "{}", other.stderr);
    let still = run(&["--out", "man", "--rate", "0"]);
    assert_eq!(still.code, Some(2), "{still:?}");
    assert!(still.stderr.contains("a number above 0 is needed"), "{}", still.stderr);
    let many = run(&["--out", "man", "--rate", "1e12"]);
    assert_eq!(many.code, Some(1), "{many:?}");
    assert!(many.stderr.contains("frames of 24 points take"), "{}", many.stderr);
    let named = run(&["--out", "man.pc2"]);
    assert_eq!(named.code, Some(2), "{named:?}");
    fs::write(folder.path().join("man.glb"), b"glTF").expect("written");
    let cut = run(&["--out", "man"]);
    assert_eq!(cut.code, Some(1), "{cut:?}");
    assert!(cut.stderr.contains("is no glTF 2 that can be read"), "{}", cut.stderr);
}
