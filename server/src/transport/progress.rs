//! Bytes that a connection has written, by which a drain tells whose peer takes nothing any more.

use std::{
    io,
    pin::Pin,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    task::{Context, Poll},
    time::Duration,
};

use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    time::sleep,
};

use crate::counters::Counters;

/// So many looks in a row see nothing written where a peer takes nothing. Between them calls have their turns to answer,
/// however busy the machine is.
const QUIET_LOOKS: u32 = 8;

/// Bytes that a connection has written.
#[derive(Clone, Debug, Default)]
pub(super) struct Progress {
    written: Arc<AtomicU64>,
    /// Those of all connections are counted too.
    counters: Arc<Counters>,
}

/// A stream whose written bytes are counted.
#[derive(Debug)]
pub(super) struct Counted<S> {
    stream: S,
    progress: Progress,
}

impl Progress {
    /// Of a new connection of a server that counts in `counters`.
    pub(super) fn new(counters: &Arc<Counters>) -> Self {
        Self { written: Arc::default(), counters: Arc::clone(counters) }
    }

    /// A stream that is counted here.
    pub(super) fn counted<S>(&self, stream: S) -> Counted<S> {
        Counted { stream, progress: self.clone() }
    }

    /// Waits until nothing was written for `time`.
    pub(super) async fn stalled(&self, time: Duration) {
        let (mut before, mut looks) = (self.written(), 0);
        while looks < QUIET_LOOKS {
            sleep(time / QUIET_LOOKS).await;
            let now = self.written();
            looks = if now == before { looks + 1 } else { 0 };
            before = now;
        }
    }

    fn written(&self) -> u64 {
        self.written.load(Ordering::Relaxed)
    }

    fn note(&self, written: &Poll<io::Result<usize>>) {
        if let Poll::Ready(Ok(bytes)) = written {
            self.written.fetch_add(*bytes as u64, Ordering::Relaxed);
            self.counters.sent_bytes.add(*bytes as u64);
        }
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Counted<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Counted<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.progress.note(&written);
        written
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        pieces: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write_vectored(context, pieces);
        self.progress.note(&written);
        written
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use tokio::{
        io::{AsyncReadExt as _, AsyncWriteExt as _},
        time::timeout,
    };

    use super::*;

    const SHORT: Duration = Duration::from_millis(80);

    #[tokio::test]
    async fn a_connection_that_writes_nothing_is_stalled_and_one_that_writes_is_not() {
        let (near, mut far) = tokio::io::duplex(1000);
        let progress = Progress::default();
        let mut near = progress.counted(near);
        near.write_all(&[1; 700]).await.expect("written");
        assert_eq!(progress.written(), 700);

        // Each look sees something new, however long it takes.
        let writing = async {
            let mut seen = 0;
            loop {
                near.write_all(&[2; 10]).await.expect("written");
                near.flush().await.expect("flushed");
                seen += far.read(&mut [0; 100]).await.expect("read");
                sleep(SHORT / 80).await;
                if seen > 1500 {
                    return;
                }
            }
        };
        tokio::select! {
            biased;
            () = writing => {}
            () = progress.stalled(SHORT) => panic!("it writes"),
        }

        let patience = Duration::from_mins(1);
        timeout(patience, progress.stalled(SHORT)).await.expect("nothing is written any more");
        // More than there is room for: what the peer does not take counts only as far as it went.
        let before = progress.written();
        timeout(SHORT, near.write_all(&[3; 5000])).await.expect_err("nobody takes it");
        assert!(progress.written() - before <= 1000, "{}", progress.written());
    }
}
