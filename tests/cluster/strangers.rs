//! Who connects before rank 0, and what comes over a link that is not what was sent.

use std::{
    io::{Read as _, Write as _},
    net::{Shutdown, TcpListener, TcpStream},
    sync::mpsc,
    thread,
    time::{Duration, Instant},
};

use nappe_cluster::{LinkError, Remote, RemoteError, Token, lead};
use nappe_sim::{math::Precision, world::WorldSetup};
use nappe_tests::{
    Scene,
    networks::{sheet, sheet_rules},
    ranks::on_ranks,
};
use xxhash_rust::xxh3::xxh3_64;

use crate::job::{PATIENCE, TOKEN, listener, meet, start};

/// Bytes of a token, and of the head of a message.
const TOKEN_BYTES: usize = size_of::<Token>();
const HEAD_BYTES: usize = 32;

fn setup() -> WorldSetup {
    Scene::new(sheet(5, 0.05, &sheet_rules(200.0, 0.02), 0.01), 5e-3).setup()
}

fn connect(listener: &TcpListener) -> TcpStream {
    TcpStream::connect(listener.local_addr().expect("an address")).expect("the server listens")
}

/// The head of a message of so many bytes, the first of its direction.
fn head(length: u64, message: &[u8]) -> Vec<u8> {
    let mut head: Vec<u8> = [length, 0, xxh3_64(message)].into_iter().flat_map(u64::to_le_bytes).collect();
    head.extend(xxh3_64(&head).to_le_bytes());
    head
}

/// All that a rank 0 without others says before it is told anything.
fn greeting() -> Vec<u8> {
    let listener = listener();
    let address = listener.local_addr().expect("an address");
    let rank = thread::spawn(move || {
        on_ranks(1, 1, |cluster| {
            let stream = TcpStream::connect(address).expect("the server listens");
            lead(&cluster, TOKEN, stream, || {}).is_err()
        })
    });
    let (mut stream, _) = listener.accept().expect("rank 0 connects");
    let mut said = vec![0; TOKEN_BYTES + HEAD_BYTES];
    stream.read_exact(&mut said).expect("token and head");
    let length = said[TOKEN_BYTES..].first_chunk::<8>().map_or(0, |bytes| u64::from_le_bytes(*bytes));
    said.resize(said.len() + length as usize, 0);
    stream.read_exact(&mut said[TOKEN_BYTES + HEAD_BYTES..]).expect("the greeting");
    drop(stream);
    assert!(rank.join().expect("it ends").iter().all(|(is_lost, _)| *is_lost));
    said
}

#[test]
fn rank_0_is_met_while_strangers_say_nothing_little_or_something_wrong() {
    let listener = listener();
    let silent: Vec<_> = (0..10).map(|_| connect(&listener)).collect();
    let mut slow = connect(&listener);
    slow.write_all(&TOKEN[..5]).expect("it is taken");
    let mut wrong = connect(&listener);
    wrong.write_all(&[8; 64]).expect("it is taken");
    let begin = Instant::now();
    let handle = start(2, TOKEN, &listener);
    let remote = meet(listener, PATIENCE).expect("the ranks");
    // One after the other they would take five seconds each.
    assert!(begin.elapsed() < Duration::from_secs(30), "{:?}", begin.elapsed());
    drop((silent, slow, wrong));
    remote.end().expect("the link holds");
    assert!(handle.join().expect("no rank fails"));
}

#[test]
fn ranks_of_another_token_end_and_those_of_the_right_one_are_met() {
    let listener = listener();
    let strangers = start(2, [8; 16], &listener);
    let handle = start(1, TOKEN, &listener);
    let remote = meet(listener, PATIENCE).expect("the ranks");
    remote.end().expect("the link holds");
    assert!(handle.join().expect("no rank fails"));
    assert!(strangers.join().is_err(), "their link ended");
}

