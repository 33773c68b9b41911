//! Sessions of snow: their fields, diagnostics and topology, refused steps, failures, changes.

use std::collections::BTreeSet;

use nappe_proto::v1::{
    self, Encoding, Field, SessionState, TimeBound, collider_shape::Shape, create_session_request::Scene,
};
use nappe_server::{Limits, Reason};
use nappe_sim::{field, math::Precision, report::NoStopwatch};
use prost::Message as _;
use prost_types::{FieldDescriptorProto, FileDescriptorSet};
use tonic_types::StatusExt as _;

use crate::{
    cloth_scenes::sheet_with,
    harness::{Server, assert_reason, every, latest, request},
    simulation::simulation,
    snow_scenes::{ball, diverging, snow, snow_with, too_long},
};

/// Every field of snow, in binary64.
fn all_fields(id: &str) -> v1::WatchFramesRequest {
    let fields = [Field::Positions, Field::Velocities, Field::PlasticRatio, Field::StressNorm];
    let evaluated = [Field::Forces, Field::Accelerations];
    v1::WatchFramesRequest {
        fields: fields.into_iter().chain(evaluated).map(i32::from).collect(),
        encoding: Encoding::RawF64.into(),
        ..every(id, 0)
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_field_of_snow_arrives_with_the_bits_of_the_simulation() {
    let mut server = Server::start().await;
    for (name, precision) in [("f32", Precision::F32), ("f64", Precision::F64)] {
        let text = snow(&format!("steps = 6\nhash_interval = 1\nprecision = \"{name}\""));
        let id = server.session(text.clone()).await;
        let mut watch = server.watch(all_fields(&id)).await;
        let mut narrow = server.watch(v1::WatchFramesRequest { encoding: 0, ..all_fields(&id) }).await;
        server.play(&id).await;

        let (frames, _) = watch.until_end().await;
        let (narrow, _) = narrow.until_end().await;
        let mut reference = simulation(&text, precision);
        assert_eq!(frames.len(), 7);
        for (number, frame) in frames.iter().enumerate() {
            let fields = [
                (Field::Positions, field::Field::Positions),
                (Field::Velocities, field::Field::Velocities),
                (Field::PlasticRatio, field::Field::PlasticRatios),
                (Field::StressNorm, field::Field::StressNorms),
                (Field::Forces, field::Field::Forces),
                (Field::Accelerations, field::Field::Accelerations),
            ];
            for (field, own) in fields {
                let mut expected = vec![0.0; own.width() * reference.particle_count()];
                reference.read::<f64>(own, &mut expected);
                assert_eq!(frame.numbers(field, f64::from_le_bytes), expected, "{field:?} of frame {number}");
                let rounded: Vec<f32> = expected.iter().map(|number| *number as f32).collect();
                assert_eq!(narrow[number].numbers(field, f32::from_le_bytes), rounded, "{field:?}, binary32");
            }
            assert_eq!(frame.head.state_hash, Some(reference.state_hash()), "frame {number}");
            assert!(frame.grid.is_none(), "nobody asked for the grid");
            reference.step(&mut NoStopwatch).expect("a step");
        }

        // It hit the floor: it is under stress, and packed somewhere.
        let stress = frames[6].numbers(Field::StressNorm, f64::from_le_bytes);
        let packing = frames[6].numbers(Field::PlasticRatio, f64::from_le_bytes);
        assert!(stress.iter().any(|s| *s > 100.0) && packing.iter().any(|ratio| *ratio < 1.0));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn diagnostics_of_snow_are_those_of_the_step_and_all_finite() {
    let mut server = Server::start().await;
    let text = snow("steps = 4");
    let id = server.session(text.clone()).await;
    let mut watch = server.watch(every(&id, 0)).await;
    server.play(&id).await;
    let (frames, _) = watch.until_end().await;

    assert_eq!(frames[0].head.diagnostics.as_ref().expect("diagnostics").snow, None, "there was no step");
    let mut reference = simulation(&text, Precision::F32);
    for frame in &frames[1..] {
        let report = reference.step(&mut NoStopwatch).expect("a step");
        let expected = report.snow.expect("diagnostics of snow");
        let diagnostics = frame.head.diagnostics.as_ref().expect("diagnostics");

        let sent = diagnostics.snow.expect("diagnostics of snow");
        assert_eq!((sent.substeps, sent.dt_seconds), (expected.substeps, expected.dt));
        assert!(sent.substeps > 1, "a frame of a film is many steps of snow");
        assert_eq!((sent.bound_particle, sent.bound_seconds), (expected.bound.particle, expected.bound.dt));
        assert_eq!(format!("{:?}", sent.bound()), format!("{:?}", expected.bound.kind));
        assert_ne!(sent.bound(), TimeBound::Unspecified);
        assert_eq!([sent.min_plastic_ratio, sent.max_plastic_ratio], expected.plastic_ratio_range);
        assert_eq!((sent.mass, sent.grid_mass_error), (expected.mass, expected.grid_mass_error));
        assert_eq!((sent.max_speed, sent.dropped_momentum), (expected.max_speed, expected.dropped_momentum));

        let counts = [sent.plastic_count, sent.inverted_count, sent.clamped_count, sent.ballistic_count];
        let those = [expected.plastic_count, expected.inverted_count, expected.clamped_count];
        assert_eq!((&counts[..3], counts[3]), (&those[..], expected.ballistic_count));
        assert_eq!(sent.block_count, expected.block_count);
        let angular_momentum: [f64; 3] = sent.angular_momentum.expect("angular momentum").into();
        assert_eq!(angular_momentum, expected.angular_momentum);

        assert_eq!(diagnostics.elastic_energy, report.diagnostics.elastic_energy);
        let stages: Vec<&str> = diagnostics.stages.iter().map(|stage| stage.stage.as_str()).collect();
        for stage in ["sort", "particles_to_grid", "grid_update", "grid_to_particles", "diagnose"] {
            assert!(stages.contains(&stage), "{stage} among {stages:?}");
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_topology_has_a_body_for_each_cloth_and_object_and_every_shape_of_collider() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(5, "") + &ball("") + COLLIDERS).await;
    let session = server.get(&id).await;
    let mut watch = server.watch(latest(&id)).await;
    let bodies: Vec<_> = watch.topology.bodies.iter().map(|b| (b.name.as_str(), b.first_particle)).collect();
    assert_eq!(bodies, [("sheet", 0), ("ball", 25)]);
    let snow = &watch.topology.bodies[1];
    assert!(snow.triangles_u32.is_empty() && snow.springs_u32.is_empty() && snow.pins_u32.is_empty());
    assert_eq!(session.particle_count, 25 + u64::from(snow.particle_count));

    let shapes: Vec<_> =
        watch.topology.colliders.iter().filter_map(|collider| collider.shape.clone()).collect();
    assert!(shapes.iter().any(|s| matches!(s, Shape::Capsule(c) if c.radius == 0.1)));
    for collider in &watch.topology.colliders {
        let velocity = if collider.name == "capsule" { [0.0, 0.0, 0.25] } else { [0.0; 3] };
        assert_eq!(collider.velocity, Some(velocity.into()), "{}", collider.name);
    }
    assert!(shapes.iter().any(|s| matches!(s, Shape::Cylinder(c) if c.radius == 0.2)));
    assert!(shapes.iter().any(|s| matches!(s, Shape::HalfPipe(p) if p.radius == 2.0 && p.up.is_some())));
    let half_extent = Some(v1::Vector3 { x: 0.1, y: 0.2, z: 0.3 });
    assert!(shapes.iter().any(|s| matches!(s, Shape::Box(b) if b.half_extent == half_extent)));

    // Cloth has no packing and no stress.
    let request = v1::WatchFramesRequest {
        fields: [Field::PlasticRatio, Field::StressNorm].map(i32::from).to_vec(),
        ..latest(&id)
    };
    let frame = server.watch(request).await.frame().await;
    assert_eq!(frame.numbers(Field::PlasticRatio, f32::from_le_bytes)[..25], [1.0; 25]);
    assert_eq!(frame.numbers(Field::StressNorm, f32::from_le_bytes)[..25], [0.0; 25]);
    assert_eq!(
        watch.frame().await.numbers(Field::Positions, f32::from_le_bytes).len() as u64,
        3 * session.particle_count
    );
}

#[test]
fn a_scene_has_a_section_for_each_shape_of_the_contract_and_for_no_other() {
    let files = FileDescriptorSet::decode(v1::FILE_DESCRIPTOR_SET).expect("descriptors");
    let messages = files.file.iter().flat_map(|file| &file.message_type);
    let colliders = messages.filter(|message| message.name() == "ColliderShape");
    let shapes = colliders.flat_map(|message| &message.field).filter(|field| field.oneof_index.is_some());
    let shapes: BTreeSet<&str> = shapes.map(FieldDescriptorProto::name).collect();
    let page = nappe_scene::reference_page();
    let sections = page.lines().filter_map(|line| line.strip_prefix("### collider."));
    assert_eq!(sections.filter(|section| *section != "key").collect::<BTreeSet<_>>(), shapes);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fixed_step_above_the_bound_is_refused_with_the_number_unless_unchecked() {
    let mut server = Server::start().await;
    let create = |text| v1::CreateSessionRequest { scene: Some(Scene::SceneText(text)), ..request() };
    let fixed = snow_with("", "substep = 0.02");
    let refused = server.client.create_session(create(fixed.clone())).await.expect_err("above the bound");
    assert_reason(&refused, Reason::InvalidScene);
    for part in ["2.0000e-2 s", "isolated_particle", "unchecked"] {
        assert!(refused.message().contains(part), "{part}: {}", refused.message());
    }

    let unchecked = snow_with("", "substep = 0.02\nunchecked = true");
    server.client.create_session(create(unchecked)).await.expect("unchecked steps are the scene's own risk");
    let short = snow_with("", "substep = 1e-4");
    let id = server.session(short).await;
    let snow = server.step(&id, 1).await.diagnostics.and_then(|d| d.snow).expect("diagnostics of snow");
    assert_eq!((snow.bound(), snow.substeps), (TimeBound::Fixed, 417));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_divergence_of_snow_names_reason_particle_and_step_and_keeps_the_last_good_state() {
    let mut server = Server::start().await;
    let (bad, good) = (server.session(diverging()).await, server.session(snow("")).await);
    let mut watch = server.watch(all_fields(&bad)).await;
    let step = v1::StepSessionRequest { step_count: 10_000, wait: true, ..v1::StepSessionRequest::of(&bad) };
    let status = server.client.step_session(step).await.expect_err("it diverges");
    let failed = server.until(&bad, |session| session.state() == SessionState::Failed).await;
    let failure = failed.failure.clone().expect("a failed session says why");
    println!("{}: {}", failure.reason, failure.message);
    let of_snow = [Reason::NodeSpeed, Reason::DeformationLimit, Reason::NotFinite, Reason::OutOfRange];
    let reason =
        of_snow.into_iter().find(|reason| reason.name() == failure.reason).expect("a reason of snow");
    let metadata = assert_reason(&status, reason);
    assert_eq!(metadata["step"], failure.step.to_string());
    assert_eq!(metadata["particle"], failure.particle.expect("the particle").to_string());
    assert!(failure.particle.is_some_and(|particle| particle < failed.particle_count));
    assert_eq!(failed.step, failure.step, "the step that failed was not taken");

    // No number that is not finite left, and what stands is the state before the step that failed.
    let (frames, broken) = watch.until_break().await;
    assert_eq!(assert_reason(&broken, reason), metadata);
    for (frame, field) in frames.iter().flat_map(|frame| frame.fields.values().map(move |f| (frame, f))) {
        let numbers = field.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes));
        assert!(numbers.into_iter().all(f64::is_finite), "frame {}", frame.head.frame);
    }

    let last = &frames.last().expect("frames").head;
    assert_eq!((last.step, last.state_hash), (failure.step, failed.state_hash));
    let again = server.watch(all_fields(&bad)).await.frame().await;
    assert_eq!(again.fields, frames[0].fields, "it stays readable");
    assert_eq!(server.step(&good, 3).await.step, 3, "others go on");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fixed_step_that_packing_makes_too_long_ends_the_session_with_both_numbers() {
    let mut server = Server::start().await;
    let id = server.session(too_long(0.0031, "")).await;
    let step = v1::StepSessionRequest { step_count: 1000, wait: true, ..v1::StepSessionRequest::of(&id) };
    let status = server.client.step_session(step).await.expect_err("it hardens");
    let metadata = assert_reason(&status, Reason::TimeStepLimit);
    assert_eq!((metadata["value"].as_str(), metadata["body"].as_str()), ("0.0031", "ball"));
    assert!(status.message().contains("3.1000e-3 s is above the bound"), "{}", status.message());
    let session = server.get(&id).await;
    let failure = session.failure.expect("a failed session says why");
    assert!(failure.step > 0 && failure.particle.is_some() && failure.value == Some(0.0031), "{failure:?}");
    assert_eq!((session.step, session.frame), (failure.step, failure.step));
}

#[tokio::test(flavor = "multi_thread")]
async fn the_hash_does_not_depend_on_the_number_of_threads() {
    let mut server = Server::start().await;
    let mut hashes = Vec::new();
    for thread_count in [1, 2] {
        let scene = Some(Scene::SceneText(snow("")));
        let id = server.create(v1::CreateSessionRequest { scene, thread_count, ..request() }).await;
        hashes.push(server.step(&id, 8).await.state_hash.expect("a paused session has a hash"));
    }
    assert_eq!(hashes[0], hashes[1]);
}

#[tokio::test(flavor = "multi_thread")]
async fn particles_of_cloth_and_snow_count_together() {
    let text = sheet_with(5, "") + &ball("");
    let mut server = Server::start().await;
    let id = server.session(text.clone()).await;
    let session = server.get(&id).await;
    let count = session.particle_count;
    assert_eq!(session.snow_particle_count, count - 25);
    for (max_particles, fits) in [(count, true), (count - 1, false), (25, false)] {
        let mut server = Server::with(Limits { max_particles, ..Limits::default() }).await;
        let create = v1::CreateSessionRequest { scene: Some(Scene::SceneText(text.clone())), ..request() };
        match server.client.create_session(create).await {
            Ok(_) => assert!(fits, "{max_particles}"),
            Err(status) => {
                assert!(!fits, "{max_particles}: {status:?}");
                assert_reason(&status, Reason::SceneTooLarge);
            }
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn gravity_acts_on_snow_from_its_step_on() {
    let mut server = Server::start().await;
    let id = server.session(snow("gravity = [0, 0, 0]")).await;
    let gravity = Some(v1::Vector3 { x: 1.0, y: 0.0, z: 0.0 });
    let update =
        v1::UpdateParametersRequest { session_id: id.clone(), at_step: 1, gravity, ..Default::default() };
    server.client.update_parameters(update).await.expect("accepted");
    let mut watch = server.watch(all_fields(&id)).await;
    server.step(&id, 2).await;
    let mut mean = Vec::new();
    for _ in 0..3 {
        let v = watch.frame().await.numbers(Field::Velocities, f64::from_le_bytes);
        let along_x: Vec<f64> = v.iter().step_by(3).copied().collect();
        mean.push(along_x.iter().sum::<f64>() / along_x.len() as f64);
    }

    // Nothing else pushes along x, and all particles weigh the same: dv = g dt, on the mean.
    let dt = server.get(&id).await.dt_seconds;
    assert!(mean[1].abs() < 1e-6 && (mean[2] - mean[1] - dt).abs() < 1e-5, "{mean:?}, dt {dt}");
}

#[tokio::test(flavor = "multi_thread")]
async fn changes_that_snow_does_not_have_are_refused_and_say_so() {
    let mut server = Server::start().await;
    let alone = server.session(snow("")).await;
    let both = server.session(sheet_with(5, "") + &ball("")).await;

    let springs = |id: &str, body: &str| v1::UpdateParametersRequest {
        session_id: id.into(),
        springs: vec![v1::SpringUpdate { body: body.into(), stiffness: Some(1.0), ..Default::default() }],
        ..Default::default()
    };

    let pin = |id: &str, particle| v1::UpdateParametersRequest {
        session_id: id.into(),
        pins: vec![v1::PinUpdate { particle, target: Some(v1::Vector3::default()), duration_seconds: 1.0 }],
        ..Default::default()
    };

    for (request, said) in [
        (springs(&alone, "ball"), "'ball' is snow, which has no springs"),
        (springs(&both, "ball"), "'ball' is snow, which has no springs"),
        (springs(&alone, ""), "there is no cloth"),
        (springs(&both, "boat"), "no body is named 'boat'"),
        (pin(&alone, 3), "particle 3 is not pinned"),
        (pin(&both, 30), "particle 30 is not pinned"),
        (pin(&both, 1_000_000), "there is no particle 1000000"),
    ] {
        let status = server.client.update_parameters(request).await.expect_err("refused");
        assert_reason(&status, Reason::InvalidChange);
        assert!(status.message().contains(said), "{said}: {}", status.message());
        assert!(status.get_details_bad_request().is_some_and(|bad| !bad.field_violations.is_empty()));
    }

    // Springs of all bodies are those of the cloth, and pins of the cloth still move.
    for request in [springs(&both, ""), pin(&both, 0)] {
        server.client.update_parameters(request).await.expect("accepted");
    }
    assert_eq!(server.step(&both, 2).await.step, 2);
}

/// Colliders of each shape besides plane and sphere, far from the snow.
const COLLIDERS: &str = r#"
[[collider]]
name = "capsule"
capsule = { start = [50, 0, 0], end = [50, 1, 0], radius = 0.1 }
velocity = [0, 0, 0.25]
[[collider]]
name = "crate"
box = { center = [60, 0, 0], size = [0.2, 0.4, 0.6] }
[[collider]]
name = "pillar"
cylinder = { start = [70, 0, 0], end = [70, 1, 0], radius = 0.2 }
[[collider]]
name = "trough"
half_pipe = { point = [0, -50, 0], axis = [0, 0, 1], up = [0, 1, 0], radius = 2 }
"#;
