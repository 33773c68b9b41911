//! `--save FILE.png` and `FILE.mp4`: a page that a browser draws, where one is there; and what is told where it is not, dies or
//! is asked for what there is not.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::support::{
    Done, SMALL_SCENE, Server, command, command_at, end_by, folder, nappe_in, run_to_end, skipped, until,
    write_scene,
};

/// What a browser of the family of Chromium is called.
const BROWSERS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];
/// A file of PNG begins so; its width follows after 8 bytes.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";

/// A browser on PATH, or `None` with a message where there is none.
fn browser() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let mut places = BROWSERS.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    let found = places.find(|place| place.is_file());
    if found.is_none() {
        skipped("no browser draws pictures: install Chromium or Chrome");
    }
    found
}

/// A program that does as told. A shell writes it: a file that a process of this test still holds open for writing cannot be
/// started.
fn script(folder: &Path, name: &str, what: &str) -> PathBuf {
    let path = folder.join(name);
    let write = ["-c", "printf '#!/bin/sh\\n%s\\n' \"$1\" > \"$2\" && chmod +x \"$2\"", "sh", what];
    let status = Command::new("sh").args(write).arg(&path).status();
    assert!(status.expect("there is a shell").success());
    path
}

/// The names in a folder.
fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
}

/// Width and height of a picture.
fn sides(png: &[u8]) -> [u32; 2] {
    assert!(png.starts_with(PNG), "it is a PNG");
    [16, 20].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes")))
}

/// PATH with a folder before it.
fn path_with(folder: &Path) -> std::ffi::OsString {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let all = std::iter::once(folder.to_owned()).chain(std::env::split_paths(&path));
    std::env::join_paths(all).expect("a path")
}

#[test]
fn without_a_browser_or_ffmpeg_it_is_said_what_to_install_before_anything_is_computed() {
    let here = folder();
    let path = here.path().join("nappe");
    let linked = fs::hard_link(command().get_program(), &path);
    linked.or_else(|_other_disk| fs::copy(command().get_program(), &path).map(drop)).expect("a second name");
    let alone = |browser: &str, save: &str| {
        let mut nappe = command_at(&path);
        nappe.current_dir(here.path()).env("PATH", here.path()).env("NAPPE_BROWSER", browser);
        run_to_end(nappe.args(["run", "flag", "--save", save]))
    };
    for (browser, save, parts) in [
        ("", "a.png", &["a picture needs a browser", "apt install chromium", "NAPPE_BROWSER=PATH"][..]),
        ("/nowhere/chromium", "a.png", &["NAPPE_BROWSER names /nowhere/chromium"]),
        ("", "a.mp4", &["a film is made by ffmpeg", "apt install ffmpeg"]),
    ] {
        if cfg!(target_os = "macos") && browser.is_empty() && save == "a.png" {
            continue;
        }
        let done = alone(browser, save);
        assert_eq!((done.code, done.stdout.as_str()), (Some(2), ""), "{save}: {done:?}");
        assert!(parts.iter().all(|part| done.stderr.contains(part)), "{done:?}");
    }
    assert_eq!(names(here.path()), BTreeSet::from(["nappe".to_owned()]));
}

#[test]
fn a_browser_that_dies_is_told_before_anything_is_computed_and_nothing_is_left() {
    let [here, programs] = [folder(), folder()];
    let scene = write_scene(here.path(), SMALL_SCENE);
    for (what, part) in [
        ("echo no screen here >&2; exit 3", "ended in Browser.getVersion (exit status: 3). Its last lines:"),
        ("echo no screen here >&2; kill -9 $$", "ended in Browser.getVersion (signal: 9"),
        (
            "echo no screen here >&2; printf 'what\\0' >&4; exec sleep 60",
            "failed in Browser.getVersion: expected",
        ),
    ] {
        let browser = script(programs.path(), "browser", what);
        let mut nappe = command();
        nappe.current_dir(here.path()).env("NAPPE_BROWSER", &browser);
        let done = run_to_end(nappe.args(["run", &scene, "--save", "a.png"]));
        assert_eq!((done.code, done.stdout.as_str()), (Some(1), ""), "{what}: {done:?}");
        assert!(done.stderr.contains(part) && done.stderr.contains("no screen here"), "{what}: {done:?}");
        assert_eq!(names(here.path()), BTreeSet::from(["scene.toml".to_owned()]), "{what}");
    }
}

