//! What a server says beforehand of a session's memory lies close above what the session takes.

use std::sync::atomic::Ordering;

use bytes::Bytes;
use nappe_proto::v1::{
    self, MeshHeader, UploadMeshRequest, create_session_request::Scene,
    simulation_service_client::SimulationServiceClient, upload_mesh_request::Part,
};
use nappe_server::{App, Limits};
use nappe_sim::mesh::TriangleMesh;
use nappe_tests::meshes::{Surface, box12};
use tonic::transport::Channel;
use tonic_types::StatusExt as _;

use crate::{IGNORED, alone, peak_since, requests::runtime, server, used};

type Client = SimulationServiceClient<Channel>;

/// Memory (bytes) of a server with room for every scene here, and for no huge one.
const ROOM: u64 = 4 << 30;
/// Memory (bytes) of a server without room for a scene, but for its mesh.
const SCANT: u64 = 16 << 20;

async fn with_client(max_server_bytes: u64) -> (App, Client) {
    let limits = Limits { max_server_bytes, history_bytes_per_session: 1, ..Limits::default() };
    let (app, channel) = server(limits).await;
    (app, SimulationServiceClient::new(channel))
}

fn request(text: &str, precision: v1::Precision) -> v1::CreateSessionRequest {
    v1::CreateSessionRequest {
        scene: Some(Scene::SceneText(text.to_owned())),
        precision: precision.into(),
        thread_count: 2,
        ..v1::CreateSessionRequest::default()
    }
}

/// Bytes that a session needs, and those that are left, of a request that is refused.
async fn refused(client: &mut Client, request: v1::CreateSessionRequest) -> [u64; 2] {
    let status = client.create_session(request).await.expect_err("there is no room");
    let info = status.get_details_error_info().expect("every status has an ErrorInfo");
    assert_eq!(info.reason, "SERVER_MEMORY_FULL", "{status}");
    ["needed_bytes", "left_bytes"].map(|key| info.metadata[key].parse().expect("a number"))
}

/// Bytes that are left.
pub(crate) async fn left(client: &mut Client) -> u64 {
    let huge = "version = 1\ndt = 0.001\n[[body]]\nname = \"b\"\nmesh = { grid = [2000, 2000], spacing = 0.1 }\n\
                mass = { particle = 0.1 }\nsprings = { stretch = { stiffness = 1.0 }, shear = { stiffness = 1.0 }, \
                bend = { stiffness = 1.0 } }\n";
    refused(client, request(huge, v1::Precision::F64)).await[1]
}

/// Makes a mesh.
type Make = fn() -> TriangleMesh;

/// Uploads the sheet and the slab that the text names, and puts their ids there.
async fn with_meshes(client: &mut Client, text: &str) -> String {
    let known: [(&str, Make); 2] = [("SHEET", sheet), ("SLAB", slab)];
    let mut text = text.to_owned();
    for (name, mesh) in known {
        if text.contains(name) {
            text = text.replace(name, &upload(client, &mesh()).await);
        }
    }
    text
}

fn sheet() -> TriangleMesh {
    TriangleMesh::grid(200, 200, 0.01)
}

/// A box that lies under a third of the sheet.
fn slab() -> TriangleMesh {
    let Surface { points, triangles } = box12([0.0; 3], [1.1, 0.05, 0.36]);
    TriangleMesh { points, triangles, ..TriangleMesh::default() }
}

/// Uploads a mesh; gives its id.
async fn upload(client: &mut Client, mesh: &TriangleMesh) -> String {
    let header = MeshHeader {
        point_count: mesh.points.len() as u64,
        triangle_count: mesh.triangles.len() as u64,
        ..MeshHeader::default()
    };
    let points = mesh.points.as_flattened().iter().flat_map(|c| c.to_le_bytes());
    let data: Vec<u8> =
        points.chain(mesh.triangles.as_flattened().iter().flat_map(|i| i.to_le_bytes())).collect();
    let data = data.chunks(1 << 20).map(|piece| Part::Data(Bytes::copy_from_slice(piece)));
    let parts: Vec<Part> = std::iter::once(Part::Header(header)).chain(data).collect();
    let pieces = parts.into_iter().map(|part| UploadMeshRequest { part: Some(part) });
    let uploaded = client.upload_mesh(tokio_stream::iter(pieces)).await.expect("it is a mesh");
    uploaded.into_inner().mesh_id
}

