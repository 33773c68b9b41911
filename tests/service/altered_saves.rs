//! Files of sessions that were cut, altered or forged: they are refused by the section, before anything is built of them.

use nappe_proto::v1;
use nappe_server::{
    Limits, Reason,
    state::{Opened, SavedSession, Section, read, write},
};
use nappe_sim::world::Change;
use tonic::{Code, Status};
use tonic_types::StatusExt as _;
use xxhash_rust::xxh3::xxh3_64;

use crate::{
    cloth_scenes::{sheet, sheet_with},
    harness::{Server, assert_reason},
    saved_sessions::{create, save, session, upload},
    snow_scenes::ball,
};

/// Bytes before the table of a file, of a row of it, and before the first section.
const HEAD: usize = 64;
const ROW: usize = 28;
const FRONT: usize = HEAD + ROW * Section::ALL.len() + 8;

/// Files that are altered at random.
const COUNT: usize = if cfg!(feature = "slow") { 100_000 } else { 1_000 };

/// A file of a session of a scene after some steps, and what is in it.
async fn saved(scene: String) -> (Vec<u8>, SavedSession) {
    let mut server = Server::start().await;
    let id = server.session(scene).await;
    server.step(&id, 7).await;
    let drag =
        v1::UpdateParametersRequest { at_step: 20, drag: Some(0.01), ..v1::UpdateParametersRequest::of(&id) };
    server.client.update_parameters(drag).await.expect("accepted");
    let file = save(&mut server, &id).await.expect("it is saved");
    let opened = Opened::of(&file).expect("a good file");
    let saved = read(&opened).expect("good sections");
    (file, saved)
}

/// The bytes of a section.
fn section(file: &[u8], section: Section) -> &[u8] {
    Opened::of(file).expect("a good file").section(section)
}

/// Where a section begins in a file.
fn place(file: &[u8], section: Section) -> usize {
    let row = HEAD + ROW * section as usize;
    u64::from_le_bytes(*file[row + 4..].first_chunk().expect("a row")) as usize
}

/// The file with other bytes in a section, all hashes made anew.
fn with(file: &[u8], changed: Section, at: usize, bytes: &[u8]) -> Vec<u8> {
    let (begin, length) = (place(file, changed), section(file, changed).len());
    let mut file = file.to_vec();
    file[begin + at..begin + at + bytes.len()].copy_from_slice(bytes);
    let hash = xxh3_64(&file[begin..begin + length]);
    let row = HEAD + ROW * changed as usize;
    file[row + 20..row + 28].copy_from_slice(&hash.to_le_bytes());
    sealed(file)
}

fn sealed(mut file: Vec<u8>) -> Vec<u8> {
    let hash = xxh3_64(&file[..FRONT - 8]);
    file[FRONT - 8..FRONT].copy_from_slice(&hash.to_le_bytes());
    file
}

