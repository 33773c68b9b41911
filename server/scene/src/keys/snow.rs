//! The keys of snow: how it is stepped, its objects, what they are made of.

use nappe_sim::snow::{Kernel, Law, Preset, SnowSettings, Transfer};

use crate::{
    schema::{Alternative, Alternatives, LENGTH, Presence, Range, SIZE, SPEED, Section, ValueKind, key},
    snow::{Overlap, Sampling, VolumeFrom},
    transform::TRANSFORM,
};

use Presence::{Absent, Chosen, Default, Required};
use ValueKind::{Choice, Flag, Number, Pair, Table, Tables, Text, Vector, Whole};

/// A share of a whole.
const SHARE: Range = Range(0.0, 1.0);
/// An amplitude of noise: below 1, so that factors stay above 0.
const NOISE: Range = Range(0.0, 0.95);

#[rustfmt::skip] // one line per key
pub(super) static SNOW: Section = Section {
    name: "snow",
    about: "Snow, by the material point method after Stomakhin et al. 2013. All objects are on one grid, and so they collide. A step of the scene is divided into steps of the snow, each as long as a bound allows. Small motions about rest stay bounded below it. `substep` gives steps of one length.",
    keys: &[
        key("cell", Number(SIZE), "m", Required, "side of a cell of the grid, which follows the snow wherever it goes"),
        key("kernel", Choice(|| Kernel::ALL.map(Kernel::name).to_vec()), "", Default("\"quadratic\""), "B-spline that spreads a particle over nodes; linear, with pic_flip alone, is here to show how it fails"),
        key("transfer", Choice(|| Transfer::NAMES.to_vec()), "", Default("\"mls\""), "how velocities go to the grid and back: pic_flip (Stomakhin et al. 2013), apic (Jiang et al. 2015), mls (Hu et al. 2018)"),
        key("flip", Number(SHARE), "", Absent("0.95 with pic_flip, unless flip_time is given"), "share of FLIP in each step of the snow, with pic_flip alone: the damping per second then doubles when the step is halved"),
        key("flip_time", Number(Range(1e-9, 1e9)), "s", Absent("see flip"), "with pic_flip, in place of flip: the share of FLIP in a step dt is exp(-dt / flip_time), so that the damping per second does not depend on dt"),
        key("advection", Choice(|| vec!["particle", "grid"]), "", Absent("particle, with pic_flip"), "which velocity moves a particle, with pic_flip alone: its own (Stomakhin et al. 2013), or that of the grid around it, which keeps positions and deformation together"),
        key("safety", Number(Range(1e-3, 1.0)), "", Absent("0.9, unless substep is given"), "share of the bound that a step of the snow takes; below the bound small motions about rest stay bounded, large ones are not certified"),
        key("substep", Number(Range(1e-12, 1.0)), "s", Absent("as long as the bound allows"), "length of the steps of the snow; refused, with the number, where it is above the bound"),
        key("unchecked", Flag, "", Default("false"), "with substep: skips the check against the bound; the run may diverge, and reports it"),
        key("beta", Number(SHARE), "", Default("0.0"), "0: explicit steps; 0.5 to 1: semi-implicit ones, with the forces that act after this share of the step (1: backward Euler, linearised). Every beta is of order 1; a wave of angular frequency w that is slow against the step is damped by exp(-beta w^2 dt t / 2). Elastic waves do not bound the step then; rotation and deformation do"),
        key("solver", Table(&SOLVER), "", Absent("its defaults"), "linear solver, with beta above 0 alone"),
        key("max_substeps", Whole(1, 1_000_000), "", Default("10000"), "steps of the snow within one step of the scene: a run that needs more stops"),
        key("ballistic_below", Number(SHARE), "", Default("0.0"), "a particle whose density on the grid is below this share of its own flies without stress, and does not bound the step; 0: none does"),
        key("max_energy", Number(Range(0.0, 1e300)), "J", Absent("no limit"), "largest kinetic plus elastic energy of all snow: a step whose result has more is not taken"),
        key("drag", Number(Range(0.0, SnowSettings::MOST_DRAG)), "1/s", Default("0.0"), "linear drag of the medium: what weighs m feels -drag m (v - wind). It is taken by the velocity at the end of a step, and so bounds none"),
        key("object", Tables(&OBJECT, 1000), "", Required, "objects, at least one: `[[snow.object]]`"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static SOLVER: Section = Section {
    name: "snow.solver",
    about: "Minimal residuals (MINRES), matrix-free: the tangent of compressed snow is not positive. A solve that stops above its tolerance fails the step.",
    keys: &[
        key("tolerance", Number(Range(1e-15, 0.5)), "", Default("1e-4"), "stops at |r| <= tolerance |b|"),
        key("max_iterations", Whole(1, 1_000_000), "iterations", Default("500"), "cap on iterations"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static OBJECT: Section = Section {
    name: "snow.object",
    about: "A solid filled with particles. Each particle has the same share of the solid's volume, and the masses add up to density times volume: exactly so for boxes, balls and closed meshes, whatever the sampling and the noise. What is random comes from `seed` alone, with the same bits on every platform.",
    keys: &[
        key("name", Text(64), "", Required, "name, unique among bodies and objects"),
        key("box", Table(&BOX), "", Chosen, "a box"),
        key("sphere", Table(&SPHERE), "", Chosen, "a ball"),
        key("mesh", Table(&MESH), "", Chosen, "the inside of a closed mesh: each edge has two triangles, which run along it in opposite directions; points with the same coordinates count as one"),
        key("transform", Table(&TRANSFORM), "", Absent("the source as it lies"), "moves the source before it is filled: scale, then rotate, then translate"),
        key("sampling", Choice(|| Sampling::NAMES.to_vec()), "", Default("\"jittered\""), "where particles go: jittered (one at a random position in each cell of a lattice), lattice (in the middle of each), poisson (at random, no two nearer than 0.85 times the edge of a cube with a particle's share of the volume). In a box the lattice is even; in other solids it consists of cubes, and particles outside the solid are dropped"),
        key("jitter", Number(SHARE), "", Absent("0.5, with jittered alone"), "part of a lattice's cell over which its particle may lie, along each axis: 0 its middle, 1 anywhere"),
        key("particles_per_cell", Number(Range(1e-3, 1000.0)), "", Absent("8, unless particles is given"), "particles per cell of the grid, nearly: a lattice has whole rows"),
        key("particles", Whole(1, 1_000_000_000), "particles", Absent("by particles_per_cell"), "particles of the object, exactly: a lattice with a few too many loses some at random"),
        key("seed", Whole(0, 4_294_967_295), "", Default("0"), "seed of the positions and of the noise"),
        key("velocity", Vector(SPEED), "m/s", Default("[0.0, 0.0, 0.0]"), "velocity of the centre of mass at the start"),
        key("angular_velocity", Vector(SPEED), "rad/s", Default("[0.0, 0.0, 0.0]"), "angular velocity about the solid's centre of mass at the start; mls and apic keep it, and PIC/FLIP at 0.95 stops any spin within a second"),
        key("material", Table(&MATERIAL), "", Absent("the preset stomakhin"), "what it is made of"),
        key("density_noise", Number(NOISE), "", Default("0.0"), "relative amplitude of noise on the particles' masses, even from 1 - noise to 1 + noise and then scaled so that the object's mass stays"),
        key("stiffness_noise", Number(NOISE), "", Default("0.0"), "relative amplitude of noise on Young's modulus, from 1 - noise to 1 + noise"),
        key("noise_length", Number(SIZE), "m", Absent("each particle has its own value"), "distance over which noise changes: values on a lattice of that spacing, blended between"),
        key("volume", Choice(|| VolumeFrom::NAMES.to_vec()), "", Default("\"source\""), "volumes at rest: source (the solid's volume, evenly) or grid (mass over the density on the grid before the first step, as Stomakhin et al. 2013; larger at the surface)"),
        key("overlap", Choice(|| Overlap::NAMES.to_vec()), "", Default("\"keep\""), "space that it shares with earlier objects, or that parts of its mesh share: keep counts it for each, with a warning above 1 % of the smaller one; drop leaves out its particles that lie in an earlier object, so that it may have fewer than were asked for, and counts once what parts of its mesh share"),
        key("attach", Text(64), "", Absent("none are held"), "name of a collider with contact = \"sticky\" that stands: particles of an elastic object within half a cell of its surface are held to it, and stretch there as if the object went on behind it"),
    ],
    alternatives: Alternatives::OneChosen,
};

#[rustfmt::skip] // one line per key
static BOX: Section = Section {
    name: "snow.object.box",
    about: "A box along the axes; `transform` turns it.",
    keys: &[
        key("min", Vector(LENGTH), "m", Chosen, "lower corner"),
        key("max", Vector(LENGTH), "m", Chosen, "upper corner, above the lower one along each axis"),
        key("center", Vector(LENGTH), "m", Chosen, "centre"),
        key("size", Vector(SIZE), "m", Chosen, "edges"),
    ],
    alternatives: Alternatives::OneOf(&[
        Alternative { key: "min", needs: &["max"], may: &[] },
        Alternative { key: "center", needs: &["size"], may: &[] },
    ]),
};

#[rustfmt::skip] // one line per key
static SPHERE: Section = Section {
    name: "snow.object.sphere",
    about: "A ball.",
    keys: &[
        key("center", Vector(LENGTH), "m", Required, "centre"),
        key("radius", Number(SIZE), "m", Required, "radius"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static MESH: Section = Section {
    name: "snow.object.mesh",
    about: "A closed triangle mesh. A part inside another is a hole when it is turned inside out. Parts that overlap are filled once, while the volume counts what they share twice, which gives a warning above 1 % of the smaller one: join them first, or give the object overlap = \"drop\".",
    keys: &[
        key("upload", Text(200), "", Chosen, "id of an uploaded mesh, or torus, walker or tunic: meshes that come with nappe"),
        key("file", Text(1000), "", Chosen, "a mesh file beside the scene: .obj, .off, .ply or .stl, also packed as .obj.gz and so on, or a folder of .eti files"),
    ],
    alternatives: Alternatives::OneChosen,
};

#[rustfmt::skip] // one line per key
static MATERIAL: Section = Section {
    name: "snow.object.material",
    about: "A preset, and what differs from it. The presets and where their numbers come from are in the table under \"Presets of snow\".",
    keys: &[
        key("preset", Choice(|| Preset::ALL.map(|preset| preset.name).to_vec()), "", Default("\"stomakhin\""), "a material by name. It sets the material alone: the method of Stomakhin et al. 2013 is kernel = cubic, transfer = pic_flip and flip = 0.95 besides"),
        key("law", Choice(|| Law::ALL.map(Law::name).to_vec()), "", Absent("of the preset"), "elastic law: fixed_corotated (Stomakhin et al. 2012, 2013) or neo_hookean"),
        key("young", Number(Range(1e-3, 1e13)), "Pa", Absent("of the preset"), "Young's modulus of snow that is not packed"),
        key("poisson", Number(Range(0.0, 0.49)), "", Absent("of the preset"), "Poisson's ratio"),
        key("density", Number(Range(1e-3, 1e6)), "kg/m^3", Absent("of the preset"), "density at rest"),
        key("critical_compression", Number(Range(0.0, 0.999)), "", Absent("of the preset"), "theta_c: compression at which it begins to yield"),
        key("critical_stretch", Number(Range(0.0, 1000.0)), "", Absent("of the preset"), "theta_s: stretch at which it begins to yield"),
        key("hardening", Number(Range(0.0, 40.0)), "", Absent("of the preset"), "xi: stiffness grows as exp(xi (1 - J_P)) while it is packed"),
        key("plastic_ratio_range", Pair(Range(1e-6, 1000.0)), "", Absent("of the preset"), "range in which the plastic volume ratio J_P is kept: its lower end, at most 1, bounds the stiffness; its upper one is at least 1").once_called("jp_range"),
        key("plastic", Flag, "", Absent("of the preset"), "false: elastic, whatever the preset says"),
    ],
    alternatives: Alternatives::None,
};
