//! Mesh files that were damaged, by every reader: each is refused or read within memory that is known beforehand.

use std::{fmt::Write as _, time::Instant};

use fastrand::Rng;
use nappe_scene::mesh::{EtiOptions, MeshFile, write_eti, write_obj, write_off, write_ply};
use nappe_sim::mesh::TriangleMesh;

use crate::{
    COUNT, PATIENCE, SEEDS, alone,
    meshes::{mesh, tally},
    mutations::damage,
    own_peak,
};

/// Memory (bytes) that no file of these sizes announces: claims are bounded by what a file can hold.
const READ_BUDGET: u64 = 4 << 20;
/// Memory (bytes) beside that of the mesh: messages, names.
const SLACK: u64 = 64 << 10;

/// A format of mesh files.
struct Reader {
    /// Writes a mesh in the format, as one file or several.
    write: fn(&TriangleMesh) -> Vec<Vec<u8>>,
    /// The files as they are read.
    file: fn(&[Vec<u8>]) -> MeshFile<'_>,
}

/// Every format that is read: a new one takes a line here.
const READERS: [Reader; 8] = [
    Reader { write: |mesh| one(|out| write_obj(mesh, out)), file: |files| MeshFile::Obj(&files[0]) },
    Reader { write: |mesh| one(|out| write_off(mesh, out)), file: |files| MeshFile::Off(&files[0]) },
    Reader { write: |mesh| one(|out| write_ply(mesh, out)), file: |files| MeshFile::Ply(&files[0]) },
    Reader { write: ply_in_text, file: |files| MeshFile::Ply(&files[0]) },
    Reader { write: big_endian_ply, file: |files| MeshFile::Ply(&files[0]) },
    Reader { write: stl_in_text, file: |files| MeshFile::Stl(&files[0]) },
    Reader { write: binary_stl, file: |files| MeshFile::Stl(&files[0]) },
    Reader { write: set, file: eti },
];

/// One file, as a writer makes it.
fn one(write: impl FnOnce(&mut Vec<u8>) -> std::io::Result<()>) -> Vec<Vec<u8>> {
    let mut bytes = Vec::new();
    write(&mut bytes).expect("memory takes it");
    vec![bytes]
}

/// The head of a PLY of points and faces.
fn ply_head(mesh: &TriangleMesh, format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment made\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.points.len(),
        mesh.triangles.len()
    )
}

fn ply_in_text(mesh: &TriangleMesh) -> Vec<Vec<u8>> {
    let mut text = ply_head(mesh, "ascii");
    for [x, y, z] in &mesh.points {
        writeln!(text, "{x} {y} {z}").expect("a string takes it");
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(text, "3 {a} {b} {c}").expect("a string takes it");
    }
    vec![text.into_bytes()]
}

fn big_endian_ply(mesh: &TriangleMesh) -> Vec<Vec<u8>> {
    let mut bytes = ply_head(mesh, "binary_big_endian").into_bytes();
    bytes.extend(mesh.points.as_flattened().iter().flat_map(|c| (*c as f32).to_be_bytes()));
    for corners in &mesh.triangles {
        bytes.push(3);
        bytes.extend(corners.iter().flat_map(|corner| corner.to_be_bytes()));
    }
    vec![bytes]
}

/// The triangles of a mesh by the places of their corners (m), but for those that name a point that is not there.
fn facets(mesh: &TriangleMesh) -> impl Iterator<Item = [[f64; 3]; 3]> {
    let place = |corner: u32| mesh.points.get(corner as usize).copied();
    mesh.triangles.iter().filter_map(move |&[a, b, c]| Some([place(a)?, place(b)?, place(c)?]))
}

fn stl_in_text(mesh: &TriangleMesh) -> Vec<Vec<u8>> {
    let facet = |corners: [[f64; 3]; 3]| {
        let corner = |[x, y, z]: [f64; 3]| format!("vertex {x} {y} {z}\n");
        format!("facet\nouter\n{}endloop\nendfacet\n", corners.map(corner).concat())
    };
    vec![format!("solid\n{}endsolid\n", facets(mesh).map(facet).collect::<String>()).into_bytes()]
}

