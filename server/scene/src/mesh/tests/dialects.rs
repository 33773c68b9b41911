//! One square in every dialect of OBJ and OFF, with every end of line and with a byte order mark.

use nappe_sim::mesh::TriangleMesh;

use crate::mesh::MeshFile;

type File = fn(&[u8]) -> MeshFile<'_>;

fn obj(bytes: &[u8]) -> MeshFile<'_> {
    MeshFile::Obj(bytes)
}

fn off(bytes: &[u8]) -> MeshFile<'_> {
    MeshFile::Off(bytes)
}

/// A file with other ends of lines, and with a mark or without.
fn written(file: &[u8], end: &str, mark: &[u8]) -> Vec<u8> {
    let mut bytes = mark.to_vec();
    for byte in file {
        match byte {
            b'\n' => bytes.extend(end.bytes()),
            other => bytes.push(*other),
        }
    }
    bytes
}

const ENDS: [&str; 3] = ["\n", "\r\n", "\r"];
const MARKS: [&[u8]; 2] = [b"", b"\xef\xbb\xbf"];

/// Asserts that a file holds a mesh, without a warning, whatever ends its lines and stands before it.
fn assert_holds(kind: File, file: &[u8], mesh: &TriangleMesh) {
    for end in ENDS {
        for mark in MARKS {
            let bytes = written(file, end, mark);
            let loaded = kind(&bytes).read("square").expect("it is a mesh");
            let text = String::from_utf8_lossy(&bytes);
            assert_eq!(&loaded.mesh, mesh, "{text:?}");
            assert!(loaded.warnings.is_empty(), "{:?} {text:?}", loaded.warnings);
        }
    }
}

fn square() -> TriangleMesh {
    TriangleMesh {
        points: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..TriangleMesh::default()
    }
}

const UV: [[f64; 2]; 4] = [[0.0, 0.0], [0.5, 0.0], [0.5, 0.25], [0.0, 0.25]];

#[test]
fn every_dialect_of_obj_gives_the_same_square() {
    let files: [&[u8]; 10] = [
        b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n",
        b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4",
        b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 \\\n  3 4\n",
        b"v 0 0 0\nv 1 \\\n0\\\n0\nv 1 1 0\nv 0 1 0\n\\\nf \\\n 1 2\\\n3 4 \\\n\n\n",
        b"# C:\\meshes\\\nv 0 0 0\nv 1 0 0\nv 1 1 0 # \\\nv 0 1 0\nf 1 2 3 4\n",
        b"v 0 0 0 1\nv 1 0 0 1.0\nv 1 1 0 0.5\nv 0 1 0 2\nf 1 2 3 4\n",
        b"v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nf 1 2 3 4\n",
        b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1 4//1\n",
        b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4 -3 -2 -1\n",
        b"mtllib the\xe9.mtl\n\no square\ng a b\ns off\nusemtl x\nv\t0 0 0\nv  1 0 0\nv 1e0 +1 -0.0\nv 0 1 0\nf 1 2 3 4\n",
    ];
    for file in files {
        assert_holds(obj, file, &square());
    }

    let uv = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0\nvt 0.5 0\nvt 0.5 0.25 0\nvt 0 0.25\nf 1/1 2/2 3/3/7 4/-1\n";
    assert_holds(obj, uv, &TriangleMesh { uv: UV.to_vec(), ..square() });
}

