//! The parts of a closed mesh in numbers and in words: how many they are, which are holes, which were turned round, what overlaps,
//! and what passes through itself.

use nappe_sim::{
    collide::shape::{FirstCrossing, SelfCrossings},
    math::four_digits,
    mesh::TriangleMesh,
};

use crate::{
    fill::{Solid, shared_by_parts},
    mesh::{Holes, Mended, mend},
};

/// The parts of a closed mesh, which no edge joins: the solid is the union of all that are no holes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshParts {
    /// How many there are, those around holes with them.
    pub count: usize,
    /// Parts within others that are turned inside out.
    pub holes: usize,
    /// The first triangles of the parts that were turned round; none where the whole mesh was.
    pub turned: Vec<u32>,
    /// Parts that share more than a hundredth of the smaller one, if any do.
    pub overlaps: Option<PartOverlaps>,
    /// Whether there were too many parts near each other to look at all of them.
    pub is_cut_off: bool,
    /// How often parts pass through themselves, with triangles as the file numbers them.
    pub crossings: SelfCrossings,
    /// Volume (m³) of the union; of a part that passes through itself what it goes round twice counts twice.
    pub volume: f64,
}

/// Parts that overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartOverlaps {
    /// Pairs of parts.
    pub pairs: usize,
    /// The first triangles of the two that share most.
    pub triangles: [u32; 2],
    /// Volume (m³) that is counted too often where it is counted for each part.
    pub volume: f64,
}

impl MeshParts {
    /// Of a mesh. Points with the same coordinates count as one.
    ///
    /// # Errors
    /// Why it encloses no solid, in words that go on after "the mesh".
    pub fn new(mesh: &TriangleMesh) -> Result<Self, String> {
        let mended = mend(mesh, Holes::Refused).map_err(|error| error.to_string())?;
        let crossings = SelfCrossings::new(&mended.surface.points, &mended.surface.triangles)?;
        Ok(Self::of(&mended, crossings))
    }

    /// Of a mesh that was put in order, whose surface passes through itself so often.
    pub(crate) fn of(mended: &Mended, mut crossings: SelfCrossings) -> Self {
        let Mended { closed, numbers, hollows, turned, .. } = mended;
        if let Some(first) = &mut crossings.first {
            first.triangles = first.triangles.map(|t| numbers[t as usize]);
        }
        let (count, holes, volume) = (closed.parts.len(), *hollows, closed.volume);
        let parts = Self { count, holes, turned: turned.clone(), crossings, volume, ..Self::default() };
        if count - holes < 2 {
            return parts;
        }
        let Some(shared) = shared_by_parts(&Solid::from_mesh(closed.clone())) else { return parts };
        let overlaps = PartOverlaps { pairs: shared.pairs, triangles: shared.most, volume: shared.volume };
        Self {
            overlaps: (shared.pairs > 0).then_some(overlaps),
            is_cut_off: shared.is_cut_off,
            volume: if shared.volume < volume { volume - shared.volume } else { volume },
            ..parts
        }
    }

    /// What is odd about them, in sentences.
    pub fn told(&self) -> Vec<String> {
        let mut told = Vec::new();
        match self.turned[..] {
            [] => {}
            [first] => told.push(format!(
                "1 part is turned the wrong way, the one that begins with triangle {first}: it is turned round"
            )),
            [first, ..] => told.push(format!(
                "{} parts are turned the wrong way, the first begins with triangle {first}: they are turned round",
                self.turned.len()
            )),
        }
        if let Some(PartOverlaps { pairs, triangles: [a, b], volume }) = self.overlaps {
            let volume = four_digits(volume);
            told.push(match pairs {
                1 => format!(
                    "the parts that begin with triangles {a} and {b} overlap by {volume} m^3: the solid is their union"
                ),
                _ => format!(
                    "{pairs} pairs of parts overlap by {volume} m^3, most those that begin with triangles {a} and {b}: the \
                     solid is the union of all"
                ),
            });
        }
        if self.is_cut_off {
            told.push("too many parts are near each other to see whether all of them overlap".to_owned());
        }
        told.extend(self.told_of_crossings());
        told
    }

    /// What is told of parts that pass through themselves.
    pub fn told_of_crossings(&self) -> Option<String> {
        let SelfCrossings { count, first, is_cut_off } = self.crossings;
        let Some(FirstCrossing { triangles: [a, b], place }) = first else {
            return is_cut_off.then(|| {
                "too many triangles are near each other to see whether a part passes through itself"
                    .to_owned()
            });
        };
        let times = match (count, is_cut_off) {
            (1, false) => "an edge crosses a triangle of the same part:".to_owned(),
            (_, false) => {
                format!("{count} times an edge crosses a triangle of the same part, first those of")
            }
            (_, true) => {
                format!("at least {count} times an edge crosses a triangle of the same part, one is that of")
            }
        };
        let place = place.map(four_digits).join(", ");
        Some(format!("{times} triangles {a} and {b} at ({place}) m: inside is what the part goes round"))
    }
}
