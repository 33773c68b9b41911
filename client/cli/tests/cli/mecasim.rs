//! `nappe mecasim` on the course's own data, where they are.

use std::{fs, path::Path};

use serde_json::Value;

use crate::support::{Done, course, folder, nappe_in};

/// An object file as the course writes them, for one of its meshes.
fn object_text(course: &Path, name: &str) -> String {
    let has_textures = course.join("data").join(name).join("texcoord.eti").exists();
    let textures =
        if has_textures { format!("Textures=./data/{name}/texcoord.eti;  \n") } else { String::new() };
    format!(
        "# {name}\nPoints=./data/{name}/points.eti;  \nFaceSet=./data/{name}/faceset.eti; \n\
         Masses=./data/{name}/masses.eti;\n{textures}k=15000.0;\nnu=0.01;\nrho0=1000;\ndt=0.0025;\n\
         Integration=explicite;\nNbIterVitImpl=5;\nInteraction=yes;\nUseTexture={};\n",
        i32::from(has_textures)
    )
}

/// Runs the course's command line from the course's folder, as the course does.
fn mecasim(course: &Path, meshes: &[&str], more: &[&str]) -> Done {
    let folder = folder();
    let kinds: Vec<String> = (1..=meshes.len()).map(|i| format!("objet{i}=mss;\n")).collect();
    let kinds = kinds.concat();
    let simu = folder.path().join("scene.simu");
    fs::write(&simu, format!("NbIter=20;\nGx=0.0;\nGy=-9.8;\nGz=0;\nviscosite=0.995;\n{kinds}"))
        .expect("written");
    let mut args = vec!["mecasim".to_owned(), meshes.len().to_string(), simu.display().to_string()];
    for (i, mesh) in meshes.iter().enumerate() {
        let path = folder.path().join(format!("object{}", i + 1));
        fs::write(&path, object_text(course, mesh)).expect("written");
        args.push(path.display().to_string());
    }
    args.extend(more.iter().map(|&arg| arg.to_owned()));
    args.push("--json".to_owned());
    nappe_in(course, &args.iter().map(String::as_str).collect::<Vec<_>>())
}

fn check_summary(name: &str, result: &Value, particles: u64) {
    assert_eq!((&result["steps"], &result["particles"]), (&20.into(), &particles.into()), "{name}: {result}");
    assert!(result["diverged"].is_null(), "{name}: {result}");
    for key in ["energy_at_end", "max_stretch", "time"] {
        assert!(result[key].as_f64().is_some_and(f64::is_finite), "{name}: {key} in {result}");
    }
}

#[test]
fn the_courses_objects_run_and_stay_finite() {
    let Some(course) = course() else { return };
    for (name, particles) in [
        ("drap10", 100),
        ("drap70", 4900),
        ("vache", 4315),
        ("sphere", 162),
        ("bunny", 435),
        ("pantalon", 943),
    ] {
        let result = mecasim(&course, &[name], &[]).ok().json();
        check_summary(name, &result, particles);
    }
}

#[test]
fn two_objects_share_a_scene() {
    let Some(course) = course() else { return };
    let result = mecasim(&course, &["drap10", "sphere"], &[]).ok().json();
    check_summary("drap10 and sphere", &result, 262);
}

#[test]
fn threads_change_no_bit_of_a_course_object() {
    let Some(course) = course() else { return };
    let hash = |threads: &str| {
        mecasim(&course, &["drap10"], &["--threads", threads]).ok().json()["state_hash"].clone()
    };
    assert_eq!(hash("1"), hash("2"));
}

#[test]
fn the_courses_viscosity_counts_only_when_asked_for() {
    let Some(course) = course() else { return };
    let hash = |more: &[&str]| mecasim(&course, &["drap10"], more).ok().json()["state_hash"].clone();
    assert_ne!(hash(&[]), hash(&["--viscosity"]));
}

