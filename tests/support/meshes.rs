//! Closed surfaces of triangles to test with, each turned outwards: boxes, balls, rings, trays with a pit.
//!
//! Distances here are those of all triangles one after the other, with the sign of the winding number: slow, and apart from
//! what the program does.

use std::{collections::BTreeMap, f64::consts::TAU};

use nappe_sim::{
    collide::{Collider, Contact, Shape, StartInside, shape::MeshSolid},
    math::array::{cross, dot, length, minus},
};

/// A closed surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Points (m).
    pub points: Vec<[f64; 3]>,
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// That of a solid.
    pub fn of(solid: &MeshSolid) -> Self {
        Self { points: solid.points().to_vec(), triangles: solid.triangles().to_vec() }
    }

    /// A collider that stands, with a coefficient of friction and a margin (m).
    pub fn collider(&self, friction: f64, margin: f64) -> Collider {
        Collider {
            name: "solid".to_owned(),
            shape: self.shape(),
            velocity: [0.0; 3],
            way: None,
            friction,
            restitution: 0.0,
            margin,
            contact: Contact::default(),
            recovery: Collider::RECOVERY,
            on_start_inside: StartInside::Warn,
        }
    }

    /// As a shape of a collider, which must be accepted.
    pub fn shape(&self) -> Shape {
        let solid = MeshSolid::new(self.points.clone(), self.triangles.clone());
        Shape::Mesh(solid.unwrap_or_else(|error| panic!("the surface was refused: {error}")))
    }

    /// The same with each point elsewhere.
    #[must_use]
    pub fn mapped(mut self, place: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        self.points.iter_mut().for_each(|point| *point = place(*point));
        self
    }

    /// Several as one, each a part with points of its own.
    #[must_use]
    pub fn joined(parts: &[Self]) -> Self {
        let mut whole = Self { points: Vec::new(), triangles: Vec::new() };
        for part in parts {
            let first = whole.points.len() as u32;
            whole.triangles.extend(part.triangles.iter().map(|corners| corners.map(|corner| corner + first)));
            whole.points.extend(&part.points);
        }
        whole
    }

    /// The same turned inside out.
    #[must_use]
    pub fn inside_out(mut self) -> Self {
        for corners in &mut self.triangles {
            corners.swap(1, 2);
        }
        self
    }

    /// Corners of each triangle (m).
    pub fn corners(&self) -> impl Iterator<Item = [[f64; 3]; 3]> + '_ {
        self.triangles.iter().map(|triangle| triangle.map(|i| self.points[i as usize]))
    }

    /// The volume inside (m³), below 0 where it is turned inwards.
    pub fn volume(&self) -> f64 {
        self.corners().map(|[a, b, c]| dot(a, cross(b, c))).sum::<f64>() / 6.0
    }

    /// Sides of triangles that run along an edge more often one way than the other, or more than once each way.
    pub fn open_sides(&self) -> Vec<[u32; 2]> {
        let mut runs: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        for [a, b, c] in &self.triangles {
            for side in [[*a, *b], [*b, *c], [*c, *a]] {
                *runs.entry(side).or_default() += 1;
            }
        }
        let is_open = |([a, b], count): &([u32; 2], u32)| *count != 1 || runs.get(&[*b, *a]) != Some(&1);
        runs.iter().map(|(side, count)| (*side, *count)).filter(is_open).map(|(side, _)| side).collect()
    }

    /// Signed distance (m), negative inside.
    pub fn distance(&self, point: [f64; 3]) -> f64 {
        let nearest = self.corners().map(|corners| to_triangle(point, corners)).fold(f64::INFINITY, f64::min);
        if self.winding(point) > 0.5 { -nearest } else { nearest }
    }

    /// How often the surface goes round a point: 1 inside, 0 outside, as nearly as angles are exact (Van Oosterom and
    /// Strackee 1983).
    pub fn winding(&self, point: [f64; 3]) -> f64 {
        let angle = |corners: [[f64; 3]; 3]| {
            let [a, b, c] = corners.map(|corner| minus(corner, point));
            let [x, y, z] = [a, b, c].map(length);
            let below = x * y * z + dot(a, b) * z + dot(b, c) * x + dot(c, a) * y;
            2.0 * dot(a, cross(b, c)).atan2(below)
        };
        self.corners().map(angle).sum::<f64>() / (2.0 * TAU)
    }

    /// Least distance (m) of a point from the planes of the triangles, all of which it must be behind.
    pub fn least_depth_of(&self, point: [f64; 3]) -> f64 {
        let depth = |[a, b, c]: [[f64; 3]; 3]| {
            let normal = cross(minus(b, a), minus(c, a));
            dot(minus(a, point), normal) / length(normal)
        };
        self.corners().map(depth).fold(f64::INFINITY, f64::min)
    }
}

