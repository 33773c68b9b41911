//! What the decoder accepts comes back as it was sent, whatever the pieces; what it refuses, it names; and no
//! bytes make it panic.

use nappe_client::{
    DecodeError, DecodeLimits, Decoder, Field, Fields, Frame, Shape, Topology, TopologyError, Vectors,
    mesh_points, mesh_triangles, v1,
};
use proptest::prelude::*;
use prost::Message as _;

const POSITIONS: i32 = v1::Field::Positions as i32;
const VELOCITIES: i32 = v1::Field::Velocities as i32;
const F32: i32 = v1::Encoding::RawF32 as i32;
const F64: i32 = v1::Encoding::RawF64 as i32;

fn with_velocities() -> Fields {
    Fields::positions().with(Field::Velocities)
}

fn packed(values: &[u32]) -> bytes::Bytes {
    values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>().into()
}

fn topology_of(particle_count: u32) -> v1::Topology {
    let body = v1::BodyTopology { name: "sheet".to_owned(), particle_count, ..v1::BodyTopology::default() };
    v1::Topology { topology_id: 7, particle_count, bodies: vec![body], ..v1::Topology::default() }
}

fn decoder(particle_count: u32, fields: Fields) -> Decoder {
    let mut decoder = Decoder::new(fields, DecodeLimits::default());
    let read = decoder.topology(topology_of(particle_count)).expect("a topology").expect("in one piece");
    assert_eq!(read.particle_count, particle_count as usize);
    decoder
}

fn field(field: i32, encoding: i32, first_particle: u32, data: Vec<u8>) -> v1::FieldData {
    v1::FieldData { field, encoding, first_particle, data: data.into(), ..v1::FieldData::default() }
}

fn f32_bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn piece(index: u32, count: u32, fields: Vec<v1::FieldData>) -> v1::Frame {
    let chunk = Some(v1::Chunk { index, count });
    v1::Frame { frame: 3, step: 12, time_seconds: 0.5, topology_id: 7, fields, chunk, ..v1::Frame::default() }
}

/// Two particles, one a piece.
fn halves() -> [v1::Frame; 2] {
    let half = |index: u32| piece(index, 2, vec![field(POSITIONS, F32, index, f32_bytes(&[1.0, 2.0, 3.0]))]);
    [half(0), half(1)]
}

#[test]
fn a_frame_in_two_pieces_comes_with_the_last() {
    let mut decoder = decoder(2, Fields::positions());
    let [first, last] = halves();
    assert_eq!(decoder.frame(first), Ok(None));
    let frame = decoder.frame(last).expect("in order").expect("complete");
    assert_eq!((frame.frame, frame.step, frame.positions.len()), (3, 12, 2));
    assert_eq!(frame.positions.get(1), Some([1.0, 2.0, 3.0]));
    assert_eq!(frame.positions.get(2), None);
}

#[test]
fn a_frame_needs_its_topology() {
    let mut fresh = Decoder::new(Fields::positions(), DecodeLimits::default());
    let refused = fresh.frame(piece(0, 1, Vec::new()));
    assert_eq!(refused, Err(DecodeError::UnknownTopology { frame: 3, found: 7, announced: None }));
    let other = v1::Frame { topology_id: 8, ..piece(0, 1, Vec::new()) };
    let refused = decoder(2, Fields::positions()).frame(other);
    assert_eq!(refused, Err(DecodeError::UnknownTopology { frame: 3, found: 8, announced: Some(7) }));
}

#[test]
fn pieces_out_of_order_are_refused() {
    let [first, last] = halves();
    let refused = decoder(2, Fields::positions()).frame(last);
    let expected = DecodeError::Piece { frame: 3, index: 1, count: 2, expected: 0, expected_count: 2 };
    assert_eq!(refused, Err(expected));

    let mut repeated = decoder(2, Fields::positions());
    assert_eq!(repeated.frame(first.clone()), Ok(None));
    assert!(matches!(repeated.frame(first), Err(DecodeError::Piece { index: 0, expected: 1, .. })));

    let mut changed = decoder(2, Fields::positions());
    assert_eq!(changed.frame(halves()[0].clone()), Ok(None));
    assert!(matches!(changed.frame(piece(1, 3, Vec::new())), Err(DecodeError::Piece { count: 3, .. })));

    let none = decoder(2, Fields::positions()).frame(piece(0, 0, Vec::new()));
    assert!(matches!(none, Err(DecodeError::Piece { count: 0, .. })));
}

