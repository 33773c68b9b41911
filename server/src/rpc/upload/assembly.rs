//! A mesh that grows as its bytes come: each byte is decoded once, into the array where it stays.
//!
//! Enters: bytes in any division, in the order of the header. Leaves: a mesh, as soon as all have come.

use nappe_sim::mesh::TriangleMesh;

use super::layout::Layout;
use crate::{
    error::{Reason, ServiceError},
    memory::Claim,
};

/// Arrays have room for as many bytes as have come in all, and these.
const AHEAD_BYTES: usize = 1 << 20;
/// Beyond that, an array that is full grows by this factor: while it is copied, old and new take 1.25 times the new.
const GROWTH: usize = 4;

/// A mesh of which some bytes have come.
#[derive(Debug)]
pub(super) struct Assembly {
    layout: Layout,
    mesh: TriangleMesh,
    /// Bytes that have come.
    received: usize,
    carry: Carry,
    /// The memory of the arrays.
    claim: Claim,
}

/// The beginning of an element whose end has not come.
#[derive(Debug, Default)]
struct Carry {
    bytes: [u8; 24],
    length: usize,
}

impl Assembly {
    pub(super) fn new(layout: Layout, claim: Claim) -> Self {
        Self { layout, mesh: TriangleMesh::default(), received: 0, carry: Carry::default(), claim }
    }

    /// Bytes that have come.
    pub(super) fn received(&self) -> usize {
        self.received
    }

    /// Bytes of the whole.
    pub(super) fn total(&self) -> usize {
        self.layout.total
    }

    /// Decodes the bytes that come next: no more than are missing.
    ///
    /// # Errors
    /// If there is no memory for them.
    pub(super) fn append(&mut self, bytes: &[u8]) -> Result<(), ServiceError> {
        self.received += bytes.len();
        let Self { layout, mesh, received, carry, claim } = self;
        let mut arrays = Arrays { carry, claim, received: *received, rest: bytes };

        arrays
            .fill(&mut mesh.points, layout.points, |bytes: &[u8; 24]| numbers(bytes, f64::from_le_bytes))?;
        arrays.fill(&mut mesh.triangles, layout.triangles, |bytes: &[u8; 12]| {
            numbers(bytes, u32::from_le_bytes)
        })?;
        arrays.fill(&mut mesh.masses, layout.masses, |bytes: &[u8; 8]| f64::from_le_bytes(*bytes))?;
        arrays.fill(&mut mesh.uv, layout.uv, |bytes: &[u8; 8]| {
            numbers(bytes, |bytes| f64::from(f32::from_le_bytes(bytes)))
        })?;
        arrays.fill(&mut mesh.velocities, layout.velocities, |bytes: &[u8; 24]| {
            numbers(bytes, f64::from_le_bytes)
        })
    }

    /// The mesh, its warnings before it is checked, which are none, and what its memory is claimed by.
    pub(super) fn finish(self) -> (TriangleMesh, Vec<String>, Claim) {
        (self.mesh, Vec::new(), self.claim)
    }
}

/// Bytes on their way into arrays.
struct Arrays<'a> {
    carry: &'a mut Carry,
    claim: &'a Claim,
    received: usize,
    rest: &'a [u8],
}