/// Estimated and found bytes of a session: while it is built and takes its first steps, and after them.
async fn compare(text: &str, precision: v1::Precision) -> [[u64; 2]; 2] {
    let (app, mut client) = with_client(SCANT).await;
    let own = with_meshes(&mut client, text).await;
    let [build, _] = refused(&mut client, request(&own, precision)).await;
    app.shutdown().await;

    let (app, mut client) = with_client(ROOM).await;
    let own = with_meshes(&mut client, text).await;
    let (room, before) = (left(&mut client).await, used());
    let peak = peak_since(async {
        let made = client.create_session(request(&own, precision)).await.expect("it fits").into_inner();
        let session_id = made.session.expect("the answer has the session").session_id;
        let step =
            v1::StepSessionRequest { step_count: 3, wait: true, ..v1::StepSessionRequest::of(session_id) };
        client.step_session(step).await.expect("steps are taken");
    });
    let peak = peak.await as u64;
    let (steady, session) = ((used() - before) as u64, room - left(&mut client).await);
    app.shutdown().await;
    [[build, peak], [session, steady]]
}

/// A scene of one body with another one of the same kind a metre above.
fn with_one_above(text: &str) -> String {
    let (_, body) = text.split_once("[[body]]").expect("a scene of a body");
    let above = body.replace("\"b\"", "\"above\"");
    format!("{text}[[body]]{above}transform = {{ translate = [0, 1, 0] }}\n")
}

/// Sheets above each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pile {
    pub(crate) count: u32,
    /// Particles along each side of a sheet, 1 cm apart.
    pub(crate) side: usize,
    /// What they keep (m).
    pub(crate) thickness: f64,
    /// From one sheet to the next (m).
    pub(crate) apart: f64,
}

impl Pile {
    /// The name of a sheet.
    pub(crate) fn name(layer: u32) -> String {
        format!("sheet{layer}")
    }

    /// A scene of them.
    pub(crate) fn scene(&self) -> String {
        let Self { count, side, thickness, apart } = *self;
        let law = "{ stiffness = 1.0 }";
        let sheet = |layer: u32| {
            format!(
                "[[body]]\nname = \"{}\"\nmesh = {{ grid = [{side}, {side}], spacing = 0.01 }}\n\
                 mass = {{ particle = 0.01 }}\nintegrator = \"implicit_euler\"\nthickness = {thickness:e}\n\
                 springs = {{ stretch = {law}, shear = {law}, bend = {law} }}\n\
                 transform = {{ translate = [0, {:e}, 0] }}\n",
                Self::name(layer),
                apart * f64::from(layer)
            )
        };
        let sheets: String = (0..count).map(sheet).collect();
        format!("version = 1\ndt = 1e-3\n{sheets}")
    }
}

/// What a step of a session came to.
struct Stepped {
    /// The most bytes that were in use, from before it was made.
    peak: u64,
    /// Bytes that are counted for it.
    counted: u64,
    /// Why the step was not taken.
    reason: Option<String>,
}

/// Makes a session on a server of its own with so much memory (bytes), and takes a step.
async fn first_step(text: &str, max_server_bytes: u64) -> Stepped {
    let (app, mut client) = with_client(max_server_bytes).await;
    let (room, mut reason) = (left(&mut client).await, None);
    let peak = peak_since(async {
        let made =
            client.create_session(request(text, v1::Precision::F32)).await.expect("it fits").into_inner();
        let session_id = made.session.expect("the answer has the session").session_id;
        let step =
            v1::StepSessionRequest { step_count: 1, wait: true, ..v1::StepSessionRequest::of(session_id) };
        if let Err(status) = client.step_session(step).await {
            reason = status.get_details_error_info().map(|info| info.reason);
        }
    });
    let peak = peak.await as u64;
    let counted = room - left(&mut client).await;
    app.shutdown().await;
    Stepped { peak, counted, reason }
}

/// Scenes of some megabytes, in the ways that scenes are made.
fn scenes() -> Vec<(&'static str, String)> {
    [cloth_scenes(), snow_scenes()].concat()
}

