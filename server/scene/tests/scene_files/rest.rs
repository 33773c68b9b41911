//! `[rest]`, as scenes write it, and what of it is refused.

use nappe_scene::{NoMeshes, Rest, Scene};
use nappe_sim::cloth::RestSettings;

use crate::{SMALL, build, message, parse};

fn with(root: &str) -> String {
    SMALL.replace("dt = 0.01\n", &format!("dt = 0.01\n{root}\n"))
}

/// When cloth counts as calm in a scene that can be built.
fn settings(root: &str) -> Option<RestSettings> {
    let built = build(&with(root)).unwrap_or_else(|error| panic!("{error}"));
    built.setup.bodies[0].settings.rest
}

#[test]
fn the_time_over_which_an_error_adds_up_is_that_of_the_scene_unless_it_says_another() {
    assert_eq!(settings(""), None);
    let rest = "rest = { error = 1e-4 }";
    let lasts = settings(&format!("steps = 300\n{rest}")).expect("it is watched");
    assert!(lasts.error == 1e-4 && (lasts.within - 3.0).abs() < 1e-12, "{lasts:?}");
    let within = "rest = { error = 1e-4, within = 7 }";
    let expected = Some(RestSettings { error: 1e-4, within: 7.0, sleep: true });
    let awake = settings("rest = { error = 1e-4, within = 7, sleep = false }").expect("it is watched");
    assert!(!awake.sleep, "{awake:?}");
    assert_eq!([settings(within), settings(&format!("steps = 300\n{within}"))], [expected; 2]);
}

#[test]
fn a_scene_that_is_written_reads_the_same() {
    assert_eq!(parse(SMALL).expect("a scene").rest, None);
    for (root, rest) in [
        ("rest = { error = 1e-4, within = 7 }", Rest { error: 1e-4, within: Some(7.0), sleep: None }),
        (
            "rest = { error = 1e-4, within = 7, sleep = false }",
            Rest { error: 1e-4, within: Some(7.0), sleep: Some(false) },
        ),
        ("steps = 10\nrest = { error = 1 }", Rest { error: 1.0, within: None, sleep: None }),
    ] {
        let scene = parse(&with(root)).expect("a scene");
        assert_eq!(scene.rest, Some(rest));
        let again = Scene::parse(&scene.to_toml(), "again.toml").expect("a scene");
        assert_eq!(again.rest, scene.rest);
    }
    let scene = parse(&with("rest = { error = 1e-4, within = 7 }")).expect("a scene");
    let edited = scene.with_values(&[("rest.error".to_owned(), "0.002".to_owned())]);
    assert_eq!(
        edited.expect("the scene has that key").rest,
        Some(Rest { error: 0.002, within: Some(7.0), sleep: None })
    );
}

#[test]
fn what_cannot_be_watched_is_refused_with_its_key() {
    for (root, told) in [
        ("rest = { error = 1e-4 }", "rest.within: is missing"),
        ("steps = 10\nrest = {}", "rest.error: is missing"),
        ("steps = 10\nrest = { error = 0 }", "rest.error: is 0"),
        ("steps = 10\nrest = { error = -1e-4 }", "rest.error: is -"),
        ("steps = 10\nrest = { error = 1e-4, within = 0 }", "rest.within: is 0"),
        ("steps = 10\nrest = { error = 1e-4, speed = 1 }", "rest.speed"),
        ("steps = 10\nrest = { error = 1e-4, sleep = 1 }", "rest.sleep"),
    ] {
        let message = message(&with(root));
        assert!(message.contains(told), "{message}, not {told}");
    }
    let snow = "version = 1\ndt = 0.01\nsteps = 10\nrest = { error = 1e-4 }\n[snow]\ncell = 0.1\n[[snow.object]]\n\
        name = \"ball\"\nsphere = { center = [0, 1, 0], radius = 0.2 }\n";
    let message = message(snow);
    assert!(message.contains("rest: is for cloth, and the scene has snow alone"), "{message}");
}

#[test]
fn particles_that_are_watched_count_in_the_size_of_a_scene() {
    let watched = |root: &str| parse(&with(root)).expect("a scene").size(&NoMeshes).watched_particles;
    assert_eq!([watched(""), watched("rest = { error = 1e-4 }")], [0, 6]);
}
