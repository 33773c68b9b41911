//! STL files, files that gzip has packed, pointers in place of files, and endings that are not read.

use std::{collections::BTreeSet, env, fmt::Write as _, fs, io::Write as _, path::PathBuf, process};

use flate2::{Compression, write::GzEncoder};
use nappe_scene::{
    ErrorKind,
    files::{Existing, ReadOptions, load_mesh, save_mesh},
    mesh::{Loaded, MeshFile, read_stl, write_obj, write_off, write_ply},
};
use nappe_sim::mesh::TriangleMesh;

/// A cube of 2 m about the origin as facets: two for each side, seen from outside against the clock.
fn cube() -> Vec<[[f64; 3]; 3]> {
    let mut facets = Vec::new();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let corner = |u: f64, v: f64| {
                let mut point = [0.0; 3];
                point[axis] = sign;
                point[(axis + 1) % 3] = u;
                point[(axis + 2) % 3] = v * sign;
                point
            };
            let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            facets.extend([[a, b, c], [a, c, d]]);
        }
    }
    facets
}

fn text(facets: &[[[f64; 3]; 3]]) -> String {
    let mut text = "solid cube\n".to_owned();
    for corners in facets {
        text += "  facet normal 0 0 0\n    outer loop\n";
        for [x, y, z] in corners {
            writeln!(text, "      vertex {x:e} {y} {z:+.1}").expect("memory takes it");
        }
        text += "    endloop\n  endfacet\n";
    }
    text + "endsolid"
}

fn binary(head: &[u8], facets: &[[[f64; 3]; 3]]) -> Vec<u8> {
    let mut bytes = head.to_vec();
    bytes.resize(80, b' ');
    bytes.extend((facets.len() as u32).to_le_bytes());
    for corners in facets {
        bytes.extend([0; 12]);
        bytes.extend(corners.as_flattened().iter().flat_map(|x| (*x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// Six times the volume (m³) that a mesh encloses, after each edge was found once in each direction.
#[track_caller]
fn volume_of_closed(mesh: &TriangleMesh) -> f64 {
    let mut edges = BTreeSet::new();
    for [a, b, c] in &mesh.triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            assert!(edges.insert(edge), "{edge:?} twice");
        }
    }
    assert!(edges.iter().all(|(a, b)| edges.contains(&(*b, *a))), "an edge is open");
    let of_triangle = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| mesh.points[i as usize]);
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]
    };
    mesh.triangles.iter().map(of_triangle).sum()
}

#[test]
fn a_closed_solid_of_facets_is_a_closed_mesh() {
    let facets = cube();
    let texts = [text(&facets), text(&facets).replace('\n', "\r\n"), text(&facets).to_uppercase()];
    let marked = format!("\u{feff}\n{}", text(&facets));
    let named = [text(&facets).replace("solid cube", "solid"), marked];
    let parted = ["end ", "END_", "end-"].map(|end| text(&facets).replace("end", end));
    let files = [binary(b"made by hand", &facets), binary(b"solid cube", &facets)];
    let all = texts.into_iter().chain(named).chain(parted).map(String::into_bytes).chain(files);
    for bytes in all {
        let Loaded { mesh, warnings } = read_stl(&bytes, "a.stl").expect("a cube");
        assert_eq!((mesh.points.len(), mesh.triangles.len(), warnings.len()), (8, 12, 0));
        assert_eq!(volume_of_closed(&mesh), 6.0 * 8.0);
        // Points stand in the order in which they appear.
        assert_eq!((mesh.points[0], mesh.triangles[0]), (facets[0][0], [0, 1, 2]));
        let announced = MeshFile::Stl(&bytes).memory_bytes();
        assert!(announced >= 8 * 24 + 12 * 12 && announced < 20 * bytes.len() as u64, "{announced}");
    }
}

