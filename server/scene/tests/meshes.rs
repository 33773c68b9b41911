//! Mesh readers and writers: round trips, errors by line, and text that is not a mesh.

use nappe_scene::{
    SceneError,
    mesh::{
        EtiOptions, EtiTexts, Loaded, NamedText, PlyFrame, PlyNumbers, PlyProperty, course_grid, read_eti,
        read_obj, read_off, read_ply, read_stl, six_digits, write_eti, write_obj, write_off, write_ply,
        write_ply_frame,
    },
};
use nappe_sim::mesh::TriangleMesh;
use proptest::prelude::*;

fn eti(
    points: &str,
    faces: &str,
    masses: &str,
    uv: &str,
    missing: Option<f64>,
) -> Result<Loaded, SceneError> {
    let texts = EtiTexts {
        points: NamedText { file: "points.eti", text: points },
        faceset: Some(NamedText { file: "faceset.eti", text: faces }),
        masses: Some(NamedText { file: "masses.eti", text: masses }),
        texcoord: (!uv.is_empty()).then_some(NamedText { file: "texcoord.eti", text: uv }),
    };
    read_eti(&texts, &EtiOptions { missing_mass: missing })
}

#[test]
fn numbers_are_written_as_a_cpp_stream_writes_them() {
    for (value, wanted) in [
        (0.0, "0"),
        (-0.0, "-0"),
        (1.0, "1"),
        (0.1 * 3.0, "0.3"),
        (-0.059_847_214_4, "-0.0598472"),
        (0.006_632_189_7, "0.00663219"),
        (1.0 / 9.0, "0.111111"),
        (123_456.7, "123457"),
        (999_999.6, "1e+06"),
        (1_234_567.0, "1.23457e+06"),
        (0.000_1, "0.0001"),
        (0.000_099_999_96, "0.0001"),
        (0.000_012_345_678, "1.23457e-05"),
        (1e-10, "1e-10"),
        (2.5e100, "2.5e+100"),
        (-42.0, "-42"),
    ] {
        assert_eq!(six_digits(value), wanted);
    }
}

