//! Names that are typed wrongly: what is near is said, or what there is.

use std::fs;

use crate::support::{SMALL_SCENE, Server, folder, nappe, nappe_in, write_scene};

/// The command ends with this code and says all of these parts.
#[track_caller]
fn says(args: &[&str], code: i32, parts: &[&str]) {
    let done = nappe(args);
    assert_eq!(done.code, Some(code), "{args:?}: {done:?}");
    for part in parts {
        assert!(done.stderr.contains(part), "'{part}' is missing after {args:?}: {}", done.stderr);
    }
    assert!(done.stdout.is_empty(), "{done:?}");
}

#[test]
fn a_scene_that_is_not_there_gets_the_nearest_one() {
    for verb in [&["run"][..], &["scenes"], &["chart"], &["stability"], &["plan", "--tolerance", "1mm"]] {
        for (typed, near) in [("flga", "flag"), ("FLAG", "flag"), ("two-snowballs", "two_snowballs")] {
            let wanted = format!("no scene '{typed}' comes with nappe; did you mean '{near}'?");
            says(&[verb, &[typed]].concat(), 1, &[&wanted, "`nappe scenes` lists them"]);
        }
    }
    says(&["run", "nothing"], 1, &["no scene 'nothing' comes with nappe; allowed: demo, ", ", flag, "]);
}

#[test]
fn a_file_that_is_not_there_and_is_called_as_a_scene_is_told_so() {
    let here = folder();
    for verb in [&["run"][..], &["chart"], &["plan", "--tolerance", "1mm"]] {
        for typed in ["flag.toml", "FLAG.toml"] {
            let done = nappe_in(here.path(), &[verb, &[typed]].concat());
            assert_eq!(done.code, Some(1), "{done:?}");
            let told = format!("there is no file {typed}; 'flag' is a scene that comes with nappe");
            assert!(done.stderr.contains(&told), "{}", done.stderr);
        }
    }
    let own = nappe_in(here.path(), &["run", "own.toml"]);
    assert_eq!(own.code, Some(1), "{own:?}");
    assert!(own.stderr.contains("own.toml: ") && !own.stderr.contains("comes with"), "{}", own.stderr);
    fs::write(here.path().join("own.toml"), SMALL_SCENE).expect("a scene");
    let own = nappe_in(here.path(), &["run", "own"]);
    assert_eq!(own.code, Some(1), "{own:?}");
    assert!(own.stderr.contains("there is a file own.toml"), "{}", own.stderr);
}

#[test]
fn a_verb_that_is_not_there_gets_those_that_are_near() {
    for (typed, near) in
        [("server", "'serve'"), ("srve", "'serve'"), ("forc", "'fork'"), ("watchh", "'watch'")]
    {
        says(&[typed], 2, &[near]);
    }
}

#[test]
fn a_scene_in_the_place_of_a_verb_is_told_how_it_is_run() {
    for typed in ["flag", "two_snowballs", "my.toml"] {
        says(&[typed], 2, &[&format!("'{typed}' is a scene: nappe run {typed}")]);
    }
    let done = nappe(&["flags"]);
    assert!(done.code == Some(2) && !done.stderr.contains("nappe run"), "{done:?}");
}

#[test]
fn a_place_for_frames_says_which_endings_there_are() {
    let all = "an HTML page ends in .html, a Rerun recording in .rrd";
    for (typed, near) in [
        ("x.htm", "--save x.htm: no frames are kept in a .htm; did you mean '.html'?"),
        ("x.rdr", "did you mean '.rrd'?"),
        ("x.alembic", "allowed: .html, .rrd"),
    ] {
        says(&["run", "flag", "--save", typed], 2, &[near, all]);
        says(&["watch", "first", "--save", typed], 2, &[near, all]);
    }
}

#[test]
fn a_key_of_a_sweep_gets_the_nearest_one_wherever_it_stands() {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    for (set, told) in [
        ("gravty=1", "did you mean 'gravity'?"),
        ("body.sheet.springs.bend.stifness=1", "did you mean 'body.sheet.springs.bend.stiffness'?"),
        ("springs.bend.stiffness=1", "did you mean 'body.sheet.springs.bend.stiffness'?"),
        ("drga=1", "did you mean 'body.sheet.drag'?"),
        ("gravity.y=1", "allowed: gravity.0, gravity.1, gravity.2"),
    ] {
        let done = nappe_in(here.path(), &["sweep", &scene, "--set", set, "--out", "out"]);
        assert_eq!(done.code, Some(2), "{done:?}");
        assert!(done.stderr.contains(told), "{}", done.stderr);
    }
    assert!(!here.path().join("out").exists(), "nothing was computed");
}

