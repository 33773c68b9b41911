//! A collider stands in each frame where the frame says that it is, and is placed again only when it has moved.

use nappe_client::{Body, Collider, ColliderPose, Frame, Shape, Topology, Vectors, v1};
use nappe_rerun::{ColorBy, Recorder, Sink};

use crate::recorded::{Recorded, file};

/// A particle above a box.
fn scene() -> Topology {
    let vector = |[x, y, z]: [f64; 3]| Some(v1::Vector3 { x, y, z });
    let solid = v1::BoxShape {
        center: vector([0.0, -1.0, 0.0]),
        half_extent: vector([0.4, 0.2, 0.1]),
        axis_x: vector([1.0, 0.0, 0.0]),
        axis_y: vector([0.0, 1.0, 0.0]),
    };
    let body = Body {
        name: "dust".to_owned(),
        first_particle: 0,
        particle_count: 1,
        triangles: Vec::new(),
        springs: Vec::new(),
        pins: Vec::new(),
        uv: Vec::new(),
        color: None,
        masses: Vec::new(),
        volumes: Vec::new(),
    };
    let solid = Collider { name: "box".to_owned(), shape: Some(Shape::Box(solid)), velocity: [0.0; 3] };
    Topology { id: 1, particle_count: 1, bodies: vec![body], colliders: vec![solid] }
}

pub(crate) fn frame(number: u64, poses: Vec<ColliderPose>) -> Frame {
    Frame {
        frame: number,
        step: number,
        time: 0.01 * number as f64,
        state_hash: None,
        positions: Vectors::F32(vec![0.0; 3]),
        velocities: None,
        plastic_ratios: None,
        stress_norms: None,
        forces: None,
        accelerations: None,
        grid: None,
        dropped_count: 0,
        diagnostics: None,
        poses,
        carried: None,
    }
}

/// The angle (rad) about y in a frame.
fn angle(number: u64) -> f64 {
    number as f64 / 20.0 * std::f64::consts::FRAC_PI_2
}

pub(crate) fn pose(number: u64) -> ColliderPose {
    let (sine, cosine) = (0.5 * angle(number)).sin_cos();
    let position = [0.1 * number as f64, -1.0, 0.0];
    ColliderPose { name: "box".to_owned(), position, turn: [0.0, sine, 0.0, cosine] }
}

pub(crate) fn record(test: &str, frames: impl IntoIterator<Item = Frame>) -> Recorded {
    let path = file(test);
    let mut recorder = Recorder::open("poses", Sink::Save(path.clone()), ColorBy::default()).expect("opens");
    recorder.topology(&scene()).expect("records");
    for frame in frames {
        recorder.frame(&frame).expect("records");
    }
    recorder.finish().expect("closes");
    Recorded::read(&path)
}

const BOX: &str = "/world/colliders/0_box";

#[test]
fn a_turning_box_is_at_its_pose_in_frames_0_10_and_20() {
    let recorded = record("turning", (0..=20).map(|number| frame(number, vec![pose(number)])));
    let (places, axes) = (&recorded.translations[BOX], &recorded.axes[BOX]);
    assert_eq!((places.len(), axes.len()), (21, 21));
    for number in [0, 10, 20] {
        let (sine, cosine) = angle(number).sin_cos();
        // x turns to -z and z to x; columns follow each other.
        let expected = [cosine, 0.0, -sine, 0.0, 1.0, 0.0, sine, 0.0, cosine];
        let row = number as usize;
        let found = places[row].iter().chain(&axes[row]).copied().map(f64::from);
        let expected = pose(number).position.into_iter().chain(expected);
        let far = found.zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(far < 1e-6, "frame {number}: {:?} {:?}", places[row], axes[row]);
    }
}

#[test]
fn a_box_that_is_let_go_is_where_it_began() {
    let frames = [frame(0, vec![]), frame(1, vec![pose(4)]), frame(2, vec![pose(4)]), frame(3, vec![])];
    let recorded = record("let_go", frames);
    let places = &recorded.translations[BOX];
    assert_eq!(places.len(), 3, "it is placed again only when it has moved: {places:?}");
    assert_eq!((places[0], places[2]), ([0.0, -1.0, 0.0], [0.0, -1.0, 0.0]));
    assert!((places[1][0] - 0.4).abs() < 1e-6, "{places:?}");
}
