//! Mesh colliders as they reach a client of the contract alone, and the client library: arrays that come over several
//! pieces of a topology are those that were uploaded, in binary32.

use std::{
    collections::BTreeSet,
    f64::consts::{PI, TAU},
};

use bytes::Bytes;
use nappe_client::{Client, Event as Watched, WatchOptions, mesh_points, mesh_triangles};
use nappe_proto::v1::{
    self, MeshHeader, UploadMeshRequest, collider_shape::Shape, upload_mesh_request::Part,
    watch_frames_response::Event,
};
use nappe_scene::files::{self, ReadOptions};
use nappe_tests::course;
use prost::Message as _;
use tokio_stream::StreamExt as _;

use crate::{
    cloth_scenes::sheet,
    frames::in_time,
    harness::{Server, every},
};

/// A surface in files and scenes.
struct Mesh {
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// A ball of 1 m about a point 5 m below the origin: `rings` bands of triangles, `around` points on each circle between
/// two, and a pole at each end.
fn ball(rings: u32, around: u32) -> Mesh {
    let mut points = vec![[0.0, -4.0, 0.0]];
    for ring in 1..rings {
        let (sine, cosine) = (PI * f64::from(ring) / f64::from(rings)).sin_cos();
        points.extend((0..around).map(|at| {
            let turn = TAU * f64::from(at) / f64::from(around);
            [sine * turn.cos(), cosine - 5.0, sine * turn.sin()]
        }));
    }
    points.push([0.0, -6.0, 0.0]);

    let last = points.len() as u32 - 1;
    let point = |ring: u32, at: u32| match ring {
        0 => 0,
        ring if ring == rings => last,
        ring => 1 + (ring - 1) * around + at % around,
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for at in 0..around {
            let [a, b] = [point(ring, at), point(ring, at + 1)];
            let [c, d] = [point(ring + 1, at), point(ring + 1, at + 1)];
            triangles.extend((ring + 1 < rings).then_some([b, d, c]));
            triangles.extend((ring > 0).then_some([a, b, c]));
        }
    }
    Mesh { points, triangles }
}

/// Uploads a mesh without masses and returns its id.
async fn upload(server: &mut Server, mesh: &Mesh) -> String {
    let header = MeshHeader {
        name: "surface".into(),
        point_count: mesh.points.len() as u64,
        triangle_count: mesh.triangles.len() as u64,
        ..MeshHeader::default()
    };
    let points = mesh.points.as_flattened().iter().flat_map(|c| c.to_le_bytes());
    let triangles = mesh.triangles.as_flattened().iter().flat_map(|i| i.to_le_bytes());
    let data: Vec<u8> = points.chain(triangles).collect();
    let mut parts = vec![Part::Header(header)];
    parts.extend(data.chunks(1 << 20).map(|piece| Part::Data(Bytes::copy_from_slice(piece))));
    let messages: Vec<_> = parts.into_iter().map(|part| UploadMeshRequest { part: Some(part) }).collect();
    let answer = server.client.upload_mesh(tokio_stream::iter(messages)).await.expect("accepted");
    answer.into_inner().mesh_id
}

fn collider(name: &str, mesh_id: &str) -> String {
    format!("[[collider]]\nname = \"{name}\"\nmesh = {{ upload = \"{mesh_id}\" }}\n")
}

/// A mesh collider as it came.
#[derive(Default)]
struct Surface {
    name: String,
    points: Vec<u8>,
    triangles: Vec<u8>,
    /// Pieces of the topology that held a part of it.
    piece_count: u32,
}

impl Surface {
    fn points(&self) -> Vec<[f32; 3]> {
        triples(&self.points, f32::from_le_bytes)
    }

