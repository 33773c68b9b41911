//! `nappe scenes`: the scenes that come with nappe, or with a server.

use clap::Args;

use crate::{
    error::Result,
    output::{self, Column, Format, OutputArgs},
    scene,
};

/// List the scenes that come with nappe
#[derive(Args, Debug)]
pub(crate) struct ScenesArgs {
    /// Print the text of this scene, as a start for one's own
    #[arg(value_name = "SCENE")]
    name: Option<String>,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe scenes`.
///
/// # Errors
/// When there is no scene of this name.
pub(crate) fn run(args: &ScenesArgs) -> Result<()> {
    if let Some(name) = &args.name {
        let text = scene::shipped_text(name)?;
        return match args.output.format() {
            Format::Json => output::json(&serde_json::json!({ "name": name, "text": text })),
            Format::Text => output::line(text.trim_end()),
        };
    }
    let scenes = scene::shipped()?;
    match args.output.format() {
        Format::Json => output::json(&scenes),
        Format::Text => {
            let rows: Vec<Vec<String>> = scenes
                .iter()
                .map(|scene| vec![scene.name.to_owned(), scene.steps.to_string(), scene.title.clone()])
                .collect();
            let columns = [Column::Left("scene"), Column::Right("steps"), Column::Left("title")];
            output::line(&output::table(&columns, &rows))?;
            output::line("\n`nappe run NAME` computes one; `nappe scenes NAME` prints its text.")
        }
    }
}
