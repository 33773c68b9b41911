//! Meshes and mesh files without sense: each is refused or used within memory that is known beforehand.

use std::{sync::Arc, thread, time::Instant};

use fastrand::Rng;
use nappe_scene::{
    MeshSource, Scene, SceneError,
    mesh::{EtiOptions, MeshFile, write_eti, write_obj, write_off, write_ply},
};
use nappe_sim::mesh::TriangleMesh;
use nappe_tests::threads::with_threads;

use crate::{BUDGET, COUNT, LIMITS, PATIENCE, SEEDS, alone, own_peak, scenes::coordinate};

/// Memory (bytes) that a file may announce to take and still be read.
const READ_BUDGET: u64 = 4 << 20;
/// Memory (bytes) beside that of the mesh: messages, names.
const SLACK: u64 = 64 << 10;

/// One mesh under every id.
struct One(Arc<TriangleMesh>);

impl MeshSource for One {
    fn upload(&self, _: &str) -> Option<Arc<TriangleMesh>> {
        Some(Arc::clone(&self.0))
    }

    fn file(&self, _: &str) -> Result<TriangleMesh, SceneError> {
        unreachable!("these scenes name no file")
    }
}

fn mesh(random: &mut Rng) -> TriangleMesh {
    let count = random.usize(1..80);
    let mut points: Vec<[f64; 3]> = (0..count).map(|_| [0; 3].map(|_| coordinate(random))).collect();
    if random.u8(0..30) == 0 {
        points[random.usize(0..count)][random.usize(0..3)] = [f64::NAN, f64::INFINITY][random.usize(0..2)];
    }

    let last = count as u32;
    let kind = random.u8(0..5);
    let triangle = |random: &mut Rng| match kind {
        0 => [0, random.u32(0..last), random.u32(0..last)],
        1 => [random.u32(0..last); 3],
        2 => [0, 1.min(last - 1), 2.min(last - 1)],
        _ => [0; 3].map(|_| random.u32(0..last)),
    };
    let mut triangles: Vec<[u32; 3]> = (0..random.usize(0..300)).map(|_| triangle(random)).collect();
    if kind == 4 && random.bool() {
        triangles = TriangleMesh::grid(count.min(9), 5, 0.1).triangles;
    }
    let each = |random: &mut Rng, value: f64| if random.bool() { vec![value; count] } else { Vec::new() };
    let mass = [0.0, 0.1, -1.0][random.usize(0..3)];
    let masses = each(random, mass);
    let uv = each(random, 0.5).into_iter().map(|u| [u, if random.u8(0..250) == 0 { f64::NAN } else { u }]);
    TriangleMesh { points, triangles, masses, uv: uv.collect() }
}

/// A scene of cloth, or of snow, from an uploaded mesh.
fn scene_of(random: &mut Rng) -> String {
    let law = "{ stiffness = 100.0, damping = 0.1 }";
    if random.bool() {
        return format!(
            "version = 1\ndt = 1e-3\n[[body]]\nname = \"b\"\nmesh = {{ upload = \"m\" }}\n\
             mass = {{ particle = 0.1 }}\nsprings = {{ stretch = {law}, shear = {law}, bend = {law} }}\n"
        );
    }
    format!(
        "version = 1\ndt = 1e-3\n[snow]\ncell = 0.1\n[[snow.object]]\nname = \"s\"\nmesh = {{ upload = \"m\" }}\n\
         particles = {}\nsampling = \"{}\"\n",
        random.u32(1..200),
        ["jittered", "poisson"][random.usize(0..2)]
    )
}

/// How many meshes of a seed were refused, and how many built.
fn meshes_of(seed: u64) -> [u64; 2] {
    let (mut random, mut ends) = (Rng::with_seed(seed), [0; 2]);
    for _ in 0..COUNT / SEEDS {
        let (mesh, text) = (mesh(&mut random), scene_of(&mut random));
        let start = Instant::now();
        let (took, built) = own_peak(|| {
            let scene = Scene::parse(&text, "hostile").expect("a scene");
            mesh.check().is_ok() && scene.build(&One(Arc::new(mesh.clone())), &LIMITS).is_ok()
        });
        ends[usize::from(built)] += 1;
        let seconds = start.elapsed().as_secs_f64();
        assert!(took <= BUDGET && seconds < PATIENCE, "{took} bytes, {seconds} s: {text}\n{mesh:?}");
    }
    ends
}

