//! The largest messages of every method that limits allow, which name what is large.
//!
//! Enters: limits, and ids that a server gave. Leaves: messages, each with as many bytes as are allowed.

use bytes::Bytes;
use nappe_proto::v1::{
    self, begin_upload_request::Header, create_session_request::Scene, grid_request::Selection,
    upload_mesh_request::Part,
};
use nappe_server::Limits;
use prost::Message;

use crate::contract::{Method, padded};

/// A session of as many particles as are allowed.
const LARGE: &str = "large";
/// One that is made from the largest mesh.
const UPLOADED: &str = "uploaded";
/// One whose state fits into a message.
const PUT: &str = "to-be-put";
/// Cloth with pins, air and a collider.
const SHEET: &str = "sheet";
const SNOW: &str = "snow";
const STOPPED: &str = "to-be-stopped";
const FORKED: &str = "forked";

/// Particles of the session whose state fits into a message.
const PUT_COUNT: usize = 80_000;
/// Points of an upload in calls of one message each: of one piece.
const PIECE_POINTS: u64 = (1 << 20) / 24;
/// Bytes of a request that needs no token, and of the prefix of a message.
const OPEN_BYTES: usize = (1 << 10) - 5;
/// Names of the fields of particles, all of them.
const FIELDS: [i32; 4] = [1, 2, 3, 4];
/// Simulated seconds per second of sessions that play: they take little of the processor.
const SLOWLY: f64 = 0.01;

/// What messages are made from.
#[derive(Debug)]
pub(crate) struct Names {
    limits: Limits,
    /// The largest mesh that was uploaded last.
    mesh: String,
    /// The upload that began last.
    upload: String,
    /// The link that was made last.
    link: String,
}

impl Names {
    pub(crate) fn new(limits: &Limits) -> Self {
        Self { limits: limits.clone(), mesh: String::new(), upload: String::new(), link: String::new() }
    }

    /// Takes what an answer of a method names.
    pub(crate) fn take(&mut self, method: &Method, answer: &Bytes) {
        let answer = answer.clone();
        match method.name.as_str() {
            "UploadMesh" => self.mesh = read::<v1::UploadMeshResponse>(answer).mesh_id,
            "BeginUpload" => self.upload = read::<v1::BeginUploadResponse>(answer).upload_id,
            "MakeLink" => self.link = read::<v1::MakeLinkResponse>(answer).code,
            _ => {}
        }
    }

    /// Every call of a method with its largest messages.
    ///
    /// # Panics
    /// If the method has none here: it needs some.
    pub(crate) fn calls(&self, method: &Method) -> Vec<Vec<Bytes>> {
        let name = method.name.as_str();
        if name == "UploadMesh" {
            return vec![self.mesh_in_pieces()];
        }
        let messages = self
            .of_uploads(name)
            .or_else(|| self.of_sessions(name))
            .or_else(|| self.of_changes(name))
            .or_else(|| self.of_streams(name));
        let messages =
            messages.unwrap_or_else(|| panic!("the method {name} of the contract has no calls here"));
        let most = if name == "OpenLink" { OPEN_BYTES } else { self.limits.max_message_bytes as usize };
        messages.into_iter().map(|message| vec![padded(message, most).into()]).collect()
    }

    /// The header of the largest mesh: points, masses, velocities, and triangles up to the limit.
    fn largest_mesh(&self) -> v1::MeshHeader {
        let points = self.limits.max_particles;
        v1::MeshHeader {
            name: "x".repeat(256),
            point_count: points,
            mass_count: points,
            velocity_count: points,
            triangle_count: (self.limits.max_mesh_bytes - 56 * points) / 12,
            uv_count: 0,
        }
    }

    fn mesh_in_pieces(&self) -> Vec<Bytes> {
        let header = self.largest_mesh();
        let total = 56 * header.point_count + 12 * header.triangle_count;
        let piece = |bytes: u64| {
            let part = Part::Data(vec![0; bytes as usize].into());
            Bytes::from(v1::UploadMeshRequest { part: Some(part) }.encode_to_vec())
        };
        let header = v1::UploadMeshRequest { part: Some(Part::Header(header)) }.encode_to_vec();
        let mut messages = vec![padded(header, self.limits.max_message_bytes as usize).into()];
        messages.extend(vec![piece(1 << 20); (total >> 20) as usize]);
        if !total.is_multiple_of(1 << 20) {
            messages.push(piece(total % (1 << 20)));
        }
        messages
    }

