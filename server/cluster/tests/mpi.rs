//! Ranks under `mpirun`, as a server starts them: the bits of one process.

use std::{
    io::Read as _,
    net::TcpListener,
    path::Path,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use nappe_cluster::{LINK, Link, Meeting, Remote, SHARED_FOLDER, Token};
use nappe_sim::{
    cloth::{ClothSettings, Network, SpringLaw, SpringRules},
    math::Precision,
    mesh::TriangleMesh,
    report::NoStopwatch,
    world::{BodySetup, Simulation, WorldSetup},
};

const TOKEN: Token = [0xab; 16];

/// A hung sheet of so many particles per side.
fn setup(side: usize) -> WorldSetup {
    let law = |stiffness: f64| SpringLaw { stiffness, damping: 0.01 };
    let rules = SpringRules { stretch: law(200.0), shear: Some(law(100.0)), bend: Some(law(20.0)) };
    let mesh = TriangleMesh::grid(side, side, 0.02);
    let mut network = Network::from_lattice(&mesh, [side, side], &rules, 0.002);
    network.pins = vec![0, side as u32 - 1];
    let body = BodySetup {
        name: "sheet".to_owned(),
        network,
        settings: ClothSettings::default(),
        forces: Vec::new(),
    };
    let (gravity, wind) = ([0.0, -9.81, 0.0], [1.0, 0.0, 0.5]);
    WorldSetup {
        dt: 5e-3,
        gravity,
        wind_at: Vec::new(),
        wind,
        colliders: Vec::new(),
        bodies: vec![body],
        snow: None,
    }
}

/// A job, which is ended with this value.
struct Job(Child);

impl Drop for Job {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn start(size: usize) -> (Job, Remote) {
    start_with(size, |_| {})
}

/// The same with more settings of the launcher.
fn start_with(size: usize, set: impl FnOnce(&mut Command)) -> (Job, Remote) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    let mut launcher = Command::new("mpirun");
    launcher
        .args(["-n", &size.to_string(), "--oversubscribe", "--bind-to", "none", "-x", "NAPPE_LINK"])
        .arg(env!("CARGO_BIN_EXE_nappe-rank"))
        .env(LINK, Link { address: address.to_string(), token: TOKEN, threads: 1 }.to_string())
        .env("OMPI_MCA_mpi_yield_when_idle", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .stdin(Stdio::null());
    set(&mut launcher);
    let job = Job(launcher.spawn().expect("mpirun is installed where this feature is built"));
    let mut meeting = Meeting::new(listener, TOKEN, Duration::from_mins(1)).expect("it can be asked");
    let begin = Instant::now();
    loop {
        if let Some(remote) = meeting.look().expect("the ranks") {
            return (job, remote);
        }
        assert!(begin.elapsed() < Duration::from_mins(1), "rank 0 does not connect");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Waits for the end of a job; whether it was a good one.
fn end(mut job: Job) -> bool {
    let begin = Instant::now();
    loop {
        if let Some(status) = job.0.try_wait().expect("it can be asked") {
            return status.success();
        }
        assert!(begin.elapsed() < Duration::from_mins(1), "the job does not end");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn ranks_of_a_job_have_the_bits_of_one_process() {
    // Of the smaller sheet one rank has all particles.
    for (precision, side) in
        Precision::ALL.into_iter().flat_map(|precision| [(precision, 40), (precision, 10)])
    {
        let setup = setup(side);
        let (mut alone, _) = Simulation::new(&setup, precision).expect("a sheet");
        let reports: Vec<_> = (0..20).map(|_| alone.step(&mut NoStopwatch).expect("it is stable")).collect();
        for size in [1, 2, 4] {
            let (job, mut remote) = start(size);
            assert_eq!(remote.hello().hosts.len(), size);
            remote.build(setup.clone(), precision).expect("a sheet");
            for report in &reports {
                let stepped = remote.step().expect("the link holds");
                assert_eq!(stepped.result.as_ref(), Ok(report), "{size} ranks in {precision}");
            }
            let (mut copy, _) = Simulation::new(&setup, precision).expect("a sheet");
            copy.put(&remote.take().expect("the link holds"));
            assert_eq!(copy.state_hash(), alone.state_hash(), "{size} ranks in {precision}");
            remote.end().expect("the link holds");
            assert!(end(job), "{size} ranks");
        }
    }
}

#[test]
fn a_setup_of_several_pieces_reaches_all_ranks_whole() {
    // MPI is handed 64 MiB at a time: keys of 32 bytes, the last of which are in a second piece and set the last step.
    let mut setup = setup(40);
    let key = |number: u32| (5e-9 * f64::from(number), [1.0, 1e-6 * f64::from(number), 0.5]);
    setup.wind_at = (0..2_200_000).map(key).collect();
    setup.bodies[0].network.drag = 0.01;
    let (mut alone, _) = Simulation::new(&setup, Precision::F32).expect("a sheet");
    let (job, mut remote) = start(3);
    remote.build(setup, Precision::F32).expect("a sheet");
    for _ in 0..3 {
        let report = alone.step(&mut NoStopwatch).expect("it is stable");
        assert_eq!(remote.step().expect("the link holds").result, Ok(report));
    }
    remote.end().expect("the link holds");
    assert!(end(job));
}

#[test]
fn ranks_do_without_a_folder_for_shared_memory_that_only_another_host_has() {
    let missing = Path::new(env!("CARGO_TARGET_TMPDIR")).join("on-another-host");
    let (mut job, mut remote) = start_with(2, |launcher| {
        launcher.envs(SHARED_FOLDER.map(|name| (name, &missing))).stderr(Stdio::piped());
    });
    remote.build(setup(10), Precision::F32).expect("a sheet");
    remote.step().expect("the link holds").result.expect("it is stable");
    remote.end().expect("the link holds");
    let mut said = String::new();
    job.0.stderr.take().expect("a pipe").read_to_string(&mut said).expect("UTF-8");
    assert!(end(job));
    assert!(!said.contains("on-another-host"), "MPI misses it: {said}");
}

#[test]
fn a_link_that_ends_ends_the_job() {
    let (job, mut remote) = start(3);
    remote.build(setup(40), Precision::F32).expect("a sheet");
    drop(remote);
    assert!(!end(job));
}
