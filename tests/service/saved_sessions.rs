//! Sessions as files: saved from one server, they go on in another one with the same bits.

use nappe_proto::v1::{self, SessionState, create_session_request::Scene, upload_mesh_request::Part};
use nappe_server::{
    Limits, Reason,
    state::{Opened, Section},
};
use tonic::Status;

use crate::{
    cloth_scenes::{sheet, sheet_with},
    frames::in_time,
    harness::{Server, assert_reason, every, request},
    snow_scenes::{ball, snow},
};

/// The file of a session, put together from its pieces.
pub(crate) async fn save(server: &mut Server, id: &str) -> Result<Vec<u8>, Status> {
    let mut stream = server.client.save_session(v1::SaveSessionRequest::of(id)).await?.into_inner();
    let (mut file, mut byte_count) = (Vec::new(), 0);
    while let Some(piece) = in_time(stream.message()).await? {
        assert!((1..=1 << 20).contains(&piece.data.len()));
        byte_count = piece.byte_count;
        file.extend_from_slice(&piece.data);
    }
    assert_eq!(file.len() as u64, byte_count);
    Ok(file)
}

/// Uploads a file, and returns its id.
pub(crate) async fn upload(server: &mut Server, file: &[u8]) -> Result<String, Status> {
    let format = v1::FileFormat::Checkpoint.into();
    let header = v1::FileHeader { format, byte_count: file.len() as u64, ..v1::FileHeader::default() };
    let pieces = file.chunks(1 << 20).map(|piece| Part::Data(piece.to_vec().into()));
    let parts = [Part::File(header)].into_iter().chain(pieces);
    let messages: Vec<_> = parts.map(|part| v1::UploadMeshRequest { part: Some(part) }).collect();
    let answer = server.client.upload_mesh(tokio_stream::iter(messages)).await?;
    Ok(answer.into_inner().mesh_id)
}

fn going_on(checkpoint_id: &str, session_id: &str) -> v1::CreateSessionRequest {
    let scene = Some(Scene::CheckpointId(checkpoint_id.into()));
    v1::CreateSessionRequest { session_id: session_id.into(), scene, ..request() }
}

/// Makes a session that goes on from a file.
pub(crate) async fn create(
    server: &mut Server,
    file: &[u8],
    id: &str,
) -> Result<v1::CreateSessionResponse, Status> {
    let checkpoint = upload(server, file).await?;
    Ok(server.client.create_session(going_on(&checkpoint, id)).await?.into_inner())
}

/// The session of an answer.
pub(crate) fn session(answer: v1::CreateSessionResponse) -> v1::Session {
    answer.session.expect("the answer has the session")
}

/// A scene of an uploaded mesh of three points.
fn of_mesh(id: &str) -> String {
    format!(
        "version = 1\ndt = 0.001\n[[body]]\nname = \"t\"\nmesh = {{ upload = \"{id}\" }}\n\
         mass = {{ particle = 0.1 }}\nsprings = {{ stretch = {{ stiffness = 10 }} }}\npins = [0]\n"
    )
}

