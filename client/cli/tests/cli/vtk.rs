//! `--save FILE.pvd`: an index and files for ParaView, which are read back without VTK and compared with PLY files of the same run.

use std::{
    collections::BTreeSet,
    fs,
    io::Read as _,
    path::Path,
    process::{Child, Stdio},
};

use flate2::read::ZlibDecoder;

use crate::{
    snow::SNOW_SCENE,
    support::{SMALL_SCENE, command, end_by, folder, nappe_in, until, write_scene},
};

/// A .vtp file: its elements, and its appended arrays.
pub(crate) struct Vtp {
    head: String,
    data: Vec<u8>,
}

impl Vtp {
    pub(crate) fn read(path: &Path) -> Self {
        let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mark = b"<AppendedData encoding=\"raw\">\n_";
        let at = bytes.windows(mark.len()).position(|window| window == mark).expect("appended data");
        assert!(bytes.ends_with(b"\n</AppendedData>\n</VTKFile>\n"), "{} is whole", path.display());
        let head = String::from_utf8(bytes[..at].to_vec()).expect("a text");
        Self { head, data: bytes[at + mark.len()..].to_vec() }
    }

    /// A number of the piece.
    pub(crate) fn count(&self, name: &str) -> usize {
        let (_, rest) = self.head.split_once(&format!(" {name}=\"")).expect("a number of the piece");
        rest.split('"').next().and_then(|number| number.parse().ok()).expect("a number")
    }

    /// The text of a fact.
    fn fact(&self, name: &str) -> Option<&str> {
        let element = self.head.lines().find(|line| line.contains(&format!(" Name=\"{name}\"")))?;
        let (_, rest) = element.split_once('>')?;
        Some(rest.split('<').next().unwrap_or_default())
    }

    /// The numbers of a fact.
    pub(crate) fn numbers(&self, name: &str) -> Vec<f64> {
        let words = self.fact(name).unwrap_or_else(|| panic!("no {name}"));
        words.split(' ').map(|word| word.parse().expect("a number")).collect()
    }

    /// The texts of a fact.
    pub(crate) fn texts(&self, name: &str) -> Vec<String> {
        let bytes: Vec<u8> = self.numbers(name).into_iter().map(|byte| byte as u8).collect();
        let texts = bytes.split(|byte| *byte == 0).map(|text| String::from_utf8_lossy(text).into_owned());
        let mut texts: Vec<String> = texts.collect();
        assert_eq!(texts.pop().as_deref(), Some(""), "each text has its end");
        texts
    }

    /// Type and bytes of an array of a section.
    fn array(&self, section: &str, name: &str) -> Option<(String, Vec<u8>)> {
        let (_, rest) = self.head.split_once(&format!("<{section}>\n")).expect("a section");
        let (within, _) = rest.split_once(&format!("</{section}>")).expect("its end");
        let element = within.lines().find(|line| line.contains(&format!(" Name=\"{name}\"")))?;
        let value = |attribute: &str| {
            let (_, rest) = element.split_once(&format!(" {attribute}=\"")).expect("an attribute");
            rest.split('"').next().expect("a value").to_owned()
        };
        let offset: usize = value("offset").parse().expect("a number");
        let word = |index: usize| {
            let place = offset + 4 * index;
            u32::from_le_bytes(self.data[place..place + 4].try_into().expect("four bytes")) as usize
        };
        let (mut place, mut bytes) = (offset + 4 * (3 + word(0)), Vec::new());
        for block in 0..word(0) {
            let packed = &self.data[place..place + word(3 + block)];
            ZlibDecoder::new(packed).read_to_end(&mut bytes).expect("a whole block");
            place += word(3 + block);
        }
        Some((value("type"), bytes))
    }

    /// Points of binary64.
    pub(crate) fn points(&self) -> Vec<[f64; 3]> {
        let (kind, bytes) = self.array("Points", "Points").expect("points");
        assert_eq!(kind, "Float64");
        let (numbers, _) = bytes.as_chunks::<8>();
        let numbers: Vec<f64> = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
        numbers.as_chunks::<3>().0.to_vec()
    }
}

/// A PLY file of a frame: type and bytes of each array, and the bytes of the corners of its triangles.
struct Ply {
    properties: Vec<(String, usize)>,
    rows: Vec<Vec<u8>>,
    corners: Vec<u8>,
}

