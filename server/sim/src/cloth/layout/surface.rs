//! The surface of a cloth: its faces, where they are at rest, and how far apart parts of it stay.

use crate::{
    cloth::{
        network::{Components, Joined},
        settings::{ClothSettings, SurfaceCheck},
    },
    math::{Vec3, vec3},
    surface::{Beside, Candidate, Faces, closest},
};

/// Share of the distance at rest of two parts of one sheet beyond which they do not push each other.
const REST_SHARE: f64 = 0.9;

/// Faces of a cloth in the model's numbering.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    /// The greatest distance (m) that parts keep; 0 where crossings are counted alone.
    pub(crate) thickness: f64,
    pub(crate) faces: Faces,
    /// What is known of triangles that share a particle; nothing where crossings are counted alone.
    pub(crate) beside: Beside,
    /// Positions at rest (m), and the sheet that each particle belongs to.
    rest: Vec<Vec3<f64>>,
    sheets: Vec<u32>,
    /// Distance (m) that each sheet keeps from itself.
    thicknesses: Vec<f64>,
}

impl Surface {
    /// That of networks, where their settings or their thickness ask for one; `place` gives the model's numbering.
    pub(crate) fn of(
        joined: &Joined<'_>,
        settings: &ClothSettings,
        place: &[u32],
        user: &[u32],
    ) -> Option<Self> {
        let network = &*joined.whole;
        let counts = settings.contact.surface == SurfaceCheck::Count;
        if network.triangles.is_empty() || network.thickness == 0.0 && !counts {
            return None;
        }
        let row = |particle: &u32| place[*particle as usize];
        let mut triangles: Vec<[u32; 3]> =
            network.triangles.iter().map(|corners| corners.each_ref().map(row)).collect();
        // In the order of the particles, which lie beside each other: so do the triangles of a leaf of a tree.
        triangles.sort_by_key(|corners| {
            let least = corners.iter().copied().min();
            (least, corners.iter().map(|corner| u64::from(*corner)).sum::<u64>(), *corners)
        });
        let count = user.len();
        let edges = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c]]);
        let components = Components::new(count, &vec![1.0_f64; count], edges);
        let sheets = (0..count).map(|row| components.of_row(row) as u32).collect();
        let mut thicknesses = vec![0.0; components.count()];
        for (row, &old) in user.iter().enumerate() {
            thicknesses[components.of_row(row)] = joined.parts[joined.part_of(old)].thickness;
        }
        let rest: Vec<_> = user.iter().map(|&old| vec3(network.x[old as usize])).collect();
        let faces = Faces::new(&triangles, count);
        let faces = if joined.has_figures() {
            faces.with_figures(|row| joined.is_figure(user[row as usize]))
        } else {
            faces
        };
        let thickness = network.thickness;
        let beside = if thickness > 0.0 { Beside::new(&faces, &rest) } else { Beside::default() };
        Some(Self { thickness, faces, beside, rest, sheets, thicknesses })
    }

    /// Distance (m) that the sheet of a particle keeps from itself.
    pub(crate) fn thickness_of(&self, particle: u32) -> f64 {
        self.thicknesses[self.sheets[particle as usize] as usize]
    }

    /// How far apart (m) a pair stays, half of what each part keeps: of one sheet, no farther than it lies at rest.
    pub(crate) fn distance_of(&self, candidate: &Candidate) -> f64 {
        let [one, .., other] = candidate.corners.map(|corner| self.thickness_of(corner));
        let thickness = 0.5 * (one + other);
        let [first, others @ ..] = candidate.corners.map(|corner| self.sheets[corner as usize]);
        if others.iter().any(|other| *other != first) {
            return thickness;
        }
        let at_rest = candidate.corners.map(|corner| self.rest[corner as usize]);
        let difference = closest(candidate.kind(), at_rest).difference;
        thickness.min(REST_SHARE * difference.norm())
    }
}

#[cfg(test)]
impl Surface {
    /// Faces over so many particles, each of which is a sheet of its own.
    pub(crate) fn of_sheets(faces: Faces, thickness: f64, count: u32) -> Self {
        let (rest, thicknesses) = (vec![Vec3::zeros(); count as usize], vec![thickness; count as usize]);
        let beside = Beside::new(&faces, &rest);
        Self { thickness, faces, beside, rest, sheets: (0..count).collect(), thicknesses }
    }
}
