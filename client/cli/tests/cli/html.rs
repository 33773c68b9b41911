//! `--save FILE.html`: a page with its frames, which are read back and compared with PLY files of the same run.

use std::{fs, path::Path};

use base64::{Engine as _, engine::general_purpose::STANDARD};
use nappe_client::packed::{Step, unpack};
use serde_json::{Value, json};

use crate::{
    run::DIVERGING_SCENE,
    support::{SMALL_SCENE, Server, folder, nappe_in, write_scene},
};

/// What an HTML file holds.
struct Page {
    head: Value,
    blocks: Vec<Value>,
    end: Option<Value>,
}

impl Page {
    /// Reads a file, as far as it is whole.
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).expect("the file");
        let mut page = Self { head: Value::Null, blocks: Vec::new(), end: None };
        for element in text.split("<script type=\"application/json\" class=\"nappe-").skip(1) {
            let (class, rest) = element.split_once("\">").expect("a class");
            let (content, _) = rest.split_once("</script>\n").expect("a whole element");
            let value = serde_json::from_str(content).expect("JSON");
            match class {
                "head" => page.head = value,
                "block" => page.blocks.push(value),
                "end" => page.end = Some(value),
                other => panic!("an element of class {other}"),
            }
        }
        page
    }

    /// All frames: their numbers, the bound of their positions, and the positions.
    fn frames(&self) -> Vec<(u64, f64, Vec<f32>)> {
        let particles = self.head["particles"].as_u64().expect("a count") as usize;
        let mut frames = Vec::new();
        for block in &self.blocks {
            let step = step(&block["step"]);
            assert_eq!(block["bound"], step.bound());
            let mut base: Option<Vec<i32>> = None;
            for frame in list(&block["frames"]) {
                let bytes = STANDARD.decode(frame["positions"].as_str().expect("a text")).expect("base64");
                let numbers = unpack(&bytes, particles, 3, base.as_deref()).expect("a packed array");
                let number = frame["frame"].as_u64().expect("a number");
                frames.push((number, step.bound(), step.restore(&numbers)));
                base = Some(numbers);
            }
        }
        frames
    }
}

fn step(size: &Value) -> Step {
    let size = size.as_f64().expect("a number");
    let step = Step::new(size.log2() as i32).expect("a step");
    assert_eq!(step.size(), size, "a power of two");
    step
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}

/// Positions of a PLY file of a frame.
fn ply(path: &Path, particles: usize) -> Vec<f32> {
    let bytes = fs::read(path).expect("a frame");
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|window| window == end).expect("a header") + end.len();
    let header = String::from_utf8_lossy(&bytes[..start]);
    let width = 4 * header.lines().filter(|line| line.starts_with("property float")).count();
    let vertices = bytes[start..start + particles * width].chunks_exact(width);
    let number = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().expect("four bytes"));
    vertices.flat_map(|vertex| vertex[..12].chunks_exact(4).map(number)).collect()
}

#[test]
fn every_frame_lies_within_the_bound_that_the_file_states() {
    for scene in ["demo", "flag", "two_snowballs"] {
        let here = folder();
        let run = |save: &str| {
            let args = ["run", scene, "--steps", "40", "--frame-interval", "1", "--json", "--save", save];
            nappe_in(here.path(), &args).ok().json()
        };
        let (html, plain) = (run("page.html"), run("frames"));
        assert_eq!(html["state_hash"], plain["state_hash"], "{scene}: the same bits");
        let page = Page::read(&here.path().join("page.html"));
        let sizes: Vec<usize> = page.blocks.iter().map(|block| list(&block["frames"]).len()).collect();
        assert_eq!(sizes, [32, 9], "{scene}");
        let frames = page.frames();
        for (index, (number, bound, positions)) in frames.iter().enumerate() {
            assert_eq!(*number, index as u64, "{scene}");
            let path = here.path().join(format!("frames/frame-{number:06}.ply"));
            let exact = ply(&path, positions.len() / 3);
            let far = |(a, b): (&f32, &f32)| (f64::from(*a) - f64::from(*b)).abs();
            let worst = positions.iter().zip(&exact).map(far).fold(0.0, f64::max);
            assert!(worst <= *bound && worst > 0.25 * bound, "{scene}, frame {number}: {worst} for {bound}");
        }
        let end = page.end.expect("an end");
        assert_eq!(
            (&end["hash"], &end["frames"], &end["finished"]),
            (&html["state_hash"], &41.into(), &true.into())
        );
        assert_eq!(end["failure"], Value::Null, "{scene}");
        let color = &page.head["color"];
        assert_eq!(color, &if scene == "two_snowballs" { "plastic_ratio".into() } else { Value::Null });
    }
}

