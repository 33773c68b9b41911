//! Frames that lead the corners of a figure: where each of them is over time.
//!
//! Enters: places of all corners, frame after frame, how fast frames pass, and how firm corners are. Leaves: where a corner is at a time, on
//! straight lines between frames; the mass by which it gives way; what is wrong with frames that are to lead so many corners.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::{
    collide::FASTEST,
    math::{
        array::{cross, length, minus},
        four_digits, number,
    },
    names::names,
};

/// Pressure (N) on each square metre by which a corner that gives way lies 1 m off its frame (N/m³), where nothing else is said.
pub const FIRMNESS: f64 = 1e6;

/// What follows the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Repeat {
    /// It holds from then on.
    #[default]
    Hold,
    /// The first one, after as much time as between any two.
    Loop,
}

names!(Repeat { Hold: "hold", Loop: "loop" });

/// Where the corners of a figure are over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frames {
    /// Places (m) of all corners, frame after frame. Shared, so that a copy copies none of them.
    pub places: Arc<[[f32; 3]]>,
    /// Corners of a frame, 1 or more.
    pub corners: u32,
    /// Frames in a second (1/s), above 0.
    pub rate: f64,
    /// When the first frame passes (s), 0 or more: it holds until then.
    pub start: f64,
    /// What follows the last frame.
    pub repeat: Repeat,
    /// Mass (kg) of each corner that gives way, 0 of one that is a pin; none: all are pins. Shared as places are.
    pub masses: Arc<[f64]>,
}

/// Two frames, and the share of the way from one to the other.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Between {
    frames: [usize; 2],
    share: f64,
}

impl Frames {
    /// How many frames there are.
    pub fn count(&self) -> usize {
        self.places.len() / self.corners.max(1) as usize
    }

    /// The places (m) of the corners in a frame, by its number from 0.
    ///
    /// # Panics
    /// Where there is no such frame.
    pub fn frame(&self, number: usize) -> &[[f32; 3]] {
        let corners = self.corners as usize;
        &self.places[number * corners..(number + 1) * corners]
    }

