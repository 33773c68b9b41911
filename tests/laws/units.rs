//! The scene in other units: lengths, times and masses times powers of two. Binary numbers have the same bits but for their exponents.
//!
//! Energies are times an even power, since solvers take roots of them.
//!
//! Laws of elements are left out, whose numbers at rest nobody outside sees, and vertex block descent of what pins hold, which has a
//! constant with a unit. All of these are in docs/laws/steps.md.

use nappe_sim::{
    cloth::Minimizer,
    collide::{
        Collider, Shape,
        shape::{Capsule, Cuboid, Cylinder, HalfPipe, MeshSolid, Plane, Sphere},
    },
    snow::{Blend, Transfer},
    time_step::TimeStep,
    world::{BodySetup, Change},
};
use nappe_tests::at_random::{Run, World};

use crate::law::{Law, Verdict, WORK, alike};

pub(crate) const LAW: Law = Law { name: "units", judge };

/// Exponents of two of a length, a time and a mass.
#[derive(Clone, Copy)]
struct Units([i32; 3]);

impl Units {
    /// What a number of these dimensions is times.
    fn of(&self, dimensions: [i32; 3]) -> f64 {
        2.0_f64.powi((0..3).map(|i| self.0[i] * dimensions[i]).sum())
    }

    fn length(&self) -> f64 {
        self.of([1, 0, 0])
    }

    fn time(&self) -> f64 {
        self.of([0, 1, 0])
    }

    fn speed(&self) -> f64 {
        self.of([1, -1, 0])
    }

    fn acceleration(&self) -> f64 {
        self.of([1, -2, 0])
    }

    fn force(&self) -> f64 {
        self.of([1, -2, 1])
    }
}

fn judge(world: &World) -> Result<Verdict, String> {
    // What pins hold may leave over 0.01 m/s² of its mass where particles move one by one.
    let has_unit = |body: &BodySetup| {
        let has_sweeps = matches!(body.settings.minimizer, Minimizer::VertexBlockDescent { .. });
        let has_pins = !body.network.pins.is_empty() || body.network.masses.contains(&0.0);
        !body.network.elements.is_empty() || has_sweeps && has_pins
    };
    if world.setup.bodies.iter().any(has_unit) {
        return Ok(Verdict::Silent);
    }
    let (world, first) = &world.run_within(WORK)?;
    for units in [Units([3, 0, 0]), Units([0, -2, 0]), Units([0, 0, 4]), Units([-4, 1, -2])] {
        let scaled = in_units(world, units);
        let mut expected: Run = first.clone();
        for frame in &mut expected.frames {
            frame.x.iter_mut().for_each(|x| *x = x.map(|c| c * units.length()));
        }
        if let Verdict::Broken(why) = alike(&expected, &scaled.run()?, |_| [0.0; 3], |_| 0.0) {
            return Ok(Verdict::Broken(format!("length, time and mass times 2^{:?}: {why}", units.0)));
        }
    }
    Ok(Verdict::Holds)
}

fn scale(vector: &mut [f64; 3], by: f64) {
    *vector = vector.map(|c| c * by);
}

fn scale_time_step(step: &mut TimeStep, units: Units) {
    if let TimeStep::Fixed(dt) | TimeStep::Unchecked(dt) = step {
        *dt *= units.time();
    }
}

fn in_units(world: &World, units: Units) -> World {
    let mut scaled = world.clone();
    let setup = &mut scaled.setup;
    setup.dt *= units.time();
    scale(&mut setup.gravity, units.acceleration());
    scale(&mut setup.wind, units.speed());
    for (time, v) in &mut setup.wind_at {
        *time *= units.time();
        scale(v, units.speed());
    }
    for body in &mut setup.bodies {
        let network = &mut body.network;
        network.x.iter_mut().for_each(|x| scale(x, units.length()));
        network.v.iter_mut().for_each(|v| scale(v, units.speed()));
        network.masses.iter_mut().for_each(|m| *m *= units.of([0, 0, 1]));
        for spring in &mut network.springs {
            spring.rest_length *= units.length();
            spring.law.stiffness *= units.of([0, -2, 1]);
            spring.law.damping *= units.of([0, -1, 1]);
        }
        network.drag *= units.of([0, -1, 1]);
        if let Some(air) = &mut network.air {
            air.density *= units.of([-3, 0, 1]);
        }
        let settings = &mut body.settings;
        scale_time_step(&mut settings.time_step, units);
        if let Minimizer::Newton(newton) = &mut settings.minimizer {
            newton.tolerance *= units.acceleration();
        }
        if let Some(tolerance) = &mut settings.tolerance {
            *tolerance *= units.length();
        }
        for force in &mut body.forces {
            scale(&mut force.force, units.force());
            force.from *= units.time();
            force.until *= units.time();
        }
    }
    if let Some(snow) = &mut setup.snow {
        snow.settings.cell *= units.length();
        snow.settings.drag /= units.time();
        scale_time_step(&mut snow.settings.time_step, units);
        if let Transfer::PicFlip(Blend::TimeConstant(time)) = &mut snow.settings.transfer {
            *time *= units.time();
        }
        for object in &mut snow.objects {
            object.x.iter_mut().for_each(|x| scale(x, units.length()));
            object.v.iter_mut().for_each(|v| scale(v, units.speed()));
            scale(&mut object.angular_velocity, units.of([0, -1, 0]));
            object.mass.iter_mut().for_each(|m| *m *= units.of([0, 0, 1]));
            object.volume.iter_mut().for_each(|v| *v *= units.of([3, 0, 0]));
            object.material.young *= units.of([-1, -2, 1]);
        }
    }
    setup.colliders.iter_mut().for_each(|collider| scale_collider(collider, units));
    for change in &mut scaled.changes {
        if let Change::Pin { target, duration, .. } = change {
            scale(target, units.length());
            *duration *= units.time();
        }
    }
    scaled
}

fn scale_collider(collider: &mut Collider, units: Units) {
    let length = units.length();
    let of = |v: [f64; 3]| v.map(|c| c * length);
    scale(&mut collider.velocity, units.speed());
    collider.margin *= length;
    collider.recovery *= units.speed();
    collider.shape = match collider.shape.clone() {
        Shape::Plane(it) => Shape::Plane(Plane { point: of(it.point), ..it }),
        Shape::Sphere(it) => Shape::Sphere(Sphere { center: of(it.center), radius: it.radius * length }),
        Shape::Capsule(it) => {
            Shape::Capsule(Capsule { start: of(it.start), end: of(it.end), radius: it.radius * length })
        }
        Shape::Cylinder(it) => {
            Shape::Cylinder(Cylinder { start: of(it.start), end: of(it.end), radius: it.radius * length })
        }
        Shape::Box(it) => Shape::Box(Cuboid { center: of(it.center), half_extent: of(it.half_extent), ..it }),
        Shape::HalfPipe(it) => {
            Shape::HalfPipe(HalfPipe { point: of(it.point), radius: it.radius * length, ..it })
        }
        Shape::Mesh(it) => {
            let points = it.points().iter().map(|point| of(*point)).collect();
            let triangles = it.triangles().to_vec();
            Shape::Mesh(MeshSolid::new(points, triangles).expect("a closed surface as before"))
        }
    };
    for key in collider.way.iter_mut().flat_map(|way| &mut way.keys) {
        key.time *= units.time();
        key.pose.position = of(key.pose.position);
    }
}
