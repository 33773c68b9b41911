//! The walker by formula: the figure that comes with nappe. It is of capsules that overlap, one per limb, on bones that swing.
//!
//! Enters: nothing. Leaves: its mesh at the first frame, all frames, and where its limbs are, for the garment that lies around it.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nappe_sim::mesh::TriangleMesh;

use super::pc2::PointFrames;

/// Length of its edges (m), about.
const EDGE: f64 = 0.03;
/// Frames in a second (1/s), and how many there are: of 5 s.
const RATE: f64 = 30.0;
const FRAMES: u32 = 151;
/// How long the arms take to come down (s), and how far they are from the body before and after (rad).
const LOWERED: f64 = 0.6;
const HIGH: f64 = 43.0 * PI / 180.0;
const LOW: f64 = 5.0 * PI / 180.0;
/// When the walk begins, and how long it takes to grow to its full width (s).
const WALKS: f64 = 0.4;
const GROWS: f64 = 0.4;
/// Strides of each leg in a second (1/s).
const STRIDES: f64 = 0.9;
/// How far arms and thighs swing, and by how much elbows and knees bend (rad).
const ARM: f64 = 10.0 * PI / 180.0;
const LEG: f64 = 22.0 * PI / 180.0;
const ELBOW: f64 = 15.0 * PI / 180.0;
const KNEE: f64 = 25.0 * PI / 180.0;
/// How far the body rises between two steps (m).
const RISE: f64 = 0.02;

/// Radius of the torso, and heights of the middles of its two round ends (m).
pub(super) const TORSO: f64 = 0.14;
pub(super) const CHEST: f64 = 1.33;
const PELVIS: f64 = 0.98;

/// A limb: a capsule that hangs from a joint along the bone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limb {
    /// The joint (m).
    joint: [f64; 3],
    /// (m)
    pub(super) radius: f64,
    /// From the joint to the end of the bone (m).
    length: f64,
    /// Angles (rad) that it is turned by from hanging straight down: back, and then to the side.
    back: f64,
    aside: f64,
}

impl Limb {
    /// Where a point (m) is of the limb as it hangs from the origin.
    fn place(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let (sin, cos) = libm::sincos(self.back);
        let (y, z) = (cos * y - sin * z, sin * y + cos * z);
        let (sin, cos) = libm::sincos(self.aside);
        let (x, y) = (cos * x - sin * y, sin * x + cos * y);
        let [from_x, from_y, from_z] = self.joint;
        [from_x + x, from_y + y, from_z + z]
    }

    /// Both ends of the bone (m).
    pub(super) fn ends(&self) -> [[f64; 3]; 2] {
        [self.joint, self.place([0.0, -self.length, 0.0])]
    }
}

