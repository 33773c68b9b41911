//! Pinches: what is between two colliders that close on it, as between the fingers of a gripper, is held there.
//!
//! Reads a sub-step of a particle and the colliders around it; writes where it is held, how fast, and by which two. Between rigid
//! bodies the force that presses is not known: it is held or not, whatever the coefficients of friction above 0 are.

use super::{
    answer::Encounter,
    facing::{Facing, facing},
    touch::Answer,
};
use crate::{
    collide::collider::Collider,
    math::{Vec3, array3, vec3},
};

/// Cosine between the normals of two colliders that hold what is between them, at most: 120 degrees.
const OPPOSITE: f64 = -0.5;
/// Looks for the middle between two surfaces, at most.
const MOST_LOOKS: usize = 16;
/// Roundings of positions by which a distance may be above the margin: fingers may close to twice the margin exactly.
const ROUNDINGS: f64 = 4.0;
/// Reach of a look for fingers, over the margin and what the particle and surfaces go.
const REACH: f64 = 2.0;

/// Where two colliders hold a particle.
struct Grip<'a> {
    fingers: [Facing<'a>; 2],
    /// The place (m).
    x: Vec3<f64>,
    /// How far (m) it is from where the particle was carried.
    shift: f64,
    /// How much room (m) the two leave there, below their margins.
    room: f64,
}

/// Whether anything can be held: two colliders rub, and one of them has a way.
pub(crate) fn can_hold(colliders: &[Collider]) -> bool {
    let rubbing = || colliders.iter().filter(|collider| collider.friction > 0.0);
    rubbing().count() > 1 && rubbing().any(|collider| collider.way.is_some())
}

impl<'a> Encounter<'a> {
    /// What becomes of the particle if two colliders hold it, and these two: each gives half of the change of its velocity. Of
    /// several pairs one in which both have a way goes first, then the one that leaves the least room.
    pub(crate) fn held(&self) -> Option<(Answer, [Facing<'a>; 2])> {
        let end = array3(&self.x[1]);
        let rubbing = facing(self.colliders, self.near).filter(|collider| collider.friction > 0.0);
        let speed = |collider: Facing<'_>| vec3::<f64>(collider.velocity_at(end, self.sub_step.end)).norm();
        let fastest = rubbing.clone().map(speed).fold(0.0, f64::max);
        let went = (self.x[1] - self.x[0]).norm() + fastest * self.sub_step.dt;
        let is_near = |collider: &Facing<'a>| {
            !collider.is_beyond(end, self.sub_step.end, REACH * (collider.margin + went))
        };
        let mut best = None::<Grip<'_>>;
        for (number, first) in rubbing.clone().enumerate() {
            if !is_near(&first) {
                continue;
            }
            for second in rubbing.clone().skip(number + 1) {
                if first.way.is_none() && second.way.is_none() || !is_near(&second) {
                    continue;
                }
                let grip = self.grip([first, second]);
                best = match (best, grip) {
                    (Some(best), Some(grip)) if grip.rank() < best.rank() => Some(grip),
                    (best, grip) => best.or(grip),
                };
            }
        }
        let Grip { fingers, x, shift, .. } = best?;
        let [first, second] = fingers.map(|finger| finger.velocity_at(array3(&x), self.sub_step.end));
        let v = (vec3::<f64>(first) + vec3::<f64>(second)) * 0.5;
        // What is pushed to the middle may stretch springs, as what comes out of a solid does.
        let was_inside = shift > fingers.map(|finger| self.spare_of(finger)).into_iter().fold(0.0, f64::max);
        Some((Answer { x, v, swing: 0.0, was_inside, is_pinched: false }, fingers))
    }

