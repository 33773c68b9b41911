//! The keys of a figure: mesh, transform, thickness, frames.

use nappe_sim::{cloth::Repeat, world::allowed};

use crate::{
    schema::{Alternatives, Presence, Range, Section, ValueKind, key},
    transform::TRANSFORM,
};

use Presence::{Absent, Chosen, Default, Required};
use ValueKind::{Choice, Number, Table, Text, Vector};

#[rustfmt::skip] // one line per key
pub(super) static FIGURE: Section = Section {
    name: "figure",
    about: "A mesh whose points go by frames, and which bodies with a thickness meet as they meet each other: a walker in clothes. Its surface may be open, and may cross itself: it does not meet itself, nor other figures, colliders or snow. Nothing moves it but its frames. Cloth that is to lie around it must not cross it at the start.",
    keys: &[
        key("name", Text(64), "", Required, "name, unique among bodies and figures"),
        key("color", Vector(Range(0.0, 1.0)), "", Absent("the grey of solids"), "colour in viewers, for looks alone: red, green and blue of sRGB"),
        key("mesh", Table(&MESH), "", Required, "its triangles; where its points are, the frames say"),
        key("transform", Table(&TRANSFORM), "", Absent("the frames as they are"), "moves all frames: scale, then rotate, then translate"),
        key("thickness", Number(Range(1e-6, 1e3)), "m", Required, "distance that counts for half where it meets a body, as the thickness of a body does"),
        key("firmness", Number(Range(1e3, 1e9)), "N/m^3", Default("1e6"), "pressure over how far it gives way: cloth that two parts press between them pushes them off their frames, by p / firmness where it presses by p"),
        key("frames", Table(&FRAMES), "", Required, "where its points are over time"),
        key("start", Number(Range::of(allowed::DURATION)), "s", Default("0.0"), "when the first frame passes; until then it holds, and cloth can settle"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static MESH: Section = Section {
    name: "figure.mesh",
    about: "The triangles of a figure: an upload or a file, with as many points as its frames have, in their order.",
    keys: &[
        key("upload", Text(200), "", Chosen, "id of an uploaded mesh, or walker: one that comes with nappe"),
        key("file", Text(1000), "", Chosen, "a mesh file beside the scene, as of a body"),
    ],
    alternatives: Alternatives::OneChosen,
};

#[rustfmt::skip] // one line per key
static FRAMES: Section = Section {
    name: "figure.frames",
    about: "Frames of points, as PC2 files have them. Between frames points go on straight lines.",
    keys: &[
        key("upload", Text(200), "", Chosen, "id of uploaded frames, or walker: those that come with nappe, 30 in a second for 5 s"),
        key("file", Text(1000), "", Chosen, "a .pc2 file beside the scene"),
        key("rate", Number(Range(1e-3, 1e5)), "1/s", Required, "frames in a second; no point may be faster than 1e4 m/s"),
        key("repeat", Choice(|| Repeat::ALL.map(Repeat::name).to_vec()), "", Default("\"hold\""), "what follows the last frame: hold keeps it; loop begins anew, with the first frame after as much time as between any two"),
    ],
    alternatives: Alternatives::OneChosen,
};
