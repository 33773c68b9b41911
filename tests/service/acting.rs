//! Air and forces by call, states from outside, resets: over gRPC, with the bits of a scene that says the same.

use nappe_proto::v1::{self, ChangeKind, SessionState, SpringKind};
use nappe_server::{Limits, Reason};

use crate::{
    cloth_scenes::{dust, sheet, sheet_with},
    frames::{Watch, Whole},
    harness::{Server, assert_reason, every},
};

fn packed(vectors: &[[f64; 3]]) -> Vec<u8> {
    vectors.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn force(body: &str, particles: &[u32], force: [f64; 3]) -> v1::ForceUpdate {
    v1::ForceUpdate {
        body: body.into(),
        particles_u32: particles.iter().flat_map(|particle| particle.to_le_bytes()).collect(),
        force: Some(force.into()),
        ..v1::ForceUpdate::default()
    }
}

fn forces(id: &str, at_step: u64, forces: Vec<v1::ForceUpdate>) -> v1::UpdateParametersRequest {
    v1::UpdateParametersRequest { at_step, forces, ..v1::UpdateParametersRequest::of(id) }
}

async fn reset(server: &mut Server, id: &str) -> v1::ResetSessionResponse {
    server.client.reset_session(v1::ResetSessionRequest::of(id)).await.expect("a reset").into_inner()
}

#[tokio::test(flavor = "multi_thread")]
async fn air_and_forces_by_call_have_the_bits_of_a_scene_that_says_the_same() {
    let mut server = Server::start().await;
    let timed =
        "\nair = { lift = 1 }\n[[body.force]]\non = 7\nforce = [0, 0.01, 0]\nfrom = 0.02\nuntil = 0.06\n";
    let text = sheet_with(6, "wind = [1, 0, 3]").replace("drag = 1e-4", &format!("drag = 1e-4{timed}"));
    let written = server.session(text).await;
    let written = server.step(&written, 40).await;

    let called = server
        .session(sheet_with(6, "wind = [1, 0, 3]").replace("drag = 1e-4", "drag = 1e-4\nair = {}"))
        .await;
    let air = v1::AirUpdate { lift: Some(1.0), ..v1::AirUpdate::default() };
    let request = v1::UpdateParametersRequest { air: vec![air], ..v1::UpdateParametersRequest::of(&called) };
    server.client.update_parameters(request).await.expect("accepted");
    for (step, up) in [(10, 0.01), (30, 0.0)] {
        let request = forces(&called, step, vec![force("sheet", &[7], [0.0, up, 0.0])]);
        server.client.update_parameters(request).await.expect("accepted");
    }
    let called = server.step(&called, 40).await;
    assert_eq!(written.state_hash, called.state_hash);
    let air = called.parameters.clone().expect("parameters").cloths[0].air.expect("air");
    assert_eq!((air.density, air.lift), (1.2, 1.0));
    let of = |session: v1::Session| session.diagnostics.expect("diagnostics").external_work;
    assert!(of(called) != 0.0, "the air worked");
}

fn acting(session: &v1::Session) -> &[v1::ForceUpdate] {
    &session.parameters.as_ref().expect("parameters").forces
}

/// The only session of a server, as it is listed.
async fn listed(server: &mut Server) -> v1::Session {
    let answer = server.client.list_sessions(v1::ListSessionsRequest::default()).await;
    let sessions = answer.expect("listed").into_inner().sessions;
    assert_eq!(sessions.len(), 1);
    sessions[0].clone()
}

#[tokio::test(flavor = "multi_thread")]
async fn forces_that_calls_have_set_are_read_back_and_can_be_sent_again() {
    let mut server = Server::start().await;
    let id = server.session(sheet(5)).await;
    assert!(acting(&server.get(&id).await).is_empty());
    let (up, aside) = ([0.0, 0.01, 0.0], [0.0, 0.0, -0.002]);
    let change = |wanted: Vec<v1::ForceUpdate>| forces(&id, 0, wanted);

    // All that are free feel the same: none is named. Pins, which are 0 and 4, feel nothing.
    server.client.update_parameters(change(vec![force("sheet", &[], up)])).await.expect("accepted");
    assert!(acting(&server.get(&id).await).is_empty(), "the change waits for its step");
    let told = server.step(&id, 1).await;
    assert_eq!(acting(&told), [force("sheet", &[], up)]);
    assert_eq!(acting(&listed(&mut server).await), acting(&told));

    // Others on some of them: each is named, but not in a list of sessions.
    let others = [force("sheet", &[7, 9], aside), force("sheet", &[1, 2], [0.0; 3])];
    server.client.update_parameters(change(others.to_vec())).await.expect("accepted");
    let told = server.step(&id, 1).await;
    let [one] = acting(&told) else { panic!("{:?}", acting(&told)) };
    let named: Vec<u32> = (0..25).filter(|particle| ![0, 1, 2, 4].contains(particle)).collect();
    let expected: Vec<[f64; 3]> = named.iter().map(|p| if [7, 9].contains(p) { aside } else { up }).collect();
    assert_eq!(
        (one.body.as_str(), one.force, one.particles(), one.forces()),
        ("sheet", None, named, expected)
    );
    let session = listed(&mut server).await;
    assert_eq!(acting(&session), [v1::ForceUpdate { body: "sheet".into(), ..v1::ForceUpdate::default() }]);

    // A fork has them. What was taken away and is sent again as it was told leads to the bits of the calls that set it.
    let request = v1::ForkSessionRequest::of(&id);
    let forked = server.client.fork_session(request).await.expect("a fork").into_inner();
    let forked = forked.session.expect("a session");
    assert_eq!(acting(&forked), acting(&told));
    let again = vec![force("sheet", &[], [0.0; 3]), one.clone()];
    server.client.update_parameters(change(again)).await.expect("accepted");
    let as_before = [&[force("sheet", &[], up)][..], &others].concat();
    server.client.update_parameters(forces(&forked.session_id, 0, as_before)).await.expect("accepted");
    let (session, forked) = (server.step(&id, 5).await, server.step(&forked.session_id, 5).await);
    assert_eq!((acting(&session), acting(&forked)), (acting(&told), acting(&told)));
    assert_eq!(session.state_hash, forked.state_hash);

    reset(&mut server, &id).await;
    assert!(acting(&server.get(&id).await).is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn more_forces_than_a_description_holds_are_left_out_and_their_body_is_named() {
    let mut server = Server::start().await;
    let id = server.session(dust(65, "")).await;
    let each: Vec<[f64; 3]> = (0..65 * 65).map(|i| [0.0, 0.0, 1e-9 * f64::from(i + 1)]).collect();
    let update = v1::ForceUpdate {
        body: "dust".into(),
        forces_f64: packed(&each).into(),
        ..v1::ForceUpdate::default()
    };
    server.client.update_parameters(forces(&id, 0, vec![update])).await.expect("accepted");
    let told = server.step(&id, 1).await;
    assert_eq!(acting(&told), [v1::ForceUpdate { body: "dust".into(), ..v1::ForceUpdate::default() }]);

    let some = vec![force("dust", &[], [0.0; 3]), force("dust", &[64 * 65], [0.0, 0.0, 1e-6])];
    server.client.update_parameters(forces(&id, 0, some.clone())).await.expect("accepted");
    assert_eq!(acting(&server.step(&id, 1).await), &some[1..]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_state_by_call_or_by_upload_is_where_the_body_goes_on_from() {
    let mut server = Server::with(Limits { max_meshes: 1, ..Limits::default() }).await;
    let library = nappe_client::Client::connect(&server.app.url()).await.expect("a client");
    let x: Vec<[f64; 3]> = (0..16).map(|i| [f64::from(i), 2.0, -1.0]).collect();
    let v: Vec<[f64; 3]> = (0..16).map(|i| [0.0, f64::from(i), 0.5]).collect();
    let mut hashes = Vec::new();
    for by_upload in [false, true] {
        let id = server.session(dust(4, "precision = \"f64\"")).await;
        server.step(&id, 3).await;
        let mut state = v1::StateUpdate { body: "dust".into(), ..v1::StateUpdate::default() };
        if by_upload {
            let mesh =
                nappe_client::MeshUpload { points: x.clone(), velocities: v.clone(), ..Default::default() };
            state.upload_id = library.upload_mesh(&mesh).await.expect("uploaded").mesh_id;
        } else {
            (state.positions_f64, state.velocities_f64) = (packed(&x).into(), packed(&v).into());
        }
        let request =
            v1::UpdateParametersRequest { states: vec![state], ..v1::UpdateParametersRequest::of(&id) };
        server.client.update_parameters(request).await.expect("accepted");
        // The server forgets the mesh for another one, while the state waits.
        let other = nappe_client::MeshUpload { points: vec![[0.0; 3]], ..Default::default() };
        library.upload_mesh(&other).await.expect("uploaded");
        let listed = server.client.list_pending_changes(v1::ListPendingChangesRequest::of(&id)).await;
        let listed = listed.expect("listed").into_inner().changes;
        assert_eq!(listed[0].changes.as_ref().expect("changes").states[0].positions_f64, packed(&x));
        hashes.push(server.step(&id, 5).await.state_hash);
    }
    assert_eq!(hashes[0], hashes[1]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_reset_is_the_start_with_its_moving_pins_and_is_told_with_a_frame() {
    let mut server = Server::start().await;
    let moving = "pins = [\"top_left\", \"top_right\"]\nmoving_pin = [{ pin = \"top_left\", offset = [0, 0.3, 0], duration = 0.1 }]";
    let text = sheet(5).replace("pins = [\"top_left\", \"top_right\"]", moving);
    let id = server.session(text.clone()).await;
    let mut watch = server.watch(every(&id, 0)).await;
    let start = watch.frame().await;
    server.step(&id, 20).await;
    let stiffer = v1::SpringUpdate {
        kind: SpringKind::Shear.into(),
        stiffness: Some(90.0),
        ..v1::SpringUpdate::default()
    };
    let request = v1::UpdateParametersRequest {
        springs: vec![stiffer],
        gravity: Some([0.0; 3].into()),
        ..forces(&id, 0, vec![force("sheet", &[], [0.1, 0.0, 0.0])])
    };
    let changed = server.client.update_parameters(request).await.expect("accepted").into_inner();
    server.step(&id, 10).await;
    let done = reset(&mut server, &id).await;
    assert_eq!((done.effective_step, done.order), (30, changed.order + 1));

    // A frame shows it at once, and the change is told before it.
    let frames = frames_to(&mut watch, 31).await;
    let last = frames.last().expect("frames");
    assert_eq!((last.head.step, last.head.frame), (30, 31));
    assert_eq!(positions(last), positions(&start));
    let kinds: Vec<_> = watch.changes.iter().map(|change| (change.kind(), change.step)).collect();
    assert!(kinds.contains(&(ChangeKind::Reset, 30)), "{kinds:?}");

    // From there it goes as a new session does.
    let new = server.session(text).await;
    let mut new_watch = server.watch(every(&new, 0)).await;
    server.step(&new, 60).await;
    server.step(&id, 60).await;
    let (again, first) = (frames_to(&mut watch, 91).await, frames_to(&mut new_watch, 60).await);
    assert_eq!(positions(again.last().expect("frames")), positions(first.last().expect("frames")));
    let parameters = |session: v1::Session| session.parameters;
    assert_eq!(parameters(server.get(&id).await), parameters(server.get(&new).await));

    // While it plays, between two steps; a fork goes back to the same start.
    server.play(&id).await;
    reset(&mut server, &id).await;
    server.pause(&id).await;
    let request = v1::ForkSessionRequest::of(&id);
    let forked = server.client.fork_session(request).await.expect("a fork").into_inner();
    let forked = forked.session.expect("a session").session_id;
    reset(&mut server, &forked).await;
    let mut watch = server.watch(every(&forked, 1)).await;
    assert_eq!(positions(&watch.frame().await), positions(&start));

    server.client.stop_session(v1::StopSessionRequest::of(&id)).await.expect("stopped");
    let refused =
        server.client.reset_session(v1::ResetSessionRequest::of(&id)).await.expect_err("at its end");
    assert_reason(&refused, Reason::SessionFinished);
}

fn positions(frame: &Whole) -> Vec<f32> {
    frame.numbers(v1::Field::Positions, f32::from_le_bytes)
}

/// Frames up to that of a number.
async fn frames_to(watch: &mut Watch, number: u64) -> Vec<Whole> {
    let mut frames = Vec::new();
    while frames.last().is_none_or(|frame: &Whole| frame.head.frame < number) {
        frames.push(watch.frame().await);
    }
    frames
}

#[tokio::test(flavor = "multi_thread")]
async fn what_does_not_fit_is_refused_with_its_field_and_changes_nothing() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    let before = server.get(&id).await.state_hash;
    let state = |positions: Vec<u8>| v1::StateUpdate {
        body: "sheet".into(),
        positions_f64: positions.into(),
        ..v1::StateUpdate::default()
    };
    let of = |forces: Vec<v1::ForceUpdate>, states: Vec<v1::StateUpdate>| v1::UpdateParametersRequest {
        forces,
        states,
        ..v1::UpdateParametersRequest::of(&id)
    };
    let bytes = |count: usize| v1::ForceUpdate {
        forces_f64: vec![0; count].into(),
        force: None,
        ..force("sheet", &[], [0.0; 3])
    };
    let odd = v1::ForceUpdate { particles_u32: vec![0; 7].into(), ..force("sheet", &[], [1.0; 3]) };
    let both = v1::ForceUpdate { forces_f64: vec![0; 24].into(), ..force("sheet", &[5], [1.0; 3]) };
    let unknown = v1::StateUpdate { upload_id: "mesh-1".into(), ..state(Vec::new()) };
    let nan = packed(&[[0.0, f64::NAN, 0.0]; 16]);
    let air = v1::AirUpdate { density: Some(2.0), ..v1::AirUpdate::default() };
    let no_air = v1::UpdateParametersRequest { air: vec![air], ..v1::UpdateParametersRequest::of(&id) };
    for (request, reason, told) in [
        (
            of(vec![force("sail", &[], [1.0; 3])], vec![]),
            Reason::InvalidChange,
            "no body is named 'sail'; there are: sheet",
        ),
        (of(vec![force("", &[], [1.0; 3])], vec![]), Reason::InvalidField, "forces[0].body"),
        (of(vec![force("sheet", &[0], [1.0; 3])], vec![]), Reason::InvalidChange, "particle 0 is pinned"),
        (of(vec![force("sheet", &[16], [1.0; 3])], vec![]), Reason::InvalidChange, "there is no particle 16"),
        (
            of(vec![force("sheet", &[5], [f64::INFINITY, 0.0, 0.0])], vec![]),
            Reason::InvalidField,
            "forces[0].force.x",
        ),
        (of(vec![bytes(48)], vec![]), Reason::InvalidChange, "2 forces for 16 particles"),
        (of(vec![bytes(47)], vec![]), Reason::InvalidField, "has 47 bytes: 24 for a force are needed"),
        (of(vec![bytes(0)], vec![]), Reason::InvalidField, "neither force nor forces_f64"),
        (of(vec![odd], vec![]), Reason::InvalidField, "has 7 bytes"),
        (of(vec![both], vec![]), Reason::InvalidField, "both force and forces_f64"),
        (
            of(vec![], vec![state(vec![0; 24])]),
            Reason::InvalidChange,
            "positions of 1 particles, and the body has 16",
        ),
        (of(vec![], vec![state(nan)]), Reason::InvalidField, "a position, number 0, is NaN"),
        (
            of(vec![], vec![state(packed(&[[3e6; 3]; 16]))]),
            Reason::InvalidChange,
            "positions of particle 0 is 3000000",
        ),
        (
            of(vec![], vec![state(vec![0; 24]), state(vec![0; 24])]),
            Reason::InvalidChange,
            "states 0 and 1 put 'sheet': one state of a body in a call is allowed",
        ),
        (of(vec![], vec![unknown]), Reason::MeshNotFound, "mesh-1"),
        (no_air, Reason::InvalidChange, "no body has [body.air]"),
    ] {
        let refused = server.client.update_parameters(request).await.expect_err("refused");
        assert_reason(&refused, reason);
        assert!(refused.message().contains(told), "{}, not {told}", refused.message());
    }
    assert_eq!(server.get(&id).await.state_hash, before);
}

/// Two level sheets, one above the other, which keep their surfaces apart.
fn two_sheets() -> String {
    let body = |name: &str, height: f64| {
        format!(
            r#"
            [[body]]
            name = "{name}"
            mesh = {{ grid = [4, 4], spacing = 0.1 }}
            transform = {{ translate = [0, {height}, 0] }}
            mass = {{ density = 0.2 }}
            thickness = 0.01
            springs = {{ stretch = {{ stiffness = 50, damping = 0.02 }} }}
            "#
        )
    };
    format!("version = 1\ndt = 0.005\nprecision = \"f64\"\n{}{}", body("one", 0.0), body("other", 0.2))
}

/// A sheet of 4 x 4 particles that stands upright, and goes through the lower one of the two.
fn upright() -> Vec<[f64; 3]> {
    (0..16).map(|i| [0.1 * f64::from(i % 4) + 0.013, 0.15 - 0.1 * f64::from(i / 4), 0.123]).collect()
}

fn put(id: &str, body: &str, places: &[[f64; 3]]) -> v1::UpdateParametersRequest {
    let positions_f64 = packed(places).into();
    let state = v1::StateUpdate { body: body.into(), positions_f64, ..v1::StateUpdate::default() };
    v1::UpdateParametersRequest { states: vec![state], ..v1::UpdateParametersRequest::of(id) }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_state_that_crosses_another_body_is_refused_with_both_and_no_step_is_taken() {
    let mut server = Server::start().await;
    let id = server.session(two_sheets()).await;
    let before = server.step(&id, 2).await.state_hash;
    let crossing = put(&id, "other", &upright());
    let states = crossing.states.clone();
    let refused = server.client.update_parameters(crossing.clone()).await.expect_err("it crosses");
    let told = assert_reason(&refused, Reason::InvalidChange);
    let mut bodies = [told["body"].as_str(), told["other"].as_str()];
    bodies.sort_unstable();
    assert_eq!(bodies, ["one", "other"]);
    assert!(refused.message().contains("its surface crosses that of body"), "{}", refused.message());

    let changes = v1::Changes { states, ..v1::Changes::default() };
    let with = v1::StepSessionRequest {
        step_count: 3,
        wait: true,
        changes: Some(changes),
        ..v1::StepSessionRequest::of(&id)
    };
    let refused = server.client.step_session(with.clone()).await.expect_err("it crosses");
    assert_reason(&refused, Reason::InvalidChange);
    // Steps that are taken already change nothing.
    let taken = v1::StepSessionRequest { to_step: Some(2), step_count: 0, ..with };
    server.client.step_session(taken).await.expect("two steps are taken");
    let session = server.get(&id).await;
    assert_eq!((session.step, session.state_hash, session.state()), (2, before, SessionState::Paused));

    // It fits where the other body has been sent away by a call that waits for the same step.
    let away: Vec<[f64; 3]> = upright().iter().map(|[x, y, z]| [*x, y + 9.0, *z]).collect();
    server.client.update_parameters(put(&id, "one", &away)).await.expect("nothing is there");
    server.client.update_parameters(crossing).await.expect("the other one will be gone");
    assert_eq!(server.step(&id, 3).await.step, 5);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_state_that_crosses_once_its_step_has_come_ends_the_session_with_that() {
    let mut server = Server::start().await;
    let id = server.session(two_sheets()).await;
    let later = v1::UpdateParametersRequest { at_step: 5, wait: true, ..put(&id, "other", &upright()) };
    let mut client = server.client.clone();
    let waiting = tokio::spawn(async move { client.update_parameters(later).await });
    server.until_pending(&id, 1).await;
    let step = v1::StepSessionRequest { step_count: 10, wait: true, ..v1::StepSessionRequest::of(&id) };
    let ended = server.client.step_session(step).await.expect_err("it cannot go on so");
    let refused = waiting.await.expect("a task").expect_err("it crosses");
    for status in [ended, refused] {
        assert_eq!(assert_reason(&status, Reason::InvalidChange)["step"], "5");
    }
    let session = server.get(&id).await;
    assert_eq!((session.step, session.state()), (5, SessionState::Failed));
    assert_eq!(session.failure.expect("a failure").reason, Reason::InvalidChange.name());
}
