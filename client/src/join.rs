//! Pieces of a topology to the whole message.
//!
//! Enters: `v1::Topology` messages, each the whole or a piece. Leaves: one whole message. Memory grows
//! with what has arrived, and stays below a limit.

use bytes::Bytes;
use nappe_proto::v1::{self, collider_shape::Shape};

use crate::topology::TopologyError;

/// The pieces of one topology that have arrived.
#[derive(Debug, Default)]
pub(crate) struct Pieces {
    pieces: Vec<v1::Topology>,
    bytes: usize,
}

impl Pieces {
    /// Takes the next piece; returns the whole when its last piece has come. Piece 0 begins anew.
    pub(crate) fn add(
        &mut self,
        piece: v1::Topology,
        max_bytes: usize,
    ) -> Result<Option<v1::Topology>, TopologyError> {
        let v1::Chunk { index, count } = piece.chunk.unwrap_or(v1::Chunk { index: 0, count: 1 });
        if index == 0 {
            *self = Self::default();
        }
        let expected = self.pieces.len() as u32;
        let same = self.pieces.first().is_none_or(|first| {
            first.topology_id == piece.topology_id
                && first.particle_count == piece.particle_count
                && first.chunk.map(|chunk| chunk.count) == Some(count)
        });
        if index != expected || index >= count || !same {
            return Err(TopologyError::Piece { index, count, expected });
        }

        self.bytes = self.bytes.saturating_add(size(&piece));
        if self.bytes > max_bytes {
            return Err(TopologyError::TooLarge { bytes: self.bytes, allowed: max_bytes });
        }

        self.pieces.push(piece);
        let complete = index + 1 == count;
        Ok(complete.then(|| join(std::mem::take(self).pieces)).flatten())
    }
}

fn size(piece: &v1::Topology) -> usize {
    let arrays = |body: &v1::BodyTopology| {
        let lists = [&body.triangles_u32, &body.springs_u32, &body.pins_u32, &body.uv_f32].map(Bytes::len);
        let numbers = [&body.mass_f32, &body.volume_f32].map(Bytes::len);
        lists.iter().chain(&numbers).sum::<usize>()
    };
    // What a body or a collider takes in memory without its arrays counts as well.
    let bodies = piece.bodies.iter().map(|body| 256 + body.name.len() + arrays(body));
    let surface = |mesh: &v1::MeshShape| mesh.points_f32.len() + mesh.triangles_u32.len();
    let colliders =
        piece.colliders.iter().map(|collider| 256 + collider.name.len() + mesh(collider).map_or(0, surface));
    bodies.chain(colliders).sum()
}

/// The whole: parts of a body stand under the same first particle, those of a mesh under the same name, one after the other.
fn join(pieces: Vec<v1::Topology>) -> Option<v1::Topology> {
    let mut pieces = pieces.into_iter();
    let mut whole = pieces.next()?;
    let mut parts = std::mem::take(&mut whole.bodies);
    let mut colliders = std::mem::take(&mut whole.colliders);
    for piece in pieces {
        parts.extend(piece.bodies);
        colliders.extend(piece.colliders);
    }
    let same =
        |a: &v1::BodyTopology, b: &v1::BodyTopology| a.first_particle == b.first_particle && a.name == b.name;

    for parts in parts.chunk_by(same) {
        whole.bodies.push(match parts {
            [body] => body.clone(),
            parts => v1::BodyTopology {
                triangles_u32: concat(parts, |part| &part.triangles_u32),
                springs_u32: concat(parts, |part| &part.springs_u32),
                pins_u32: concat(parts, |part| &part.pins_u32),
                uv_f32: concat(parts, |part| &part.uv_f32),
                mass_f32: concat(parts, |part| &part.mass_f32),
                volume_f32: concat(parts, |part| &part.volume_f32),
                ..parts[0].clone()
            },
        });
    }
    whole.colliders = colliders.chunk_by(continues).map(join_mesh).collect();
    whole.chunk = None;
    Some(whole)
}

/// The arrays of a mesh; none of another collider.
fn mesh(collider: &v1::ColliderShape) -> Option<&v1::MeshShape> {
    match &collider.shape {
        Some(Shape::Mesh(mesh)) => Some(mesh),
        _ => None,
    }
}

/// Whether a collider is the next part of the one before it.
fn continues(before: &v1::ColliderShape, next: &v1::ColliderShape) -> bool {
    before.name == next.name && mesh(before).is_some() && mesh(next).is_some()
}

