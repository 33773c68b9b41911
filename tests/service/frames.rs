//! A stream of frames put together from its pieces, with checks that the pieces are in order.

use std::{collections::BTreeMap, time::Duration};

use nappe_proto::v1::{self, collider_shape::Shape, watch_frames_response::Event};
use tokio_stream::StreamExt as _;
use tonic::{Status, Streaming};

/// Nothing in this suite takes this long unless it hangs.
pub(crate) const PATIENCE: Duration = Duration::from_mins(1);

/// Waits for what must come, however busy the machine is, and fails where a test would hang.
pub(crate) async fn in_time<T>(work: impl Future<Output = T>) -> T {
    tokio::time::timeout(PATIENCE, work).await.expect("it comes in time")
}

/// A frame put together from its pieces.
#[derive(Clone, Debug)]
pub(crate) struct Whole {
    pub(crate) head: v1::Frame,
    pub(crate) piece_count: u32,
    /// Bytes by field.
    pub(crate) fields: BTreeMap<i32, Vec<u8>>,
    /// The grid's nodes, and how many pieces they came in.
    pub(crate) grid: Option<Nodes>,
}

/// Nodes of the snow's grid put together from their pieces.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Nodes {
    pub(crate) cell: f64,
    pub(crate) stride: u32,
    pub(crate) node_count: u64,
    pub(crate) index: Vec<[i32; 3]>,
    pub(crate) mass: Vec<f32>,
    pub(crate) velocity: Vec<[f32; 3]>,
    pub(crate) force: Vec<[f32; 3]>,
    pub(crate) piece_count: u32,
}

impl Nodes {
    fn append(&mut self, piece: &v1::GridField) {
        let head = (piece.cell, piece.stride, piece.node_count);
        assert!(self.piece_count == 0 || head == (self.cell, self.stride, self.node_count));
        (self.cell, self.stride, self.node_count) = head;
        let index = numbers(&piece.index_i32, i32::from_le_bytes);
        let velocity = numbers(&piece.velocity_f32, f32::from_le_bytes);
        let force = numbers(&piece.force_f32, f32::from_le_bytes);
        self.index.extend(index.as_chunks().0);
        self.velocity.extend(velocity.as_chunks().0);
        self.force.extend(force.as_chunks().0);
        self.mass.extend(numbers(&piece.mass_f32, f32::from_le_bytes));
        assert_eq!((self.index.len(), self.velocity.len()), (self.mass.len(), self.mass.len()));
        self.piece_count += 1;
    }
}

/// Packed numbers of `N` bytes each.
fn numbers<T, const N: usize>(bytes: &[u8], read: impl Fn([u8; N]) -> T) -> Vec<T> {
    assert_eq!(bytes.len() % N, 0);
    bytes.as_chunks().0.iter().map(|chunk| read(*chunk)).collect()
}

impl Whole {
    /// A field's numbers.
    pub(crate) fn numbers<T, const N: usize>(&self, field: v1::Field, read: impl Fn([u8; N]) -> T) -> Vec<T> {
        numbers(&self.fields[&i32::from(field)], read)
    }
}

/// What a stream of frames gives.
#[derive(Debug)]
pub(crate) enum Next {
    Frame(Box<Whole>),
    End(v1::SessionEnd),
    Broken(Status),
    Closed,
}

/// A watcher that puts frames together.
pub(crate) struct Watch {
    pub(crate) topology: v1::Topology,
    pub(crate) topology_piece_count: u32,
    /// Changes of state that came so far, how the session stood at the start first.
    pub(crate) changes: Vec<v1::StateChange>,
    stream: Streaming<v1::WatchFramesResponse>,
}

impl Watch {
    pub(crate) async fn new(mut stream: Streaming<v1::WatchFramesResponse>) -> Self {
        let mut topology = first_piece(&mut stream).await;
        let count = topology.chunk.map_or(1, |chunk| chunk.count);
        for index in 1..count {
            let piece = first_piece(&mut stream).await;
            assert_eq!(piece.chunk, Some(v1::Chunk { index, count }));
            piece.bodies.into_iter().for_each(|body| append(&mut topology.bodies, body));
            piece.colliders.into_iter().for_each(|part| append_collider(&mut topology.colliders, part));
        }
        Self { topology, topology_piece_count: count, changes: Vec::new(), stream }
    }

    async fn message(&mut self) -> Option<Result<Event, Status>> {
        let next = in_time(self.stream.next()).await;
        next.map(|message| message.map(|message| message.event.expect("a message holds an event")))
    }

