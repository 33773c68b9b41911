//! Memory that others can make the program take, counted by its own allocator.
//!
//! Scenes that ask for little and would cost much: needles, leaves, dust, grids of one column, particles far
//! apart; meshes and mesh files without sense. Each is refused or built within memory that its limits explain. And the frames that a session keeps,
//! requests of many empty elements, uploads, short requests that name something large, changes that wait, every method with
//! its largest messages, and piles of cloth.
#![allow(unsafe_code, reason = "an allocator that counts hands every request on to the system's")]
#![allow(clippy::print_stdout, reason = "what became of the scenes")]

mod watch;
mod scenes;
mod history;
mod meshes;
mod mutations;
mod mesh_files;
mod requests;
mod named;
mod contract;
mod messages;
mod largest;
mod estimates;
mod waiting;
mod piles;

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use nappe_scene::{NoMeshes, Scene, SceneLimits};
use nappe_server::{App, Config, Limits};
use nappe_sim::{math::Precision, world::Simulation};
use nappe_tests::threads::with_threads;
use tonic::transport::Channel;

struct Counting;

/// From so many bytes on, the system moves the pages of a block that grows, and copies none.
const MOVED: usize = 32 << 20;
/// Bytes in use.
static USED: AtomicUsize = AtomicUsize::new(0);
/// Allocations of so many bytes or more are not counted: what the server asks for only to see whether there is any.
pub(crate) static IGNORED: AtomicUsize = AtomicUsize::new(usize::MAX);
/// Most bytes in use since the last look.
static PEAK: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    /// Bytes that a thread took and did not give back since the last look, and the most that it had of them.
    static OWN: Cell<[isize; 2]> = const { Cell::new([0; 2]) };
}

impl Counting {
    /// Whether an allocation of this thread is not counted.
    fn is_left_out(bytes: usize) -> bool {
        bytes >= IGNORED.load(Ordering::Relaxed) || watch::is_of_client()
    }

    fn add(bytes: usize) {
        if Self::is_left_out(bytes) {
            return;
        }
        let used = USED.fetch_add(bytes, Ordering::Relaxed) + bytes;
        PEAK.fetch_max(used, Ordering::Relaxed);
        watch::look(used);
        // A thread that ends has no counter any more.
        let _ = OWN.try_with(|own| {
            let [used, peak] = own.get();
            let used = used + bytes as isize;
            own.set([used, peak.max(used)]);
        });
    }

    fn take(bytes: usize) {
        if Self::is_left_out(bytes) {
            return;
        }
        USED.fetch_sub(bytes, Ordering::Relaxed);
        let _ = OWN.try_with(|own| {
            let [used, peak] = own.get();
            own.set([used - bytes as isize, peak]);
        });
    }
}

// SAFETY: every call goes to the system's allocator with the arguments that it came with.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size());

        // SAFETY: the caller keeps `alloc`'s contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size());

        // SAFETY: the caller keeps `alloc_zeroed`'s contract.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        Self::take(layout.size());

        // SAFETY: the caller keeps `dealloc`'s contract.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if layout.size() < MOVED {
            // Both are there while the system copies.
            Self::add(size);
            Self::take(layout.size());
        } else {
            Self::take(layout.size());
            Self::add(size);
        }

        // SAFETY: the caller keeps `realloc`'s contract.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// One test at a time: they count the same memory.
static ALONE: Mutex<()> = Mutex::new(());

/// Bytes in use.
pub(crate) fn used() -> usize {
    USED.load(Ordering::Relaxed)
}

/// Most bytes in use while `work` was done, beyond those before it.
pub(crate) async fn peak_since(work: impl Future<Output = ()>) -> usize {
    let before = used();
    PEAK.store(before, Ordering::Relaxed);
    work.await;
    PEAK.load(Ordering::Relaxed).saturating_sub(before)
}

/// Most bytes that this thread had at a time while `work` was done, and what came of it.
pub(crate) fn own_peak<T>(work: impl FnOnce() -> T) -> (isize, T) {
    OWN.set([0; 2]);
    let done = work();
    (OWN.get()[1], done)
}

/// Waits until no other test counts.
pub(crate) fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A call that takes this long hangs.
pub(crate) const HANGS: Duration = Duration::from_mins(5);

/// Times so long that a busy machine breaks none of them: what one test's server has is gone when the next one counts.
fn patient() -> Config {
    Config {
        drain_seconds: 300.0,
        drain_stall_seconds: 300.0,
        handshake_seconds: 300.0,
        request_seconds: 300.0,
        upload_idle_seconds: 300.0,
        ..Config::default()
    }
}

