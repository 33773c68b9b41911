//! Ranks and launchers that are stopped, as a computer that hangs stops them: sessions and servers end all the same.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::{
    ranks::{LAUNCHER, has_ranks},
    ranks_lost::{Job, processes, send},
    support::{Folder, SMALL_SCENE, Server, folder, until, write_scene},
};

/// A server, and a scene that never ends.
struct Place {
    server: Server,
    scene: String,
    _folder: Folder,
}

/// Which process of a job hangs.
#[derive(Clone, Copy, Debug)]
enum Hung {
    Rank(usize),
    Launcher,
}

/// Jobs of so many ranks, and what hangs of each.
const CASES: [(usize, Hung); 4] =
    [(1, Hung::Rank(0)), (2, Hung::Rank(1)), (4, Hung::Rank(2)), (2, Hung::Launcher)];

impl Place {
    fn new(options: &[&str]) -> Self {
        let folder = folder();
        let text = SMALL_SCENE.replace("steps = 40", "steps = 0").replace("[12, 12]", "[30, 30]");
        let scene = write_scene(folder.path(), &text);
        let server = Server::with(&[&["--launcher", LAUNCHER, "--max-ranks", "4"], options].concat());
        Self { server, scene, _folder: folder }
    }

    fn session(&self, id: &str) -> Value {
        let all = self.server.nappe(&["list"]).ok().json();
        let mut all = all.as_array().expect("a list").iter();
        all.find(|session| session["session_id"] == id).expect("it is there").clone()
    }

    /// Creates a session of so many ranks and has it play; then one process of its job is stopped.
    fn hang(&self, id: &str, size: usize, hung: Hung) -> Job {
        let before: BTreeSet<u32> = processes(self.server.id(), "nappe-rank").into_iter().collect();
        self.server.nappe(&["create", &self.scene, "--id", id, "--ranks", &size.to_string()]).ok();
        self.server.nappe(&["play", id]).ok();
        until("some steps", || self.session(id)["step"].as_u64() > Some(5));
        let mut ranks = processes(self.server.id(), "nappe-rank");
        ranks.retain(|rank| !before.contains(rank));
        let launchers = processes(self.server.id(), "mpirun");
        assert_eq!(ranks.len(), size);
        let launcher = *launchers.last().expect("a launcher");
        let job = Job::of(launcher, ranks);
        send(
            "STOP",
            match hung {
                Hung::Rank(number) => job.ranks[number],
                Hung::Launcher => job.launcher,
            },
        );
        job
    }
}

#[test]
fn a_session_of_which_a_process_hangs_is_deleted_with_all_of_its_job() {
    if !has_ranks() {
        return;
    }
    let place = Place::new(&["--max-sessions", "1"]);
    for (size, hung) in CASES {
        let job = place.hang("hung", size, hung);
        place.server.nappe(&["delete", "hung"]).ok();
        // The place of the only session that there may be.
        place.server.nappe(&["create", &place.scene, "--id", "next"]).ok();
        until("nothing is left", || job.is_gone());
        place.server.nappe(&["delete", "next"]).ok();
    }
}

#[test]
fn a_session_of_which_a_rank_hangs_is_stopped_and_says_so() {
    if !has_ranks() {
        return;
    }
    let place = Place::new(&[]);
    for (number, size) in [(0, 1), (1, 2)] {
        let id = format!("stopped-{number}");
        let job = place.hang(&id, size, Hung::Rank(number));
        let stopped = place.server.nappe(&["stop", &id]);
        assert!(stopped.stderr.contains("RANK_LOST"), "{stopped:?}");
        assert_eq!(place.session(&id)["failure"]["reason"], "RANK_LOST");
        until("nothing is left", || job.is_gone());
    }
}

#[test]
fn a_job_of_which_a_process_hangs_ends_with_a_server_that_is_killed() {
    if !has_ranks() {
        return;
    }
    for (size, hung) in CASES {
        let place = Place::new(&[]);
        let job = place.hang("hung", size, hung);
        place.server.end_by("KILL");
        until("nothing is left", || job.is_gone());
    }
}

#[test]
fn ranks_that_say_nothing_are_lost_with_the_names_of_their_hosts() {
    if !has_ranks() {
        return;
    }
    let place = Place::new(&["--rank-silence", "5"]);
    let jobs = [("first", 0, "no word came from rank 0, on host"), ("second", 1, "for a rank on")]
        .map(|(id, number, said)| (id, said, place.hang(id, 2, Hung::Rank(number))));
    for (id, said, job) in jobs {
        until("the session failed", || place.session(id)["state"] == "failed");
        let failure = place.session(id)["failure"].clone();
        assert_eq!(failure["reason"], "RANK_LOST");
        let message = failure["message"].as_str().expect("a text");
        assert!(message.contains(said) && message.contains("5 s"), "{message}");
        until("nothing is left", || job.is_gone());
    }
}
