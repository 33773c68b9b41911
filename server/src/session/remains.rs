//! What a job of ranks can leave behind on this host: processes, and the files of MPI, which have folders of their own.
//!
//! Enters: the link that each process of the job has in its environment. Leaves: folders, and in the end nothing of the job.
//! Nothing else is touched: a number of a process that stands for another one by now is left alone.

use std::{
    env, fs, io, iter,
    os::unix::fs::DirBuilderExt as _,
    path::{Path, PathBuf},
    thread,
    time::{Duration, Instant},
};

use nappe_cluster::{LINK, Link, SHARED_FOLDER};
use rustix::process::{Pid, Signal, kill_process};

/// Where Linux has files that are memory.
const SHARED_MEMORY: &str = "/dev/shm";
/// The variable that says where temporary files are made.
const TEMPORARY: &str = "TMPDIR";
/// How long is waited for the end of processes that are killed, and how often they are looked for.
const END: Duration = Duration::from_millis(500);
const TICK: Duration = Duration::from_millis(2);

/// What a job can leave behind on this host. It is ended with this value.
#[derive(Debug)]
pub(super) struct Remains {
    /// The variable that its processes are started with: no process of another job has it.
    mark: String,
    /// The folder for temporary files.
    temporary: PathBuf,
    /// The folder for memory that ranks share; none where the system has no place for it.
    shared: Option<PathBuf>,
}

impl Remains {
    /// Of a job that is to be started with this link, and with [`Remains::variables`].
    ///
    /// # Errors
    /// When the system makes no folder for temporary files.
    pub(super) fn new(link: &Link) -> io::Result<Self> {
        let mut number = [0; 8];
        getrandom::fill(&mut number).map_err(io::Error::other)?;
        let name = format!("nappe-ranks-{:016x}", u64::from_ne_bytes(number));
        let temporary = make_folder(env::temp_dir().join(&name))?;
        // Without it MPI takes the other one.
        let shared = make_folder(Path::new(SHARED_MEMORY).join(&name)).ok();
        Ok(Self { mark: format!("{LINK}={link}"), temporary, shared })
    }

    /// What tells the processes of the job of its folders. A folder for shared memory that the user chose stays.
    pub(super) fn variables(&self) -> impl Iterator<Item = (&'static str, &Path)> {
        let free = SHARED_FOLDER.into_iter().filter(|name| env::var_os(name).is_none());
        let shared = free.filter_map(move |name| Some((name, self.shared.as_deref()?)));
        shared.chain([(TEMPORARY, &*self.temporary)])
    }

    /// The folders of the job.
    pub(super) fn folders(&self) -> impl Iterator<Item = &Path> {
        iter::once(&*self.temporary).chain(self.shared.as_deref())
    }

    /// Kills the processes of the job, and waits until they are gone: they may be making files.
    fn end_processes(&self) {
        let begin = Instant::now();
        loop {
            let left = self.processes();
            for process in &left {
                // It may end at any time.
                let _ = kill_process(*process, Signal::KILL);
            }
            if left.is_empty() || begin.elapsed() > END {
                return;
            }
            thread::sleep(TICK);
        }
    }

    /// The processes of the job that are there.
    fn processes(&self) -> Vec<Pid> {
        let Ok(all) = fs::read_dir("/proc") else { return Vec::new() };
        let numbers = all.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse::<i32>().ok());
        numbers.filter(|number| self.has(*number)).filter_map(Pid::from_raw).collect()
    }

    /// Whether a process is of this job. One that has ended has no environment any more, and those of others cannot be read.
    fn has(&self, process: i32) -> bool {
        let environment = fs::read(format!("/proc/{process}/environ")).unwrap_or_default();
        environment.split(|byte| *byte == 0).any(|variable| variable == self.mark.as_bytes())
    }
}

impl Drop for Remains {
    fn drop(&mut self) {
        self.end_processes();
        for folder in self.folders() {
            // What cannot be removed is in nobody's way.
            let _ = fs::remove_dir_all(folder);
        }
    }
}

/// Makes a folder that only this user may enter.
fn make_folder(path: PathBuf) -> io::Result<PathBuf> {
    let made = fs::DirBuilder::new().mode(0o700).create(&path);
    made.map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use std::{
        os::unix::{fs::MetadataExt as _, process::CommandExt as _},
        process::{Child, Command, Stdio},
    };

    use rustix::process::kill_process_group;

    use super::*;

    fn remains(token: u8) -> (Remains, Link) {
        let link = Link { address: "127.0.0.1:1".to_owned(), token: [token; 16], threads: 1 };
        (Remains::new(&link).expect("folders"), link)
    }

    /// A process in a group of its own, with a link in its environment; it is there when this returns.
    fn process(link: &Link) -> Child {
        let mut command = Command::new("sleep");
        command.arg("600").env(LINK, link.to_string()).process_group(0).stdin(Stdio::null());
        command.spawn().expect("sleep starts")
    }

    /// Whether a process ends by itself or is ended, however busy the machine is.
    fn ends(child: &mut Child) -> bool {
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_mins(1) {
            if child.try_wait().expect("it can be asked").is_some() {
                return true;
            }
            thread::sleep(TICK);
        }
        false
    }

    #[test]
    fn processes_of_the_job_are_ended_and_no_others() {
        let ((own_remains, own_link), (_other_remains, other_link)) = (remains(1), remains(2));
        let [mut first, mut second, mut other] = [&own_link, &own_link, &other_link].map(process);
        let stopped = kill_process_group(Pid::from_child(&first), Signal::STOP);
        stopped.expect("it is there");

        drop(own_remains);
        assert!(ends(&mut first) && ends(&mut second), "one that is stopped is ended too");
        let is_left = other.try_wait().expect("it can be asked").is_none();
        assert!(is_left, "a process of another job is ended");
        other.kill().expect("it is there");
        other.wait().expect("it ends");
    }

    #[test]
    fn a_job_has_folders_of_its_own_that_are_gone_with_all_that_is_in_them() {
        let (first, _) = remains(3);
        let (second, _) = remains(3);
        let [own, others] =
            [&first, &second].map(|remains| remains.folders().map(Path::to_path_buf).collect::<Vec<_>>());
        assert!(own.iter().all(|folder| !others.contains(folder)));
        let temporary = first.variables().find(|(name, _)| *name == TEMPORARY).map(|(_, folder)| folder);
        assert_eq!(temporary, own.first().map(PathBuf::as_path));
        for folder in &own {
            let mode = fs::metadata(folder).expect("it is there").mode();
            assert_eq!(mode & 0o077, 0, "others may enter {}", folder.display());
            fs::create_dir(folder.join("session")).expect("a folder is made");
            fs::write(folder.join("session/segment"), "memory").expect("a file is written");
        }
        drop(first);
        assert!(!own.iter().any(|folder| folder.exists()));
        assert!(others.iter().all(|folder| folder.is_dir()), "folders of another job are removed");
    }
}