#[test]
fn a_body_has_the_colour_that_its_scene_gives() {
    let here = folder();
    let colored = |color: &str| {
        let name = "name = \"sheet\"";
        write_scene(here.path(), &SMALL_SCENE.replace(name, &format!("{name}\n{color}")))
    };
    for (text, expected) in [("color = [1.0, 0.5, 0]", json!([255, 128, 0])), ("", Value::Null)] {
        nappe_in(here.path(), &["run", &colored(text), "--save", "c.html", "--force"]).ok();
        assert_eq!(Page::read(&here.path().join("c.html")).head["bodies"][0]["color"], expected, "{text}");
    }
    let refused = nappe_in(here.path(), &["check", &colored("color = [1.0, 2.0, 0.0]")]);
    assert_ne!(refused.code, Some(0), "{refused:?}");
    assert!(refused.stderr.contains("color") && refused.stderr.contains("0 to 1"), "{refused:?}");
}

#[test]
fn texts_cannot_leave_their_place_and_an_error_that_is_allowed_is_kept() {
    let here = folder();
    let evil = "</script><script>alert(1)</script>";
    let scene =
        write_scene(here.path(), &SMALL_SCENE.replace("title = \"small\"", &format!("title = \"{evil}\"")));
    nappe_in(here.path(), &["run", &scene, "--save", "a.html", "--max-error", "0.003"]).ok();
    let text = fs::read_to_string(here.path().join("a.html")).expect("the file");
    assert!(!text.contains("<script>alert"), "a title that is run");
    let page = Page::read(&here.path().join("a.html"));
    assert_eq!(page.head["title"], evil);
    assert!(page.head["scene"].as_str().is_some_and(|scene| scene.contains(evil)), "the scene's text");
    // The largest power of two below 0.006.
    assert_eq!(
        (page.head["bound"].as_f64(), page.blocks[0]["step"].as_f64()),
        (Some(1.0 / 512.0), Some(1.0 / 256.0))
    );
    let body = &page.head["bodies"][0];
    let triangles = STANDARD.decode(body["triangles"]["data"].as_str().expect("a text")).expect("base64");
    let count = body["triangles"]["count"].as_u64().expect("a count") as usize;
    assert_eq!(unpack(&triangles, count, 3, None).map(|indices| indices.len()), Ok(3 * 2 * 11 * 11));
    assert_eq!(list(&body["pins"]).len(), 2);
    assert_eq!(page.frames().len(), 21);
}

/// Four points and four triangles.
const PYRAMID: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

#[test]
fn a_mesh_collider_is_in_the_head_with_its_points_and_triangles() {
    let here = folder();
    fs::write(here.path().join("pyramid.obj"), PYRAMID).expect("the mesh is written");
    let collider = r#"
[[collider]]
name = "pyramid"
mesh = { file = "pyramid.obj", transform = { scale = 0.1, translate = [2, -1, 0] } }
velocity = [0, 0.5, 0]
"#;
    let scene = write_scene(here.path(), &format!("{SMALL_SCENE}{collider}"));
    nappe_in(here.path(), &["run", &scene, "--steps", "2", "--save", "page.html"]).ok();
    let page = Page::read(&here.path().join("page.html"));
    let collider = &page.head["colliders"][0];
    assert_eq!((&collider["name"], &collider["velocity"][1]), (&"pyramid".into(), &0.5.into()));
    let shape = &collider["shape"];
    assert_eq!((&shape["kind"], &shape["origin"]), (&"mesh".into(), &json!([2.0, -1.0, 0.0])));

    let bytes = |value: &Value| STANDARD.decode(value.as_str().expect("a text")).expect("base64");
    let packed = bytes(&shape["points"]);
    let (words, _) = packed.as_chunks::<4>();
    let numbers: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
    let (points, _) = numbers.as_chunks::<3>();
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
    assert_eq!(sorted, [[2.0, -1.0, 0.0], [2.0, -1.0, 0.1], [2.0, -0.9, 0.0], [2.1, -1.0, 0.0]]);

    assert_eq!(shape["triangles"]["count"], 4);
    let corners = unpack(&bytes(&shape["triangles"]["data"]), 4, 3, None).expect("a packed array");
    let (triangles, _) = corners.as_chunks::<3>();
    // Six times the volume, which is above 0 where triangles are turned outwards.
    let volume: f32 =
        triangles.iter().map(|triangle| six_volumes(triangle.map(|i| points[i as usize]))).sum();
    assert!((volume - 1e-3).abs() < 1e-6, "{volume}");
}

/// A box that turns by 90 degrees about y and rises by 0.1 m in the 40 steps of the small scene, and a ball that only moves.
const TURNING: &str = r#"
[[collider]]
name = "box"
box = { center = [0, -2, 0], size = [0.4, 0.2, 0.1] }

