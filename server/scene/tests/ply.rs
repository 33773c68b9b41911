//! PLY files: every end of line, encoding and type of number, strips and fans, and what is refused.

use nappe_scene::mesh::{Loaded, MeshFile, read_ply};

const POINTS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
const VERTICES: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const NUMBERS: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
const FACES: &str = "element face 2\nproperty list uchar int vertex_indices\n";
const CORNERS: &str = "3 0 1 2\n3 0 2 3\n";

/// A text of two triangles, a line of the payload each.
fn square() -> String {
    format!("ply\nformat ascii 1.0\ncomment hand made\n{VERTICES}{FACES}end_header\n{NUMBERS}{CORNERS}")
}

/// A text of the square's points, with elements of another kind: their name, count and lines.
fn with(name: &str, count: usize, lines: &str) -> String {
    let list = "property list int int vertex_indices\n";
    format!("ply\nformat ascii 1.0\n{VERTICES}element {name} {count}\n{list}end_header\n{NUMBERS}{lines}")
}

/// A file of the square with numbers of these types: `x` of the points, and the indices.
fn binary(order: &str, [x, index]: [(&str, usize); 2]) -> Vec<u8> {
    let header = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex 4\nproperty list uchar short skipped\n\
         property {} x\nproperty float y\nproperty double z\nproperty uchar red\nelement face 2\n\
         property list ushort {} vertex_index\nproperty int flags\nend_header\n",
        x.0, index.0
    );
    let mut bytes = header.into_bytes();
    let mut put = |bits: u64, size: usize| {
        let little = bits.to_le_bytes();
        match order {
            "little" => bytes.extend(&little[..size]),
            _ => bytes.extend(little[..size].iter().rev()),
        }
    };
    for [px, y, z] in POINTS {
        put(2, 1);
        put(7, 2);
        put(8, 2);
        match x.0 {
            "float" => put(u64::from((px as f32).to_bits()), 4),
            "double" => put(px.to_bits(), 8),
            _ => put(px as u64, x.1),
        }
        put(u64::from((y as f32).to_bits()), 4);
        put(z.to_bits(), 8);
        put(255, 1);
    }
    for corners in [[0, 1, 2], [0, 2, 3]] {
        put(3, 2);
        for corner in corners {
            put(corner, index.1);
        }
        put(9, 4);
    }
    bytes
}

#[track_caller]
fn assert_square(loaded: &Loaded, triangles: [[u32; 3]; 2]) {
    assert_eq!((&loaded.mesh.points[..], &loaded.mesh.triangles[..]), (&POINTS[..], &triangles[..]));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
}

const HALVES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

#[test]
fn a_text_is_read_with_any_end_of_line_and_with_a_byte_order_mark() {
    let faces_first = format!("ply\nformat ascii 1.0\n{FACES}{VERTICES}end_header\n{CORNERS}\n{NUMBERS}\n\n");
    let texts = [
        (square(), HALVES),
        (square().replace(CORNERS, &format!("\n{CORNERS}")), HALVES),
        (square().replace("0 2 3", " 0\t2   3  "), HALVES),
        (square().replace("uchar int ", "uchar int64 "), HALVES),
        (square().replace("uchar int ", "uint8 uint64 "), HALVES),
        (faces_first, HALVES),
        (with("tristrips", 1, "5 0 1 3 2 -1\n"), [[0, 1, 3], [3, 1, 2]]),
        (with("tristrips", 2, "3 0 1 3\n4 -1 3 1 2\n"), [[0, 1, 3], [3, 1, 2]]),
        (with("tristrips", 1, "6 0 1 3 3 1 2\n"), [[0, 1, 3], [1, 3, 2]]),
        (with("trifans", 1, "5 0 1 2 3 -1\n"), HALVES),
        (with("trifans", 1, "7 0 1 2 -1 0 2 3\n"), HALVES),
    ];
    for (text, triangles) in texts {
        for end in ["\n", "\r\n", "\r"] {
            for mark in ["", "\u{feff}"] {
                let text = format!("{mark}{}", text.replace('\n', end));
                assert_square(&read_ply(text.as_bytes(), "a.ply").expect(&text), triangles);
            }
        }
    }
}

