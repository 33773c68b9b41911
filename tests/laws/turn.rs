//! The scene with its axes exchanged, and in a mirror: all vectors are those of the first one, changed alike.
//!
//! Vertex block descent is left out: it moves particles in an order that follows from where they are, and ends before that is forgotten. Solves of
//! a fixed number of iterations are made to end at rounding, for the same reason. Steps of snow beside colliders on a way are bounded by the blocks of its
//! grid, which begin at 0 along each axis.

use nappe_sim::{
    cloth::Minimizer,
    collide::{
        Collider, Shape,
        shape::{Capsule, Cuboid, Cylinder, HalfPipe, MeshSolid, Plane, Sphere},
    },
    linalg::Stop,
    world::Change,
};
use nappe_tests::at_random::{Run, World};

use crate::{
    boost::tight,
    law::{Law, Verdict, WORK, alike, shaken, spread},
};

pub(crate) const LAW: Law = Law { name: "turn", judge };

const ALLOWED: f64 = 1e-9;
const SPREADS: f64 = 1e4;

/// Which axis each axis becomes, and with which sign.
#[derive(Clone, Copy)]
struct Axes {
    from: [usize; 3],
    signs: [f64; 3],
}

impl Axes {
    const TURNED: Self = Self { from: [1, 2, 0], signs: [1.0, 1.0, 1.0] };
    const MIRRORED: Self = Self { from: [0, 1, 2], signs: [-1.0, 1.0, 1.0] };

    fn of(&self, v: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|c| self.signs[c] * v[self.from[c]])
    }

    fn is_mirror(&self) -> bool {
        self.signs.iter().product::<f64>() < 0.0
    }

    /// Of what says how something turns.
    fn of_turn(&self, v: [f64; 3]) -> [f64; 3] {
        self.of(v).map(|c| if self.is_mirror() { -c } else { c })
    }
}

fn judge(world: &World) -> Result<Verdict, String> {
    let has_sweeps = |body: &nappe_sim::world::BodySetup| {
        matches!(body.settings.minimizer, Minimizer::VertexBlockDescent { .. })
            && body.settings.integrator.is_implicit()
    };
    let has_way = world.setup.colliders.iter().any(|collider| collider.way.is_some());
    if world.setup.bodies.iter().any(has_sweeps) || world.setup.snow.is_some() && has_way {
        return Ok(Verdict::Silent);
    }
    let mut first = tight(world);
    for body in &mut first.setup.bodies {
        body.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 4000 };
    }
    let (first, run) = first.run_within(WORK)?;
    let rounding = 1e-15 * (1.0 + world.size() / world.setup.dt);
    let spread = spread(&run, &shaken(&first, rounding).run()?);
    let allowed = |step: usize| {
        ALLOWED * world.size() + SPREADS * spread.get(step).or(spread.last()).copied().unwrap_or_default()
    };
    for (name, axes) in [("exchanged", Axes::TURNED), ("in a mirror", Axes::MIRRORED)] {
        let mut expected: Run = run.clone();
        for frame in &mut expected.frames {
            frame.x.iter_mut().for_each(|x| *x = axes.of(*x));
        }
        if let Verdict::Broken(why) = alike(&expected, &turned(&first, axes).run()?, |_| [0.0; 3], allowed) {
            return Ok(Verdict::Broken(format!("{name}: {why}")));
        }
    }
    Ok(Verdict::Holds)
}

fn turned(world: &World, axes: Axes) -> World {
    let mut turned = world.clone();
    let each = |v: &mut [f64; 3]| *v = axes.of(*v);
    let setup = &mut turned.setup;
    each(&mut setup.gravity);
    each(&mut setup.wind);
    setup.wind_at.iter_mut().for_each(|(_, v)| each(v));
    for body in &mut setup.bodies {
        body.network.x.iter_mut().chain(&mut body.network.v).for_each(each);
        body.forces.iter_mut().for_each(|force| each(&mut force.force));
    }
    for object in setup.snow.iter_mut().flat_map(|snow| &mut snow.objects) {
        object.x.iter_mut().chain(&mut object.v).for_each(each);
        object.angular_velocity = axes.of_turn(object.angular_velocity);
    }
    setup.colliders.iter_mut().for_each(|collider| turn_collider(collider, axes));
    for change in &mut turned.changes {
        if let Change::Pin { target, .. } = change {
            each(target);
        }
    }
    turned
}

fn turn_collider(collider: &mut Collider, axes: Axes) {
    let of = |v: [f64; 3]| axes.of(v);
    collider.velocity = of(collider.velocity);
    collider.shape = match collider.shape.clone() {
        Shape::Plane(it) => Shape::Plane(Plane { point: of(it.point), normal: of(it.normal) }),
        Shape::Sphere(it) => Shape::Sphere(Sphere { center: of(it.center), ..it }),
        Shape::Capsule(it) => Shape::Capsule(Capsule { start: of(it.start), end: of(it.end), ..it }),
        Shape::Cylinder(it) => Shape::Cylinder(Cylinder { start: of(it.start), end: of(it.end), ..it }),
        Shape::Box(it) => {
            let mut turned = it.axes.map(of);
            // A box has right-handed axes, and is its own mirror image.
            if axes.is_mirror() {
                turned[0] = turned[0].map(|c| -c);
            }
            Shape::Box(Cuboid { center: of(it.center), axes: turned, ..it })
        }
        Shape::HalfPipe(it) => {
            Shape::HalfPipe(HalfPipe { point: of(it.point), axis: of(it.axis), up: of(it.up), ..it })
        }
        Shape::Mesh(it) => {
            let points = it.points().iter().map(|point| of(*point)).collect();
            let mut triangles = it.triangles().to_vec();
            if axes.is_mirror() {
                for corners in &mut triangles {
                    corners.swap(1, 2);
                }
            }
            Shape::Mesh(MeshSolid::new(points, triangles).expect("a closed surface as before"))
        }
    };
    for key in collider.way.iter_mut().flat_map(|way| &mut way.keys) {
        key.pose.position = of(key.pose.position);
        let [x, y, z, w] = key.pose.turn;
        let [x, y, z] = axes.of_turn([x, y, z]);
        key.pose.turn = [x, y, z, w];
    }
}
