//! Ten scenes in which everything goes by the clock: wind, forces, pins on their ways, and a collider with keys.
//!
//! Leaves: the text of each, with its name.

/// A scene of three bodies, two sheets and a chain.
pub(crate) struct Timed {
    pub(crate) name: &'static str,
    /// Keys of the sheet that hangs, and of the one that falls.
    sheets: [&'static str; 2],
    /// Keys of the chain.
    chain: &'static str,
    /// The shape of the collider, and its keys.
    collider: &'static str,
}

const IN_AIR: &str = "drag = 1e-3";
const BALL: &str = "\
sphere = { center = [0.2, 0, 0.2], radius = 0.15 }
key = [
    { time = 0.02, position = [0.2, 0, 0.2] },
    { time = 0.1, position = [0.22, 0.02, 0.2], turn = [0, 0.1, 0, 1] },
    { time = 0.3, position = [0.15, 0, 0.25] },
]";
const BOX: &str = "\
box = { center = [0.2, 0.08, 0.2], size = [0.4, 0.1, 0.3] }
key = [
    { time = 0, position = [0.2, 0.08, 0.2] },
    { time = 0.07, position = [0.2, 0.09, 0.2] },
    { time = 0.25, position = [0.24, 0.07, 0.18], turn = [0, 0.2, 0, 1] },
]";
const CAPSULE: &str = "\
capsule = { start = [0, 0.05, 0.2], end = [0.4, 0.05, 0.2], radius = 0.08 }
key = [
    { time = 0.05, position = [0.2, 0.05, 0.2] },
    { time = 0.21, position = [0.2, 0.06, 0.24], turn = [0.1, 0, 0, 1] },
]";
const CYLINDER: &str = "\
cylinder = { start = [0.2, -0.2, 0.2], end = [0.2, 0.14, 0.2], radius = 0.12 }
key = [
    { time = 0.01, position = [0.2, -0.03, 0.2] },
    { time = 0.11, position = [0.2, -0.01, 0.2], turn = [0, 0.3, 0, 1] },
    { time = 0.28, position = [0.18, -0.04, 0.22], turn = [0, 0.5, 0, 1] },
]";
const FLOOR: &str = "\
plane = { point = [0, 0.1, 0], normal = [0, 1, 0] }
key = [
    { time = 0.03, position = [0, 0.1, 0] },
    { time = 0.17, position = [0, 0.13, 0], turn = [0.02, 0, 0, 1] },
    { time = 0.4, position = [0, 0.05, 0] },
]";
const TROUGH: &str = "\
half_pipe = { point = [0.2, 0.45, 0.2], axis = [1, 0, 0], up = [0, 1, 0], radius = 0.35 }
key = [
    { time = 0.04, position = [0.2, 0.45, 0.2] },
    { time = 0.26, position = [0.2, 0.47, 0.21] },
]";

pub(crate) const SCENES: [Timed; 10] = [
    Timed {
        name: "linear",
        sheets: [IN_AIR, "drag = 1e-3\nlaw = [{ name = \"quadratic_bending\", stiffness = 1e-5 }]"],
        chain: IN_AIR,
        collider: BALL,
    },
    Timed {
        name: "symplectic",
        sheets: ["drag = 1e-3\nintegrator = \"symplectic_euler\""; 2],
        chain: "drag = 1e-3\nintegrator = \"symplectic_euler\"",
        collider: BOX,
    },
    Timed {
        name: "verlet",
        sheets: ["integrator = \"velocity_verlet\"", "integrator = \"velocity_verlet_pc\""],
        chain: "integrator = \"velocity_verlet\"",
        collider: CAPSULE,
    },
    Timed {
        name: "newton",
        sheets: ["drag = 1e-3\nminimizer = \"newton\""; 2],
        chain: "drag = 1e-3\nminimizer = \"newton\"",
        collider: CYLINDER,
    },
    Timed {
        name: "descent",
        sheets: [
            "drag = 1e-3\nminimizer = \"vertex_block_descent\"",
            "drag = 1e-3\nminimizer = \"one_step\"",
        ],
        chain: IN_AIR,
        collider: FLOOR,
    },
    Timed { name: "thick", sheets: ["drag = 1e-3\nthickness = 0.004"; 2], chain: IN_AIR, collider: BALL },
    Timed { name: "in_air", sheets: ["air = { lift = 1.0 }"; 2], chain: IN_AIR, collider: TROUGH },
    Timed {
        name: "divided",
        sheets: ["drag = 1e-3\nsubsteps = 3"; 2],
        chain: "drag = 1e-3\nsubsteps = 3",
        collider: BOX,
    },
    Timed { name: "accurate", sheets: ["drag = 1e-3\ntolerance = 2e-5"; 2], chain: IN_AIR, collider: FLOOR },
    Timed {
        name: "mixed",
        sheets: ["air = { density = 2 }\nintegrator = \"symplectic_euler\"", "drag = 1e-3"],
        chain: "integrator = \"velocity_verlet_pc\"",
        collider: CYLINDER,
    },
];

impl Timed {
    /// The scene as a file of TOML.
    pub(crate) fn text(&self) -> String {
        let Self { name, sheets: [hangs, falls], chain, collider } = self;
        let springs = "springs = { stretch = { stiffness = 60, damping = 0.02 }, shear = { stiffness = 30, damping = 0.01 }, \
                       bend = { stiffness = 2, damping = 0.002 } }";
        format!(
            r#"version = 1
title = "{name}"
dt = 0.005
steps = 62
frame_interval = 4
wind_at = [
    {{ time = 0.02, velocity = [0, 0, 0] }},
    {{ time = 0.09, velocity = [3, 1, 2] }},
    {{ time = 0.2, velocity = [0, 0, 1] }},
]

[[body]]
name = "hangs"
mesh = {{ grid = [8, 7], spacing = 0.05, ripple = 0.003 }}
transform = {{ translate = [0, 0.3, 0] }}
mass = {{ density = 0.25 }}
pins = ["top_left", "top_right"]
moving_pin = [
    {{ pin = "top_left", offset = [0.04, 0.05, 0.02], duration = 0.16 }},
    {{ pin = "top_right", offset = [-0.02, 0.03, 0], duration = 0.277 }},
]
force = [{{ on = 30, force = [0.01, 0.03, 0], from = 0.03, until = 0.113 }}]
{hangs}
{springs}

[[body]]
name = "falls"
mesh = {{ grid = [9, 9], spacing = 0.03 }}
transform = {{ translate = [0.08, 0.2, 0.08] }}
mass = {{ density = 0.25 }}
force = [{{ on = "all", force = [0, 0.001, 0.0005], from = 0.1, until = 0.171 }}]
{falls}
{springs}

[[body]]
name = "chain"
mesh = {{ chain = 21, spacing = 0.03 }}
transform = {{ translate = [-0.4, 0.4, 0] }}
mass = {{ particle = 0.005 }}
pins = ["first", "last"]
moving_pin = [{{ pin = "last", offset = [-0.1, 0.05, 0.05], duration = 0.2 }}]
force = [{{ on = 10, force = [0, 0.1, 0.05], from = 0.06, until = 0.24 }}]
{chain}
springs = {{ stretch = {{ stiffness = 60, damping = 0.02 }} }}

[[collider]]
name = "moves"
friction = 0.3
margin = 0.01
{collider}
"#
        )
    }
}

#[test]
fn ten_scenes_have_names_of_their_own_and_differ() {
    use std::collections::BTreeSet;

    let names: BTreeSet<&str> = SCENES.iter().map(|scene| scene.name).collect();
    let texts: BTreeSet<String> = SCENES.iter().map(Timed::text).collect();
    assert_eq!([names.len(), texts.len(), SCENES.len()], [10; 3]);
}
