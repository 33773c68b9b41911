//! Pulls by call: they draw, end by themselves, are told, limited, and refused by their fields.

use nappe_proto::v1::{self, SessionState};
use nappe_server::{Limits, Reason};
use nappe_tests::scene::{difference, norm};

use crate::{
    cloth_scenes::{dust, sheet, sheet_with},
    harness::{Server, assert_reason},
    snow_scenes::ball,
};

fn pull(body: &str, particles: &[u32], points: &[[f64; 3]]) -> v1::PullUpdate {
    v1::PullUpdate {
        body: body.into(),
        particles_u32: particles.iter().flat_map(|particle| particle.to_le_bytes()).collect(),
        points_f64: points.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect(),
        frequency: 100.0,
        most: 40.0,
        seconds: 0.02,
    }
}

fn pulls(id: &str, at_step: u64, pulls: Vec<v1::PullUpdate>) -> v1::UpdateParametersRequest {
    v1::UpdateParametersRequest { at_step, pulls, ..v1::UpdateParametersRequest::of(id) }
}

fn pull_count(session: &v1::Session) -> u32 {
    session.parameters.as_ref().expect("parameters").cloths[0].pull_count
}

/// Takes a step; positions after it.
async fn stepped(server: &mut Server, id: &str) -> (v1::Session, Vec<[f64; 3]>) {
    let frame = v1::FrameRequest { encoding: v1::Encoding::RawF64.into(), ..v1::FrameRequest::default() };
    let request = v1::StepSessionRequest { wait: true, frame: Some(frame), ..v1::StepSessionRequest::of(id) };
    let answer = server.client.step_session(request).await.expect("a step").into_inner();
    let frame = answer.frame.expect("the frame that was asked for");
    let numbers = frame.fields[0].data.as_chunks::<8>().0.iter();
    let numbers: Vec<f64> = numbers.map(|bytes| f64::from_le_bytes(*bytes)).collect();
    (answer.session.expect("a session"), numbers.as_chunks::<3>().0.to_vec())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pull_draws_a_particle_from_the_next_step_on_and_ends_by_itself() {
    let mut server = Server::start().await;
    let text = || sheet_with(6, "precision = \"f64\"");
    let (pulled, free) = (server.session(text()).await, server.session(text()).await);
    let (_, start) = stepped(&mut server, &free).await;
    server.step(&pulled, 1).await;
    let [x, y, z] = start[14];
    let request = pulls(&pulled, 0, vec![pull("sheet", &[14], &[[x, y + 0.1, z]])]);
    server.client.update_parameters(request).await.expect("accepted");
    let (told, drawn) = stepped(&mut server, &pulled).await;
    let (fallen_told, fallen) = stepped(&mut server, &free).await;
    assert_eq!((pull_count(&told), pull_count(&fallen_told)), (1, 0));
    // At most 40 m/s² for a step of 2 ms, and its neighbours hold it back.
    let ahead = norm(difference(drawn[14], fallen[14]));
    assert!(drawn[14][1] > fallen[14][1] && (1e-6..1.7e-4).contains(&ahead), "{ahead} m");
    let work = |session: &v1::Session| session.diagnostics.clone().expect("diagnostics").external_work;
    assert!(work(&told) != 0.0 && work(&fallen_told) == 0.0);

    // A fork goes on with the same bits; after 10 steps the pull is over.
    let request = v1::ForkSessionRequest::of(&pulled);
    let forked = server.client.fork_session(request).await.expect("a fork").into_inner();
    let forked = forked.session.expect("a session");
    assert_eq!((pull_count(&forked), forked.state_hash), (1, told.state_hash));
    let (last, ended) = (server.step(&pulled, 8).await, server.step(&pulled, 1).await);
    assert_eq!((pull_count(&last), pull_count(&ended)), (1, 0));
    assert_eq!(server.step(&forked.session_id, 9).await.state_hash, ended.state_hash);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pull_waits_is_listed_let_go_and_reset() {
    let mut server = Server::start().await;
    let id = server.session(sheet(5)).await;
    let asked = pull("sheet", &[7, 12], &[[0.1, 0.2, 0.3]; 2]);
    server.client.update_parameters(pulls(&id, 4, vec![asked.clone()])).await.expect("accepted");
    let request = v1::ListPendingChangesRequest::of(&id);
    let listed = server.client.list_pending_changes(request).await.expect("listed").into_inner();
    assert_eq!(listed.changes[0].changes.as_ref().expect("changes").pulls, [asked]);
    assert_eq!(pull_count(&server.step(&id, 4).await), 0);
    assert_eq!(pull_count(&server.step(&id, 1).await), 2);
    let end = |particles: &[u32]| vec![pull("sheet", particles, &[])];
    server.client.update_parameters(pulls(&id, 0, end(&[7]))).await.expect("accepted");
    assert_eq!(pull_count(&server.step(&id, 1).await), 1);
    let all: Vec<[f64; 3]> = vec![[0.1, 0.2, 0.3]; 25];
    server.client.update_parameters(pulls(&id, 0, vec![pull("sheet", &[], &all)])).await.expect("accepted");
    assert_eq!(pull_count(&server.step(&id, 1).await), 23, "all but two pins");
    server.client.update_parameters(pulls(&id, 0, end(&[]))).await.expect("accepted");
    assert_eq!(pull_count(&server.step(&id, 1).await), 0);

    server.client.update_parameters(pulls(&id, 0, vec![pull("sheet", &[], &all)])).await.expect("accepted");
    server.step(&id, 1).await;
    server.client.reset_session(v1::ResetSessionRequest::of(&id)).await.expect("a reset");
    assert_eq!(pull_count(&server.get(&id).await), 0);

    // A session that comes to its end while it is pulled.
    server.client.update_parameters(pulls(&id, 0, vec![pull("sheet", &[], &all)])).await.expect("accepted");
    server.step(&id, 1).await;
    server.client.stop_session(v1::StopSessionRequest::of(&id)).await.expect("stopped");
    assert_eq!(server.get(&id).await.state(), SessionState::Finished);
    let refused = server.client.update_parameters(pulls(&id, 0, end(&[]))).await.expect_err("at its end");
    assert_reason(&refused, Reason::SessionFinished);
}

#[tokio::test(flavor = "multi_thread")]
async fn pulls_that_do_not_fit_are_refused_by_their_fields() {
    let mut server = Server::with(Limits { max_pulls: 3, ..Limits::default() }).await;
    let info = server.client.get_server_info(v1::GetServerInfoRequest {}).await.expect("told").into_inner();
    assert_eq!(info.limits.expect("limits").max_pulls, 3);
    let (id, points) = (server.session(sheet(4)).await, [[0.1, 0.2, 0.3]; 4]);
    let of = |particles: &[u32], count: usize| pull("sheet", particles, &points[..count]);
    let one = || of(&[5], 1);
    let odd = v1::PullUpdate { points_f64: vec![0; 23].into(), ..one() };
    for (pull, reason, told) in [
        (pull("", &[5], &points[..1]), Reason::InvalidField, "pulls[0].body"),
        (
            pull("sail", &[5], &points[..1]),
            Reason::InvalidChange,
            "no body is named 'sail'; there are: sheet",
        ),
        (of(&[0], 1), Reason::InvalidChange, "particle 0 is pinned, and follows no pull"),
        (of(&[16], 1), Reason::InvalidChange, "there is no particle 16 to pull: the body has 16, from 0"),
        (of(&[5, 6], 1), Reason::InvalidChange, "1 points for 2 particles"),
        (of(&[5, 6, 7, 8], 4), Reason::InvalidChange, "the call pulls at 4 particles: allowed are 3"),
        (odd, Reason::InvalidField, "has 23 bytes: 24 for a point are needed"),
        (v1::PullUpdate { particles_u32: vec![0; 3].into(), ..one() }, Reason::InvalidField, "has 3 bytes"),
        (pull("sheet", &[5], &[[f64::NAN, 0.0, 0.0]]), Reason::InvalidField, "a point, number 0, is NaN"),
        (v1::PullUpdate { frequency: f64::NAN, ..one() }, Reason::InvalidField, "pulls[0].frequency"),
        (
            v1::PullUpdate { frequency: 251.0, ..one() },
            Reason::InvalidChange,
            "frequency is 251: allowed are 1e-9 to 250",
        ),
        (v1::PullUpdate { frequency: 0.0, ..one() }, Reason::InvalidChange, "frequency is 0"),
        (
            v1::PullUpdate { most: 1e300, ..one() },
            Reason::InvalidChange,
            "most is 1e300: allowed are 1e-9 to 1000000",
        ),
        (v1::PullUpdate { seconds: 0.0, ..one() }, Reason::InvalidChange, "seconds is 0"),
        (
            v1::PullUpdate { seconds: 1e9, ..one() },
            Reason::InvalidChange,
            "seconds is 1000000000: allowed are 1e-9 to 10",
        ),
    ] {
        let refused = server.client.update_parameters(pulls(&id, 0, vec![pull])).await.expect_err("refused");
        assert_reason(&refused, reason);
        assert!(refused.message().contains(told), "{}, not {told}", refused.message());
    }
    // Those of one call count together; a fork has the same limit.
    let request = v1::ForkSessionRequest::of(&id);
    let forked = server.client.fork_session(request).await.expect("a fork").into_inner();
    for id in [id, forked.session.expect("a session").session_id] {
        let four = pulls(&id, 0, vec![of(&[5, 6], 2), of(&[7, 8], 2)]);
        let refused = server.client.update_parameters(four).await.expect_err("refused");
        assert_reason(&refused, Reason::InvalidChange);
        let three = pulls(&id, 0, vec![of(&[5, 6], 2), of(&[7], 1), pull("sheet", &[], &[])]);
        server.client.update_parameters(three).await.expect("three");
        assert_eq!(pull_count(&server.step(&id, 1).await), 0, "they were let go by the same call");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn snow_follows_no_pull() {
    let mut server = Server::start().await;
    let id = server.session(dust(3, "") + &ball("")).await;
    let request = pulls(&id, 0, vec![pull("ball", &[0], &[[0.0; 3]])]);
    let refused = server.client.update_parameters(request).await.expect_err("refused");
    assert_reason(&refused, Reason::InvalidChange);
    assert!(refused.message().contains("is snow, and follows no pull"), "{}", refused.message());
}
