//! Holds: what the colliders around a node leave free of its velocity.
//!
//! Reads contacts and unit normals of colliders, one after the other; writes the free part of vectors.

use crate::{
    collide::{Contact, SAME_NORMAL},
    math::{
        Real, Vec3,
        array::{cross, dot, length},
    },
};

/// What colliders leave free of a node's velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Hold<R> {
    /// The node is free: all of its velocity.
    Free,
    /// What lies along the surface with this normal.
    Across([R; 3]),
    /// What lies in this direction, along two surfaces at once.
    Along([R; 3]),
    /// Nothing of its velocity: the node sticks, or three surfaces hold it.
    All,
}

impl<R: Real> Hold<R> {
    /// The free part of a vector.
    pub(crate) fn free(&self, v: &Vec3<R>) -> Vec3<R> {
        match self {
            Self::Free => *v,
            Self::Across(normal) => {
                let normal = Vec3::from(*normal);
                v - normal * normal.dot(v)
            }
            Self::Along(way) => {
                let way = Vec3::from(*way);
                way * way.dot(v)
            }
            Self::All => Vec3::zeros(),
        }
    }
}

impl Hold<f64> {
    /// What a collider of this contact and unit normal leaves of it. Normals that are all but the same, or
    /// opposite, hold one direction: what is called free and is held loses energy, never the other way round.
    pub(crate) fn and(self, contact: Contact, normal: [f64; 3]) -> Self {
        if contact == Contact::Sticky {
            return Self::All;
        }

        match self {
            Self::Free => Self::Across(normal),
            Self::Across(first) => {
                let way = cross(first, normal);
                let sine = length(way);
                if sine < SAME_NORMAL { self } else { Self::Along(way.map(|c| c / sine)) }
            }
            Self::Along(way) if dot(way, normal).abs() < SAME_NORMAL => self,
            Self::Along(_) | Self::All => Self::All,
        }
    }

    /// In the precision of a state.
    pub(crate) fn of<R: Real>(self) -> Hold<R> {
        match self {
            Self::Free => Hold::Free,
            Self::Across(normal) => Hold::Across(normal.map(R::of)),
            Self::Along(way) => Hold::Along(way.map(R::of)),
            Self::All => Hold::All,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Hold;
    use crate::{
        collide::Contact,
        math::{Vec3, array::dot},
    };

    const X: [f64; 3] = [1.0, 0.0, 0.0];
    const Y: [f64; 3] = [0.0, 1.0, 0.0];
    const Z: [f64; 3] = [0.0, 0.0, 1.0];
    /// In the plane of X and Y, along neither.
    const SLOPE: [f64; 3] = [0.6, 0.8, 0.0];
    const TURNED: [f64; 3] = [2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0];

    fn held(normals: &[[f64; 3]]) -> Hold<f64> {
        normals.iter().fold(Hold::Free, |hold, normal| hold.and(Contact::Slip, *normal))
    }

    #[test]
    fn what_is_free_lies_along_every_surface_and_is_free_once_more() {
        let v = Vec3::new(0.3, -1.7, 0.9);
        for normals in [
            &[X][..],
            &[X, Y],
            &[X, SLOPE],
            &[TURNED, SLOPE],
            &[X, Y, Z],
            &[X, SLOPE, TURNED],
            &[X, SLOPE, Y],
            &[X, X, Y],
        ] {
            let hold = held(normals);
            let free = hold.free(&v);
            for normal in normals {
                let off = dot([free.x, free.y, free.z], *normal).abs();
                assert!(off < 1e-15, "{hold:?} leaves {off:e} along {normal:?}");
            }
            assert!((hold.free(&free) - free).norm() < 1e-15, "{hold:?}: {free:?}");
        }
    }

    #[test]
    fn each_surface_of_another_direction_takes_one() {
        assert_eq!(held(&[]), Hold::Free);
        assert_eq!(held(&[SLOPE]), Hold::Across(SLOPE));
        assert_eq!(held(&[X, Y]), Hold::Along(Z));
        assert_eq!(held(&[Z, X]), Hold::Along(Y));
        assert!(matches!(held(&[X, SLOPE]), Hold::Along([0.0, 0.0, z]) if (z - 1.0).abs() < 1e-15));
        assert_eq!(held(&[X, Y, Z]), Hold::All);
        assert_eq!(held(&[X, SLOPE, TURNED]), Hold::All);
        assert_eq!(held(&[X, Y, Z, SLOPE]), Hold::All);
    }

    #[test]
    fn surfaces_of_the_same_direction_hold_it_once() {
        let opposite = SLOPE.map(|c| -c);
        let nearly = [1.0, 1e-6, 0.0];
        for normals in [[SLOPE, SLOPE], [SLOPE, opposite]] {
            assert_eq!(held(&normals), Hold::Across(SLOPE));
        }
        assert_eq!(held(&[X, nearly]), Hold::Across(X));
        // The third lies in the plane of the first two.
        assert_eq!(held(&[X, Y, SLOPE]), Hold::Along(Z));
        // A channel of four walls.
        assert_eq!(held(&[X, [-1.0, 0.0, 0.0], Y, [0.0, -1.0, 0.0]]), Hold::Along(Z));
    }

    #[test]
    fn what_sticks_is_held_whatever_else_holds_it() {
        for before in [Hold::Free, Hold::Across(X), Hold::Along(Y), Hold::All] {
            assert_eq!(before.and(Contact::Sticky, Z), Hold::All);
            assert_eq!(Hold::All.and(Contact::Separating, Z), Hold::All);
        }
    }

    #[test]
    fn in_binary32_it_is_the_same_hold() {
        assert_eq!(held(&[X, Y]).of::<f32>(), Hold::Along([0.0, 0.0, 1.0]));
        assert_eq!(held(&[X]).of::<f32>(), Hold::Across([1.0, 0.0, 0.0]));
        assert_eq!(held(&[]).of::<f32>(), Hold::Free);
        assert_eq!(Hold::All.of::<f32>(), Hold::All);
    }
}
