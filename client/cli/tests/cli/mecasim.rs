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
    for key in ["energy", "max_stretch", "time"] {
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
