//! A table of a run: a row per frame with what its step reported, as comma-separated values (RFC 4180).
//!
//! Enters: the names of colliders, then frames. Leaves: a file with a line of names and one a frame. Numbers read back to the last
//! bit; where there is none, nothing stands.

mod columns;

use std::path::Path;

use nappe_client::{Frame, Topology, components, v1};
use nappe_scene::printable;

use self::columns::{COLUMNS, Cell};
use crate::{
    files::{aside::Growing, write::Existing},
    studies::study::csv::{number, quoted},
    words::{error::Result, output},
};

/// The columns of the frame itself.
const OF_FRAME: [&str; 4] = ["step", "time_seconds", "frame", "state_hash"];
/// The columns of what a collider felt, after `load_` and its name.
const OF_LOAD: [&str; 7] = ["force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z", "contacts"];

/// A table in the making.
pub(crate) struct Table {
    file: Growing,
    /// The colliders, in the order of the scene.
    colliders: Vec<String>,
    frame_count: u64,
}

impl Table {
    /// Opens the file, beside one that is there.
    ///
    /// # Errors
    /// When it cannot be opened, or is there and stays.
    pub(super) fn create(path: &Path, existing: Existing) -> Result<Self> {
        Ok(Self { file: Growing::open(path, existing)?, colliders: Vec::new(), frame_count: 0 })
    }

    /// Keeps the names of the colliders.
    pub(super) fn topology(&mut self, topology: &Topology) {
        self.colliders = topology.colliders.iter().map(|collider| collider.name.clone()).collect();
    }

    /// Writes the row of a frame, after the names of the columns if it is the first.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(super) fn frame(&mut self, frame: &Frame) -> Result<()> {
        if self.frame_count == 0 {
            self.write(&names(&self.colliders))?;
        }
        self.frame_count += 1;
        self.write(&row(frame, &self.colliders))?;
        self.file.flush()
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(super) fn finish(self) -> Result<()> {
        self.file.finish()
    }

    fn write(&mut self, fields: &[String]) -> Result<()> {
        let fields: Vec<String> = fields.iter().map(|field| quoted(field)).collect();
        self.file.write((fields.join(",") + "\n").as_bytes())
    }
}

/// The names of all columns.
fn names(colliders: &[String]) -> Vec<String> {
    let of_loads = colliders.iter().flat_map(|collider| {
        let collider = printable(collider);
        OF_LOAD.map(|part| format!("load_{collider}_{part}"))
    });
    let known = OF_FRAME.into_iter().chain(COLUMNS.map(|(name, _)| name));
    known.map(str::to_owned).chain(of_loads).collect()
}

/// The fields of a frame.
fn row(frame: &Frame, colliders: &[String]) -> Vec<String> {
    let mut fields = vec![
        frame.step.to_string(),
        number(frame.time),
        frame.frame.to_string(),
        frame.state_hash.map(output::hash).unwrap_or_default(),
    ];
    let diagnostics = frame.diagnostics.as_ref();
    fields.extend(COLUMNS.iter().map(|(_, value)| match diagnostics.and_then(value) {
        Some(Cell::Number(value)) => number(value),
        Some(Cell::Count(count)) => count.to_string(),
        Some(Cell::Word(word)) => word,
        None => String::new(),
    }));
    for collider in colliders {
        let loads = diagnostics.map(|diagnostics| diagnostics.loads.as_slice()).unwrap_or_default();
        fields.extend(load(loads.iter().find(|load| load.name == *collider)));
    }
    fields
}

/// The fields of what a collider felt.
fn load(load: Option<&v1::ColliderLoad>) -> [String; OF_LOAD.len()] {
    let Some(load) = load else { return Default::default() };
    let [force, torque] = [load.force, load.torque].map(components);
    let [[fx, fy, fz], [tx, ty, tz]] = [force, torque].map(|vector| vector.map(number));
    [fx, fy, fz, tx, ty, tz, load.contacts.to_string()]
}

#[cfg(test)]
mod tests {
    use nappe_client::Vectors;

    use super::*;

    fn frame(diagnostics: Option<v1::Diagnostics>) -> Frame {
        Frame {
            frame: 3,
            step: 30,
            time: 0.1,
            state_hash: Some(255),
            positions: Vectors::F32(Vec::new()),
            velocities: None,
            plastic_ratios: None,
            stress_norms: None,
            forces: None,
            accelerations: None,
            grid: None,
            dropped_count: 0,
            diagnostics,
            poses: Vec::new(),
            carried: None,
        }
    }

    /// The field of a column.
    fn field(fields: &[String], colliders: &[String], column: &str) -> String {
        let names = names(colliders);
        assert_eq!(names.len(), fields.len());
        fields[names.iter().position(|name| name == column).expect("a column")].clone()
    }

    #[test]
    fn what_a_step_reported_stands_below_its_name_and_what_it_did_not_is_empty() {
        let colliders = ["floor", "a, \"b\""].map(str::to_owned);
        let mut snow =
            v1::SnowDiagnostics { substeps: 12, mass: 1.0 / 3.0, ..v1::SnowDiagnostics::default() };
        snow.set_bound(v1::TimeBound::ElasticWave);
        let force = Some(v1::Vector3 { x: 1e-7, y: -2.5, z: 1e21 });
        let felt = v1::ColliderLoad {
            name: colliders[1].clone(),
            force,
            contacts: 4,
            ..v1::ColliderLoad::default()
        };
        let diagnostics = v1::Diagnostics {
            kinetic_energy: 0.1 + 0.2,
            momentum: Some(v1::Vector3 { x: 1.0, y: 2.0, z: -0.0 }),
            snow: Some(snow),
            loads: vec![felt],
            ..v1::Diagnostics::default()
        };
        let fields = row(&frame(Some(diagnostics)), &colliders);
        for (column, expected) in [
            ("step", "30"),
            ("time_seconds", "0.1"),
            ("frame", "3"),
            ("state_hash", "00000000000000ff"),
            ("kinetic_energy", "0.30000000000000004"),
            ("momentum_y", "2.0"),
            ("momentum_z", "-0.0"),
            ("solve_outcome", ""),
            ("snow_substeps", "12"),
            ("snow_bound", "elastic_wave"),
            ("snow_bound_particle", ""),
            ("snow_mass", "0.3333333333333333"),
            ("cloth_error_rms", ""),
            ("load_floor_contacts", ""),
            ("load_a, \"b\"_force_x", "1e-7"),
            ("load_a, \"b\"_force_z", "1e21"),
            ("load_a, \"b\"_contacts", "4"),
        ] {
            assert_eq!(field(&fields, &colliders, column), expected, "{column}");
        }
        let without = row(&frame(None), &colliders);
        assert!(without[4..].iter().all(String::is_empty), "{without:?}");
        assert_eq!(field(&without, &colliders, "step"), "30");
    }
}