    fn of_uploads(&self, method: &str) -> Option<Vec<Vec<u8>>> {
        let upload_id = self.upload.clone();
        Some(match method {
            "BeginUpload" => {
                let format = v1::FileFormat::Obj.into();
                let byte_count = self.limits.max_mesh_bytes;
                let file = v1::FileHeader { format, byte_count, ..v1::FileHeader::default() };
                let small = v1::MeshHeader { point_count: PIECE_POINTS, ..v1::MeshHeader::default() };
                let headers = [Header::File(file), Header::Mesh(self.largest_mesh()), Header::Mesh(small)];
                let begin = |header| v1::BeginUploadRequest { header: Some(header) }.encode_to_vec();
                headers.into_iter().map(begin).collect()
            }
            "AppendUpload" => {
                let data = vec![0; 24 * PIECE_POINTS as usize].into();
                vec![v1::AppendUploadRequest { upload_id, offset: 0, data }.encode_to_vec()]
            }
            "FinishUpload" => vec![v1::FinishUploadRequest { upload_id }.encode_to_vec()],
            _ => return None,
        })
    }

    fn of_sessions(&self, method: &str) -> Option<Vec<Vec<u8>>> {
        Some(match method {
            "CreateSession" => self.sessions().iter().map(Message::encode_to_vec).collect(),
            "ForkSession" => {
                let new_session_id = FORKED.to_owned();
                vec![
                    v1::ForkSessionRequest { new_session_id, ..v1::ForkSessionRequest::of(LARGE) }
                        .encode_to_vec(),
                ]
            }
            "SaveSession" => of(|id| v1::SaveSessionRequest::of(id).encode_to_vec(), &[LARGE, SHEET, SNOW]),
            "GetSession" => of(|id| v1::GetSessionRequest::of(id).encode_to_vec(), &[LARGE, SHEET]),
            "DeleteSession" => of(|id| v1::DeleteSessionRequest::of(id).encode_to_vec(), &[LARGE, FORKED]),
            "PlaySession" => {
                let play = |id: &str| v1::PlaySessionRequest {
                    real_time_factor: SLOWLY,
                    ..v1::PlaySessionRequest::of(id)
                };
                [LARGE, SHEET, SNOW].map(|id| play(id).encode_to_vec()).to_vec()
            }
            "PauseSession" => {
                let pause =
                    |id: &str| v1::PauseSessionRequest { wait: true, ..v1::PauseSessionRequest::of(id) };
                [LARGE, SHEET, SNOW].map(|id| pause(id).encode_to_vec()).to_vec()
            }
            "StopSession" => of(|id| v1::StopSessionRequest::of(id).encode_to_vec(), &[STOPPED]),
            "ResetSession" => {
                of(|id| v1::ResetSessionRequest::of(id).encode_to_vec(), &[LARGE, PUT, SHEET, SNOW])
            }
            "StepSession" => self.steps(),
            "GetServerInfo" => vec![v1::GetServerInfoRequest {}.encode_to_vec()],
            "ListSessions" => {
                vec![v1::ListSessionsRequest { page_size: 1000, page_token: String::new() }.encode_to_vec()]
            }
            "MakeLink" => vec![v1::MakeLinkRequest::default().encode_to_vec()],
            "OpenLink" => vec![v1::OpenLinkRequest { code: self.link.clone() }.encode_to_vec()],
            _ => return None,
        })
    }

    /// Sessions with texts of as many bytes as are allowed.
    fn sessions(&self) -> Vec<v1::CreateSessionRequest> {
        let dust = |mesh: &str| {
            format!(
                "version = 1\ndt = 1e-3\n[[body]]\nname = \"dust\"\nmesh = {{ {mesh} }}\n\
                 mass = {{ particle = 0.1 }}\nintegrator = \"symplectic_euler\"\n"
            )
        };
        // A side has at most 100 000 particles.
        let grid = |count: u64| dust(&format!("grid = [40, {}], spacing = 0.01", count / 40));
        let texts = [
            (LARGE, grid(self.limits.max_particles)),
            (UPLOADED, dust(&format!("upload = \"{}\"", self.mesh))),
            (PUT, grid(PUT_COUNT as u64)),
            (SHEET, SHEET_SCENE.to_owned()),
            (SNOW, SNOW_SCENE.to_owned()),
            (STOPPED, grid(1000)),
        ];
        texts.map(|(id, text)| self.session(id, &text)).to_vec()
    }

    fn session(&self, id: &str, text: &str) -> v1::CreateSessionRequest {
        let rest = (self.limits.max_scene_bytes as usize).saturating_sub(text.len() + 1);
        v1::CreateSessionRequest {
            session_id: id.to_owned(),
            scene: Some(Scene::SceneText(format!("{text}#{}", "x".repeat(rest)))),
            thread_count: 1,
            ..v1::CreateSessionRequest::default()
        }
    }