    /// The next whole frame, or the end.
    pub(crate) async fn next(&mut self) -> Next {
        let mut whole: Option<Whole> = None;
        loop {
            match self.message().await {
                None => return Next::Closed,
                Some(Err(status)) => return Next::Broken(status),
                Some(Ok(Event::End(end))) => return Next::End(end),
                Some(Ok(Event::Topology(_))) => panic!("the topology comes once"),
                Some(Ok(Event::Change(change))) => {
                    assert!(whole.is_none(), "a frame has no changes between its pieces");
                    self.changes.push(change);
                }
                Some(Ok(Event::Progress(_))) => assert!(whole.is_none(), "a frame is whole"),
                Some(Ok(Event::Frame(piece))) => {
                    let chunk = piece.chunk.expect("a piece says where it stands");
                    let whole = whole.get_or_insert_with(|| Whole {
                        head: piece.clone(),
                        piece_count: 0,
                        fields: BTreeMap::new(),
                        grid: None,
                    });
                    assert_eq!((piece.frame, chunk.index), (whole.head.frame, whole.piece_count));
                    assert_eq!(piece.diagnostics.is_some(), chunk.index == 0);
                    assert!(piece.poses.is_empty() || chunk.index == 0);
                    whole.piece_count += 1;
                    if let Some(grid) = &piece.grid {
                        whole.grid.get_or_insert_default().append(grid);
                    }
                    for field in piece.fields {
                        whole.fields.entry(field.field).or_default().extend_from_slice(&field.data);
                    }
                    if whole.piece_count == chunk.count {
                        return Next::Frame(Box::new(whole.clone()));
                    }
                }
            }
        }
    }

    /// The next frame, which must come.
    pub(crate) async fn frame(&mut self) -> Whole {
        match self.next().await {
            Next::Frame(frame) => *frame,
            other => panic!("a frame was due: {other:?}"),
        }
    }

    /// The frames until the end of the session, and the end.
    pub(crate) async fn until_end(&mut self) -> (Vec<Whole>, v1::SessionEnd) {
        let mut frames = Vec::new();
        loop {
            match self.next().await {
                Next::Frame(frame) => frames.push(*frame),
                Next::End(end) => {
                    assert!(matches!(self.next().await, Next::Closed), "nothing follows the end");
                    return (frames, end);
                }
                other => panic!("the end was due: {other:?}"),
            }
        }
    }

    /// The frames until the stream breaks, and its status.
    pub(crate) async fn until_break(&mut self) -> (Vec<Whole>, Status) {
        let mut frames = Vec::new();
        loop {
            match self.next().await {
                Next::Frame(frame) => frames.push(*frame),
                Next::Broken(status) => return (frames, status),
                other => panic!("a status was due: {other:?}"),
            }
        }
    }
}

async fn first_piece(stream: &mut Streaming<v1::WatchFramesResponse>) -> v1::Topology {
    match in_time(stream.next()).await.expect("a message").expect("no error").event {
        Some(Event::Topology(topology)) => topology,
        other => panic!("the topology comes first: {other:?}"),
    }
}

/// Adds a body, or the next bytes of the last one.
fn append(bodies: &mut Vec<v1::BodyTopology>, part: v1::BodyTopology) {
    match bodies.last_mut().filter(|body| body.first_particle == part.first_particle) {
        None => bodies.push(part),
        Some(body) => {
            body.triangles_u32 = [&body.triangles_u32[..], &part.triangles_u32].concat().into();
            body.springs_u32 = [&body.springs_u32[..], &part.springs_u32].concat().into();
            body.pins_u32 = [&body.pins_u32[..], &part.pins_u32].concat().into();
            body.uv_f32 = [&body.uv_f32[..], &part.uv_f32].concat().into();
        }
    }
}

/// Adds a collider, or the next bytes of the last one.
fn append_collider(colliders: &mut Vec<v1::ColliderShape>, part: v1::ColliderShape) {
    match colliders.last_mut().filter(|collider| collider.name == part.name) {
        None => colliders.push(part),
        Some(collider) => {
            let (Some(Shape::Mesh(mesh)), Some(Shape::Mesh(part))) = (&mut collider.shape, part.shape) else {
                panic!("only a mesh continues");
            };
            mesh.points_f32 = [&mesh.points_f32[..], &part.points_f32].concat().into();
            mesh.triangles_u32 = [&mesh.triangles_u32[..], &part.triangles_u32].concat().into();
        }
    }
}