#[test]
fn a_set_survives_blanks_tabs_carriage_returns_and_negative_zeros() {
    let points = "\t 3 \r\n\t\t 0 0 -0\r\n 1 0 0 \r\n\r\n  0 1e0 0  ";
    let loaded = eti(points, "\t0  1 2   \n\n", "0\n1\n2.5\n\n", "0 -0\n1 -0\n0 -1\n", None).unwrap();
    assert_eq!(loaded.mesh.points, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert!(loaded.mesh.points[0][2].is_sign_negative());
    assert_eq!(loaded.mesh.triangles, [[0, 1, 2]]);
    assert_eq!(loaded.mesh.masses, [0.0, 1.0, 2.5]);
    assert_eq!(loaded.mesh.uv[2], [0.0, -1.0]);
    assert!(loaded.warnings.is_empty());
    let written = write_eti(&loaded.mesh);
    assert_eq!(written.points, "3\n0 0 -0\n1 0 0\n0 1 0\n");
    assert_eq!(written.texcoord.unwrap(), "0 -0\n1 -0\n0 -1\n");
}

const P: &str = "3\n0 0 0\n1 0 0\n0 1 0\n";
const M: &str = "1\n1\n1\n";

#[test]
fn every_error_of_a_set_names_its_file_and_line() {
    for (points, faces, masses, uv, wanted) in [
        ("", "", M, "", "points.eti: is empty; allowed: a number of points first"),
        ("x\n", "", M, "", "points.eti:1: the number of points is 'x'; allowed: a whole number"),
        ("4000000000\n0 0 0\n", "", M, "", "points.eti:1: announces 4000000000 points, but 1 follow"),
        ("3\n0 0 0\n1 0 0\n", "", M, "", "points.eti:1: announces 3 points, but 2 follow"),
        ("1\n0 0\n   \n", "", M, "", "points.eti:2: a point has 2 numbers; allowed: 3"),
        ("1\n0 nan 0\n", "", M, "", "points.eti:2: a point is 'nan'; allowed: a finite number"),
        (
            P,
            "0 1 2\n0 1 3\n",
            M,
            "",
            "faceset.eti:2: names point '3'; allowed: 0 to 2, the points of this mesh",
        ),
        (P, "0 1 -2\n", M, "", "faceset.eti:1: names point '-2'; allowed: 0 to 2"),
        (P, "0 1\n", M, "", "faceset.eti:1: has 2 indices; allowed: three, a triangle"),
        (P, "", "1\n-1\n1\n", "", "masses.eti:2: the mass of point 1 is -1; allowed: 0 (pinned) or more"),
        (P, "", "1\n1 1\n1\n", "", "masses.eti:2: a mass has 2 numbers; allowed: 1"),
        (
            P,
            "",
            "1\n1\n1\n1\n",
            "",
            "masses.eti:4: has more masses than the 3 points; allowed: one per point",
        ),
        (P, "", "1\n1\n", "", "masses.eti:2: holds 2 masses for 3 points; point 2 is the first without"),
        (
            P,
            "",
            "1\n1\n1",
            "",
            "masses.eti:3: holds 2 masses and an unfinished line 3 ('1' without an end of line: the file may be cut) for 3 points",
        ),
        (P, "", M, "0 0\n", "texcoord.eti: holds 1 texture coordinates for 3 points; allowed: one per point"),
        (P, "", M, "0\n", "texcoord.eti:1: a texture coordinate has 1 numbers; allowed: 2"),
    ] {
        let found = eti(points, faces, masses, uv, None).unwrap_err().to_string();
        assert!(found.starts_with(wanted), "\nwanted {wanted}\nfound  {found}");
    }
}

#[test]
fn a_missing_mass_gets_the_value_that_was_asked_for_and_a_warning() {
    for masses in ["1\n1\n", "1\n1\n1"] {
        let loaded = eti(P, "0 1 2\n", masses, "", Some(0.25)).unwrap();
        assert_eq!(loaded.mesh.masses, [1.0, 1.0, 0.25]);
        assert!(loaded.warnings[0].ends_with("points 2 to 2 get the mass 0.25 kg"), "{:?}", loaded.warnings);
    }
    assert_eq!(eti(P, "", "1\n1\n1 ", "", None).unwrap().mesh.masses, [1.0; 3], "a blank ends a number");
    assert_eq!(eti(P, "", "1\n1\n1\n ", "", None).unwrap().mesh.masses, [1.0; 3]);
    assert!(eti(P, "", "1\n1\n1\n1\n", "", Some(1.0)).is_err(), "too many masses stay an error");
}

#[test]
fn the_formula_gives_back_what_its_file_holds() {
    let mesh = course_grid(7, 5, 0.1);
    let written = write_eti(&mesh);
    let (masses, uv) = (written.masses.unwrap(), written.texcoord.unwrap());
    let read = eti(&written.points, &written.faceset, &masses, &uv, None).unwrap().mesh;
    assert_eq!(read, mesh);
}

#[test]
fn obj_keeps_points_in_order_and_fans_polygons() {
    let text = "# a comment\r\no thing\nv 9 9 9\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nv 0 1 0\nvt 0.5\nvt 1 1\nvn 0 0 1\nf 2/1/1 3/1 4/1 5//1\nf -1 -2 -3\nusemtl x\n";
    let loaded = read_obj(text, "a.obj").unwrap();
    assert_eq!(loaded.mesh.points[0], [9.0; 3], "an isolated point stays");
    assert_eq!(loaded.mesh.triangles, [[1, 2, 3], [1, 3, 4], [4, 3, 2]]);
    assert!(loaded.mesh.uv.is_empty());
    assert!(loaded.warnings[0].contains("some points have no texture coordinate"));
}

#[test]
fn obj_off_and_ply_give_back_what_was_written() {
    let mut mesh = TriangleMesh::grid(4, 3, 0.1 / 3.0);
    let mut bytes = Vec::new();
    write_obj(&mesh, &mut bytes).unwrap();
    assert_eq!(read_obj(std::str::from_utf8(&bytes).unwrap(), "a.obj").unwrap().mesh, mesh);
    mesh.masses = (0..12).map(f64::from).collect();
    bytes.clear();
    write_ply(&mesh, &mut bytes).unwrap();
    assert_eq!(read_ply(&bytes, "a.ply").unwrap().mesh, mesh);
    (mesh.masses, mesh.uv) = (Vec::new(), Vec::new());
    bytes.clear();
    write_off(&mesh, &mut bytes).unwrap();
    assert_eq!(read_off(std::str::from_utf8(&bytes).unwrap(), "a.off").unwrap().mesh, mesh);
}

#[test]
fn errors_of_obj_and_off_are_named() {
    for (text, wanted) in [
        ("", "a.obj: holds no vertices"),
        ("v 0 0\n", "a.obj:1: a vertex has 2 numbers; allowed: 3"),
        ("v 0 0 inf\n", "a.obj:1: a vertex is 'inf'; allowed: a finite number"),
        ("v 0 0 0\nf 1 1\n", "a.obj:2: a face has 2 corners; allowed: 3 or more"),
        ("v 0 0 0\nf 1 1 2\n", "a.obj:2: a face names vertex '2'; allowed: 1 to 1 (those above this line)"),
        ("v 0 0 0\nf 1 1 0\n", "a.obj:2: a face names vertex '0'"),
        ("v 0 0 0\nf 1 1 -2\n", "a.obj:2: a face names vertex '-2'"),
        ("v 0 0 0\nf 1 1 -9223372036854775808\n", "a.obj:2: a face names vertex"),
        (
            "v 0 0 0\nf 1/1 1 1\n",
            "a.obj:2: a face names texture coordinate '1'; allowed: none, there are none above",
        ),
        ("f 1 2 3\n", "a.obj:1: a face names vertex '1'; allowed: none, there are none above this line"),
        // The last line is cut in the middle.
        ("v 0 0 0\nv 1 0", "a.obj:2: a vertex has 2 numbers; allowed: 3"),
        ("v 0 0 0\nv 1 0 -", "a.obj:2: a vertex is '-'; allowed: a finite number"),
        ("v 0 0 0\nf 1 1", "a.obj:2: a face has 2 corners; allowed: 3 or more"),
    ] {
        let found = read_obj(text, "a.obj").unwrap_err().to_string();
        assert!(found.starts_with(wanted), "\nwanted {wanted}\nfound  {found}");
    }
    for (text, wanted) in [
        ("", "a.off: ends before its counts"),
        ("OFF", "a.off: ends before its counts"),
        ("COFF\n", "a.off: ends before its counts"),
        ("XOFF\n", "a.off:1: begins with 'XOFF'; allowed: OFF"),
        ("OFF BINARY\n", "a.off:1: is a binary OFF; allowed: text"),
        ("OFF\n3\n", "a.off:2: has one count"),
        ("OFF\n3 x 0\n", "a.off:2: the number of faces is 'x'; allowed: a whole number"),
        ("OFF\n900000000000 1 0\n0 0 0\n", "a.off:2: announces 900000000000 points, but 1 follow"),
        ("OFF\n2 0 0\n0 0 0\n", "a.off:2: announces 2 points, but 1 follow"),
        ("OFF 1 1 0\n0 0 0\n", "a.off:1: announces 1 faces, but 0 follow"),
        (
            "OFF 1 1 0\n0 0 0\n18446744073709551615 0 0\n",
            "a.off:3: announces 18446744073709551615 corners, but 2 follow",
        ),
        ("OFF 1 1 0\n0 0 0\n3 0 0\n", "a.off:3: announces 3 corners, but 2 follow"),
        ("OFF 1 1 0\n0 0 0\n3 0 0 1\n", "a.off:3: names point '1'; allowed: 0 to 0"),
        ("OFF 0 1 0\n3 0 0 0\n", "a.off:2: names point '0'; allowed: none, there are no points"),
        ("OFF 2 0 0\n0 0 0\n1 0", "a.off:3: a point has 2 numbers; allowed: 3"),
        ("OFF 1 1 0\n0 0 0\n3 0 0", "a.off:3: announces 3 corners, but 2 follow"),
    ] {
        let found = read_off(text, "a.off").unwrap_err().to_string();
        assert!(found.starts_with(wanted), "\nwanted {wanted}\nfound  {found}");
    }
}

#[test]
fn a_set_whose_last_line_is_cut_is_refused_with_the_line() {
    for (points, faces, uv, wanted) in [
        ("3\n0 0 0\n1 0 0\n0 1", "", "", "points.eti:4: a point has 2 numbers; allowed: 3"),
        ("3\n0 0 0\n1 0 0\n0 1 -", "", "", "points.eti:4: a point is '-'; allowed: a finite number"),
        (P, "0 1 2\n0 1", "", "faceset.eti:2: has 2 indices; allowed: three, a triangle"),
        (P, "", "0 0\n0 1\n1", "texcoord.eti:3: a texture coordinate has 1 numbers; allowed: 2"),
    ] {
        let found = eti(points, faces, M, uv, None).unwrap_err().to_string();
        assert!(found.starts_with(wanted), "\nwanted {wanted}\nfound  {found}");
    }
}

#[test]
fn meshes_whose_last_line_has_no_end_and_integers_are_read() {
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.5], [0.0, 1.0, 0.0]];
    let fan = [[0, 1, 2], [0, 2, 3]];
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nf 1 2 3 4";
    let off = "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0.5\n0 1 0\n4 0 1 2 3";
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
               property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0.5\n0 1 0\n4 0 1 2 3";
    for read in [read_obj(obj, "a.obj"), read_off(off, "a.off"), read_ply(ply.as_bytes(), "a.ply")] {
        let mesh = read.unwrap().mesh;
        assert_eq!((&mesh.points[..], &mesh.triangles[..]), (&points[..], &fan[..]));
    }
    let set = eti("3\n0 0 0\n1 0 0\n0 1 0.5", "0 1 2", M, "", None).unwrap().mesh;
    assert_eq!((set.points[2], set.triangles), ([0.0, 1.0, 0.5], vec![[0, 1, 2]]));
}

