//! Triangles in bundles of a few that are near each other: which of them a box may meet, and how often they go round a point.
//!
//! Reads triangles of a closed surface (m). Winding numbers are counted along a ray, without an error of rounding.

use super::{
    boxes::{Bounds, Boxes, sorted},
    four::WIDTH,
    tree::Mesh,
};
use crate::surface::turn_above;

/// Rays that are cast to see how many triangles one looks at.
const SAMPLES: usize = 16;

/// Triangles, and boxes around bundles of them.
#[derive(Clone, Debug)]
pub(super) struct Bundles {
    order: Vec<u32>,
    /// Around as many triangles as a bundle has, one bundle after the other.
    boxes: Boxes,
}

impl Bundles {
    /// Of some triangles of a surface.
    pub(super) fn new(mesh: Mesh<'_>, triangles: &[u32]) -> Self {
        let bounds: Vec<Bounds> = triangles.iter().map(|t| mesh.around(&[*t])).collect();
        let order: Vec<u32> = sorted(&bounds).into_iter().map(|place| triangles[place as usize]).collect();
        let bundles = (0_u32..).zip(order.chunks(WIDTH));
        let bounds: Vec<(u32, Bounds)> =
            bundles.map(|(bundle, triangles)| (bundle, mesh.around(triangles))).collect();
        Self { boxes: Boxes::new(&bounds), order }
    }

    /// Calls `note` for all triangles that meet a box (m), and for some that do not.
    pub(super) fn meeting(&self, bounds: Bounds, mut note: impl FnMut(u32)) {
        self.boxes.meeting(bounds, |bundle| {
            let first = bundle as usize * WIDTH;
            for t in &self.order[first..self.order.len().min(first + WIDTH)] {
                note(*t);
            }
        });
    }

    /// How often the triangles go round a point (m): a closed surface that is turned outwards does once.
    pub(super) fn winding(&self, mesh: Mesh<'_>, p: [f64; 3]) -> i32 {
        let mut turns = 0;
        self.meeting(ray(p), |t| turns += turn_above(p, mesh.corners(t)));
        turns
    }

    /// How many triangles a winding number looks at, nearly.
    pub(super) fn cost(&self, mesh: Mesh<'_>) -> usize {
        let (mut looks, mut rays) = (0, 0);
        for t in self.order.iter().step_by(self.order.len().div_ceil(SAMPLES).max(1)) {
            self.meeting(ray(mesh.corners(*t)[0]), |_| looks += 1);
            rays += 1;
        }
        looks / rays.max(1)
    }
}

/// The ray from a point (m) along +z, as a box.
fn ray(p: [f64; 3]) -> Bounds {
    [p, [p[0], p[1], f64::INFINITY]]
}