fn binary_stl(mesh: &TriangleMesh) -> Vec<Vec<u8>> {
    let mut bytes = [[0; 80].as_slice(), &(facets(mesh).count() as u32).to_le_bytes()].concat();
    for corners in facets(mesh) {
        bytes.extend([0; 12]);
        bytes.extend(corners.as_flattened().iter().flat_map(|x| (*x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    vec![bytes]
}

/// A set of the course. What a mesh lacks is a file that is empty.
fn set(mesh: &TriangleMesh) -> Vec<Vec<u8>> {
    let set = write_eti(mesh);
    let texts = [Some(set.points), Some(set.faceset), set.masses, set.texcoord];
    texts.into_iter().map(|text| text.unwrap_or_default().into_bytes()).collect()
}

fn eti(files: &[Vec<u8>]) -> MeshFile<'_> {
    let other = |place: usize| files.get(place).map(Vec::as_slice).filter(|bytes| !bytes.is_empty());
    MeshFile::Eti {
        points: &files[0],
        others: [other(1), other(2), other(3)],
        options: EtiOptions::default(),
    }
}

/// What became of the files of one reader: refused, read.
type Ends = [u64; 2];

/// Damages files of a seed, of each format as many, and reads them.
fn files_of(seed: u64) -> [u64; 2 * READERS.len()] {
    let (mut random, mut ends) = (Rng::with_seed(seed), [0; 2 * READERS.len()]);
    for number in 0..COUNT / SEEDS {
        let place = number as usize % READERS.len();
        let mut files = (READERS[place].write)(&mesh(&mut random));
        // Of a set mostly one file, so that all of them are read.
        let (chosen, is_all) = (random.usize(0..files.len()), random.u8(0..8) == 0);
        for (file, bytes) in files.iter_mut().enumerate() {
            if file == chosen || is_all {
                damage(&mut random, bytes);
            }
        }
        ends[2 * place + end_of(&(READERS[place].file)(&files))] += 1;
    }
    ends
}

/// What becomes of a file, by its place among the ends.
fn end_of(file: &MeshFile<'_>) -> usize {
    let announced = file.memory_bytes();
    assert!(announced <= READ_BUDGET, "{announced} bytes announced: {file:?}");
    let start = Instant::now();
    let (took, read) = own_peak(|| file.read("hostile").is_ok());
    let seconds = start.elapsed().as_secs_f64();
    assert!(took as u64 <= announced + SLACK, "{took} bytes, {announced} announced: {file:?}");
    assert!(seconds < PATIENCE, "{seconds} s for {file:?}");
    usize::from(read)
}

/// A sheet of 100 000 points whose coordinates have many digits.
fn large_sheet() -> TriangleMesh {
    TriangleMesh::grid(400, 250, 0.1 / 3.0)
}

/// Bytes of the arrays of a mesh.
fn array_bytes(mesh: &TriangleMesh) -> f64 {
    let TriangleMesh { points, triangles, masses, uv, velocities, springs } = mesh;
    let of_points = 24 * (points.len() + velocities.len()) + 8 * masses.len() + 16 * uv.len();
    (of_points + 12 * triangles.len() + size_of_val(springs.as_slice())) as f64
}

#[test]
fn a_large_mesh_takes_what_is_claimed_for_it_and_little_beside_its_arrays() {
    let _alone = alone();
    let sheet = large_sheet();
    // Those of OBJ, OFF, and PLY, binary and text.
    for Reader { write, file } in &READERS[..4] {
        let files = write(&sheet);
        let (file, size) = (file(&files), files[0].len() as f64);
        let claimed = file.memory_bytes();
        let (took, loaded) = own_peak(|| file.read("sheet").expect("it was just written"));
        let arrays = array_bytes(&loaded.mesh);
        println!("{size} bytes, arrays of {arrays}, {claimed} claimed, {took} taken");
        assert_eq!((loaded.mesh.points.len(), &loaded.mesh.triangles), (100_000, &sheet.triangles));
        assert!(took as u64 <= claimed, "{took} bytes, {claimed} claimed");
        assert!(
            claimed as f64 <= 1.3 * size + arrays,
            "{claimed} claimed, {arrays} of arrays, {size} of the file"
        );
    }
}

#[test]
fn an_stl_takes_what_is_claimed_for_it_which_is_at_most_twice_its_own_bytes() {
    let _alone = alone();
    let sheet = large_sheet();
    // Each facet apart from the others has three points of its own; some have none.
    let mut apart = TriangleMesh::default();
    for corners in &sheet.triangles[..50_000] {
        let first = apart.points.len() as u32;
        let lift = f64::from(first);
        apart.points.extend(corners.map(|i| sheet.points[i as usize]).map(|[x, _, z]| [x, lift, z]));
        apart.triangles.extend([[first, first + 1, first + 2], [first, first, first + 1]]);
    }
    for (mesh, points, triangles) in [(&sheet, 100_000, sheet.triangles.len()), (&apart, 150_000, 50_000)] {
        for Reader { write, file } in &READERS[5..7] {
            let files = write(mesh);
            let (file, size) = (file(&files), files[0].len() as u64);
            let claimed = file.memory_bytes();
            let (took, loaded) = own_peak(|| file.read("facets").expect("it was just written"));
            println!("{size} bytes, {claimed} claimed, {took} taken");
            assert_eq!((loaded.mesh.points.len(), loaded.mesh.triangles.len()), (points, triangles));
            assert_eq!(loaded.mesh.points.capacity(), points, "what is kept is what counts");
            assert!(took as u64 <= claimed, "{took} bytes, {claimed} claimed");
            assert!(claimed <= 2 * size, "{claimed} claimed, {size} of the file");
        }
    }
}

#[test]
fn elements_that_a_file_cannot_hold_are_refused_before_memory_is_taken_for_them() {
    let _alone = alone();
    for file in [
        MeshFile::Off(b"OFF\n4000000000 1 0\n0 0 0\n"),
        MeshFile::Off(b"OFF\n1 4000000000 0\n0 0 0\n"),
        MeshFile::Ply(
            b"ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n\
                        property float z\nend_header\n0 0 0\n",
        ),
    ] {
        let (took, read) = own_peak(|| file.read("hostile").expect_err("one line follows").to_string());
        assert!(took as u64 <= SLACK && file.memory_bytes() <= SLACK, "{took} bytes: {file:?}");
        assert!(read.contains("4000000000"), "{read}");
    }
}

#[test]
fn no_damaged_mesh_file_takes_more_memory_than_is_known_before() {
    let _alone = alone();
    let ends = tally(files_of);
    let (by_reader, _) = ends.as_chunks::<2>();
    println!("files that are refused, are read, by reader: {by_reader:?}");
    let each = COUNT / READERS.len() as u64;
    for [refused, read] in by_reader as &[Ends] {
        assert!(*refused > each / 20 && *read > each / 20, "both ends are met by every reader");
    }
}
