//! Ranks that hang, and links that are altered: a session, its place and its launcher are got rid of all the same.
//!
//! The launcher is a script that writes down the link which it was given. Threads of this process are then the ranks, behind a
//! connection that the test can hold up or alter.

use std::{
    fs,
    io::{Read as _, Write as _},
    net::{Shutdown, TcpListener, TcpStream},
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU32, Ordering},
    },
    thread,
    time::Duration,
};

use nappe_cluster::{Link, follow, lead};
use nappe_proto::v1::{self, SessionState, create_session_request::Scene};
use nappe_server::{Config, Limits, RankSettings, Reason};
use nappe_tests::ranks::on_ranks;
use tonic::Status;

use crate::{
    cloth_scenes::sheet,
    frames::in_time,
    harness::{Server, assert_reason, config, connect, request},
};

/// What the launcher does: its number and the link are in one file, whole from the start.
const LAUNCHER: &str = r#"printf '%s %s' "$$" "$NAPPE_LINK" > "$0.part" && mv "$0.part" "$0.link"
exec sleep 600
"#;

/// What the folders of a job are called.
const FOLDER: &str = "nappe-ranks-";

/// What happens to the answers of a rank.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    Nothing,
    /// None comes through.
    Held,
    /// The next has one bit that is another one.
    Altered,
}

/// A launcher, and the ranks that it does not start.
pub(crate) struct StandIn {
    script: PathBuf,
    fault: Arc<Mutex<Fault>>,
    /// How many ranks there are, whatever is asked for.
    ranks: usize,
}

impl StandIn {
    fn new() -> Self {
        Self::of(1)
    }

