//! A topology in pieces, which share the memory of its arrays.
//!
//! Enters: the whole message. Leaves: messages of at most so many bytes, numbered. Colliders come first, in the order of
//! the scene; a mesh and a body continue from piece to piece until their arrays are sent.

use bytes::Bytes;
use nappe_proto::v1::{self, collider_shape::Shape};

use super::pieces::numbered;

/// Bytes that a body takes in a message besides its name and arrays, at most.
const BODY_BYTES: usize = 64;
/// Bytes that a collider takes in a message besides its name and arrays, at most.
const COLLIDER_BYTES: usize = 192;
/// Bytes of the largest element of an array.
const ELEMENT_BYTES: usize = 12;

/// Cuts a topology into pieces whose colliders and bodies take at most `budget` bytes; at least one.
pub(super) fn split(whole: v1::Topology, budget: usize) -> Vec<v1::Topology> {
    let mut cutter = Cutter { pieces: vec![Piece::default()], room: budget, budget };
    for collider in whole.colliders {
        cutter.add_collider(collider);
    }
    for body in whole.bodies {
        cutter.add_body(body);
    }

    numbered(cutter.pieces)
        .map(|(chunk, Piece { colliders, bodies })| v1::Topology {
            topology_id: whole.topology_id,
            particle_count: whole.particle_count,
            bodies,
            colliders,
            chunk: Some(chunk),
            session_uid: whole.session_uid.clone(),
        })
        .collect()
}

/// What differs from piece to piece.
#[derive(Default)]
struct Piece {
    colliders: Vec<v1::ColliderShape>,
    bodies: Vec<v1::BodyTopology>,
}

/// Cuts arrays into pieces of at most `budget` bytes.
struct Cutter {
    pieces: Vec<Piece>,
    /// Bytes left in the last piece.
    room: usize,
    budget: usize,
}

impl Cutter {
    fn add_collider(&mut self, collider: v1::ColliderShape) {
        let v1::ColliderShape { name, velocity, shape } = collider;
        let head = COLLIDER_BYTES + name.len();
        match shape {
            Some(Shape::Mesh(mesh)) => self.add_mesh(&name, velocity, mesh),
            shape => {
                self.begin(head);
                self.last().colliders.push(v1::ColliderShape { name, velocity, shape });
            }
        }
    }

    fn add_mesh(&mut self, name: &str, velocity: Option<v1::Vector3>, mut mesh: v1::MeshShape) {
        loop {
            let mut room = self.begin(COLLIDER_BYTES + name.len());
            let part = v1::MeshShape {
                points_f32: part(&mut mesh.points_f32, 12, &mut room),
                triangles_u32: part(&mut mesh.triangles_u32, 12, &mut room),
                origin: mesh.origin,
            };
            let shape = Some(Shape::Mesh(part));
            self.last().colliders.push(v1::ColliderShape { name: name.to_owned(), velocity, shape });
            self.room = room;

            if mesh.points_f32.is_empty() && mesh.triangles_u32.is_empty() {
                return;
            }
            self.room = 0;
        }
    }

    fn add_body(&mut self, mut body: v1::BodyTopology) {
        loop {
            let mut room = self.begin(BODY_BYTES + body.name.len());
            let part = v1::BodyTopology {
                name: body.name.clone(),
                first_particle: body.first_particle,
                particle_count: body.particle_count,
                triangles_u32: part(&mut body.triangles_u32, 12, &mut room),
                springs_u32: part(&mut body.springs_u32, 8, &mut room),
                pins_u32: part(&mut body.pins_u32, 4, &mut room),
                uv_f32: part(&mut body.uv_f32, 8, &mut room),
                color: body.color,
                role: body.role,
                mass_f32: part(&mut body.mass_f32, 4, &mut room),
                volume_f32: part(&mut body.volume_f32, 4, &mut room),
            };
            self.last().bodies.push(part);
            self.room = room;

            if is_sent(&body) {
                return;
            }
            self.room = 0;
        }
    }

    /// Takes room for what stands before the arrays, in a new piece where the last one is full, and returns how many bytes
    /// of arrays fit behind it: at least one element, so that every piece carries something.
    fn begin(&mut self, head: usize) -> usize {
        if self.room < head + ELEMENT_BYTES && self.room < self.budget {
            self.pieces.push(Piece::default());
            self.room = self.budget;
        }
        self.room = self.room.saturating_sub(head);
        self.room.max(ELEMENT_BYTES)
    }

    fn last(&mut self) -> &mut Piece {
        self.pieces.last_mut().expect("there is a piece")
    }
}

/// The next whole elements of an array, as many as there is room for, which becomes less.
fn part(data: &mut Bytes, element: usize, room: &mut usize) -> Bytes {
    let bytes = (*room / element * element).min(data.len());
    *room -= bytes;
    data.split_to(bytes)
}

/// Whether nothing of the arrays is left.
fn is_sent(body: &v1::BodyTopology) -> bool {
    let lists = [&body.triangles_u32, &body.springs_u32, &body.pins_u32, &body.uv_f32];
    let numbers = [&body.mass_f32, &body.volume_f32];
    lists.iter().chain(&numbers).all(|data| data.is_empty())
}

#[cfg(test)]
mod tests {
    use prost::Message as _;

    use super::*;

    fn bytes(count: usize) -> Bytes {
        (0..count).map(|i| i as u8).collect::<Vec<_>>().into()
    }