    fn steps(&self) -> Vec<Vec<u8>> {
        let step = |id: &str| v1::StepSessionRequest { wait: true, ..v1::StepSessionRequest::of(id) };
        let changed = |id: &str, update: v1::UpdateParametersRequest| {
            let changes = v1::Changes {
                pins: update.pins,
                states: update.states,
                collider_paths: update.collider_paths,
                ..v1::Changes::default()
            };
            v1::StepSessionRequest { changes: Some(changes), ..step(id) }
        };
        let frame = Some(v1::FrameRequest { fields: FIELDS.repeat(2000), encoding: 0 });
        let put = v1::StepSessionRequest { frame, ..changed(PUT, state_in_arrays()) };
        let many = self.limits.max_changes_per_call as usize;
        [step(LARGE), put, changed(SHEET, many_pins(many)), changed(SHEET, collider_path(many))]
            .map(|request| request.encode_to_vec())
            .to_vec()
    }

    fn of_changes(&self, method: &str) -> Option<Vec<Vec<u8>>> {
        let many = self.limits.max_changes_per_call;
        Some(match method {
            "UpdateParameters" => self.updates().iter().map(Message::encode_to_vec).collect(),
            "ListPendingChanges" => {
                let list = |id: &str| v1::ListPendingChangesRequest {
                    page_size: 1000,
                    ..v1::ListPendingChangesRequest::of(id)
                };
                [LARGE, PUT, SHEET].map(|id| list(id).encode_to_vec()).to_vec()
            }
            "DropPendingChanges" => {
                let orders = (1..=u64::from(many)).collect();
                let drop =
                    v1::DropPendingChangesRequest { orders, ..v1::DropPendingChangesRequest::of(LARGE) };
                let all = [PUT, SHEET].map(|id| v1::DropPendingChangesRequest::of(id).encode_to_vec());
                [vec![drop.encode_to_vec()], all.to_vec()].concat()
            }
            _ => return None,
        })
    }

    /// Changes that are made at once, that wait, and that are refused.
    fn updates(&self) -> Vec<v1::UpdateParametersRequest> {
        let many = self.limits.max_changes_per_call as usize;
        let by_upload = |count: usize| {
            let state = v1::StateUpdate {
                body: "dust".into(),
                upload_id: self.mesh.clone(),
                ..v1::StateUpdate::default()
            };
            v1::UpdateParametersRequest {
                states: vec![state; count],
                ..v1::UpdateParametersRequest::default()
            }
        };
        let springs = vec![v1::SpringUpdate { stiffness: Some(20.0), ..v1::SpringUpdate::default() }; many];
        let air = vec![v1::AirUpdate { density: Some(1.0), ..v1::AirUpdate::default() }; many];
        let all = [
            (LARGE, by_upload(1)),
            (LARGE, by_upload(many)),
            (PUT, by_upload(many)),
            (PUT, state_in_arrays()),
            (LARGE, forces()),
            (SHEET, many_pulls(many)),
            (SHEET, v1::UpdateParametersRequest { springs, ..v1::UpdateParametersRequest::default() }),
            (SHEET, v1::UpdateParametersRequest { air, ..v1::UpdateParametersRequest::default() }),
            (SHEET, many_pins(many)),
            (SHEET, pin_path(many)),
            (SHEET, collider_path(many)),
        ];
        let at = |at_step: u64| {
            all.iter().map(move |(id, update)| v1::UpdateParametersRequest {
                session_id: (*id).to_owned(),
                at_step,
                ..update.clone()
            })
        };
        at(0).chain(at(1_000_000)).collect()
    }

    fn of_streams(&self, method: &str) -> Option<Vec<Vec<u8>>> {
        // As many elements as are allowed in a request.
        let fields = || FIELDS.repeat(self.limits.max_changes_per_call as usize / FIELDS.len());
        let watch = |id: &str, encoding: v1::Encoding| v1::WatchFramesRequest {
            fields: fields(),
            encoding: encoding.into(),
            ..v1::WatchFramesRequest::of(id)
        };
        Some(match method {
            "WatchFrames" => {
                let grid = v1::GridRequest {
                    selection: Some(Selection::All(v1::AllNodes {})),
                    max_nodes: 0,
                    force: false,
                };
                let with_grid =
                    v1::WatchFramesRequest { grid: Some(grid), ..watch(SNOW, v1::Encoding::RawF64) };
                let [wide, narrow] = [v1::Encoding::RawF64, v1::Encoding::RawF32].map(|e| watch(LARGE, e));
                [wide, narrow, with_grid].map(|request| request.encode_to_vec()).to_vec()
            }
            "WatchDiagnostics" => {
                [LARGE, SHEET].map(|id| v1::WatchDiagnosticsRequest::of(id).encode_to_vec()).to_vec()
            }
            _ => return None,
        })
    }
}

