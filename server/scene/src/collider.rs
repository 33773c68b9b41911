//! Colliders: how a scene writes them, the keys that it may use, and what the simulation gets.
//!
//! To add a shape: its variant of [`ShapeText`], its line in `COLLIDER`, its section, its arm in
//! [`ColliderText::assemble`]. The solid of a mesh is made in `assemble`, where meshes come from.

use nappe_sim::{
    collide::{
        Collider, Contact, Shape, StartInside,
        shape::{Capsule, Cuboid, Cylinder, HalfPipe, Plane, Sphere},
    },
    math::array::{dot, length},
};
use serde::{Deserialize, Serialize};

use crate::{
    body::Mesh,
    error::{ErrorKind, SceneError},
    location::Location,
    names,
    schema::{Alternatives, DIRECTION, LENGTH, Presence, Range, SIZE, SPEED, Section, ValueKind, WELD, key},
    transform::{ROTATE, Rotate, TRANSFORM, Transform, rotation},
    way::{ColliderKey, KEY, way},
};

use Presence::{Absent, Chosen, Default as Preset, Required};
use ValueKind::{Choice, Flag, Number, Table, Tables, Text, Vector};

/// Something that particles collide with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColliderText {
    /// Name, unique among colliders.
    pub name: String,
    /// Its shape at time 0.
    #[serde(flatten)]
    pub shape: ShapeText,
    /// Velocity (m/s).
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Coulomb's friction coefficient; 0: no friction.
    #[serde(default)]
    pub friction: f64,
    /// Share of the normal approach speed that comes back to cloth, 0 to 1.
    #[serde(default)]
    pub restitution: f64,
    /// Distance from the surface at which a particle touches (m).
    #[serde(default)]
    pub margin: f64,
    /// How snow meets it; cloth always separates.
    #[serde(default, with = "names::contact")]
    pub contact: Contact,
    /// Speed (m/s) at which cloth that is inside is pushed out.
    #[serde(default = "recovery")]
    pub recovery: f64,
    /// What becomes of cloth and snow that begin inside.
    #[serde(default, with = "names::start_inside")]
    pub on_start_inside: StartInside,
    /// Its way, in place of a velocity.
    #[serde(default, rename = "key", skip_serializing_if = "Vec::is_empty")]
    pub keys: Vec<ColliderKey>,
}

fn recovery() -> f64 {
    Collider::RECOVERY
}

/// Shape of a collider.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ShapeText {
    /// The half-space behind a plane.
    Plane {
        /// A point of it (m).
        point: [f64; 3],
        /// Direction towards the particles, of any length but 0.
        normal: [f64; 3],
    },
    /// A ball about a centre.
    Sphere {
        /// Centre (m).
        center: [f64; 3],
        /// Radius (m).
        radius: f64,
    },
    /// All points within a distance of a segment.
    Capsule {
        /// One end of the segment (m).
        start: [f64; 3],
        /// The other end (m).
        end: [f64; 3],
        /// Distance from the segment (m).
        radius: f64,
    },
    /// A box, along the axes unless it is turned.
    Box {
        /// Centre (m).
        center: [f64; 3],
        /// Edges (m).
        size: [f64; 3],
        /// Rotation about its centre.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rotate: Option<Rotate>,
    },
    /// A cylinder with flat ends.
    Cylinder {
        /// Centre of one end (m).
        start: [f64; 3],
        /// Centre of the other (m).
        end: [f64; 3],
        /// Radius (m).
        radius: f64,
    },
    /// The inside of a closed mesh.
    Mesh(ColliderMesh),
    /// The ground below a trough, endless along its axis.
    HalfPipe {
        /// A point of the axis (m).
        point: [f64; 3],
        /// Direction of the axis, of any length but 0.
        axis: [f64; 3],
        /// Direction of the opening, across the axis.
        up: [f64; 3],
        /// Inner radius (m).
        radius: f64,
    },
}

/// The mesh of a collider: a file or an upload.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColliderMesh {
    /// Where it comes from.
    #[serde(flatten)]
    pub mesh: Mesh,
    /// Scales, turns and shifts the mesh, in this order.
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub transform: Transform,
    /// Fills loops of at most 64 open edges.
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub close_holes: bool,
}

impl ColliderMesh {
    /// Triangles in the meshes of all colliders of a scene, at most.
    pub const MOST_TRIANGLES: u64 = 200_000;

    /// A mesh as it lies, without holes.
    pub fn new(mesh: Mesh) -> Self {
        Self { mesh, transform: Transform::default(), close_holes: false }
    }
}

impl ColliderText {
    /// Its mesh, if it has one.
    pub fn mesh(&self) -> Option<&ColliderMesh> {
        if let ShapeText::Mesh(mesh) = &self.shape { Some(mesh) } else { None }
    }

    /// The same, to be changed.
    pub(crate) fn mesh_mut(&mut self) -> Option<&mut ColliderMesh> {
        if let ShapeText::Mesh(mesh) = &mut self.shape { Some(mesh) } else { None }
    }
}

