//! Piles of sheets with a thickness, at random: pairs of surfaces take little more than is counted, or end their session alone.

use std::{collections::BTreeMap, sync::atomic::Ordering};

use bytes::Bytes;
use fastrand::Rng;
use nappe_proto::v1::{
    self, create_session_request::Scene, simulation_service_client::SimulationServiceClient,
};
use nappe_server::Limits;
use nappe_sim::mesh::TriangleMesh;
use tonic::{Status, transport::Channel};
use tonic_types::StatusExt as _;

use crate::{
    IGNORED, alone, connect,
    estimates::Pile,
    requests::runtime,
    start, used,
    watch::{Watch, as_client, excess},
};

type Client = SimulationServiceClient<Channel>;

/// Piles that are tried, each once made so and once put so.
const PILES: u32 = if cfg!(feature = "slow") { 100 } else { 2 };
const SEED: u64 = 1;
/// Memory (bytes) of a server that has room for most piles, and of one that has little.
const ROOM: u64 = 1 << 30;
const SCANT: u64 = 48 << 20;
/// Bytes from which an allocation only shows that there is so much.
const SEEN_ONLY: usize = 128 << 20;
/// What a call and its answer may take beside (bytes).
const CALL: usize = 2 << 20;
/// How far apart (m) sheets are that are put elsewhere later.
const FAR: f64 = 0.05;
/// The session that nothing may change, and its steps beside each pile.
const BYSTANDER: &str = "bystander";
const STEPS: u64 = 3;

impl Pile {
    fn at_random(random: &mut Rng) -> Self {
        // Half of the shortest edge is the largest thickness that is allowed.
        let thickness = 1e-4 * 50.0_f64.powf(random.f64());
        let apart = thickness * 0.05 * 60.0_f64.powf(random.f64());
        Self { count: random.u32(2..=20), side: random.usize(4..=20), thickness, apart }
    }

    /// Where its sheets are, as states.
    fn states(&self) -> Vec<v1::StateUpdate> {
        let points = TriangleMesh::grid(self.side, self.side, 0.01).points;
        let state = |layer: u32| {
            let y = self.apart * f64::from(layer);
            let positions = points.iter().flat_map(|[x, _, z]| [*x, y, *z]).flat_map(f64::to_le_bytes);
            v1::StateUpdate {
                body: Self::name(layer),
                positions_f64: positions.collect(),
                velocities_f64: Bytes::new(),
                upload_id: String::new(),
            }
        };
        (0..self.count).map(state).collect()
    }
}

fn create(id: &str, text: String) -> v1::CreateSessionRequest {
    v1::CreateSessionRequest {
        session_id: id.to_owned(),
        scene: Some(Scene::SceneText(text)),
        thread_count: 2,
        ..v1::CreateSessionRequest::default()
    }
}

fn step(id: &str, step_count: u64) -> v1::StepSessionRequest {
    v1::StepSessionRequest { step_count, wait: true, ..v1::StepSessionRequest::of(id) }
}

/// The hash of a session after so many more steps.
async fn hash(client: &mut Client, id: &str, steps: u64) -> Option<u64> {
    let stepped = client.step_session(step(id, steps)).await.expect("it steps");
    stepped.into_inner().session.expect("the answer has the session").state_hash
}

fn sheet() -> String {
    Pile { count: 1, side: 20, thickness: 0.004, apart: 0.0 }.scene()
}

/// How a pile comes to be.
#[derive(Clone, Copy, Debug)]
enum IsPut {
    AtStart,
    Later,
}

/// Makes a pile, or puts sheets so, and takes two steps. Says why that did not work.
async fn drill(client: &mut Client, pile: &Pile, is_put: IsPut) -> Result<(), Status> {
    match is_put {
        IsPut::AtStart => {
            client.create_session(create("pile", pile.scene())).await?;
        }
        IsPut::Later => {
            let far = Pile { apart: FAR, ..*pile };
            client.create_session(create("pile", far.scene())).await?;
            client.step_session(step("pile", 1)).await?;
            let states = pile.states();
            let put = v1::UpdateParametersRequest { states, ..v1::UpdateParametersRequest::of("pile") };
            client.update_parameters(put).await?;
        }
    }
    client.step_session(step("pile", 2)).await.map(drop)
}

/// Tries piles, beside a bystander; gives how often each ended in which way.
async fn piles(url: String) -> BTreeMap<String, u32> {
    let mut client = Client::new(connect(url).await);
    client.create_session(create(BYSTANDER, sheet())).await.expect("a session is made");
    let (mut random, mut ends) = (Rng::with_seed(SEED), BTreeMap::new());
    // From here on it has the memory that it needs.
    let mut last = hash(&mut client, BYSTANDER, STEPS).await;
    for number in 0..PILES {
        let pile = Pile::at_random(&mut random);
        for is_put in [IsPut::AtStart, IsPut::Later] {
            let end = drill(&mut client, &pile, is_put).await;
            let reason = end.err().map(|status| reason(&status));
            println!("{number}: {pile:?}, {is_put:?}: {reason:?}, {} bytes too many", excess());
            assert_eq!(excess(), 0, "{pile:?}, {is_put:?}: bytes beyond what is allowed");
            assert_ne!(reason.as_deref(), Some("SESSION_PANICKED"), "{pile:?}, {is_put:?}");
            *ends.entry(reason.unwrap_or_else(|| "steps".to_owned())).or_default() += 1;

            last = hash(&mut client, BYSTANDER, STEPS).await;
            // It is there if it was made.
            let _ = client.delete_session(v1::DeleteSessionRequest::of("pile")).await;
        }
    }
    client.create_session(create("undisturbed", sheet())).await.expect("a session is made");
    let undisturbed = hash(&mut client, "undisturbed", STEPS * (1 + 2 * u64::from(PILES))).await;
    assert!(last.is_some() && last == undisturbed, "{last:?} beside piles, {undisturbed:?} without");
    ends
}

fn reason(status: &Status) -> String {
    status.get_details_error_info().map_or_else(|| status.to_string(), |info| info.reason)
}

/// Piles on a server with so much memory, of which at most 1.3 times as much is in use as is counted.
fn piles_with(max_server_bytes: u64) -> BTreeMap<String, u32> {
    IGNORED.store(SEEN_ONLY, Ordering::Relaxed);
    let server = runtime();
    let limits = Limits { max_server_bytes, history_bytes_per_session: 1, ..Limits::default() };
    let app = server.block_on(async { start(limits) });
    let (counted, before) = (app.reserved(), used());
    let watch = Watch::begin(move || before + CALL + counted() as usize * 13 / 10);
    let ends = as_client(piles(app.url()));
    drop(watch);
    server.block_on(app.shutdown());
    IGNORED.store(usize::MAX, Ordering::Relaxed);
    println!("with {max_server_bytes} bytes: {ends:?}");
    ends
}

#[test]
fn piles_at_random_take_little_more_than_is_counted_or_end_alone() {
    let _alone = alone();
    let ends = piles_with(ROOM);
    assert!(ends.contains_key("steps"), "no pile was stepped: {ends:?}");
}

#[test]
fn piles_at_random_without_room_end_alone() {
    let _alone = alone();
    let ends = piles_with(SCANT);
    // Among few piles there may be none that is too large.
    assert!(cfg!(not(feature = "slow")) || ends.contains_key("SERVER_MEMORY_FULL"), "{ends:?}");
}
