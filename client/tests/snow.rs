//! What snow adds to frames: numbers per particle, nodes of the grid, new colliders. What comes is as it was
//! sent, whatever the pieces; what is refused is named; no bytes make the decoder panic or take more than its
//! limits.

use nappe_client::{
    Collider, DecodeError, DecodeLimits, Decoder, Field, Fields, Frame, GridFrame, Scalars, Shape,
    TopologyError, Vectors, components, v1,
};
use proptest::prelude::*;
use prost::Message as _;

const NODE_LIMIT: usize = 1000;

fn bytes_of<const N: usize>(numbers: impl IntoIterator<Item = [u8; N]>) -> bytes::Bytes {
    numbers.into_iter().flatten().collect::<Vec<u8>>().into()
}

fn topology_of(particle_count: u32) -> v1::Topology {
    let body = v1::BodyTopology { name: "ball".to_owned(), particle_count, ..v1::BodyTopology::default() };
    v1::Topology { topology_id: 1, particle_count, bodies: vec![body], ..v1::Topology::default() }
}

fn decoder(particle_count: u32, fields: Fields) -> Decoder {
    let limits = DecodeLimits { max_grid_nodes: NODE_LIMIT, ..DecodeLimits::default() };
    let mut decoder = Decoder::new(fields, limits);
    decoder.topology(topology_of(particle_count)).expect("a topology").expect("in one piece");
    decoder
}

fn field(field: v1::Field, encoding: v1::Encoding, first_particle: u32, values: &[f64]) -> v1::FieldData {
    let data = match encoding {
        v1::Encoding::RawF64 => bytes_of(values.iter().map(|value| value.to_le_bytes())),
        _ => bytes_of(values.iter().map(|&value| (value as f32).to_le_bytes())),
    };
    let (field, encoding) = (field.into(), encoding.into());
    v1::FieldData { field, encoding, first_particle, data, ..v1::FieldData::default() }
}

fn piece(index: u32, count: u32, fields: Vec<v1::FieldData>, grid: Option<v1::GridField>) -> v1::Frame {
    let chunk = Some(v1::Chunk { index, count });
    v1::Frame { frame: 5, topology_id: 1, fields, grid, chunk, ..v1::Frame::default() }
}

/// A frame without particles, of these pieces of a grid.
fn grids(pieces: Vec<v1::GridField>) -> Result<Option<Frame>, DecodeError> {
    let mut decoder = decoder(0, Fields::positions());
    let count = pieces.len() as u32;
    let mut last = Ok(None);
    for (index, grid) in (0..).zip(pieces) {
        last = decoder.frame(piece(index, count, Vec::new(), Some(grid)));
        if last.is_err() {
            break;
        }
    }
    last
}

/// Nodes `range` of a row of `node_count` nodes along x.
fn row(range: std::ops::Range<i32>, node_count: u64) -> v1::GridField {
    v1::GridField {
        cell: 0.25,
        index_i32: bytes_of(range.clone().flat_map(|i| [i, -1, 2]).map(i32::to_le_bytes)),
        mass_f32: bytes_of(range.clone().map(|i| (i as f32 + 0.5).abs().to_le_bytes())),
        velocity_f32: bytes_of(range.flat_map(|i| [0.0, i as f32, -1.0]).map(f32::to_le_bytes)),
        stride: 1,
        node_count,
        force_f32: bytes::Bytes::new(),
    }
}

#[test]
fn numbers_that_were_asked_for_come_in_both_precisions_and_in_pieces() {
    let positions = |first| field(v1::Field::Positions, v1::Encoding::RawF32, first, &[1.0, 2.0, 3.0]);
    let ratio = |first, value| field(v1::Field::PlasticRatio, v1::Encoding::RawF64, first, &[value]);
    let stress = |first, value| field(v1::Field::StressNorm, v1::Encoding::RawF32, first, &[value]);
    let mut decoder = decoder(2, Fields::all());
    let velocities = field(v1::Field::Velocities, v1::Encoding::RawF32, 0, &[0.5; 6]);
    let forces = field(v1::Field::Forces, v1::Encoding::RawF64, 0, &[0.1; 6]);
    let accelerations = field(v1::Field::Accelerations, v1::Encoding::RawF32, 0, &[-9.5; 6]);
    let whole = vec![velocities, forces, accelerations];
    let first = piece(0, 2, [vec![positions(0), ratio(0, 0.1), stress(0, 7.0)], whole].concat(), None);
    assert_eq!(decoder.frame(first), Ok(None));
    let last = piece(1, 2, vec![positions(1), ratio(1, 1.3), stress(1, 8.0)], None);
    let frame = decoder.frame(last).expect("in order").expect("complete");
    let ratios = frame.plastic_ratios.expect("asked for");
    assert_eq!((&ratios, ratios.get(1), ratios.get(2)), (&Scalars::F64(vec![0.1, 1.3]), Some(1.3), None));
    assert_eq!(frame.stress_norms, Some(Scalars::F32(vec![7.0, 8.0])));
    assert_eq!(frame.velocities.map(|v| v.len()), Some(2));
    assert_eq!(frame.forces, Some(Vectors::F64(vec![0.1; 6])));
    assert_eq!(frame.accelerations, Some(Vectors::F32(vec![-9.5; 6])));
    assert_eq!(frame.grid, None);
}