/// A collider of its parts, which are several only of a mesh.
fn join_mesh(parts: &[v1::ColliderShape]) -> v1::ColliderShape {
    let first = parts[0].clone();
    let meshes: Vec<&v1::MeshShape> = parts.iter().filter_map(mesh).collect();
    if meshes.len() < 2 {
        return first;
    }
    let points_f32 = concat(&meshes, |mesh| &mesh.points_f32);
    let triangles_u32 = concat(&meshes, |mesh| &mesh.triangles_u32);
    let whole = v1::MeshShape { points_f32, triangles_u32, origin: meshes[0].origin };
    v1::ColliderShape { shape: Some(Shape::Mesh(whole)), ..first }
}

fn concat<T>(parts: &[T], array: impl Fn(&T) -> &Bytes) -> Bytes {
    parts.iter().flat_map(|part| array(part).iter().copied()).collect::<Vec<u8>>().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(index: u32, count: u32, bodies: &[(&str, u32, &[u8])]) -> v1::Topology {
        let body = |(name, first_particle, triangles): &(&str, u32, &[u8])| v1::BodyTopology {
            name: (*name).to_owned(),
            first_particle: *first_particle,
            triangles_u32: triangles.to_vec().into(),
            ..v1::BodyTopology::default()
        };
        let chunk = Some(v1::Chunk { index, count });
        v1::Topology {
            topology_id: 1,
            chunk,
            bodies: bodies.iter().map(body).collect(),
            ..v1::Topology::default()
        }
    }

    #[test]
    fn a_body_continues_from_piece_to_piece() {
        let mut pieces = Pieces::default();
        let first = piece(0, 3, &[("a", 0, &[1, 2]), ("b", 5, &[3])]);
        assert_eq!(pieces.add(first.clone(), 10_000), Ok(None));
        // A stream that begins anew sends piece 0 again.
        assert_eq!(pieces.add(first, 10_000), Ok(None));
        assert_eq!(pieces.add(piece(1, 3, &[("b", 5, &[4, 5])]), 10_000), Ok(None));
        let whole = pieces.add(piece(2, 3, &[("b", 5, &[6]), ("c", 7, &[])]), 10_000);
        let whole = whole.expect("in order").expect("complete");
        let expected = piece(0, 1, &[("a", 0, &[1, 2]), ("b", 5, &[3, 4, 5, 6]), ("c", 7, &[])]);
        assert_eq!(whole, v1::Topology { chunk: None, ..expected });
    }

    #[test]
    fn a_mesh_continues_the_collider_before_it_and_no_other() {
        let part = |name: &str, points: &[u8], triangles: &[u8]| {
            let (points_f32, triangles_u32) = (points.to_vec().into(), triangles.to_vec().into());
            let origin = Some([0.5, 0.25, 0.0].into());
            let shape = Some(Shape::Mesh(v1::MeshShape { points_f32, triangles_u32, origin }));
            v1::ColliderShape { name: name.to_owned(), velocity: None, shape }
        };
        let floor = v1::ColliderShape { name: "floor".to_owned(), ..v1::ColliderShape::default() };
        let with = |index: u32, colliders: &[v1::ColliderShape]| v1::Topology {
            colliders: colliders.to_vec(),
            ..piece(index, 3, &[("a", index, &[])])
        };
        let sent = [
            with(0, &[floor.clone(), part("cow", &[1, 2], &[])]),
            with(1, &[part("cow", &[3], &[4])]),
            with(
                2,
                &[part("cow", &[], &[5]), part("box", &[6], &[7]), floor.clone(), part("cow", &[8], &[9])],
            ),
        ];
        let mut pieces = Pieces::default();
        let all = sent.map(|piece| pieces.add(piece, 10_000).expect("in order"));
        let whole = all.into_iter().flatten().next().expect("complete");
        let expected = [
            floor.clone(),
            part("cow", &[1, 2, 3], &[4, 5]),
            part("box", &[6], &[7]),
            floor,
            part("cow", &[8], &[9]),
        ];
        assert_eq!(whole.colliders, expected);

        let large = Pieces::default().add(with(0, &[part("cow", &[0; 500], &[0; 400])]), 1000);
        assert!(matches!(large, Err(TopologyError::TooLarge { allowed: 1000, .. })), "{large:?}");
    }

    #[test]
    fn pieces_out_of_order_or_too_large_are_refused() {
        let mut pieces = Pieces::default();
        let refused = pieces.add(piece(1, 2, &[]), 10_000);
        assert_eq!(refused, Err(TopologyError::Piece { index: 1, count: 2, expected: 0 }));
        pieces.add(piece(0, 3, &[]), 10_000).expect("the first");
        assert!(pieces.add(piece(2, 3, &[]), 10_000).is_err());
        assert!(pieces.add(piece(1, 4, &[]), 10_000).is_err());
        assert!(Pieces::default().add(piece(0, 0, &[]), 10_000).is_err());
        let large = Pieces::default().add(piece(0, 2, &[("a", 0, &[0; 900])]), 1000);
        assert!(matches!(large, Err(TopologyError::TooLarge { allowed: 1000, .. })));
    }
}