/// Starts a server with limits that asks for no token, in the runtime of the caller.
pub(crate) fn start(limits: Limits) -> App {
    let address = "127.0.0.1:0".parse().expect("an address");
    App::start(Config { address, limits, no_token: true, ..patient() }).expect("the server starts")
}

/// A connection to a server at a URL.
pub(crate) async fn connect(url: String) -> Channel {
    let endpoint = Channel::from_shared(url).expect("a URL").timeout(HANGS);
    endpoint.connect().await.expect("the server answers")
}

/// Such a server, and a connection to it.
pub(crate) async fn server(limits: Limits) -> (App, Channel) {
    let app = start(limits);
    let channel = connect(app.url()).await;
    (app, channel)
}

/// What the scenes may hold.
const LIMITS: SceneLimits = SceneLimits { max_particles: 250, max_springs: 4000 };
/// Memory (bytes) that a scene of so many particles may take while it is read and built.
const BUDGET: isize = 48 << 20;
/// How long (s) one scene may take before it counts as one that hangs: the slowest takes some hundredths.
const PATIENCE: f64 = 60.0;
/// Scenes, meshes and mesh files that are tried, of each so many.
pub(crate) const COUNT: u64 = if cfg!(feature = "slow") { 100_000 } else { 1_000 };
/// Of these, one in so many is simulated too where it can be built.
const SIMULATED: u64 = 200;
/// Seeds of the scenes, each on a thread of its own.
const SEEDS: u64 = 4;

/// What became of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    /// It is not a scene.
    Unread,
    /// It asks for too much, or for what cannot be.
    Refused,
    Built,
    Simulated,
}

/// How far a scene is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Goal {
    Build,
    Simulate,
}

fn end_of(text: &str, goal: Goal) -> End {
    let Ok(scene) = Scene::parse(text, "hostile") else { return End::Unread };
    let Ok(built) = scene.build(&NoMeshes, &LIMITS) else { return End::Refused };
    if goal == Goal::Build {
        return End::Built;
    }
    match Simulation::new(&built.setup, Precision::F64) {
        Ok((simulation, _)) => {
            assert!(simulation.particle_count() as u64 <= LIMITS.max_particles, "{text}");
            End::Simulated
        }
        Err(_) => End::Refused,
    }
}

/// What the scenes of one seed came to.
#[derive(Clone, Debug, Default)]
struct Tally {
    /// By how they ended.
    ends: [u64; 4],
    /// Most memory (bytes), and for which scene.
    largest: (isize, String),
    /// Longest time (s), and for which scene.
    longest: (f64, String),
}

impl Tally {
    fn of(seed: u64, count: u64) -> Self {
        let (mut random, mut tally) = (fastrand::Rng::with_seed(seed), Self::default());
        for number in 0..count {
            let text = scenes::hostile(&mut random);
            let start = Instant::now();

            let goal = if number % SIMULATED == 0 { Goal::Simulate } else { Goal::Build };
            let (took, end) = own_peak(|| end_of(&text, goal));
            tally.ends[end as usize] += 1;

            let seconds = start.elapsed().as_secs_f64();
            assert!(took <= BUDGET, "{took} bytes for\n{text}");
            assert!(seconds < PATIENCE, "{seconds} s for\n{text}");
            if took > tally.largest.0 {
                tally.largest = (took, text.clone());
            }
            if seconds > tally.longest.0 {
                tally.longest = (seconds, text);
            }
        }
        tally
    }
}

#[test]
fn no_scene_takes_more_memory_than_its_limits_explain() {
    let _alone = alone();
    let work = |seed| move || with_threads(1, || Tally::of(seed, COUNT / SEEDS));
    let workers: Vec<_> = (0..SEEDS).map(|seed| thread::spawn(work(seed))).collect();
    let tallies: Vec<Tally> = workers.into_iter().map(|worker| worker.join().expect("no panic")).collect();

    let total = |end: End| tallies.iter().map(|tally| tally.ends[end as usize]).sum::<u64>();
    let [unread, refused, built, simulated] =
        [End::Unread, End::Refused, End::Built, End::Simulated].map(total);
    println!("{unread} not read, {refused} refused, {built} built, {simulated} simulated");
    for Tally { largest, longest, .. } in &tallies {
        println!("{} bytes for\n{}\n{:.3} s for\n{}", largest.0, largest.1, longest.0, longest.1);
    }
    assert!(unread < COUNT / 100, "the scenes are well formed: {unread} are not");
    assert!(refused > COUNT / 20 && built > COUNT / 20 && simulated > COUNT / 2000, "all ends are met");
}
