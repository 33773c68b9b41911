//! A rank of a cluster, started by a server in an MPI job: `mpirun -n 4 nappe-rank`.
//!
//! Reads where the server listens from `NAPPE_LINK` (HOST:PORT/TOKEN/THREADS, the token as 32 hexadecimal digits, the threads
//! of each rank); steps until the server says that this is the end.

use std::{
    env,
    io::{self, Write as _},
    net::TcpStream,
    process::ExitCode,
    sync::Arc,
    thread,
    time::Duration,
};

use nappe_cluster::{Cluster, LINK, Link, Mpi, abort, follow, lead};
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

fn run() -> Result<(), String> {
    follow_parent()?;
    check_processor().map_err(|error| error.to_string())?;
    let Link { address, token, threads } = Link::read(&env::var(LINK).unwrap_or_default())?;
    let (_universe, mpi) = Mpi::join()?;
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| format!("cannot start {threads} threads: {error}"))?;

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