#[test]
fn what_belongs_to_a_picture_is_told_where_there_is_none() {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    for (args, part) in [
        (&["--save", "a.html", "--at", "0.1"][..], "--at belongs to a picture FILE.png, and a.html is none"),
        (&["--save", "a.mp4", "--at", "0.1"], "--at belongs to a picture FILE.png, and a.mp4 is none"),
        (
            &["--size", "64x64"],
            "--size belongs to a picture FILE.png or a film FILE.mp4, and --save is missing",
        ),
        (&["--save", "a.csv", "--theme", "dark"], "--theme belongs to a picture"),
        (&["--save", "a.png", "--theme", "pink"], "[possible values: dark, light]"),
        (&["--save", "a.png", "--size", "64"], "'64' is no WIDTHxHEIGHT"),
        (&["--save", "a.png", "--at=-1"], "--at"),
        (&["--save", "a.mp4", "--size", "65x64"], "width and height of a film are even numbers"),
        (&["--save", "a.png", "--fields", "velocity"], "--fields belongs to"),
        (
            &["--save", "a.png", "--table", "a.png"],
            "--table a.png: a table is a file whose name ends in .csv",
        ),
        (&["--save", "a.jpg"], "a picture in .png, a film in .mp4"),
    ] {
        let done = nappe_in(here.path(), &[&["run", scene.as_str()][..], args].concat());
        assert!(done.code == Some(2) && done.stderr.contains(part), "{args:?}: {done:?}");
    }
    let watched = nappe_in(here.path(), &["watch", "first", "--save", "a.rrd", "--at", "1"]);
    assert!(watched.code == Some(2) && watched.stderr.contains("--at belongs to a picture"), "{watched:?}");
    fs::write(here.path().join("mine.png"), "mine").expect("a file");
    let browser = script(here.path(), "browser", "exit 3");
    let run = ["run", scene.as_str(), "--save", "mine.png"];
    let kept = run_to_end(command().current_dir(here.path()).env("NAPPE_BROWSER", &browser).args(run));
    assert!(kept.code == Some(1) && kept.stderr.contains("mine.png is there already"), "{kept:?}");
    let all = ["browser", "mine.png", "scene.toml"].map(str::to_owned);
    assert_eq!(names(here.path()), BTreeSet::from(all));
}

/// A run in a folder, drawn by a browser.
fn drawn(browser: &Path, here: &Path, args: &[&str]) -> Done {
    let mut nappe = command();
    nappe.current_dir(here).env("NAPPE_BROWSER", browser).args(["run", "scene.toml", "--size", "64x48"]);
    run_to_end(nappe.args(args))
}

#[test]
fn a_picture_is_that_of_its_instant_and_comes_again_bit_by_bit() {
    let Some(browser) = browser() else { return };
    let here = folder();
    // A sheet in free fall, which leaves its first view.
    write_scene(here.path(), &SMALL_SCENE.replace("pins = [\"top_left\", \"top_right\"]", ""));
    let read = |name: &str| fs::read(here.path().join(name)).expect("a picture");
    let told =
        drawn(&browser, here.path(), &["--save", "last.PNG", "--json", "--table", "t.csv"]).ok().json();
    assert_eq!((&told["saved"], &told["frames"]), (&"last.PNG".into(), &21.into()));
    let last = read("last.PNG");
    assert_eq!(sides(&last), [64, 48]);
    drawn(&browser, here.path(), &["--save", "end.png", "--at", "0.2"]).ok();
    assert!(read("end.png") == last, "the end is at 0.2 s");
    drawn(&browser, here.path(), &["--save", "first.png", "--at", "0"]).ok();
    assert!(read("first.png") != last, "it has moved since");
    drawn(&browser, here.path(), &["--save", "dark.png", "--theme", "dark"]).ok();
    assert!(read("dark.png") != last, "before another background");

    let late = drawn(&browser, here.path(), &["--save", "late.png", "--at", "0.3"]);
    assert!(late.code == Some(2) && late.stderr.contains("--at 0.3: the run ends at t = "), "{late:?}");
    let server = Server::start();
    let scene = here.path().join("scene.toml");
    server.nappe(&["create", scene.to_str().expect("UTF-8"), "--id", "first"]).ok();
    server.nappe(&["step", "first", "8"]).ok();
    let path = here.path().join("watched.png");
    let watch = ["watch", "first", "--from", "0", "--count", "2", "--size", "32x32", "--save"];
    let told = server.nappe(&[&watch[..], &[path.to_str().expect("UTF-8")]].concat()).ok().json();
    assert_eq!(told["frames"], 2);
    assert_eq!(sides(&read("watched.png")), [32, 32]);
    fs::remove_file(path).expect("it is there");

    let all = ["dark.png", "end.png", "first.png", "last.PNG", "scene.toml", "t.csv"].map(str::to_owned);
    assert_eq!(names(here.path()), BTreeSet::from(all), "nothing else is left");
}