#[test]
fn a_frame_that_breaks_off_is_named() {
    let mut decoder = decoder(2, Fields::positions());
    let [first, _] = halves();
    assert_eq!(decoder.frame(first), Ok(None));
    let next = v1::Frame { frame: 4, ..piece(0, 1, Vec::new()) };
    let expected = DecodeError::BrokenOff { frame: 3, received: 1, count: 2, next: 4 };
    assert_eq!(decoder.frame(next), Err(expected));
}

#[test]
fn arrays_of_a_wrong_size_are_refused() {
    let refuse = |fields| decoder(2, Fields::positions()).frame(piece(0, 1, fields)).expect_err("too bad");
    let point = f32_bytes(&[1.0, 2.0, 3.0]);
    let odd = refuse(vec![field(POSITIONS, F32, 0, vec![0; 13])]);
    assert!(matches!(odd, DecodeError::Bytes { bytes: 13, element: 12, .. }), "{odd}");
    let short = refuse(vec![field(POSITIONS, F32, 0, point.clone())]);
    assert!(matches!(short, DecodeError::Missing { received: 1, particles: 2, .. }), "{short}");
    let absent = refuse(Vec::new());
    assert!(matches!(absent, DecodeError::Missing { received: 0, .. }), "{absent}");
    let long = refuse(vec![field(POSITIONS, F32, 0, f32_bytes(&[0.0; 9]))]);
    assert!(matches!(long, DecodeError::Range { end: 3, particles: 2, .. }), "{long}");
    let gap = refuse(vec![field(POSITIONS, F32, 1, point.clone())]);
    assert!(matches!(gap, DecodeError::Range { first: 1, expected: 0, .. }), "{gap}");
    let twice = refuse(vec![field(POSITIONS, F32, 0, point.clone()), field(POSITIONS, F32, 0, point)]);
    assert!(matches!(twice, DecodeError::Range { first: 0, expected: 1, .. }), "{twice}");
    let far = refuse(vec![field(POSITIONS, F32, u32::MAX, vec![0; 12])]);
    assert!(matches!(far, DecodeError::Range { .. }), "{far}");
}

#[test]
fn values_that_are_not_finite_are_refused_with_their_particle() {
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let data = f32_bytes(&[0.0, 0.0, 0.0, 0.0, value, 0.0]);
        let frame = piece(0, 1, vec![field(POSITIONS, F32, 0, data)]);
        let refused = decoder(2, Fields::positions()).frame(frame).expect_err("not finite");
        assert!(matches!(refused, DecodeError::NotFinite { particle: 1, .. }), "{refused}");
    }
    let timeless = v1::Frame { time_seconds: f64::NAN, ..piece(0, 1, Vec::new()) };
    let refused = decoder(0, Fields::positions()).frame(timeless);
    assert!(matches!(refused, Err(DecodeError::Time { frame: 3, .. })));
}

#[test]
fn an_unknown_packing_is_refused_and_an_unknown_array_is_passed_over() {
    let frame = piece(0, 1, vec![field(POSITIONS, 99, 0, vec![0; 12])]);
    let refused = decoder(1, Fields::positions()).frame(frame).expect_err("unknown");
    assert!(matches!(refused, DecodeError::Encoding { encoding: 99, .. }), "{refused}");
    let mixed = vec![field(POSITIONS, F32, 0, vec![0; 12]), field(POSITIONS, F64, 1, vec![0; 24])];
    let refused = decoder(2, Fields::positions()).frame(piece(0, 1, mixed)).expect_err("mixed");
    assert!(matches!(refused, DecodeError::Encoding { encoding: F64, .. }), "{refused}");

    let fields = vec![field(77, F32, 0, vec![1, 2, 3]), field(POSITIONS, F32, 0, vec![0; 12])];
    let frame = decoder(1, Fields::positions()).frame(piece(0, 1, fields)).expect("known enough");
    assert_eq!(frame.expect("complete").positions, Vectors::F32(vec![0.0; 3]));
}

#[test]
fn velocities_that_were_asked_for_must_come() {
    let frame = piece(0, 1, vec![field(POSITIONS, F32, 0, vec![0; 12])]);
    let refused = decoder(1, with_velocities()).frame(frame).expect_err("half of it");
    assert!(matches!(refused, DecodeError::Missing { field: "velocities", .. }), "{refused}");
}