#[test]
fn the_sweater_lacks_a_mass_and_runs_once_it_is_given() {
    let Some(course) = course() else { return };
    let refused = mecasim(&course, &["pull"], &[]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    for part in ["masses.eti", "1467", "1468", "--missing-mass"] {
        assert!(refused.stderr.contains(part), "'{part}' is missing in: {}", refused.stderr);
    }
    let result = mecasim(&course, &["pull"], &["--missing-mass", "1"]).ok().json();
    check_summary("pull", &result, 1468);
}

#[test]
fn kinds_out_of_scope_and_wrong_counts_are_refused_by_name() {
    let Some(course) = course() else { return };
    let folder = folder();
    let simu = folder.path().join("scene.simu");
    fs::write(&simu, "NbIter=20;\nobjet1=sph;\n").expect("written");
    let object = folder.path().join("object1");
    fs::write(&object, object_text(&course, "drap10")).expect("written");
    let (simu, object) = (simu.display().to_string(), object.display().to_string());
    let refused = nappe_in(&course, &["mecasim", "1", &simu, &object]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("sph"), "{}", refused.stderr);
    let miscounted = nappe_in(&course, &["mecasim", "2", &simu, &object]);
    assert_eq!(miscounted.code, Some(2), "{miscounted:?}");
    assert!(miscounted.stderr.contains('2') && miscounted.stderr.contains('1'), "{}", miscounted.stderr);
}

#[test]
fn an_object_file_that_is_not_there_is_named() {
    let folder = folder();
    let done = nappe_in(folder.path(), &["mecasim", "1", "no.simu", "no.object"]);
    assert_eq!(done.code, Some(1), "{done:?}");
    assert!(done.stderr.contains("no.simu"), "{}", done.stderr);
}

/// The files of two cloths of our own, in the course's formats; the second takes half of the steps of the first.
fn cloths(folder: &Path) -> [&'static str; 3] {
    for (name, size) in [("small", "5x5"), ("large", "8x6")] {
        let grid = ["mesh", "grid", size, "--spacing", "0.1", "--course", "--out"];
        nappe_in(folder, &[&grid[..], &[&format!("data/{name}")]].concat()).ok();
        fs::write(folder.join(name), object_text(folder, name)).expect("written");
    }
    let steps = |text: String| text.replace("dt=0.0025", "dt=0.005").replace("15000.0", "150.0");
    fs::write(folder.join("large"), steps(object_text(folder, "large"))).expect("written");
    fs::write(folder.join("scene.simu"), "NbIter=20;\nGx=0.0;\nGy=-9.8;\nGz=0;\nobjet1=mss;\nobjet2=mss;\n")
        .expect("written");
    ["scene.simu", "small", "large"]
}

#[test]
fn a_scene_that_is_written_runs_with_the_bits_of_the_courses_files() {
    let folder = folder();
    let [simu, small, large] = cloths(folder.path());
    let two = ["mecasim", "2", simu, small, large, "--json"];
    for more in [&[][..], &["--integrator", "bdf2", "--steps", "7", "--precision", "f64"]] {
        let here = |args: &[&str]| nappe_in(folder.path(), args).ok();
        let computed = here(&[&two[..], more].concat()).json();
        let written = here(&[&two[..], more, &["--write", "my.toml", "--force"]].concat()).json();
        assert_eq!(written["written"], serde_json::json!(["my-small.ply", "my-large.ply", "my.toml"]));
        // The course's files are not needed any more.
        let other = crate::support::folder();
        for file in ["my-small.ply", "my-large.ply", "my.toml"] {
            fs::copy(folder.path().join(file), other.path().join(file)).expect("it is written");
        }
        let run = nappe_in(other.path(), &["run", "my.toml", "--json"]).ok().json();
        for key in ["state_hash", "steps", "time", "particles", "springs", "precision"] {
            assert_eq!(run[key], computed[key], "{key} with {more:?}");
        }
    }
    let text = fs::read_to_string(folder.path().join("my.toml")).expect("the scene");
    assert!(text.starts_with("# Made by `nappe mecasim` of scene.simu and small, large.\n"), "{text}");
    assert_eq!(text.matches("integrator = \"bdf2\"").count(), 2, "{text}");
}

#[test]
fn the_courses_own_cloth_is_written_with_its_bits() {
    let Some(course) = course() else { return };
    let folder = folder();
    let scene = folder.path().join("my.toml").display().to_string();
    let computed = mecasim(&course, &["drap10"], &[]).ok().json();
    mecasim(&course, &["drap10"], &["--write", &scene]).ok();
    let run = nappe_in(folder.path(), &["run", &scene, "--json"]).ok().json();
    assert_eq!((&run["state_hash"], &run["steps"]), (&computed["state_hash"], &20.into()));
}

#[test]
fn a_scene_that_cannot_be_written_leaves_every_file_as_it_was() {
    let folder = folder();
    let [simu, small, _] = cloths(folder.path());
    let write = |path: &str, more: &[&str]| {
        let args = ["mecasim", "1", simu, small, "--write", path];
        nappe_in(folder.path(), &[&args[..], more].concat())
    };
    let names = || {
        let entries =
            fs::read_dir(folder.path()).expect("a folder").map(|entry| entry.expect("one").file_name());
        let mut names: Vec<_> = entries.collect();
        names.sort();
        names
    };
    let before = names();
    for (path, more, code, part) in [
        ("my.json", &[][..], 2, "--write my.json: a scene file ends in .toml"),
        ("nowhere/my.toml", &[], 1, "nowhere"),
        ("my.toml", &["--save", "my.html"], 2, "--save"),
        ("my.toml", &["--integrator", "leapfrog"], 2, "velocity_verlet"),
    ] {
        let done = write(path, more);
        assert_eq!(done.code, Some(code), "{path} {more:?}: {done:?}");
        assert!(done.stderr.contains(part), "{path} {more:?}: {}", done.stderr);
        assert_eq!(names(), before, "{path} {more:?}");
    }
    // One of the files is there: none is written.
    fs::write(folder.path().join("my-small.ply"), "mine").expect("written");
    let refused = write("my.toml", &[]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("my-small.ply is there already: --force overwrites it"), "{refused:?}");
    assert!(!folder.path().join("my.toml").exists());
    let done = write("my.toml", &["--force"]).ok();
    assert!(done.stdout.contains("`nappe run my.toml`"), "{}", done.stdout);
    let refused = write("my.toml", &[]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
}

#[test]
fn a_warning_of_a_file_that_is_named_twice_is_one_line() {
    let folder = folder();
    let [simu, small, _] = cloths(folder.path());
    let text = fs::read_to_string(folder.path().join(small)).expect("the object");
    fs::write(folder.path().join(small), text + "colour=3;\n").expect("written");
    let done = nappe_in(folder.path(), &["mecasim", "2", simu, small, small, "--write", "my.toml"]).ok();
    let told: Vec<&str> = done.stderr.lines().filter(|line| line.contains("'colour'")).collect();
    assert_eq!(told.len(), 1, "{}", done.stderr);
    assert!(told[0].ends_with("(2 times)"), "{}", done.stderr);
}