/// 0 before 0, 1 after 1, and softly from one to the other.
fn softly(share: f64) -> f64 {
    let share = share.clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// The arms at a time (s): of each side the upper arm and the forearm.
pub(super) fn arms(time: f64) -> [Limb; 4] {
    let [right, left] = [1.0, -1.0].map(|side| {
        let (sin, grown) = (stride(time), softly((time - WALKS) / GROWS));
        let aside = side * (HIGH + (LOW - HIGH) * softly(time / LOWERED));
        let back = side * ARM * grown * sin;
        let joint = [side * 0.17, CHEST + rise(time), 0.0];
        let upper = Limb { joint, radius: 0.05, length: 0.27, back, aside };
        let [_, elbow] = upper.ends();
        [upper, Limb { joint: elbow, radius: 0.042, length: 0.24, back: back - ELBOW * grown, aside }]
    });
    [right[0], right[1], left[0], left[1]]
}

/// The legs, likewise.
fn legs(time: f64) -> [Limb; 4] {
    let [right, left] = [1.0, -1.0].map(|side| {
        let (sin, grown) = (stride(time), softly((time - WALKS) / GROWS));
        let back = -side * LEG * grown * sin;
        // A knee bends most where its thigh comes to the front.
        let bent = KNEE * grown * (0.5 + 0.5 * side * sin);
        let joint = [side * 0.09, 0.92 + rise(time), 0.0];
        let thigh = Limb { joint, radius: 0.075, length: 0.42, back, aside: 0.0 };
        let [_, knee] = thigh.ends();
        [thigh, Limb { joint: knee, radius: 0.055, length: 0.4, back: back + bent, aside: 0.0 }]
    });
    [right[0], right[1], left[0], left[1]]
}

/// The share of its swing that a limb has at a time (s).
fn stride(time: f64) -> f64 {
    libm::sin(TAU * STRIDES * (time - WALKS))
}

/// How far the body is up at a time (s), in m.
fn rise(time: f64) -> f64 {
    let sin = stride(time);
    RISE * softly((time - WALKS) / GROWS) * sin * sin
}

/// All limbs at a time (s): torso, head, arms, legs.
fn limbs(time: f64) -> Vec<Limb> {
    let at = |height: f64| [0.0, height + rise(time), 0.0];
    let torso = Limb { joint: at(CHEST), radius: TORSO, length: CHEST - PELVIS, back: 0.0, aside: 0.0 };
    let head = Limb { joint: at(1.64), radius: 0.1, length: 0.08, back: 0.0, aside: 0.0 };
    [torso, head].into_iter().chain(arms(time)).chain(legs(time)).collect()
}

/// A capsule as it hangs from the origin: its triangles are turned outwards.
fn capsule(limb: &Limb) -> TriangleMesh {
    let Limb { radius, length, .. } = *limb;
    let cells = |way: f64, least: f64| (way / EDGE).round().max(least) as u32;
    let (around, rows) = (cells(TAU * radius, 8.0), cells(length, 1.0));
    let round = cells(FRAC_PI_2 * radius, 2.0);
    // Radius and height of each ring, from the top down.
    let end = |step: u32| {
        let (sin, cos) = libm::sincos(FRAC_PI_2 * f64::from(step) / f64::from(round));
        [radius * sin, radius * cos]
    };
    let upper = (1..=round).map(end);
    let straight = (1..rows).map(|row| [radius, -length * f64::from(row) / f64::from(rows)]);
    let lower = (1..=round).rev().map(|step| [end(step)[0], -length - end(step)[1]]);
    let rings: Vec<[f64; 2]> = upper.chain(straight).chain(lower).collect();

    let mut mesh = TriangleMesh::default();
    for [radius, height] in &rings {
        for step in 0..around {
            let (sin, cos) = libm::sincos(TAU * f64::from(step) / f64::from(around));
            mesh.points.push([radius * cos, *height, radius * sin]);
        }
    }
    let [top, bottom] = [0, 1].map(|end| rings.len() as u32 * around + end);
    mesh.points.extend([[0.0, radius, 0.0], [0.0, -length - radius, 0.0]]);
    let point = |ring: u32, step: u32| ring * around + step % around;
    let last = rings.len() as u32 - 1;
    for step in 0..around {
        mesh.triangles.push([top, point(0, step + 1), point(0, step)]);
        mesh.triangles.push([bottom, point(last, step), point(last, step + 1)]);
        for ring in 0..last {
            let [here, below] = [ring, ring + 1].map(|ring| [point(ring, step), point(ring, step + 1)]);
            mesh.triangles.push([here[0], here[1], below[0]]);
            mesh.triangles.push([here[1], below[1], below[0]]);
        }
    }
    mesh
}

/// The walker that scenes name as `upload = "walker"`, as it stands at first: 1.7 m high, with its arms away from its body.
pub(crate) fn shipped_walker() -> TriangleMesh {
    let mut whole = TriangleMesh::default();
    for limb in limbs(0.0) {
        let first = whole.points.len() as u32;
        let part = capsule(&limb);
        whole.points.extend(part.points.iter().map(|point| limb.place(*point)));
        whole.triangles.extend(part.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
    }
    whole
}

/// Its frames, of the same name, thirty in a second: its arms come down, and it walks where it stands.
pub(crate) fn shipped_walk() -> PointFrames {
    let parts: Vec<TriangleMesh> = limbs(0.0).iter().map(capsule).collect();
    let points = parts.iter().map(|part| part.points.len() as u32).sum();
    let mut places = Vec::new();
    for frame in 0..FRAMES {
        for (limb, part) in limbs(f64::from(frame) / RATE).iter().zip(&parts) {
            places.extend(part.points.iter().map(|point| limb.place(*point).map(|c| c as f32)));
        }
    }
    PointFrames { points, places: places.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Holes, mend};

    #[test]
    fn the_walker_is_of_ten_closed_capsules_and_its_frames_move_its_points() {
        let (walker, walk) = (shipped_walker(), shipped_walk());
        assert_eq!((walk.points as usize, walk.count()), (walker.points.len(), FRAMES as usize));
        assert!((2000..4000).contains(&walker.points.len()), "{} points", walker.points.len());
        // A capsule has two triangles for each point but four.
        assert_eq!(walker.triangles.len(), 2 * walker.points.len() - 4 * 10);
        for (point, place) in walker.points.iter().zip(&*walk.places) {
            assert_eq!(point.map(|c| c as f32), *place);
        }
        let limb = limbs(0.0)[2];
        let mended = mend(&capsule(&limb), Holes::Refused).expect("it is closed");
        let exact = PI * limb.radius * limb.radius * (limb.length + limb.radius * 4.0 / 3.0);
        let volume = mended.closed.volume;
        assert!(volume < exact && volume > 0.9 * exact, "{volume} of {exact}");

        let frames = walk.places.chunks_exact(walker.points.len());
        let fastest = frames.clone().zip(frames.skip(1)).flat_map(|(from, to)| from.iter().zip(to)).map(
            |(from, to)| {
                let way = [0, 1, 2].map(|c| f64::from(to[c] - from[c]));
                RATE * way.iter().map(|c| c * c).sum::<f64>().sqrt()
            },
        );
        let fastest = fastest.fold(0.0, f64::max);
        assert!((0.5..4.0).contains(&fastest), "{fastest} m/s");
    }
}