#[test]
fn a_binary_ply_with_a_number_that_is_none_is_refused() {
    let mut mesh = TriangleMesh::grid(2, 2, 1.0);
    mesh.points[3][1] = f64::NAN;
    let mut bytes = Vec::new();
    write_ply(&mesh, &mut bytes).unwrap();
    let error = read_ply(&bytes, "a.ply").unwrap_err().to_string();
    assert_eq!(error, "a.ply: the 'y' of vertex 3 is 'NaN'; allowed: a finite number");
}

#[test]
fn a_frame_reads_back_as_the_positions_it_shows() {
    let frame = PlyFrame {
        positions: PlyNumbers::F32(&[0.5, 1.0, -2.0, 3.0, 4.0, 5.0]),
        properties: &[
            PlyProperty { names: &["vx", "vy"], values: PlyNumbers::F32(&[6.0, 7.0, 8.0, 9.0]) },
            PlyProperty { names: &["mass"], values: PlyNumbers::F32(&[0.25, 0.75]) },
        ],
        triangles: &[[0, 1, 1]],
        step: 7,
        time: 0.25,
        comments: &["run 12".to_owned(), "carried 1e0 -2.5e-3".to_owned()],
    };
    let mut bytes = Vec::new();
    write_ply_frame(&frame, &mut bytes).unwrap();
    let said = "comment step 7\ncomment time_seconds 0.25\ncomment run 12\ncomment carried 1e0 -2.5e-3\nelement vertex 2\n";
    assert!(String::from_utf8_lossy(&bytes).contains(said));
    let mesh = read_ply(&bytes, "frame.ply").unwrap().mesh;
    assert_eq!(mesh.points, [[0.5, 1.0, -2.0], [3.0, 4.0, 5.0]]);
    assert_eq!(mesh.triangles, [[0, 1, 1]]);
    // A property of our own, read back by the name that a mesh knows, stands beside its particle's others.
    assert_eq!(mesh.masses, [0.25, 0.75]);
    let numbers: Vec<u8> =
        [3.0_f32, 4.0, 5.0, 8.0, 9.0, 0.75].into_iter().flat_map(f32::to_le_bytes).collect();
    assert!(bytes.windows(numbers.len()).any(|window| window == numbers));
}

