//! A built program that keeps its sessions in a folder, and a client of it.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    process::{self, Child, Command, Stdio},
    sync::atomic::{AtomicU32, Ordering},
    time::Duration,
};

use nappe_proto::v1::{
    self, create_session_request::Scene, simulation_service_client::SimulationServiceClient,
    watch_frames_response::Event,
};
use tonic::transport::Channel;

use crate::support::first_line;

/// Whatever takes this long hangs.
const PATIENCE: Duration = Duration::from_mins(2);

/// Servers of this test so far: each has a file of its own for its log.
static STARTED: AtomicU32 = AtomicU32::new(0);

/// A sheet in air that two corners hold, and a ball of snow, above a floor.
pub(crate) fn scene() -> String {
    r#"
version = 1
dt = 0.005
wind = [2, 0, 1]

[[body]]
name = "sheet"
mesh = { grid = [6, 5], spacing = 0.05, plane = "upright" }
mass = { density = 0.3 }
pins = [0, 5]
air = { lift = 1.0 }

[body.springs]
stretch = { stiffness = 100, damping = 0.02 }
shear = { stiffness = 30, damping = 0.01 }
bend = { stiffness = 0.1, damping = 0.001 }

[snow]
cell = 0.06

[[snow.object]]
name = "ball"
sphere = { center = [2, 0.2, 0], radius = 0.1 }
velocity = [1, -1, 0]
seed = 1

[[collider]]
name = "floor"
plane = { point = [0, -3, 0], normal = [0, 1, 0] }
friction = 0.8
"#
    .to_owned()
}

/// A path of this test that is not there.
pub(crate) fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-kept-{name}", process::id()));
    let _ = fs::remove_dir_all(&path);
    path
}

/// The outcome of what must not take long.
pub(crate) async fn in_time<T>(future: impl Future<Output = T>) -> T {
    tokio::time::timeout(PATIENCE, future).await.expect("it is done in time")
}

/// A request for a session that never ends by itself.
pub(crate) fn request(id: &str, precision: v1::Precision) -> v1::CreateSessionRequest {
    v1::CreateSessionRequest {
        session_id: id.into(),
        scene: Some(Scene::SceneText(scene())),
        precision: precision.into(),
        thread_count: 1,
        step_limit: Some(0),
        frame_interval_steps: 2,
        ..v1::CreateSessionRequest::default()
    }
}

/// The program, ended with the test.
pub(crate) struct Server {
    process: Child,
    log_file: PathBuf,
    pub(crate) client: SimulationServiceClient<Channel>,
}

impl Server {
    /// Starts it, with a folder for its sessions or without one.
    pub(crate) async fn start(folder: Option<&Path>, options: &[&str]) -> Self {
        let number = STARTED.fetch_add(1, Ordering::Relaxed);
        let temporary = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let log_file = temporary.join(format!("{}-kept-{number}.log", process::id()));
        let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
        command.args(["--address", "127.0.0.1:0", "--drain-seconds", "300"]).args(options);
        if let Some(folder) = folder {
            command.arg("--state-dir").arg(folder);
        }
        command.env("XDG_RUNTIME_DIR", temporary).stdout(Stdio::piped());
        command.stderr(File::create(&log_file).expect("made"));
        let mut process = command.spawn().expect("it starts");
        let line = first_line(process.stdout.take().expect("its output"));
        let url = format!("http://{}", line.trim().rsplit_once("http://").expect("an address").1);
        // Who connects waits until its sessions are there.
        let client = in_time(SimulationServiceClient::connect(url)).await.expect("connected");
        Self { process, log_file, client }
    }

    /// Kills it, as `kill -9` does; what it logged.
    pub(crate) fn kill(mut self) -> String {
        self.process.kill().expect("it is there");
        self.process.wait().expect("it ends");
        fs::read_to_string(&self.log_file).expect("a text")
    }

    /// Asks it to end, and waits until it has ended.
    pub(crate) fn end(mut self) {
        let sent = Command::new("kill").args(["-TERM", &self.process.id().to_string()]).status();
        assert!(sent.expect("kill runs").success());
        assert!(self.process.wait().expect("it ends").success());
    }

    /// Makes a session.
    pub(crate) async fn create(&mut self, id: &str, precision: v1::Precision) -> v1::Session {
        let made = in_time(self.client.create_session(request(id, precision))).await.expect("made");
        made.into_inner().session.expect("the answer has the session")
    }

    /// Takes steps and returns the session after them.
    pub(crate) async fn step(&mut self, id: &str, step_count: u64) -> v1::Session {
        let request = v1::StepSessionRequest { step_count, wait: true, ..v1::StepSessionRequest::of(id) };
        let stepped = in_time(self.client.step_session(request)).await.expect("the steps are taken");
        stepped.into_inner().session.expect("the answer has the session")
    }

    /// Puts the session back to its start.
    pub(crate) async fn reset(&mut self, id: &str) {
        in_time(self.client.reset_session(v1::ResetSessionRequest::of(id))).await.expect("reset");
    }

    /// Deletes the session.
    pub(crate) async fn delete(&mut self, id: &str) {
        in_time(self.client.delete_session(v1::DeleteSessionRequest::of(id))).await.expect("deleted");
    }

    /// The session as it is.
    pub(crate) async fn get(&mut self, id: &str) -> v1::Session {
        let got = in_time(self.client.get_session(v1::GetSessionRequest::of(id))).await;
        got.expect("the session is there").into_inner().session.expect("the answer has the session")
    }

    /// Waits until the session is as wanted.
    pub(crate) async fn until(&mut self, id: &str, wanted: impl Fn(&v1::Session) -> bool) -> v1::Session {
        let waiting = async {
            loop {
                let session = self.get(id).await;
                if wanted(&session) {
                    return session;
                }
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        in_time(waiting).await
    }

    /// The calls whose changes wait.
    pub(crate) async fn pending(&mut self, id: &str) -> Vec<u64> {
        let listed = self.client.list_pending_changes(v1::ListPendingChangesRequest::of(id)).await;
        let changes = listed.expect("a page").into_inner().changes;
        changes.iter().map(|change| change.accepted.map_or(0, |accepted| accepted.order)).collect()
    }

    /// The ids of the sessions.
    pub(crate) async fn list(&mut self) -> Vec<String> {
        let listed = self.client.list_sessions(v1::ListSessionsRequest::default()).await;
        let sessions = listed.expect("a page").into_inner().sessions;
        sessions.into_iter().map(|session| session.session_id).collect()
    }

    /// The number of the frame that a new watcher of the newest frames sees first.
    pub(crate) async fn newest_frame(&mut self, id: &str) -> u64 {
        let watch = self.client.watch_frames(v1::WatchFramesRequest::of(id)).await;
        let mut stream = watch.expect("the stream opens").into_inner();
        loop {
            let message = in_time(stream.message()).await.expect("it goes on").expect("a message");
            if let Some(Event::Frame(frame)) = message.event {
                return frame.frame;
            }
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
        let _ = fs::remove_file(&self.log_file);
    }
}
