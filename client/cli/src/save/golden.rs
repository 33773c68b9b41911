//! The bytes of files for other programs, of two frames that stay: they are those of committed files, which these programs read.
//!
//! `NAPPE_BLESS=1` writes the committed files anew. Arrays of VTK are compared as they were before they were packed: another make
//! of zlib packs them otherwise.

use std::{
    collections::BTreeMap,
    env, fs,
    io::Read as _,
    path::{Path, PathBuf},
};

use flate2::read::ZlibDecoder;
use nappe_client::{
    Body, Collider, ColliderPose, Frame, Scalars, Shape, Topology, Vectors, WatchOptions, v1,
};

use super::Sink;
use crate::{files::write::Existing, options::fields::FieldsArgs};

/// Particles of all bodies.
const PARTICLES: u32 = 8;
/// What stands before the arrays of a file of VTK.
const MARK: &[u8] = b"<AppendedData encoding=\"raw\">\n_";

fn body(name: &str, first_particle: usize, particle_count: usize) -> Body {
    Body {
        name: name.to_owned(),
        first_particle,
        particle_count,
        triangles: Vec::new(),
        springs: Vec::new(),
        pins: Vec::new(),
        uv: Vec::new(),
        color: None,
        masses: Vec::new(),
        volumes: Vec::new(),
    }
}

fn vector([x, y, z]: [f64; 3]) -> v1::Vector3 {
    v1::Vector3 { x, y, z }
}

/// A sheet, two particles of snow, a spring; a ball that rises, a box that is turned, a floor.
fn topology() -> Topology {
    let sheet = Body {
        triangles: vec![[0, 1, 2], [2, 1, 3]],
        uv: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]],
        color: Some([255, 0, 128]),
        ..body("sheet", 0, 4)
    };
    let rope = Body { springs: vec![[6, 7]], ..body("rope", 6, 2) };
    let ball = v1::SphereShape { center: Some(vector([0.0, -1.0, 0.0])), radius: 0.5 };
    let cuboid = v1::BoxShape {
        center: Some(vector([2.0, 0.0, 0.0])),
        half_extent: Some(vector([0.5, 1.0, 1.5])),
        axis_x: Some(vector([0.0, 0.6, 0.8])),
        axis_y: Some(vector([1.0, 0.0, 0.0])),
    };
    let floor =
        v1::PlaneShape { point: Some(vector([0.0, -1.5, 0.0])), normal: Some(vector([0.0, 1.0, 0.0])) };
    let collider = |name: &str, shape: Shape, velocity: [f64; 3]| Collider {
        name: name.to_owned(),
        shape: Some(shape),
        velocity,
    };
    Topology {
        id: 1,
        particle_count: PARTICLES as usize,
        bodies: vec![sheet, body("12 <&> \"é\"", 4, 2), rope],
        colliders: vec![
            collider("ball", Shape::Sphere(ball), [0.0, 0.5, 0.0]),
            collider("box", Shape::Box(cuboid), [0.0; 3]),
            collider("floor", Shape::Plane(floor), [0.0; 3]),
        ],
    }
}

/// The first or the second frame.
fn frame(number: u32) -> Frame {
    let time = 0.02 * f64::from(number);
    let positions: Vec<f64> = (0..3 * PARTICLES).map(|index| 0.1 * f64::from(index) - 0.7 + time).collect();
    let velocities = positions.iter().map(|position| position / 3.0).collect();
    let plastic_ratios = (0..PARTICLES).map(|index| 1.0 - 0.01 * f64::from(index)).collect();
    let load = v1::ColliderLoad {
        name: "ball".to_owned(),
        force: Some(vector([0.1, -2.5, 1e21])),
        contacts: 4,
        ..v1::ColliderLoad::default()
    };
    let step = v1::Diagnostics {
        kinetic_energy: 0.1 + 0.2,
        max_stretch: 1.0 / 3.0,
        contact_count: 4,
        loads: vec![load],
        ..v1::Diagnostics::default()
    };
    let turned =
        ColliderPose { name: "box".to_owned(), position: [2.0, 0.25, 0.0], turn: [0.0, 0.0, 0.6, 0.8] };
    let is_first = number == 0;
    Frame {
        frame: number.into(),
        step: (2 * number).into(),
        time,
        state_hash: Some(255),
        positions: Vectors::F64(positions),
        velocities: Some(Vectors::F64(velocities)),
        plastic_ratios: Some(Scalars::F64(plastic_ratios)),
        stress_norms: None,
        forces: None,
        accelerations: None,
        grid: None,
        dropped_count: 0,
        diagnostics: (!is_first).then_some(step),
        poses: if is_first { Vec::new() } else { vec![turned] },
        carried: None,
    }
}