fn cloth_scenes() -> Vec<(&'static str, String)> {
    let cloth = |mesh: &str, springs: &str, how: &str| {
        format!(
            "version = 1\ndt = 1e-4\n[[body]]\nname = \"b\"\nmesh = {{ {mesh} }}\nmass = {{ particle = 0.01 }}\n\
             {how}\nsprings = {{ {springs} }}\n"
        )
    };
    let law = "{ stiffness = 1.0 }";
    let all = format!("stretch = {law}, shear = {law}, bend = {law}");
    let implicit = "integrator = \"implicit_euler\"";
    let thick = format!("{implicit}\nthickness = 0.004");
    vec![
        (
            "cloth, lattice, explicit",
            cloth("grid = [200, 200], spacing = 0.01", &all, "integrator = \"symplectic_euler\""),
        ),
        ("cloth, lattice, implicit", cloth("grid = [200, 200], spacing = 0.01", &all, implicit)),
        (
            "cloth, lattice, air",
            cloth(
                "grid = [200, 200], spacing = 0.01",
                &format!("stretch = {law}"),
                &format!("{implicit}\nair = {{}}"),
            ),
        ),
        (
            "cloth, two levels",
            cloth(
                "grid = [200, 200], spacing = 0.01",
                &all,
                &format!("{implicit}\nsolver = {{ preconditioner = \"two_level\" }}"),
            ),
        ),
        (
            "cloth, patches",
            cloth(
                "grid = [200, 200], spacing = 0.01, ripple = 0.002",
                &all.replace("1.0", "1e10"),
                &format!("{implicit}\nsolver = {{ preconditioner = \"patches\" }}"),
            ),
        ),
        (
            "cloth, lattice, stretch",
            cloth("grid = [200, 200], spacing = 0.01", &format!("stretch = {law}"), implicit),
        ),
        (
            "cloth, bdf2 by Newton",
            cloth("grid = [200, 200], spacing = 0.01", &all, "integrator = \"bdf2\"\nminimizer = \"newton\""),
        ),
        (
            "cloth, vertex block descent",
            cloth("grid = [200, 200], spacing = 0.01", &all, "minimizer = \"vertex_block_descent\""),
        ),
        ("cloth, thickness", cloth("grid = [200, 200], spacing = 0.01", &all, &thick)),
        (
            "cloth, two with a thickness",
            with_one_above(&cloth("grid = [200, 100], spacing = 0.01", &all, &thick)),
        ),
        ("cloth, edges of an upload", cloth("upload = \"SHEET\"", &all, implicit)),
        (
            "cloth, chain",
            cloth("chain = 40000, spacing = 0.01", &format!("stretch = {law}, bend = {law}"), implicit),
        ),
    ]
}

fn snow_scenes() -> Vec<(&'static str, String)> {
    let snow = |keys: &str, object: &str| {
        format!(
            "version = 1\ndt = 1e-4\n[snow]\ncell = 0.02\n{keys}\n[[snow.object]]\nname = \"s\"\n\
             sphere = {{ center = [0, 1, 0], radius = 0.4 }}\nparticles = 100000\n{object}\n"
        )
    };
    vec![
        ("snow, mls", snow("", "")),
        ("snow, pic_flip", snow("transfer = \"pic_flip\"", "volume = \"grid\"")),
        ("snow, semi-implicit", snow("transfer = \"pic_flip\"\nbeta = 0.5", "")),
        ("snow, poisson, thin", snow("", "sampling = \"poisson\"").replace("cell = 0.02", "cell = 0.01")),
    ]
}

/// A sheet with a thickness just above three slabs, each of which is a mesh: all of its particles are near one.
fn on_three_meshes() -> String {
    let law = "{ stiffness = 1.0 }";
    let slab = |(number, z): (usize, f64)| {
        format!(
            "[[collider]]\nname = \"slab{number}\"\nmargin = 0.001\n\
             mesh = {{ upload = \"SLAB\", transform = {{ translate = [1, -0.0511, {z:?}] }} }}\n"
        )
    };
    let slabs: String = [0.27, 1.0, 1.73].into_iter().enumerate().map(slab).collect();
    format!(
        "version = 1\ndt = 1e-4\n[[body]]\nname = \"b\"\nmesh = {{ grid = [200, 200], spacing = 0.01 }}\n\
         mass = {{ particle = 0.01 }}\nintegrator = \"implicit_euler\"\nthickness = 0.004\n\
         springs = {{ stretch = {law}, shear = {law}, bend = {law} }}\n{slabs}"
    )
}

#[test]
fn estimates_of_memory_lie_close_above_what_is_taken() {
    compare_all(&scenes(), 1.5);
}

