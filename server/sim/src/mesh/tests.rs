//! Checks of a mesh with springs of its own.

use super::{MeshSpring, SpringKind, TriangleMesh};

const SPRING: MeshSpring = MeshSpring {
    points: [0, 3],
    kind: SpringKind::Stretch,
    stiffness: 10.0,
    damping: 0.0,
    rest_length: None,
};

fn problem(spring: MeshSpring) -> Option<String> {
    let mesh = TriangleMesh { springs: vec![SPRING, spring], ..TriangleMesh::grid(2, 2, 1.0) };
    mesh.validate().err().map(|error| error.to_string())
}

#[test]
fn springs_join_two_points_of_the_mesh_by_numbers_that_can_be() {
    assert_eq!(problem(MeshSpring { rest_length: Some(1e-9), damping: 2.0, ..SPRING }), None);
    for (spring, told) in [
        (
            MeshSpring { points: [1, 4], ..SPRING },
            "spring 1 names point 4, but there are only 4 points (0 to 3)",
        ),
        (MeshSpring { points: [2, 2], ..SPRING }, "spring 1 joins point 2 to itself: two points are needed"),
        (
            MeshSpring { stiffness: -1.0, ..SPRING },
            "the stiffness of spring 1 is -1; allowed: a finite number, 0 or more",
        ),
        (
            MeshSpring { damping: f64::NAN, ..SPRING },
            "the damping of spring 1 is NaN; allowed: a finite number, 0 or more",
        ),
        (
            MeshSpring { rest_length: Some(0.0), ..SPRING },
            "the rest length of spring 1 is 0; allowed: a finite number above 0, or none: as the mesh lies",
        ),
    ] {
        assert_eq!(problem(spring).as_deref(), Some(told));
    }
}
