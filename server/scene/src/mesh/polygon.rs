//! Faces of any number of corners as triangles, and what is odd about them.
//!
//! Enters: the corners of a face. Leaves: triangles that turn as the face does. A fan from the first corner is taken
//! where it covers the face, as it does if the face is convex; other faces are cut by their ears.

use super::{
    ears::{Ears, Ring},
    loaded::{Met, fan},
};

/// Corners of a polygon that is cut by its ears, at most: the time for one grows with their square.
pub(super) const MOST_CORNERS: usize = 2000;

/// What places are in warnings.
#[derive(Clone, Copy, Debug)]
pub(super) enum Placed {
    /// Lines of a text, from 1.
    Lines,
    /// Faces, from 0.
    Faces,
}

/// What may be odd about a face.
#[derive(Clone, Copy, Debug)]
enum Oddity {
    TooFew,
    Repeated,
    NotFlat,
    Crossing,
    TooMany,
}

impl Oddity {
    const ALL: [Self; 5] = [Self::TooFew, Self::Repeated, Self::NotFlat, Self::Crossing, Self::TooMany];

    /// Which faces they are, and what becomes of them.
    fn words(self) -> [String; 2] {
        let [which, what] = match self {
            Self::TooFew => ["faces of two corners or fewer", "they give no triangle"],
            Self::Repeated => ["polygons that name a corner twice in a row", "it is taken once"],
            Self::NotFlat => [
                "polygons that are not flat",
                "a corner is off the mean plane by more than 1 % of the polygon's size, and other triangles of the \
                 same corners have another shape",
            ],
            Self::Crossing => ["polygons that cross themselves or have no area", FANNED],
            Self::TooMany => {
                return [
                    format!("polygons that are not convex, of more than {MOST_CORNERS} corners"),
                    FANNED.into(),
                ];
            }
        };
        [which.into(), what.into()]
    }
}

const FANNED: &str = "each becomes a fan of triangles from its first corner, which may overlap; cut them into triangles \
                      in the program that made the file";

/// Cuts the polygons of one file, and counts what is odd about them.
#[derive(Debug, Default)]
pub(super) struct Polygons {
    ears: Ears,
    corners: Vec<u32>,
    met: [Met; Oddity::ALL.len()],
}

impl Polygons {
    pub(super) fn new() -> Self {
        Self::default()
    }

    /// Appends the triangles of a face, fewer than it has corners. `corners` are indices of `points`; `place` is the
    /// line or the index of the face.
    ///
    /// # Panics
    /// If a corner is no index of a point.
    pub(super) fn cut(
        &mut self,
        points: &[[f64; 3]],
        corners: &[u32],
        place: usize,
        triangles: &mut Vec<[u32; 3]>,
    ) {
        // A triangle stays as it is: what is odd about one is found in every mesh alike.
        if let [a, b, c] = *corners {
            triangles.push([a, b, c]);
            return;
        }

        self.corners.clear();
        self.corners.extend_from_slice(corners);
        self.corners.dedup();
        if self.corners.len() > 1 && self.corners.first() == self.corners.last() {
            self.corners.pop();
        }
        if self.corners.len() < corners.len() {
            self.add(Oddity::Repeated, place);
        }
        match self.corners[..] {
            [] | [_] | [_, _] => self.add(Oddity::TooFew, place),
            [a, b, c] => triangles.push([a, b, c]),
            _ => self.cut_polygon(points, place, triangles),
        }
    }

    /// Four corners or more, no two in a row the same.
    fn cut_polygon(&mut self, points: &[[f64; 3]], place: usize, triangles: &mut Vec<[u32; 3]>) {
        let ring = Ring::new(points, &self.corners);
        let is_flat = ring.is_flat();
        let (is_fan, fault) = if ring.is_fan() {
            (true, None)
        } else if self.corners.len() > MOST_CORNERS {
            (true, Some(Oddity::TooMany))
        } else if ring.has_area() && self.ears.cut(&ring, triangles) {
            (false, None)
        } else {
            (true, Some(Oddity::Crossing))
        };

        if is_fan {
            triangles.extend(fan(&self.corners));
        }
        if !is_flat {
            self.add(Oddity::NotFlat, place);
        }
        if let Some(fault) = fault {
            self.add(fault, place);
        }
    }

    fn add(&mut self, oddity: Oddity, place: usize) {
        self.met[oddity as usize].add(place);
    }

    /// What was odd, one warning for each kind, with its count and its first place.
    pub(super) fn warnings(self, file: &str, placed: Placed) -> Vec<String> {
        let met = Oddity::ALL.into_iter().zip(self.met).filter(|(_, met)| met.count > 0);
        met.map(|(oddity, Met { count, first })| {
            let [which, what] = oddity.words();
            let place = match placed {
                Placed::Lines => format!("{file}:{first}"),
                Placed::Faces => format!("{file}: face {first}"),
            };
            format!("{place}: {which} ({count}, the first here): {what}")
        })
        .collect()
    }
}
