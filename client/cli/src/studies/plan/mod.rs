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
    studies::{
        chart::{document::compared, table},
        study::{Contents, Folder, HASH_OF, LookArgs, Subject},
    },
    words::error::Result,
};

/// Names of the files of a plan.
pub(crate) const FILES: [&str; 2] = ["plan", "terms"];

/// Writes the files of a plan into a folder; their paths.
///
/// # Errors
/// What cannot be drawn, and a file that cannot be written.
pub(crate) fn write(
    folder: &Folder,
    subject: &Subject,
    plan: &Plan,
    look: &LookArgs,
) -> Result<Vec<PathBuf>> {
    let contents = Contents {
        name: "plan",
        table: table::text(&subject.name, subject.threads, &plan.chart),
        document: Some(document::document(subject, plan)),
        #[cfg(feature = "charts")]
        draw: &|style| nappe_charts::plan_pictures(&subject.name, plan, &subject.styled(style)),
    };
    folder.write(look, contents)
}

/// The first fields of a plan, the hash of its scene, and where its files are.
pub(crate) fn said(subject: &Subject, plan: &Plan, written: &[PathBuf]) -> impl Serialize {
    let rest = serde_json::json!({
        "compared": compared(&plan.chart),
        "scene_hash": subject.scene_hash,
        "hash_of": HASH_OF,
        "files": written,
    });
    document::Document::new(subject, plan, rest)
}

/// The text of the scene as a plan has it; none where nothing is accurate enough.
pub(crate) fn scene_text(name: &str, scene: &Scene, plan: &Plan) -> Option<String> {
    scene::planned(scene, name, plan).filter(|_| plan.is_met)
}