#[test]
fn a_film_has_a_picture_of_every_frame_and_one_that_fails_is_told() {
    let Some(browser) = browser() else { return };
    let [here, programs] = [folder(), folder()];
    write_scene(here.path(), SMALL_SCENE);
    // In place of ffmpeg: it keeps the pictures as they come, and what it was asked for.
    let keep = "for out; do :; done; printf '%s\\n' \"$@\" > asked; exec cat > \"$out\"";
    script(programs.path(), "ffmpeg", keep);
    let film = |save: &str| {
        let mut nappe = command();
        nappe.current_dir(here.path()).env("NAPPE_BROWSER", &browser).env("PATH", path_with(programs.path()));
        run_to_end(nappe.args([
            "run",
            "scene.toml",
            "--steps",
            "16",
            "--frame-interval",
            "4",
            "--size",
            "32x32",
            "--save",
            save,
        ]))
    };
    let done = film("a.mp4").ok();
    assert!(done.stderr.contains("drawing 5 pictures of 32x32 for a.mp4"), "{done:?}");
    let bytes = fs::read(here.path().join("a.mp4")).expect("what ffmpeg made");
    assert!(bytes.starts_with(PNG));
    assert_eq!(bytes.windows(PNG.len()).filter(|window| *window == PNG).count(), 5);
    let asked = fs::read_to_string(here.path().join("asked")).expect("its arguments");
    let rate = asked.lines().skip_while(|word| *word != "-framerate").nth(1).expect("a rate");
    let rate: f64 = rate.parse().expect("a number");
    assert!((rate - 50.0).abs() < 1e-6, "a frame every 20 ms: {asked}");

    script(programs.path(), "ffmpeg", "echo no such codec >&2; exit 9");
    let failed = film("b.mp4");
    assert_eq!(failed.code, Some(1), "{failed:?}");
    assert!(
        failed.stderr.contains("(exit status: 9)") && failed.stderr.contains("no such codec"),
        "{failed:?}"
    );
    let all = ["a.mp4", "asked", "scene.toml"].map(str::to_owned);
    assert_eq!(names(here.path()), BTreeSet::from(all));
}

#[test]
fn a_run_that_the_user_ends_is_drawn_as_far_as_it_came() {
    let Some(browser) = browser() else { return };
    let here = folder();
    write_scene(here.path(), &SMALL_SCENE.replace("steps = 40", "steps = 0"));
    let mut nappe = command();
    nappe.current_dir(here.path()).env("NAPPE_BROWSER", &browser);
    nappe.args(["run", "scene.toml", "--frame-interval", "100", "--size", "32x32", "--save", "a.png"]);
    let mut run = nappe.stdout(std::process::Stdio::null()).spawn().expect("it starts");
    // Another one may not take the name meanwhile.
    until("the page is begun", || {
        fs::metadata(here.path().join("a.png.new.page/page.html.new")).is_ok_and(|page| page.len() > 0)
    });
    let second = drawn(&browser, here.path(), &["--save", "a.png"]);
    assert!(
        second.code == Some(1) && second.stderr.contains("is being written by another run"),
        "{second:?}"
    );
    assert_eq!(end_by(&mut run, "INT"), Some(130));
    assert_eq!(sides(&fs::read(here.path().join("a.png")).expect("a picture")), [32, 32]);
    assert_eq!(names(here.path()), BTreeSet::from(["a.png", "scene.toml"].map(str::to_owned)));
}
