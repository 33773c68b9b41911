//! Nodes of the snow's grid: chosen for each watcher, bounded, in pieces, never for those who did not ask.

use nappe_proto::v1::{self, Axis, Encoding, Field, SessionState, grid_request::Selection};
use nappe_server::{Limits, Reason};
use nappe_sim::{math::Precision, report::NoStopwatch, snow::GridNode};
use tonic_types::StatusExt as _;

use crate::{
    cloth_scenes::sheet,
    frames::Nodes,
    harness::{Server, assert_reason, every, latest},
    simulation::simulation,
    snow_scenes::{block, diverging, snow},
};

fn all(max_nodes: u32) -> v1::GridRequest {
    v1::GridRequest { selection: Some(Selection::All(v1::AllNodes {})), max_nodes, force: false }
}

fn slice(axis: Axis, coordinate: f64, max_nodes: u32) -> v1::GridRequest {
    let slice = v1::SliceNodes { axis: axis.into(), coordinate };
    v1::GridRequest { selection: Some(Selection::Slice(slice)), max_nodes, force: false }
}

fn with(grid: v1::GridRequest, request: v1::WatchFramesRequest) -> v1::WatchFramesRequest {
    v1::WatchFramesRequest { grid: Some(grid), ..request }
}

/// The nodes as they should arrive.
fn expected<'a>(nodes: impl IntoIterator<Item = &'a GridNode>) -> Nodes {
    let mut expected = Nodes::default();
    for node in nodes {
        expected.index.push(node.index);
        expected.mass.push(node.mass as f32);
        expected.velocity.push(node.velocity.map(|v| v as f32));
    }
    expected
}

fn assert_same(found: &Nodes, nodes: &Nodes, what: &str) {
    assert_eq!(found.index, nodes.index, "{what}");
    assert_eq!((&found.mass, &found.velocity), (&nodes.mass, &nodes.velocity), "{what}");
}

/// Nodes after each of the first steps of a scene.
fn reference(text: &str, steps: usize) -> (f64, Vec<Vec<GridNode>>) {
    let mut simulation = simulation(text, Precision::F32);
    let mut frames = Vec::new();
    for _ in 0..steps {
        simulation.step(&mut NoStopwatch).expect("a step");
        let mut nodes = Vec::new();
        simulation.grid_nodes(&mut nodes);
        frames.push(nodes);
    }
    (simulation.snow_cell().expect("there is snow"), frames)
}