#[test]
fn numbers_that_are_missing_odd_or_not_finite_are_refused_by_name() {
    let fields = Fields::positions().with(Field::StressNorms);
    let refuse = |data: Vec<v1::FieldData>| {
        let positions = field(v1::Field::Positions, v1::Encoding::RawF32, 0, &[0.0; 6]);
        let frame = piece(0, 1, [vec![positions], data].concat(), None);
        decoder(2, fields).frame(frame).expect_err("too bad")
    };
    let stress = |values: &[f64]| field(v1::Field::StressNorm, v1::Encoding::RawF32, 0, values);
    let absent = refuse(Vec::new());
    assert!(
        matches!(absent, DecodeError::Missing { field: "stress norms", received: 0, particles: 2, .. }),
        "{absent}"
    );
    let short = refuse(vec![stress(&[1.0])]);
    assert!(matches!(short, DecodeError::Missing { received: 1, .. }), "{short}");
    let long = refuse(vec![stress(&[1.0; 3])]);
    assert!(matches!(long, DecodeError::Range { end: 3, particles: 2, .. }), "{long}");
    let odd = refuse(vec![v1::FieldData { data: vec![0; 7].into(), ..stress(&[]) }]);
    assert!(matches!(odd, DecodeError::Bytes { bytes: 7, element: 4, .. }), "{odd}");
    let nan = refuse(vec![stress(&[1.0, f64::NAN])]);
    assert!(matches!(nan, DecodeError::NotFinite { field: "stress norms", particle: 1, .. }), "{nan}");
}

#[test]
fn an_array_that_was_not_asked_for_is_passed_over() {
    let positions = field(v1::Field::Positions, v1::Encoding::RawF32, 0, &[0.0; 3]);
    let bad = field(v1::Field::PlasticRatio, v1::Encoding::RawF32, 9, &[f64::NAN; 4]);
    let frame = decoder(1, Fields::positions()).frame(piece(0, 1, vec![positions, bad], None));
    assert_eq!(frame.expect("known enough").expect("complete").plastic_ratios, None);
}

#[test]
fn nodes_come_with_their_places() {
    let frame = grids(vec![row(-1..1, 3), row(1..2, 3)]).expect("in order").expect("complete");
    let grid = frame.grid.expect("it was sent");
    assert_eq!((grid.len(), grid.stride, grid.node_count), (3, 1, 3));
    let positions: Vec<[f32; 3]> = grid.positions().collect();
    assert_eq!(positions, [[-0.25, -0.25, 0.5], [0.0, -0.25, 0.5], [0.25, -0.25, 0.5]]);
    assert_eq!(grid.masses, [-0.5, 0.5, 1.5].map(f32::abs));
}

#[test]
fn a_grid_that_does_not_hold_together_is_refused() {
    let refuse = |pieces| grids(pieces).expect_err("too bad");
    let short = refuse(vec![row(0..2, 3)]);
    assert!(matches!(short, DecodeError::GridMissing { received: 2, announced: 3, .. }), "{short}");
    let long = refuse(vec![row(0..4, 3)]);
    assert!(matches!(long, DecodeError::GridTooLarge { received: 4, allowed: 3, .. }), "{long}");
    for bad in [
        v1::GridField { mass_f32: vec![0; 4].into(), ..row(0..2, 2) },
        v1::GridField { velocity_f32: vec![0; 23].into(), ..row(0..2, 2) },
        v1::GridField { index_i32: vec![0; 25].into(), ..row(0..2, 2) },
        v1::GridField { force_f32: vec![0; 12].into(), ..row(0..2, 2) },
        v1::GridField { force_f32: vec![0; 23].into(), ..row(0..2, 2) },
    ] {
        let uneven = refuse(vec![bad]);
        assert!(matches!(uneven, DecodeError::GridBytes { .. }), "{uneven}");
    }
    for bad in [
        v1::GridField { cell: 0.0, ..row(0..1, 1) },
        v1::GridField { cell: f64::NAN, ..row(0..1, 1) },
        v1::GridField { cell: f64::INFINITY, ..row(0..1, 1) },
        v1::GridField { stride: 0, ..row(0..1, 1) },
    ] {
        let head = refuse(vec![bad]);
        assert!(matches!(head, DecodeError::GridHead { .. }), "{head}");
    }
    let changed = refuse(vec![row(0..1, 2), v1::GridField { cell: 0.5, ..row(1..2, 2) }]);
    assert!(matches!(changed, DecodeError::GridHead { .. }), "{changed}");
    for value in [f32::NAN, f32::INFINITY, -1.0] {
        let bad = v1::GridField { mass_f32: bytes_of([1.0, value].map(f32::to_le_bytes)), ..row(0..2, 2) };
        let mass = refuse(vec![bad]);
        assert!(matches!(mass, DecodeError::GridValue { field: "mass", node: 1, .. }), "{mass}");
    }
    let mut fast = [0.0_f32; 6];
    fast[4] = f32::NEG_INFINITY;
    let bad = v1::GridField { velocity_f32: bytes_of(fast.map(f32::to_le_bytes)), ..row(0..2, 2) };
    let speed = refuse(vec![bad]);
    assert!(matches!(speed, DecodeError::GridValue { field: "velocity", node: 1, .. }), "{speed}");
}