#[rustfmt::skip] // one line per key
pub(crate) static COLLIDER: Section = Section {
    name: "collider",
    about: "Something that particles collide with. Distances from each shape are exact.",
    keys: &[
        key("name", Text(64), "", Required, "name, unique among colliders"),
        key("plane", Table(&PLANE), "", Chosen, "the half-space behind a plane"),
        key("sphere", Table(&SPHERE), "", Chosen, "a ball"),
        key("capsule", Table(&CAPSULE), "", Chosen, "all points within a distance of a segment"),
        key("box", Table(&BOX), "", Chosen, "a box"),
        key("cylinder", Table(&CYLINDER), "", Chosen, "a solid cylinder with flat ends"),
        key("half_pipe", Table(&HALF_PIPE), "", Chosen, "the ground below a trough"),
        key("mesh", Table(&MESH), "", Chosen, "the inside of a closed mesh"),
        key("velocity", Vector(SPEED), "m/s", Preset("[0.0, 0.0, 0.0]"), "constant velocity"),
        key("friction", Number(Range(0.0, 100.0)), "", Preset("0.0"), "Coulomb's friction coefficient"),
        key("restitution", Number(Range(0.0, 1.0)), "", Preset("0.0"), "share of the normal approach speed that comes back to a particle of cloth; snow takes 0"),
        key("margin", Number(Range(0.0, 1e3)), "m", Preset("0.0"), "distance from the surface at which a particle touches: half the cloth's thickness"),
        key("contact", Choice(|| Contact::ALL.map(Contact::name).to_vec()), "", Preset("\"separating\""), "how snow meets it: sticky (it moves with the surface), slip (it neither enters nor leaves, and slides with friction), separating (it may leave, and slides with friction while pressed on); cloth always separates"),
        key("recovery", Number(Range(1e-6, 1e3)), "m/s", Preset("1.0"), "speed at which cloth that is inside at the start of a sub-step is pushed out, which gives it no velocity"),
        key("on_start_inside", Choice(|| StartInside::ALL.map(StartInside::name).to_vec()), "", Preset("\"warn\""), "what happens to cloth that begins inside, and to snow that begins inside by more than a cell: warn (it begins there, and is told), refuse (the scene is refused), lift (cloth is moved out along the nearest way, before its springs are made; snow that begins inside at all is left out; both are told). Pins may begin inside"),
        key("key", Tables(&KEY, ColliderKey::MOST), "", Preset("[]"), "in place of `velocity`, where it is over time: `[[collider.key]]`"),
    ],
    alternatives: Alternatives::OneChosen,
};