#[test]
fn a_frame_in_binary64_holds_its_bits_beside_numbers_in_binary32() {
    let positions = [1.0 / 3.0, -0.0, 1e-300, f64::MIN_POSITIVE, 1e300, -2.0 / 3.0];
    let frame = PlyFrame {
        positions: PlyNumbers::F64(&positions),
        properties: &[PlyProperty { names: &["mass"], values: PlyNumbers::F32(&[0.25, 0.75]) }],
        triangles: &[],
        step: 1,
        time: 0.5,
        comments: &[],
    };
    let mut bytes = Vec::new();
    write_ply_frame(&frame, &mut bytes).unwrap();
    assert!(String::from_utf8_lossy(&bytes).contains("property double z\nproperty float mass\n"));
    let mesh = read_ply(&bytes, "frame.ply").unwrap().mesh;
    let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(mesh.points.as_flattened()), bits(&positions));
    assert_eq!(mesh.masses, [0.25, 0.75]);
}

/// Text made of the pieces of the formats, so that it goes deep into the readers.
fn near_mesh() -> impl Strategy<Value = String> {
    let word = prop_oneof![
        Just("v"),
        Just("f"),
        Just("vt"),
        Just("OFF"),
        Just("\n"),
        Just("\n"),
        Just("0"),
        Just("1"),
        Just("3"),
        Just("-1"),
        Just("1/2"),
        Just("nan"),
        Just("1e999"),
        Just("99999999999999999999"),
        Just("#"),
        Just("ply\n"),
        Just("format ascii 1.0\n"),
        Just("element vertex 2\n"),
        Just("property float x\n"),
        Just("end_header\n"),
        Just("property list uchar int vertex_indices\n"),
        Just("solid\n"),
        Just("facet\n"),
        Just("outer loop\n"),
        Just("vertex 0 0 1\n"),
        Just("endloop\nendfacet\n"),
        Just("endsolid\n"),
        Just("é"),
    ];
    prop::collection::vec(word, 0..60).prop_map(|words| words.join(" "))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn no_text_makes_a_reader_panic_and_what_it_reads_has_indices_in_range(text in near_mesh(), bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let mut read = vec![read_obj(&text, "a"), read_off(&text, "a"), read_ply(text.as_bytes(), "a"), read_ply(&bytes, "a")];
        read.extend([read_stl(text.as_bytes(), "a"), read_stl(&bytes, "a")]);
        read.push(eti(&text, &text, &text, &text, None));
        read.push(eti(P, &text, M, &text, Some(1.0)));
        for loaded in read.into_iter().flatten() {
            let count = loaded.mesh.points.len();
            prop_assert!(loaded.mesh.triangles.iter().flatten().all(|i| (*i as usize) < count));
        }
    }

    #[test]
    fn no_scene_text_makes_the_parser_panic(text in "(\\[\\[body\\]\\]\n|version|dt|mesh|grid|=|\\{|\\}|\\[|\\]|,|\"|1|-0.5|nan|é|\n| ){0,60}") {
        if let Err(error) = nappe_scene::Scene::parse(&text, "s") {
            prop_assert!(!error.to_string().is_empty());
        }
    }

    #[test]
    fn six_digits_read_back_within_half_a_unit_of_the_sixth_digit(value in prop::num::f64::NORMAL) {
        let back: f64 = six_digits(value).parse().unwrap();
        prop_assert!((back - value).abs() <= 5.1e-6 * value.abs() || !back.is_finite());
    }
}