#[test]
fn a_server_cannot_make_a_client_hold_more_nodes_than_it_agreed_to() {
    let many = 600;
    let refused = grids(vec![row(0..many, u64::MAX), row(many..2 * many, u64::MAX)]).expect_err("too many");
    assert!(
        matches!(refused, DecodeError::GridTooLarge { received: 1200, allowed: NODE_LIMIT, .. }),
        "{refused}"
    );
}

#[test]
fn a_grid_sent_with_gaps_may_hold_fewer_nodes_than_there_are() {
    let sparse = v1::GridField { stride: 2, ..row(0..1, 1_000_000) };
    let grid = grids(vec![sparse]).expect("in order").expect("complete").grid.expect("it was sent");
    assert_eq!((grid.len(), grid.stride, grid.node_count), (1, 2, 1_000_000));
}

#[test]
fn every_bound_has_its_name() {
    let known: Vec<_> = (1..64).filter_map(|number| v1::TimeBound::try_from(number).ok()).collect();
    for bound in &known {
        let word = bound.word();
        assert_eq!(bound.as_str_name(), format!("TIME_BOUND_{}", word.to_uppercase()));
    }
    assert_eq!(known.len(), 13);
    assert_eq!(v1::TimeBound::Unspecified.word(), "unknown");
}

#[allow(clippy::unnecessary_wraps, reason = "as the messages hold it")]
fn vector([x, y, z]: [f64; 3]) -> Option<v1::Vector3> {
    Some(v1::Vector3 { x, y, z })
}

fn read(shape: v1::collider_shape::Shape) -> Result<Shape, TopologyError> {
    read_moving(shape, None).map(|collider| collider.shape.expect("a shape"))
}

