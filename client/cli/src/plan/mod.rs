//! A plan on its way out: its files, and what is said of it.
//!
//! Enters: a plan of a study. Leaves: plan.csv, plan.json and pictures in a folder, a scene; words on standard output.

pub(crate) mod words;
pub(crate) mod terms;
mod document;
pub(crate) mod scene;

use std::path::PathBuf;

use nappe_scene::Scene;
use nappe_study::Plan;
use serde::Serialize;

use crate::{
    chart::table,
    error::{CliError, Result},
    study::{HASH_OF, LookArgs, Subject, files},
};

/// Names of the files of a plan.
pub(crate) const FILES: [&str; 2] = ["plan", "terms"];

/// Writes the files of a plan into a folder; their paths.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(
    folder: &files::Folder,
    subject: &Subject,
    plan: &Plan,
    look: &LookArgs,
) -> Result<Vec<PathBuf>> {
    let document = serde_json::to_string_pretty(&document::document(subject, plan))
        .map_err(|error| CliError::failure(format!("cannot write the plan as JSON: {error}")))?;
    let files = [
        ("plan.csv".to_owned(), table::text(&subject.name, subject.threads, &plan.chart).into_bytes()),
        ("plan.json".to_owned(), (document + "\n").into_bytes()),
    ];
    folder.write(files.into_iter().chain(pictures(&subject.name, plan, look)?))
}

/// The first fields of a plan, the hash of its scene, and where its files are.
pub(crate) fn said(subject: &Subject, plan: &Plan, written: &[PathBuf]) -> impl Serialize {
    let rest = serde_json::json!({ "scene_hash": subject.scene_hash, "hash_of": HASH_OF, "files": written });
    document::Document::new(subject, plan, rest)
}

/// The text of the scene as a plan has it; none where nothing is right enough.
pub(crate) fn scene_text(name: &str, scene: &Scene, plan: &Plan) -> Option<String> {
    scene::planned(scene, name, plan).filter(|_| plan.is_met)
}

/// Pictures, each as SVG and PNG.
#[cfg(feature = "charts")]
fn pictures(scene: &str, plan: &Plan, look: &LookArgs) -> Result<Vec<(String, Vec<u8>)>> {
    nappe_charts::plan_pictures(scene, plan, &look.style())
        .map(files::of_pictures)
        .map_err(|error| CliError::failure(format!("cannot draw the plan: {error}")))
}

/// None: this build draws nothing, and says so.
#[cfg(not(feature = "charts"))]
fn pictures(_: &str, _: &Plan, _: &LookArgs) -> Result<Vec<(String, Vec<u8>)>> {
    files::note_without_pictures();
    Ok(Vec::new())
}