fn refuse_topology(change: impl FnOnce(&mut v1::Topology)) -> TopologyError {
    let mut topology = topology_of(4);
    change(&mut topology);
    match Decoder::new(Fields::positions(), DecodeLimits::default()).topology(topology) {
        Err(DecodeError::Topology(error)) => error,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_topology_whose_counts_or_indices_do_not_fit_is_refused() {
    let many = refuse_topology(|t| t.particle_count = u32::MAX);
    assert!(matches!(many, TopologyError::TooMany { announced: 0xffff_ffff, .. }), "{many}");
    let uncovered = refuse_topology(|t| t.particle_count = 5);
    assert!(matches!(uncovered, TopologyError::Uncovered { held: 4, particles: 5 }), "{uncovered}");
    let long = refuse_topology(|t| t.bodies[0].particle_count = u32::MAX);
    assert!(matches!(long, TopologyError::Range { expected: 0, .. }), "{long}");
    let shifted = refuse_topology(|t| t.bodies[0].first_particle = 1);
    assert!(matches!(shifted, TopologyError::Range { first: 1, .. }), "{shifted}");
    let outside = refuse_topology(|t| t.bodies[0].triangles_u32 = packed(&[0, 1, 4]));
    assert!(matches!(outside, TopologyError::Index { index: 4, last: 3, .. }), "{outside}");
    let pin = refuse_topology(|t| t.bodies[0].pins_u32 = packed(&[9]));
    assert!(matches!(pin, TopologyError::Index { what: "pins", index: 9, .. }), "{pin}");
    let odd = refuse_topology(|t| t.bodies[0].springs_u32 = packed(&[0, 1, 2]));
    assert!(matches!(odd, TopologyError::Bytes { element: 8, bytes: 12, .. }), "{odd}");
    let texture = refuse_topology(|t| t.bodies[0].uv_f32 = packed(&[0, 0]));
    assert!(matches!(texture, TopologyError::TextureCount { count: 1, particles: 4, .. }), "{texture}");
    let few = refuse_topology(|t| t.bodies[0].mass_f32 = packed(&[0, 0]));
    assert!(matches!(few, TopologyError::Weights { what: "masses", count: 2, .. }), "{few}");
    let infinite = refuse_topology(|t| t.bodies[0].volume_f32 = packed(&[f32::INFINITY.to_bits(); 4]));
    assert!(matches!(infinite, TopologyError::Weights { what: "volumes", count: 4, .. }), "{infinite}");
}

#[test]
fn a_collider_is_drawable_or_refused_and_a_new_shape_is_unknown() {
    use v1::collider_shape::Shape as Wire;
    let ball = |radius| Wire::Sphere(v1::SphereShape { radius, ..v1::SphereShape::default() });
    let shape = |shape| vec![v1::ColliderShape { name: "c".to_owned(), shape, velocity: None }];
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = refuse_topology(|t| t.colliders = shape(Some(ball(radius))));
        assert!(matches!(refused, TopologyError::Collider { .. }), "{refused}");
    }
    let flat = Wire::Plane(v1::PlaneShape::default());
    let refused = refuse_topology(|t| t.colliders = shape(Some(flat)));
    assert!(refused.to_string().contains("length 1"), "{refused}");

    let colliders = [shape(None), shape(Some(ball(0.5)))].concat();
    let topology = v1::Topology { colliders, ..topology_of(1) };
    let read = Decoder::new(Fields::positions(), DecodeLimits::default()).topology(topology);
    let shapes: Vec<_> =
        read.expect("good").expect("whole").colliders.iter().map(|c| c.shape.clone()).collect();
    assert_eq!(shapes, [None, Some(ball(0.5))]);
}

/// A collider of a tetrahedron, with these arrays in place of its own.
fn tetrahedron(points: Option<Vec<f32>>, triangles: Option<Vec<u32>>) -> v1::ColliderShape {
    let points = points.unwrap_or_else(|| vec![0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]);
    let points_f32 = points.iter().flat_map(|c| c.to_le_bytes()).collect::<Vec<u8>>().into();
    let triangles_u32 = packed(&triangles.unwrap_or_else(|| vec![0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]));
    let shape = v1::collider_shape::Shape::Mesh(v1::MeshShape { points_f32, triangles_u32, origin: None });
    v1::ColliderShape { name: "it".to_owned(), shape: Some(shape), velocity: None }
}

#[test]
fn a_mesh_is_whole_over_any_pieces_and_its_arrays_are_read() {
    let whole = tetrahedron(None, None);
    let Some(Shape::Mesh(mesh)) = &whole.shape else { panic!("a mesh") };
    let wall = v1::ColliderShape { name: "wall".to_owned(), ..v1::ColliderShape::default() };
    for size in [1, 7, 12, 48] {
        // Points and triangles side by side, in parts of so many bytes each.
        let cut = |array: &bytes::Bytes, i: usize| {
            let at = |i: usize| (size * i).min(array.len());
            array.slice(at(i)..at(i + 1))
        };
        let count = 48_usize.div_ceil(size);
        let mut decoder = Decoder::new(Fields::positions(), DecodeLimits::default());
        let mut read = None;
        for i in 0..count {
            let (points_f32, triangles_u32) = (cut(&mesh.points_f32, i), cut(&mesh.triangles_u32, i));
            let shape = Some(Shape::Mesh(v1::MeshShape { points_f32, triangles_u32, origin: None }));
            let mut colliders = vec![v1::ColliderShape { shape, ..whole.clone() }];
            if i + 1 == count {
                colliders.push(wall.clone());
            }
            let chunk = Some(v1::Chunk { index: i as u32, count: count as u32 });
            let bodies = if i + 1 == count { topology_of(1).bodies } else { Vec::new() };
            read =
                decoder.topology(v1::Topology { colliders, chunk, bodies, ..topology_of(1) }).expect("good");
            assert_eq!(read.is_some(), i + 1 == count);
        }
        let colliders = read.expect("whole").colliders;
        assert_eq!(colliders.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["it", "wall"]);
        assert_eq!(colliders[0].shape, whole.shape, "parts of {size} bytes");
        assert_eq!(mesh_points(mesh)[3], [0.0, 0.0, 1.0]);
        assert_eq!(mesh_triangles(mesh), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]);
    }
}

