//! A server that keeps its sessions, killed at random moments: each time it comes back, all sessions are there. At the end no change
//! that was answered is missing, states have the bits of undisturbed sessions, and who watched has every frame once.

use std::{
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::{Duration, Instant},
};

use super::{
    changes::{self, Change, Changer, step_of},
    random::Random,
    server::{Server, hash, number, step, until},
    watched::Watched,
};
use crate::shell::Failure;

/// From an answer of the server to its kill: the shortest time (s), and how many times as long the longest is.
const SHORTEST: f64 = 0.05;
const RANGE: f64 = 40.0;
const SEED: u64 = 1;
/// Steps that are taken after the last change has taken effect.
const AFTER: u64 = 20;

/// What a scene begins with.
const HEAD: &str = "version = 1\ndt = 0.005\nframe_interval = 8\n";
const SHEET: &str = r#"
[[body]]
name = "sheet"
mesh = { grid = [8, 6], spacing = 0.05, plane = "upright" }
mass = { density = 0.3 }
pins = [0, 7]
air = { lift = 1.0 }
springs = { stretch = { stiffness = 100, damping = 0.02 }, shear = { stiffness = 30, damping = 0.01 }, bend = { stiffness = 0.1, damping = 0.001 } }
"#;
const THICK: &str = r#"
[[body]]
name = "sheet"
mesh = { grid = [10, 10], spacing = 0.05, ripple = 0.0005 }
mass = { density = 0.25 }
drag = 2e-5
pins = ["top_left", "top_right"]
thickness = 0.004
springs = { stretch = { stiffness = 200, damping = 0.03 }, shear = { stiffness = 50, damping = 0.01 }, bend = { stiffness = 2, damping = 0.002 } }
solver = { tolerance = 1e-3, max_iterations = 200 }
"#;
const SNOW: &str = r#"
[snow]
cell = 0.06

[[snow.object]]
name = "ball"
sphere = { center = [2, 0.2, 0], radius = 0.1 }
velocity = [1, -1, 0]
seed = 1
"#;
const FLOOR: &str = r#"
[[collider]]
name = "floor"
plane = { point = [0, -3, 0], normal = [0, 1, 0] }
friction = 0.8
"#;

/// A session that is drilled.
struct Subject {
    id: &'static str,
    precision: &'static str,
    parts: &'static [&'static str],
    changer: Changer,
}

static SUBJECTS: [Subject; 5] = [
    Subject {
        id: "cloth",
        precision: "f32",
        parts: &[SHEET],
        changer: Changer { pause: SLOWLY, options: wind },
    },
    Subject {
        id: "held",
        precision: "f64",
        parts: &[SHEET, FLOOR],
        changer: Changer { pause: OFTEN, options: held },
    },
    Subject {
        id: "thick",
        precision: "f32",
        parts: &[THICK],
        changer: Changer { pause: SLOWLY, options: wind },
    },
    Subject {
        id: "snow",
        precision: "f32",
        parts: &[SNOW, FLOOR],
        changer: Changer { pause: SLOWLY, options: of_snow },
    },
    Subject {
        id: "both",
        precision: "f64",
        parts: &[SHEET, SNOW, FLOOR],
        changer: Changer { pause: SLOWLY, options: of_both },
    },
];
/// Some 20 changes a second, each of which is two calls of some 20 ms; and one.
const OFTEN: Duration = Duration::from_millis(10);
const SLOWLY: Duration = Duration::from_secs(1);

/// Options of a call.
fn words<const N: usize>(words: [&str; N]) -> Vec<String> {
    words.map(str::to_owned).to_vec()
}

fn wind(number: u64) -> Vec<String> {
    words(["--wind", &format!("{},0,1", 1 + number % 3)])
}

/// A pin, a force and a collider in turn.
fn held(number: u64) -> Vec<String> {
    let part = number / 3 % 5;
    match number % 3 {
        0 => words(["--pin", &format!("0=0,0.0{part},0.01:0.1")]),
        1 => words(["--force", &format!("sheet:12=0,0.00{part},0.002")]),
        _ => words(["--collider", "floor", "--to", &format!("0,-3.0{part},0"), "--in", "0.1"]),
    }
}

fn of_snow(number: u64) -> Vec<String> {
    words(["--force", &format!("ball:all=0,0.000{},0", number % 4)])
}

fn of_both(number: u64) -> Vec<String> {
    let body = if number.is_multiple_of(2) { "sheet" } else { "ball" };
    words(["--force", &format!("{body}:all=0,0.000{},0", number % 4)])
}