    /// Where two colliders hold the particle at the end. What began between them goes along with them; what came between them
    /// stops where it is then.
    fn grip(&self, fingers: [Facing<'a>; 2]) -> Option<Grip<'a>> {
        let start = array3(&self.x[0]);
        let carried = fingers.map(|finger| vec3::<f64>(finger.carried(start, self.sub_step)));
        let [first, second] = fingers.map(|finger| finger.margin);
        // No farther than the particle and the fingers can be from each other.
        let most = first + second + (carried[0] - carried[1]).norm() + ROUNDINGS * self.rounding;
        let middle = |from: Vec3<f64>| self.middle(fingers, from, most);
        if look(fingers, &self.x[0], self.sub_step.start()).is_some()
            && let Some(grip) = middle((carried[0] + carried[1]) * 0.5)
        {
            return Some(grip);
        }
        let (distances, _) = look(fingers, &self.x[1], self.sub_step.end)?;
        if distances.iter().all(|distance| *distance >= 0.0) { middle(self.x[1]) } else { None }
    }

    /// The middle between two surfaces across from a place (m), if it is within both margins and no farther than `most` (m) from
    /// the place. Where margins differ, distances are in their proportion.
    fn middle(&self, fingers: [Facing<'a>; 2], from: Vec3<f64>, most: f64) -> Option<Grip<'a>> {
        let margins = fingers.map(|finger| finger.margin);
        let both = margins[0] + margins[1];
        let share = if both > 0.0 { margins[0] / both } else { 0.5 };
        let mut x = from;
        for looks in 1..=MOST_LOOKS {
            let ([first, second], across) = look(fingers, &x, self.sub_step.end)?;
            // Both distances change by half of |across| per metre of a way along it.
            let by = across * (2.0 * (share * second - (1.0 - share) * first) / across.norm_squared());
            if by.norm() <= self.rounding || looks == MOST_LOOKS {
                let shift = (x - from).norm();
                let spare = ROUNDINGS * self.rounding;
                let is_held = first <= margins[0] + spare && second <= margins[1] + spare && shift <= most;
                return is_held.then_some(Grip { fingers, x, shift, room: first + second - both });
            }
            x += by;
        }
        None
    }
}

impl Grip<'_> {
    /// Of two grips the lower one holds.
    fn rank(&self) -> (bool, f64) {
        (self.fingers.iter().any(|finger| finger.way.is_none()), self.room)
    }
}

/// Distances (m) of a place from two surfaces at a time (s), and the difference of their normals, which leads from the first
/// one to the second; none where the surfaces do not look at each other.
fn look(fingers: [Facing<'_>; 2], x: &Vec3<f64>, time: f64) -> Option<([f64; 2], Vec3<f64>)> {
    let [(first, out), (second, back)] = fingers.map(|finger| finger.distance(array3(x), time));
    let [out, back] = [out, back].map(vec3::<f64>);
    (out.dot(&back) < OPPOSITE).then(|| ([first, second], out - back))
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "angles of the tests, not of a step")]
mod tests {
    use super::*;
    use crate::{
        collide::{
            collider::{Contact, StartInside},
            motion::{PoseKey, Way, pose::Pose},
            shape::{Cuboid, Plane, Shape, Sphere},
        },
        sub_step::SubStep,
    };

    const TIMES: [f64; 2] = [0.3, 0.31];
    const DT: f64 = TIMES[1] - TIMES[0];
    const MARGIN: f64 = 1e-3;

    fn collider(shape: Shape, way: Option<Way>) -> Collider {
        Collider {
            name: "finger".into(),
            shape,
            velocity: [0.0; 3],
            way,
            friction: 0.1,
            restitution: 0.0,
            margin: MARGIN,
            contact: Contact::Separating,
            recovery: Collider::RECOVERY,
            on_start_inside: StartInside::Warn,
        }
    }

    /// A box 2 cm high about a height (m), which goes by so much (m) in the sub-step, and turns by an angle (rad) about y.
    fn finger(height: f64, goes: [f64; 3], turns: f64) -> Collider {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let cuboid = Cuboid { center: [0.0, height, 0.0], half_extent: [0.05, 0.01, 0.05], axes };
        let key = |share: f64, time: f64| {
            let (sin, cos) = (0.5 * share * turns).sin_cos();
            let position = [goes[0] * share, height + goes[1] * share, goes[2] * share];
            PoseKey { time, pose: Pose { position, turn: [0.0, sin, 0.0, cos] } }
        };
        collider(Shape::Box(cuboid), Some(Way { keys: vec![key(0.0, TIMES[0]), key(1.0, TIMES[1])] }))
    }

    /// What becomes of a particle that is at `x` (m) and moves with `v` (m/s), and by which colliders.
    fn held(colliders: &[Collider], x: [f64; 3], v: [f64; 3]) -> Option<(Answer, [usize; 2])> {
        let (x, v) = (vec3::<f64>(x), vec3::<f64>(v));
        let (x, v) = ([x, x + v * DT], [v, v]);
        let sub_step = SubStep { dt: DT, end: TIMES[1] };
        let encounter = Encounter { colliders, near: &[], x, v, sub_step, rounding: 1e-15 };
        let (answer, fingers) = encounter.held()?;
        let number = |finger: Facing<'_>| {
            colliders
                .iter()
                .position(|collider| std::ptr::eq(collider, finger.collider))
                .expect("one of them")
        };
        Some((answer, fingers.map(number)))
    }

    /// Two fingers with so much room (m) between them about the height 0, that go and turn together.
    fn pair(room: f64, goes: [f64; 3], turns: f64) -> [Collider; 2] {
        [-1.0, 1.0].map(|side: f64| finger(side * (0.01 + 0.5 * room), goes, turns))
    }

    #[test]
    fn what_is_between_two_fingers_goes_along_with_them_wherever_it_would_fall() {
        let (goes, turns) = ([0.02, 0.03, -0.01], 0.2);
        for room in [0.0, 1.5 * MARGIN, 2.0 * MARGIN] {
            for v in [[0.0; 3], [20.0, -3.0, 0.0], [0.0, 0.3, 0.0]] {
                let start = [0.03, 0.0, 0.02];
                let (end, by) = held(&pair(room, goes, turns), start, v).expect("it is held");
                let (sin, cos) = turns.sin_cos();
                let turned = [cos * start[0] + sin * start[2], 0.0, cos * start[2] - sin * start[0]];
                let expected = Vec3::from([0, 1, 2].map(|c| goes[c] + turned[c]));
                let off = (end.x - expected).norm();
                assert!(off < 1e-15 && by == [0, 1] && !end.was_inside, "{room} m: off by {off:e} m");
                let off = (end.v - (expected - Vec3::from(start)) / DT).norm();
                assert!(off < 1e-11, "{room} m: off by {off:e} m/s");
            }
        }
    }

    #[test]
    fn what_has_room_or_no_friction_or_no_way_is_not_held() {
        let still = [0.0; 3];
        let of = |colliders: &[Collider]| held(colliders, still, still).map(|(_, fingers)| fingers);
        assert_eq!(of(&pair(1.9 * MARGIN, still, 0.0)), Some([0, 1]), "its ways rest");
        assert_eq!(of(&pair(2.1 * MARGIN, still, 0.0)), None);
        for number in [0, 1] {
            let mut smooth = pair(MARGIN, still, 0.0);
            smooth[number].friction = 0.0;
            assert_eq!(of(&smooth), None);
            let mut one = pair(MARGIN, still, 0.0);
            one[number].way = None;
            assert!(of(&one) == Some([0, 1]) && can_hold(&one));
            one[1 - number].way = None;
            assert!(of(&one).is_none() && !can_hold(&one));
        }
        let [lower, upper] = pair(MARGIN, still, 0.0);
        assert!(!can_hold(std::slice::from_ref(&lower)) && of(&[lower.clone(), lower]).is_none());
        assert!(
            held(&pair(MARGIN, still, 0.0), [0.06, 0.0, 0.0], still).is_none(),
            "it is beside: {upper:?}"
        );
    }

    #[test]
    fn what_lies_on_one_finger_goes_to_the_middle_as_the_other_comes() {
        let [mut lower, _] = pair(1.5 * MARGIN, [0.0; 3], 0.0);
        let upper = finger(0.01 + 0.75 * MARGIN + 0.02, [0.0, -0.02, 0.0], 0.0);
        let lying = [0.01, 0.25 * MARGIN, 0.0];
        let (end, _) = held(&[lower.clone(), upper.clone()], lying, [0.0, -0.01, 0.0]).expect("it is held");
        assert!(end.x.y.abs() < 1e-15 && end.x.x == 0.01 && end.was_inside, "{end:?}");
        assert!((end.v - Vec3::new(0.0, -1.0, 0.0)).norm() < 1e-11, "{end:?}");
        // Twice the margin below gives twice the distance.
        lower.margin = 2.0 * MARGIN;
        let (end, _) = held(&[lower, upper], lying, [0.0; 3]).expect("it is held");
        assert!((end.x.y - 0.25 * MARGIN).abs() < 1e-15, "{end:?}");
    }

    #[test]
    fn what_flies_between_two_balls_stops_there_and_walls_at_right_angles_hold_nothing() {
        let ball = |x: f64| Shape::Sphere(Sphere { center: [x, 0.0, 0.0], radius: 0.1 });
        let way = |x: f64| {
            let pose = Pose { position: [x, 0.0, 0.0], turn: Pose::NO_TURN };
            Some(Way { keys: TIMES.map(|time| PoseKey { time, pose }).to_vec() })
        };
        let x = 0.1 + 0.5 * MARGIN;
        let balls = [collider(ball(-x), way(-x)), collider(ball(x), None)];
        let (end, _) = held(&balls, [0.0, 0.05, 0.0], [0.02, -5.0, 0.0]).expect("it is held");
        assert!(end.x.x.abs() < 1e-12 && end.x.y.abs() < 2e-6 && end.v.norm() == 0.0, "{end:?}");
        let planes = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]
            .map(|normal| collider(Shape::Plane(Plane { point: [0.0; 3], normal }), None));
        let mut planes = planes.to_vec();
        planes[0].way = way(0.0);
        assert!(held(&planes, [0.0; 3], [0.0; 3]).is_none());
    }

    #[test]
    fn surfaces_hold_from_120_degrees_between_their_normals_on() {
        for (degrees, holds) in [(119.0_f64, false), (121.0, true), (180.0, true)] {
            let (sin, cos) = (0.5 * degrees.to_radians()).sin_cos();
            let planes = [1.0, -1.0].map(|side: f64| {
                let normal = [side * sin, cos, 0.0];
                let point = normal.map(|c| -0.5 * MARGIN * c);
                let pose = Pose { position: point, turn: Pose::NO_TURN };
                let keys = TIMES.map(|time| PoseKey { time, pose }).to_vec();
                collider(Shape::Plane(Plane { point, normal }), Some(Way { keys }))
            });
            assert_eq!(held(&planes, [0.0; 3], [0.0; 3]).is_some(), holds, "{degrees} degrees");
        }
    }

    #[test]
    fn fingers_that_leave_a_table_hold_before_it() {
        let plane = Plane { point: [0.0, -0.75 * MARGIN, 0.0], normal: [0.0, 1.0, 0.0] };
        let table = collider(Shape::Plane(plane), None);
        let goes = [0.01, 0.1 * MARGIN, 0.0];
        let [lower, upper] = pair(1.5 * MARGIN, goes, 0.0);
        for colliders in [[table.clone(), lower.clone(), upper.clone()], [upper, lower, table]] {
            let (end, _) = held(&colliders, [0.0; 3], [0.0; 3]).expect("it is held");
            assert!((end.x - Vec3::from(goes)).norm() < 1e-15, "{end:?}");
        }
    }

    #[test]
    fn a_box_that_sweeps_over_a_floor_holds_nothing_before_its_side() {
        let floor = collider(Shape::Plane(Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] }), None);
        let sweeping = finger(0.01, [0.02, 0.0, 0.0], 0.0);
        assert!(held(&[floor, sweeping], [0.05 + MARGIN, MARGIN, 0.0], [0.0; 3]).is_none());
    }
}
