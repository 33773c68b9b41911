//! The pages of HTML recordings and of the server: their types and tests, whether the committed files are what their
//! source makes, and what a browser shows of recordings and of a running server.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::shell::{Failure, Shell};

/// Where their source is.
const FOLDER: &str = "viewer/web";
/// Where the client is that a page calls the server with.
const CLIENT: &str = "client/typescript";
/// The files that the command and the server hold.
const PAGES: [&str; 2] = ["viewer/web/dist/replay.html", "viewer/web/dist/live.html"];
/// Who runs recordings in a browser.
const BROWSERS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];
/// What is recorded to be looked at, and how many steps: cloth, in several blocks of frames, and snow with cloth.
const RECORDINGS: [(&str, &str); 2] = [("demo", "260"), ("snow_and_cloth", "150")];

/// Where the shipped scenes are, and how many steps of each are recorded to be looked at.
const SCENES: &str = "server/scenes";
const BOXES_STEPS: &str = "150";

/// Checks the pages, as far as Node, their packages and a browser are there.
pub(crate) fn page(shell: &mut Shell) -> Result<(), Failure> {
    let (node, npm) = (shell.find("node"), shell.find("npm"));
    let (Some(node), Some(npm)) = (node, npm) else {
        shell.skip("page", "Node is not installed (Debian package npm)");
        return Ok(());
    };
    for folder in [FOLDER, CLIENT] {
        if !shell.root().join(folder).join("node_modules").is_dir() {
            shell.skip("page", &format!("its packages are not installed: npm ci --prefix {folder}"));
            return Ok(());
        }
    }
    shell.step("page", |shell| {
        for script in ["check", "test"] {
            shell.run(&format!("page: {script}"), &mut run(&npm, script))?;
        }
        built(shell, &npm)?;
        browsers(shell, &node)
    })
}

fn run(npm: &Path, script: &str) -> Command {
    let mut command = Command::new(npm);
    command.args(["--prefix", FOLDER, "run", "--silent", script]);
    command
}

/// Builds them again: the committed bytes must come out.
fn built(shell: &mut Shell, npm: &Path) -> Result<(), Failure> {
    let root = shell.root().to_owned();
    let read = |page: &str| {
        fs::read(root.join(page)).map_err(|error| Failure(format!("{page} cannot be read: {error}")))
    };
    let committed = PAGES.into_iter().map(read).collect::<Result<Vec<_>, _>>()?;
    shell.run("page: build", &mut run(npm, "build"))?;
    for (page, before) in PAGES.into_iter().zip(committed) {
        if read(page)? != before {
            return Err(Failure(format!(
                "{page} is not what its source makes; it is now: look at the change and commit it"
            )));
        }
    }
    Ok(())
}

/// Opens recordings from disk, and the page of the built server, in a browser without a screen.
fn browsers(shell: &mut Shell, node: &Path) -> Result<(), Failure> {
    let Some(browser) = browser(shell) else {
        shell.skip("page in a browser", "Chromium is not installed (Debian package chromium)");
        return Ok(());
    };
    let folder = shell.target().join("page");
    fs::create_dir_all(&folder)
        .map_err(|error| Failure(format!("{} cannot be made: {error}", folder.display())))?;
    let nappe = shell.target().join("release/nappe");
    let server = shell.target().join("release/nappe-server");
    let mut all = script(node, &browser, "all", &server);
    for (scene, steps) in RECORDINGS {
        let file = folder.join(format!("{scene}.html"));
        let mut record = Command::new(&nappe);
        record.args(["run", scene, "--steps", steps, "--json", "--force", "--save"]).arg(&file);
        shell.run(&format!("page: record {scene}"), &mut record)?;
        all.arg(&file);
    }
    shell.run("page: recordings and a server, in one browser", &mut all)
}

/// Opens one recording in a browser, where Node, its packages and a browser are there.
pub(crate) fn show(shell: &mut Shell, title: &str, file: &Path) -> Result<(), Failure> {
    in_a_browser(shell, title, |node, browser| script(node, browser, "browser", file))
}

/// Loads and closes the page of the built server a hundred times.
pub(crate) fn loads(shell: &mut Shell) -> Result<(), Failure> {
    let server = shell.target().join("release/nappe-server");
    in_a_browser(shell, "page: loads", |node, browser| {
        let mut command = script(node, browser, "live", &server);
        command.args(["--only", "loads"]);
        command
    })
}

/// Records every shipped scene, and counts the pixels of its bodies that lie under boxes of its page.
pub(crate) fn boxes(shell: &mut Shell) -> Result<(), Failure> {
    const TITLE: &str = "page: bodies under boxes";
    let packages = shell.root().join(FOLDER).join("node_modules").is_dir();
    if !packages || shell.find("node").is_none() || browser(shell).is_none() {
        shell.skip(TITLE, "Node, its packages or Chromium are not installed");
        return Ok(());
    }
    let unread = |error| Failure(format!("the shipped scenes cannot be listed: {error}"));
    let listed = fs::read_dir(shell.root().join(SCENES)).map_err(unread)?;
    let mut scenes: Vec<PathBuf> =
        listed.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>().map_err(unread)?;
    scenes.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    scenes.sort();

    let folder = shell.target().join("page");
    fs::create_dir_all(&folder)
        .map_err(|error| Failure(format!("{} cannot be made: {error}", folder.display())))?;
    let nappe = shell.target().join("release/nappe");
    let mut files = Vec::with_capacity(scenes.len());
    for path in scenes {
        let Some(scene) = path.file_stem().and_then(|name| name.to_str()) else { continue };
        let file = folder.join(format!("{scene}.html"));
        let mut record = Command::new(&nappe);
        record.args(["run", scene, "--steps", BOXES_STEPS, "--json", "--force", "--save"]).arg(&file);
        shell.run(&format!("page: record {scene}"), &mut record)?;
        files.push(file);
    }
    in_a_browser(shell, TITLE, |node, browser| {
        let mut command = Command::new(node);
        command.arg(format!("{FOLDER}/tests/boxes.mjs")).args(&files).env("CHROMIUM", browser);
        command
    })
}

/// Draws recordings into a picture, where Node, its packages and a browser are there.
pub(crate) fn picture<'a>(
    shell: &mut Shell,
    out: &str,
    arguments: impl IntoIterator<Item = &'a str>,
) -> Result<(), Failure> {
    in_a_browser(shell, out, |node, browser| {
        let mut command = script(node, browser, "picture", Path::new(out));
        command.args(arguments);
        command
    })
}

/// Runs a command of Node and a browser, where both and the page's packages are there.
fn in_a_browser(
    shell: &mut Shell,
    title: &str,
    command: impl FnOnce(&Path, &Path) -> Command,
) -> Result<(), Failure> {
    let packages = shell.root().join(FOLDER).join("node_modules").is_dir();
    match (shell.find("node"), browser(shell)) {
        (Some(node), Some(browser)) if packages => shell.run(title, &mut command(&node, &browser)),
        _ => {
            shell.skip(title, "Node, its packages or Chromium are not installed");
            Ok(())
        }
    }
}

fn browser(shell: &Shell) -> Option<PathBuf> {
    BROWSERS.iter().find_map(|name| shell.find(name))
}

/// A script of the pages' tests on a recording, or on a program.
fn script(node: &Path, browser: &Path, name: &str, file: &Path) -> Command {
    let mut command = Command::new(node);
    command.arg(format!("{FOLDER}/tests/{name}.mjs")).arg(file).env("CHROMIUM", browser);
    command
}
