//! Networks that are stepped as one cloth: the particles of each after those of the one before.

use std::{borrow::Cow, ops::Range};

use super::description::{ElementList, Network, Spring};
use crate::{interrupt, surface::Crossing};

/// Networks side by side, in the order that they were given in.
#[derive(Clone, Debug)]
pub(crate) struct Joined<'a> {
    /// All of them as one, with the greatest thickness. Of several it has drag and air of the first one, which all of them
    /// have, and neither texture coordinates nor frames.
    pub(crate) whole: Cow<'a, Network>,
    /// Each of them.
    pub(crate) parts: Vec<&'a Network>,
    /// The first particle of each within the whole.
    starts: Vec<u32>,
}

impl<'a> Joined<'a> {
    /// Puts networks side by side whose indices are those of their own particles.
    ///
    /// # Panics
    /// Where there are none.
    pub(crate) fn of(parts: Vec<&'a Network>) -> Self {
        let (mut starts, mut count) = (Vec::with_capacity(parts.len()), 0);
        for part in &parts {
            starts.push(count);
            count += part.x.len() as u32;
        }
        let whole = match parts.as_slice() {
            [only] => Cow::Borrowed(*only),
            several => Cow::Owned(side_by_side(several, &starts)),
        };
        Self { whole, parts, starts }
    }

    /// The part that a particle of the whole belongs to.
    pub(crate) fn part_of(&self, particle: u32) -> usize {
        self.starts.partition_point(|start| *start <= particle) - 1
    }

    /// Whether any part is a figure.
    pub(crate) fn has_figures(&self) -> bool {
        self.parts.iter().any(|part| part.is_figure())
    }

    /// Whether a particle of the whole is a corner of a figure.
    pub(crate) fn is_figure(&self, particle: u32) -> bool {
        self.parts[self.part_of(particle)].is_figure()
    }

    /// Its triangles that are no figure's.
    pub(crate) fn triangles_of_cloth(&self) -> Cow<'_, [[u32; 3]]> {
        if !self.has_figures() {
            return Cow::Borrowed(self.whole.triangles.as_slice());
        }
        let of_cloth = |corners: &&[u32; 3]| !self.is_figure(corners[0]);
        Cow::Owned(self.whole.triangles.iter().filter(of_cloth).copied().collect())
    }

    /// The first crossing of its surfaces; what figures do among themselves is none.
    pub(crate) fn first_crossing(&self) -> Option<Crossing> {
        self.whole.first_crossing_of(&|particles| self.counts(particles))
    }

    /// A particle of each of the first two parts of its surfaces that touch, of which one at least is no figure's.
    pub(crate) fn touching(&self) -> Option<[u32; 2]> {
        self.whole.touching_of(&|particles| self.counts(particles))
    }

    /// Whether some of these particles are no figure's.
    fn counts(&self, particles: &[u32]) -> bool {
        particles.iter().any(|particle| !self.is_figure(*particle))
    }

    /// The particles of a part within the whole.
    pub(crate) fn particles(&self, part: usize) -> Range<u32> {
        let start = self.starts[part];
        start..start + self.parts[part].x.len() as u32
    }
}

fn side_by_side(parts: &[&Network], starts: &[u32]) -> Network {
    let Network { drag, air, .. } = *parts[0];
    let mut whole = Network { drag, air, ..Network::default() };
    for (part, &start) in parts.iter().zip(starts) {
        interrupt::point();
        let moved = |particle: u32| start + particle;
        whole.x.extend_from_slice(&part.x);
        whole.v.extend_from_slice(&part.v);
        whole.masses.extend_from_slice(&part.masses);
        whole.pins.extend(part.pins.iter().map(|pin| moved(*pin)));
        let spring = |spring: &Spring| Spring { particles: spring.particles.map(moved), ..*spring };
        whole.springs.extend(part.springs.iter().map(spring));
        whole.elements.extend(part.elements.iter().map(|list| ElementList {
            kind: list.kind,
            law: list.law,
            particles: list.particles.iter().map(|particle| moved(*particle)).collect(),
            rest: list.rest.clone(),
            bending: list.bending,
            threads: list.threads,
        }));
        whole.triangles.extend(part.triangles.iter().map(|corners| corners.map(moved)));
        whole.thickness = whole.thickness.max(part.thickness);
    }
    whole
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::cloth::{Frames, Repeat, SpringKind, SpringLaw};

    fn part(x: f64, count: u32, thickness: f64) -> Network {
        let law = SpringLaw { stiffness: 1.0, damping: 0.0 };
        let spring = Spring { particles: [0, count - 1], kind: SpringKind::Stretch, rest_length: 1.0, law };
        Network {
            x: vec![[x, 0.0, 0.0]; count as usize],
            v: vec![[0.0; 3]; count as usize],
            masses: vec![x; count as usize],
            pins: vec![1],
            springs: vec![spring],
            triangles: vec![[0, 1, 2]],
            uv: vec![[0.0; 2]; count as usize],
            thickness,
            ..Network::default()
        }
    }

    #[test]
    fn particles_stand_side_by_side_and_what_names_them_is_moved() {
        let [one, other] = [part(1.0, 3, 0.1), part(2.0, 4, 0.2)];
        let joined = Joined::of(vec![&one, &other]);
        let whole = &joined.whole;
        assert_eq!(whole.x.iter().map(|x| x[0]).collect::<Vec<_>>(), [1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0]);
        assert_eq!(whole.masses.len(), 7);
        assert_eq!(whole.pins, [1, 4]);
        assert_eq!(whole.springs.iter().map(|s| s.particles).collect::<Vec<_>>(), [[0, 2], [3, 6]]);
        assert_eq!(whole.triangles, [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(whole.thickness, 0.2);
        assert_eq!([0, 2, 3, 6].map(|particle| joined.part_of(particle)), [0, 0, 1, 1]);
        assert_eq!([0, 1].map(|part| joined.particles(part)), [0..3, 3..7]);
    }

    #[test]
    fn what_figures_do_among_themselves_does_not_count() {
        let places: Arc<[[f32; 3]]> = [[0.0_f32; 3]; 3].into();
        let frames =
            Frames { places, corners: 3, rate: 1.0, start: 0.0, repeat: Repeat::Hold, masses: [].into() };
        let figure = Network { frames: Some(frames), ..part(1.0, 3, 0.1) };
        let cloth = part(2.0, 4, 0.2);
        let joined = Joined::of(vec![&cloth, &figure, &figure]);
        assert!(joined.has_figures() && joined.whole.frames.is_none());
        assert_eq!([0, 3, 4, 9].map(|particle| joined.is_figure(particle)), [false, false, true, true]);
        assert_eq!(*joined.triangles_of_cloth(), [[0, 1, 2]]);
        assert!(joined.counts(&[3, 4]) && !joined.counts(&[4, 9]));
        assert!(!Joined::of(vec![&cloth]).has_figures());
    }

    #[test]
    fn one_network_is_itself() {
        let one = part(1.0, 3, 0.1);
        let joined = Joined::of(vec![&one]);
        assert_eq!(*joined.whole, one);
        assert_eq!((joined.part_of(2), joined.particles(0)), (0, 0..3));
    }
}
