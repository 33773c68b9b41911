//! Sessions that begin at a saved frame: their clock, frame 0 and the bits that follow; and frames at which none begins.

use bytes::Bytes;
use nappe_proto::v1::{
    self, Encoding, Field, MeshHeader, SessionState, UploadMeshRequest, create_session_request::Scene,
    upload_mesh_request::Part,
};
use nappe_server::Reason;
use tonic::Status;

use crate::{
    cloth_scenes::sheet_with,
    frames::Whole,
    harness::{Server, assert_reason, every, request},
    snow_scenes::snow,
};

/// A sheet of 36 particles in a gust, with a pin that moves.
fn timed() -> String {
    let gust = "{ time = 0.01, velocity = [0, 0, 0] }, { time = 0.04, velocity = [3, 0, 2] }";
    let moving = "[[body.moving_pin]]\npin = \"top_left\"\noffset = [0.05, 0.05, 0]\nduration = 0.07\n";
    sheet_with(6, &format!("precision = \"f64\"\nsteps = 40\nwind_at = [{gust}]\n")) + moving
}

/// The newest frame of a session, with exact positions and velocities.
async fn frame(server: &mut Server, id: &str) -> Whole {
    let from_frame = server.get(id).await.frame;
    let mut watch = server
        .watch(v1::WatchFramesRequest {
            fields: vec![Field::Positions.into(), Field::Velocities.into()],
            encoding: Encoding::RawF64.into(),
            ..every(id, from_frame)
        })
        .await;
    watch.frame().await
}

/// Uploads points with velocities, packed.
async fn upload(server: &mut Server, positions: &[u8], velocities: &[u8]) -> String {
    let header = MeshHeader {
        name: "frame".into(),
        point_count: positions.len() as u64 / 24,
        velocity_count: velocities.len() as u64 / 24,
        ..MeshHeader::default()
    };
    let data = Bytes::from([positions, velocities].concat());
    let parts = [Part::Header(header), Part::Data(data)];
    let messages = parts.map(|part| UploadMeshRequest { part: Some(part) });
    let uploaded = server.client.upload_mesh(tokio_stream::iter(messages)).await;
    uploaded.expect("a good mesh").into_inner().mesh_id
}

/// What a request says of a frame.
async fn begin(server: &mut Server, frame: &Whole) -> v1::Begin {
    let bytes = |field: Field| frame.fields[&i32::from(field)].clone();
    let upload_id = upload(server, &bytes(Field::Positions), &bytes(Field::Velocities)).await;
    let v1::Frame { step, time_seconds, carried, .. } = frame.head.clone();
    v1::Begin { step, time_seconds: Some(time_seconds), upload_id, carried }
}

