//! `nappe mesh`: the course's grids byte for byte, conversions, descriptions.

use std::{fmt::Write, fs, path::Path};

use serde_json::{Value, json};

use crate::support::{course, folder, nappe, nappe_in};

fn same_files(made: &Path, original: &Path) {
    for file in ["points.eti", "faceset.eti", "masses.eti", "texcoord.eti"] {
        let read =
            |folder: &Path| fs::read(folder.join(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
        let (made, original) = (read(made), read(original));
        let at = made.iter().zip(&original).position(|(a, b)| a != b);
        assert_eq!((at, made.len()), (None, original.len()), "{file} differs at byte {at:?}");
    }
}

#[test]
fn the_courses_grids_come_out_byte_for_byte() {
    let Some(course) = course() else { return };
    let folder = folder();
    for (size, name) in [("70x70", "drap70"), ("10x10", "drap10")] {
        nappe_in(folder.path(), &["mesh", "grid", size, "--spacing", "0.1", "--course", "--out", name]).ok();
        same_files(&folder.path().join(name), &course.join("data").join(name));
    }
}

#[test]
fn a_mesh_survives_a_tour_of_all_formats() {
    let folder = folder();
    nappe_in(folder.path(), &["mesh", "grid", "5x4", "--spacing", "0.25", "--course", "--out", "set"]).ok();
    for (from, to) in [("set", "a.ply"), ("a.ply", "b.obj"), ("b.obj", "c.off"), ("c.off", "d.ply")] {
        let done = nappe_in(folder.path(), &["mesh", "convert", from, to, "--json"]).ok().json();
        assert_eq!((&done["points"], &done["triangles"]), (&20.into(), &24.into()), "{from} to {to}");
    }
    let info = |name: &str| nappe_in(folder.path(), &["mesh", "info", name, "--json"]).ok().json();
    let (start, end) = (info("set"), info("d.ply"));
    assert_eq!(start["edges"], end["edges"]);
    assert_eq!((&start["min"], &start["max"]), (&end["min"], &end["max"]));
    // OBJ carries no masses: what a format cannot hold is gone, not invented.
    assert_eq!((&start["pinned"], &start["masses"], &end["masses"]), (&2.into(), &20.into(), &0.into()));
}

#[test]
fn a_set_that_lacks_a_mass_is_refused_unless_the_mass_is_given() {
    let Some(course) = course() else { return };
    let pull = course.join("data/pull");
    let pull = pull.to_str().expect("a UTF-8 path");
    let folder = folder();
    let refused = nappe_in(folder.path(), &["mesh", "convert", pull, "pull.ply"]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    for part in ["masses.eti", "1467", "1468", "--missing-mass"] {
        assert!(refused.stderr.contains(part), "'{part}' is missing in: {}", refused.stderr);
    }
    assert!(!folder.path().join("pull.ply").exists());
    nappe_in(folder.path(), &["mesh", "convert", pull, "pull.ply", "--missing-mass", "0.5"]).ok();
    let filled = nappe_in(folder.path(), &["mesh", "info", "pull.ply", "--json"]).ok().json();
    assert_eq!((&filled["points"], &filled["masses"]), (&1468.into(), &1468.into()));

    let described = nappe(&["mesh", "info", pull, "--json"]).ok().json();
    assert_eq!((&described["masses"], &described["missing_masses"]), (&1467.into(), &1.into()));
    assert!(described["warnings"][0].as_str().is_some_and(|warning| warning.contains("1468")), "{described}");
}

#[test]
fn several_meshes_are_described_one_per_line() {
    let folder = folder();
    for (size, out) in [("3x4", "a.obj"), ("5x2", "b.ply")] {
        nappe_in(folder.path(), &["mesh", "grid", size, "--out", out]).ok();
    }
    let lines = nappe_in(folder.path(), &["mesh", "info", "a.obj", "b.ply", "--json"]).ok().stdout;
    let described: Vec<Value> =
        lines.lines().map(|line| serde_json::from_str(line).expect("a JSON object per line")).collect();
    assert_eq!(described.iter().map(|mesh| &mesh["points"]).collect::<Vec<_>>(), [12, 10]);
    assert_eq!((&described[0]["mesh"], &described[1]["mesh"]), (&"a.obj".into(), &"b.ply".into()));
    let text = nappe_in(folder.path(), &["mesh", "info", "a.obj", "b.ply"]).ok().stdout;
    assert!(text.contains("a.obj") && text.contains("b.ply"), "{text}");
    // The file that cannot be read is named, also after one that can.
    let missing = nappe_in(folder.path(), &["mesh", "info", "a.obj", "none.obj"]);
    assert_eq!(missing.code, Some(1));
    assert!(missing.stderr.contains("none.obj"), "{}", missing.stderr);
}

/// Four facets of a tetrahedron, as text.
fn tetrahedron() -> String {
    let points = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"];
    let facets = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|corners: [usize; 3]| {
        let corners = corners.map(|corner| format!("vertex {}\n", points[corner])).concat();
        format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    });
    format!("solid\n{}endsolid\n", facets.concat())
}

#[test]
fn a_solid_of_facets_is_described_converted_and_simulated() {
    let folder = folder();
    fs::write(folder.path().join("a.stl"), tetrahedron()).expect("written");
    let info = nappe_in(folder.path(), &["mesh", "info", "a.stl", "--json"]).ok().json();
    assert_eq!(
        (&info["points"], &info["triangles"], &info["edges"]),
        (&4.into(), &4.into(), &6.into()),
        "{info}"
    );
    nappe_in(folder.path(), &["mesh", "convert", "a.stl", "a.ply"]).ok();
    let scene = "version = 1\ndt = 0.001\n[[body]]\nname = \"a\"\nmesh = { file = \"a.stl\" }\n\
                 mass = { particle = 0.1 }\nsprings = { stretch = { stiffness = 10 } }\n";
    fs::write(folder.path().join("scene.toml"), scene).expect("written");
    let ran = nappe_in(folder.path(), &["run", "scene.toml", "--steps", "2", "--json"]).ok().json();
    assert_eq!(ran["particles"], 4, "{ran}");
}

#[test]
fn springs_of_a_ply_go_to_the_server_and_are_told_where_a_format_has_none() {
    let folder = folder();
    let square = |stiffness: f64| {
        let properties = "property int vertex1\nproperty int vertex2\nproperty double stiffness\nproperty double damping\n";
        let edges =
            ["0 1", "0 2", "0 3", "1 2", "2 3"].map(|ends| format!("{ends} {stiffness} 0.1\n")).concat();
        format!(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
             element face 2\nproperty list uchar int vertex_indices\nelement edge 5\n{properties}end_header\n\
             0 0 0\n1 0 0\n1 0 1\n0 0 1\n3 0 1 2\n3 0 2 3\n{edges}"
        )
    };
    let hash = |springs: &str, stiffness: f64| {
        fs::write(folder.path().join("a.ply"), square(stiffness)).expect("written");
        let scene = format!(
            "version = 1\ndt = 0.01\n[[body]]\nname = \"a\"\nmesh = {{ file = \"a.ply\" }}\n\
             mass = {{ particle = 0.1 }}\npins = [0]\nsprings = {{ {springs} }}\n"
        );
        fs::write(folder.path().join("scene.toml"), scene).expect("written");
        let ran = nappe_in(folder.path(), &["run", "scene.toml", "--steps", "20", "--json"]).ok().json();
        ran["state_hash"].clone()
    };
    let (own, law) = ("pattern = \"file\"", "stretch = { stiffness = 10, damping = 0.1 }");
    assert_eq!(hash(own, 10.0), hash(law, 1.0), "the same springs, by the mesh and by a law");
    assert_ne!(hash(own, 10.0), hash(own, 20.0));

    // The same from a table.
    let rows = ["0,1", "0,2", "0,3", "1,2", "2,3"].map(|ends| format!("{ends},10,0.1\n")).concat();
    let table = format!("particle_a,particle_b,stiffness,damping\n{rows}");
    fs::write(folder.path().join("springs.csv"), &table).expect("written");
    let sprung = ["mesh", "springs", "a.ply", "springs.csv", "--out", "b.ply"];
    nappe_in(folder.path(), &sprung).ok();
    let written = fs::read_to_string(folder.path().join("scene.toml")).expect("it was just written");
    fs::write(folder.path().join("b.toml"), written.replace("a.ply", "b.ply")).expect("written");
    let ran = nappe_in(folder.path(), &["run", "b.toml", "--steps", "20", "--json"]).ok().json();
    assert_eq!(ran["state_hash"], hash(own, 10.0), "{ran}");

    fs::write(folder.path().join("springs.csv"), table.replace("2,3,10", "2,4,10")).expect("written");
    let refused = nappe_in(folder.path(), &[&sprung[..], &["--force"]].concat());
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(
        refused.stderr.contains("springs.csv:6:3: names point '4'; allowed: 0 to 3"),
        "{}",
        refused.stderr
    );
    let refused = nappe_in(folder.path(), &["mesh", "springs", "a.ply", "springs.csv", "--out", "b.obj"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");

    let told = nappe_in(folder.path(), &["mesh", "convert", "a.ply", "a.obj"]);
    assert_eq!(told.code, Some(0), "{told:?}");
    assert!(told.stderr.contains("the format .obj holds no springs: they are left out"), "{}", told.stderr);
    let kept = nappe_in(folder.path(), &["mesh", "convert", "a.ply", "c.ply"]);
    assert!(kept.code == Some(0) && kept.stderr.is_empty(), "{kept:?}");
}

#[test]
fn a_file_that_gzip_has_packed_is_read_and_not_sent() {
    // Three points and a triangle, as gzip writes them.
    const PACKED: [u8; 40] = [
        31, 139, 8, 0, 0, 0, 0, 0, 2, 255, 43, 83, 48, 0, 65, 174, 50, 5, 67, 40, 109, 0, 98, 113, 165, 1,
        73, 35, 5, 99, 46, 0, 67, 249, 110, 42, 32, 0, 0, 0,
    ];
    let folder = folder();
    fs::write(folder.path().join("a.obj.gz"), PACKED).expect("written");
    let info = nappe_in(folder.path(), &["mesh", "info", "a.obj.gz", "--json"]).ok().json();
    assert_eq!((&info["points"], &info["triangles"]), (&3.into(), &1.into()), "{info}");
    let refused = nappe_in(folder.path(), &["mesh", "upload", "a.obj.gz"]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("gunzip"), "{}", refused.stderr);
}

#[test]
fn a_folder_whose_name_has_a_dot_is_a_folder() {
    let folder = folder();
    fs::create_dir(folder.path().join("sheets.v2")).expect("made");
    let grid = ["mesh", "grid", "4x4", "--course", "--out", "sheets.v2", "--json"];
    let made = nappe_in(folder.path(), &grid).ok();
    assert!(folder.path().join("sheets.v2/points.eti").is_file());
    assert!(!made.stderr.contains("warning"), "nothing is lost in .eti files: {}", made.stderr);
    // Read and written as any folder; a new name with a dot is a format that is not known.
    nappe_in(folder.path(), &["mesh", "convert", "sheets.v2", "sheet.ply"]).ok();
    let unknown = nappe_in(folder.path(), &["mesh", "grid", "4x4", "--out", "sheets.v3"]);
    assert_eq!(unknown.code, Some(1), "{unknown:?}");
    assert!(unknown.stderr.contains("folder"), "{}", unknown.stderr);
}

#[test]
fn a_mesh_that_is_there_stays_unless_it_is_to_be_overwritten() {
    let folder = folder();
    let run = |args: &[&str]| nappe_in(folder.path(), args);
    run(&["mesh", "grid", "3x3", "--course", "--out", "set"]).ok();
    for out in ["a.obj", "b.ply", "other"] {
        run(&["mesh", "convert", "set", out]).ok();
        let file =
            if out == "other" { folder.path().join("other/points.eti") } else { folder.path().join(out) };
        let kept = fs::read(&file).expect("it is written");
        let grid = ["mesh", "grid", "4x4", "--out", out];
        for args in [&["mesh", "convert", "set", out][..], &grid] {
            let refused = run(args);
            assert_eq!(refused.code, Some(1), "{refused:?}");
            assert!(refused.stderr.contains("is there already: --force overwrites it"), "{}", refused.stderr);
            assert_eq!(fs::read(&file).expect("it stays"), kept);
        }
        run(&[&grid[..], &["--force"]].concat()).ok();
        let info = run(&["mesh", "info", out, "--json"]).ok().json();
        // The grid has no masses, and those of the set before it are not taken for its own.
        assert_eq!((&info["points"], &info["masses"]), (&16.into(), &0.into()), "{out}");
    }
}

#[test]
fn what_cannot_be_read_or_written_is_named() {
    let missing = nappe(&["mesh", "info", "no-such.obj"]);
    assert_eq!(missing.code, Some(1));
    assert!(missing.stderr.contains("no-such.obj"), "{}", missing.stderr);
    let folder = folder();
    fs::write(folder.path().join("a.glb"), "glTF").expect("written");
    let unknown = nappe_in(folder.path(), &["mesh", "info", "a.glb"]);
    assert_eq!(unknown.code, Some(1));
    assert!(unknown.stderr.contains("glTF: export the mesh as .obj or .ply"), "{}", unknown.stderr);
    assert_eq!(nappe(&["mesh", "grid", "1x70", "--out", "x"]).code, Some(2));
    assert_eq!(nappe(&["mesh", "grid", "7x7", "--spacing", "0", "--out", "x"]).code, Some(2));
}

/// A triangle above an edge and two below it, which meet in its middle; and a tetrahedron.
const TWO_PARTS: &str = "v 0 0 0\nv 2 0 0\nv 1 1 0\nv 1 0 0\nv 1 -1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 0 0 2\n\
    f 1 2 3\nf 1 5 4\nf 4 5 2\nf 6 8 7\nf 6 7 9\nf 6 9 8\nf 7 8 9\n";

#[test]
fn a_mesh_is_described_with_parts_borders_junctions_and_size() {
    let folder = folder();
    fs::write(folder.path().join("two.obj"), TWO_PARTS).expect("written");
    let text = nappe_in(folder.path(), &["mesh", "info", "two.obj"]).ok().stdout;
    assert_eq!(
        text,
        "mesh\n\
         file         two.obj\n\
         points       9\n\
         triangles    7, repeated: 0\n\
         edges        14\n\
         open edges   7, in loops: 1\n\
         T-junctions  1, the first: point 3 on the edge 0 to 1\n\
         parts        2\n\
         crossings    not counted: the mesh encloses no volume\n\
         volume       none: the mesh is not closed: the edge from point 0 at (0, 0, 0) to point 1 at (2, 0, 0) has \
         1 triangle, and each edge of a closed surface has two; 6 other edges are open too\n\
         masses       0, 0 kg, 0 pinned by mass 0, 0 missing\n\
         texture      0 coordinates\n\
         from         (0, -1, 0) m\n\
         to           (2, 1, 2) m\n\
         size         2 x 2 x 2 m, diagonal 3.4641016151377544 m\n\
         warning      two.obj: no masses: a scene must give them\n"
    );

    let described = nappe_in(folder.path(), &["mesh", "info", "two.obj", "--json"]).ok().json();
    let expected = json!({
        "mesh": "two.obj", "points": 9, "triangles": 7, "edges": 14,
        "masses": 0, "missing_masses": 0, "pinned": 0, "total_mass": 0.0, "texture_coordinates": 0,
        "min": [0.0, -1.0, 0.0], "max": [2.0, 1.0, 2.0], "size": [2.0, 2.0, 2.0], "diagonal": 12.0_f64.sqrt(),
        "parts": 2, "open_edges": 7, "boundary_loops": 1, "t_junctions": 1, "repeated_triangles": 0,
        "holes": 0, "turned": [], "overlaps": null, "crossings": null,
        "volume": null, "warnings": ["two.obj: no masses: a scene must give them"],
    });
    assert_eq!(described, expected);
}

#[test]
fn a_file_that_cannot_be_read_does_not_keep_others_from_being_described() {
    let folder = folder();
    let (open, closed) = TWO_PARTS.split_once("f 6 8 7").expect("the tetrahedron");
    let solid = format!("{}f 6 8 7{closed}f 7 9 8\n", &open[..open.find('f').expect("faces")]);
    for (name, text) in [("solid.obj", solid.as_str()), ("bad.obj", "v 0 0 zero\n")] {
        fs::write(folder.path().join(name), text).expect("written");
    }
    let done = nappe_in(folder.path(), &["mesh", "info", "bad.obj", "none.obj", "solid.obj", "--json"]);
    assert_eq!(done.code, Some(1));
    assert!(done.stderr.contains("bad.obj:1") && done.stderr.contains("none.obj"), "{}", done.stderr);
    assert_eq!(done.stdout.lines().count(), 1, "{}", done.stdout);
    // One face is there twice, the other way round, and so the solid is not closed.
    let described = done.json();
    assert_eq!((&described["repeated_triangles"], &described["volume"]), (&1.into(), &Value::Null));
    let told = |part: &str| {
        described["warnings"]
            .as_array()
            .expect("a list")
            .iter()
            .any(|w| w.as_str().is_some_and(|w| w.starts_with("solid.obj: ") && w.contains(part)))
    };
    assert!(told("1 of them run the other way round") && told("5 isolated points"), "{described}");

    fs::write(folder.path().join("solid.obj"), solid.replace("f 7 9 8\n", "")).expect("written");
    let closed = nappe_in(folder.path(), &["mesh", "info", "solid.obj", "--json"]).ok().json();
    let volume = closed["volume"].as_f64().expect("a volume");
    assert!((volume - 1.0 / 6.0).abs() < 1e-15, "{closed}");
    assert_eq!((&closed["open_edges"], &closed["parts"]), (&0.into(), &1.into()));
}

/// Two boxes of 1 m^3 that share 0.36 m^3, each a part.
const TWO_BOXES: &str = "v -.5 -.5 -.5\nv .5 -.5 -.5\nv -.5 .5 -.5\nv .5 .5 -.5\nv -.5 -.5 .5\nv .5 -.5 .5\n\
    v -.5 .5 .5\nv .5 .5 .5\nv 0 -.3 -.4\nv 1 -.3 -.4\nv 0 .7 -.4\nv 1 .7 -.4\nv 0 -.3 .6\nv 1 -.3 .6\nv 0 .7 .6\n\
    v 1 .7 .6\nf 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\nf 9 11 12 10\nf 13 14 16 15\n\
    f 9 10 14 13\nf 11 15 16 12\nf 9 13 15 11\nf 10 12 16 14\n";

#[test]
fn parts_of_a_closed_mesh_that_overlap_are_told_and_their_volume_is_that_of_the_union() {
    let folder = folder();
    fs::write(folder.path().join("boxes.obj"), TWO_BOXES).expect("written");
    let described = nappe_in(folder.path(), &["mesh", "info", "boxes.obj", "--json"]).ok().json();
    assert_eq!(
        (&described["parts"], &described["holes"], &described["turned"], &described["overlaps"]["pairs"]),
        (&json!(2), &json!(0), &json!([]), &json!(1)),
        "{described}"
    );
    assert_eq!(described["overlaps"]["triangles"], json!([0, 12]));
    for (volume, exact) in [(&described["overlaps"]["volume"], 0.36), (&described["volume"], 1.64)] {
        let off = volume.as_f64().expect("a number") / exact - 1.0;
        assert!(off.abs() < 0.02, "{described}");
    }
    let text = nappe_in(folder.path(), &["mesh", "info", "boxes.obj"]).ok().stdout;
    assert!(text.contains("overlapping pairs: 1, most those that begin with triangles 0 and 12"), "{text}");
}

/// A prism over a star of five points that is drawn in one line.
fn star() -> String {
    let mut text = String::new();
    for z in [-1, 1] {
        for [x, y] in [[100, 0], [31, 95], [-81, 59], [-81, -59], [31, -95]] {
            let _ = writeln!(text, "v {x} {y} {z}");
        }
    }
    text.push_str("v 0 0 -1\nv 0 0 1\n");
    for [a, b] in [[1, 3], [3, 5], [5, 2], [2, 4], [4, 1]] {
        let (c, d) = (a + 5, b + 5);
        let _ = writeln!(text, "f {a} {b} {d}\nf {a} {d} {c}\nf 11 {b} {a}\nf 12 {c} {d}");
    }
    text
}

#[test]
fn a_mesh_that_passes_through_itself_is_told_with_the_first_crossing_and_what_programs_mend_it() {
    let folder = folder();
    fs::write(folder.path().join("star.obj"), star()).expect("written");
    let described = nappe_in(folder.path(), &["mesh", "info", "star.obj", "--json"]).ok().json();
    let crossings = &described["crossings"];
    let count = crossings["count"].as_u64().expect("a number");
    assert!(count > 10 && crossings["cut_off"] == json!(false), "{described}");
    let [a, b] = [0, 1].map(|k| crossings["triangles"][k].as_u64().expect("a number"));
    assert!(a < b && b < 20, "{described}");
    assert!((0..3).all(|c| crossings["place"][c].as_f64().is_some_and(|x| x.abs() <= 100.0)), "{described}");
    let told = described["warnings"].to_string();
    let first = format!("first those of triangles {a} and {b} at");
    for part in [first.as_str(), "Blender", "MeshLab", "manifold3d"] {
        assert!(told.contains(part), "'{part}' is missing in {told}");
    }
    let text = nappe_in(folder.path(), &["mesh", "info", "star.obj"]).ok().stdout;
    assert!(text.contains(&format!("crossings    {count}, the first: triangles {a} and {b} at (")), "{text}");

    fs::write(folder.path().join("boxes.obj"), TWO_BOXES).expect("written");
    let sound = nappe_in(folder.path(), &["mesh", "info", "boxes.obj", "--json"]).ok().json();
    assert_eq!(
        sound["crossings"],
        json!({ "count": 0, "cut_off": false, "triangles": null, "place": null }),
        "{sound}"
    );
    let text = nappe_in(folder.path(), &["mesh", "info", "boxes.obj"]).ok().stdout;
    assert!(text.contains("crossings    0\n"), "{text}");
}