#[test]
fn both_zeros_are_one_place_and_facets_without_three_points_are_left_out() {
    let facets = [
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [[-0.0; 3], [0.0, 1.0, -0.0], [0.0, 0.0, 1.0]],
        [[-0.0, 0.0, 0.0], [0.0; 3], [7.0; 3]],
    ];
    let several = format!("{}\n{}\n", text(&facets[..1]), text(&facets[1..]));
    for bytes in [binary(b"", &facets), text(&facets).into_bytes(), several.into_bytes()] {
        let loaded = read_stl(&bytes, "a.stl").expect("two triangles");
        assert_eq!(loaded.mesh.points.len(), 4, "nothing stands at 7 7 7");
        assert_eq!(loaded.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(loaded.warnings, ["a.stl: 1 facets have two corners in one place: they are left out"]);
    }
    let error = read_stl(&binary(b"", &facets[2..]), "a.stl").expect_err("nothing is left").to_string();
    assert!(error.starts_with("a.stl: holds no triangles (1 facets have two"), "{error}");
}

#[test]
fn an_stl_that_was_cut_is_refused() {
    let facets = &cube()[..2];
    let text = text(facets);
    for whole in [text.as_bytes(), &binary(b"", facets), &binary(b"solid\0", facets)] {
        assert!(read_stl(whole, "a.stl").is_ok());
        for length in 0..whole.len() {
            let error = read_stl(&whole[..length], "a.stl").expect_err("it was cut").to_string();
            assert!(error.starts_with("a.stl:") && error.len() < 300, "{length}: {error}");
        }
    }
}

#[test]
fn what_is_wrong_with_an_stl_is_told_with_its_place() {
    let facets = &cube()[..2];
    let text = text(facets);
    for (text, wanted) in [
        (
            text.replace("outer loop", "inner loop"),
            "a.stl:3: says 'inner loop'; allowed here: a line 'outer'",
        ),
        (
            text.replace("endloop", "vertex 0 0 0"),
            "a.stl:7: says 'vertex 0 0 0'; allowed here: a line 'endloop'",
        ),
        (text.replace("endloop", "end facet"), "a.stl:7: says 'end facet'; allowed here: a line 'endloop'"),
        (text.replace("-1e0", "nan"), "a.stl:4: a vertex is 'nan'; allowed: a finite number"),
        (text.replace("endsolid", ""), "a.stl: ends before a line 'endsolid': the file may be cut"),
        ("solid\nendsolid\n".to_owned(), "a.stl: holds no triangles"),
        ("nothing".to_owned(), "a.stl: has 7 bytes; allowed: a text that begins with 'solid', or 84 bytes"),
    ] {
        let found = read_stl(text.as_bytes(), "a.stl").expect_err(wanted).to_string();
        assert!(found.starts_with(wanted), "\nwanted {wanted}\nfound  {found}");
    }
    let mut bytes = binary(b"", facets);
    bytes.extend([1, 2, 3]);
    let loaded = read_stl(&bytes, "a.stl").expect("all facets are there");
    assert_eq!(loaded.warnings, ["a.stl: 3 bytes after the last facet are ignored"]);
    bytes[80] = 3;
    let error = read_stl(&bytes, "a.stl").expect_err("a facet is missing").to_string();
    assert!(error.starts_with("a.stl: announces 3 facets of 50 bytes, but the file ends after 2"), "{error}");
    bytes[80] = 2;
    let at = 84 + 50 + 12;
    bytes[at..at + 4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    let error = read_stl(&bytes, "a.stl").expect_err("an infinite corner").to_string();
    assert!(error.starts_with("a.stl: facet 1 (from 0) has a corner at inf "), "{error}");
}

/// A folder of this process that goes away.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = env::temp_dir().join(format!("nappe-{name}-{}", process::id()));
        fs::create_dir_all(&folder).expect("made");
        Self(folder)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, bytes).expect("written");
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        drop(fs::remove_dir_all(&self.0));
    }
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).expect("memory takes it");
    encoder.finish().expect("memory takes it")
}