#[test]
fn a_binary_file_is_read_in_both_byte_orders_with_numbers_of_every_type() {
    let whole = [("char", 1), ("uint8", 1), ("int16", 2), ("ushort", 2), ("int", 4), ("uint32", 4)];
    let wider = [("int64", 8), ("uint64", 8)];
    for order in ["little", "big"] {
        for index in whole.into_iter().chain(wider) {
            for x in whole.into_iter().chain([("float", 4), ("double", 8)]) {
                let bytes = binary(order, [x, index]);
                assert_square(&read_ply(&bytes, "a.ply").expect(order), HALVES);
            }
        }
    }
}

#[test]
fn the_first_number_of_a_binary_file_may_look_like_an_end_of_line() {
    let header = "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar y\n\
                  property uchar z\nend_header\n";
    for end in ["\n", "\r\n", "\r"] {
        let bytes = [header.replace('\n', end).as_bytes(), &[10, 13, 10]].concat();
        let loaded = read_ply(&bytes, "a.ply").expect("three bytes are three numbers");
        assert_eq!(loaded.mesh.points, [[10.0, 13.0, 10.0]], "{end:?}");
    }
}

#[test]
fn no_file_that_was_cut_is_taken_for_a_whole_one() {
    let texts = [square(), with("tristrips", 1, "5 0 1 3 2 -1"), with("trifans", 1, "4 0 1 2 3")];
    let texts = texts.map(|text| text.trim_end().as_bytes().to_vec());
    let files = [binary("little", [("float", 4), ("int", 4)]), binary("big", [("double", 8), ("char", 1)])];
    for whole in texts.into_iter().chain(files) {
        assert!(read_ply(&whole, "a.ply").is_ok(), "{}", String::from_utf8_lossy(&whole));
        for length in 0..whole.len() {
            let error = read_ply(&whole[..length], "a.ply").expect_err("it was cut").to_string();
            assert!(error.starts_with("a.ply:"), "{length}: {error}");
        }
    }
}

/// Asserts that each text is refused with a short message that begins so.
fn told(cases: &[(String, &str)]) {
    for (text, wanted) in cases {
        let found = read_ply(text.as_bytes(), "a.ply").expect_err(wanted).to_string();
        assert!(found.starts_with(wanted) && found.len() < 400, "\nwanted {wanted}\nfound  {found}");
    }
}

#[test]
fn what_is_wrong_with_a_header_is_told_with_its_line_and_what_is_allowed() {
    told(&[
        (square().replace("ply\n", "plx\n"), "a.ply:1: begins with 'plx'; allowed: ply"),
        (square().replace("ascii 1.0", "ascii 2.0"), "a.ply:2: has the version '2.0' of PLY; allowed: 1.0"),
        (square().replace("ascii 1.0", "utf8 1.0"), "a.ply:2: has the format 'utf8'; allowed: ascii, binary"),
        (square().replace("format ascii 1.0\n", ""), "a.ply:9: ends a header without its format; allowed: "),
        (
            square().replace("int vert", "int128 vert"),
            "a.ply:9: has the type 'int128'; allowed: char, uchar,",
        ),
        (
            square().replace("uchar int", "float int"),
            "a.ply:9: counts the numbers of 'vertex_indices' by a type",
        ),
        (
            square().replace("uchar int", "uchar float"),
            "a.ply:9: the property 'vertex_indices' of 'face' names",
        ),
        (
            square().replace("list uchar int", "int"),
            "a.ply:9: the property 'vertex_indices' of 'face' is one",
        ),
        (
            square().replace("float x", "list uchar float x"),
            "a.ply:5: the property 'x' of 'vertex' is a list",
        ),
        (square().replace("face 2", "face -2"), "a.ply:8: announces '-2' elements 'face'; allowed: a whole"),
        (square().replace("face 2", "vertex 2"), "a.ply:8: has the element 'vertex' a second time; allowed"),
        (square().replace("element vertex 4\n", ""), "a.ply:4: has a property before any element; allowed:"),
        (square().replace("comment", "command"), "a.ply:3: says 'command hand made'; allowed in a header: "),
        (square().replace("end_header\n", ""), "a.ply:10: says '0 0 0'; allowed in a header: "),
        (
            with("range_grid", 1, "1 0\n"),
            "a.ply:7: holds a range scan (the element 'range_grid'), which has no triangles: convert",
        ),
    ]);
}

