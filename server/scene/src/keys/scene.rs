//! The keys of a scene: the root.

use nappe_sim::{
    cloth::{SurfaceCheck, SurfaceSettings},
    math::Precision,
    world::allowed,
};

use super::{body::BODY, figure::FIGURE, snow::SNOW};
use crate::{
    collider::COLLIDER,
    schema::{Alternatives, Presence, Range, SPEED, Section, ValueKind, key},
};

use Presence::{Absent, Default, Required};
use ValueKind::{Choice, Flag, Number, Table, Tables, Text, Vector, Whole};

/// Bodies, figures or colliders of one scene.
const MANY: usize = 1000;

#[rustfmt::skip] // one line per key
static WIND_AT: Section = Section {
    name: "wind_at",
    about: "A key of the wind over time. The wind changes linearly between keys, and is constant before the first and after the last. A step takes the wind at its middle.",
    keys: &[
        key("time", Number(Range::of(allowed::DURATION)), "s", Required, "when, after the key before it"),
        key("velocity", Vector(SPEED), "m/s", Required, "velocity of the medium then"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static CONTACT: Section = Section {
    name: "contact",
    about: "How surfaces of cloth meet each other. The distance that they keep is the `thickness` of a body.",
    keys: &[
        key("friction", Number(Range(0.0, 100.0)), "", Default("0.3"), "Coulomb's friction coefficient between surfaces of bodies with a thickness"),
        key("recovery", Number(Range(0.0, SurfaceSettings::MOST_RECOVERY)), "m/s", Default("0.1"), "how fast surfaces that are nearer to each other than their thickness are moved apart"),
        key("surface", Choice(|| SurfaceCheck::ALL.map(SurfaceCheck::name).to_vec()), "", Default("\"off\""), "whether edges that cross triangles are counted at the end of each sub-step, exactly, with and without a thickness: off, or count, whose number stands in the diagnostics"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static REST: Section = Section {
    name: "rest",
    about: "When cloth counts as calm. A piece, which is what springs and elements hold together, is watched over windows of eight steps; the diagnostics tell how much is calm. A body sleeps while all of it is calm, and all bodies with a thickness while all of them are.",
    keys: &[
        key("error", Number(Range(1e-9, 1.0)), "m", Required, "how far off positions may become if what is calm counts as standing still; at least 200 roundings of the largest coordinate, which are 1.2e-5 m at 1 m in f32"),
        key("within", Number(Range(1e-6, 1e9)), "s", Absent("as long as the scene lasts"), "the time over which that error may add up; needed where `steps` is 0"),
        key("sleep", Flag, "", Default("true"), "whether what is calm sleeps: it is stepped seldom until something disturbs it, by `implicit_euler` with `one_step` or `auto` alone; false: it is watched, and no result depends on it"),
    ],
    alternatives: Alternatives::None,
};

/// The root of a scene.
#[rustfmt::skip] // one line per key
pub(crate) static ROOT: Section = Section {
    name: "scene",
    about: "The whole file.",
    keys: &[
        key("version", Whole(1, 1), "", Required, "version of this format"),
        key("title", Text(200), "", Default("\"\""), "title, for people"),
        key("dt", Number(Range(1e-9, 1.0)), "s", Required, "time step of the scene's clock"),
        key("steps", Whole(0, 1_000_000_000_000), "steps", Default("0"), "steps after which the simulation ends; 0: it never ends by itself"),
        key("frame_interval", Whole(1, 1_000_000), "steps", Default("1"), "steps between frames"),
        key("precision", Choice(|| Precision::ALL.map(Precision::name).to_vec()), "", Default("\"f32\""), "precision of positions and velocities; sums are f64 whatever it is"),
        key("gravity", Vector(Range::of(allowed::GRAVITY)), "m/s^2", Default("[0.0, -9.81, 0.0]"), "gravity"),
        key("wind", Vector(SPEED), "m/s", Default("[0.0, 0.0, 0.0]"), "velocity of the medium; bodies feel it through their drag and their air, snow through its drag"),
        key("wind_at", Tables(&WIND_AT, 10_000), "", Default("[]"), "in place of `wind`, its velocity over time: `[[wind_at]]`"),
        key("hash_interval", Whole(1, 1_000_000), "frames", Default("10"), "frames between frames that carry the hash of the state"),
        key("contact", Table(&CONTACT), "", Absent("its defaults"), "how surfaces of cloth meet each other: `[contact]`"),
        key("rest", Table(&REST), "", Absent("nothing is watched"), "when cloth counts as calm, and whether it sleeps then: `[rest]`"),
        key("body", Tables(&BODY, MANY), "", Default("[]"), "bodies: `[[body]]`; a scene has at least one body or snow"),
        key("figure", Tables(&FIGURE, MANY), "", Default("[]"), "figures: `[[figure]]`; cloth with a thickness meets them"),
        key("snow", Table(&SNOW), "", Absent("no snow"), "snow: `[snow]` with `[[snow.object]]`; cloth and snow pass through each other, because nothing couples them yet"),
        key("collider", Tables(&COLLIDER, MANY), "", Default("[]"), "colliders: `[[collider]]`"),
    ],
    alternatives: Alternatives::None,
};
