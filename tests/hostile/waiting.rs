//! What waits in a session and what calls give it count as memory of the server, in its forks too.

use std::time::Duration;

use nappe_proto::v1::{self, simulation_service_client::SimulationServiceClient};
use tonic::transport::Channel;

use crate::{
    alone,
    estimates::left,
    named::{session, with_client},
    requests::runtime,
};

type Client = SimulationServiceClient<Channel>;

/// Particles of a body, and poses of a way.
const COUNT: u64 = 10_000;
/// Bytes that lists take beside their numbers, at most.
const BESIDE: u64 = 32 << 10;

/// Bytes that are left, once nothing of the calls before counts any more.
async fn settled(client: &mut Client) -> u64 {
    let mut found = left(client).await;
    loop {
        tokio::time::sleep(Duration::from_millis(20)).await;
        let again = left(client).await;
        if again == found {
            return found;
        }
        found = again;
    }
}

/// Bytes that a copy of a session takes of the server's memory; the copy is deleted.
async fn of_fork(client: &mut Client, id: &str) -> u64 {
    let before = settled(client).await;
    let request = v1::ForkSessionRequest { new_session_id: "copy".into(), ..v1::ForkSessionRequest::of(id) };
    client.fork_session(request).await.expect("a copy is made");
    let after = settled(client).await;
    client.delete_session(v1::DeleteSessionRequest::of("copy")).await.expect("deleted");
    before - after
}

/// Whether so many bytes are those of lists, and little beside.
#[track_caller]
fn check(what: &str, found: u64, lists: u64) {
    println!("{what}: {found} bytes, {lists} of them lists");
    assert!((lists..lists + BESIDE).contains(&found), "{what}: {found} bytes, {lists} of them lists");
}

async fn step(client: &mut Client, id: &str, step_count: u64) {
    let request = v1::StepSessionRequest { step_count, wait: true, ..v1::StepSessionRequest::of(id) };
    client.step_session(request).await.expect("steps are taken");
}

#[test]
fn changes_that_wait_count_until_they_are_taken_or_dropped_and_in_a_fork_once_more() {
    let _alone = alone();
    runtime().block_on(async {
        let (app, mut client) = with_client().await;
        let id = session(&mut client, COUNT, "").await;
        let (before, own) = (settled(&mut client).await, of_fork(&mut client, &id).await);

        let force = [0.0_f64, 1.0, 0.0].map(f64::to_le_bytes).concat();
        let list = 24 * COUNT;
        let update = v1::UpdateParametersRequest {
            at_step: 100,
            forces: vec![v1::ForceUpdate {
                body: "dust".into(),
                forces_f64: force.repeat(COUNT as usize).into(),
                ..v1::ForceUpdate::default()
            }],
            ..v1::UpdateParametersRequest::of(&id)
        };
        for _ in 0..20 {
            client.update_parameters(update.clone()).await.expect("accepted");
        }
        check("20 calls that wait", before - settled(&mut client).await, 20 * list);
        check("those of a copy", of_fork(&mut client, &id).await - own, 20 * list);

        let drop = v1::DropPendingChangesRequest {
            orders: (1..=10).collect(),
            ..v1::DropPendingChangesRequest::of(&id)
        };
        let dropped = client.drop_pending_changes(drop).await.expect("dropped").into_inner();
        assert_eq!(dropped.dropped_count, 10);
        check("10 of them", before - settled(&mut client).await, 10 * list);

        // The body has one force for each particle, from whichever call.
        step(&mut client, &id, 101).await;
        check("forces that act", before - settled(&mut client).await, list);
        check("those of a copy", of_fork(&mut client, &id).await - own, list);
        app.shutdown().await;
    });
}

#[test]
fn ways_that_calls_give_count_in_a_session_and_in_its_forks() {
    let _alone = alone();
    runtime().block_on(async {
        let (app, mut client) = with_client().await;
        let ball =
            "pins = [0]\n[[collider]]\nname = \"ball\"\nsphere = { center = [0, -9, 0], radius = 1 }\n";
        let id = session(&mut client, 10, ball).await;
        let (before, own) = (settled(&mut client).await, of_fork(&mut client, &id).await);

        let times_seconds: Vec<f64> = (1..=COUNT).map(|second| second as f64).collect();
        let path = v1::ColliderPath {
            name: "ball".into(),
            times_seconds: times_seconds.clone(),
            positions: [0.0, -9.0, 0.0].repeat(COUNT as usize),
            turns: Vec::new(),
        };
        let collider_paths = vec![path];
        let update = v1::UpdateParametersRequest { collider_paths, ..v1::UpdateParametersRequest::of(&id) };
        client.update_parameters(update).await.expect("accepted");
        step(&mut client, &id, 1).await;
        // A pose of 64 bytes, in the world and in what sub-steps look at.
        let of_ball = 128 * COUNT;
        check("the way of a ball", before - settled(&mut client).await, of_ball);
        check("that of a copy", of_fork(&mut client, &id).await - own, of_ball);

        let targets = [0.0; 3].repeat(COUNT as usize);
        let paths = vec![v1::PinPath { particle: 0, times_seconds, targets }];
        let update = v1::UpdateParametersRequest { paths, ..v1::UpdateParametersRequest::of(&id) };
        client.update_parameters(update).await.expect("accepted");
        step(&mut client, &id, 1).await;
        let of_both = of_ball + 32 * COUNT;
        check("with that of a pin", before - settled(&mut client).await, of_both);
        check("those of a copy", of_fork(&mut client, &id).await - own, of_both);
        app.shutdown().await;
    });
}
