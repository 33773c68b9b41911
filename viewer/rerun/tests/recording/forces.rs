//! The force on a collider is an arrow that pushes it where it is; none stays where there is no force.

use nappe_client::{Frame, v1};

use crate::poses::{frame, pose, record};

const ARROW: &str = "/world/forces/0_box";

/// A frame in which the box feels a force (N).
fn pushed(number: u64, [x, y, z]: [f64; 3]) -> Frame {
    let force = Some(v1::Vector3 { x, y, z });
    let load = v1::ColliderLoad { name: "box".to_owned(), force, ..v1::ColliderLoad::default() };
    let diagnostics = v1::Diagnostics { loads: vec![load], ..v1::Diagnostics::default() };
    Frame { diagnostics: Some(diagnostics), ..frame(number, Vec::new()) }
}

#[test]
fn arrows_are_in_proportion_to_the_greatest_force_so_far_and_go_when_it_ends() {
    let recorded = record(
        "forces",
        [
            frame(0, Vec::new()),
            pushed(1, [0.0, -4.0, 0.0]),
            pushed(2, [0.0, -1.0, 0.0]),
            pushed(3, [0.0; 3]),
            frame(4, Vec::new()),
            pushed(5, [0.0, f64::NAN, 0.0]),
            pushed(6, [8.0, 0.0, 0.0]),
            pushed(7, [0.0, -4.0, 0.0]),
            frame(8, Vec::new()),
        ],
    );
    assert_eq!((recorded.count(ARROW, "step"), recorded.count(ARROW, "")), (6, 1));
    let labels = recorded.labels[ARROW].iter();
    let labels: Vec<Vec<&str>> = labels.map(|row| row.iter().map(String::as_str).collect()).collect();
    let expected: [&[&str]; 6] =
        [&["box 4.00 N"], &["box 1.00 N"], &[], &["box 8.00 N"], &["box 4.00 N"], &[]];
    assert_eq!(labels, expected);

    let vectors = &recorded.vectors[ARROW];
    let longest = -vectors[0][0][1];
    assert!(longest > 0.15 && longest < 0.25, "a fifth of a scene whose radius is nearly 1 m: {longest}");
    let expected: [&[[f32; 3]]; 6] = [
        &[[0.0, -longest, 0.0]],
        &[[0.0, -0.25 * longest, 0.0]],
        &[],
        &[[longest, 0.0, 0.0]],
        &[[0.0, -0.5 * longest, 0.0]],
        &[],
    ];
    assert_near(vectors, &expected);
    // The box is 0.8 m wide, 0.4 m high, and its centre 1 m below the origin.
    let starts: [&[[f32; 3]]; 6] = [
        &[[0.0, -0.8 + longest, 0.0]],
        &[[0.0, -0.8 + 0.25 * longest, 0.0]],
        &[],
        &[[-0.4 - longest, -1.0, 0.0]],
        &[[0.0, -0.8 + 0.5 * longest, 0.0]],
        &[],
    ];
    assert_near(&recorded.origins[ARROW], &starts);
}

#[test]
fn an_arrow_goes_along_with_its_collider() {
    // Turned by a quarter about y, 2 m along x: its z, along which it is 0.2 m wide, points along x.
    let moved = Frame { poses: vec![pose(20)], ..pushed(20, [0.5, 0.0, 0.0]) };
    let recorded = record("forces_moved", [moved]);
    let [vector, start] = [&recorded.vectors[ARROW][0][0], &recorded.origins[ARROW][0][0]];
    let tip = [0, 1, 2].map(|axis| start[axis] + vector[axis]);
    assert_near(&[vec![tip]], &[&[[1.9, -1.0, 0.0]]]);
}

fn assert_near(found: &[Vec<[f32; 3]>], expected: &[&[[f32; 3]]]) {
    assert_eq!(found.len(), expected.len(), "{found:?}, not {expected:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert_eq!(found.len(), expected.len(), "{found:?}, not {expected:?}");
        let pairs = found.as_flattened().iter().zip(expected.as_flattened());
        let far = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(far < 1e-6, "{found:?}, not {expected:?}");
    }
}