    fn body(name: &str, first_particle: u32, triangles: usize, uv: usize) -> v1::BodyTopology {
        v1::BodyTopology {
            name: name.into(),
            first_particle,
            particle_count: 10,
            triangles_u32: bytes(12 * triangles),
            springs_u32: Bytes::new(),
            pins_u32: bytes(4),
            uv_f32: bytes(8 * uv),
            color: Some(0x00ff_8000),
            role: v1::BodyRole::Figure.into(),
            mass_f32: bytes(4 * uv),
            volume_f32: bytes(4 * triangles),
        }
    }

    fn mesh(name: &str, points: usize, triangles: usize) -> v1::ColliderShape {
        let (points_f32, triangles_u32) = (bytes(12 * points), bytes(12 * triangles));
        let shape = v1::MeshShape { points_f32, triangles_u32, origin: Some([0.5; 3].into()) };
        let velocity = Some([0.0, 0.0, 1.0].into());
        v1::ColliderShape { name: name.into(), velocity, shape: Some(Shape::Mesh(shape)) }
    }

    /// A box, which takes the most bytes of all colliders without arrays.
    fn solid(name: &str) -> v1::ColliderShape {
        let some = Some([0.5; 3].into());
        let shape = v1::BoxShape { center: some, half_extent: some, axis_x: some, axis_y: some };
        v1::ColliderShape { name: name.into(), velocity: some, shape: Some(Shape::Box(shape)) }
    }

    fn joined(a: &Bytes, b: &Bytes) -> Bytes {
        [&a[..], b].concat().into()
    }

    /// Adds a part of a body behind what has come.
    fn put_body(together: &mut Vec<v1::BodyTopology>, part: &v1::BodyTopology) {
        match together.last_mut().filter(|last| last.first_particle == part.first_particle) {
            None => together.push(part.clone()),
            Some(last) => {
                last.triangles_u32 = joined(&last.triangles_u32, &part.triangles_u32);
                last.pins_u32 = joined(&last.pins_u32, &part.pins_u32);
                last.uv_f32 = joined(&last.uv_f32, &part.uv_f32);
                last.mass_f32 = joined(&last.mass_f32, &part.mass_f32);
                last.volume_f32 = joined(&last.volume_f32, &part.volume_f32);
            }
        }
    }

    /// Adds a collider or a part of one behind what has come.
    fn put_collider(together: &mut Vec<v1::ColliderShape>, part: &v1::ColliderShape) {
        match together.last_mut().filter(|last| last.name == part.name) {
            None => together.push(part.clone()),
            Some(last) => {
                let (Some(Shape::Mesh(last)), Some(Shape::Mesh(part))) = (&mut last.shape, &part.shape)
                else {
                    panic!("only a mesh continues");
                };
                last.points_f32 = joined(&last.points_f32, &part.points_f32);
                last.triangles_u32 = joined(&last.triangles_u32, &part.triangles_u32);
            }
        }
    }

    #[test]
    fn pieces_put_together_are_the_whole_and_none_is_too_large() {
        let bodies =
            vec![body("a", 0, 3, 0), body("b", 10, 200, 77), body("c", 20, 0, 5), body("d", 30, 90, 1)];
        let all =
            [solid("floor"), mesh("cow", 170, 330), solid("wall"), mesh("box", 8, 12), mesh("torus", 90, 1)];
        for colliders in [&all[..0], &all[..1], &all[1..2], &all[1..], &all[..]] {
            let (bodies, colliders) = (bodies.clone(), colliders.to_vec());
            let whole = v1::Topology {
                topology_id: 1,
                particle_count: 40,
                bodies,
                colliders,
                ..v1::Topology::default()
            };
            for budget in [200, 500, 1000, 1 << 20] {
                let pieces = split(whole.clone(), budget);
                let (mut bodies, mut colliders) = (Vec::new(), Vec::new());
                for (i, piece) in pieces.iter().enumerate() {
                    assert!(piece.encoded_len() <= budget + 100, "{} of {budget}", piece.encoded_len());
                    assert_eq!(piece.chunk, Some(v1::Chunk { index: i as u32, count: pieces.len() as u32 }));
                    for part in &piece.bodies {
                        put_body(&mut bodies, part);
                    }
                    for part in &piece.colliders {
                        put_collider(&mut colliders, part);
                    }
                }
                assert_eq!((bodies, colliders), (whole.bodies.clone(), whole.colliders.clone()), "{budget}");
            }
        }
    }

    #[test]
    fn pieces_share_the_memory_of_the_arrays() {
        let (cow, sheet) = (mesh("cow", 300, 300), body("sheet", 0, 300, 0));
        let Some(Shape::Mesh(whole)) = cow.shape.clone() else { panic!("a mesh") };
        let triangles = sheet.triangles_u32.as_ptr_range();
        let topology = v1::Topology { bodies: vec![sheet], colliders: vec![cow], ..v1::Topology::default() };
        let pieces = split(topology, 1000);
        assert!(pieces.len() > 10, "{}", pieces.len());
        for piece in &pieces {
            for collider in &piece.colliders {
                let Some(Shape::Mesh(part)) = &collider.shape else { panic!("a mesh") };
                for (part, whole) in
                    [(&part.points_f32, &whole.points_f32), (&part.triangles_u32, &whole.triangles_u32)]
                {
                    assert!(part.is_empty() || whole.as_ptr_range().contains(&part.as_ptr()));
                }
            }
            for body in &piece.bodies {
                assert!(body.triangles_u32.is_empty() || triangles.contains(&body.triangles_u32.as_ptr()));
            }
        }
    }
}
