//! A server that was used much is as it was before: sessions, streams and cancelled calls leave no thread, no task, no
//! file descriptor and no memory behind. Alone in its process, because it counts what the process has.

#![allow(clippy::print_stdout, reason = "a message where nothing can be counted")]

use std::{fs, time::Duration};

use nappe_proto::v1::{
    self, create_session_request::Scene, simulation_service_client::SimulationServiceClient,
};
use nappe_server::{App, Config};
use tokio::{runtime::Handle, task::JoinSet};
use tonic::transport::Channel;

type Client = SimulationServiceClient<Channel>;

/// Clients that work at a time.
const WORKERS: usize = 8;
/// Whatever takes this long hangs.
const PATIENCE: Duration = Duration::from_mins(1);
/// Memory that a process may have more of after ten times the work (bytes): its allocator's, not the server's.
const SLACK_BYTES: u64 = 16 << 20;

/// What a process has.
#[derive(Clone, Copy, Debug)]
struct Usage {
    threads: usize,
    tasks: usize,
    descriptors: usize,
    resident_bytes: u64,
}

impl Usage {
    /// As of now; none where the system has no `/proc`.
    fn now() -> Option<Self> {
        let count = |folder: &str| fs::read_dir(folder).ok().map(Iterator::count);
        let memory = fs::read_to_string("/proc/self/statm").ok()?;
        let pages: u64 = memory.split_whitespace().nth(1)?.parse().ok()?;
        Some(Self {
            threads: count("/proc/self/task")?,
            tasks: Handle::current().metrics().num_alive_tasks(),
            descriptors: count("/proc/self/fd")?,
            resident_bytes: 4096 * pages,
        })
    }
}

/// Waits until threads, tasks and descriptors are as they were, and the memory but for a slack (bytes). Threads that
/// the runtime made because many blocked at a time end after ten idle seconds.
async fn back_to(before: Usage, slack_bytes: u64, what: &str) {
    let mut now = before;
    for _ in 0..600 {
        now = Usage::now().expect("it could be read before");
        let is_back = now.threads <= before.threads
            && now.tasks <= before.tasks
            && now.descriptors <= before.descriptors
            && now.resident_bytes < before.resident_bytes.saturating_add(slack_bytes);
        if is_back {
            return;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    panic!("{what} left something behind: {before:?} before, {now:?} after");
}

fn scene(root: &str) -> String {
    format!(
        r#"
        version = 1
        title = "dust"
        dt = 0.001
        [[body]]
        name = "dust"
        mesh = {{ grid = [20, 20], spacing = 0.1 }}
        mass = {{ density = 0.2 }}
        {root}
        "#
    )
}

fn create(text: String) -> v1::CreateSessionRequest {
    let scene = Some(Scene::SceneText(text));
    v1::CreateSessionRequest { scene, thread_count: 1, ..v1::CreateSessionRequest::default() }
}

async fn made(client: &mut Client, text: String) -> String {
    let made = client.create_session(create(text)).await.expect("a session").into_inner();
    made.session.expect("the answer has the session").session_id
}

async fn delete(client: &mut Client, id: &str) {
    let request = v1::DeleteSessionRequest { session_id: id.into(), ..v1::DeleteSessionRequest::default() };
    client.delete_session(request).await.expect("deleted");
}

async fn connect(url: &str) -> Client {
    let endpoint = Channel::from_shared(url.to_owned()).expect("a URL").timeout(PATIENCE);
    Client::new(endpoint.connect().await.expect("it answers"))
}

/// Makes and deletes sessions.
async fn sessions(client: &Client, count: usize) {
    let mut workers = JoinSet::new();
    for _ in 0..WORKERS {
        let mut client = client.clone();
        workers.spawn(async move {
            for _ in 0..count / WORKERS {
                let id = made(&mut client, scene("")).await;
                delete(&mut client, &id).await;
            }
        });
    }
    while let Some(done) = workers.join_next().await {
        done.expect("no panic");
    }
}

/// Opens streams and cuts them after their first message. A connection that cuts very many is closed by HTTP/2, so
/// that each carries a hundred.
async fn streams(app: &App, id: &str, count: usize) {
    let mut workers = JoinSet::new();
    for _ in 0..WORKERS {
        let (url, id) = (app.url(), id.to_owned());
        workers.spawn(async move {
            let mut client = connect(&url).await;
            for i in 1..=count / WORKERS {
                if i % 100 == 0 {
                    client = connect(&url).await;
                }
                let request = v1::WatchFramesRequest { session_id: id.clone(), ..Default::default() };
                let mut stream = client.watch_frames(request).await.expect("a stream").into_inner();
                let message = tokio::time::timeout(PATIENCE, stream.message()).await.expect("in time");
                message.expect("no error").expect("a message");
            }
        });
    }
    while let Some(done) = workers.join_next().await {
        done.expect("no panic");
    }
}

/// Calls that wait for a step of minutes, and are cancelled. A connection that cuts more than twenty which the server did
/// not come to is closed by HTTP/2, so that each carries a few.
async fn cancelled_calls(app: &App, id: &str, count: usize) {
    for _ in 0..count / WORKERS {
        let client = connect(&app.url()).await;
        let mut workers = JoinSet::new();
        for _ in 0..WORKERS {
            let (mut client, id) = (client.clone(), id.to_owned());
            workers.spawn(async move {
                let request = v1::StepSessionRequest {
                    session_id: id,
                    step_count: 1,
                    wait: true,
                    ..v1::StepSessionRequest::default()
                };
                let call = tokio::time::timeout(Duration::from_millis(3), client.step_session(request));
                call.await.expect_err("the step takes longer");
            });
        }
        while let Some(done) = workers.join_next().await {
            done.expect("no panic");
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_streams_and_cancelled_calls_leave_nothing_behind() {
    if Usage::now().is_none() {
        println!("skipped: there is no /proc to count with");
        return;
    }
    let address = "127.0.0.1:0".parse().expect("an address");
    // No connection is closed because this process was held up.
    let patient = Config { handshake_seconds: 300.0, request_seconds: 300.0, ..Config::default() };
    let app = App::start(Config { address, no_token: true, ..patient }).expect("it starts");
    let mut client = connect(&app.url()).await;

    // The first use makes threads that stay.
    sessions(&client, 1000).await;
    let before = Usage::now().expect("it could be read before");
    sessions(&client, 9000).await;
    back_to(before, SLACK_BYTES, "10 000 sessions").await;

    let watched = made(&mut client, scene("")).await;
    streams(&app, &watched, 1000).await;
    let before = Usage::now().expect("it could be read before");
    streams(&app, &watched, 9000).await;
    back_to(before, SLACK_BYTES, "10 000 streams").await;
    delete(&mut client, &watched).await;

    let before = Usage::now().expect("it could be read before");
    let slow = "substeps = 10000\n[body.springs]\nstretch = { stiffness = 50 }";
    let slow = scene(slow).replace("[20, 20]", "[150, 150]");
    let slow = made(&mut client, slow).await;
    cancelled_calls(&app, &slow, 1000).await;
    delete(&mut client, &slow).await;
    back_to(before, u64::MAX, "1 000 cancelled calls").await;
    app.shutdown().await;
}