    /// A job of so many ranks.
    pub(crate) fn of(ranks: usize) -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("launcher-{}-{number}.sh", std::process::id());
        let script = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        fs::write(&script, LAUNCHER).expect("the script is written");
        Self { script, fault: Arc::new(Mutex::new(Fault::Nothing)), ranks }
    }

    /// A server that starts it, and has room for one session. Nothing is lost for being silent.
    async fn server(&self) -> Server {
        self.server_of(1).await
    }

    /// The same with room for so many.
    pub(crate) async fn server_of(&self, max_sessions: u32) -> Server {
        let ranks = RankSettings {
            rank_program: Some(self.script.clone()),
            launcher: format!("sh {} {{ranks}} {{program}}", self.script.display()),
            rank_silence: 3600,
            ..RankSettings::default()
        };
        let limits = Limits { max_sessions, max_ranks: Some(2), ..Limits::default() };
        Server::configured(Config { ranks, limits, ..config() }).await
    }

    /// Creates a session, whose rank joins it: its id, and the number of the launcher.
    async fn create(&self, server: &Server, rank_count: u32) -> Result<(String, u32), Status> {
        let (made, launcher) = self.make(server, sheet(5), rank_count).await?;
        Ok((made.session.expect("the answer has the session").session_id, launcher))
    }

    /// The same of a scene's text: the whole answer, and the number of the launcher.
    pub(crate) async fn make(
        &self,
        server: &Server,
        text: String,
        rank_count: u32,
    ) -> Result<(v1::CreateSessionResponse, u32), Status> {
        let mut client = connect(&server.app).await;
        let scene = Some(Scene::SceneText(text));
        let create = client.create_session(v1::CreateSessionRequest { scene, rank_count, ..request() });
        let (made, launcher) = tokio::join!(create, self.join());
        Ok((made?.into_inner(), launcher))
    }

    /// Reads what the launcher wrote, and has ranks join that job; the number of the launcher.
    async fn join(&self) -> u32 {
        let path = self.script.with_extension("sh.link");
        let written = async {
            loop {
                if let Ok(text) = fs::read_to_string(&path) {
                    return text;
                }
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        let written = in_time(written).await;
        let (number, link) = written.split_once(' ').expect("two words");
        let link = Link::read(link).expect("a link");
        run_ranks(self.ranks, &link, &self.fault);
        number.parse().expect("a number")
    }

    fn set(&self, fault: Fault) {
        *self.fault.lock().unwrap_or_else(PoisonError::into_inner) = fault;
    }
}

impl Drop for StandIn {
    fn drop(&mut self) {
        for path in [self.script.clone(), self.script.with_extension("sh.link")] {
            // The launcher may not have run.
            let _ = fs::remove_file(path);
        }
    }
}

/// Starts ranks in threads of their own, the first behind a proxy.
fn run_ranks(count: usize, link: &Link, fault: &Arc<Mutex<Fault>>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let (address, token) = (listener.local_addr().expect("an address"), link.token);
    thread::spawn(move || {
        on_ranks(count, 1, |cluster| {
            // How it ends is what the tests are about.
            if cluster.rank() == 0 {
                let stream = TcpStream::connect(address).expect("the proxy listens");
                drop(lead(&cluster, token, stream, || {}));
            } else {
                drop(follow(&cluster));
            }
        });
    });
    let (rank, _) = listener.accept().expect("the rank connects");
    let server = TcpStream::connect(&link.address).expect("the server listens");
    let copy = |stream: &TcpStream| stream.try_clone().expect("a copy");
    forward(copy(&server), copy(&rank), Arc::new(Mutex::new(Fault::Nothing)));
    forward(rank, server, Arc::clone(fault));
}

/// Hands bytes on, in a thread of its own.
fn forward(mut from: TcpStream, mut to: TcpStream, fault: Arc<Mutex<Fault>>) {
    thread::spawn(move || {
        let mut piece = vec![0; 1 << 16];
        while let Ok(count @ 1..) = from.read(&mut piece) {
            let mut fault = fault.lock().unwrap_or_else(PoisonError::into_inner);
            match *fault {
                Fault::Held => continue,
                Fault::Altered => {
                    piece[count - 1] ^= 16;
                    *fault = Fault::Nothing;
                }
                Fault::Nothing => {}
            }
            drop(fault);
            if to.write_all(&piece[..count]).is_err() {
                break;
            }
        }
        // Either may be closed already.
        let _ = to.shutdown(Shutdown::Both);
    });
}

fn is_there(process: u32) -> bool {
    Path::new("/proc").join(process.to_string()).exists()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_whose_rank_hangs_is_deleted_and_its_place_is_free() {
    let stand_in = StandIn::new();
    let mut server = stand_in.server().await;
    for is_playing in [true, false] {
        let (id, launcher) = stand_in.create(&server, 1).await.expect("a session");
        assert!(is_there(launcher));
        if is_playing {
            server.play(&id).await;
            server.until(&id, |session| session.step > 3).await;
        }
        stand_in.set(Fault::Held);
        let mut client = connect(&server.app).await;
        let pause = v1::PauseSessionRequest { session_id: id.clone(), wait: true, ..Default::default() };
        let paused = tokio::spawn(async move { client.pause_session(pause).await });
        in_time(server.client.delete_session(v1::DeleteSessionRequest::of(&id)))
            .await
            .expect("it is deleted");
        assert!(!is_there(launcher), "the launcher is ended before the call is answered");
        // One that is paused already is answered at once.
        let paused = in_time(paused).await.expect("the call is answered");
        assert!(!is_playing || paused.is_err(), "{paused:?}");

        let next = server.session(sheet(5)).await;
        server.client.delete_session(v1::DeleteSessionRequest::of(&next)).await.expect("it is deleted");
        stand_in.set(Fault::Nothing);
        fs::remove_file(stand_in.script.with_extension("sh.link")).expect("it was written");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_whose_rank_hangs_is_stopped_and_says_that_a_rank_is_lost() {
    let stand_in = StandIn::new();
    let mut server = stand_in.server().await;
    let (id, launcher) = stand_in.create(&server, 1).await.expect("a session");
    server.play(&id).await;
    server.until(&id, |session| session.step > 3).await;
    stand_in.set(Fault::Held);
    let stop = in_time(server.client.stop_session(v1::StopSessionRequest::of(&id))).await;
    assert_reason(&stop.expect_err("its rank does not answer"), Reason::RankLost);
    let session = server.until(&id, |session| session.state() == SessionState::Failed).await;
    let failure = session.failure.expect("a failed session says why");
    assert_eq!(failure.reason, Reason::RankLost.name());
    assert!(failure.message.contains("the ranks on thread did not give up"), "{}", failure.message);
    in_time(server.client.delete_session(v1::DeleteSessionRequest::of(&id))).await.expect("it is deleted");
    assert!(!is_there(launcher));
}

/// The folders that a launcher is told to keep its files in.
fn folders(launcher: u32) -> Vec<PathBuf> {
    let environment = fs::read(format!("/proc/{launcher}/environ")).expect("it runs");
    let environment = String::from_utf8_lossy(&environment);
    let values =
        environment.split('\0').filter_map(|variable| Some(PathBuf::from(variable.split_once('=')?.1)));
    let is_own =
        |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(FOLDER));
    values.filter(is_own).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_folders_of_a_job_are_gone_with_its_session_whatever_is_left_in_them() {
    let stand_in = StandIn::new();
    let mut server = stand_in.server().await;
    for fault in [Fault::Nothing, Fault::Altered] {
        let (id, launcher) = stand_in.create(&server, 1).await.expect("a session");
        let folders = folders(launcher);
        assert!(!folders.is_empty(), "the launcher is told of none");
        for folder in &folders {
            fs::create_dir_all(folder.join("session")).expect("a folder is made");
            fs::write(folder.join("session/segment"), "memory").expect("a file is written");
        }
        if fault == Fault::Altered {
            server.play(&id).await;
            stand_in.set(fault);
            server.until(&id, |session| session.state() == SessionState::Failed).await;
        }
        in_time(server.client.delete_session(v1::DeleteSessionRequest::of(&id)))
            .await
            .expect("it is deleted");
        assert!(!folders.iter().any(|folder| folder.exists()), "after {fault:?}: {folders:?}");
        stand_in.set(Fault::Nothing);
        fs::remove_file(stand_in.script.with_extension("sh.link")).expect("it was written");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn one_altered_bit_of_the_link_ends_the_session_by_name() {
    let stand_in = StandIn::new();
    let mut server = stand_in.server().await;
    let (id, _) = stand_in.create(&server, 1).await.expect("a session");
    server.play(&id).await;
    server.until(&id, |session| session.step > 3).await;
    stand_in.set(Fault::Altered);
    let session = server.until(&id, |session| session.state() == SessionState::Failed).await;
    let failure = session.failure.expect("a failed session says why");
    assert_eq!(failure.reason, Reason::RankLost.name());
    assert!(failure.message.contains("altered on its way"), "{}", failure.message);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_launcher_that_starts_single_processes_is_told_so() {
    let stand_in = StandIn::new();
    let server = stand_in.server().await;
    let refused = stand_in.create(&server, 2).await.expect_err("one rank where two were asked for");
    assert_reason(&refused, Reason::RanksNotStarted);
    assert!(refused.message().contains("a job of 1 instead of 2"), "{}", refused.message());
}
