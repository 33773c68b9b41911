//! What `--save` leaves: an earlier file is whole until the new one is, whatever ends the run, and a refused run leaves nothing.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Child, Stdio},
};

use crate::support::{Folder, SMALL_SCENE, command, end_by, folder, nappe_in, until, write_scene};

/// Every file and folder below a folder, with the bytes of the files.
pub(crate) fn contents(folder: &Path) -> BTreeMap<String, Option<Vec<u8>>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.is_dir() {
            let below = contents(&path).into_iter().map(|(file, bytes)| (format!("{name}/{file}"), bytes));
            found.extend(below);
            found.insert(name, None);
        } else {
            found.insert(name, Some(fs::read(&path).expect("a file")));
        }
    }
    found
}

/// A folder with a page and a folder of frames, each of four steps, and a scene that does not end.
fn earlier() -> Folder {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    for save in ["page.html", "frames"] {
        nappe_in(here.path(), &["run", &scene, "--steps", "4", "--save", save]).ok();
    }
    fs::write(here.path().join("frames/notes.txt"), "mine").expect("written");
    write_scene(here.path(), &SMALL_SCENE.replace("steps = 40", "steps = 0"));
    here
}

/// A run that goes on in the place of an earlier one, and has written a file.
pub(crate) fn begun(here: &Path, save: &str, file: &str) -> Child {
    let mut run = command();
    run.current_dir(here).args(["run", "scene.toml", "--force", "--save", save]);
    let run = run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    until("something is written", || fs::metadata(here.join(file)).is_ok_and(|file| file.len() > 0));
    run
}

const CASES: [(&str, &str); 2] =
    [("page.html", "page.html.new"), ("frames", "frames/frames.new/frame-000005.ply")];

#[test]
fn a_killed_run_leaves_the_earlier_files_whole_and_what_it_wrote_beside_them() {
    for (save, file) in CASES {
        let here = earlier();
        let before = contents(here.path());
        let mut run = begun(here.path(), save, file);
        run.kill().expect("it runs");
        run.wait().expect("it ends");
        let mut after = contents(here.path());
        assert!(after.contains_key(file), "{save}: what was written stays");
        after.retain(|name, _| !name.contains(".new"));
        assert!(after == before, "{save}: {:?} and {:?}", after.keys(), before.keys());

        // What a killed run left is in nobody's way.
        let next = ["run", "scene.toml", "--steps", "2", "--force", "--save", save];
        nappe_in(here.path(), &next).ok();
        let names: Vec<String> = contents(here.path()).into_keys().collect();
        let expected = match save {
            "frames" => {
                &["frames", "frames/frame-000000.ply", "frames/frame-000001.ply", "frames/notes.txt"][..]
            }
            _ => &[
                "frames",
                "frames/frame-000000.ply",
                "frames/frame-000001.ply",
                "frames/frame-000002.ply",
                "frames/notes.txt",
            ],
        };
        assert_eq!(names, [expected, &["page.html", "scene.toml"]].concat(), "{save}");
    }
}

#[test]
fn a_run_that_is_ended_takes_the_place_of_the_earlier_one() {
    for (save, file) in CASES {
        let here = earlier();
        let before = contents(here.path());
        let mut run = begun(here.path(), save, file);
        assert_eq!(end_by(&mut run, "INT"), Some(130));
        let after = contents(here.path());
        assert!(after.keys().all(|name| !name.contains(".new")), "{save}: {:?}", after.keys());
        let changed = if save == "frames" { "frames/frame-000005.ply" } else { "page.html" };
        assert!(after.contains_key(changed) && after.get(changed) != before.get(changed), "{save}");
        assert_eq!(after["frames/notes.txt"].as_deref(), Some(&b"mine"[..]));
    }
}

#[test]
fn a_refused_run_leaves_nothing_and_every_file_as_it_was() {
    let here = earlier();
    // The schema allows it, and only who builds the scene knows better.
    write_scene(here.path(), &SMALL_SCENE.replace("\"top_left\", \"top_right\"", "0, 144"));
    let before = contents(here.path());
    for (save, code) in
        [("page.html", 5), ("frames", 5), ("new.html", 5), ("a/b/frames", 5), ("nowhere/a.html", 1)]
    {
        let done = nappe_in(here.path(), &["run", "scene.toml", "--force", "--save", save]);
        assert_eq!(done.code, Some(code), "{save}: {done:?}");
        assert!(contents(here.path()) == before, "{save}: {:?}", contents(here.path()).keys());
    }
}

#[cfg(unix)]
#[test]
fn two_runs_do_not_write_one_page() {
    let here = earlier();
    let mut run = begun(here.path(), "other.html", "other.html.new");
    for force in [&[][..], &["--force"]] {
        let args = ["run", "scene.toml", "--steps", "2", "--save", "other.html"];
        let second = nappe_in(here.path(), &[&args[..], force].concat());
        assert_eq!(second.code, Some(1), "{second:?}");
        assert!(second.stderr.contains("other.html is being written by another run"), "{second:?}");
    }
    assert_eq!(end_by(&mut run, "INT"), Some(130));
    let page = fs::read_to_string(here.path().join("other.html")).expect("the page");
    assert!(page.lines().last().is_some_and(|line| line.contains("class=\"nappe-end\"")));
}
