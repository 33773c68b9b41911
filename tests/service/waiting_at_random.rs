//! Three clients ask one session for steps, pauses, plays and its end at random: every call that waits is answered, and
//! as the model allows.

use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use nappe_proto::v1::{self, SessionState, create_session_request::Scene};
use nappe_server::{Limits, Reason};
use tokio::task::{JoinHandle, JoinSet};
use tonic::Status;
use tonic_types::StatusExt as _;

use crate::{
    cloth_scenes::dust,
    harness::{Client, Server, connect, request},
    waiting_calls::{SLOW, divided},
    waiting_model::{Answered, Call, History, Shown},
};

/// A call that takes this long hangs: the next step of a slow play is hours away.
const HANGS: Duration = Duration::from_secs(20);
/// Sequences of calls.
const COUNT: u64 = if cfg!(feature = "slow") { 10_000 } else { 500 };
/// Sequences at a time, each with a session of its own.
const WORKERS: u64 = 4;
/// One sequence in so many has steps of milliseconds, so that calls come while one is in progress; those of the others
/// are over before the next call comes.
const RARE: u32 = 8;

/// What all clients of a sequence share.
#[derive(Debug, Default)]
struct Shared {
    clock: AtomicU64,
    /// Most steps that an answer has shown.
    seen: AtomicU64,
}

impl Shared {
    fn now(&self) -> u64 {
        self.clock.fetch_add(1, Ordering::SeqCst)
    }
}

/// How a call is made.
#[derive(Clone, Copy, Debug)]
struct Plan {
    call: Call,
    waits: bool,
    has_frame: bool,
}

/// Makes a call of a sequence whose steps are counted up to `reach` at a time.
fn plan(random: &mut fastrand::Rng, reach: u64, seen: u64) -> Plan {
    let call = match random.u32(0..40) {
        0..6 => Call::Play(0.0),
        6..14 => Call::Play(SLOW),
        14..22 => Call::Pause,
        22..28 => Call::Step(random.u64(1..=reach)),
        28..36 => Call::StepTo(seen + random.u64(0..=reach)),
        36..38 => Call::Fork,
        38 => Call::Stop,
        _ => Call::Delete,
    };
    let is_step = matches!(call, Call::Step(_) | Call::StepTo(_));
    let waits = !(is_step || call == Call::Pause) || random.u32(0..4) > 0;
    Plan { call, waits, has_frame: is_step && waits && random.u32(0..3) == 0 }
}

fn shown(session: Option<v1::Session>, frame: Option<v1::Frame>) -> Shown {
    let session = session.expect("the answer has the session");
    Shown {
        state: session.state(),
        step: session.step,
        is_hashed: session.state_hash.is_some(),
        frame_step: frame.map(|frame| frame.step),
    }
}

/// Makes a call, and gives what its answer shows.
async fn make(client: &mut Client, id: &str, plan: Plan) -> Result<Option<Shown>, Status> {
    let Plan { call, waits: wait, has_frame } = plan;
    let frame = has_frame.then(v1::FrameRequest::default);
    let step = v1::StepSessionRequest { wait, frame, ..v1::StepSessionRequest::of(id) };
    let step = match call {
        Call::Play(real_time_factor) => {
            let play = v1::PlaySessionRequest { real_time_factor, ..v1::PlaySessionRequest::of(id) };
            return Ok(Some(shown(client.play_session(play).await?.into_inner().session, None)));
        }
        Call::Pause => {
            let pause = v1::PauseSessionRequest { wait, ..v1::PauseSessionRequest::of(id) };
            return Ok(Some(shown(client.pause_session(pause).await?.into_inner().session, None)));
        }
        Call::Stop => {
            let stop = v1::StopSessionRequest::of(id);
            return Ok(Some(shown(client.stop_session(stop).await?.into_inner().session, None)));
        }
        Call::Delete => {
            client.delete_session(v1::DeleteSessionRequest::of(id)).await?;
            return Ok(None);
        }
        Call::Fork => {
            let fork = v1::ForkSessionRequest::of(id);
            let forked = client.fork_session(fork).await?.into_inner().session;
            let fork_id = forked.as_ref().expect("the answer has the session").session_id.clone();
            client.delete_session(v1::DeleteSessionRequest::of(fork_id)).await.expect("nobody else knows it");
            return Ok(Some(shown(forked, None)));
        }
        Call::Step(step_count) => v1::StepSessionRequest { step_count, ..step },
        Call::StepTo(to_step) => v1::StepSessionRequest { to_step: Some(to_step), ..step },
    };
    let v1::StepSessionResponse { session, frame } = client.step_session(step).await?.into_inner();
    Ok(Some(shown(session, frame)))
}

