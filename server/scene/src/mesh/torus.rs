//! A torus by formula: the mesh that comes with nappe.

use std::f64::consts::TAU;

use nappe_sim::mesh::TriangleMesh;

/// The torus that scenes name as `upload = "torus"`: 1 m across, with a hole of 0.4 m about the y axis; 512 points and
/// 1 024 triangles.
pub(crate) fn shipped_torus() -> TriangleMesh {
    torus([0.35, 0.15], [32, 16])
}

/// A torus about the y axis: radius of the circle in its middle and of its tube (m), cells around the axis and around
/// the tube. Its triangles are turned outwards.
fn torus([ring, tube]: [f64; 2], [around, across]: [u32; 2]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for i in 0..around {
        for j in 0..across {
            let angle = |step: u32, steps: u32| libm::sincos(TAU * f64::from(step) / f64::from(steps));
            let ((sin_ring, cos_ring), (sin_tube, cos_tube)) = (angle(i, around), angle(j, across));
            let reach = ring + tube * cos_tube;
            mesh.points.push([reach * cos_ring, tube * sin_tube, reach * sin_ring]);
            let point = |i: u32, j: u32| (i % around) * across + j % across;
            let [here, further] = [i, i + 1].map(|i| [point(i, j), point(i, j + 1)]);
            mesh.triangles.push([here[0], here[1], further[0]]);
            mesh.triangles.push([further[0], here[1], further[1]]);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Holes, mend};

    #[test]
    fn the_torus_is_closed_and_turned_outwards() {
        let torus = shipped_torus();
        assert_eq!((torus.points.len(), torus.triangles.len()), (512, 1024));
        let mended = mend(&torus, Holes::Refused).expect("it is closed");
        assert_eq!((&mended.surface, mended.repeated), (&torus, None));
        let exact = TAU * 0.35 * TAU / 2.0 * 0.15 * 0.15;
        let volume = mended.closed.volume;
        assert!(volume < exact && volume > 0.96 * exact, "{volume} of {exact}");
    }
}