#[test]
fn particles_have_the_names_of_the_scene_wherever_they_have_numbers() {
    let here = folder();
    let rope = "[[body]]\nname = \"rope\"\nmesh = { chain = 5, spacing = 0.1 }\nmass = { particle = 0.01 }\n\
        pins = [\"last\"]\nsprings = { stretch = { stiffness = 100.0 } }\n";
    let two = SMALL_SCENE.replace("steps = 40", "steps = 0") + rope;
    let (scene, server) = (write_scene(here.path(), &two), Server::start());
    // What is named has the bits of what is numbered: the sheet has 12 x 12 particles, the rope comes after it.
    let pairs = [
        ["--pin", "top_left=0,0.5,0:0.05", "0=0,0.5,0:0.05"],
        ["--pin", "sheet:top_right=0.5,0.5,0", "11=0.5,0.5,0"],
        ["--pin", "last=0,1,0:0.1", "148=0,1,0:0.1"],
        ["--pin", "rope:4=0,1,0:0.1", "148=0,1,0:0.1"],
        ["--force", "sheet:bottom_right=0,0.5,0", "sheet:143=0,0.5,0"],
        ["--force", "rope:first=0,0.5,0", "rope:0=0,0.5,0"],
    ];
    for (number, [option, named, numbered]) in pairs.into_iter().enumerate() {
        let hashes = [named, numbered].map(|change| {
            let id = format!("pair-{number}-{}", usize::from(change == named));
            server.nappe(&["create", &scene, "--id", &id]).ok();
            server.nappe(&["update", &id, option, change]).ok();
            let stepped = server.nappe(&["step", &id, "8"]).ok().json()["state_hash"].clone();
            server.nappe(&["delete", &id]).ok();
            stepped
        });
        assert!(hashes[0].is_string(), "{hashes:?}");
        assert_eq!(hashes[0], hashes[1], "{named} is {numbered}");
    }
    server.nappe(&["create", &scene, "--id", "here"]).ok();
    let changes = [
        ("--pin", "top_lft=0,0,0", "did you mean 'top_left'?"),
        ("--pin", "top=0,0,0", "--pin top: sends 12 particles to one point"),
        ("--pin", "shet:top_left=0,0,0", "no body is named 'shet'; did you mean 'sheet'?"),
        ("--pin", "rope:top_left=0,0,0", "the particle of body 'rope' is 'top_left'; allowed: first, last"),
        ("--pin", "sheet:144=0,0,0", "the particle of body 'sheet' is 144; allowed: 0 to 143"),
        ("--force", "sheet:lft=0,0,0", "did you mean 'left'?"),
    ];
    for (option, change, told) in changes {
        let refused = server.nappe(&["update", "here", option, change]);
        assert_eq!(refused.code, Some(2), "{refused:?}");
        assert!(refused.stderr.contains(told), "{}", refused.stderr);
    }
    server.nappe(&["create", "two_snowballs", "--id", "snow"]).ok();
    let refused = server.nappe(&["update", "snow", "--pin", "top_left=0,0,0"]);
    assert!(refused.stderr.contains("no body has a particle 'top_left'"), "{}", refused.stderr);
}

#[test]
fn a_measure_of_a_sweep_names_a_particle_as_the_scene_does() {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    let measures = "body.sheet.particle.bottom_left.y,body.sheet.particle.132.y";
    let args = [
        "sweep",
        &scene,
        "--set",
        "gravity.1=-1,-9.81",
        "--steps",
        "8",
        "--out",
        "out",
        "--measure",
        measures,
    ];
    nappe_in(here.path(), &args).ok();
    let rows = fs::read_to_string(here.path().join("out/sweep.csv")).expect("a table");
    let mut rows = rows.lines().map(|row| row.split(',').map(str::to_owned).collect::<Vec<_>>());
    let head = rows.next().expect("names of columns");
    let place = |name: &str| head.iter().position(|column| column == name).expect(name);
    let [named, numbered] = ["body.sheet.particle.bottom_left.y", "body.sheet.particle.132.y"].map(place);
    for row in rows {
        assert_eq!(row[named], row[numbered], "{row:?}");
        assert!(row[named].parse::<f64>().is_ok_and(|y| y < 0.0), "it falls: {row:?}");
    }
}

#[test]
fn an_address_needs_no_scheme() {
    let server = Server::with(&["--address", "localhost:0"]);
    let place = server.url.strip_prefix("http://127.0.0.1:").expect("it listens on loopback");
    for typed in [format!("localhost:{place}"), format!("127.0.0.1:{place}"), server.url.clone()] {
        let listed = nappe(&["list", "--json", "--server", &typed]).ok();
        assert_eq!(listed.json(), serde_json::json!([]), "{typed}");
        let run = nappe(&["run", "flag", "--steps", "2", "--json", "--server", &typed]).ok();
        assert_eq!(run.json()["steps"], 2, "{typed}");
    }
    says(&["serve", "--address", "localhost"], 2, &["localhost:6277", "unix:PATH"]);
    says(
        &["view", "first", "--connect", "http://localhost:9876"],
        2,
        &["a Rerun viewer is reached at localhost:9876"],
    );
}