#[test]
fn what_is_wrong_behind_a_header_is_told_with_its_line_and_what_is_allowed() {
    let long = "9".repeat(100_000);
    told(&[
        (square().replace("vertex 4", "vertex 5"), "a.ply:15: vertex 4 goes on with '2'; allowed: "),
        (
            square().replace("vertex 4", "vertex 4000000000"),
            "a.ply:4: announces 4000000000 vertices of 6 bytes or more each, but 40 bytes follow the header (the",
        ),
        (
            square().replace("face 2", "face 26"),
            "a.ply:8: announces 26 faces of 2 bytes or more each, but 40 bytes",
        ),
        (square().replace("face 2", "face 3"), "a.ply:8: announces 3 faces, but the file ends after 2"),
        (
            square().replace("1 1 0\n", "1 1\n"),
            "a.ply:13: vertex 2 ends before its 'z'; allowed: every number",
        ),
        (
            square().replace("1 1 0\n", "1 1 nan\n"),
            "a.ply:13: the 'z' of vertex 2 is 'nan'; allowed: a finite",
        ),
        (square().replace("1 1 0\n", "1 1 x\n"), "a.ply:13: the 'z' of vertex 2 is 'x'; allowed: a finite"),
        (
            square().replace("3 0 2 3", "3 0 2 4"),
            "a.ply:16: face 1 names point 4; allowed: 0 to 3, the points",
        ),
        (square().replace("3 0 2 3", "3 0 2 -1"), "a.ply:16: face 1 names point -1; allowed: 0 to 3, the"),
        (square().replace("3 0 2 3", "3 0 2 1.5"), "a.ply:16: face 1 names point '1.5'; allowed: a whole"),
        (
            square().replace("3 0 2 3", "4 0 2 3"),
            "a.ply:16: face 1 says that 'vertex_indices' has 4 numbers, but 3",
        ),
        (
            square().replace("3 0 2 3", "x 0 2 3"),
            "a.ply:16: face 1 says that 'vertex_indices' has 'x' numbers;",
        ),
        (
            square().replace("3 0 2 3", &format!("{long} 0")),
            "a.ply:16: face 1 says that 'vertex_indices' has '999",
        ),
        (
            with("tristrips", 1, "3 0 1 4\n"),
            "a.ply:14: tristrips 0 names point 4; allowed: 0 to 3, the points of this mesh, and -1",
        ),
    ]);
    let mut bytes = binary("little", [("float", 4), ("int", 4)]);
    // The last corner stands before four bytes of flags.
    let at = bytes.len() - 8;
    bytes[at] = 4;
    let found = read_ply(&bytes, "a.ply").expect_err("there is no point 4").to_string();
    assert_eq!(found, "a.ply: face 1 names point 4; allowed: 0 to 3, the points of this mesh");
}