/// Saves both frames into a folder that is new.
fn save(folder: &Path, name: &str) {
    let fields = FieldsArgs::default().as_saved(&["plastic_ratio".to_owned()]);
    let session = v1::Session {
        title: "two frames".to_owned(),
        dt_seconds: 0.01,
        frame_interval_steps: 2,
        ..v1::Session::default()
    };
    let mut sink = Sink::create(&folder.join(name), Existing::Kept, &fields, None).expect("it is new");
    let _ = sink.watch(WatchOptions::default(), &session);
    sink.topology(topology());
    for number in 0..2 {
        sink.frame(&frame(number)).expect("there is room");
    }
    sink.finish(None, None).expect("there is room");
}

/// The files below a folder; the version of the program is left out.
fn contents(folder: &Path, within: &str) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder.join(within)).expect("a folder") {
        let entry = entry.expect("an entry");
        let name = format!("{within}{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            found.extend(contents(folder, &format!("{name}/")));
            continue;
        }
        let bytes = fs::read(entry.path()).expect("a file");
        let bytes = match String::from_utf8(bytes) {
            Ok(text) => text.replace(concat!("nappe ", env!("CARGO_PKG_VERSION")), "nappe").into_bytes(),
            Err(binary) => binary.into_bytes(),
        };
        found.insert(name, bytes);
    }
    found
}

/// The elements of a file of VTK without the places of its arrays, and the arrays.
fn unpacked(file: &[u8]) -> (String, Vec<Vec<u8>>) {
    let Some(at) = file.windows(MARK.len()).position(|window| window == MARK) else {
        return (String::from_utf8_lossy(file).into_owned(), Vec::new());
    };
    let (head, data) = (String::from_utf8_lossy(&file[..at]), &file[at + MARK.len()..]);
    let (mut lines, mut arrays) = (String::new(), Vec::new());
    for line in head.lines() {
        let (before, place) = line.split_once(" offset=\"").unwrap_or((line, ""));
        lines = lines + before + "\n";
        if let Some(offset) = place.split('"').next().and_then(|offset| offset.parse::<usize>().ok()) {
            arrays.push(array(&data[offset..]));
        }
    }
    (lines, arrays)
}

/// The bytes of an array that begins here.
fn array(packed: &[u8]) -> Vec<u8> {
    let word = |index: usize| {
        let bytes: [u8; 4] = packed[4 * index..4 * index + 4].try_into().expect("four bytes");
        u32::from_le_bytes(bytes) as usize
    };
    let (mut place, mut bytes) = (4 * (3 + word(0)), Vec::new());
    for block in 0..word(0) {
        let length = word(3 + block);
        ZlibDecoder::new(&packed[place..place + length]).read_to_end(&mut bytes).expect("a whole block");
        place += length;
    }
    bytes
}

#[test]
fn files_of_the_same_frames_are_the_committed_ones() {
    let folder = env::temp_dir().join(format!("nappe-golden-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a temporary folder");
    for name in ["two.pvd", "two.usda", "two.csv"] {
        save(&folder, name);
    }
    let found = contents(&folder, "");
    fs::remove_dir_all(&folder).expect("it goes");

    let golden: PathBuf = [env!("CARGO_MANIFEST_DIR"), "tests", "golden"].iter().collect();
    if env::var_os("NAPPE_BLESS").is_some_and(|value| value == "1") {
        fs::create_dir_all(golden.join("two")).expect("a folder");
        for (name, bytes) in &found {
            fs::write(golden.join(name), bytes).expect("written");
        }
    }
    let names: Vec<&str> = found.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "two.csv",
            "two.pvd",
            "two.usda",
            "two/colliders-000000.vtp",
            "two/colliders-000001.vtp",
            "two/frame-000000.vtp",
            "two/frame-000001.vtp",
        ]
    );
    for (name, bytes) in &found {
        let known = fs::read(golden.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        let ((head, arrays), (known_head, known_arrays)) = (unpacked(bytes), unpacked(&known));
        assert_eq!(head, known_head, "{name}");
        assert!(arrays == known_arrays, "{name}: an array has other numbers");
        assert_eq!(arrays.is_empty(), !name.contains('/'), "{name}: files of VTK have arrays");
    }
}