    fn triangles(&self) -> Vec<[u32; 3]> {
        triples(&self.triangles, u32::from_le_bytes)
    }
}

/// Packed triples of numbers.
fn triples<T: Copy>(bytes: &[u8], read: impl Fn([u8; 4]) -> T) -> Vec<[T; 3]> {
    assert_eq!(bytes.len() % 12, 0);
    let numbers: Vec<T> = bytes.as_chunks::<4>().0.iter().map(|number| read(*number)).collect();
    numbers.as_chunks::<3>().0.to_vec()
}

/// The mesh colliders of a session, put together as the contract says, and the names of all colliders in their order.
async fn surfaces(server: &mut Server, id: &str) -> (Vec<Surface>, Vec<String>) {
    let mut stream = server.client.watch_frames(every(id, 0)).await.expect("the stream opens").into_inner();
    let (mut surfaces, mut names): (Vec<Surface>, Vec<String>) = (Vec::new(), Vec::new());
    loop {
        let piece = match in_time(stream.next()).await.expect("a message").expect("no error").event {
            Some(Event::Topology(piece)) => piece,
            other => panic!("the topology comes first: {other:?}"),
        };
        assert!(piece.encoded_len() <= 1 << 20, "a piece of {} bytes", piece.encoded_len());
        let v1::Chunk { index, count } = piece.chunk.expect("a piece says where it stands");
        for collider in piece.colliders {
            let goes_on = names.last() == Some(&collider.name);
            if !goes_on {
                names.push(collider.name.clone());
            }
            let Some(Shape::Mesh(part)) = collider.shape else { continue };
            if !goes_on {
                surfaces.push(Surface { name: collider.name, ..Surface::default() });
            }
            let surface = surfaces.last_mut().expect("it has begun");
            surface.points.extend_from_slice(&part.points_f32);
            surface.triangles.extend_from_slice(&part.triangles_u32);
            surface.piece_count += 1;
        }
        if index + 1 == count {
            return (surfaces, names);
        }
    }
}

fn in_binary32(points: &[[f64; 3]]) -> Vec<[f32; 3]> {
    points.iter().map(|point| point.map(|c| c as f32)).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_arrays_of_a_mesh_come_over_several_pieces_as_they_were_uploaded() {
    let mut server = Server::start().await;
    let mesh = ball(151, 200);
    assert_eq!(mesh.triangles.len(), 60_000);
    let mesh_id = upload(&mut server, &mesh).await;
    let floor = "[[collider]]\nname = \"floor\"\nplane = { point = [0, -9, 0], normal = [0, 1, 0] }\n";
    let moving = "velocity = [0, 0, 0.5]\n";
    let id = server.session(sheet(4) + &collider("ball", &mesh_id) + moving + floor).await;

    let (surfaces, names) = surfaces(&mut server, &id).await;
    assert_eq!(names, ["ball", "floor"]);
    let [surface] = &surfaces[..] else { panic!("one mesh, not {}", surfaces.len()) };
    assert!(surface.name == "ball" && surface.piece_count > 1, "{} pieces", surface.piece_count);
    let points = in_binary32(&mesh.points);
    assert!(surface.points() == points, "{} points came", surface.points().len());
    assert!(surface.triangles() == mesh.triangles, "{} triangles came", surface.triangles().len());

    // The same from the client library.
    let client = Client::connect(&server.app.url()).await.expect("connected");
    let mut watched = client.watch(&id, WatchOptions::default()).await.expect("a stream");
    let Some(Ok(Watched::Topology(topology))) = in_time(watched.next()).await else {
        panic!("the topology comes first")
    };
    let ball = &topology.colliders[0];
    assert_eq!((ball.name.as_str(), ball.velocity), ("ball", [0.0, 0.0, 0.5]));
    let Some(Shape::Mesh(read)) = &ball.shape else { panic!("a mesh") };
    assert!(mesh_points(read) == points && mesh_triangles(read) == mesh.triangles);
    assert_eq!(topology.colliders[1].name, "floor");
    server.step(&id, 1).await;
}

/// The corners of each triangle, whatever numbers its points have and wherever it begins.
fn corners(points: &[[f32; 3]], triangles: &[[u32; 3]]) -> BTreeSet<[[u32; 3]; 3]> {
    let corners = triangles.iter().map(|triangle| {
        let mut corners = triangle.map(|i| points[i as usize].map(f32::to_bits));
        corners.sort_unstable();
        corners
    });
    corners.collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_cow_of_the_course_comes_over_several_pieces_as_its_file_has_it() {
    let test = "the_cow_of_the_course_comes_over_several_pieces_as_its_file_has_it";
    let Some(folder) = course::folder(test) else { return };
    let loaded = files::load_mesh(&folder.join("data/vache"), &ReadOptions::default())
        .unwrap_or_else(|error| panic!("{error}"));
    let cow = Mesh { points: loaded.mesh.points, triangles: loaded.mesh.triangles };

    let mut server = Server::start().await;
    // A ball before it leaves less than the cow needs of the first piece.
    let before = upload(&mut server, &ball(150, 180)).await;
    let mesh_id = upload(&mut server, &cow).await;
    let id = server.session(sheet(4) + &collider("ball", &before) + &collider("cow", &mesh_id)).await;
    let (surfaces, names) = surfaces(&mut server, &id).await;
    assert_eq!(names, ["ball", "cow"]);
    let [ball, read] = &surfaces[..] else { panic!("two meshes, not {}", surfaces.len()) };
    assert_eq!((ball.piece_count, read.piece_count), (1, 2));

    // The file has a triangle twice, which the scene drops.
    let expected = corners(&in_binary32(&cow.points), &cow.triangles);
    assert_eq!((read.triangles().len(), expected.len()), (8626, 8626));
    assert!(corners(&read.points(), &read.triangles()) == expected);
}
