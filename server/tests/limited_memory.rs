//! The program under a limit on its memory: sessions that do not fit are refused, and nothing else happens.
#![cfg(target_os = "linux")]

mod support;

use std::{
    process::{Child, Command, Stdio},
    time::Duration,
};

use nappe_proto::v1::{
    self, create_session_request::Scene, simulation_service_client::SimulationServiceClient,
};
use nappe_server::Reason;
use support::first_line;
use tonic::{Status, transport::Channel};
use tonic_types::StatusExt as _;

/// Whatever takes this long hangs.
const PATIENCE: Duration = Duration::from_mins(2);
/// Address space of the program (kilobytes).
const KILOBYTES: u64 = 2_500_000;
/// Sessions that are asked for: together they need several times as much.
const SESSIONS: usize = 12;

/// A program that ends with the test.
struct Program(Child);

impl Drop for Program {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts the program with its limit and with settings; gives its URL.
fn start(settings: &[(&str, &str)]) -> (Program, String) {
    let script = format!("ulimit -v {KILOBYTES}; exec \"$0\" --no-token --address 127.0.0.1:0");
    let mut command = Command::new("sh");
    command.arg("-c").arg(script).arg(env!("CARGO_BIN_EXE_nappe-server"));
    command.envs(settings.iter().copied()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut program = Program(command.spawn().expect("a shell"));
    let line = first_line(program.0.stdout.take().expect("it is piped"));
    let url = line.split_whitespace().last().expect("the line ends with the URL").to_owned();
    (program, url)
}

/// A scene of 250 000 particles and 1.5 million springs.
fn request() -> v1::CreateSessionRequest {
    let law = "{ stiffness = 100.0 }";
    let text = format!(
        "version = 1\ndt = 1e-3\nprecision = \"f64\"\n[[body]]\nname = \"b\"\n\
         mesh = {{ grid = [500, 500], spacing = 0.01 }}\nmass = {{ particle = 0.01 }}\n\
         springs = {{ stretch = {law}, shear = {law}, bend = {law} }}\n"
    );
    v1::CreateSessionRequest {
        scene: Some(Scene::SceneText(text)),
        thread_count: 1,
        ..v1::CreateSessionRequest::default()
    }
}

fn reason(status: &Status) -> String {
    status.get_details_error_info().map_or_else(|| format!("{status:?}"), |info| info.reason)
}

/// Asks for sessions until they no longer fit; gives the ids of those that do.
async fn fill(client: &mut SimulationServiceClient<Channel>) -> Vec<String> {
    let mut ids = Vec::new();
    for _ in 0..SESSIONS {
        match client.create_session(request()).await {
            Ok(made) => ids.push(made.into_inner().session.expect("the answer has it").session_id),
            Err(status) => assert_eq!(reason(&status), Reason::ServerMemoryFull.name(), "{status:?}"),
        }
    }
    assert!(!ids.is_empty() && ids.len() < SESSIONS, "{} of {SESSIONS} fit", ids.len());
    ids
}

async fn check(settings: &[(&str, &str)]) {
    let (_program, url) = start(settings);
    let endpoint = Channel::from_shared(url).expect("a URL").timeout(PATIENCE);
    let channel = endpoint.connect().await.expect("it answers");
    let mut client = SimulationServiceClient::new(channel);
    let ids = fill(&mut client).await;

    // Those that are there go on, and whoever leaves makes room.
    for id in &ids {
        let step = v1::StepSessionRequest { step_count: 1, wait: true, ..v1::StepSessionRequest::of(id) };
        client.step_session(step).await.expect("a step is taken");
    }
    for id in &ids {
        client.delete_session(v1::DeleteSessionRequest::of(id)).await.expect("deleted");
    }
    client.create_session(request()).await.expect("there is room again");
    client.get_server_info(v1::GetServerInfoRequest {}).await.expect("it answers");
}

fn block_on(work: impl Future<Output = ()>) {
    tokio::runtime::Runtime::new().expect("a runtime").block_on(work);
}

#[test]
fn the_limit_of_the_process_is_respected_by_default() {
    block_on(check(&[("NAPPE_HISTORY_BYTES", "1000000")]));
}

#[test]
fn where_the_setting_promises_more_than_there_is_the_session_that_asks_is_refused() {
    block_on(check(&[("NAPPE_HISTORY_BYTES", "1000000"), ("NAPPE_MAX_SERVER_BYTES", "1000000000000")]));
}