#[test]
fn a_greeting_that_comes_byte_by_byte_is_one() {
    let listener = listener();
    let mut stream = connect(&listener);
    stream.set_nodelay(true).expect("it is set");
    let greeting = greeting();
    let handle = thread::spawn(move || {
        for byte in greeting {
            stream.write_all(&[byte]).expect("it is taken");
        }
        stream
    });
    let remote = meet(listener, PATIENCE).expect("rank 0");
    assert_eq!(remote.hello().hosts.len(), 1);
    drop(handle.join());
}

#[test]
fn a_message_that_is_announced_takes_no_memory_and_is_refused_by_its_length() {
    for announced in [1 << 16, 1 << 37, u64::MAX] {
        let listener = listener();
        let mut stream = connect(&listener);
        stream.write_all(&TOKEN).expect("it is taken");
        stream.write_all(&head(announced, &[])).expect("it is taken");
        let refused = meet(listener, PATIENCE).expect_err("no greeting is that long");
        let is_named = matches!(
            refused,
            RemoteError::Link(LinkError::TooLong { length, .. }) if length == announced
        );
        assert!(is_named, "{refused}");
    }
}

#[test]
fn a_greeting_that_was_altered_is_refused() {
    let greeting = greeting();
    for place in [TOKEN_BYTES, TOKEN_BYTES + 9, greeting.len() - 1] {
        let listener = listener();
        let mut altered = greeting.clone();
        altered[place] ^= 4;
        let mut stream = connect(&listener);
        stream.write_all(&altered).expect("it is taken");
        let refused = meet(listener, PATIENCE).expect_err("a bit is another one");
        let is_named = matches!(refused, RemoteError::Link(LinkError::Altered { number: 0 }));
        assert!(is_named, "{refused}");
    }
}

#[test]
fn a_rank_0_that_says_nothing_is_lost_with_the_name_of_its_host() {
    let listener = listener();
    let mut stream = connect(&listener);
    stream.write_all(&greeting()).expect("it is taken");
    let mut remote = meet(listener, Duration::from_millis(50)).expect("rank 0");
    let lost = remote.build(setup(), Precision::F64).expect_err("nobody answers");
    assert!(matches!(&lost, RemoteError::Silent { host, .. } if host == "thread"), "{lost}");
    drop(stream);
}

/// Ranks whose answers go through a proxy, which alters a bit of the first that comes after it is told to.
fn altered() -> (Remote, mpsc::Sender<()>) {
    let (behind, before) = (listener(), listener());
    let handle = start(1, TOKEN, &behind);
    let server = connect(&before);
    let (rank, _) = behind.accept().expect("rank 0 connects");
    let (alter, told) = mpsc::channel();
    let copy = |stream: &TcpStream| stream.try_clone().expect("a copy");
    forward(copy(&server), copy(&rank), |_| {});
    forward(rank, server, move |piece| {
        if let Some(byte) = piece.last_mut()
            && told.try_recv().is_ok()
        {
            *byte ^= 1;
        }
    });
    // Its link ends with this test.
    drop(handle);
    (meet(before, PATIENCE).expect("the ranks"), alter)
}

/// Hands bytes on, in a thread of its own.
fn forward(mut from: TcpStream, mut to: TcpStream, change: impl Fn(&mut [u8]) + Send + 'static) {
    thread::spawn(move || {
        let mut piece = vec![0; 1 << 16];
        while let Ok(count) = from.read(&mut piece) {
            change(&mut piece[..count]);
            if count == 0 || to.write_all(&piece[..count]).is_err() {
                break;
            }
        }
        // Either may be closed already.
        let _ = to.shutdown(Shutdown::Both);
    });
}

#[test]
fn one_altered_bit_of_an_answer_ends_the_link_by_name() {
    let (mut remote, alter) = altered();
    remote.build(setup(), Precision::F64).expect("a sheet");
    remote.step().expect("the link holds").result.expect("it is stable");
    alter.send(()).expect("the proxy runs");
    let lost = remote.step().expect_err("a bit is another one");
    assert!(matches!(lost, RemoteError::Link(LinkError::Altered { .. })), "{lost}");
    assert!(lost.to_string().contains("altered on its way"), "{lost}");
}
