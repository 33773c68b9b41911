//! A recording of cloth holds its meshes, colliders and diagnostics, every frame and a layout; and errors of any
//! recording say what is wrong.

use std::{path::Path, sync::Arc};

use nappe_client::{Body, Collider, Frame, Shape, Topology, Vectors, v1};
use nappe_rerun::{ColorBy, LiveRecorder, Recorder, RerunError, Sink};

use crate::recorded::{Recorded, TIMELINES, file};

const SIDE: usize = 12;
const FRAMES: u64 = 5;

/// A sheet of `SIDE` x `SIDE` particles pinned at two corners, a chain of three, a still plane, a moving ball.
fn scene() -> Topology {
    let at = |row: usize, column: usize| (row * SIDE + column) as u32;
    let cells = (0..SIDE - 1).flat_map(|row| (0..SIDE - 1).map(move |column| (row, column)));
    let triangles = cells
        .flat_map(|(r, c)| {
            [[at(r, c), at(r + 1, c), at(r, c + 1)], [at(r, c + 1), at(r + 1, c), at(r + 1, c + 1)]]
        })
        .collect();
    let count = SIDE * SIDE;
    let sheet = Body {
        name: "sheet".to_owned(),
        first_particle: 0,
        particle_count: count,
        triangles,
        springs: Vec::new(),
        pins: vec![0, SIDE as u32 - 1],
        uv: Vec::new(),
        color: None,
        masses: Vec::new(),
        volumes: Vec::new(),
    };
    let base = count as u32;
    let chain = Body {
        name: "a chain/of three".to_owned(),
        first_particle: count,
        particle_count: 3,
        triangles: Vec::new(),
        springs: vec![[base, base + 1], [base + 1, base + 2]],
        pins: Vec::new(),
        uv: Vec::new(),
        color: None,
        masses: Vec::new(),
        volumes: Vec::new(),
    };
    let vector = |[x, y, z]: [f64; 3]| Some(v1::Vector3 { x, y, z });
    let plane = v1::PlaneShape { point: None, normal: vector([0.0, 1.0, 0.0]) };
    let ball = v1::SphereShape { center: vector([0.5, 0.5, 0.5]), radius: 0.25 };
    let colliders = vec![
        Collider { name: "floor".to_owned(), shape: Some(Shape::Plane(plane)), velocity: [0.0; 3] },
        Collider { name: "ball".to_owned(), shape: Some(Shape::Sphere(ball)), velocity: [0.1, 0.0, 0.0] },
    ];
    Topology { id: 1, particle_count: count + 3, bodies: vec![sheet, chain], colliders }
}

fn frame(number: u64) -> Frame {
    let spacing = 1.0 / SIDE as f32;
    let height = 1.0 - 0.1 * number as f32;
    let sheet =
        (0..SIDE * SIDE).flat_map(|p| [(p % SIDE) as f32 * spacing, height, (p / SIDE) as f32 * spacing]);
    let chain = (0..3).flat_map(|link| [2.0, height - 0.1 * link as f32, 0.0]);
    let load = |name: &str, y: f64| v1::ColliderLoad {
        name: name.to_owned(),
        force: Some(v1::Vector3 { x: 0.0, y, z: 0.0 }),
        ..v1::ColliderLoad::default()
    };
    let loads = vec![load("floor", -2.0), load("ball", if number == 2 { f64::NAN } else { -0.5 })];
    let solve = v1::SolveReport { iterations: 10, relative_residual: 1e-3, ..v1::SolveReport::default() };
    Frame {
        frame: number,
        step: 2 * number,
        time: 0.02 * number as f64,
        state_hash: None,
        positions: Vectors::F32(sheet.chain(chain).collect()),
        velocities: None,
        plastic_ratios: None,
        stress_norms: None,
        forces: None,
        accelerations: None,
        grid: None,
        dropped_count: 0,
        diagnostics: Some(v1::Diagnostics { solve: Some(solve), loads, ..v1::Diagnostics::default() }),
        poses: Vec::new(),
        carried: None,
    }
}

fn record(path: &Path) -> Result<(), RerunError> {
    let mut recorder = Recorder::open("a test", Sink::Save(path.to_owned()), ColorBy::default())?;
    recorder.topology(&scene())?;
    for number in 0..FRAMES {
        recorder.frame(&frame(number))?;
    }
    recorder.finish()
}

