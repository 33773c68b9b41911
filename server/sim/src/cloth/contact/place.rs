//! Where two parts meet within a sub-step: a contact is one of its end, as implicit Euler has it, unless one part would go through the other on
//! its way there.
//!
//! What lies over an inner edge or corner of a surface touches it only within the cone between the faces about it: elsewhere one of those faces
//! is nearer. So a vertex that slides over a flat sheet is pushed across it alone.

use super::rules::THIN;
use crate::{
    math::Vec3,
    surface::{Candidate, Closest, Faces, Inside, PairKind, closest, gap_along},
};

/// Halvings of a way, to find the place of it where two parts are nearest.
const HALVINGS: u32 = 12;
/// Sine of the angle by which a direction may lean out of a cone, and is turned back: what a sheet that is nearly flat makes.
const LEAN: f64 = 0.03;

/// Where two parts meet: how the nearest points are mixed of their corners, and the direction from the second part to the first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) weights: [f64; 4],
    pub(super) normal: Vec3<f64>,
    /// Their distance there (m).
    pub(super) distance: f64,
    /// After which share of the way.
    pub(super) share: f64,
    inside: Inside,
}

/// The way of the corners of a pair in a sub-step.
pub(super) struct Going {
    pub(super) kind: PairKind,
    /// Where they begin, and their ways (m).
    pub(super) start: [Vec3<f64>; 4],
    pub(super) ways: [Vec3<f64>; 4],
    /// How far apart (m) the parts begin, and in which direction.
    pub(super) gap: f64,
    pub(super) normal: Vec3<f64>,
}

impl Going {
    /// Where they meet, if they end nearer than a distance (m) or go through each other.
    pub(super) fn meets(&self, target: f64) -> Option<Place> {
        let end = self.at(1.0);
        if gap_along(self.kind, end, &self.normal) >= target {
            return None;
        }
        let at_end = closest(self.kind, end);
        let distance = at_end.difference.norm();
        let least = THIN * target.min(self.gap);
        let stays_apart = gap_along(self.kind, end, &self.normal) >= least
            || distance >= least && gap_along(self.kind, self.start, &at_end.difference) >= least * distance;
        if stays_apart {
            return if distance < target { Place::new(&at_end, 1.0) } else { None };
        }
        let nearest = self.nearest(at_end)?;
        (nearest.distance < least || distance < target).then_some(nearest)
    }

    /// Where they are nearest at the start.
    pub(super) fn begins(&self) -> Option<Place> {
        Place::new(&closest(self.kind, self.start), 0.0)
    }

    /// Where all corners are after a share of their ways (m).
    fn at(&self, share: f64) -> [Vec3<f64>; 4] {
        [0, 1, 2, 3].map(|k| self.start[k] + self.ways[k] * share)
    }

    /// The place of the way where they are nearest: where they stop to come nearer. Behind it they may be on the other side.
    fn nearest(&self, at_end: Closest) -> Option<Place> {
        let comes_nearer = |found: &Closest| found.difference.dot(&mixed(&self.ways, &found.weights)) < 0.0;
        if comes_nearer(&at_end) {
            return Place::new(&at_end, 1.0);
        }
        let (mut low, mut high, mut best) = (0.0, 1.0, closest(self.kind, self.start));
        if !comes_nearer(&best) {
            return Place::new(&best, 0.0);
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let there = closest(self.kind, self.at(middle));
            if comes_nearer(&there) {
                (low, best) = (middle, there);
            } else {
                high = middle;
            }
        }
        Place::new(&best, low)
    }
}

impl Place {
    /// None where the parts touch, so that there is no direction.
    fn new(found: &Closest, share: f64) -> Option<Self> {
        let distance = found.difference.norm();
        let normal = found.difference / distance;
        let is_sound = distance > 0.0 && normal.iter().all(|c| c.is_finite());
        is_sound.then_some(Self { weights: found.weights, normal, distance, share, inside: found.inside })
    }

    /// The same where the surfaces touch there: inside of both parts, or over an edge or a corner that the triangle counts for all that have it; and
    /// within the cone of what meets there, to which a direction is turned that leans out of it a little. `at` says where a particle is after a
    /// share of its way.
    pub(super) fn borne(
        self,
        faces: &Faces,
        candidate: &Candidate,
        at: impl Fn(u32, f64) -> Vec3<f64>,
    ) -> Option<Self> {
        let [first, second, third, fourth] = candidate.corners;
        let triangle = candidate.triangle as usize;
        let at = |particle: u32| at(particle, self.share);
        let mut place = self;
        // No particle across an edge is nearer than the edge.
        let over_edge = |place: &mut Self, [from, to]: [u32; 2], sign: f64| {
            let (start, edge) = (at(from), at(to) - at(from));
            faces.across([from, to]).all(|other| {
                let beside = at(other) - start;
                let beside = beside - edge * (beside.dot(&edge) / edge.norm_squared());
                place.turn_from(&(beside * sign))
            })
        };
        let is_borne = match (candidate.kind(), self.inside) {
            (PairKind::VertexTriangle, Inside::Both) => true,
            (PairKind::Edges, Inside::Both) => {
                over_edge(&mut place, [third, fourth], 1.0) && over_edge(&mut place, [first, second], -1.0)
            }
            (PairKind::VertexTriangle, Inside::Edge(edge)) => {
                let corners = [second, third, fourth];
                let ends = [corners[usize::from(edge)], corners[(usize::from(edge) + 1) % 3]];
                faces.owns_edge(triangle, edge.into()) && over_edge(&mut place, ends, 1.0)
            }
            (PairKind::VertexTriangle, Inside::Corner(corner)) => {
                let point = [second, third, fourth][usize::from(corner)];
                let here = at(point);
                let about = faces.about(point).iter().flat_map(|other| faces.triangles()[*other as usize]);
                let mut others = about.filter(|other| *other != point);
                faces.owns_vertex(triangle, corner.into())
                    && others.all(|other| place.turn_from(&(at(other) - here)))
            }
            _ => false,
        };
        is_borne.then(|| place.turned(&self.normal))
    }

    /// Takes from the direction what leads towards a place beside the nearest one; whether that is no more than a little.
    fn turn_from(&mut self, beside: &Vec3<f64>) -> bool {
        let square = beside.norm_squared();
        let towards = self.normal.dot(beside);
        if towards > LEAN * square.sqrt() {
            return false;
        }
        if towards > 0.0 {
            self.normal -= beside * (towards / square);
        }
        true
    }

    /// The same with a direction of length 1, of which the nearest points lie apart along another one.
    fn turned(mut self, before: &Vec3<f64>) -> Self {
        self.normal.normalize_mut();
        self.distance *= self.normal.dot(before);
        self
    }
}

/// The sum of vectors by weights.
pub(super) fn mixed(of_corners: &[Vec3<f64>; 4], weights: &[f64; 4]) -> Vec3<f64> {
    of_corners[0] * weights[0]
        + of_corners[1] * weights[1]
        + of_corners[2] * weights[2]
        + of_corners[3] * weights[3]
}
