//! The fields of a scene: the root.

use nappe_sim::math::Precision;

use super::{
    body::{BODY, SPEED},
    collider::COLLIDER,
    snow::SNOW,
};
use crate::schema::{Kind, Presence, Range, Section, field};

use Kind::{Choice, Number, Table, Tables, Text, Vector, Whole};
use Presence::{Absent, Default, Required};

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
        field(
            "body",
            Tables(&BODY, MANY),
            "",
            Default("[]"),
            "bodies: `[[body]]`; a scene has a body or snow at least",
        ),
        field(
            "snow",
            Table(&SNOW),
            "",
            Absent("no snow"),
            "snow: `[snow]` with `[[snow.object]]`; cloth and snow pass through each other, as nothing couples them yet",
        ),
        field("collider", Tables(&COLLIDER, MANY), "", Default("[]"), "colliders: `[[collider]]`"),
    ],
    alternatives: &[],
};