#[tokio::test(flavor = "multi_thread")]
async fn files_that_were_cut_or_altered_are_refused_by_the_section() {
    let (file, _) = saved(sheet_with(4, "") + &ball("")).await;
    let mut server = Server::start().await;
    for part in Section::ALL {
        let (begin, length) = (place(&file, part), section(&file, part).len());
        let mut flipped = file.clone();
        flipped[begin + length / 2] ^= 1;
        let refused = upload(&mut server, &flipped).await.expect_err("it was altered");
        assert_eq!(assert_reason(&refused, Reason::InvalidCheckpoint)["section"], part.name());
        // A length that no file has.
        let mut forged = file.clone();
        let row = HEAD + ROW * part as usize;
        forged[row + 12..row + 20].copy_from_slice(&(1_u64 << 60).to_le_bytes());
        let refused = upload(&mut server, &sealed(forged)).await.expect_err("it is forged");
        assert_eq!(assert_reason(&refused, Reason::InvalidCheckpoint)["section"], part.name());
        let refused = upload(&mut server, &file[..begin]).await.expect_err("it was cut");
        assert_reason(&refused, Reason::InvalidCheckpoint);
    }
    let mut newer = file.clone();
    newer[8..12].copy_from_slice(&99_u32.to_le_bytes());
    let refused = upload(&mut server, &sealed(newer)).await.expect_err("another format");
    assert_reason(&refused, Reason::InvalidCheckpoint);
    assert!(refused.message().contains("format 99"), "{refused:?}");

    // A list of 2^60 keys of the wind, after the time step, gravity and the wind.
    let endless = [0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x10];
    let forged = with(&file, Section::Setup, 56, &endless);
    let refused = create(&mut server, &forged, "").await.expect_err("a list without an end");
    assert_eq!(assert_reason(&refused, Reason::InvalidCheckpoint)["section"], "setup");
    session(create(&mut server, &file, "good").await.expect("it goes on"));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_no_session_says_is_refused_by_the_section() {
    type Spoil = fn(&mut SavedSession);
    let spoiled: [(Spoil, Section); 8] = [
        (|s| s.session.session.as_mut().expect("one").particle_count += 1, Section::Session),
        (|s| s.setup.bodies[0].network.springs[0].particles[0] = u32::MAX, Section::Setup),
        (|s| s.setup.bodies[0].network.x[0][0] = f64::NAN, Section::Setup),
        (|s| s.initial.push(Change::Drag(f64::NAN)), Section::Initial),
        (|s| s.pending.groups[0].step = 0, Section::Pending),
        (|s| s.pending.last_order = u64::MAX, Section::Pending),
        (|s| s.frame.frame = u64::MAX, Section::Frame),
        (|s| s.state_hash += 1, Section::Hash),
    ];
    let (_, good) = saved(sheet(5)).await;
    let (_, other) = saved(sheet(6)).await;
    let mut server = Server::start().await;
    for (spoil, part) in spoiled {
        let mut saved = good.clone();
        spoil(&mut saved);
        let file = write(&saved).expect("it can be written");
        let refused = create(&mut server, &file, "").await.expect_err("it is spoiled");
        assert_eq!(assert_reason(&refused, Reason::InvalidCheckpoint)["section"], part.name(), "{refused:?}");
    }
    let mixed = SavedSession { state: other.state, ..good.clone() };
    let file = write(&mixed).expect("it can be written");
    let refused = create(&mut server, &file, "").await.expect_err("the state of another setup");
    assert_eq!(assert_reason(&refused, Reason::InvalidCheckpoint)["section"], "state");

    // Names that no collider and no stage has would be told to everybody who lists sessions.
    let mut told = good.clone();
    let session = told.session.session.as_mut().expect("one");
    let stage = v1::StageTime { stage: "x".repeat(1 << 20), seconds: 1.0 };
    session.diagnostics.as_mut().expect("some").stages = vec![stage];
    let refused = create(&mut server, &write(&told).expect("it can be written"), "").await;
    let refused = refused.expect_err("no stage is called so");
    assert_eq!(assert_reason(&refused, Reason::InvalidCheckpoint)["section"], "session");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_counts_of_a_file_are_held_against_the_limits_before_anything_is_built() {
    let (file, good) = saved(sheet(5)).await;
    let mut small = Server::with(Limits { max_particles: 24, ..Limits::default() }).await;
    let refused = create(&mut small, &file, "").await.expect_err("25 particles");
    assert_eq!(assert_reason(&refused, Reason::SceneTooLarge)["value"], "25");
    let mut small = Server::with(Limits { max_springs: 1, ..Limits::default() }).await;
    let refused = create(&mut small, &file, "").await.expect_err("more springs");
    assert_reason(&refused, Reason::SceneTooLarge);
    let mut small = Server::start().await;
    let mut long = good.clone();
    long.session.session.as_mut().expect("one").title = "x".repeat(2 << 20);
    let long = write(&long).expect("it can be written");
    let refused = create(&mut small, &long, "").await.expect_err("a title like a book");
    assert_reason(&refused, Reason::SceneTooLarge);
    let mut small = Server::with(Limits { max_pending_changes: 0, ..Limits::default() }).await;
    let refused = create(&mut small, &file, "").await.expect_err("a change waits");
    assert_reason(&refused, Reason::TooManyChanges);
    let mut small = Server::with(Limits { max_mesh_bytes: 1000, ..Limits::default() }).await;
    let refused = create(&mut small, &file, "").await.expect_err("a larger file");
    assert_reason(&refused, Reason::MeshTooLarge);

    // Many particles that nothing else fits: their memory is asked for first.
    let mut large = good;
    let network = &mut large.setup.bodies[0].network;
    network.x = vec![[0.0; 3]; 100_000];
    network.v = network.x.clone();
    network.masses = vec![1.0; 100_000];
    let large = write(&large).expect("it can be written");
    let limits = Limits { history_bytes_per_session: 0, max_server_bytes: 32 << 20, ..Limits::default() };
    let mut small = Server::with(limits).await;
    let refused = create(&mut small, &large, "").await.expect_err("it is too large");
    assert_reason(&refused, Reason::ServerMemoryFull);
    // What was refused took nothing.
    let id = small.session(sheet(4)).await;
    assert_eq!(small.step(&id, 2).await.step, 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_of_other_bits_goes_on_with_a_warning() {
    let (file, saved) = saved(sheet(5)).await;
    let mut other = file;
    other[24] ^= 1;
    let mut server = Server::start().await;
    let answer = create(&mut server, &sealed(other), "other").await.expect("it goes on");
    let told = answer.warnings.iter().filter(|warning| warning.contains("other bits"));
    assert_eq!(told.count(), 1, "{:?}", answer.warnings);
    assert_eq!(answer.session.expect("the session").state_hash, Some(saved.state_hash));
}

/// A refusal has a reason, and is none of a server that broke.
fn assert_refused(refused: &Status, what: &str) {
    let reason = refused.get_details_error_info().map(|info| info.reason);
    assert!(reason.is_some_and(|reason| !reason.is_empty()), "{what}: {refused:?}");
    assert_ne!(refused.code(), Code::Internal, "{what}: {refused:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn files_altered_at_random_are_refused_or_go_on_and_break_no_server() {
    let (file, _) = saved(sheet_with(4, "") + &ball("")).await;
    let limits =
        Limits { history_bytes_per_session: 1 << 20, max_server_bytes: 256 << 20, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let mut random = fastrand::Rng::with_seed(1);
    for number in 0..COUNT {
        let part = Section::ALL[random.usize(..Section::ALL.len())];
        let (begin, length) = (place(&file, part), section(&file, part).len());
        if length == 0 {
            continue;
        }
        let mut altered = file.clone();
        for _ in 0..random.usize(1..4) {
            altered[begin + random.usize(..length)] = random.u8(..);
        }
        let what = format!("file {number}, altered in the section {}", part.name());
        // One that is altered by chance has a wrong hash; one that somebody forged has the right one.
        if random.bool() {
            match upload(&mut server, &altered).await {
                Ok(_) => assert!(altered == file, "{what}"),
                Err(refused) => {
                    assert_eq!(assert_reason(&refused, Reason::InvalidCheckpoint)["section"], part.name());
                }
            }
            continue;
        }
        let forged = with(&file, part, 0, &altered[begin..begin + length]);
        match create(&mut server, &forged, "").await {
            Ok(answer) => {
                let delete = v1::DeleteSessionRequest::of(&session(answer).session_id);
                server.client.delete_session(delete).await.expect("it is deleted");
            }
            Err(refused) => assert_refused(&refused, &what),
        }
    }
    // The server is as it was.
    session(create(&mut server, &file, "good").await.expect("it goes on"));
    assert_eq!(server.step("good", 2).await.step, 9);
}