#[rustfmt::skip] // one line per key
static PLANE: Section = Section {
    name: "collider.plane",
    about: "A plane.",
    keys: &[
        key("point", Vector(LENGTH), "m", Required, "a point of the plane at time 0"),
        key("normal", Vector(DIRECTION), "", Required, "direction towards the particles, not zero; its length does not matter"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static SPHERE: Section = Section {
    name: "collider.sphere",
    about: "A ball.",
    keys: &[
        key("center", Vector(LENGTH), "m", Required, "centre at time 0"),
        key("radius", Number(SIZE), "m", Required, "radius"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static CAPSULE: Section = Section {
    name: "collider.capsule",
    about: "A cylinder with round ends: all points within `radius` of a segment.",
    keys: &[
        key("start", Vector(LENGTH), "m", Required, "one end of the segment at time 0"),
        key("end", Vector(LENGTH), "m", Required, "the other end, another point"),
        key("radius", Number(SIZE), "m", Required, "radius"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static BOX: Section = Section {
    name: "collider.box",
    about: "A box.",
    keys: &[
        key("center", Vector(LENGTH), "m", Required, "centre at time 0"),
        key("size", Vector(SIZE), "m", Required, "edges along its own axes"),
        key("rotate", Table(&ROTATE), "", Absent("edges along the axes"), "rotation about its centre"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static CYLINDER: Section = Section {
    name: "collider.cylinder",
    about: "A solid cylinder with flat ends.",
    keys: &[
        key("start", Vector(LENGTH), "m", Required, "centre of one end at time 0"),
        key("end", Vector(LENGTH), "m", Required, "centre of the other end, another point"),
        key("radius", Number(SIZE), "m", Required, "radius"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static HALF_PIPE: Section = Section {
    name: "collider.half_pipe",
    about: "The ground below a trough: all that is outside of a tube and below its axis. It has no ends.",
    keys: &[
        key("point", Vector(LENGTH), "m", Required, "a point of the axis at time 0"),
        key("axis", Vector(DIRECTION), "", Required, "direction of the axis, not zero; its length does not matter"),
        key("up", Vector(DIRECTION), "", Required, "direction of the opening, not along the axis; the part of it across the axis is taken"),
        key("radius", Number(SIZE), "m", Required, "inner radius"),
    ],
    alternatives: Alternatives::None,
};

#[rustfmt::skip] // one line per key
static MESH: Section = Section {
    name: "collider.mesh",
    about: "A closed triangle mesh: each edge has two triangles, which run along it in opposite directions. Points with the same coordinates count as one, a triangle that is there twice counts once, and a mesh that is turned inside out is turned round; masses mean nothing here. A scene has at most 200000 triangles in the meshes of its colliders.",
    keys: &[
        key("file", Text(1000), "", Chosen, "a mesh file beside the scene: .obj, .off, .ply or .stl, also packed as .obj.gz and so on, or a folder of .eti files"),
        key("upload", Text(200), "", Chosen, "id of an uploaded mesh, or torus, walker or tunic: meshes that come with nappe"),
        key("weld", Number(WELD), "m", Preset("0.0"), "points nearer to each other than this become one, before the transform and before holes are closed; 0: none but those with the same coordinates. Points that only others between them join become one too. Triangles that lose a corner are left out. At most a tenth of the mesh's median edge; 1e-6 joins points at the same place"),
        key("transform", Table(&TRANSFORM), "", Absent("the mesh as it lies"), "moves the mesh: scale, then rotate, then translate"),
        key("close_holes", Flag, "", Preset("false"), "true: each loop of at most 64 open edges is filled by a fan of triangles from its first point; false: a mesh with an open edge is refused"),
    ],
    alternatives: Alternatives::OneChosen,
};

impl ColliderText {
    /// The collider that the text describes; `at` is where it stands, and `solid` makes the shape of a mesh.
    pub(crate) fn assemble(
        &self,
        at: &Location<'_>,
        solid: impl FnOnce(&ColliderMesh) -> Result<Shape, SceneError>,
    ) -> Result<Collider, SceneError> {
        let keys = at.key("key");
        if !self.keys.is_empty() && self.velocity != [0.0; 3] {
            let message = "does not go with key, which says where the collider is at all times";
            return at.key("velocity").inconsistent(message);
        }
        Ok(Collider {
            name: self.name.clone(),
            shape: self.shape.assemble(at, solid)?,
            velocity: self.velocity,
            way: way(&self.keys, &keys)?,
            friction: self.friction,
            restitution: self.restitution,
            margin: self.margin,
            contact: self.contact,
            recovery: self.recovery,
            on_start_inside: self.on_start_inside,
        })
    }
}

impl ShapeText {
    fn assemble(
        &self,
        at: &Location<'_>,
        solid: impl FnOnce(&ColliderMesh) -> Result<Shape, SceneError>,
    ) -> Result<Shape, SceneError> {
        Ok(match self {
            Self::Mesh(mesh) => solid(mesh)?,
            &Self::Plane { point, normal } => {
                Plane { point, normal: unit(normal, "normal", &at.key("plane"))? }.into()
            }
            &Self::Sphere { center, radius } => Sphere { center, radius }.into(),
            &Self::Capsule { start, end, radius } => {
                apart(start, end, &at.key("capsule"))?;
                Capsule { start, end, radius }.into()
            }
            Self::Box { center, size, rotate } => {
                let rotation = rotation(rotate.as_ref(), &at.key("box"))?;
                // The rotation's columns are where it takes the axes.
                let axes = [0, 1, 2].map(|axis| rotation.map(|row| row[axis]));
                Cuboid { center: *center, half_extent: size.map(|edge| 0.5 * edge), axes }.into()
            }
            &Self::Cylinder { start, end, radius } => {
                apart(start, end, &at.key("cylinder"))?;
                Cylinder { start, end, radius }.into()
            }
            &Self::HalfPipe { point, axis, up, radius } => {
                let at = at.key("half_pipe");
                let (axis, up) = (unit(axis, "axis", &at)?, unit(up, "up", &at)?);
                HalfPipe { point, axis, up: square(axis, up, &at)?, radius }.into()
            }
        })
    }
}

/// The unit vector along the direction that stands in the key `name` of `at`.
fn unit(v: [f64; 3], name: &str, at: &Location<'_>) -> Result<[f64; 3], SceneError> {
    let length = length(v);
    if length == 0.0 {
        let message = match name {
            "normal" => "is zero: a normal needs a direction",
            "axis" => "is zero: an axis needs a direction",
            _ => "is zero: a direction needs a length above 0",
        };
        return Err(at.key(name).error(ErrorKind::OutOfRange, message));
    }
    Ok(v.map(|c| c / length))
}

/// The unit vector nearest to `up` at right angles to `axis`; both are unit vectors.
fn square(axis: [f64; 3], up: [f64; 3], at: &Location<'_>) -> Result<[f64; 3], SceneError> {
    let along = dot(axis, up);
    let across = [0, 1, 2].map(|c| up[c] - along * axis[c]);
    let length = length(across);
    // Nearer to the axis than that, its direction is mostly rounding.
    if length < 1e-6 {
        let message = "runs along the axis; allowed: a direction across it, that of the opening";
        return at.key("up").inconsistent(message);
    }
    Ok(across.map(|c| c / length))
}

fn apart(start: [f64; 3], end: [f64; 3], at: &Location<'_>) -> Result<(), SceneError> {
    if start == end {
        return at
            .key("end")
            .inconsistent("is the same point as start; allowed: another point, or a sphere instead");
    }
    Ok(())
}