/// The same, with its reason if it is refused, and its times.
async fn ask(mut client: Client, id: String, plan: Plan, shared: Arc<Shared>, asked: u64) -> Answered {
    let answer = make(&mut client, &id, plan).await;
    let replied = shared.now();
    let answer = answer.map_err(|status| {
        let info = status.get_details_error_info();
        let reason = info.and_then(|info| Reason::of(&info.reason));
        reason.unwrap_or_else(|| panic!("no reason: {status:?}"))
    });
    if let Ok(Some(shown)) = answer {
        shared.seen.fetch_max(shown.step, Ordering::SeqCst);
    }
    let Plan { call, waits, has_frame } = plan;
    Answered { call, waits, has_frame, asked, replied, answer }
}

/// A sequence of calls to a session of its own.
struct Sequence {
    seed: u64,
    running: Vec<(Plan, JoinHandle<Answered>)>,
    history: History,
}

impl Sequence {
    /// Waits until every call is answered. None of them needs another one.
    async fn answered(&mut self) {
        for (plan, call) in self.running.drain(..) {
            let Ok(answered) = tokio::time::timeout(HANGS, call).await else {
                let (seed, calls) = (self.seed, &self.history.calls);
                panic!("seed {seed}: {plan:?} is not answered within {HANGS:?}; before it: {calls:#?}");
            };
            self.history.calls.push(answered.expect("no panic"));
        }
    }
}

/// Runs the sequence of a seed.
async fn run(seed: u64, clients: &mut [Client; 3]) {
    let mut random = fastrand::Rng::with_seed(seed);
    let limit = (random.u32(0..4) == 0).then_some(40);
    let is_slow = random.u32(0..RARE) == 0;
    let (text, reach) = if is_slow { (divided(24, 20), 6) } else { (dust(2, "gravity = [0, 0, 0]"), 50) };
    let scene = Some(Scene::SceneText(text));
    let create = v1::CreateSessionRequest { scene, step_limit: limit, ..request() };
    let made = clients[0].create_session(create).await.expect("a session is made").into_inner();
    let id = made.session.expect("the answer has the session").session_id;

    let shared = Arc::new(Shared::default());
    // It stands at its start, as after a pause.
    let start = Shown { state: SessionState::Paused, step: 0, is_hashed: true, frame_step: None };
    let (asked, replied) = (shared.now(), shared.now());
    let start = Answered {
        call: Call::Pause,
        waits: true,
        has_frame: false,
        asked,
        replied,
        answer: Ok(Some(start)),
    };
    let history = History { calls: vec![start], limit };
    let mut sequence = Sequence { seed, running: Vec::new(), history };
    for _ in 0..random.u32(4..13) {
        let plan = plan(&mut random, reach, shared.seen.load(Ordering::SeqCst));
        let client = clients[random.usize(0..3)].clone();
        let call = ask(client, id.clone(), plan, Arc::clone(&shared), shared.now());
        sequence.running.push((plan, tokio::spawn(call)));
        match random.u32(0..4) {
            0 => {}
            1 => tokio::time::sleep(Duration::from_micros(random.u64(0..1500))).await,
            _ => sequence.answered().await,
        }
    }
    sequence.answered().await;
    if let Some(fault) = sequence.history.fault() {
        panic!("seed {seed}: {fault}; all calls: {:#?}", sequence.history.calls);
    }
    // It may be deleted already.
    let _ = clients[0].delete_session(v1::DeleteSessionRequest::of(id)).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn every_call_that_waits_is_answered_as_the_calls_around_it_allow() {
    let limits = Limits { max_sessions: 64, history_bytes_per_session: 1 << 20, ..Limits::default() };
    let server = Server::with(limits).await;
    let mut workers = JoinSet::new();
    for worker in 0..WORKERS {
        let mut clients =
            [connect(&server.app).await, connect(&server.app).await, connect(&server.app).await];
        workers.spawn(async move {
            for seed in (worker..COUNT).step_by(WORKERS as usize) {
                run(seed, &mut clients).await;
            }
        });
    }
    while let Some(done) = workers.join_next().await {
        if let Err(failed) = done {
            std::panic::resume_unwind(failed.into_panic());
        }
    }
}
