//! Ranks of the suite, which are threads, and the server's end of their link.

use std::{
    net::{TcpListener, TcpStream},
    thread,
    time::{Duration, Instant},
};

use nappe_cluster::{Meeting, Remote, RemoteError, Token, follow, lead};
use nappe_tests::ranks::on_ranks;

/// What ranks show that are expected.
pub(crate) const TOKEN: Token = [7; 16];

/// Nothing in this suite takes this long unless it hangs.
pub(crate) const PATIENCE: Duration = Duration::from_mins(1);

/// A listener on a free port.
pub(crate) fn listener() -> TcpListener {
    TcpListener::bind("127.0.0.1:0").expect("a port")
}

/// Takes over who shows the token, among all who connect. Ranks may be silent for so long while they work.
pub(crate) fn meet(listener: TcpListener, silence: Duration) -> Result<Remote, RemoteError> {
    let mut meeting = Meeting::new(listener, TOKEN, silence).expect("it can be asked");
    let begin = Instant::now();
    loop {
        if let Some(remote) = meeting.look()? {
            return Ok(remote);
        }
        assert!(begin.elapsed() < PATIENCE, "nobody with the token comes");
        thread::sleep(Duration::from_millis(1));
    }
}

/// Starts so many ranks, which connect to the listener. They end by themselves; the handle says whether well.
pub(crate) fn start(size: usize, token: Token, listener: &TcpListener) -> thread::JoinHandle<bool> {
    let address = listener.local_addr().expect("an address");
    thread::spawn(move || {
        let ends = on_ranks(size, 1, |cluster| {
            if cluster.rank() == 0 {
                let stream = TcpStream::connect(address).expect("the server listens");
                // As a rank does: a link that ends aborts the job.
                assert!(lead(&cluster, token, stream, || {}).is_ok(), "the link ended");
                true
            } else {
                follow(&cluster).is_ok()
            }
        });
        ends.into_iter().all(|(end, _)| end)
    })
}

/// Starts so many ranks, and takes over their link.
pub(crate) fn ranks(size: usize) -> (Remote, thread::JoinHandle<bool>) {
    let listener = listener();
    let handle = start(size, TOKEN, &listener);
    (meet(listener, PATIENCE).expect("the ranks"), handle)
}
