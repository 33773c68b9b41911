//! The keys of a body: mesh, transform, mass, springs, pins, solver, limits.

use nappe_sim::{
    cloth::{Air, ElementKind, Hessian, Integrator, MinimizerKind, OnPass},
    linalg::{OperatorKind, PreconditionerKind},
    world::allowed,
};

use crate::{
    body::{GridPlane, Pattern, Unused},
    element_law::NamedWarp,
    fabric::Fabric,
    schema::{
        Alternative, Alternatives, DIRECTION, LENGTH, Presence, Range, SPEED, Section, ValueKind, WELD, key,
    },
    transform::TRANSFORM,
};

use Presence::{Absent, Chosen, Default, Required};
use ValueKind::{
    Choice, Flag, NameOrVector, Number, OneOrThree, Pair, Pin, Pins, Table, Tables, Text, Vector, Whole,
    WholePair,
};

/// A distance between particles (m).
const SPACING: Range = Range(1e-6, 1e3);
/// A mass (kg).
const MASS: Range = Range(1e-12, 1e9);
/// A stiffness (N/m).
const STIFFNESS: Range = Range::of(allowed::STIFFNESS);
/// Red, green or blue of sRGB.
const COLOR: Range = Range(0.0, 1.0);
/// A damping (N s/m).
const DAMPING: Range = Range::of(allowed::DAMPING);

