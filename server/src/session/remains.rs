//! What a job of ranks can leave behind on this host: processes in groups of their own, and MPI's files in shared memory.
//!
//! Enters: where its ranks run, and the link that each has in its environment. Leaves: nothing of them, and nothing else is
//! touched: a number of a process that stands for another one by now, and a file that was made anew, are left alone.

use std::{
    collections::BTreeMap,
    fs,
    os::unix::fs::MetadataExt as _,
    path::{Path, PathBuf},
};

use nappe_cluster::{LINK, Link, RankPlace};
use rustix::process::{Pid, Signal, getpgid, getpgrp, kill_process, kill_process_group};

/// Where Open MPI keeps the memory that ranks of a host share, and how its files are called.
const SHARED_MEMORY: &str = "/dev/shm/";
const SEGMENTS: [&str; 2] = ["vader_segment.", "sm_segment."];

/// What a job can leave behind on this host.
#[derive(Debug, Default)]
pub(super) struct Remains {
    ranks: Vec<Rank>,
    /// Numbers of the files in their file system, by path.
    segments: BTreeMap<PathBuf, u64>,
}

/// A rank on this host.
#[derive(Clone, Debug)]
struct Rank {
    process: Pid,
    group: Option<Pid>,
    /// The variable that it was started with: no process of another job has it.
    mark: String,
}

impl Remains {
    /// Of a job whose ranks run there, and were handed this link.
    pub(super) fn of(places: &[RankPlace], link: &Link) -> Self {
        let system = rustix::system::uname();
        let here = places.iter().filter(|place| place.host.as_bytes() == system.nodename().to_bytes());
        let rank = |place: &RankPlace| {
            let mark = format!("{LINK}={link}");
            Some(Rank { process: pid(place.process)?, group: pid(place.group), mark })
        };
        let ranks: Vec<Rank> = here.filter_map(rank).filter(Rank::is_there).collect();
        let segments = ranks.iter().flat_map(Rank::segments).collect();
        Self { ranks, segments }
    }

    /// Ends what is left of it.
    pub(super) fn end(&self) {
        for rank in self.ranks.iter().filter(|rank| rank.is_there()) {
            // A process may end at any time.
            let group = getpgid(Some(rank.process)).ok();
            if let Some(group) = group.filter(|group| rank.group == Some(*group) && *group != getpgrp()) {
                let _ = kill_process_group(group, Signal::KILL);
            }
            let _ = kill_process(rank.process, Signal::KILL);
        }
        for (path, number) in &self.segments {
            if inode(path) == Some(*number) {
                // MPI may have removed it meanwhile.
                let _ = fs::remove_file(path);
            }
        }
    }
}

impl Rank {
    /// Whether its process is there, and is of this job.
    fn is_there(&self) -> bool {
        let environment = self.read("environ");
        environment.split(|byte| *byte == 0).any(|variable| variable == self.mark.as_bytes())
    }

    /// Files of shared memory that its process has open, with their numbers.
    fn segments(&self) -> Vec<(PathBuf, u64)> {
        let maps = self.read("maps");
        let maps = String::from_utf8_lossy(&maps);
        let path = |line: &str| {
            let name = &line[line.find(SHARED_MEMORY)? + SHARED_MEMORY.len()..];
            let is_segment = SEGMENTS.iter().any(|start| name.starts_with(start)) && !name.contains('/');
            is_segment.then(|| Path::new(SHARED_MEMORY).join(name))
        };
        let paths = maps.lines().filter_map(path);
        paths.filter_map(|path| inode(&path).map(|number| (path, number))).collect()
    }

    /// A file that Linux has of its process; nothing where there is none.
    fn read(&self, name: &str) -> Vec<u8> {
        fs::read(format!("/proc/{}/{name}", self.process.as_raw_pid())).unwrap_or_default()
    }
}

/// The number of a file in its file system.
fn inode(path: &Path) -> Option<u64> {
    fs::symlink_metadata(path).ok().map(|file| file.ino())
}

/// A process or a group that can be ended: 0 and 1 stand for others than they say.
fn pid(number: u32) -> Option<Pid> {
    i32::try_from(number).ok().filter(|number| *number > 1).and_then(Pid::from_raw)
}

#[cfg(test)]
mod tests {
    use std::{
        os::unix::process::CommandExt as _,
        process::{Child, Command, Stdio},
        thread,
        time::{Duration, Instant},
    };

    use super::*;

    fn link(token: u8) -> Link {
        Link { address: "127.0.0.1:1".to_owned(), token: [token; 16], threads: 1 }
    }

    /// A process in a group of its own, with a link in its environment; it is there when this returns.
    fn process(link: &Link) -> (Child, RankPlace) {
        let mut command = Command::new("sleep");
        command.arg("600").env(LINK, link.to_string()).process_group(0).stdin(Stdio::null());
        let child = command.spawn().expect("sleep starts");
        let host = rustix::system::uname().nodename().to_string_lossy().into_owned();
        let place = RankPlace { host, process: child.id(), group: child.id() };
        (child, place)
    }

    /// Whether a process ends by itself or is ended, however busy the machine is.
    fn ends(child: &mut Child) -> bool {
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_mins(1) {
            if child.try_wait().expect("it can be asked").is_some() {
                return true;
            }
            thread::sleep(Duration::from_millis(2));
        }
        false
    }

    #[test]
    fn ranks_of_the_job_on_this_host_are_ended_and_no_others() {
        let (mut own, own_place) = process(&link(1));
        let (mut other, other_place) = process(&link(2));
        let (mut away, away_place) = process(&link(1));
        let away_place = RankPlace { host: "elsewhere.example".to_owned(), ..away_place };
        let stopped = kill_process_group(Pid::from_child(&own), Signal::STOP);
        stopped.expect("it is there");

        Remains::of(&[own_place, other_place, away_place], &link(1)).end();
        assert!(ends(&mut own), "a stopped rank is ended");
        for child in [&mut other, &mut away] {
            assert!(
                child.try_wait().expect("it can be asked").is_none(),
                "a process of another job is ended"
            );
            child.kill().expect("it is there");
            child.wait().expect("it ends");
        }
    }

    #[test]
    fn numbers_that_stand_for_many_processes_are_no_ranks() {
        assert_eq!([0, 1, u32::MAX].map(pid), [None; 3]);
        assert!(pid(2).is_some());
    }
}