/// Distance (m) of a point from a triangle.
pub fn to_triangle(point: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> f64 {
    let normal = cross(minus(b, a), minus(c, a));
    let is_over = |from: [f64; 3], to: [f64; 3]| {
        dot(cross(minus(to, from), minus(point, from)), normal) >= 0.0 && dot(normal, normal) > 0.0
    };
    if is_over(a, b) && is_over(b, c) && is_over(c, a) {
        return (dot(minus(point, a), normal) / length(normal)).abs();
    }
    let to_side = |from: [f64; 3], to: [f64; 3]| {
        let (way, out) = (minus(to, from), minus(point, from));
        let square = dot(way, way);
        let share = if square > 0.0 { (dot(out, way) / square).clamp(0.0, 1.0) } else { 0.0 };
        length(minus(out, way.map(|w| w * share)))
    };
    to_side(a, b).min(to_side(b, c)).min(to_side(c, a))
}

/// A box of 12 triangles along the axes.
pub fn box12(center: [f64; 3], half: [f64; 3]) -> Surface {
    let planes = [0, 1, 2].map(|a| vec![center[a] - half[a], center[a] + half[a]]);
    cells(&planes, |_| true)
}

/// Axes turned about z, and then about x (rad); right-handed, one a row.
pub fn axes(about_z: f64, about_x: f64) -> [[f64; 3]; 3] {
    let ([s, c], [t, d]) = ([about_z.sin(), about_z.cos()], [about_x.sin(), about_x.cos()]);
    [[c, s * d, s * t], [-s, c * d, c * t], [0.0, -t, d]]
}

/// A box of 12 triangles whose own axes are the rows of `axes`.
pub fn turned_box12(center: [f64; 3], half: [f64; 3], axes: [[f64; 3]; 3]) -> Surface {
    box12([0.0; 3], half)
        .mapped(|p| [0, 1, 2].map(|c| center[c] + p[0] * axes[0][c] + p[1] * axes[1][c] + p[2] * axes[2][c]))
}

/// A ball of 20 triangles, each divided into four as often as `levels` says; its points lie on the sphere.
pub fn icosphere(center: [f64; 3], radius: f64, levels: u32) -> Surface {
    let t = f64::midpoint(1.0, 5.0_f64.sqrt());
    let mut points = Vec::new();
    for (s, t) in [(1.0, t), (-1.0, t), (1.0, -t), (-1.0, -t)] {
        points.extend([[s, t, 0.0], [0.0, s, t], [t, 0.0, s]]);
    }
    // Three corners at the distance of an edge, 2, from each other.
    let near = |a: u32, b: u32| length(minus(points[a as usize], points[b as usize])) < 2.1;
    let mut triangles = Vec::new();
    for a in 0..12_u32 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let [p, q, r] = [a, b, c].map(|i| points[i as usize]);
                    triangles.push(if dot(p, cross(q, r)) > 0.0 { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }

    for _ in 0..levels {
        let mut between: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *between.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                let [p, q]: [[f64; 3]; 2] = [a, b].map(|i| points[i as usize]);
                let sum = [0, 1, 2].map(|c| p[c] + q[c]);
                let size = length(p) / length(sum);
                points.push(sum.map(|c| c * size));
                points.len() as u32 - 1
            })
        };
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let [d, e, f] = [middle(a, b), middle(b, c), middle(c, a)];
            finer.extend([[a, d, f], [b, e, d], [c, f, e], [d, e, f]]);
        }
        triangles = finer;
    }
    let place = |p: [f64; 3]| {
        let size = radius / length(p);
        [0, 1, 2].map(|c| center[c] + size * p[c])
    };
    Surface { points, triangles }.mapped(place)
}