async fn create(
    server: &mut Server,
    text: String,
    begin: v1::Begin,
) -> Result<(v1::Session, Vec<String>), Status> {
    let scene = Some(Scene::SceneText(text));
    let request = v1::CreateSessionRequest { scene, begin: Some(begin), ..request() };
    let made = server.client.create_session(request).await?.into_inner();
    Ok((made.session.expect("the answer has the session"), made.warnings))
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_begins_at_a_frame_has_its_clock_and_goes_on_to_the_same_end() {
    let mut server = Server::start().await;
    let whole = server.session(timed()).await;
    let cut = server.step(&whole, 15).await;
    let saved = frame(&mut server, &whole).await;
    assert_eq!((saved.head.step, saved.head.carried.is_some()), (15, true));
    let plain = server.watch(every(&whole, 15)).await.frame().await;
    assert_eq!(plain.head.carried, None, "frames without velocities say nothing of it");

    let at = begin(&mut server, &saved).await;
    let (begun, warnings) = create(&mut server, timed(), at).await.expect("a frame of the same scene");
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!((begun.step, begun.time_seconds, begun.frame), (15, cut.time_seconds, 0));
    assert_eq!((begun.state(), begun.step_limit), (SessionState::Paused, 40));
    assert_eq!((begun.state_hash, &begun.parameters), (cut.state_hash, &cut.parameters));
    let id = begun.session_id.clone();
    let first = frame(&mut server, &id).await;
    assert_eq!((first.head.frame, first.head.step, &first.fields), (0, 15, &saved.fields));
    assert_eq!(first.head.carried, saved.head.carried);

    let (end, other) = (server.step(&whole, 25).await, server.step(&id, 25).await);
    assert_eq!((end.step, end.state()), (40, SessionState::Finished));
    assert_eq!((other.step, other.state(), other.state_hash), (40, SessionState::Finished, end.state_hash));
    assert!(other.largest_stretch >= other.diagnostics.expect("diagnostics").max_stretch);
    assert!(end.largest_stretch >= other.largest_stretch && end.largest_stretch_seconds <= end.time_seconds);

    // Another session puts bodies back to the start of the scene, and time goes on.
    let at = begin(&mut server, &saved).await;
    let (again, _) = create(&mut server, timed(), at).await.expect("a frame of the same scene");
    let reset = v1::ResetSessionRequest::of(&again.session_id);
    server.client.reset_session(reset).await.expect("it is put back");
    let id = again.session_id;
    let (start, back) = (server.session(timed()).await, frame(&mut server, &id).await);
    assert_eq!((back.head.step, back.fields), (15, frame(&mut server, &start).await.fields));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_frame_lacks_is_told() {
    let mut server = Server::start().await;
    let whole = server.session(timed()).await;
    server.step(&whole, 7).await;
    let saved = frame(&mut server, &whole).await;
    let mut at = begin(&mut server, &saved).await;
    let carried = at.carried.take();
    let (_, warnings) = create(&mut server, timed(), at.clone()).await.expect("positions are enough");
    assert!(warnings.len() == 1 && warnings[0].contains("does not say what steps depend on"), "{warnings:?}");
    for (missing, told) in
        [("past", "bdf2"), ("warm_start", "warm_start"), ("patches", "patches"), ("pins", "pins")]
    {
        let carried = carried.clone().map(|carried| v1::Carried { missing: vec![missing.into()], ..carried });
        let at = v1::Begin { carried, ..at.clone() };
        let (_, warnings) = create(&mut server, timed(), at).await.expect("it may differ");
        assert!(warnings.len() == 1 && warnings[0].contains(told), "{missing}: {warnings:?}");
    }

    // Gravity that a call changed is in no frame.
    let gravity = Some([0.0, -1.0, 0.0].into());
    let call = v1::UpdateParametersRequest { gravity, ..v1::UpdateParametersRequest::of(&whole) };
    server.client.update_parameters(call).await.expect("accepted");
    server.step(&whole, 1).await;
    let changed = frame(&mut server, &whole).await;
    assert_eq!(changed.head.carried.as_ref().expect("numbers").missing, ["calls"]);
    let at = begin(&mut server, &changed).await;
    let refused = create(&mut server, timed(), at).await.expect_err("the scene has another gravity");
    assert_eq!(assert_reason(&refused, Reason::InvalidField)["field"], "begin.carried.missing");
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_that_do_not_fit_are_refused_by_what_is_wrong() {
    let mut server = Server::start().await;
    let whole = server.session(timed()).await;
    server.step(&whole, 9).await;
    let saved = frame(&mut server, &whole).await;
    let good = begin(&mut server, &saved).await;
    let bytes = vec![0; 25 * 24];
    let (still, few) = (upload(&mut server, &bytes, &[]).await, upload(&mut server, &bytes, &bytes).await);
    let carrying = |numbers: Vec<f64>, missing: &[&str]| {
        let missing = missing.iter().map(|name| (*name).to_owned()).collect();
        v1::Begin { carried: Some(v1::Carried { numbers, missing }), ..good.clone() }
    };
    let numbers = good.carried.clone().expect("numbers").numbers;

    let (timeless, lost) = (Some(f64::NAN), "mesh-none".to_owned());
    for (at, field, told) in [
        (v1::Begin { step: 40, time_seconds: None, ..good.clone() }, "begin.step", "ends after 40 steps"),
        (v1::Begin { step: 1 << 60, ..good.clone() }, "begin.step", "allowed are at most"),
        (v1::Begin { step: 8, ..good.clone() }, "begin.time_seconds", "step 8 of the scene"),
        (v1::Begin { time_seconds: timeless, ..good.clone() }, "begin.time_seconds", "is NaN"),
        (v1::Begin { upload_id: still, ..good.clone() }, "begin.upload_id", "has no velocities"),
        (
            v1::Begin { upload_id: few, ..good.clone() },
            "begin.upload_id",
            "has 25 particles, and the scene has 36 (sheet 36)",
        ),
        (carrying(Vec::new(), &[]), "begin.carried.numbers", "none that this version tells"),
        (
            carrying(vec![f64::NAN; numbers.len()], &[]),
            "begin.carried.numbers",
            "none that this version tells",
        ),
        (carrying(numbers, &["luck"]), "begin.carried.missing", "has 'luck'; there are: calls"),
    ] {
        let refused = create(&mut server, timed(), at).await.expect_err(told);
        assert_eq!(assert_reason(&refused, Reason::InvalidField)["field"], field, "{refused:?}");
        assert!(refused.message().contains(told), "{}, not {told}", refused.message());
    }
    let at = v1::Begin { upload_id: lost, ..good.clone() };
    let refused = create(&mut server, timed(), at).await.expect_err("there is no such upload");
    assert_reason(&refused, Reason::MeshNotFound);
    // A scene without the moving pin, and one of snow.
    let still = timed().split("[[body.moving_pin]]").next().expect("a text").to_owned();
    for (text, told) in [(still, "pins of sheet were on ways"), (snow(""), "is snow")] {
        let at = v1::Begin { time_seconds: None, ..good.clone() };
        let refused = create(&mut server, text, at).await.expect_err(told);
        assert_reason(&refused, Reason::InvalidField);
        assert!(refused.message().contains(told), "{}, not {told}", refused.message());
    }
}