#[tokio::test(flavor = "multi_thread")]
async fn all_nodes_arrive_as_each_step_left_them() {
    let mut server = Server::start().await;
    let text = snow("steps = 3");
    let id = server.session(text.clone()).await;
    let mut watch = server.watch(with(all(0), every(&id, 0))).await;

    server.play(&id).await;
    let (frames, _) = watch.until_end().await;
    let (cell, nodes) = reference(&text, 3);
    let first = frames[0].grid.as_ref().expect("an empty grid is sent too");
    assert_eq!((first.node_count, first.index.len(), first.cell), (0, 0, cell));
    for (frame, nodes) in frames[1..].iter().zip(&nodes) {
        let grid = frame.grid.as_ref().expect("the grid");
        assert_eq!((grid.cell, grid.stride, grid.node_count), (cell, 1, nodes.len() as u64));
        assert!(nodes.len() > 100);
        assert_same(grid, &expected(nodes), "all nodes");

        // Mass on the grid is that of the particles.
        let snow = frame.head.diagnostics.as_ref().and_then(|d| d.snow).expect("diagnostics of snow");
        let mass: f64 = grid.mass.iter().map(|m| f64::from(*m)).sum();
        assert!((mass / snow.mass - 1.0).abs() < 1e-5, "{mass} of {}", snow.mass);
        assert!(grid.velocity.iter().flatten().all(|v| v.is_finite()));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn forces_on_nodes_come_to_those_who_ask_for_them() {
    let mut server = Server::start().await;
    let text = snow("steps = 6");
    let id = server.session(text.clone()).await;
    let forced = v1::GridRequest { force: true, ..all(0) };
    let mut watch = server.watch(with(forced, every(&id, 0))).await;
    let mut plain = server.watch(with(all(0), every(&id, 0))).await;
    server.play(&id).await;
    let ((frames, _), (others, _)) = (watch.until_end().await, plain.until_end().await);
    let mut simulation = simulation(&text, Precision::F32);
    let mut largest = 0.0;
    for (frame, other) in frames[1..].iter().zip(&others[1..]) {
        simulation.step(&mut NoStopwatch).expect("a step");
        let expected: Vec<[f32; 3]> =
            simulation.grid_forces().into_iter().map(|force| force.map(|f| f as f32)).collect();
        let [grid, other] = [frame, other].map(|frame| frame.grid.as_ref().expect("the grid"));
        assert_eq!(grid.force, expected);
        assert!(other.force.is_empty(), "nobody asked on this stream");
        assert_same(grid, other, "all else");
        largest = expected.iter().flatten().fold(largest, |largest: f32, f| largest.max(f.abs()));
        let sum: f64 = expected.iter().map(|force| f64::from(force[1])).sum();
        assert!(sum.abs() <= 1e-4 * f64::from(largest) * expected.len() as f64, "{sum} N in all");
    }
    assert!(largest > 1e-3, "it hit the floor: {largest} N");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_slice_is_the_nearest_plane_and_a_stride_keeps_within_what_is_allowed() {
    let mut server = Server::start().await;
    let text = snow("steps = 2");
    let id = server.session(text.clone()).await;
    let (cell, frames) = reference(&text, 2);
    let nodes = &frames[1];
    server.step(&id, 2).await;

    for (axis, number) in [(Axis::X, 0), (Axis::Y, 1), (Axis::Z, 2)] {
        for index in [-1, 0, 2] {
            let in_plane: Vec<_> = nodes.iter().filter(|node| node.index[number] == index).collect();
            for off in [-0.4, 0.0, 0.4] {
                let request = slice(axis, (f64::from(index) + off) * cell, 0);
                let grid = server.watch(with(request, latest(&id))).await.frame().await.grid.expect("a grid");
                assert_eq!((grid.stride, grid.node_count), (1, in_plane.len() as u64));
                assert_same(&grid, &expected(in_plane.iter().copied()), &format!("{axis:?} {index}"));
            }
        }
    }

    let (every_node, plane) = (nodes.len(), nodes.iter().filter(|node| node.index[1] == 1).count());
    for (request, whole, in_plane) in [
        (all(20), every_node, None),
        (all(1 << 30), every_node, None),
        (slice(Axis::Y, cell, 9), plane, Some(1)),
    ] {
        let grid = server.watch(with(request, latest(&id))).await.frame().await.grid.expect("a grid");
        assert_eq!(grid.node_count, whole as u64);
        assert!(grid.index.len() <= request.max_nodes as usize && !grid.index.is_empty());
        let stride = grid.stride as i32;
        let kept = nodes.iter().filter(|node| match in_plane {
            None => node.index.iter().all(|i| i % stride == 0),
            Some(index) => node.index[1] == index && [0, 2].iter().all(|a| node.index[*a] % stride == 0),
        });
        assert_same(&grid, &expected(kept), "with a stride");
        assert_eq!(stride == 1, whole <= request.max_nodes as usize);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_server_bounds_nodes_for_every_watcher() {
    let mut server = Server::with(Limits { max_grid_nodes: 50, ..Limits::default() }).await;

    let info = server.client.get_server_info(v1::GetServerInfoRequest {}).await.expect("info").into_inner();
    assert_eq!(info.limits.expect("limits").max_grid_nodes, 50);
    let id = server.session(snow("")).await;
    server.step(&id, 1).await;
    for max_nodes in [0, 51, u32::MAX] {
        let grid = server.watch(with(all(max_nodes), latest(&id))).await.frame().await.grid.expect("a grid");
        assert!(grid.node_count > 100 && grid.stride > 1, "{max_nodes}: {} nodes", grid.node_count);
        assert!((1..=50).contains(&grid.index.len()), "{max_nodes}: {}", grid.index.len());
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_grid_above_a_mebibyte_continues_in_further_pieces() {
    // 27 000 particles, one per cell: 1.65 MiB of fields, and more than 32 000 nodes of 28 bytes.
    let mut server = Server::start().await;
    let text = block(30, "steps = 1");
    let id = server.session(text.clone()).await;
    let fields = [Field::Positions, Field::Velocities, Field::PlasticRatio, Field::StressNorm];
    let request = v1::WatchFramesRequest {
        fields: fields.map(i32::from).to_vec(),
        encoding: Encoding::RawF64.into(),
        ..every(&id, 1)
    };
    let mut watch = server.watch(with(all(0), request)).await;
    server.play(&id).await;
    let (frames, _) = watch.until_end().await;
    let (_, nodes) = reference(&text, 1);
    let grid = frames[0].grid.as_ref().expect("the grid");
    assert_eq!((frames[0].piece_count, grid.piece_count), (3, 2), "{} nodes", nodes[0].len());
    assert_same(grid, &expected(&nodes[0]), "put together");
    assert_eq!(frames[0].numbers(Field::StressNorm, f64::from_le_bytes).len(), 27_000);
}

#[tokio::test(flavor = "multi_thread")]
async fn only_watchers_that_ask_for_nodes_receive_them() {
    let mut server = Server::start().await;
    let id = server.session(snow("steps = 5")).await;
    let mut plain = server.watch(every(&id, 0)).await;
    let mut sliced = server.watch(with(slice(Axis::Z, 0.0, 0), every(&id, 0))).await;
    let mut whole = server.watch(with(all(0), latest(&id))).await;
    server.play(&id).await;
    let (plain, _) = plain.until_end().await;
    let (sliced, _) = sliced.until_end().await;
    let (whole, _) = whole.until_end().await;
    assert_eq!((plain.len(), sliced.len()), (6, 6));
    assert!(plain.iter().all(|frame| frame.grid.is_none()), "nobody asked for it here");
    for (frame, with_grid) in plain.iter().zip(&sliced) {
        assert_eq!(frame.fields, with_grid.fields, "the grid changes nothing else");
        let grid = with_grid.grid.as_ref().expect("asked for");
        assert!(grid.index.iter().all(|i| i[2] == 0) && (frame.head.frame == 0 || !grid.index.is_empty()));
    }

    let last = whole.last().and_then(|frame| frame.grid.as_ref()).expect("asked for");
    assert!(last.index.iter().any(|i| i[2] != 0) && last.index.len() as u64 == last.node_count);
}

#[tokio::test(flavor = "multi_thread")]
async fn nodes_asked_for_late_come_with_the_state_that_stands_and_count_in_the_history() {
    // Frame 0 goes at once: the history holds a few frames of positions, and fewer with their grid.
    let mut server = Server::with(Limits { history_bytes_per_session: 40_000, ..Limits::default() }).await;
    let text = snow("");
    let id = server.session(text.clone()).await;
    let particles = server.get(&id).await.particle_count;
    server.step(&id, 14).await;
    let without = server.get(&id).await;
    let kept = without.frame - without.oldest_frame + 1;
    // Positions, and some 1 000 bytes of diagnostics and bookkeeping.
    let fits = 40_000 / (12 * particles + 2000)..=40_000 / (12 * particles + 500);
    assert!(fits.contains(&kept), "{kept} frames of {particles} particles");
    let mut present = server.watch(with(all(0), latest(&id))).await;
    let grid = present.frame().await.grid.expect("a grid");
    let (_, nodes) = reference(&text, 14);
    assert_same(&grid, &expected(&nodes[13]), "of step 14");
    let refused = server.client.watch_frames(with(all(0), every(&id, 13))).await.expect_err("none there");
    assert_eq!(assert_reason(&refused, Reason::FrameExpired)["oldest_frame"], "14");

    // As long as somebody asks for it, every frame has a grid, and takes room for it.
    server.step(&id, 12).await;
    let with_grid = server.get(&id).await;
    let room: u64 = 40_000 - 28 * grid.node_count;
    assert!(with_grid.frame - with_grid.oldest_frame < room / (12 * particles), "nodes take room");
    let frame = server.watch(with(all(0), every(&id, with_grid.oldest_frame))).await.frame().await;
    assert!(frame.grid.is_some_and(|grid| !grid.index.is_empty()));
    drop(present);
}

#[tokio::test(flavor = "multi_thread")]
async fn nodes_of_a_step_that_failed_are_not_sent() {
    let mut server = Server::start().await;
    let id = server.session(diverging()).await;
    let step = v1::StepSessionRequest { step_count: 10_000, wait: true, ..v1::StepSessionRequest::of(&id) };
    server.client.step_session(step).await.expect_err("it diverges");
    let failed = server.until(&id, |session| session.state() == SessionState::Failed).await;
    assert!(failed.frame > 0, "it fails on the way");

    // Nobody asked for nodes while they were there: the newest frame has none, and will not get any.
    let (frames, status) = server.watch(with(all(0), latest(&id))).await.until_break().await;
    assert!(frames.is_empty());
    let reason = status.get_details_error_info().expect("a reason").reason;
    assert_eq!(Some(reason), failed.failure.map(|failure| failure.reason));

    // Before the first step, a grid without nodes is sent.
    let fresh = server.session(diverging()).await;
    let first = server.watch(with(all(0), every(&fresh, 0))).await.frame().await;
    assert_eq!(first.grid.map(|grid| grid.node_count), Some(0));
}

#[tokio::test(flavor = "multi_thread")]
async fn invalid_requests_for_a_grid_are_refused_with_the_field() {
    let mut server = Server::start().await;
    let (snowy, cloth) = (server.session(snow("")).await, server.session(sheet(4)).await);

    let other_axis = |axis| {
        let slice = v1::SliceNodes { axis, coordinate: 0.0 };
        v1::GridRequest { selection: Some(Selection::Slice(slice)), max_nodes: 0, force: false }
    };
    for (id, request, field) in [
        (&snowy, v1::GridRequest { selection: None, max_nodes: 5, force: false }, "grid.selection"),
        (&snowy, other_axis(0), "grid.slice.axis"),
        (&snowy, other_axis(7), "grid.slice.axis"),
        (&snowy, slice(Axis::X, f64::NAN, 0), "grid.slice.coordinate"),
        (&snowy, slice(Axis::X, f64::NEG_INFINITY, 0), "grid.slice.coordinate"),
        (&cloth, all(0), "grid"),
        (&cloth, slice(Axis::X, f64::NAN, 0), "grid.slice.coordinate"),
    ] {
        let status = server.client.watch_frames(with(request, latest(id))).await.expect_err("refused");
        assert_reason(&status, Reason::InvalidField);
        let bad = status.get_details_bad_request().expect("the invalid field is named");
        assert_eq!(bad.field_violations[0].field, field, "{}", status.message());
    }
    assert_eq!(server.get(&snowy).await.watcher_count, 0, "a refused request is no watcher");
}
