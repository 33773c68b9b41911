//! What watchers receive: topology, every frame, the newest frames, diagnostics.

use std::time::{Duration, Instant};

use nappe_proto::v1::{self, Encoding, Field};
use nappe_server::Reason;
use nappe_sim::{field, math::Precision, report::NoStopwatch};
use tokio_stream::StreamExt as _;

use crate::{
    cloth_scenes::{dust, sheet, sheet_with},
    frames::{Next, in_time},
    harness::{Server, assert_reason, every, latest},
    simulation::simulation,
};

#[tokio::test(flavor = "multi_thread")]
async fn every_frame_arrives_with_the_bits_of_the_simulation() {
    let mut server = Server::start().await;
    for (name, precision) in [("f32", Precision::F32), ("f64", Precision::F64)] {
        let root = format!("steps = 24\nframe_interval = 2\nhash_interval = 3\nprecision = \"{name}\"");
        let text = sheet_with(7, &root);
        let id = server.session(text.clone()).await;

        let request = v1::WatchFramesRequest {
            fields: vec![Field::Positions.into(), Field::Velocities.into()],
            encoding: Encoding::RawF64.into(),
            ..every(&id, 0)
        };
        let mut watch = server.watch(request).await;
        server.play(&id).await;
        let (frames, end) = watch.until_end().await;

        let mut reference = simulation(&text, precision);
        let mut x = vec![0.0; 3 * reference.particle_count()];
        let mut v = x.clone();
        assert_eq!(frames.len(), 13);
        for (number, frame) in frames.iter().enumerate() {
            assert_eq!((frame.head.frame, frame.head.step), (number as u64, 2 * number as u64));

            reference.read::<f64>(field::Field::Positions, &mut x);
            reference.read::<f64>(field::Field::Velocities, &mut v);
            assert_eq!(frame.numbers(Field::Positions, f64::from_le_bytes), x, "frame {number}");
            assert_eq!(frame.numbers(Field::Velocities, f64::from_le_bytes), v, "frame {number}");

            let hashed = number % 3 == 0 || number == 12;
            assert_eq!(frame.head.state_hash, hashed.then(|| reference.state_hash()), "frame {number}");

            let diagnostics = frame.head.diagnostics.as_ref().expect("diagnostics");
            assert_eq!((diagnostics.frame, diagnostics.step), (frame.head.frame, frame.head.step));
            for _ in 0..2 {
                reference.step(&mut NoStopwatch).expect("a step");
            }
        }
        assert_eq!((end.frame, end.step), (12, 24));
        assert_eq!(Some(end.state_hash), frames[12].head.state_hash);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_topology_comes_first_and_describes_the_fields() {
    let mut server = Server::start().await;
    let id = server.session(sheet(5)).await;
    let mut watch = server.watch(latest(&id)).await;
    let topology = watch.topology.clone();
    assert_eq!((topology.particle_count, topology.bodies.len()), (25, 1));
    let body = &topology.bodies[0];
    assert_eq!((body.name.as_str(), body.first_particle, body.particle_count), ("sheet", 0, 25));

    let triangles = body.triangles_u32.as_chunks().0.iter().map(|i| u32::from_le_bytes(*i));
    assert_eq!(triangles.clone().count(), 2 * 16 * 3);
    assert!(triangles.max().is_some_and(|last| last == 24));
    assert!(body.springs_u32.is_empty(), "a body with triangles needs no springs to be drawn");
    assert_eq!(body.pins_u32.len(), 2 * 4);

    let frame = watch.frame().await;
    assert_eq!((frame.head.frame, frame.head.topology_id), (0, topology.topology_id));
    assert_eq!(frame.numbers(Field::Positions, f32::from_le_bytes).len(), 75);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_frame_above_a_mebibyte_comes_in_pieces() {
    let mut server = Server::start().await;
    let id = server.session(dust(300, "steps = 2")).await;
    let request = v1::WatchFramesRequest {
        fields: vec![Field::Positions.into(), Field::Velocities.into()],
        encoding: Encoding::RawF64.into(),
        ..every(&id, 0)
    };
    let mut wide = server.watch(request).await;
    let mut narrow = server.watch(every(&id, 0)).await;

    // Two triangles a cell: 2.05 MiB; texture coordinates: 0.69 MiB; and masses: 0.34 MiB.
    assert_eq!(narrow.topology_piece_count, 4);
    let body = &narrow.topology.bodies[0];
    assert_eq!((body.triangles_u32.len(), body.uv_f32.len()), (2 * 299 * 299 * 12, 90_000 * 8));
    server.play(&id).await;

    // 90 000 particles: 1.03 MiB in binary32, 4.12 MiB with velocities in binary64. A message has one segment of
    // a field at most, and there are three of each.
    let (frames, _) = narrow.until_end().await;
    assert!(frames.iter().all(|frame| frame.piece_count == 2));
    let (frames, _) = wide.until_end().await;
    assert!(frames.iter().all(|frame| frame.piece_count == 6), "{}", frames[0].piece_count);
    let x = frames[2].numbers(Field::Positions, f64::from_le_bytes);
    let v = frames[2].numbers(Field::Velocities, f64::from_le_bytes);
    assert_eq!((x.len(), v.len()), (270_000, 270_000));

    // Two steps of free fall, v = -g t, the same for the first and the last particle.
    for velocity in [v[1], v[269_998]] {
        assert!((velocity + 9.81 * 0.002).abs() < 1e-6, "{velocity}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_newest_frames_come_no_faster_than_they_are_asked_for() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    // Before the first frame can be sent: the periods are counted from there.
    let start = Instant::now();
    let mut watch = server.watch(v1::WatchFramesRequest { max_rate_hz: 20.0, ..latest(&id) }).await;
    server.play(&id).await;
    let mut last = watch.frame().await.head.frame;
    for _ in 0..6 {
        let frame = watch.frame().await;
        assert_eq!(frame.head.frame, last + 1 + frame.head.dropped_count);
        last = frame.head.frame;
    }

    // Six periods of 50 ms; timers may round down by a millisecond each.
    assert!(start.elapsed() > Duration::from_millis(290), "{:?}", start.elapsed());
}

#[tokio::test(flavor = "multi_thread")]
async fn the_newest_frame_is_delivered_and_dropped_ones_are_counted() {
    // A frame is 480 kB: few of forty are on their way to a reader that does not read.
    let mut server = Server::start().await;
    let id = server.session(dust(200, "")).await;
    let mut watch = server.watch(latest(&id)).await;
    let first = watch.frame().await.head;
    assert_eq!((first.frame, first.dropped_count), (0, 0), "nothing was before the first");
    server.step(&id, 40).await;

    let (mut last, mut dropped) = (0, 0);
    while last < 40 {
        let head = watch.frame().await.head;
        assert_eq!(head.frame, last + 1 + head.dropped_count);
        (last, dropped) = (head.frame, dropped + head.dropped_count);
    }
    assert!(dropped > 0, "forty frames do not fit on the way");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_last_frame_and_the_end_reach_a_watcher_of_the_newest() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(4, "steps = 200")).await;

    // One frame a minute: the end is not held back by the rate.
    let mut watch = server.watch(v1::WatchFramesRequest { max_rate_hz: 1.0 / 60.0, ..latest(&id) }).await;
    server.play(&id).await;
    let (frames, end) = watch.until_end().await;
    let last = &frames.last().expect("a frame").head;
    assert_eq!((last.frame, last.step, last.state_hash), (200, 200, Some(end.state_hash)));
}

#[tokio::test(flavor = "multi_thread")]
async fn velocities_asked_for_late_come_with_the_state_that_stands() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    server.step(&id, 5).await;
    let request = v1::WatchFramesRequest { fields: vec![Field::Velocities.into()], ..latest(&id) };

    // The newest frame had no velocities: nobody had asked. The session is paused, and they come.
    let mut present = server.watch(request).await;
    let frame = present.frame().await;
    assert_eq!(frame.head.frame, 5);
    assert!(frame.numbers(Field::Velocities, f32::from_le_bytes).iter().any(|v| *v != 0.0));
    assert!(!frame.fields.contains_key(&Field::Positions.into()), "only what was asked for");

    // Frames before were made without them.
    let every_from = |from_frame| v1::WatchFramesRequest {
        fields: vec![Field::Velocities.into()],
        ..every(&id, from_frame)
    };
    let refused = server.client.watch_frames(every_from(3)).await.expect_err("no velocities there");
    assert_eq!(assert_reason(&refused, Reason::FrameExpired)["oldest_frame"], "5");

    // As long as somebody asks for them, every frame has them.
    server.step(&id, 3).await;
    let mut watch = server.watch(every_from(6)).await;
    for number in 6..=8 {
        assert_eq!(watch.frame().await.head.frame, number);
    }
    drop(present);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_first_frame_keeps_every_field_until_the_second_is_made() {
    let mut server = Server::start().await;
    let wide = |id: &str, field: Field| v1::WatchFramesRequest {
        fields: vec![field.into()],
        encoding: v1::Encoding::RawF64.into(),
        ..every(id, 0)
    };
    let fields = [(Field::Velocities, 48), (Field::PlasticRatio, 16), (Field::StressNorm, 16)];
    // It plays before anybody watches: at a rate at which no step begins for hours, then between two frames.
    for steps_before in [0, 3] {
        let id = server.session(sheet_with(4, "frame_interval = 5")).await;
        if steps_before > 0 {
            server.step(&id, steps_before).await;
        }
        let play = v1::PlaySessionRequest { real_time_factor: 1e-7, ..v1::PlaySessionRequest::of(&id) };
        server.client.play_session(play).await.expect("it plays");
        for (field, count) in fields {
            let first = server.watch(wide(&id, field)).await.frame().await;
            assert_eq!((first.head.frame, first.head.step), (0, 0));
            assert_eq!(first.numbers(field, f64::from_le_bytes).len(), count, "{field:?}");
        }
    }

    // With the second frame goes what nobody asked for; what somebody did is in both.
    let id = server.session(sheet(4)).await;
    let watch = server.watch(wide(&id, Field::Velocities)).await;
    server.step(&id, 1).await;
    let mut again = server.watch(wide(&id, Field::Velocities)).await;
    assert_eq!((again.frame().await.head.frame, again.frame().await.head.frame), (0, 1));
    let refused = server.client.watch_frames(wide(&id, Field::StressNorm)).await.expect_err("not kept");
    assert_reason(&refused, Reason::FrameExpired);
    drop(watch);
}

#[tokio::test(flavor = "multi_thread")]
async fn diagnostics_come_for_every_frame_or_at_a_rate() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(5, "steps = 30\nframe_interval = 3")).await;
    let request = v1::WatchDiagnosticsRequest {
        delivery: v1::Delivery::Every.into(),
        ..v1::WatchDiagnosticsRequest::of(&id)
    };
    let all = server.client.watch_diagnostics(request).await.expect("a stream").into_inner();
    let request = v1::WatchDiagnosticsRequest { max_rate_hz: 10.0, ..v1::WatchDiagnosticsRequest::of(&id) };
    let some = server.client.watch_diagnostics(request).await.expect("a stream").into_inner();
    server.play(&id).await;

    let collect = |stream: tonic::Streaming<v1::WatchDiagnosticsResponse>| async {
        let messages = in_time(stream.collect::<Vec<_>>()).await;
        let diagnostics = |message: v1::WatchDiagnosticsResponse| match message.event {
            Some(v1::watch_diagnostics_response::Event::Diagnostics(diagnostics)) => Some(diagnostics),
            _ => None,
        };
        let messages = messages.into_iter().map(|message| message.expect("no error"));
        messages.filter_map(diagnostics).collect::<Vec<_>>()
    };

    let all = collect(all).await;
    assert_eq!(all.iter().map(|d| d.step).collect::<Vec<_>>(), (0..=10).map(|i| 3 * i).collect::<Vec<_>>());

    let last = all.last().expect("diagnostics");
    assert!(last.step_seconds > 0.0 && last.max_stretch > 0.9 && last.solve.is_some());
    assert!(last.stages.iter().any(|stage| stage.seconds > 0.0), "stages have times");
    let some = collect(some).await;
    assert!(some.len() <= all.len() && some.last().is_some_and(|d| d.step == 30));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_deleted_session_ends_its_streams_with_a_reason() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    let (mut a, mut b) = (server.watch(every(&id, 0)).await, server.watch(latest(&id)).await);
    assert_eq!(server.until(&id, |_| true).await.watcher_count, 2);
    server.client.delete_session(v1::DeleteSessionRequest::of(id)).await.expect("deleted");
    for watch in [&mut a, &mut b] {
        let (frames, status) = watch.until_break().await;
        assert_reason(&status, Reason::SessionDeleted);
        assert!(frames.len() <= 1);
    }
    assert!(matches!(a.next().await, Next::Closed));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watcher_that_leaves_is_no_longer_counted() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    for _ in 0..50 {
        let mut watch = server.watch(latest(&id)).await;
        watch.frame().await;
    }
    server.until(&id, |session| session.watcher_count == 0).await;
}
