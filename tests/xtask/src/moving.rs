//! The pictures of pages in the README and the guides, drawn by a browser from recordings that are made for them.

use std::{fs, path::Path, process::Command};

use crate::{
    shell::{Failure, Shell},
    web,
};

/// The picture above the fold: a cloth and two snowballs, side by side.
const MOVING: &str = "docs/images/moving.png";
/// A page as a whole.
const PAGE: &str = "docs/images/page.png";
/// A page that loads slowly is not looked at (bytes).
const MOST_BYTES: u64 = 2_000_000;
/// What is recorded: a scene, and how many steps lie between two frames.
const RECORDED: [(&str, &str); 2] = [("demo", "8"), ("two_snowballs", "1")];

/// Draws them, where Node, the page's packages and a browser are there.
pub(crate) fn draw(shell: &mut Shell) -> Result<(), Failure> {
    shell.step(MOVING, |shell| {
        shell.cargo("build the command", "build --release -p nappe-cli")?;
        let folder = shell.target().join("page");
        fs::create_dir_all(&folder)
            .map_err(|error| Failure(format!("{} cannot be made: {error}", folder.display())))?;
        let recordings = RECORDED.map(|(scene, _)| folder.join(format!("{scene}-picture.html")));
        for ((scene, interval), file) in RECORDED.iter().zip(&recordings) {
            let mut record = Command::new(shell.target().join("release/nappe"));
            record
                .args(["run", scene, "--frame-interval", interval, "--quiet", "--force", "--save"])
                .arg(file);
            shell.run(&format!("record {scene}"), &mut record)?;
        }

        let [cloth, snow] = recordings.map(|file| file.display().to_string());
        let both = [format!("{cloth}@0.12@4"), format!("{snow}@0@2")];
        let moving = ["--size", "440x300", "--count", "48", "--delay", "40"];
        web::picture(shell, MOVING, both.iter().map(String::as_str).chain(moving))?;
        web::picture(shell, PAGE, [format!("{cloth}@1.2").as_str(), "--size", "1200x760", "--page"])?;
        small(&shell.root().join(MOVING))
    })
}

fn small(file: &Path) -> Result<(), Failure> {
    let size = fs::metadata(file).map_or(0, |metadata| metadata.len());
    if size <= MOST_BYTES {
        return Ok(());
    }
    Err(Failure(format!("{} has {size} bytes, more than {MOST_BYTES}", file.display())))
}