    /// The same with corners that give way, by a firmness (N/m³) and in steps of the scene of `dt` (s): each has the mass firmness x area x dt²,
    /// with a third of the areas of its triangles in the first frame. One without any is a pin.
    ///
    /// # Panics
    /// Where there are no frames, or a triangle names a corner that there is not.
    #[must_use]
    pub fn giving_way(self, triangles: &[[u32; 3]], firmness: f64, dt: f64) -> Self {
        let mut areas = vec![0.0; self.corners as usize];
        let places = self.frame(0);
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| places[corner as usize].map(f64::from));
            let area = 0.5 * length(cross(minus(b, a), minus(c, a)));
            for corner in triangle {
                areas[*corner as usize] += area / 3.0;
            }
        }
        let masses = areas.iter().map(|area| firmness * area * dt * dt).collect();
        Self { masses, ..self }
    }

    /// The place (m) of each corner at a time (s).
    ///
    /// # Panics
    /// Where there are no frames.
    pub fn at(&self, time: f64) -> impl Iterator<Item = [f64; 3]> + '_ {
        let Between { frames: [from, to], share } = self.between(time);
        self.frame(from).iter().zip(self.frame(to)).map(move |(from, to)| {
            [0, 1, 2].map(|c| {
                let [from, to] = [from[c], to[c]].map(f64::from);
                from + share * (to - from)
            })
        })
    }

    fn between(&self, time: f64) -> Between {
        let count = self.count();
        let last = count - 1;
        let passed = (time - self.start).max(0.0) * self.rate;
        let passed = match self.repeat {
            Repeat::Hold => passed.min(last as f64),
            Repeat::Loop => passed % count as f64,
        };
        let from = (passed as usize).min(last);
        let to = match self.repeat {
            Repeat::Hold => (from + 1).min(last),
            Repeat::Loop => (from + 1) % count,
        };
        Between { frames: [from, to], share: passed - from as f64 }
    }

    /// What is wrong with frames that are to lead so many corners, as what a sentence says of them; none where nothing is.
    pub fn invalid(&self, corners: usize) -> Option<String> {
        let (found, points) = (self.places.len(), self.corners as usize);
        if points != corners {
            return Some(format!(
                "have {points} points each, and the mesh has {corners}: as many are needed"
            ));
        }
        if points == 0 || found == 0 || !found.is_multiple_of(points) {
            return Some(format!(
                "have {found} places of {points} points each: a whole number of frames is needed, 1 at least"
            ));
        }
        if !self.rate.is_finite() || self.rate <= 0.0 {
            return Some(format!("pass at a rate of {} 1/s: a finite number above 0 is needed", self.rate));
        }
        if !self.start.is_finite() || self.start < 0.0 {
            return Some(format!("start at {} s: a finite number from 0 is needed", self.start));
        }
        if !self.masses.is_empty() && self.masses.len() != points {
            return Some(format!("have {} masses: one of each point is needed, or none", self.masses.len()));
        }
        if let Some(point) = self.masses.iter().position(|mass| !mass.is_finite() || *mass < 0.0) {
            let mass = self.masses[point];
            return Some(format!(
                "have a mass of {mass} kg at point {point}: a finite number from 0 is needed"
            ));
        }
        let is_finite = |place: &[f32; 3]| place.iter().all(|c| c.is_finite());
        if let Some(at) = self.places.iter().position(|place| !is_finite(place)) {
            let (frame, point, place) = (at / points, at % points, self.places[at]);
            return Some(format!("have a place that is not finite: frame {frame}, point {point}, {place:?}"));
        }
        let (frame, point, speed) = self.too_fast()?;
        let (next, speed, most) = ((frame + 1) % self.count(), four_digits(speed), number(FASTEST));
        Some(format!(
            "lead point {point} at {speed} m/s from frame {frame} to frame {next}: at most {most} m/s are allowed"
        ))
    }

    /// The first point of the first frame that is too fast on its way to the next one: frame, point, speed (m/s).
    fn too_fast(&self) -> Option<(usize, usize, f64)> {
        let count = self.count();
        let ways = match self.repeat {
            Repeat::Hold => count - 1,
            Repeat::Loop => count,
        };
        (0..ways).find_map(|frame| {
            let both = self.frame(frame).iter().zip(self.frame((frame + 1) % count));
            let mut speeds = both.enumerate().map(|(point, (from, to))| {
                let [from, to] = [from, to].map(|place| place.map(f64::from));
                (frame, point, self.rate * length(minus(to, from)))
            });
            speeds.find(|(.., speed)| *speed > FASTEST)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One corner on the x axis (m), ten frames in a second, from 0.5 s on.
    fn along(places: &[f32], repeat: Repeat) -> Frames {
        let places: Vec<[f32; 3]> = places.iter().map(|x| [*x, 0.0, 1.0]).collect();
        Frames { places: places.into(), corners: 1, rate: 10.0, start: 0.5, repeat, masses: [].into() }
    }

    fn x_at(frames: &Frames, time: f64) -> f64 {
        let places: Vec<[f64; 3]> = frames.at(time).collect();
        assert_eq!((places.len(), places[0][2]), (1, 1.0));
        places[0][0]
    }

    #[test]
    fn a_corner_holds_then_goes_straight_from_frame_to_frame_and_holds_or_begins_again() {
        let [hold, again] = Repeat::ALL.map(|repeat| along(&[0.0, 1.0, 4.0], repeat));
        for (time, held, looped) in [
            (0.0, 0.0, 0.0),
            (0.5, 0.0, 0.0),
            (0.55, 0.5, 0.5),
            (0.6, 1.0, 1.0),
            (0.65, 2.5, 2.5),
            (0.7, 4.0, 4.0),
            (0.75, 4.0, 2.0),
            (0.8, 4.0, 0.0),
            (0.85, 4.0, 0.5),
            (9.55, 4.0, 0.5),
        ] {
            let off = [x_at(&hold, time) - held, x_at(&again, time) - looped];
            assert!(off.iter().all(|off| off.abs() < 1e-12), "{time} s: off by {off:?}");
        }
        let one = along(&[2.0], Repeat::Loop);
        assert_eq!([0.0, 0.5, 7.77].map(|time| x_at(&one, time)), [2.0; 3]);
    }

    #[test]
    fn a_corner_weighs_by_a_third_of_the_areas_about_it_in_the_first_frame() {
        // A square of 2 m in two triangles, a corner beside it without any, and a second frame that counts for nothing.
        let first = [[0.0_f32; 3], [2.0, 0.0, 0.0], [2.0, 0.0, 2.0], [0.0, 0.0, 2.0], [9.0; 3]];
        let places = [first, [[0.0; 3]; 5]].concat();
        let frames = Frames { places: places.into(), corners: 5, ..along(&[0.0], Repeat::Hold) };
        let giving = frames.giving_way(&[[0, 1, 2], [0, 2, 3]], 300.0, 0.1);
        let right = [4.0, 2.0, 4.0, 2.0, 0.0];
        assert!(
            giving.masses.iter().zip(right).all(|(mass, right)| (mass - right).abs() < 1e-12),
            "{:?}",
            giving.masses
        );
        assert_eq!(giving.invalid(5), None);
    }

    #[test]
    fn frames_that_cannot_lead_are_told_with_frame_and_point() {
        let told = |change: &dyn Fn(&mut Frames)| {
            let mut frames = along(&[0.0, 1.0], Repeat::Hold);
            change(&mut frames);
            frames.invalid(1).unwrap_or_default()
        };
        assert_eq!(told(&|_| {}), "");
        let fast =
            |x: f32| move |frames: &mut Frames| frames.places = Arc::from([[0.0, 0.0, 0.0], [x, 0.0, 0.0]]);
        assert_eq!(told(&fast(1000.0)), "");
        for (told, words) in [
            (told(&|frames| frames.corners = 2), "have 2 points each, and the mesh has 1"),
            (told(&|frames| frames.places = Arc::from([[0.0_f32; 3]; 0])), "have 0 places"),
            (told(&|frames| frames.rate = 0.0), "a rate of 0 1/s"),
            (told(&|frames| frames.start = -1.0), "start at -1 s"),
            (told(&|frames| frames.masses = [1.0; 2].into()), "have 2 masses"),
            (told(&|frames| frames.masses = [f64::NAN].into()), "a mass of NaN kg at point 0"),
            (told(&fast(f32::NAN)), "frame 1, point 0"),
            (told(&fast(1001.0)), "point 0 at 10010 m/s from frame 0 to frame 1"),
        ] {
            assert!(told.contains(words), "{told}, not {words}");
        }
        // The way back is as fast as any other.
        let places = [[0.0_f32; 3], [600.0, 0.0, 0.0], [1200.0, 0.0, 0.0]];
        let mut frames = Frames { places: Arc::from(places), ..along(&[0.0], Repeat::Hold) };
        assert_eq!(frames.invalid(1), None);
        frames.repeat = Repeat::Loop;
        let told = frames.invalid(1).unwrap_or_default();
        assert!(told.contains("from frame 2 to frame 0"), "{told}");
    }
}