/// The bytes of a mesh file, spoiled here and there.
fn spoiled(random: &mut Rng, mut bytes: Vec<u8>) -> Vec<u8> {
    const WORDS: [&str; 8] = [
        "999999999999",
        "-1",
        "nan",
        "\n",
        "element vertex 4000000000\n",
        "property list uchar int v\n",
        "f 1 1 1 1 1 1 1\n",
        "\u{fffd}",
    ];
    for _ in 0..random.usize(0..4) {
        let at = random.usize(0..=bytes.len());
        match random.u8(0..5) {
            0 => bytes.truncate(at),
            1 => drop(bytes.splice(at..at, WORDS[random.usize(0..8)].bytes())),
            2 => {
                let end = (at + random.usize(0..200)).min(bytes.len());
                let twice = bytes[at..end].to_vec();
                drop(bytes.splice(
                    at..at,
                    twice.into_iter().cycle().take(random.usize(0..2000).min(50 * (end - at))),
                ));
            }
            _ if at < bytes.len() => bytes[at] = random.u8(..),
            _ => {}
        }
    }
    bytes
}

/// How many files of a seed were not tried, refused, read.
fn files_of(seed: u64) -> [u64; 3] {
    let (mut random, mut ends) = (Rng::with_seed(seed), [0; 3]);
    for _ in 0..COUNT / SEEDS {
        let (mesh, mut bytes) = (mesh(&mut random), Vec::new());
        let kind = random.u8(0..4);
        let written = match kind {
            0 => write_obj(&mesh, &mut bytes),
            1 => write_off(&mesh, &mut bytes),
            2 => write_ply(&mesh, &mut bytes),
            _ => {
                bytes.extend(write_eti(&mesh).points.bytes());
                Ok(())
            }
        };
        written.expect("memory takes it");
        let (bytes, other) =
            (spoiled(&mut random, bytes), spoiled(&mut random, write_eti(&mesh).faceset.into_bytes()));
        let file = match kind {
            0 => MeshFile::Obj(&bytes),
            1 => MeshFile::Off(&bytes),
            2 => MeshFile::Ply(&bytes),
            _ => MeshFile::Eti {
                points: &bytes,
                others: [Some(&other), None, None],
                options: EtiOptions::default(),
            },
        };

        let announced = file.memory_bytes();
        if announced > READ_BUDGET {
            ends[0] += 1;
            continue;
        }
        let start = Instant::now();
        let (took, read) = own_peak(|| file.read("hostile").is_ok());
        ends[1 + usize::from(read)] += 1;
        let seconds = start.elapsed().as_secs_f64();
        let text = || String::from_utf8_lossy(&bytes).into_owned();
        assert!(took as u64 <= announced + SLACK, "{took} bytes, {announced} announced:\n{}", text());
        assert!(seconds < PATIENCE, "{seconds} s for\n{}", text());
    }
    ends
}

/// Works on all seeds side by side, and adds up what they came to.
fn tally<const N: usize>(of: impl Fn(u64) -> [u64; N] + Copy + Send + Sync + 'static) -> [u64; N] {
    let work = |seed| move || with_threads(1, || of(seed));
    let workers: Vec<_> = (0..SEEDS).map(|seed| thread::spawn(work(seed))).collect();
    let ends = workers.into_iter().map(|worker| worker.join().expect("no panic"));
    ends.fold([0; N], |sum, ends| std::array::from_fn(|i| sum[i] + ends[i]))
}

#[test]
fn no_mesh_takes_more_memory_than_its_limits_explain() {
    let _alone = alone();
    let [refused, built] = tally(meshes_of);
    println!("{refused} meshes refused, {built} built");
    assert!(refused > COUNT / 20 && built > COUNT / 20, "both ends are met");
}

#[test]
fn no_mesh_file_takes_more_memory_than_is_known_before() {
    let _alone = alone();
    let [announced, refused, read] = tally(files_of);
    println!("{announced} files announce too much, {refused} refused, {read} read");
    assert!(refused > COUNT / 20 && read > COUNT / 20, "both ends are met");
    // One file in some thousands.
    assert!(announced > 0 || COUNT < 100_000, "some announce too much");
}