#[rustfmt::skip] // one line per key
pub(super) static BODY: Section = Section {
    name: "body",
    about: "Particles joined by springs.",
    keys: &[
        key("name", Text(64), "", Required, "name, unique among bodies"),
        key("color", Vector(COLOR), "", Absent("viewers choose one"), "colour in viewers, for looks alone: red, green and blue of sRGB, as [1.0, 0.5, 0.0] for orange"),
        key("mesh", Table(&MESH), "", Required, "where the particles are"),
        key("transform", Table(&TRANSFORM), "", Absent("the mesh as it lies"), "moves the mesh before springs are made: scale, then rotate, then translate"),
        key("velocity", Vector(SPEED), "m/s", Default("[0.0, 0.0, 0.0]"), "velocity of every free particle at the start, beside those that its mesh carries (vx, vy, vz of a PLY file)"),
        key("material", Table(&FABRIC), "", Absent("none"), "a fabric by name: mass, membrane and plate, in place of mass, springs and law"),
        key("mass", Table(&MASSES), "", Absent("the masses of the mesh; needed where it carries none"), "masses of the particles; those that the mesh gives the mass 0 stay pinned"),
        key("springs", Table(&SPRINGS), "", Absent("no springs: the particles are free of each other"), "springs"),
        key("law", Tables(&LAW, 100), "", Default("[]"), "laws of elements beside the springs: `[[body.law]]`"),
        key("pins", Pins, "", Default("[]"), "particles that do not move, by index (from 0) or name: on a grid top_left, top_right, bottom_left, bottom_right, top, bottom, left, right (row 0 is the top); on a chain first, last. A mass of 0 pins too"),
        key("moving_pin", Tables(&MOVING_PIN, 10_000), "", Default("[]"), "pins that move from the start: `[[body.moving_pin]]`"),
        key("force", Tables(&FORCE, 10_000), "", Default("[]"), "forces on particles: `[[body.force]]`"),
        key("drag", Number(Range::of(allowed::DRAG)), "N s/m", Default("0.0"), "linear drag of the medium on each particle: f = -drag (v - wind)"),
        key("thickness", Number(Range(0.0, 1e3)), "m", Default("0.0"), "distance that its surface keeps from itself, so that no edge crosses a triangle in any step; 0: it passes through all cloth. At most half of the shortest edge; with integrator implicit_euler, minimizer auto or one_step and steps that are checked. Bodies that have one keep apart from each other too"),
        key("air", Table(&AIR), "", Absent("no air"), "air that acts on the triangles: `[body.air]`; it moves with the wind"),
        key("integrator", Choice(|| Integrator::ALL.map(Integrator::name).to_vec()), "", Default("\"implicit_euler\""), "how positions and velocities advance"),
        key("minimizer", Choice(|| MinimizerKind::ALL.map(MinimizerKind::name).to_vec()), "", Default("\"auto\""), "how an implicit step solves its minimisation: auto makes one linear solve, and goes on as newton does where that is not as good as accuracy asks; one_step makes one, newton as many as newton_tolerance needs, vertex_block_descent moves particles one by one"),
        key("accuracy", Number(Range(1e-9, 1.0)), "", Absent("0.002, with auto"), "how much less than a linear solve promised the potential of an implicit step may fall, as a share of the kinetic and elastic energy: a step that lacks more makes more solves, four at most, and is taken again shorter if that is not enough. Steps that are unchecked and bodies with a thickness make one solve at a time, whatever it does"),
        key("newton_tolerance", Number(Range(1e-12, 1e6)), "m/s^2", Absent("0.01, with newton"), "largest acceleration by which forces and inertia of a particle may differ"),
        key("newton_iterations", Whole(1, 10_000), "linear solves", Absent("50, with newton"), "cap on the solves of a sub-step"),
        key("sweeps", Whole(1, 10_000), "per sub-step", Absent("20, with vertex_block_descent"), "how often vertex block descent moves all particles; up to 16 times as often where the momentum does not balance"),
        key("hessian", Choice(|| Hessian::ALL.map(Hessian::name).to_vec()), "", Default("\"absolute\""), "treatment of the negative transverse stiffness of compressed springs in an implicit step"),
        key("safety", Number(Range(1e-3, 1.0)), "", Absent("0.9, unless the sub-steps are fixed"), "share of the bound that an explicit sub-step takes; below the bound small motions stay bounded, large ones are not certified"),
        key("substeps", Whole(1, 10_000), "", Absent("as many as are needed"), "sub-steps of one length within one step of the scene. All cloths share them: they take the most that one of them asks for. Explicit ones are refused, with the number, where they are above the bound; implicit ones that are not accepted are divided further"),
        key("substep", Number(Range(1e-12, 1.0)), "s", Absent("see substeps"), "length of the sub-steps, in place of their number"),
        key("unchecked", Flag, "", Default("false"), "skips the checks of stability, before and after a sub-step: takes one per step of the scene, unless substeps or substep says otherwise; the run may diverge, and reports it"),
        key("tolerance", Number(Range(1e-12, 1e3)), "m", Absent("any error"), "largest estimated error of a position that a sub-step may make: sub-steps become as short as that needs, down to a 64th of what is asked for"),
        key("on_pass", Choice(|| OnPass::ALL.map(OnPass::name).to_vec()), "", Default("\"warn\""), "what happens when particles (or pins) cross or enter a collider within a sub-step: warn takes the sub-step, counts them and says so; reject takes it again at half the length, down to a 64th"),
        key("solver", Table(&SOLVER), "", Absent("its defaults"), "linear solver of an implicit step"),
        key("limits", Table(&LIMITS), "", Absent("no limits"), "when the state counts as diverged"),
        key("block_size", Whole(32, 4096), "particles", Default("256"), "particles per block, the unit of parallel work and of sums: a power of two. Results depend on it, never on the number of threads").once_called("grain"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static MESH: Section = Section {
    name: "body.mesh",
    about: "Where the particles are: a grid, a chain, the course's grid, an upload or a file.",
    keys: &[
        key("grid", WholePair(1, 100_000), "particles", Chosen, "`[columns, rows]`: particle r * columns + c at (c, 0, r) spacing"),
        key("chain", Whole(1, 10_000_000), "particles", Chosen, "particles in a row along x, joined one to the next"),
        key("course_grid", Whole(2, 10_000), "particles", Chosen, "the course's square grid with this many particles per side, 0.1 m apart: x = 0.1 c, y = -0.1 r, z = 0.1 sin(-2.5 c), all with 6 significant digits; mass 0 at the two upper corners, 1 kg elsewhere"),
        key("upload", Text(200), "", Chosen, "id of an uploaded mesh, or torus, walker or tunic: meshes that come with nappe"),
        key("file", Text(1000), "", Chosen, "a mesh file beside the scene: .obj, .off, .ply or .stl, also packed as .obj.gz and so on, or a folder of .eti files"),
        key("unused", Choice(|| Unused::NAMES.to_vec()), "", Default("\"keep\""), "points that no triangle names: keep makes particles of them, which fall freely and have no mass by density; drop leaves them out before anything else, so that indices of particles count the points that stay"),
        key("weld", Number(WELD), "m", Default("0.0"), "points nearer to each other than this become one, before the transform and after unused; 0: none do. Points that only others between them join become one too. The first by index stays, with its texture coordinates; masses add up (0 stays 0); triangles that lose a corner are left out; indices of particles count the points that stay. At most a tenth of the mesh's median edge; 1e-6 joins points at the same place"),
        key("spacing", Number(SPACING), "m", Chosen, "distance between neighbours"),
        key("plane", Choice(|| GridPlane::NAMES.to_vec()), "", Default("\"horizontal\""), "how a grid lies: horizontal (y = 0) or upright (z = 0, row 0 on top, at y = 0)"),
        key("ripple", Number(Range(-1e3, 1e3)), "m", Default("0.0"), "height of a ripple across a grid's columns: ripple * sin(-2.5 c), off the plane"),
    ],
    alternatives: Alternatives::OneOf(&[
        Alternative { key: "grid", needs: &["spacing"], may: &["plane", "ripple"] },
        Alternative { key: "chain", needs: &["spacing"], may: &[] },
        Alternative { key: "course_grid", needs: &[], may: &[] },
        Alternative { key: "upload", needs: &[], may: &["unused", "weld"] },
        Alternative { key: "file", needs: &[], may: &["unused", "weld"] },
    ]),
};

#[rustfmt::skip] // one line per key
static FABRIC: Section = Section {
    name: "body.material",
    about: "A fabric, and what differs from it: numbers per width and per area, which depend on no mesh. The fabrics are in the table under \"Fabrics\"; docs/laws/fabrics.md says where their numbers come from.",
    keys: &[
        key("preset", Choice(|| Fabric::ALL.map(|fabric| fabric.name).to_vec()), "", Required, "a fabric by name"),
        key("warp", NameOrVector(|| NamedWarp::NAMES.to_vec(), DIRECTION), "", Absent("uv; a mesh without texture coordinates needs a direction"), "where the warp runs: uv, the way the first texture coordinate grows where the second one stays, or a direction in the transformed mesh, as of a membrane"),
        key("density", Number(MASS), "kg/m^2", Absent("of the preset"), "mass per area"),
        key("stretch", Pair(STIFFNESS), "N/m", Absent("of the preset"), "stiffness per width along the warp and along the weft"),
        key("shear", Number(STIFFNESS), "N/m", Absent("of the preset"), "stiffness per width against shear"),
        key("bending", Number(STIFFNESS), "N m", Absent("of the preset"), "bending stiffness per width"),
        key("damping", Number(Range(0.0, 1e3)), "s", Absent("of the preset"), "damping of bending in its stiffness; stretch and shear have a thousandth of it"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static MASSES: Section = Section {
    name: "body.mass",
    about: "Masses, in one of three ways.",
    keys: &[
        key("particle", Number(MASS), "kg", Chosen, "mass of each particle"),
        key("total", Number(MASS), "kg", Chosen, "mass of the body, the same share for each particle"),
        key("density", Number(MASS), "kg/m^2", Chosen, "mass per area: each particle gets a third of its triangles' area; a triangle that is there twice counts once"),
    ],
    alternatives: Alternatives::OneChosen,
};

#[rustfmt::skip] // one line per key
static SPRINGS: Section = Section {
    name: "body.springs",
    about: "Springs, at rest as the transformed mesh lies: f = -stiffness (l - l0) u - damping ((v_i - v_j).u) u. No two join the same particles: stretch comes first, then shear, then bend.",
    keys: &[
        key("stretch", Table(&SPRING_LAW), "", Absent("with file, or pattern = \"file\""), "springs that resist change of length"),
        key("shear", Table(&SPRING_LAW), "", Absent("none"), "springs that resist change of angle"),
        key("bend", Table(&SPRING_LAW), "", Absent("none"), "springs that resist folding"),
        key("pattern", Choice(|| Pattern::NAMES.to_vec()), "", Absent("lattice for `grid`, edges for other meshes"), "edges: stretch on the edges of triangles, shear across each pair of triangles, bend along straight continuations of edges; lattice (grids only): stretch along rows and columns, shear on both diagonals of a cell, bend between particles two apart along rows and columns; file: the springs that the mesh carries, the element `edge` of a PLY, and no others"),
        key("file", Text(1000), "", Absent("no table"), "a table of all springs beside the scene, springs.csv, for a mesh that is a file: a line that names its columns (particle_a, particle_b, stiffness, and perhaps damping, rest_length, kind), and a line for each spring. Particles count the points of the file. Other keys do not go with it"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static SPRING_LAW: Section = Section {
    name: "body.springs.stretch, .shear, .bend",
    about: "Stiffness and damping of springs.",
    keys: &[
        key("stiffness", Number(STIFFNESS), "N/m", Required, "stiffness"),
        key("damping", Number(DAMPING), "N s/m", Default("0.0"), "damping along the spring"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static AIR: Section = Section {
    name: "body.air",
    about: "The force of the air on each triangle of area A and normal n, u being the mean velocity of its corners less the wind and u_t what of it is along the triangle: f = -density A / 2 ((normal |u.n| + lift |u_t|) (u.n) n + tangential |u_t| u_t), a third on each corner. The defaults are those of a flat plate in air.",
    keys: &[
        key("density", Number(Range::of(Air::DENSITY)), "kg/m^3", Default("1.2"), "density of the air"),
        key("normal", Number(Range::of(Air::COEFFICIENT)), "", Default("1.2"), "of the velocity across a triangle: the resistance of a sheet that moves broadside"),
        key("lift", Number(Range::of(Air::COEFFICIENT)), "", Default("2.0"), "of the velocity across a triangle that slides: the lift of a sheet at a small angle, which lets a flag flutter"),
        key("tangential", Number(Range::of(Air::COEFFICIENT)), "", Default("0.02"), "of the velocity along a triangle"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static LAW: Section = Section {
    name: "body.law",
    about: "A law of elements of three to six particles, at rest as the transformed mesh lies. Its page in docs/laws has the equation, and the unit of the stiffness.",
    keys: &[
        key("name", Choice(|| ElementKind::ALL.map(ElementKind::name).to_vec()), "", Required, "which law"),
        key("stiffness", OneOrThree(STIFFNESS), "of the law", Required, "stiffness; of plate and quadratic_bending: bending stiffness (N m); of membrane three: along the warp, along the weft and against shear (N/m)"),
        key("damping", Number(DAMPING), "s times that", Default("0.0"), "damping of the rate at which the elements change; of a membrane that of the greatest stiffness, of the others in proportion"),
        key("warp", NameOrVector(|| NamedWarp::NAMES.to_vec(), DIRECTION), "", Absent("none; a membrane needs one"), "where the warp of a membrane runs: uv, the way the first texture coordinate grows where the second one stays, or a direction in the transformed mesh, projected into each triangle; where it is within 30 degrees of the normal, the warp of a neighbour goes on"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static MOVING_PIN: Section = Section {
    name: "body.moving_pin",
    about: "A pin that moves from the start, at constant speed. It must be pinned: list it in `pins`, or give it the mass 0.",
    keys: &[
        key("pin", Pin, "", Required, "which, by index or name as in `pins`"),
        key("target", Vector(LENGTH), "m", Chosen, "where it goes; for a single particle"),
        key("offset", Vector(LENGTH), "m", Chosen, "how far it goes, each particle alike"),
        key("duration", Number(Range::of(allowed::DURATION)), "s", Required, "time that it takes, rounded up to one step"),
    ],
    alternatives: Alternatives::OneChosen,
};

#[rustfmt::skip] // one line per key
static FORCE: Section = Section {
    name: "body.force",
    about: "A force on particles for a time. Forces on one particle add up. A force that acts for a part of a step counts with that share.",
    keys: &[
        key("on", Pin, "", Required, "which particle, by index or name as in `pins`, or \"all\", which passes over pins"),
        key("force", Vector(Range::of(allowed::FORCE)), "N", Required, "force on each of them"),
        key("from", Number(Range::of(allowed::DURATION)), "s", Default("0.0"), "when it begins"),
        key("until", Number(Range::of(allowed::DURATION)), "s", Absent("it does not end"), "when it ends, after `from`"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static SOLVER: Section = Section {
    name: "body.solver",
    about: "Conjugate gradient, for implicit integrators.",
    keys: &[
        key("tolerance", Number(Range(1e-15, 0.5)), "", Absent("1e-4, unless fixed_iterations is given; 0.01 with newton"), "stops at |r| <= tolerance |b|, in the norm of the preconditioner"),
        key("max_iterations", Whole(1, 1_000_000), "iterations", Absent("200, unless fixed_iterations is given; 2000 with newton"), "cap on iterations"),
        key("fixed_iterations", Whole(1, 1_000_000), "iterations", Absent("stops by tolerance"), "number of iterations (fewer if rounding stops progress); excludes tolerance and max_iterations"),
        key("preconditioner", Choice(|| PreconditionerKind::ALL.map(PreconditionerKind::name).to_vec()), "", Default("\"auto\""), "approximate inverse. auto: two_level for stiff bodies of more than one block (h^2 k + h nu of a particle's springs above some 1000 times its mass) whose solves end by a tolerance, else block_jacobi; patches from where a solve of stiff cloth comes to 200 iterations"),
        key("operator", Choice(|| OperatorKind::ALL.map(OperatorKind::name).to_vec()), "", Default("\"matrix_free\""), "how the matrix is applied"),
        key("warm_start", Flag, "", Default("false"), "start from the solution of the step before"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static LIMITS: Section = Section {
    name: "body.limits",
    about: "The simulation takes no step whose result exceeds these: it stops and names the particle.",
    keys: &[
        key("max_stretch", Number(Range(1.0, 1e9)), "", Absent("no limit"), "largest length over rest length of any spring, and of any triangle of a membrane along its threads"),
        key("max_energy", Number(Range(0.0, 1e300)), "J", Absent("no limit"), "largest kinetic plus elastic energy of the body"),
    ],
    alternatives: Alternatives::None,
};