impl Arrays<'_> {
    /// Fills an array of `count` elements of `N` bytes, as far as the bytes reach.
    fn fill<T, const N: usize>(
        &mut self,
        target: &mut Vec<T>,
        count: usize,
        decode: impl Fn(&[u8; N]) -> T,
    ) -> Result<(), ServiceError> {
        let missing = count - target.len();
        if missing == 0 || self.rest.is_empty() {
            return Ok(());
        }

        let coming = missing.min((self.carry.length + self.rest.len()) / N);
        self.make_room(target, coming, count)?;

        if self.carry.length > 0 {
            let (begin, needed) = (self.carry.length, N - self.carry.length);
            let (now, rest) = self.rest.split_at(needed.min(self.rest.len()));
            self.carry.bytes[begin..begin + now.len()].copy_from_slice(now);
            self.carry.length += now.len();
            self.rest = rest;
            let whole = self.carry.bytes.first_chunk().filter(|_| self.carry.length == N);
            let Some(whole) = whole else { return Ok(()) };
            target.push(decode(whole));
            self.carry.length = 0;
        }

        let whole = (count - target.len()).min(self.rest.len() / N);
        let (now, rest) = self.rest.split_at(whole * N);
        target.extend(now.as_chunks().0.iter().map(decode));
        self.rest = rest;

        if target.len() < count {
            self.carry.bytes[..rest.len()].copy_from_slice(rest);
            self.carry.length = rest.len();
            self.rest = &[];
        }
        Ok(())
    }

    /// Room for `coming` more elements of at most `count`. What a header announces takes no memory: arrays grow
    /// as bytes come.
    fn make_room<T>(&self, target: &mut Vec<T>, coming: usize, count: usize) -> Result<(), ServiceError> {
        let needed = target.len() + coming;
        if needed <= target.capacity() {
            return Ok(());
        }
        let ahead = (self.received + AHEAD_BYTES) / size_of::<T>();
        let capacity = needed.max(GROWTH * target.len()).max(ahead).min(count);
        let bytes = |count: usize| (count * size_of::<T>()) as u64;
        self.claim.grow(bytes(capacity - target.capacity()))?;
        // While it is copied, it is there twice.
        let _copied = self.claim.beside(bytes(target.capacity()))?;
        target.try_reserve_exact(capacity - target.len()).map_err(|error| {
            ServiceError::new(
                Reason::RequestMemoryFull,
                format!("there is no memory for the upload: {error}"),
            )
        })
    }
}

/// The `N` numbers of an element.
fn numbers<T: Copy + Default, const B: usize, const N: usize>(
    bytes: &[u8],
    from: impl Fn([u8; B]) -> T,
) -> [T; N] {
    let (chunks, _) = bytes.as_chunks();
    std::array::from_fn(|i| from(chunks[i]))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nappe_proto::v1::MeshHeader;

    use super::*;
    use crate::{config::Limits, memory::MemoryAccount};

    fn account() -> Arc<MemoryAccount> {
        MemoryAccount::of_requests(1 << 30, &MemoryAccount::of_server(1 << 30))
    }

    fn assembly(point_count: u64, triangle_count: u64, others: u64) -> Assembly {
        let header = MeshHeader {
            name: "test".into(),
            point_count,
            triangle_count,
            mass_count: others,
            uv_count: others,
            velocity_count: others,
        };
        let layout = Layout::of(&header, &Limits::default()).expect("small");
        Assembly::new(layout, account().claim())
    }

    #[test]
    fn bytes_in_any_division_give_the_same_mesh() {
        let mut data: Vec<u8> = (0..9).flat_map(|i| f64::from(i).to_le_bytes()).collect();
        data.extend([0_u32, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
        data.extend([0.5_f64, 0.25, 0.0].iter().flat_map(|m| m.to_le_bytes()));
        data.extend([0.0_f32, 0.0, 1.0, 0.0, 0.0, 1.0].iter().flat_map(|c| c.to_le_bytes()));
        data.extend((10..19).flat_map(|i| f64::from(i).to_le_bytes()));
        for length in 1..=data.len() {
            let mut assembly = assembly(3, 1, 3);
            assert_eq!(assembly.total(), data.len());
            data.chunks(length).for_each(|piece| assembly.append(piece).expect("room"));
            assert_eq!(assembly.received(), data.len());
            let (mesh, ..) = assembly.finish();
            assert_eq!(mesh.points, [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0], [6.0, 7.0, 8.0]]);
            assert_eq!(mesh.triangles, [[0, 1, 2]]);
            assert_eq!(mesh.masses, [0.5, 0.25, 0.0]);
            assert_eq!(mesh.uv, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
            assert_eq!(mesh.velocities, [[10.0, 11.0, 12.0], [13.0, 14.0, 15.0], [16.0, 17.0, 18.0]]);
        }
    }

    #[test]
    fn an_upload_takes_memory_as_its_bytes_come() {
        let account = account();
        let header = MeshHeader { point_count: 4_000_000, ..MeshHeader::default() };
        let layout = Layout::of(&header, &Limits::default()).expect("allowed");
        let mut assembly = Assembly::new(layout, account.claim());
        assert_eq!(account.used(), 0, "a header takes nothing");
        assembly.append(&[0; 1000]).expect("room");
        assert!(account.used() < 2 << 20, "{}", account.used());
        for _ in 0..96 {
            assembly.append(&vec![0; 999_989]).expect("room");
        }
        assert!(account.used() <= 96_000_000, "never more than the whole: {}", account.used());
    }
}
