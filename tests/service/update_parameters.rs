//! Parameters change at the step named, all or none, with the same bits as a run that had them.

use nappe_proto::v1::{self, SpringKind};
use nappe_server::Reason;
use tonic_types::StatusExt as _;

use crate::{
    cloth_scenes::{sheet, sheet_with},
    harness::{Server, assert_reason, every},
};

fn update(id: &str, at_step: u64) -> v1::UpdateParametersRequest {
    v1::UpdateParametersRequest { session_id: id.into(), at_step, ..v1::UpdateParametersRequest::default() }
}

fn wind(id: &str, at_step: u64) -> v1::UpdateParametersRequest {
    let wind = Some([3.0, 0.0, 1.0].into());
    v1::UpdateParametersRequest { wind, drag: Some(0.05), ..update(id, at_step) }
}

async fn send(server: &mut Server, request: v1::UpdateParametersRequest) -> u64 {
    server.client.update_parameters(request).await.expect("accepted").into_inner().effective_step
}

#[tokio::test(flavor = "multi_thread")]
async fn a_change_takes_effect_at_its_step_to_the_bit() {
    let mut server = Server::start().await;

    // Asked for before the start, for step 10.
    let early = server.session(sheet(6)).await;
    assert_eq!(send(&mut server, wind(&early, 10)).await, 10);
    let early = server.step(&early, 25).await.state_hash;

    // Asked for on the way, for step 10.
    let on_the_way = server.session(sheet(6)).await;
    server.step(&on_the_way, 4).await;
    assert_eq!(send(&mut server, wind(&on_the_way, 10)).await, 10);
    server.step(&on_the_way, 3).await;
    let on_the_way = server.step(&on_the_way, 18).await.state_hash;

    // Asked for at step 10, for now.
    let just_in_time = server.session(sheet(6)).await;
    server.step(&just_in_time, 10).await;
    assert_eq!(send(&mut server, wind(&just_in_time, 0)).await, 10);
    let just_in_time = server.step(&just_in_time, 15).await.state_hash;

    // Asked for one step later.
    let late = server.session(sheet(6)).await;
    assert_eq!(send(&mut server, wind(&late, 11)).await, 11);
    let late = server.step(&late, 25).await.state_hash;

    // Never asked for.
    let never = server.session(sheet(6)).await;
    let never = server.step(&never, 25).await.state_hash;

    assert!(early.is_some());
    assert_eq!((early, early), (on_the_way, just_in_time));
    assert!(early != late && early != never && late != never);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_change_at_step_0_is_as_good_as_the_scene() {
    let mut server = Server::start().await;
    let changed = server.session(sheet(6)).await;
    let gravity = Some([0.0, -1.62, 0.0].into());
    let stiffer = v1::SpringUpdate {
        body: "sheet".into(),
        kind: SpringKind::Stretch.into(),
        stiffness: Some(80.0),
        damping: None,
    };

    let request = v1::UpdateParametersRequest { gravity, springs: vec![stiffer], ..update(&changed, 0) };
    assert_eq!(send(&mut server, request).await, 0);

    let written = sheet(6)
        .replace("dt = 0.002", "dt = 0.002\ngravity = [0, -1.62, 0]")
        .replace("stiffness = 50", "stiffness = 80");
    let written = server.session(written).await;
    let (changed, written) = (server.step(&changed, 20).await, server.step(&written, 20).await);
    assert_eq!(changed.state_hash, written.state_hash);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pin_moves_to_its_target_at_constant_speed() {
    let mut server = Server::start().await;
    let id = server.session(sheet(6)).await;
    let mut watch = server.watch(every(&id, 0)).await;
    let pins = watch.topology.bodies[0].pins_u32.clone();
    let pin = u32::from_le_bytes(pins[..4].try_into().expect("four bytes")) as usize;
    let x = watch.frame().await.numbers(v1::Field::Positions, f32::from_le_bytes);
    let start = f64::from(x[3 * pin + 1]);
    let target = [f64::from(x[3 * pin]), start + 0.1, f64::from(x[3 * pin + 2])].into();
    let mover = v1::PinUpdate { particle: pin as u32, target: Some(target), duration_seconds: 0.02 };

    // Ten steps of 2 ms, from step 5 on.
    let request = v1::UpdateParametersRequest { pins: vec![mover], ..update(&id, 5) };
    assert_eq!(send(&mut server, request).await, 5);
    server.step(&id, 20).await;
    for step in 1..=20_u32 {
        let y = watch.frame().await.numbers(v1::Field::Positions, f32::from_le_bytes)[3 * pin + 1];
        let moved = f64::from(step.saturating_sub(5).min(10)) * 0.01;
        assert!((f64::from(y) - start - moved).abs() < 1e-6, "step {step}: {y}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refused_change_changes_nothing() {
    let mut server = Server::start().await;
    let id = server.session(sheet(6)).await;
    let gravity = Some([0.0, 99.0, 0.0].into());
    let spring = v1::SpringUpdate { stiffness: Some(1.0), ..v1::SpringUpdate::default() };
    let pin = v1::PinUpdate { particle: 0, target: gravity, duration_seconds: 1.0 };

    let with_springs =
        |spring| v1::UpdateParametersRequest { gravity, springs: vec![spring], ..update(&id, 0) };
    let with_pin = |pin| v1::UpdateParametersRequest { gravity, pins: vec![pin], ..update(&id, 0) };

    let cases = [
        (with_springs(v1::SpringUpdate { body: "nobody".into(), ..spring.clone() }), Reason::InvalidChange),
        (
            with_springs(v1::SpringUpdate { kind: SpringKind::Bend.into(), ..spring.clone() }),
            Reason::InvalidChange,
        ),
        (with_springs(v1::SpringUpdate { stiffness: Some(-1.0), ..spring.clone() }), Reason::InvalidChange),
        (
            with_springs(v1::SpringUpdate { stiffness: Some(f64::NAN), ..spring.clone() }),
            Reason::InvalidField,
        ),
        (with_springs(v1::SpringUpdate { stiffness: None, ..spring.clone() }), Reason::InvalidField),
        (with_springs(v1::SpringUpdate { kind: 77, ..spring }), Reason::InvalidField),
        (with_pin(v1::PinUpdate { particle: 20, ..pin }), Reason::InvalidChange),
        (with_pin(v1::PinUpdate { particle: 99, ..pin }), Reason::InvalidChange),
        (with_pin(v1::PinUpdate { duration_seconds: f64::INFINITY, ..pin }), Reason::InvalidField),
        (with_pin(v1::PinUpdate { target: None, ..pin }), Reason::InvalidField),
        (update(&id, 0), Reason::InvalidField),
    ];

    for (request, reason) in cases {
        let status = server.client.update_parameters(request).await.expect_err("refused");
        println!("{}", status.message());
        assert_reason(&status, reason);
        assert!(status.get_details_bad_request().is_some_and(|bad| !bad.field_violations.is_empty()));
    }

    let untouched = server.session(sheet(6)).await;
    let (a, b) = (server.step(&id, 10).await, server.step(&untouched, 10).await);
    assert_eq!(a.state_hash, b.state_hash);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_tells_its_parameters_by_body_and_kind() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(5, "gravity = [0, -5, 0]\nwind = [1, 0, 0]")).await;
    let told = server.get(&id).await.parameters.expect("parameters");
    assert_eq!((told.gravity, told.wind), (Some([0.0, -5.0, 0.0].into()), Some([1.0, 0.0, 0.0].into())));
    let [sheet] = &told.cloths[..] else { panic!("one cloth: {told:?}") };
    assert_eq!((sheet.body.as_str(), sheet.drag), ("sheet", 1e-4));
    let springs = |cloth: &v1::ClothParameters| -> Vec<_> {
        let numbers = |s: &v1::SpringParameters| {
            (s.kind(), [s.min_stiffness, s.max_stiffness], [s.min_damping, s.max_damping])
        };
        cloth.springs.iter().map(numbers).collect()
    };
    let stretch = (SpringKind::Stretch, [50.0, 50.0], [0.02, 0.02]);
    assert_eq!(springs(sheet), [stretch, (SpringKind::Shear, [20.0, 20.0], [0.01, 0.01])]);

    // A change is told once its step is taken.
    let shear = v1::SpringUpdate {
        kind: SpringKind::Shear.into(),
        stiffness: Some(7.0),
        ..v1::SpringUpdate::default()
    };
    send(&mut server, v1::UpdateParametersRequest { springs: vec![shear], ..wind(&id, 3) }).await;
    assert_eq!(server.step(&id, 3).await.parameters, Some(told.clone()));
    let changed = server.step(&id, 1).await.parameters.expect("parameters");
    assert_eq!((changed.gravity, changed.wind), (told.gravity, Some([3.0, 0.0, 1.0].into())));
    assert_eq!(changed.cloths[0].drag, 0.05);
    assert_eq!(springs(&changed.cloths[0]), [stretch, (SpringKind::Shear, [7.0, 7.0], [0.01, 0.01])]);
}
