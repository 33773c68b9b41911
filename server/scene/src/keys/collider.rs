//! The fields of a collider and of its shapes.

use nappe_sim::collide::Contact;

use super::body::{FORCE, LENGTH, ROTATE, SPEED};
use crate::schema::{Alternative, Kind, Presence, Range, Section, field};

use Kind::{Choice, Number, Table, Text, Vector};
use Presence::{Absent, Chosen, Default, Required};

/// A radius or an edge (m).
const SIZE: Range = Range(1e-6, 1e6);

/// What goes with each shape.
const COMMON: &[&str] = &["velocity", "friction", "restitution", "margin", "contact"];

const fn shape(key: &'static str) -> Alternative {
    Alternative { key, needs: &["name"], may: COMMON }
}

#[rustfmt::skip] // one line a field
pub(super) static COLLIDER: Section = Section {
    name: "collider",
    about: "Something that particles collide with. Distances from each shape are exact.",
    fields: &[
        field("name", Text(64), "", Required, "name, unique among colliders"),
        field("plane", Table(&PLANE), "", Chosen, "the half-space behind a plane"),
        field("sphere", Table(&SPHERE), "", Chosen, "a ball"),
        field("capsule", Table(&CAPSULE), "", Chosen, "all points within a distance of a segment"),
        field("box", Table(&BOX), "", Chosen, "a box"),
        field("cylinder", Table(&CYLINDER), "", Chosen, "a solid cylinder with flat ends"),
        field("half_pipe", Table(&HALF_PIPE), "", Chosen, "the ground below a trough"),
        field("velocity", Vector(SPEED), "m/s", Default("[0.0, 0.0, 0.0]"), "constant velocity"),
        field("friction", Number(Range(0.0, 100.0)), "", Default("0.0"), "Coulomb's friction coefficient"),
        field("restitution", Number(Range(0.0, 1.0)), "", Default("0.0"), "share of the normal approach speed that comes back to a particle of cloth; snow takes 0"),
        field("margin", Number(Range(0.0, 1e3)), "m", Default("0.0"), "distance from the surface at which a particle touches: half the cloth's thickness"),
        field("contact", Choice(|| Contact::ALL.map(Contact::name).to_vec()), "", Default("\"separating\""), "how snow meets it: sticky (it moves with the surface), slip (it neither enters nor leaves, and slides with friction), separating (it may leave, and slides with friction while pressed on); cloth always separates"),
    ],
    alternatives: &[shape("plane"), shape("sphere"), shape("capsule"), shape("box"), shape("cylinder"), shape("half_pipe")],
};

#[rustfmt::skip] // one line a field
static PLANE: Section = Section {
    name: "collider.plane",
    about: "A plane.",
    fields: &[
        field("point", Vector(LENGTH), "m", Required, "a point of the plane at time 0"),
        field("normal", Vector(FORCE), "", Required, "direction towards the particles, not zero; its length does not matter"),
    ],
    alternatives: &[],
};

#[rustfmt::skip] // one line a field
static SPHERE: Section = Section {
    name: "collider.sphere",
    about: "A ball.",
    fields: &[
        field("center", Vector(LENGTH), "m", Required, "centre at time 0"),
        field("radius", Number(SIZE), "m", Required, "radius"),
    ],
    alternatives: &[],
};

#[rustfmt::skip] // one line a field
static CAPSULE: Section = Section {
    name: "collider.capsule",
    about: "A cylinder with round ends: all points within `radius` of a segment.",
    fields: &[
        field("start", Vector(LENGTH), "m", Required, "one end of the segment at time 0"),
        field("end", Vector(LENGTH), "m", Required, "the other end, another point"),
        field("radius", Number(SIZE), "m", Required, "radius"),
    ],
    alternatives: &[],
};

#[rustfmt::skip] // one line a field
static BOX: Section = Section {
    name: "collider.box",
    about: "A box.",
    fields: &[
        field("center", Vector(LENGTH), "m", Required, "centre at time 0"),
        field("size", Vector(SIZE), "m", Required, "edges along its own axes"),
        field("rotate", Table(&ROTATE), "", Absent("edges along the axes"), "rotation about its centre"),
    ],
    alternatives: &[],
};

#[rustfmt::skip] // one line a field
static CYLINDER: Section = Section {
    name: "collider.cylinder",
    about: "A solid cylinder with flat ends.",
    fields: &[
        field("start", Vector(LENGTH), "m", Required, "centre of one end at time 0"),
        field("end", Vector(LENGTH), "m", Required, "centre of the other end, another point"),
        field("radius", Number(SIZE), "m", Required, "radius"),
    ],
    alternatives: &[],
};

#[rustfmt::skip] // one line a field
static HALF_PIPE: Section = Section {
    name: "collider.half_pipe",
    about: "The ground below a trough: all that is outside of a tube and below its axis. It has no ends.",
    fields: &[
        field("point", Vector(LENGTH), "m", Required, "a point of the axis at time 0"),
        field("axis", Vector(FORCE), "", Required, "direction of the axis, not zero; its length does not matter"),
        field("up", Vector(FORCE), "", Required, "direction of the opening, not along the axis; the part of it across the axis is taken"),
        field("radius", Number(SIZE), "m", Required, "inner radius"),
    ],
    alternatives: &[],
};
