//! A rank of a cluster, started by a server in an MPI job: `mpirun -n 4 nappe-rank`.
//!
//! Reads where the server listens from `NAPPE_LINK` (HOST:PORT/TOKEN, the token as 32 hexadecimal digits) and the threads of
//! a rank from `NAPPE_RANK_THREADS`; steps until the server says that this is the end.

use std::{env, net::TcpStream, process::ExitCode, sync::Arc};

use nappe_cluster::{Cluster, Mpi, Token, abort, follow, lead};
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
#[allow(clippy::print_stderr, reason = "what a launcher hands on")]
fn say(message: &str) {
    eprintln!("nappe-rank: {message}");
}

fn run() -> Result<(), String> {
    check_processor().map_err(|error| error.to_string())?;
    let (address, token) = link(&env::var("NAPPE_LINK").unwrap_or_default())?;
    let threads = env::var("NAPPE_RANK_THREADS").unwrap_or_else(|_| "1".to_owned());
    let threads: usize = threads
        .parse()
        .ok()
        .filter(|threads| *threads > 0)
        .ok_or_else(|| format!("NAPPE_RANK_THREADS is '{threads}': a number from 1 is needed"))?;
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

/// Where the server listens, and what is shown to it.
fn link(text: &str) -> Result<(String, Token), String> {
    let wrong = || "NAPPE_LINK is to be HOST:PORT/TOKEN, as a server that starts ranks sets it".to_owned();
    let (address, token) = text.rsplit_once('/').ok_or_else(wrong)?;
    let mut bytes = Token::default();
    if token.len() != 2 * bytes.len() {
        return Err(wrong());
    }
    let digit = |byte: u8| char::from(byte).to_digit(16);
    for (byte, digits) in bytes.iter_mut().zip(token.as_bytes().as_chunks::<2>().0) {
        let [high, low] = digits.map(digit);
        *byte = high.zip(low).map(|(high, low)| (16 * high + low) as u8).ok_or_else(wrong)?;
    }
    Ok((address.to_owned(), bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_is_an_address_and_a_token() {
        let (address, token) = link("[::1]:6000/000102030405060708090a0b0c0d0eff").expect("a link");
        assert_eq!((address.as_str(), token[1], token[15]), ("[::1]:6000", 1, 255));
        for wrong in ["", "host:1", "host:1/12", "host:1/zz0102030405060708090a0b0c0d0e0f"] {
            assert!(link(wrong).is_err(), "{wrong}");
        }
    }
}