/// Kills a server so many times.
pub(super) fn run(target: &Path, count: usize) -> Result<(), Failure> {
    let mut server =
        Server::start(target, &["--state-dir", "{folder}/states", "--checkpoint-seconds", "0.5"])?;
    let mut watchers = Vec::new();
    for subject in &SUBJECTS {
        create(&server, subject)?;
        watchers.push(Watched::begin(server.caller(), subject.id, server.folder())?);
    }
    until("every session is watched", || {
        Ok(server.call(&["list", "--json"])?.matches("\"watcher_count\":1").count() == SUBJECTS.len())
    })?;
    for subject in &SUBJECTS {
        server.call(&["play", subject.id, "--real-time-factor", "1"])?;
    }
    let changes = disturb(&mut server, &mut watchers, count)?;
    let reference = Server::start(target, &[])?;
    for ((subject, changes), watcher) in SUBJECTS.iter().zip(&changes).zip(watchers) {
        compare(&server, &reference, subject, changes, watcher)?;
    }
    reference.end()?;
    server.end()
}

/// Makes a session of a subject, which never ends by itself.
fn create(server: &Server, subject: &Subject) -> Result<(), Failure> {
    let scene = server.write_scene(&(HEAD.to_owned() + &subject.parts.concat()))?;
    let mut arguments = vec!["create", scene.as_str(), "--id", subject.id, "--precision", subject.precision];
    arguments.extend(["--steps", "0", "--threads", "1"]);
    server.call(&arguments).map(drop)
}

/// Kills the server again and again while its sessions are changed; what changed each of them.
fn disturb(server: &mut Server, watchers: &mut [Watched], count: usize) -> Result<Vec<Vec<Change>>, Failure> {
    let (caller, is_over) = (server.caller().clone(), AtomicBool::new(false));
    thread::scope(|scope| {
        let changing: Vec<_> = SUBJECTS
            .iter()
            .map(|subject| {
                let (caller, is_over) = (&caller, &is_over);
                scope.spawn(move || changes::change(caller, subject.id, subject.changer, is_over))
            })
            .collect();
        let killed = kill(server, watchers, count);
        is_over.store(true, Ordering::Relaxed);
        let changed = changing.into_iter().map(|thread| thread.join().expect("a client does not panic"));
        let changed = changed.collect::<Result<Vec<_>, _>>();
        killed.and(changed)
    })
}

fn kill(server: &mut Server, watchers: &mut [Watched], count: usize) -> Result<(), Failure> {
    let (mut random, mut slowest) = (Random::new(SEED), Duration::ZERO);
    for _ in 0..count {
        thread::sleep(Duration::from_secs_f64(SHORTEST * RANGE.powf(random.share())));
        server.kill();
        let begin = Instant::now();
        server.start_again()?;
        slowest = slowest.max(begin.elapsed());
        let list = server.call(&["list", "--json"])?;
        if let Some(missing) = SUBJECTS.iter().find(|subject| step_of(&list, subject.id).is_none()) {
            return Err(Failure(format!("the session {} is missing after a kill: {list}", missing.id)));
        }
        for watcher in &mut *watchers {
            watcher.look()?;
        }
    }
    println!("{count} kills; all sessions were listed within {:.2} s", slowest.as_secs_f64());
    Ok(())
}

/// Compares a session with one that nobody disturbed, and ends it with who watches it.
fn compare(
    server: &Server,
    reference: &Server,
    subject: &Subject,
    changes: &[Change],
    watcher: Watched,
) -> Result<(), Failure> {
    let id = subject.id;
    let stands = server.call(&["pause", id, "--json"])?;
    let taken = step(&stands).ok_or_else(|| Failure(format!("a session says no step: {stands}")))?;
    let last = changes.last().map_or(0, |change| change.step);
    let steps = taken.max(last) + AFTER;
    let disturbed = server.call(&["step", id, "--to", &steps.to_string(), "--json"])?;
    create(reference, subject)?;
    let undisturbed = changes::repeat(reference.caller(), id, changes, steps)?;
    if step(&undisturbed) != Some(steps)
        || hash(&disturbed).is_none()
        || hash(&disturbed) != hash(&undisturbed)
    {
        return Err(Failure(format!("{id}: another hash than without kills: {disturbed}, {undisturbed}")));
    }

    let ended = server.call(&["stop", id, "--json"])?;
    let frame =
        number(&ended, "frame").ok_or_else(|| Failure(format!("a session says no frame: {ended}")))?;
    let (frames, forgotten) = watcher.end(frame)?;
    println!(
        "{id}: {steps} steps, {} changes, the same bits; {frames} frames, the next one was forgotten {forgotten} times",
        changes.len()
    );
    Ok(())
}