async fn reset(server: &mut Server, id: &str) {
    server.client.reset_session(v1::ResetSessionRequest::of(id)).await.expect("it is reset");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_was_saved_goes_on_in_another_server_with_the_same_bits() {
    let (mut first, mut second) = (Server::start().await, Server::start().await);
    let both = sheet_with(5, "") + &ball("");
    let scenes = [
        ("narrow", sheet(8), v1::Precision::F32),
        ("wide", sheet(8), v1::Precision::F64),
        ("snow", snow(""), v1::Precision::F32),
        ("snow-wide", snow(""), v1::Precision::F64),
        ("both", both, v1::Precision::F32),
    ];
    for (id, text, precision) in scenes {
        let scene = Some(Scene::SceneText(text));
        let asked = v1::CreateSessionRequest { session_id: id.into(), scene, ..request() };
        first.create(v1::CreateSessionRequest { precision: precision.into(), ..asked }).await;
        if ["narrow", "wide"].contains(&id) {
            // A pin on its way, forces, and a change that waits.
            let pin =
                v1::PinUpdate { particle: 0, target: Some([0.0, 0.1, 0.1].into()), duration_seconds: 0.2 };
            let force = Some([0.0, 1e-4, 0.0].into());
            let forces = vec![v1::ForceUpdate { body: "sheet".into(), force, ..v1::ForceUpdate::default() }];
            let calls = v1::UpdateParametersRequest {
                pins: vec![pin],
                forces,
                ..v1::UpdateParametersRequest::of(id)
            };
            first.client.update_parameters(calls).await.expect("accepted");
            let wind = v1::UpdateParametersRequest {
                at_step: 60,
                wind: Some([2.0, 0.0, 0.0].into()),
                drag: Some(0.01),
                ..v1::UpdateParametersRequest::of(id)
            };
            first.client.update_parameters(wind).await.expect("accepted");
        }
        let original = first.step(id, 37).await;
        let file = save(&mut first, id).await.expect("it is saved");
        let again = session(create(&mut second, &file, id).await.expect("it goes on"));
        assert_eq!((again.step, again.frame, again.state()), (37, original.frame, SessionState::Paused));
        assert_eq!((again.state_hash, &again.diagnostics), (original.state_hash, &original.diagnostics));
        assert_eq!((again.time_seconds, again.precision), (original.time_seconds, original.precision));
        assert_eq!((&again.parameters, &again.title), (&original.parameters, &original.title));
        assert_ne!(again.uid, original.uid);

        for steps in [200, 10] {
            let (original, again) = (first.step(id, steps).await, second.step(id, steps).await);
            assert_eq!((again.step, again.frame), (original.step, original.frame), "{id}");
            assert_eq!(again.state_hash, original.state_hash, "{id} after {steps} steps more");
            reset(&mut first, id).await;
            reset(&mut second, id).await;
        }
        // What goes on is saved as well as what began by itself, without its scene.
        let [original, again] = [first.step(id, 3).await, second.step(id, 3).await];
        let file = save(&mut second, id).await.expect("it is saved");
        let third = session(create(&mut first, &file, &format!("{id}-third")).await.expect("it goes on"));
        assert_eq!((again.state_hash, third.state_hash), (original.state_hash, original.state_hash), "{id}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_go_on_with_the_next_number_and_the_newest_is_there() {
    let (mut first, mut second) = (Server::start().await, Server::start().await);
    let id = first.session(sheet_with(6, "frame_interval = 5\nhash_interval = 1")).await;
    let original = first.step(&id, 37).await;
    assert_eq!(original.frame, 7);
    let file = save(&mut first, &id).await.expect("it is saved");
    let again = session(create(&mut second, &file, "again").await.expect("it goes on"));
    assert_eq!((again.frame, again.oldest_frame, again.frame_interval_steps), (7, 7, 5));

    let (mut original, mut again) = (first.watch(every(&id, 7)).await, second.watch(every("again", 7)).await);
    assert_eq!(original.topology.bodies, again.topology.bodies);
    first.step(&id, 13).await;
    second.step("again", 13).await;
    for (number, step) in [(7, 35), (8, 40), (9, 45), (10, 50)] {
        let (original, again) = (original.frame().await, again.frame().await);
        assert_eq!((again.head.frame, again.head.step), (number, step));
        assert_eq!(
            (again.head.state_hash, again.head.time_seconds),
            (original.head.state_hash, original.head.time_seconds)
        );
        assert_eq!(again.fields, original.fields, "frame {number}");
    }

    // More fields of the newest frame are made again where its state still stands.
    let file = save(&mut first, &id).await.expect("it is saved");
    session(create(&mut second, &file, "at-a-frame").await.expect("it goes on"));
    let fields = vec![v1::Field::Positions.into(), v1::Field::Velocities.into()];
    let asked = v1::WatchFramesRequest { fields, ..every("at-a-frame", 10) };
    let frame = second.watch(asked).await.frame().await;
    assert_eq!((frame.head.frame, frame.fields.len()), (10, 2));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_of_a_mesh_is_saved_after_the_mesh_is_forgotten() {
    let mut first = Server::with(Limits { max_meshes: 1, ..Limits::default() }).await;
    let points: Vec<u8> = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0_f64]]
        .as_flattened()
        .iter()
        .flat_map(|number| number.to_le_bytes())
        .collect();
    let corners = [0_u32, 1, 2].iter().flat_map(|corner| corner.to_le_bytes()).collect::<Vec<u8>>();
    let header = v1::MeshHeader { point_count: 3, triangle_count: 1, ..v1::MeshHeader::default() };
    let parts = [Part::Header(header), Part::Data([points, corners].concat().into())];
    let messages: Vec<_> = parts.map(|part| v1::UploadMeshRequest { part: Some(part) }).into();
    let mesh = first.client.upload_mesh(tokio_stream::iter(messages)).await.expect("a mesh").into_inner();
    let scene = of_mesh(&mesh.mesh_id);
    let id = first.session(scene.clone()).await;
    let original = first.step(&id, 5).await;
    let file = save(&mut first, &id).await.expect("it is saved");
    // The file takes the place of the mesh.
    let again = session(create(&mut first, &file, "again").await.expect("it goes on"));
    assert_eq!(again.state_hash, original.state_hash);
    let asked = v1::CreateSessionRequest { scene: Some(Scene::SceneText(scene)), ..request() };
    let refused = first.client.create_session(asked).await.expect_err("the mesh is forgotten");
    assert_reason(&refused, Reason::MeshNotFound);
    let later = save(&mut first, &id).await.expect("it is saved again");
    let setup = |file: &[u8]| Opened::of(file).expect("a good file").section(Section::Setup).to_vec();
    assert_eq!(setup(&later), setup(&file));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_at_its_end_goes_on_and_one_that_plays_is_saved_between_two_steps() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(4, "steps = 10")).await;
    server.step(&id, 10).await;
    let file = save(&mut server, &id).await.expect("it is saved");
    let further = session(create(&mut server, &file, "further").await.expect("it goes on"));
    assert_eq!((further.step, further.step_limit, further.state()), (10, 0, SessionState::Paused));
    let checkpoint = upload(&mut server, &file).await.expect("it is good");
    let asked = v1::CreateSessionRequest { step_limit: Some(12), ..going_on(&checkpoint, "to-twelve") };
    server.create(asked).await;
    assert_eq!(server.step("to-twelve", 2).await.state(), SessionState::Finished);

    server.play("further").await;
    let file = save(&mut server, "further").await.expect("it is saved");
    let copy = session(create(&mut server, &file, "copy").await.expect("it goes on"));
    assert!(copy.step >= 10 && copy.state() == SessionState::Paused);
    assert_eq!(server.get("further").await.state(), SessionState::Playing, "it plays on");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_be_saved_or_made_of_a_file_is_refused() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    let refused = save(&mut server, "nobody").await.expect_err("no session");
    assert_reason(&refused, Reason::SessionNotFound);
    let other = v1::SaveSessionRequest { session_uid: "other".into(), ..v1::SaveSessionRequest::of(&id) };
    let refused = server.client.save_session(other).await.expect_err("another session");
    assert_reason(&refused, Reason::SessionReplaced);

    let file = save(&mut server, &id).await.expect("it is saved");
    let checkpoint = upload(&mut server, &file).await.expect("it is good");
    let wrong =
        v1::CreateSessionRequest { precision: v1::Precision::F64.into(), ..going_on(&checkpoint, "") };
    let refused = server.client.create_session(wrong).await.expect_err("another precision");
    assert_eq!(assert_reason(&refused, Reason::InvalidField)["field"], "precision");
    let begin = Some(v1::Begin::default());
    let wrong = v1::CreateSessionRequest { begin, ..going_on(&checkpoint, "") };
    let refused = server.client.create_session(wrong).await.expect_err("a frame");
    assert_eq!(assert_reason(&refused, Reason::InvalidField)["field"], "begin");
    let refused = server.client.create_session(going_on(&checkpoint, &id)).await.expect_err("its own id");
    assert_reason(&refused, Reason::SessionExists);
    let refused = server.client.create_session(going_on("mesh-1", "")).await.expect_err("no file");
    assert_eq!(assert_reason(&refused, Reason::CheckpointNotFound)["checkpoint_id"], "mesh-1");

    // The file is no mesh, and one upload serves several sessions.
    let scene = of_mesh(&checkpoint);
    let asked = v1::CreateSessionRequest { scene: Some(Scene::SceneText(scene)), ..request() };
    let refused = server.client.create_session(asked).await.expect_err("no mesh");
    assert_reason(&refused, Reason::MeshNotFound);
    server.create(going_on(&checkpoint, "one")).await;
    server.create(going_on(&checkpoint, "two")).await;

    assert!(server.app.inject_panic("two"));
    server.play("two").await;
    server.until("two", |session| session.state() == SessionState::Failed).await;
    let refused = save(&mut server, "two").await.expect_err("it failed");
    assert_reason(&refused, Reason::SessionFailed);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_counts_against_the_memory_of_the_server_and_its_uploads() {
    let (history_bytes_per_session, max_server_bytes) = (1 << 30, 3 << 29);
    let limits = Limits { history_bytes_per_session, max_server_bytes, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let id = server.session(sheet(4)).await;
    let refused = save(&mut server, &id).await.expect_err("room for one");
    assert_reason(&refused, Reason::ServerMemoryFull);
    assert_eq!(server.step(&id, 2).await.step, 2);

    let mut server = Server::with(Limits { max_uploads: 0, ..Limits::default() }).await;
    let id = server.session(sheet(4)).await;
    let refused = save(&mut server, &id).await.expect_err("no place");
    assert_reason(&refused, Reason::TooManyUploads);
}
