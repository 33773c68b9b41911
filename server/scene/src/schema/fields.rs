//! The fields of a scene: the root, colliders.

use nappe_sim::math::Precision;

use super::{
    Alternative, Kind, Presence, Range, Section,
    bodies::{BODY, FORCE, LENGTH, SPEED},
    field,
};

use Kind::{Choice, Number, Table, Tables, Text, Vector, Whole};
use Presence::{Chosen, Default, Required};

/// Bodies or colliders of one scene.
const MANY: usize = 1000;

/// The root of a scene.
pub(crate) static ROOT: Section = Section {
    name: "scene",
    about: "The whole file.",
    fields: &[
        field("version", Whole(1, 1), "", Required, "version of this format"),
        field("title", Text(200), "", Default("\"\""), "title, for people"),
        field("dt", Number(Range(1e-9, 1.0)), "s", Required, "time step of the scene's clock"),
        field(
            "steps",
            Whole(0, 1_000_000_000_000),
            "steps",
            Default("0"),
            "the simulation ends after so many steps; 0: never by itself",
        ),
        field("frame_interval", Whole(1, 1_000_000), "steps", Default("1"), "a frame every so many steps"),
        field(
            "precision",
            Choice(|| Precision::ALL.map(Precision::name).to_vec()),
            "",
            Default("\"f32\""),
            "precision of positions and velocities; sums are f64 whatever it is",
        ),
        field("gravity", Vector(Range(-1e4, 1e4)), "m/s^2", Default("[0.0, -9.81, 0.0]"), "gravity"),
        field(
            "wind",
            Vector(SPEED),
            "m/s",
            Default("[0.0, 0.0, 0.0]"),
            "velocity of the medium; bodies feel it through their drag",
        ),
        field(
            "hash_interval",
            Whole(1, 1_000_000),
            "frames",
            Default("10"),
            "a frame carries the hash of the state every so many frames",
        ),
        field("body", Tables(&BODY, MANY), "", Required, "bodies, at least one: `[[body]]`"),
        field("collider", Tables(&COLLIDER, MANY), "", Default("[]"), "colliders: `[[collider]]`"),
    ],
    alternatives: &[],
};

static COLLIDER: Section = Section {
    name: "collider",
    about: "Something that particles collide with: a plane or a sphere.",
    fields: &[
        field("name", Text(64), "", Required, "name, unique among colliders"),
        field("plane", Table(&PLANE), "", Chosen, "the half-space behind a plane"),
        field("sphere", Table(&SPHERE), "", Chosen, "a ball"),
        field("velocity", Vector(SPEED), "m/s", Default("[0.0, 0.0, 0.0]"), "constant velocity"),
        field("friction", Number(Range(0.0, 100.0)), "", Default("0.0"), "Coulomb's friction coefficient"),
        field(
            "restitution",
            Number(Range(0.0, 1.0)),
            "",
            Default("0.0"),
            "share of the normal approach speed that comes back",
        ),
        field(
            "margin",
            Number(Range(0.0, 1e3)),
            "m",
            Default("0.0"),
            "distance from the surface at which a particle touches: half the cloth's thickness",
        ),
    ],
    alternatives: &[
        Alternative {
            key: "plane",
            needs: &["name"],
            may: &["velocity", "friction", "restitution", "margin"],
        },
        Alternative {
            key: "sphere",
            needs: &["name"],
            may: &["velocity", "friction", "restitution", "margin"],
        },
    ],
};

static PLANE: Section = Section {
    name: "collider.plane",
    about: "A plane.",
    fields: &[
        field("point", Vector(LENGTH), "m", Required, "a point of the plane at time 0"),
        field(
            "normal",
            Vector(FORCE),
            "",
            Required,
            "direction towards the particles, not zero; its length does not matter",
        ),
    ],
    alternatives: &[],
};

static SPHERE: Section = Section {
    name: "collider.sphere",
    about: "A ball.",
    fields: &[
        field("center", Vector(LENGTH), "m", Required, "centre at time 0"),
        field("radius", Number(Range(1e-6, 1e6)), "m", Required, "radius"),
    ],
    alternatives: &[],
};
