//! Sessions with snow that ranks step: what they warn of, and what is refused while they live on.

use nappe_proto::v1;
use nappe_server::Reason;
use tonic::Status;

use crate::{
    harness::{Server, assert_reason},
    hung_ranks::StandIn,
    snow_scenes::block,
};

#[tokio::test(flavor = "multi_thread")]
async fn more_ranks_than_blocks_of_snow_are_warned_of_once() {
    let stand_in = StandIn::of(2);
    let mut server = stand_in.server_of(1).await;
    let (made, _) = stand_in.make(&server, block(1, ""), 2).await.expect("a session");
    let told = made.warnings.iter().filter(|warning| warning.contains("2 ranks share 1 blocks"));
    assert_eq!(told.count(), 1, "{:?}", made.warnings);
    let mut different = made.warnings.clone();
    different.sort_unstable();
    different.dedup();
    assert_eq!(different.len(), made.warnings.len(), "{:?}", made.warnings);
    let id = made.session.expect("the answer has the session").session_id;
    assert_eq!(server.step(&id, 2).await.step, 2);
    server.client.delete_session(v1::DeleteSessionRequest::of(&id)).await.expect("it is deleted");
}

/// A force, a state and a reset of the block of one particle, in turn: what becomes of each.
async fn changed(server: &mut Server, id: &str) -> [Result<(), Status>; 3] {
    let force = v1::ForceUpdate {
        body: "block".into(),
        force: Some([0.0, 1.0, 0.0].into()),
        ..v1::ForceUpdate::default()
    };
    let positions = [0.05_f64, 0.15, 0.05].map(f64::to_le_bytes).as_flattened().to_vec();
    let state = v1::StateUpdate {
        body: "block".into(),
        positions_f64: positions.into(),
        ..v1::StateUpdate::default()
    };
    let update = v1::UpdateParametersRequest::of(id);
    let forces = v1::UpdateParametersRequest { forces: vec![force], ..update.clone() };
    let states = v1::UpdateParametersRequest { states: vec![state], ..update };
    let client = &mut server.client;
    [
        client.update_parameters(forces).await.map(drop),
        client.update_parameters(states).await.map(drop),
        client.reset_session(v1::ResetSessionRequest::of(id)).await.map(drop),
    ]
}

#[tokio::test(flavor = "multi_thread")]
async fn forces_states_and_resets_of_snow_are_refused_and_the_session_steps_on() {
    let stand_in = StandIn::of(2);
    let mut server = stand_in.server_of(2).await;
    let (made, _) = stand_in.make(&server, block(1, ""), 2).await.expect("a session");
    let id = made.session.expect("the answer has the session").session_id;
    // Before the first step, and after it.
    for step in 1..3 {
        for outcome in changed(&mut server, &id).await {
            let refused = outcome.expect_err("ranks step the snow");
            assert_reason(&refused, Reason::InvalidChange);
            assert!(refused.message().contains("'block' is snow that ranks step"), "{}", refused.message());
        }
        let session = server.step(&id, 1).await;
        assert_eq!((session.step, session.failure), (step, None));
    }

    // The server itself steps a copy.
    let copied = server.client.fork_session(v1::ForkSessionRequest::of(&id)).await.expect("a fork");
    let copy = copied.into_inner().session.expect("the answer has the session").session_id;
    for outcome in changed(&mut server, &copy).await {
        outcome.expect("snow of one process");
    }
    assert_eq!(server.step(&copy, 1).await.step, 3);
    for id in [id, copy] {
        server.client.delete_session(v1::DeleteSessionRequest::of(&id)).await.expect("it is deleted");
    }
}