impl Ply {
    fn read(path: &Path) -> Self {
        let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let end = b"end_header\n";
        let at = bytes.windows(end.len()).position(|window| window == end).expect("a header") + end.len();
        let header = String::from_utf8_lossy(&bytes[..at]).into_owned();
        let property = |line: &str| {
            let (kind, name) = line.strip_prefix("property ")?.split_once(' ')?;
            let width = match kind {
                "float" => 4,
                "double" => 8,
                _ => return None,
            };
            Some((name.to_owned(), width))
        };
        let properties: Vec<(String, usize)> = header.lines().filter_map(property).collect();
        let count: usize = header
            .lines()
            .find_map(|line| line.strip_prefix("element vertex ")?.parse().ok())
            .expect("a number of points");
        let width: usize = properties.iter().map(|(_, width)| width).sum();
        let (points, faces) = bytes[at..].split_at(count * width);
        Self {
            properties,
            rows: points.chunks_exact(width).map(<[u8]>::to_vec).collect(),
            corners: faces.chunks_exact(13).flat_map(|face| face[1..].to_vec()).collect(),
        }
    }

    /// Type and bytes of what these names stand for.
    fn array(&self, names: &[&str]) -> Option<(String, Vec<u8>)> {
        let index = self.properties.iter().position(|(name, _)| name == names[0])?;
        let before: usize = self.properties[..index].iter().map(|(_, width)| width).sum();
        let width = self.properties[index].1;
        let bytes = self.rows.iter().flat_map(|row| row[before..before + names.len() * width].to_vec());
        Some((if width == 4 { "Float32" } else { "Float64" }.to_owned(), bytes.collect()))
    }
}

/// Times and names of the files that an index lists, by the name of their part.
pub(crate) fn listed(path: &Path, part: &str) -> Vec<(f64, String)> {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    assert!(text.ends_with("</Collection>\n</VTKFile>\n"), "{} is whole", path.display());
    let rows = text.lines().filter(|line| line.contains(&format!(" name=\"{part}\"")));
    rows.map(|row| {
        let words: Vec<&str> = row.split('"').collect();
        (words[1].parse().expect("a time"), words[words.len() - 2].to_owned())
    })
    .collect()
}

/// The names of the files in a folder.
fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
}

#[test]
fn every_array_has_the_bits_that_a_folder_of_the_same_run_has() {
    let snow = SNOW_SCENE.replace("title", "hash_interval = 1\ntitle");
    let more = ["--fields", "velocity,plastic_ratio,stress,force,acceleration", "--grid", "smoke"];
    for (text, precision, asked) in [
        (SMALL_SCENE, "f32", &["--fields", "velocity"][..]),
        (SMALL_SCENE, "f64", &[]),
        (snow.as_str(), "f32", &more),
        (snow.as_str(), "f64", &more),
    ] {
        let here = folder();
        let scene = write_scene(here.path(), text);
        for save in ["run.pvd", "plain"] {
            let run = ["run", scene.as_str(), "--steps", "8", "--precision", precision, "--save", save];
            nappe_in(here.path(), &[&run[..], asked].concat()).ok();
        }
        let frames = listed(&here.path().join("run.pvd"), "particles");
        assert!(frames.len() > 2, "{frames:?}");
        for (number, (time, file)) in frames.iter().enumerate() {
            assert_eq!(*file, format!("run/frame-{number:06}.vtp"));
            let vtp = Vtp::read(&here.path().join(file));
            let ply = Ply::read(&here.path().join(format!("plain/frame-{number:06}.ply")));
            assert_eq!(vtp.numbers("TimeValue"), [*time]);
            assert_eq!(vtp.numbers("frame"), [number as f64]);
            assert_eq!(vtp.array("Points", "Points"), ply.array(&["x", "y", "z"]), "{file}");
            assert_eq!(vtp.array("PointData", "velocity"), ply.array(&["vx", "vy", "vz"]), "{file}");
            assert_eq!(vtp.array("PointData", "force"), ply.array(&["fx", "fy", "fz"]), "{file}");
            assert_eq!(vtp.array("PointData", "acceleration"), ply.array(&["ax", "ay", "az"]), "{file}");
            for name in ["plastic_ratio", "stress_norm"] {
                assert_eq!(vtp.array("PointData", name), ply.array(&[name]), "{file}");
            }
            assert_eq!(vtp.count("NumberOfPoints"), ply.rows.len());
            let corners = vtp.array("Polys", "connectivity").map_or_else(Vec::new, |(_, bytes)| bytes);
            assert!(corners == ply.corners, "{file}: triangles");
            let cells = vtp.count("NumberOfPolys") + vtp.count("NumberOfVerts");
            let bodies = vtp.array("CellData", "body").expect("numbers of bodies").1;
            assert_eq!(bodies, vec![0; 4 * cells], "one body");
        }
        let last = Vtp::read(&here.path().join(&frames.last().expect("a frame").1));
        assert_eq!(last.texts("body_names"), [if text == SMALL_SCENE { "sheet" } else { "block" }]);
        assert!(last.numbers("kinetic_energy")[0] > 0.0);
        assert_eq!(last.texts("state_hash").first().map(String::len), Some(16));
        if text == SMALL_SCENE {
            assert_eq!((last.count("NumberOfVerts"), last.count("NumberOfPolys")), (0, 2 * 11 * 11));
            continue;
        }
        assert_eq!((last.count("NumberOfVerts"), last.texts("load_names")), (216, vec!["floor".to_owned()]));
        let grids = listed(&here.path().join("run.pvd"), "grid");
        assert_eq!(grids.len(), frames.len());
        let grid = Vtp::read(&here.path().join(&grids.last().expect("a grid").1));
        let ply = Ply::read(&here.path().join(format!("plain/grid-{:06}.ply", grids.len() - 1)));
        assert_eq!(grid.array("Points", "Points"), ply.array(&["x", "y", "z"]));
        assert_eq!(grid.array("PointData", "mass"), ply.array(&["mass"]));
        assert_eq!(grid.array("PointData", "velocity"), ply.array(&["vx", "vy", "vz"]));
        assert_eq!(grid.array("PointData", "force"), ply.array(&["fx", "fy", "fz"]));
        assert_eq!(grid.count("NumberOfVerts"), ply.rows.len());
    }
}

