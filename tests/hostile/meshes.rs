//! Meshes without sense: each is refused or used within memory that its limits explain.

use std::{sync::Arc, thread, time::Instant};

use fastrand::Rng;
use nappe_scene::{MeshSource, Scene, SceneError};
use nappe_sim::mesh::TriangleMesh;
use nappe_tests::threads::with_threads;

use crate::{BUDGET, COUNT, LIMITS, PATIENCE, SEEDS, alone, own_peak, scenes::coordinate};

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

pub(crate) fn mesh(random: &mut Rng) -> TriangleMesh {
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
    TriangleMesh { points, triangles, masses, uv: uv.collect(), ..TriangleMesh::default() }
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

/// Works on all seeds side by side, and adds up what they came to.
pub(crate) fn tally<const N: usize>(of: impl Fn(u64) -> [u64; N] + Copy + Send + Sync + 'static) -> [u64; N] {
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
