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
};

use nappe_cluster::{Cluster, LINK, Link, Mpi, abort, follow, lead};
use nappe_sim::{math::check_processor, parallel::Communicator as _};
use rayon::ThreadPoolBuilder;

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

fn run() -> Result<(), String> {
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
            lead(&cluster, token, stream).map_err(|error| error.to_string())
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