#[test]
fn a_file_of_every_format_is_read_as_gzip_has_packed_it() {
    let folder = Folder::new("packed-meshes");
    let mesh = TriangleMesh::grid(4, 3, 0.5);
    let [mut obj, mut off, mut ply] = [const { Vec::new() }; 3];
    write_obj(&mesh, &mut obj).expect("memory takes it");
    write_off(&mesh, &mut off).expect("memory takes it");
    write_ply(&mesh, &mut ply).expect("memory takes it");
    let options = ReadOptions::default();
    for (ending, bytes) in [("obj", obj), ("off", off), ("ply", ply), ("stl", binary(b"", &cube()))] {
        let plain = load_mesh(&folder.write(&format!("a.{ending}"), &bytes), &options).expect(ending).mesh;
        let whole = packed(&bytes);
        for name in [format!("b.{ending}.gz"), format!("c.{ending}"), format!("d.{}", ending.to_uppercase())]
        {
            let read = load_mesh(&folder.write(&name, &whole), &options).expect(&name);
            assert_eq!(read.mesh, plain, "{name}");
        }
        for length in 0..whole.len() {
            let path = folder.write(&format!("cut.{ending}.gz"), &whole[..length]);
            assert!(load_mesh(&path, &options).is_err(), "{ending} cut after {length} bytes");
        }

        // What is larger than the limit is refused, packed or not.
        let limit = ReadOptions { max_bytes: bytes.len() as u64 - 1, ..options };
        for name in [format!("a.{ending}"), format!("b.{ending}.gz")] {
            let error = load_mesh(&folder.0.join(&name), &limit).expect_err(&name);
            assert_eq!(error.kind, ErrorKind::TooLarge, "{error}");
        }
        // A reader of bytes, such as a server's, unpacks nothing.
        for file in
            [MeshFile::Obj(&whole), MeshFile::Off(&whole), MeshFile::Ply(&whole), MeshFile::Stl(&whole)]
        {
            let error = file.read("upload").expect_err("packed").to_string();
            assert!(error.contains("is packed by gzip") && error.contains("gunzip"), "{error}");
        }
    }
}

#[test]
fn a_pointer_of_a_large_file_store_is_refused_in_every_format() {
    let folder = Folder::new("pointers-to-meshes");
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a214614ab2935\nsize 12345\n";
    let annex = "/annex/objects/SHA256E-s12345--4d7a214614ab2935\n";
    for (pointer, store, command) in
        [(pointer, "(Git LFS)", "`git lfs pull`"), (annex, "(git-annex)", "`git annex get`")]
    {
        for ending in ["obj", "off", "ply", "stl", "stl.gz"] {
            let path = folder.write(&format!("a.{ending}"), pointer.as_bytes());
            let error = load_mesh(&path, &ReadOptions::default()).expect_err(ending);
            let told = error.to_string();
            assert_eq!(error.kind, ErrorKind::Unsupported, "{told}");
            assert!(told.contains(&format!("is a pointer of a large-file store {store}")), "{told}");
            assert!(told.contains(command), "{told}");
        }
    }
    // Of a set each file may be one, also where a server reads it.
    folder.write("points.eti", b"1\n0 0 0\n");
    folder.write("faceset.eti", pointer.as_bytes());
    let error = load_mesh(&folder.0, &ReadOptions::default()).expect_err("a part is missing").to_string();
    assert!(error.contains("faceset.eti: is a pointer of a large-file store"), "{error}");
    let set =
        MeshFile::Eti { points: pointer.as_bytes(), others: [None; 3], options: ReadOptions::default().eti };
    let error = set.read("cow").expect_err("a pointer").to_string();
    assert!(error.starts_with("cow/points.eti: is a pointer of a large-file store"), "{error}");
}

#[test]
fn an_ending_that_is_not_read_or_written_is_named_with_those_that_are() {
    let folder = Folder::new("endings-of-meshes");
    let options = ReadOptions::default();
    for (name, wanted) in [
        ("a.glb", "has the extension 'glb', and nappe reads no glTF: export the mesh as .obj or .ply"),
        ("a.GLTF", "has the extension 'gltf', and nappe reads no glTF: export"),
        ("a.fbx", "nappe reads no FBX"),
        ("a.xyz", "has the extension 'xyz'; allowed: .obj, .off, .ply, .stl, each of them also as .gz"),
        ("points.eti.gz", "has the extension 'eti.gz'; allowed: "),
    ] {
        let error = load_mesh(&folder.write(name, b"x"), &options).expect_err(name);
        assert!(error.kind == ErrorKind::Unsupported && error.to_string().contains(wanted), "{error}");
    }
    for name in ["b.stl", "b.obj.gz", "b.glb"] {
        let error =
            save_mesh(&folder.0.join(name), &TriangleMesh::grid(2, 2, 1.0), Existing::Kept).expect_err(name);
        assert!(error.to_string().contains("allowed: .obj, .off, .ply, points.eti"), "{error}");
        assert!(!folder.0.join(name).exists(), "{name}");
    }
}
