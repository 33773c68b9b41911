//! The tunic by formula: the garment that comes with nappe, around the walker as it stands at first.

use std::f64::consts::{FRAC_PI_2, TAU};

use nappe_sim::{
    math::array::{dot, length, minus},
    mesh::TriangleMesh,
};

use super::walker::{CHEST, Limb, TORSO, arms};

/// How far it lies off the walker (m).
const GAP: f64 = 0.016;
/// Cells around the body, and from the neck to the hem.
const AROUND: u32 = 60;
const DOWN: u32 = 34;
/// Angle (rad) from the top of the shoulders at which it ends about the neck.
const NECK: f64 = 0.58;
/// Heights (m) where it begins to widen, and where it ends; and by how much it widens over the height.
const WAIST: f64 = 1.05;
const HEM: f64 = 0.72;
const FLARE: f64 = 0.3;

/// The tunic that scenes name as `upload = "tunic"`: one piece without sleeves, open at neck, arms and hem.
pub(crate) fn shipped_tunic() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for row in 0..=DOWN {
        let [radius, height] = profile(f64::from(row) / f64::from(DOWN));
        for step in 0..AROUND {
            let (sin, cos) = libm::sincos(TAU * f64::from(step) / f64::from(AROUND));
            mesh.points.push([radius * cos, height, radius * sin]);
        }
    }
    let point = |row: u32, step: u32| row * AROUND + step % AROUND;
    let arms = arms(0.0);
    let is_clear = |corner: &u32| arms.iter().all(|arm| apart(arm, mesh.points[*corner as usize]) > GAP);
    let mut triangles = Vec::new();
    for row in 0..DOWN {
        for step in 0..AROUND {
            let [here, below] = [row, row + 1].map(|row| [point(row, step), point(row, step + 1)]);
            let cell = [[here[0], here[1], below[0]], [here[1], below[1], below[0]]];
            triangles.extend(cell.into_iter().filter(|triangle| triangle.iter().all(is_clear)));
        }
    }
    mesh.triangles = triangles;
    mesh.drop_unused();
    mesh
}

/// Radius and height (m) at a share of the way from the neck to the hem.
fn profile(share: f64) -> [f64; 2] {
    let radius = TORSO + GAP;
    let shoulders = radius * (FRAC_PI_2 - NECK);
    let (straight, slope) = (CHEST - WAIST, (1.0 + FLARE * FLARE).sqrt());
    let way = share * (shoulders + straight + slope * (WAIST - HEM));
    if way < shoulders {
        let (sin, cos) = libm::sincos(NECK + way / radius);
        [radius * sin, CHEST + radius * cos]
    } else if way < shoulders + straight {
        [radius, CHEST - (way - shoulders)]
    } else {
        let fallen = (way - shoulders - straight) / slope;
        [radius + FLARE * fallen, WAIST - fallen]
    }
}

/// How far (m) a point is off the surface of a limb.
fn apart(limb: &Limb, point: [f64; 3]) -> f64 {
    let [from, to] = limb.ends();
    let (bone, off) = (minus(to, from), minus(point, from));
    let share = (dot(off, bone) / dot(bone, bone)).clamp(0.0, 1.0);
    length(minus(off, bone.map(|c| c * share))) - limb.radius
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tunic_is_one_piece_with_four_openings_that_lies_off_the_torso() {
        let tunic = shipped_tunic();
        let points = tunic.points.len();
        assert!((1900..2100).contains(&points), "{points} points");
        for [x, y, z] in &tunic.points {
            let across = x.hypot(*z);
            let from_axis = if *y > CHEST { across.hypot(y - CHEST) } else { across };
            let off = from_axis - TORSO;
            assert!(off > GAP - 1e-12, "{off} m off the torso at a height of {y} m");
        }
        let sides = tunic.triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
        let mut edges: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        edges.sort_unstable();
        edges.dedup();
        // Of a sphere 2, less 1 for each opening: neck, hem and two for the arms.
        let euler = points as i64 - edges.len() as i64 + tunic.triangles.len() as i64;
        assert_eq!(euler, -2);
        let shortest = edges.iter().map(|ends| {
            let [a, b] = ends.map(|end| tunic.points[end as usize]);
            length(minus(b, a))
        });
        let shortest = shortest.fold(f64::INFINITY, f64::min);
        assert!(shortest > 0.0085, "{shortest} m: a thickness of 4 mm needs twice as much");
    }
}