#[test]
fn of_thick_cloth_on_three_meshes_an_estimate_is_less_than_a_third_too_much() {
    compare_all(&[("cloth, thickness, on three meshes", on_three_meshes())], 1.3);
}

/// Fails where an estimate is less than what is taken, or more than so many times as much.
fn compare_all(scenes: &[(&str, String)], most: f64) {
    let _alone = alone();
    // What the server asks for only to see whether it is there is larger than any array of these scenes.
    IGNORED.store(128 << 20, Ordering::Relaxed);
    let mut wrong = Vec::new();
    println!(
        "{:28} {:4} {:>12} {:>12} {:>5}  {:>12} {:>12} {:>5}",
        "scene", "", "build", "found", "", "session", "found", ""
    );
    for (name, text) in scenes {
        for precision in [v1::Precision::F32, v1::Precision::F64] {
            let [[build, peak], [session, steady]] = runtime().block_on(compare(text, precision));
            let ratios = [build as f64 / peak as f64, session as f64 / steady as f64];
            let label = if precision == v1::Precision::F32 { "f32" } else { "f64" };
            let line = format!(
                "{name:28} {label:4} {build:12} {peak:12} {:5.2}  {session:12} {steady:12} {:5.2}",
                ratios[0], ratios[1]
            );
            println!("{line}");
            if !ratios.iter().all(|ratio| (1.0..=most).contains(ratio)) {
                wrong.push(line);
            }
        }
    }
    IGNORED.store(usize::MAX, Ordering::Relaxed);
    assert!(wrong.is_empty(), "beyond 1.0 to {most}:\n{}", wrong.join("\n"));
}

/// A thousand bodies of four particles each.
fn small_bodies(integrator: &str) -> String {
    let law = "{ stiffness = 1.0 }";
    let body = |number: u32| {
        format!(
            "[[body]]\nname = \"body{number}\"\nmesh = {{ grid = [2, 2], spacing = 0.01 }}\n\
             mass = {{ particle = 0.01 }}\nintegrator = \"{integrator}\"\n\
             springs = {{ stretch = {law}, shear = {law} }}\n"
        )
    };
    let bodies: String = (0..1000).map(body).collect();
    format!("version = 1\ndt = 1e-4\n{bodies}")
}

#[test]
fn a_body_counts_however_few_particles_it_has() {
    let _alone = alone();
    IGNORED.store(128 << 20, Ordering::Relaxed);
    for integrator in ["symplectic_euler", "implicit_euler"] {
        for precision in [v1::Precision::F32, v1::Precision::F64] {
            let text = small_bodies(integrator);
            let [[build, peak], [session, steady]] = runtime().block_on(compare(&text, precision));
            println!(
                "{integrator}, {precision:?}: build {build}, found {peak}; session {session}, found {steady}"
            );
            assert!(peak <= build && steady <= session, "{integrator}, {precision:?}: more than is counted");
            // What a body takes depends on how it is stepped: the most is counted for each.
            assert!(build <= 3 * peak && session <= 3 * steady, "{integrator}, {precision:?}: far less");
        }
    }
    IGNORED.store(usize::MAX, Ordering::Relaxed);
}

#[test]
fn pairs_of_surfaces_take_little_more_than_is_counted_or_end_their_session() {
    let _alone = alone();
    IGNORED.store(128 << 20, Ordering::Relaxed);
    // A thickness from one sheet to the next, and a quarter.
    for (side, apart) in [(20, 4e-3), (14, 1e-3)] {
        let text = Pile { count: 20, side, thickness: 0.004, apart }.scene();
        let Stepped { peak, counted, reason } = runtime().block_on(first_step(&text, ROOM));
        println!("{side} x {side}, {apart} m apart: {peak} bytes, {counted} counted, {reason:?}");
        assert!(reason.is_none_or(|reason| reason == "CONTACT"), "it has room");
        assert!(counted > 32 << 20, "pairs are counted: {counted} bytes");
        assert!(10 * peak <= 13 * counted, "{peak} bytes, {counted} counted");

        let scant = 20 << 20;
        let Stepped { peak, reason, .. } = runtime().block_on(first_step(&text, scant));
        println!("with {scant} bytes: {peak}, {reason:?}");
        assert_eq!(reason.as_deref(), Some("SERVER_MEMORY_FULL"));
        assert!(10 * peak <= 13 * scant, "{peak} bytes of {scant}");
    }
    IGNORED.store(usize::MAX, Ordering::Relaxed);
}