/// A ring about the y axis through `center`: `radius` (m) to the middle of the tube, which has the radius `tube` (m); so
/// many quads round the axis and round the tube, of two triangles each.
pub fn torus(center: [f64; 3], radius: f64, tube: f64, [around, across]: [u32; 2]) -> Surface {
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..around {
        for j in 0..across {
            let [u, v] = [TAU * f64::from(i) / f64::from(around), TAU * f64::from(j) / f64::from(across)];
            let out = radius + tube * v.cos();
            let place = [out * u.cos(), tube * v.sin(), out * u.sin()];
            points.push([0, 1, 2].map(|c| center[c] + place[c]));
            let at = |i: u32, j: u32| (i % around) * across + j % across;
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Surface { points, triangles }
}

/// A capsule: all points within `radius` (m) of the segment from `start` to `end` (m), whose surface is `around` flat strips, each of
/// `rings` pieces from either end of its straight part to the pole there. It lies within the capsule; [`capsule_facets`] says how deep.
pub fn capsule([start, end]: [[f64; 3]; 2], radius: f64, [around, rings]: [u32; 2]) -> Surface {
    let along = minus(end, start);
    let size = length(along);
    let axis = along.map(|c| c / size);
    let other = if axis[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let across = cross(other, axis);
    let first = across.map(|c| c / length(across));
    let second = cross(axis, first);
    // At a height (m) along the axis, so far (m) from it.
    let place = |height: f64, out: f64, angle: f64| {
        let (sin, cos) = angle.sin_cos();
        [0, 1, 2].map(|c| start[c] + height * axis[c] + out * (cos * first[c] + sin * second[c]))
    };

    let mut points = vec![place(-radius, 0.0, 0.0)];
    for ring in 0..2 * rings {
        let (height, step) = if ring < rings { (0.0, ring + 1) } else { (size, ring) };
        let slope = 0.25 * TAU * (f64::from(step) / f64::from(rings) - 1.0);
        let (sin, cos) = slope.sin_cos();
        points.extend(
            (0..around)
                .map(|j| place(height + radius * sin, radius * cos, TAU * f64::from(j) / f64::from(around))),
        );
    }
    points.push(place(size + radius, 0.0, 0.0));

    let at = |ring: u32, j: u32| 1 + ring * around + j % around;
    let (last, pole) = (2 * rings - 1, points.len() as u32 - 1);
    let mut triangles = Vec::new();
    for j in 0..around {
        triangles.extend([[0, at(0, j + 1), at(0, j)], [pole, at(last, j), at(last, j + 1)]]);
        for ring in 0..last {
            let [a, b, c, d] = [at(ring, j), at(ring, j + 1), at(ring + 1, j + 1), at(ring + 1, j)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Surface { points, triangles }
}

/// How deep (m) the facets of a [`capsule`] are at most: so much larger is its radius than that of a capsule within them.
pub fn capsule_facets(radius: f64, [around, rings]: [u32; 2]) -> f64 {
    let [across, along] = [0.5 * TAU / f64::from(around), 0.125 * TAU / f64::from(rings)];
    radius * (1.0 - across.cos() * along.cos())
}

/// Half of the width (m) of a tray's floor.
pub const TRAY_HALF: f64 = 0.3;

/// Depth (m) of a tray's pit.
pub const TRAY_DEPTH: f64 = 0.15;

/// A block with a pit in its top, whose square floor has its middle at the origin. Its walls along x stand at so many degrees
/// to the floor, measured in the air of the pit: below 90 they lean over the floor. Those along z are upright.
pub fn tray(degrees: f64) -> Surface {
    let (outer, inner) = (0.8, TRAY_HALF);
    let x = vec![-outer, -inner, inner, outer];
    let solid = |cell: [usize; 3]| cell != [1, 1, 1];
    let lean = TRAY_DEPTH / degrees.to_radians().tan();
    cells(&[x.clone(), vec![-0.2, 0.0, TRAY_DEPTH], x], solid).mapped(|[x, y, z]| {
        let is_rim = y == TRAY_DEPTH && x.abs() == inner && z.abs() == inner;
        [if is_rim { x - lean * x.signum() } else { x }, y, z]
    })
}

/// The surface of those cells between planes across the three axes that `is_solid` names: two triangles for each side
/// that has no other of them beside it.
fn cells(planes: &[Vec<f64>; 3], is_solid: impl Fn([usize; 3]) -> bool) -> Surface {
    let mut surface = Surface { points: Vec::new(), triangles: Vec::new() };
    let mut numbers: BTreeMap<[usize; 3], u32> = BTreeMap::new();
    let counts = [0, 1, 2].map(|a| planes[a].len() - 1);
    for i in 0..counts[0] * counts[1] * counts[2] {
        let cell = [i % counts[0], i / counts[0] % counts[1], i / counts[0] / counts[1]];
        for (axis, side) in (0..6).map(|k| (k / 2, k % 2)).filter(|_| is_solid(cell)) {
            let mut beside = cell;
            beside[axis] = (cell[axis] + 2 * side).wrapping_sub(1);
            if beside[axis] < counts[axis] && is_solid(beside) {
                continue;
            }
            let [b, c] = [(axis + 1) % 3, (axis + 2) % 3];
            let mut corner = |[s, t]: [usize; 2]| {
                let mut at = cell;
                at[axis] += side;
                at[b] += s;
                at[c] += t;
                *numbers.entry(at).or_insert_with(|| {
                    surface.points.push([0, 1, 2].map(|a| planes[a][at[a]]));
                    surface.points.len() as u32 - 1
                })
            };
            let mut quad = [[0, 0], [1, 0], [1, 1], [0, 1]].map(&mut corner);
            if side == 0 {
                quad.reverse();
            }
            let [p, q, r, s] = quad;
            surface.triangles.extend([[p, q, r], [p, r, s]]);
        }
    }
    surface
}