/// A ball that goes up, a box that stays.
const MOVING: &str = r#"
[[collider]]
name = "ball"
sphere = { center = [0, -2, 0], radius = 0.5 }
velocity = [0, 1, 0]

[[collider]]
name = "box <&> \"é\""
box = { center = [0, -4, 0], size = [2, 0.5, 2] }
"#;

#[test]
fn colliders_are_written_where_they_are_and_again_when_one_has_moved() {
    let still = MOVING.replace("velocity = [0, 1, 0]\n", "");
    for (colliders, speed) in [(MOVING, 1.0), (still.as_str(), 0.0)] {
        let here = folder();
        let scene = write_scene(here.path(), &format!("{SMALL_SCENE}{colliders}"));
        nappe_in(here.path(), &["run", &scene, "--steps", "6", "--save", "run.pvd"]).ok();
        let rows = listed(&here.path().join("run.pvd"), "colliders");
        assert_eq!(rows.len(), 4, "each frame has them");
        for (number, (time, file)) in rows.iter().enumerate() {
            let written = if speed > 0.0 { number } else { 0 };
            assert_eq!(*file, format!("run/colliders-{written:06}.vtp"));
            let vtp = Vtp::read(&here.path().join(file));
            assert_eq!(vtp.texts("collider_names"), ["ball", "box <&> \"é\""]);
            let position = vtp.numbers("collider_position");
            assert_eq!(position, [0.0, -2.0 + speed * time, 0.0, 0.0, -4.0, 0.0]);
            assert_eq!(vtp.numbers("collider_turn"), [0.0, 0.0, 0.0, 1.0].repeat(2));

            let points = vtp.points();
            let (ball, cuboid) = points.split_at(points.len() - 8);
            for point in ball {
                let far = [0, 1, 2].map(|axis| (point[axis] - position[axis]).powi(2)).iter().sum::<f64>();
                assert!((far.sqrt() - 0.5).abs() < 1e-12, "{point:?}");
            }
            for point in cuboid {
                assert_eq!(point.map(f64::abs), [1.0, if point[1] < -4.0 { 4.25 } else { 3.75 }, 1.0]);
            }
            let (_, numbers) = vtp.array("CellData", "collider").expect("numbers of colliders");
            assert_eq!(numbers.len(), 4 * vtp.count("NumberOfPolys"));
            assert_eq!(numbers[numbers.len() - 4..], [1, 0, 0, 0]);
        }
        let files = names(&here.path().join("run"));
        assert_eq!(files.len(), if speed > 0.0 { 8 } else { 5 }, "{files:?}");
    }
}

#[test]
fn a_file_of_a_frame_is_little_larger_than_its_arrays() {
    let here = folder();
    let run = ["run", "demo", "--steps", "40", "--save", "run.pvd", "--fields", "velocity"];
    nappe_in(here.path(), &run).ok();
    let (_, file) = listed(&here.path().join("run.pvd"), "particles").pop().expect("a frame");
    let vtp = Vtp::read(&here.path().join(&file));
    let arrays = [vtp.array("Points", "Points"), vtp.array("PointData", "velocity")];
    let raw: usize = arrays.iter().flatten().map(|(_, bytes)| bytes.len()).sum();
    let size = fs::metadata(here.path().join(&file)).expect("the file").len() as f64;
    assert!(raw > 100_000 && size < 1.25 * raw as f64, "{size} bytes for {raw}");
}