#[test]
fn a_file_holds_topology_once_and_every_frame_on_both_timelines() {
    let path = file("every");
    record(&path).expect("records");
    let recorded = Recorded::read(&path);
    let moving = [
        "/world/bodies/0_sheet",
        "/world/pins/0_sheet",
        "/world/bodies/1_a_chain_of_three",
        "/world/colliders/1_ball",
        "/plots/energy",
        "/plots/iterations",
        "/plots/residual",
        "/plots/step_time",
        "/plots/loads/0_floor",
    ];
    for entity in moving {
        for timeline in TIMELINES {
            assert_eq!(recorded.count(entity, timeline), FRAMES as usize, "{entity} on {timeline}");
        }
        assert_eq!(recorded.count(entity, ""), 1, "{entity} is described once");
    }
    assert_eq!(
        recorded.count("/plots/loads/1_ball", "step"),
        FRAMES as usize - 1,
        "what is no number is a gap"
    );
    assert_eq!(recorded.count("/world/colliders/0_floor", "step"), 1, "a still plane is placed once");
    assert!(recorded.count("/world/colliders/0_floor", "") > 0);
    assert_eq!(recorded.count("/world", ""), 1, "the axes");
    let snow = recorded.rows.keys().find(|(entity, _)| entity.contains("snow") || entity.contains("grid"));
    assert_eq!(snow, None, "there is no snow");
}

#[test]
fn a_file_opens_with_a_layout_and_a_camera() {
    let path = file("layout");
    record(&path).expect("records");
    let recorded = Recorded::read(&path);
    assert!(recorded.has_active_blueprint);
    let has = |part: &str| recorded.blueprint_entities.iter().any(|entity| entity.ends_with(part));
    for part in ["/EyeControls3D", "/Background", "/PlotLegend", "/viewport", "/time_panel"] {
        assert!(has(part), "{part} is not in {:?}", recorded.blueprint_entities);
    }
}

#[test]
fn a_live_recorder_writes_the_newest_frame_and_counts_the_others() {
    let path = file("live");
    let recorder =
        LiveRecorder::start("a test", Sink::Save(path.clone()), ColorBy::default()).expect("opens");
    recorder.topology(Arc::new(scene()));
    for number in 0..100 {
        recorder.frame(Arc::new(frame(number)));
    }
    let summary = recorder.finish().expect("closes");
    assert_eq!(summary.recorded_count + summary.dropped_count, 100);
    assert!(summary.recorded_count >= 1);
    let rows = Recorded::read(&path).count("/world/bodies/0_sheet", "step");
    assert_eq!(rows as u64, summary.recorded_count);
}

#[test]
fn a_frame_of_another_size_is_refused_with_both_counts() {
    let sink = Sink::Save(file("wrong"));
    let mut recorder = Recorder::open("a test", sink, ColorBy::default()).expect("opens");
    recorder.topology(&scene()).expect("records");
    let wrong = Frame { positions: Vectors::F32(vec![0.0; 9]), ..frame(7) };
    let expected = SIDE * SIDE + 3;
    match recorder.frame(&wrong) {
        Err(RerunError::Frame { frame: 7, found: 3, expected: count }) => assert_eq!(count, expected),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_file_in_no_folder_is_refused_by_name() {
    let error = record(Path::new("/no/such/folder/x.rrd")).expect_err("there is no such folder");
    let message = error.to_string();
    assert!(message.contains("/no/such/folder/x.rrd"), "{message}");
}

/// Writes to it fail as on a full disk.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_reported() {
    let error = record(Path::new("/dev/full")).expect_err("nothing fits");
    assert!(matches!(error, RerunError::File { .. }), "{error}");
    let message = error.to_string();
    assert!(message.contains("/dev/full") && message.contains("the disk is full"), "{message}");
}

#[test]
fn a_viewer_that_is_not_there_is_reported_with_its_address() {
    // Port 1 of the loopback interface: nobody listens.
    let url = "rerun+http://127.0.0.1:1/proxy";
    let error = Recorder::open("a test", Sink::Connect(url.to_owned()), ColorBy::default())
        .err()
        .expect("nobody listens");
    assert!(matches!(&error, RerunError::Connect { url: at, .. } if at == url), "{error}");
}