#[test]
fn what_is_odd_and_ignored_is_told() {
    let warnings = |bytes: &[u8]| read_ply(bytes, "a.ply").expect("it is read").warnings;
    let text = format!("{}7 7 7\n", square());
    assert_eq!(warnings(text.as_bytes()), ["a.ply: 5 bytes after the last element are ignored"]);
    let bytes = [binary("big", [("float", 4), ("int", 4)]), vec![0; 3]].concat();
    assert_eq!(warnings(&bytes), ["a.ply: 3 bytes after the last element are ignored"]);
    let text = square().replace("property float z\n", "property float z\nproperty float z\n");
    let text = text.replace(NUMBERS, "0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n");
    assert_eq!(warnings(text.as_bytes()), ["a.ply:8: 'z' says again what 'z' says, which is kept"]);
    let edges = with("polyline", 1, "2 0 1\n");
    assert_eq!(
        warnings(edges.as_bytes()),
        [
            "a.ply:7: the element 'polyline' is not read, and there is no element 'face': points alone are read"
        ]
    );
}

#[test]
fn elements_without_properties_take_neither_time_nor_memory() {
    let text = square().replace("element face", "element nothing 18446744073709551615\nelement face");
    assert_square(&read_ply(text.as_bytes(), "a.ply").expect("nothing stands for nothing"), HALVES);
    assert!(MeshFile::Ply(text.as_bytes()).memory_bytes() < 16_384);
}

#[test]
fn memory_is_known_before_for_every_type_of_numbers() {
    for order in ["little", "big"] {
        for index in [("char", 1), ("short", 2), ("int", 4), ("uint64", 8)] {
            let bytes = binary(order, [("float", 4), index]);
            let announced = MeshFile::Ply(&bytes).memory_bytes();
            // A mesh of 4 points and 2 triangles, and at most 100 bytes for each of the file.
            assert!(announced >= 4 * 24 + 2 * 12 && announced < 100 * bytes.len() as u64, "{announced}");
        }
    }
}

#[test]
fn errors_of_ply_are_named() {
    let header = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n";
    for (text, wanted) in [
        ("", "a.ply:1: begins with ''; allowed: ply, the first line of a PLY"),
        ("ply\nformat ascii 1.0\nend_header\n", "a.ply:3: has no element 'vertex'"),
        (
            &format!("{header}end_header\n0 0\n"),
            "a.ply:3: the element 'vertex' has no property 'z'; allowed: x, y and z",
        ),
        (
            &format!("{header}property float z\nend_header\n0 0 nan\n"),
            "a.ply:8: the 'z' of vertex 0 is 'nan'; allowed: a finite number",
        ),
        (
            &format!(
                "{header}property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n3 0 0 -1\n"
            ),
            "a.ply:11: face 0 names point -1; allowed: 0 to 0, the points of this mesh",
        ),
        (
            "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n1 0\n",
            "a.ply:10: face 0 names point 0; allowed: none, there are no points",
        ),
        (
            &format!("{header}property float z\nend_header\n0 0"),
            "a.ply:8: vertex 0 ends before its 'z'; allowed: every number of the header",
        ),
        (
            &format!(
                "{header}property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n3 0 0"
            ),
            "a.ply:11: face 0 says that 'vertex_indices' has 3 numbers, but 2 follow",
        ),
        (
            &format!("{header}property float z\nelement face 1\nproperty uchar q\nend_header\n0 0 0\n3\n"),
            "a.ply:7: the element 'face' has no list of points",
        ),
        (
            &header
                .replace("ascii", "binary_little_endian")
                .replace("vertex 1\n", "vertex 4000000000\nproperty float z\n"),
            "a.ply:6: ends within its header; allowed: a line end_header",
        ),
        ("ply\nformat ascii 1.0\ncom", "a.ply:3: ends within its header; allowed: a line end_header"),
    ] {
        let found = read_ply(text.as_bytes(), "a.ply").unwrap_err().to_string();
        assert!(found.starts_with(wanted), "\nwanted {wanted}\nfound  {found}");
    }
}

#[test]
fn a_message_of_a_long_line_is_short() {
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n{}\n",
        "x".repeat(100_000)
    );
    let message = read_ply(text.as_bytes(), "a.ply").unwrap_err().to_string();
    assert!(message.len() < 200 && message.contains("...'; allowed: a finite number"), "{message}");
}