fn read_moving(
    shape: v1::collider_shape::Shape,
    velocity: Option<v1::Vector3>,
) -> Result<Collider, TopologyError> {
    let collider = v1::ColliderShape { name: "c".to_owned(), velocity, shape: Some(shape) };
    let topology = v1::Topology { colliders: vec![collider], ..topology_of(0) };
    match Decoder::new(Fields::positions(), DecodeLimits::default()).topology(topology) {
        Ok(topology) => Ok(topology.expect("whole").colliders.remove(0)),
        Err(DecodeError::Topology(error)) => Err(error),
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn every_shape_is_handed_on_as_it_was_sent() {
    use v1::collider_shape::Shape as Wire;
    let (start, end, radius) = (vector([0.0, 1.0, 0.0]), vector([2.0, 1.0, 0.0]), 0.5);
    let turned = v1::BoxShape {
        center: end,
        half_extent: vector([1.0, 2.0, 3.0]),
        axis_x: vector([0.0, 1.0, 0.0]),
        axis_y: vector([-1.0, 0.0, 0.0]),
    };
    let (axis, up) = (vector([0.0, 0.0, 1.0]), vector([0.0, 1.0, 0.0]));
    for sent in [
        Wire::Plane(v1::PlaneShape { point: start, normal: up }),
        Wire::Sphere(v1::SphereShape { center: start, radius }),
        Wire::Capsule(v1::CapsuleShape { start, end, radius }),
        Wire::Cylinder(v1::CylinderShape { start, end, radius }),
        Wire::Box(turned),
        Wire::HalfPipe(v1::HalfPipeShape { point: start, axis, up, radius }),
    ] {
        assert_eq!(read(sent.clone()), Ok(sent.clone()));
        let moving = read_moving(sent.clone(), vector([0.0, 0.0, 4.0])).expect("it can be drawn");
        assert_eq!((moving.shape, moving.velocity), (Some(sent), [0.0, 0.0, 4.0]));
    }
    assert_eq!((components(start), components(None)), ([0.0, 1.0, 0.0], [0.0; 3]));
}

#[test]
fn a_shape_that_cannot_be_drawn_is_refused() {
    use v1::collider_shape::Shape as Wire;
    let (x, y) = (vector([1.0, 0.0, 0.0]), vector([0.0, 1.0, 0.0]));
    let solid =
        v1::BoxShape { half_extent: vector([1.0; 3]), axis_x: x, axis_y: y, ..v1::BoxShape::default() };
    let pipe = v1::HalfPipeShape { axis: x, up: y, radius: 1.0, ..v1::HalfPipeShape::default() };
    assert!(read(Wire::Box(solid)).is_ok() && read(Wire::HalfPipe(pipe)).is_ok());
    let rod = v1::CylinderShape { end: x, radius: 1.0, ..v1::CylinderShape::default() };
    let pill = v1::CapsuleShape { end: x, radius: 1.0, ..v1::CapsuleShape::default() };
    let nowhere = vector([f64::NAN, 0.0, 0.0]);
    for (bad, part) in [
        (Wire::Box(v1::BoxShape { half_extent: vector([1.0, 0.0, 1.0]), ..solid }), "extent"),
        (Wire::Box(v1::BoxShape { axis_y: None, ..solid }), "length 1"),
        (Wire::Box(v1::BoxShape { axis_y: x, ..solid }), "right angles"),
        (Wire::HalfPipe(v1::HalfPipeShape { up: x, ..pipe }), "right angles"),
        (Wire::HalfPipe(v1::HalfPipeShape { axis: nowhere, ..pipe }), "not finite"),
        (Wire::Cylinder(v1::CylinderShape { end: None, ..rod }), "one point"),
        (Wire::Cylinder(v1::CylinderShape { radius: -1.0, ..rod }), "radius"),
        (Wire::Capsule(v1::CapsuleShape { radius: f64::NAN, ..pill }), "radius"),
        (Wire::Capsule(v1::CapsuleShape { start: nowhere, ..pill }), "not finite"),
    ] {
        let refused = read(bad).expect_err("cannot be drawn").to_string();
        assert!(refused.contains(part), "'{part}' is missing in: {refused}");
    }
    let refused = read_moving(Wire::Box(solid), nowhere).expect_err("it moves to nowhere").to_string();
    assert!(refused.contains("not finite"), "{refused}");
}

/// A grid cut at any places, one piece for each part.
fn cut(nodes: i32, cuts: &[usize]) -> Vec<v1::GridField> {
    let count = usize::try_from(nodes).expect("a count");
    let mut edges: Vec<i32> = cuts.iter().map(|cut| (cut % (count + 1)) as i32).chain([0, nodes]).collect();
    edges.sort_unstable();
    edges.windows(2).map(|edge| row(edge[0]..edge[1], count as u64)).collect()
}

/// A decoder that met anything still has a grid that is whole.
fn holds_together(grid: &GridFrame) {
    assert!(grid.len() <= NODE_LIMIT && grid.cell > 0.0 && grid.stride > 0);
    assert_eq!((grid.len(), grid.len()), (grid.masses.len(), grid.velocities.len()));
    assert!(grid.masses.iter().all(|mass| mass.is_finite()));
    assert!(grid.velocities.iter().flatten().all(|value| value.is_finite()));
}

proptest! {
    #[test]
    fn any_cut_of_a_grid_comes_back_as_sent(nodes in 0..200_i32, cuts in prop::collection::vec(any::<usize>(), 0..5)) {
        let grid = grids(cut(nodes, &cuts)).expect("in order").expect("complete").grid;
        let whole = grids(cut(nodes, &[])).expect("in order").expect("complete").grid;
        prop_assert_eq!(grid.expect("it was sent"), whole.expect("it was sent"));
    }

    #[test]
    fn a_grid_with_bytes_changed_never_panics_the_decoder(
        nodes in 1..60_i32,
        cuts in prop::collection::vec(any::<usize>(), 0..3),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let pieces = cut(nodes, &cuts);
        let count = pieces.len() as u32;
        let mut decoder = decoder(0, Fields::positions());
        for (index, grid) in (0..).zip(pieces) {
            let mut bytes = piece(index, count, Vec::new(), Some(grid)).encode_to_vec();
            for (place, value) in &changes {
                let at = place.index(bytes.len());
                bytes[at] = *value;
            }
            let Ok(message) = v1::Frame::decode(bytes.as_slice()) else { continue };
            if let Ok(Some(Frame { grid: Some(grid), .. })) = decoder.frame(message) {
                holds_together(&grid);
            }
        }
    }
}
