//! Golden data: reads the tables and documents of `tests/golden`.
//!
//! Reads CSV and JSON; gives rows, numbers and networks, digit for digit (`float_roundtrip`).

use std::{collections::BTreeMap, fs, path::PathBuf};

use nappe_sim::cloth::{Hessian, Integrator, Network, Spring, SpringKind, SpringLaw};
use nappe_study::Method;
use serde::{Deserialize, de::DeserializeOwned};

/// Where a golden file lies.
pub fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("golden").join(name)
}

fn read(name: &str) -> String {
    let path = path(name);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("golden file {}: {error}", path.display()))
}

/// A golden JSON document.
pub fn document<T: DeserializeOwned>(name: &str) -> T {
    serde_json::from_str(&read(name)).unwrap_or_else(|error| panic!("golden file {name}: {error}"))
}

/// A row of a golden table.
#[derive(Clone, Debug)]
pub struct Row {
    table: String,
    fields: BTreeMap<String, String>,
}

impl Row {
    /// A field as it stands.
    pub fn text(&self, field: &str) -> &str {
        self.fields.get(field).unwrap_or_else(|| panic!("{}: no column '{field}'", self.table))
    }

    /// A field as a number; `inf` and `diverged` are infinite.
    pub fn number(&self, field: &str) -> f64 {
        match self.text(field) {
            "diverged" => f64::INFINITY,
            text => text.parse().unwrap_or_else(|_| panic!("{}: {field} = '{text}'", self.table)),
        }
    }

    /// A field as a count.
    pub fn count(&self, field: &str) -> u64 {
        let text = self.text(field);
        text.parse().unwrap_or_else(|_| panic!("{}: {field} = '{text}'", self.table))
    }
}

/// The rows of a golden table; lines that start with `#` are its statement.
pub fn table(name: &str) -> Vec<Row> {
    table_with(name, str::to_owned)
}

/// The same with every line as `clean` makes it: for tables with commas in their names.
pub fn table_with(name: &str, clean: impl Fn(&str) -> String) -> Vec<Row> {
    let text = read(name);
    let mut lines = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty()).map(clean);
    let header = lines.next().unwrap_or_default();
    let header: Vec<&str> = header.split(',').collect();
    let row = |line: String| {
        let fields = header.iter().zip(line.split(',')).map(|(h, f)| ((*h).to_owned(), f.to_owned()));
        Row { table: name.to_owned(), fields: fields.collect() }
    };
    lines.map(row).collect()
}

/// The method that golden tables call by this name: there `implicit_euler` keeps the full
/// Hessian. `None` for a method that the program does not have.
pub fn method(name: &str) -> Option<Method> {
    if name == "implicit_euler_clamped" {
        return Some(Method::new(Integrator::ImplicitEuler, Hessian::Clamped));
    }
    let integrator = Integrator::ALL.into_iter().find(|i| i.name() == name)?;
    let hessian = if integrator.is_implicit() { Hessian::Full } else { Hessian::Absolute };
    Some(Method::new(integrator, hessian))
}

/// A network written out in full.
#[derive(Clone, Debug, Deserialize)]
pub struct GoldenNetwork {
    mass_kg: Vec<f64>,
    pinned: Vec<u32>,
    /// Acceleration of gravity (m/s²).
    pub gravity_m_s2: [f64; 3],
    springs: Vec<[u32; 2]>,
    #[serde(rename = "k_N_per_m")]
    stiffness: Vec<f64>,
    #[serde(rename = "nu_N_s_per_m")]
    damping: Vec<f64>,
    #[serde(rename = "l0_m")]
    rest_length: Vec<f64>,
    x0_m: Vec<[f64; 3]>,
    v0_m_s: Vec<[f64; 3]>,
}

impl GoldenNetwork {
    /// The same as a body of the simulation.
    pub fn network(&self) -> Network {
        let spring = |(i, &particles): (usize, &[u32; 2])| Spring {
            particles,
            kind: SpringKind::Stretch,
            rest_length: self.rest_length[i],
            law: SpringLaw { stiffness: self.stiffness[i], damping: self.damping[i] },
        };
        Network {
            x: self.x0_m.clone(),
            v: self.v0_m_s.clone(),
            masses: self.mass_kg.clone(),
            pins: self.pinned.clone(),
            springs: self.springs.iter().enumerate().map(spring).collect(),
            ..Network::default()
        }
    }
}

/// A reference state at a time.
#[derive(Clone, Debug, Deserialize)]
pub struct GoldenState {
    /// Time since the start (s).
    pub t: f64,
    /// Positions of all particles (m).
    pub x: Vec<[f64; 3]>,
    /// Velocities of all particles (m/s).
    pub v: Vec<[f64; 3]>,
    /// Kinetic energy (J).
    #[serde(rename = "kinetic_J")]
    pub kinetic: f64,
    /// Elastic energy (J).
    #[serde(rename = "elastic_J")]
    pub elastic: f64,
    /// Gravitational energy (J).
    #[serde(rename = "gravity_J")]
    pub gravitational: f64,
    /// All three (J).
    #[serde(rename = "total_J")]
    pub total: f64,
    /// How much a small perturbation of the start has grown.
    #[serde(rename = "growth_of_position_perturbation")]
    pub growth: f64,
}

/// A motion: a network and its states.
#[derive(Clone, Debug, Deserialize)]
pub struct Transient {
    /// The network at the start.
    pub network: GoldenNetwork,
    /// States in order of time, the start first.
    pub states: Vec<GoldenState>,
}

impl Transient {
    /// The motions on record.
    pub const ALL: [&'static str; 5] =
        ["chain20 nu=0", "chain20 nu=0.5", "cloth10 nu=0", "cloth10 nu=0.1", "drap10 nu=0.01"];

    /// A motion by name, such as `cloth10 nu=0.1`.
    pub fn named(name: &str) -> Self {
        let (network, damping) = name.split_once(" nu=").expect("a name such as 'cloth10 nu=0.1'");
        document(&format!("spring_mass/{network}_transient_nu{damping}.json"))
    }

    /// The state at a time (s) on record.
    pub fn at(&self, time: f64) -> &GoldenState {
        let found = self.states.iter().find(|s| (s.t - time).abs() < 1e-12);
        found.unwrap_or_else(|| panic!("no state on record at t = {time} s"))
    }
}
