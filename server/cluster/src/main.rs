//! A rank of a cluster, started by a server in an MPI job: `mpirun -n 4 nappe-rank`.
//!
//! Reads where the server listens from `NAPPE_LINK` (HOST:PORT/TOKEN/THREADS, the token as 32 hexadecimal digits, the threads
//! of each rank); steps until the server says that this is the end.

use std::{
    env,
    io::{self, Write as _},
    net::TcpStream,
    os::unix::process::CommandExt as _,
    path::Path,
    process::{Command, ExitCode},
    sync::Arc,
    thread,
    time::Duration,
};

use nappe_cluster::{Cluster, LINK, Link, Mpi, SHARED_FOLDER, abort, follow, lead};
use nappe_sim::{math::check_processor, parallel::Communicator as _};
use rayon::ThreadPoolBuilder;
use rustix::process::{Signal, getpid, kill_process};

/// How long a job may take to end by itself once the link of rank 0 has ended.
const ABORT_TIME: Duration = Duration::from_millis(500);

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            say(&message);
            ExitCode::FAILURE
        }
    }
}

/// Says what is wrong where the launcher shows it to the server.
fn say(message: &str) {
    // Nobody is left to be told when the launcher is gone.
    let _ = writeln!(io::stderr().lock(), "nappe-rank: {message}");
}

/// Ends this process, whose link has ended: whoever waits in MPI for a rank that hangs does not come back to do so. Without
/// a word: a launcher that hangs reads none, and who writes would wait for it.
fn end_soon() {
    thread::sleep(ABORT_TIME);
    // A process can always end itself.
    let _ = kill_process(getpid(), Signal::KILL);
}

/// Has the system end this process when the one that started it ends, even while this one is stopped.
fn follow_parent() -> Result<(), String> {
    #[cfg(target_os = "linux")]
    rustix::process::set_parent_process_death_signal(Some(Signal::KILL))
        .map_err(|error| format!("cannot be told of the end of the launcher: {error}"))?;
    Ok(())
}

/// Starts this program anew, without their variables, where folders for shared memory are not there: the server made them on
/// its own host, and on this one MPI is to choose. It would share no memory here.
fn leave_missing_folders() -> Result<(), String> {
    let is_missing = |name: &str| env::var_os(name).is_some_and(|folder| !Path::new(&folder).is_dir());
    if !SHARED_FOLDER.into_iter().any(is_missing) {
        return Ok(());
    }
    let anew = |error: io::Error| format!("cannot be started anew: {error}");
    let mut command = Command::new(env::current_exe().map_err(anew)?);
    for name in SHARED_FOLDER {
        command.env_remove(name);
    }
    Err(anew(command.args(env::args_os().skip(1)).exec()))
}

fn run() -> Result<(), String> {
    leave_missing_folders()?;
    follow_parent()?;
    check_processor().map_err(|error| error.to_string())?;
    let Link { address, token, threads } = Link::read(&env::var(LINK).unwrap_or_default())?;
    let (_universe, mpi) = Mpi::join()?;
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| format!("cannot start threads, as many as {threads}: {error}"))?;

    let is_first = mpi.rank() == 0;
    let cluster: Arc<dyn Cluster> = Arc::new(mpi);
    let ended = pool.install(|| {
        if is_first {
            let stream =
                TcpStream::connect(&address).map_err(|error| format!("cannot reach {address}: {error}"))?;
            lead(&cluster, token, stream, end_soon).map_err(|error| error.to_string())
        } else {
            follow(&cluster).map_err(|error| error.to_string())
        }
    });
    // The others wait for this one.
    ended.inspect_err(|message| {
        say(message);
        abort();
    })
}