[[collider.key]]
time = 0
position = [0, -2, 0]

[[collider.key]]
time = 0.2
position = [0, -1.9, 0]
turn = [0, 1, 0, 1]

[[collider]]
name = "ball"
sphere = { center = [0, -3, 0], radius = 0.2 }
velocity = [0, 0, 0.5]
"#;

#[test]
fn each_frame_says_where_a_turning_box_is() {
    let here = folder();
    let scene = write_scene(here.path(), &format!("{SMALL_SCENE}{TURNING}"));
    nappe_in(here.path(), &["run", &scene, "--save", "page.html"]).ok();
    let page = Page::read(&here.path().join("page.html"));
    let frames: Vec<&Value> = page.blocks.iter().flat_map(|block| list(&block["frames"])).collect();
    assert_eq!(frames.len(), 21);
    for at in [0, 10, 20] {
        let [pose] = list(&frames[at]["poses"]) else { panic!("the ball has a velocity: {}", frames[at]) };
        assert_eq!(pose["name"], "box");
        let share = at as f64 / 20.0;
        let (sin, cos) = (share * std::f64::consts::FRAC_PI_4).sin_cos();
        for (told, expected) in
            [("position", &[0.0, -2.0 + 0.1 * share, 0.0][..]), ("turn", &[0.0, sin, 0.0, cos])]
        {
            let numbers = list(&pose[told]).iter().map(|number| number.as_f64().expect("a number"));
            let far = numbers.zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(far < 1e-12 && list(&pose[told]).len() == expected.len(), "frame {at}: {pose}");
        }
    }

    let plain = write_scene(here.path(), SMALL_SCENE);
    nappe_in(here.path(), &["run", &plain, "--save", "plain.html"]).ok();
    let plain = Page::read(&here.path().join("plain.html"));
    assert_eq!(plain.blocks[0]["frames"][0]["poses"], Value::Null);
}