#[test]
fn every_dialect_of_off_gives_the_same_square() {
    let files: [&[u8]; 11] = [
        b"OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n",
        b"OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3",
        b"OFF 4 1 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 0.5 0.5 0.5 1\n",
        b"OFF4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n",
        b"4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n",
        b"COFF\n4 2 0\n0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n1 1 0 255 0 0 255\n0 1 0 255 0 0 255\n3 0 1 2\n3 0 2 3\n",
        b"COFF 4 1 0\n0 0 0 1 0 0\n1 0 0 1 0 0\n1 1 0 1 0 0\n0 1 0 1 0 0\n4 0 1 2 3\n",
        b"NOFF\n4 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n0 1 0 0 0 1\n4 0 1 2 3\n",
        b"CNOFF4 1 0\n0 0 0 0 0 1 9 9 9\n1 0 0 0 0 1 9 9 9\n1 1 0 0 0 1 9 9 9\n0 1 0 0 0 1 9 9 9\n4 0 1 2 3\n",
        b"NCOFF\n4 1 0\n0 0 0 9 9 9 9\n1 0 0 9 9 9 9\n1 1 0 9 9 9 9\n0 1 0 9 9 9 9\n4 0 1 2 3\n",
        b"# one\nOFF # two\n\n4 1 0\n 0 0 0\n\t1 0 0\n1 1 0 # three\n0 1 0\n# four\n4 0 1 2 3 # red\n",
    ];
    for file in files {
        assert_holds(off, file, &square());
    }
    let textured: [&[u8]; 4] = [
        b"STOFF\n4 1 0\n0 0 0 0 0\n1 0 0 0.5 0\n1 1 0 0.5 0.25\n0 1 0 0 0.25\n4 0 1 2 3\n",
        b"STNOFF 4 1 0\n0 0 0 0 0 1 0 0\n1 0 0 0 0 1 0.5 0\n1 1 0 0 0 1 0.5 0.25\n0 1 0 0 0 1 0 0.25\n4 0 1 2 3\n",
        b"STCOFF\n4 1 0\n0 0 0 9 9 9 9 0 0\n1 0 0 9 9 9 9 0.5 0\n1 1 0 9 9 9 0.5 0.25\n0 1 0 9 9 9 9 0 0.25\n4 0 1 2 3\n",
        b"NCSTOFF\n4 1 0\n0 0 0 0 0 1 9 9 9 0 0\n1 0 0 0 0 1 9 9 9 0.5 0\n1 1 0 0 0 1 9 9 9 0.5 0.25\n0 1 0 0 0 1 9 9 9 0 0.25\n4 0 1 2 3\n",
    ];
    for file in textured {
        assert_holds(off, file, &TriangleMesh { uv: UV.to_vec(), ..square() });
    }
}

#[test]
fn an_error_names_its_line_whatever_ends_lines() {
    let cases: [(File, &[u8], usize); 5] = [
        (obj, b"# a\n\nv 0 0 0\nv 0 0\n", 4),
        (obj, b"v 0 0 0\nf 1 \\\n1 \\\n9\nv 0 0 0\n", 2),
        (obj, b"v 0 0 0\nf 1 1 1 \\\n\nv 0 0\n", 4),
        (off, b"OFF\n\n1 0 0\n0 0 x\n", 4),
        (off, b"OFF\n1 1 0\n0 0 0\n\n3 0 0\n", 5),
    ];
    for (kind, file, line) in cases {
        for end in ENDS {
            for mark in MARKS {
                let bytes = written(file, end, mark);
                let error = kind(&bytes).read("a").expect_err("it is no mesh");
                assert_eq!(error.line, line, "{error} in {:?}", String::from_utf8_lossy(&bytes));
            }
        }
    }
}

#[test]
fn the_memory_of_every_end_of_line_and_of_joined_lines_is_known_before() {
    let corners = "1 ".repeat(1000);
    let plain = format!("v 0 0 0\nf {corners}\n");
    let joined = format!("v 0 0 0\nf \\\n{}\n", corners.replace("1 ", "1 \\\n"));
    for end in ENDS {
        for file in [&plain, &joined] {
            let bytes = written(file.as_bytes(), end, b"");
            let announced = MeshFile::Obj(&bytes).memory_bytes();
            assert!((3 * 12 * 1000..3 * 240 * 1000).contains(&announced), "{announced} for {end:?}");
        }
    }
}
