//! Four clients and eight watchers, one of them stalled: at its end a server holds what it held at its start, and every
//! state has its hash.

use std::{
    path::Path,
    process::{Child, Stdio},
    sync::atomic::{AtomicU64, Ordering},
    thread,
    time::{Duration, Instant},
};

use super::server::{Server, hash, signal};
use crate::shell::Failure;

const CLIENTS: u64 = 4;
const WATCHERS: u32 = 8;
/// Steps whose hash is compared.
const STEPS: &str = "40";
const SCENE: &str = "hanging_sheet";
/// The server gives memory back when nothing has changed for ten seconds.
const SETTLES: Duration = Duration::from_secs(14);
/// What a server may hold at the end beyond its start: what the allocator keeps, and threads and files that come and go.
const MOST_MEMORY_KB: u64 = 100 << 10;
const MOST_OTHERS: u64 = 4;

/// Drills a server for so long.
pub(super) fn run(target: &Path, time: Duration) -> Result<(), Failure> {
    let server = Server::start(target, &[])?;
    let drilled = drill(&server, time);
    let ended = server.end();
    drilled.and(ended)
}

/// Eight that watch a session, the last of them stopped.
fn watch(server: &Server, session: &str) -> Result<Vec<Child>, Failure> {
    let watch = |_| {
        let mut command = server.command(&["watch", session, "--rate", "5", "--json"]);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn()
    };
    let watchers = (0..WATCHERS).map(watch).collect::<Result<Vec<_>, _>>();
    let watchers = watchers.map_err(|error| Failure(format!("nappe watch: {error}")))?;
    thread::sleep(Duration::from_secs(1));
    if let Some(last) = watchers.last() {
        signal("STOP", last.id());
    }
    Ok(watchers)
}

/// What a client does with its sessions once: states are compared with the hash of an ordinary run.
fn round(server: &Server, name: &str, expected: &str) -> Result<(), Failure> {
    let fork = format!("{name}-fork");
    server.call(&["create", SCENE, "--id", name])?;
    let said = server.call(&["step", name, STEPS, "--json"])?;
    if hash(&said) != Some(expected) {
        return Err(Failure(format!("a session has another hash than a run: {said}")));
    }
    server.call(&["fork", name, "--id", &fork])?;
    server.call(&["play", name])?;
    server.call(&["step", &fork, "5"])?;
    server.call(&["pause", name])?;
    server.call(&["stop", &fork])?;
    server.call(&["delete", &fork])?;
    server.call(&["delete", name]).map(drop)
}

fn drill(server: &Server, time: Duration) -> Result<(), Failure> {
    let said = server.call(&["run", SCENE, "--steps", STEPS, "--json"])?;
    let expected = hash(&said).ok_or_else(|| Failure(format!("a run says no hash: {said}")))?.to_owned();
    round(server, "first-round", &expected)?;
    thread::sleep(SETTLES);
    let before = server.held()?;

    server.call(&["create", SCENE, "--id", "watched", "--steps", "1000000000"])?;
    server.call(&["play", "watched"])?;
    let mut watchers = watch(server, "watched")?;
    let (end, rounds) = (Instant::now() + time, AtomicU64::new(0));
    let made = thread::scope(|scope| {
        let client = |client: u64| {
            let (rounds, expected) = (&rounds, &expected);
            move || {
                let mut made = 0;
                while Instant::now() < end {
                    round(server, &format!("client-{client}-{made}"), expected)?;
                    made += 1;
                    rounds.fetch_add(1, Ordering::Relaxed);
                }
                Ok(())
            }
        };
        let clients: Vec<_> = (0..CLIENTS).map(|number| scope.spawn(client(number))).collect();
        let ended = clients.into_iter().map(|client| client.join().expect("a client does not panic"));
        ended.collect::<Result<(), Failure>>()
    });
    for watcher in &mut watchers {
        let _ = watcher.kill();
        let _ = watcher.wait();
    }
    made?;
    server.call(&["delete", "watched"])?;
    thread::sleep(SETTLES);
    let after = server.held()?;
    println!("{} rounds of sessions; before: {before:?}, after: {after:?}", rounds.load(Ordering::Relaxed));
    let grew = |before: u64, after: u64, most: u64| after > before + most;
    if grew(before.memory_kb, after.memory_kb, MOST_MEMORY_KB)
        || grew(before.threads, after.threads, MOST_OTHERS)
        || grew(before.descriptors, after.descriptors, MOST_OTHERS)
    {
        return Err(Failure(format!("the server holds more than at its start: {before:?}, then {after:?}")));
    }
    Ok(())
}