/// A run that does not end, and has written a file.
fn begun(here: &Path, more: &[&str], file: &str) -> Child {
    write_scene(here, &SMALL_SCENE.replace("steps = 40", "steps = 0"));
    let mut run = command();
    run.current_dir(here).args(["run", "scene.toml", "--save", "run.pvd"]).args(more);
    let run = run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    until("something is written", || here.join(file).exists());
    run
}

/// Every file that an index lists is whole; gives how many there are.
pub(crate) fn check_whole(here: &Path, index: &str) -> usize {
    let rows = listed(&here.join(index), "particles");
    for (time, file) in &rows {
        assert_eq!(Vtp::read(&here.join(file)).numbers("TimeValue"), [*time], "{file}");
    }
    rows.len()
}

#[test]
fn a_run_that_is_killed_or_ended_leaves_an_index_of_whole_files() {
    let here = folder();
    let mut run = begun(here.path(), &[], "run/frame-000040.vtp");
    run.kill().expect("it runs");
    run.wait().expect("it ends");
    assert_eq!(check_whole(here.path(), "run.pvd") % 32, 1, "it was written again after 32 frames");
    for name in names(&here.path().join("run")) {
        let file = here.path().join("run").join(name);
        if file.extension().is_some_and(|ending| ending == "vtp") {
            Vtp::read(&file);
        }
    }

    // Another one is refused, and takes its place once it has ended.
    let second = nappe_in(here.path(), &["run", "scene.toml", "--save", "run.pvd"]);
    assert!(second.code == Some(1) && second.stderr.contains("run.pvd is there already"), "{second:?}");
    fs::rename(here.path().join("run.pvd"), here.path().join("old.pvd")).expect("it is there");
    let second = nappe_in(here.path(), &["run", "scene.toml", "--save", "run.pvd"]);
    assert!(second.code == Some(1) && second.stderr.contains("holds frames already"), "{second:?}");
    let mut run = begun(here.path(), &["--force"], "run/frames.new/frame-000003.vtp");
    assert!(check_whole(here.path(), "run.pvd.new") > 0, "beside those of the earlier run");
    assert_eq!(end_by(&mut run, "INT"), Some(130));
    let count = check_whole(here.path(), "run.pvd");
    let expected: BTreeSet<String> = (0..count).map(|number| format!("frame-{number:06}.vtp")).collect();
    let mut files = names(&here.path().join("run"));
    // What the killed run was writing.
    files.retain(|name| !name.ends_with(".vtp.new"));
    assert_eq!(files, expected);
    assert_eq!(
        names(here.path()),
        BTreeSet::from(["old.pvd", "run", "run.pvd", "scene.toml"].map(str::to_owned))
    );
}

#[test]
fn a_refused_run_leaves_nothing_and_what_does_not_fit_is_told() {
    let here = folder();
    let scene = write_scene(here.path(), &SMALL_SCENE.replace("\"top_left\", \"top_right\"", "0, 144"));
    let done = nappe_in(here.path(), &["run", &scene, "--save", "a/run.PVD"]);
    assert_eq!(done.code, Some(5), "{done:?}");
    assert_eq!(names(here.path()), BTreeSet::from(["scene.toml".to_owned()]));

    fs::create_dir(here.path().join("folder.pvd")).expect("a folder");
    fs::write(here.path().join("taken"), "mine").expect("a file");
    for (args, code, part) in [
        (&["--save", "folder.pvd"][..], 1, "folder.pvd is no plain file"),
        (&["--save", "taken.pvd"], 1, "cannot make the folder taken"),
        (&["--save", "run.pvd", "--color", "speed"], 2, "--color belongs to an HTML file"),
        (&["--save", "run.pvd", "--max-error", "0.1"], 2, "--max-error belongs to an HTML file"),
        (
            &["--save", "run.tar.usd"],
            2,
            "an index of files for ParaView in .pvd, a scene of USD in .usda, a table in .csv",
        ),
    ] {
        let done = nappe_in(here.path(), &[&["run", "demo"][..], args].concat());
        assert!(done.code == Some(code) && done.stderr.contains(part), "{args:?}: {done:?}");
    }
    assert_eq!(names(here.path()), BTreeSet::from(["folder.pvd", "scene.toml", "taken"].map(str::to_owned)));
}