#[test]
fn a_mesh_that_cannot_be_drawn_is_refused() {
    let ball = v1::SphereShape { radius: 0.5, ..v1::SphereShape::default() };
    let ball = v1::ColliderShape {
        name: "ball".to_owned(),
        shape: Some(Shape::Sphere(ball)),
        ..v1::ColliderShape::default()
    };
    let nan = vec![0.0, f32::NAN, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    for (colliders, part) in [
        (vec![tetrahedron(Some(nan), None)], "not finite"),
        (vec![tetrahedron(None, Some(vec![0, 2, 1, 0, 1, 4]))], "names a point that is not there"),
        (vec![tetrahedron(None, Some(vec![0, 2, u32::MAX]))], "names a point that is not there"),
        (vec![tetrahedron(None, Some(vec![0, 2]))], "no whole number"),
        (vec![tetrahedron(Some(vec![0.0; 13]), None)], "no whole number"),
        (vec![tetrahedron(None, Some(Vec::new()))], "no triangles"),
        (vec![tetrahedron(None, None), ball, tetrahedron(None, None)], "go on behind another"),
    ] {
        let refused = refuse_topology(|t| t.colliders = colliders).to_string();
        assert!(refused.contains("collider \"it\"") && refused.contains(part), "{refused}, not {part}");
    }
}

#[test]
fn poses_come_with_the_first_piece_and_name_colliders() {
    let collider = |name: &str| v1::ColliderShape { name: name.to_owned(), ..v1::ColliderShape::default() };
    let topology = v1::Topology { colliders: vec![collider("box"), collider("lid")], ..topology_of(2) };
    let read = |poses: Vec<v1::ColliderPose>| {
        let mut decoder = Decoder::new(Fields::positions(), DecodeLimits::default());
        decoder.topology(topology.clone()).expect("a topology").expect("in one piece");
        let [first, last] = halves();
        decoder.frame(v1::Frame { poses, ..first })?;
        decoder.frame(last).map(|frame| frame.expect("complete"))
    };
    let pose = |name: &str, x: f64, turn: [f64; 4]| v1::ColliderPose {
        name: name.to_owned(),
        position: Some([x, 2.0, 3.0].into()),
        turn: Some(turn.into()),
    };
    let turn = [0.0, 0.6, 0.0, 0.8];
    let frame = read(vec![pose("lid", 1.0, turn)]).expect("good");
    assert_eq!(frame.pose("lid").map(|pose| (pose.position, pose.turn)), Some(([1.0, 2.0, 3.0], turn)));
    assert_eq!((frame.pose("box"), frame.poses.len()), (None, 1));
    let refused = read(vec![pose("it", 1.0, turn)]).expect_err("there is no such collider");
    assert!(
        matches!(&refused, DecodeError::Pose { frame: 3, collider, .. } if collider == "it"),
        "{refused}"
    );
}

/// Cuts both arrays of `count` particles at the same places, one piece for each part.
fn cut(positions: &[f64], velocities: &[f64], cuts: &[usize], encoding: i32) -> Vec<v1::Frame> {
    let pack = |values: &[f64]| -> Vec<u8> {
        if encoding == F64 {
            return values.iter().flat_map(|value| value.to_le_bytes()).collect();
        }
        values.iter().flat_map(|&value| (value as f32).to_le_bytes()).collect()
    };
    let count = positions.len() / 3;
    let mut edges: Vec<usize> = cuts.iter().map(|cut| cut % (count + 1)).chain([0, count]).collect();
    edges.sort_unstable();
    let parts = edges.len() as u32 - 1;
    let part = |index: usize| {
        let (first, range) = (edges[index] as u32, 3 * edges[index]..3 * edges[index + 1]);
        let fields = vec![
            field(POSITIONS, encoding, first, pack(&positions[range.clone()])),
            field(VELOCITIES, encoding, first, pack(&velocities[range])),
        ];
        piece(index as u32, parts, fields)
    };
    (0..edges.len() - 1).map(part).collect()
}

fn read_all(pieces: Vec<v1::Frame>, particles: u32) -> Frame {
    let mut decoder = decoder(particles, with_velocities());
    let mut frames: Vec<_> =
        pieces.into_iter().filter_map(|piece| decoder.frame(piece).expect("a good piece")).collect();
    assert_eq!(frames.len(), 1);
    frames.remove(0)
}

/// A decoder that met anything still has frames that are whole.
fn holds_together(frame: &Frame, topology: &Topology) {
    assert_eq!(frame.positions.len(), topology.particle_count);
    assert!(frame.time.is_finite());
    let coordinates = (0..frame.positions.len()).filter_map(|particle| frame.positions.get(particle));
    assert!(coordinates.flatten().all(f64::is_finite));
}

proptest! {
    #[test]
    fn any_cut_of_any_arrays_comes_back_as_sent(
        values in prop::collection::vec((-1e9_f64..1e9, -1e9_f64..1e9), 0..90),
        cuts in prop::collection::vec(any::<usize>(), 0..6),
        wide in any::<bool>(),
    ) {
        let whole = values.len() / 3 * 3;
        let (positions, velocities): (Vec<f64>, Vec<f64>) = values[..whole].iter().copied().unzip();
        let encoding = if wide { F64 } else { F32 };
        let frame = read_all(cut(&positions, &velocities, &cuts, encoding), (whole / 3) as u32);
        let expect = |sent: Vec<f64>| {
            if wide {
                return Vectors::F64(sent);
            }
            Vectors::F32(sent.into_iter().map(|value| value as f32).collect())
        };
        prop_assert_eq!(frame.positions, expect(positions));
        prop_assert_eq!(frame.velocities, Some(expect(velocities)));
    }

    #[test]
    fn a_stream_with_bytes_changed_never_panics_the_decoder(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cuts in prop::collection::vec(any::<usize>(), 0..4),
    ) {
        let positions: Vec<f64> = (0..36).map(f64::from).collect();
        let mut topology = topology_of(12);
        topology.bodies[0].triangles_u32 = packed(&[0, 1, 2, 2, 1, 3]);
        topology.bodies[0].pins_u32 = packed(&[0, 11]);
        let pieces = cut(&positions, &positions, &cuts, F32);
        let mut messages: Vec<Vec<u8>> = pieces.iter().map(v1::Frame::encode_to_vec).collect();
        messages.insert(0, topology.encode_to_vec());
        for (place, value) in changes {
            let length = messages.iter().map(Vec::len).sum();
            let mut at = place.index(length);
            let message = messages.iter_mut().find(|message| {
                let is_here = at < message.len();
                at -= if is_here { 0 } else { message.len() };
                is_here
            });
            message.expect("the place is in one of them")[at] = value;
        }
        let mut decoder = Decoder::new(with_velocities(), DecodeLimits::default());
        let Ok(topology) = v1::Topology::decode(messages.remove(0).as_slice()) else { return Ok(()) };
        let Ok(Some(topology)) = decoder.topology(topology) else { return Ok(()) };
        for message in messages {
            let Ok(frame) = v1::Frame::decode(message.as_slice()) else { continue };
            if let Ok(Some(frame)) = decoder.frame(frame) {
                holds_together(&frame, &topology);
            }
        }
    }
}