/// Six times the volume between a triangle and the origin.
fn six_volumes([a, b, c]: [[f32; 3]; 3]) -> f32 {
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

#[test]
fn scenes_that_reach_far_are_kept_as_finely_as_they_can_be() {
    let here = folder();
    let far = SMALL_SCENE.replace("mass =", "transform = { translate = [20000, 0, 0] }\nmass =");
    let scene = write_scene(here.path(), &far);
    let done = nappe_in(here.path(), &["run", &scene, "--steps", "4", "--save", "far.html"]).ok();
    assert!(done.stderr.contains("from frame 0 on") && done.stderr.contains("far.html"), "{done:?}");
    let frames = Page::read(&here.path().join("far.html")).frames();
    let (_, bound, positions) = &frames[frames.len() - 1];
    assert!(*bound < 0.002 && (20_000.0 - f64::from(positions[0])).abs() < 1.0, "{bound} {}", positions[0]);
}

#[test]
fn a_bound_that_grows_again_and_again_is_told_at_once_and_in_one_line_at_the_end() {
    let here = folder();
    let scene = write_scene(here.path(), DIVERGING_SCENE);
    let done = nappe_in(here.path(), &["run", &scene, "--save", "far.html"]);
    assert_eq!(done.code, Some(3), "{done:?}");
    let steps: Vec<f64> =
        Page::read(&here.path().join("far.html")).frames().iter().map(|frame| frame.1).collect();
    let grew = steps.windows(2).filter(|pair| pair[0] < pair[1]).count();
    assert!(grew > 1, "it grows {grew} times");
    let last = steps[steps.len() - 1];
    let told: Vec<&str> = done.stderr.lines().filter(|line| line.contains("far.html")).collect();
    assert_eq!(told.len(), 2, "{}", done.stderr);
    assert!(told[0].contains("on, far.html holds positions within"), "{}", done.stderr);
    assert!(told[1].ends_with(&format!("far.html grew {grew} times, to {last} m")), "{}", done.stderr);
}

#[test]
fn a_diverged_run_says_in_its_page_where_and_why() {
    let here = folder();
    let scene = write_scene(here.path(), DIVERGING_SCENE);
    let done = nappe_in(here.path(), &["run", &scene, "--json", "--save", "failed.html"]);
    assert_eq!(done.code, Some(3), "{done:?}");
    let diverged = &done.json()["diverged"];
    let page = Page::read(&here.path().join("failed.html"));
    let (frames, end) = (page.frames(), page.end.expect("an end"));
    assert!(!frames.is_empty(), "the frames until then");
    assert_eq!((&end["finished"], &end["hash"]), (&false.into(), &Value::Null));
    let failure = &end["failure"];
    assert_eq!(failure["diverged"], true, "{failure}");
    for (name, named) in
        [("reason", "cause"), ("step", "step"), ("particle", "particle"), ("message", "message")]
    {
        assert_eq!(failure[name], diverged[named], "{name}: {failure}");
    }
    assert!(failure["time"].as_f64().is_some_and(|time| time > 0.0), "{failure}");

    // Who watches such a session from elsewhere is told the same.
    let server = Server::start();
    server.nappe(&["create", &scene, "--id", "lost"]).ok();
    server.nappe(&["play", "lost"]).ok();
    let file = here.path().join("watched.html");
    let path = file.to_str().expect("UTF-8");
    let watched = server.nappe(&["watch", "lost", "--save", path, "--from", "0"]);
    assert_ne!(watched.code, Some(0), "{watched:?}");
    let end = Page::read(&file).end.expect("an end");
    assert_eq!((&end["failure"]["reason"], &end["failure"]["step"]), (&failure["reason"], &failure["step"]));
}

#[test]
fn what_cannot_be_written_is_named() {
    let here = folder();
    fs::create_dir(here.path().join("folder.html")).expect("a folder");
    let cases: &[&str] = if cfg!(target_os = "linux") {
        std::os::unix::fs::symlink("/dev/full", here.path().join("full.html")).expect("a link");
        &["folder.html", "nowhere/a.html", "full.html"]
    } else {
        &["folder.html", "nowhere/a.html"]
    };
    for path in cases {
        let done = nappe_in(here.path(), &["run", "flag", "--steps", "40", "--save", path]);
        assert_eq!((done.code, done.stdout.as_str()), (Some(1), ""), "{done:?}");
        assert!(done.stderr.contains("cannot write") && done.stderr.contains(path), "{done:?}");
    }
    for options in [["--max-error", "0"], ["--max-error", "nan"], ["--grid", "smoke"], ["--fields", "stress"]]
    {
        let done = nappe_in(here.path(), &[&["run", "flag", "--save", "a.html"][..], &options].concat());
        assert_eq!(done.code, Some(2), "{options:?}: {done:?}");
    }
}

#[test]
fn a_session_elsewhere_is_watched_into_a_page() {
    let server = Server::start();
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    server.nappe(&["create", &scene, "--id", "seen"]).ok();
    server.nappe(&["step", "seen", "40"]).ok();
    let file = here.path().join("seen.html");
    let path = file.to_str().expect("UTF-8");
    let done = server.nappe(&["watch", "seen", "--save", path, "--from", "0"]).ok().json();
    assert_eq!((&done["frames"], &done["saved"]), (&21.into(), &path.into()));
    assert_eq!(Page::read(&file).frames().len(), 21);

    // Who mistypes keeps what he had, and is left with no file where there was none.
    let kept = fs::read(&file).expect("the page");
    let refused = server.nappe(&["watch", "nobody", "--save", path, "--force"]);
    assert_eq!((refused.code, fs::read(&file).expect("the page") == kept), (Some(5), true), "{refused:?}");
    let other = here.path().join("other.html");
    let refused = server.nappe(&["watch", "nobody", "--save", other.to_str().expect("UTF-8")]);
    assert_eq!((refused.code, other.exists()), (Some(5), false), "{refused:?}");
    let refused = server.nappe(&["watch", "seen", "--save", path]);
    assert_eq!((refused.code, fs::read(&file).expect("the page") == kept), (Some(1), true), "{refused:?}");
    assert!(refused.stderr.contains("seen.html is there already: --force overwrites it"), "{refused:?}");

    // Speeds are in the newest frame alone: nobody asked for them before.
    server.nappe(&["watch", "seen", "--save", path, "--force", "--color", "speed"]).ok();
    let page = Page::read(&file);
    assert_eq!((&page.head["color"], &page.head["scene"]), (&"speed".into(), &Value::Null));
    let frames = list(&page.blocks[0]["frames"]);
    let bytes = STANDARD.decode(frames[0]["scalar"].as_str().expect("a text")).expect("base64");
    assert_eq!(unpack(&bytes, 144, 1, None).map(|speeds| speeds.len()), Ok(144));
    assert_eq!(page.end.expect("an end")["finished"], true);
}

#[test]
fn the_demo_writes_a_small_page_over_its_own_and_no_other() {
    let here = folder();
    nappe_in(here.path(), &["demo", "--steps", "4"]).ok();
    let done = nappe_in(here.path(), &["demo"]).ok();
    assert!(done.stdout.contains("open nappe-demo.html in a browser"), "{}", done.stdout);
    let bytes = fs::metadata(here.path().join("nappe-demo.html")).expect("the page").len();
    assert!(bytes <= 3_000_000, "{bytes} bytes");
    let refused = nappe_in(here.path(), &["demo", "--steps", "4", "--save", "nappe-demo.html"]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("nappe-demo.html is there already"), "{refused:?}");
}