/// A sheet that is held at two corners, whose particles have the numbers 0 and 19, feels air, and hangs over a ball.
const SHEET_SCENE: &str = "version = 1\ndt = 1e-3\n[[body]]\nname = \"sheet\"\n\
    mesh = { grid = [20, 20], spacing = 0.1 }\nmass = { particle = 0.01 }\npins = [0, 19]\nair = {}\n\
    springs = { stretch = { stiffness = 10.0 }, shear = { stiffness = 10.0 } }\n\
    [[collider]]\nname = \"ball\"\nsphere = { center = [0, -9, 0], radius = 0.5 }\n";

const SNOW_SCENE: &str = "version = 1\ndt = 1e-4\n[snow]\ncell = 0.05\n[[snow.object]]\nname = \"s\"\n\
    sphere = { center = [0, 1, 0], radius = 0.4 }\nparticles = 20000\n";

/// A state that fills a message.
fn state_in_arrays() -> v1::UpdateParametersRequest {
    let position = |i: usize| [0.01 * i as f64, 0.0, 0.0];
    let positions = (0..PUT_COUNT).flat_map(position).flat_map(f64::to_le_bytes);
    let state = v1::StateUpdate {
        body: "dust".into(),
        positions_f64: positions.collect(),
        velocities_f64: vec![0; 24 * PUT_COUNT].into(),
        upload_id: String::new(),
    };
    v1::UpdateParametersRequest { states: vec![state], ..v1::UpdateParametersRequest::default() }
}

/// Forces that fill a message: on as many particles as have room.
fn forces() -> v1::UpdateParametersRequest {
    let count = 145_000;
    let force = v1::ForceUpdate {
        body: "dust".into(),
        particles_u32: (0..count).flat_map(u32::to_le_bytes).collect(),
        force: None,
        forces_f64: (0..3 * count).flat_map(|_| 1.0_f64.to_le_bytes()).collect(),
    };
    v1::UpdateParametersRequest { forces: vec![force], ..v1::UpdateParametersRequest::default() }
}

/// So many moves of one pin.
fn many_pins(count: usize) -> v1::UpdateParametersRequest {
    let pin = v1::PinUpdate { particle: 0, target: Some([0.0, 0.1, 0.0].into()), duration_seconds: 1.0 };
    v1::UpdateParametersRequest { pins: vec![pin; count], ..v1::UpdateParametersRequest::default() }
}

/// So many pulls at as few particles as there may be: one that all of them draw.
fn many_pulls(count: usize) -> v1::UpdateParametersRequest {
    let pull = v1::PullUpdate {
        body: "sheet".into(),
        particles_u32: 7_u32.to_le_bytes().to_vec().into(),
        points_f64: vec![0; 24].into(),
        frequency: 100.0,
        most: 10.0,
        seconds: 1.0,
    };
    let pulls = vec![pull; count.min(4096)];
    v1::UpdateParametersRequest { pulls, ..v1::UpdateParametersRequest::default() }
}

/// A pin's way through so many points.
fn pin_path(count: usize) -> v1::UpdateParametersRequest {
    let path = v1::PinPath {
        particle: 19,
        times_seconds: times(count),
        targets: (0..3 * count).map(|i| 1e-6 * i as f64).collect(),
    };
    v1::UpdateParametersRequest { paths: vec![path], ..v1::UpdateParametersRequest::default() }
}

/// A collider's way through so many places.
fn collider_path(count: usize) -> v1::UpdateParametersRequest {
    let positions = (0..count).flat_map(|i| [0.0, -9.0 - 1e-6 * i as f64, 0.0]).collect();
    let (name, times_seconds) = ("ball".into(), times(count));
    let path = v1::ColliderPath { name, times_seconds, positions, turns: Vec::new() };
    v1::UpdateParametersRequest { collider_paths: vec![path], ..v1::UpdateParametersRequest::default() }
}

fn times(count: usize) -> Vec<f64> {
    (1..=count).map(|i| 0.01 * i as f64).collect()
}

/// Messages about some sessions.
fn of(message: fn(&str) -> Vec<u8>, ids: &[&str]) -> Vec<Vec<u8>> {
    ids.iter().map(|id| message(id)).collect()
}

fn read<M: Message + Default>(bytes: Bytes) -> M {
    M::decode(bytes).expect("the server's message")
}
