//! Pictures of studies for a paper: their style, and the profile of several scenes.

use std::{collections::BTreeMap, fs, path::Path};

use serde_json::Value;

use crate::support::{SMALL_SCENE, check_pictures, folder, nappe, nappe_in, write_scene};

/// What a picture for a column of a journal is asked for.
const STYLE: [&str; 7] =
    ["--width", "85", "--title", "Cloth & snow", "--font", "Libertinus Sans", "--no-caption"];

/// An element of text of a graphic.
struct Words {
    at: [f64; 2],
    size: f64,
    /// Whether it starts, ends or has its middle there.
    anchor: String,
    is_upwards: bool,
    text: String,
}

fn words(svg: &str) -> Vec<Words> {
    let elements = svg.split("<text ").skip(1).filter_map(|rest| rest.split_once("</text>"));
    let read = |(element, _): (&str, &str)| {
        let (head, text) = element.split_once('>').expect("the end of a tag");
        let value = |name: &str| {
            let (_, rest) = head.split_once(&format!("{name}=\"")).expect("an attribute");
            rest.split_once('"').expect("its end").0
        };
        let number = |name: &str| value(name).parse::<f64>().expect("a number");
        let anchor = value("text-anchor").to_owned();
        let is_upwards = head.contains("rotate(-90");
        Words {
            at: [number("x"), number("y")],
            size: number("font-size"),
            anchor,
            is_upwards,
            text: text.to_owned(),
        }
    };
    elements.map(read).collect()
}

/// How wide words are, about as the widest of usual fonts has them.
fn width(text: &str, size: f64) -> f64 {
    let share = |letter: char| match letter {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ' ' => 0.32,
        'f' | 'r' | 't' | '(' | ')' | '-' => 0.40,
        'm' | 'w' => 0.97,
        _ => 0.63,
    };
    size * text.replace("&amp;", "&").chars().map(share).sum::<f64>()
}

/// A picture for a column has the style that it was asked for, and all its words are inside it.
fn check_style(svg: &str, file: &str) {
    let (head, _) = svg.split_once('>').expect("a tag");
    assert!(
        head.contains(" width=\"85mm\"") && head.contains("&apos;Libertinus Sans&apos;"),
        "{file}: {head}"
    );
    let (_, frame) = head.split_once("viewBox=\"0 0 ").expect("a frame");
    let frame: Vec<f64> =
        frame.split(['"', ' ']).take(2).map(|side| side.parse().expect("a number")).collect();
    let words = words(svg);
    assert!(words.iter().any(|words| words.text == "Cloth &amp; snow"), "{file} has its title");
    for Words { at: [x, y], size, anchor, is_upwards, text } in words {
        let long = width(&text, size);
        let back = match anchor.as_str() {
            "start" => 0.0,
            "middle" => 0.5 * long,
            _ => long,
        };
        let [left, right, above, below] = if is_upwards {
            [x - size, x + 3.0, y - long + back, y + back]
        } else {
            [x - back, x - back + long, y - size, y + 3.0]
        };
        let is_inside = left >= -1.0 && right <= frame[0] + 1.0 && above >= -1.0 && below <= frame[1] + 1.0;
        assert!(is_inside, "{file}: {text} at {x}, {y} of {frame:?}");
        assert!(size >= 10.0 && !text.contains("Filled marks"), "{file}: {text}, {size} px");
    }
}

/// The files that a study says that it wrote.
fn files(said: &Value) -> Vec<&str> {
    said["files"].as_array().expect("files").iter().filter_map(Value::as_str).collect()
}

#[test]
fn pictures_for_a_column_have_their_title_their_font_no_caption_and_all_words_inside() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let methods = ["--method", "symplectic_euler,velocity_verlet_pc,implicit_euler_absolute"];
    let studies: [&[&str]; 3] = [
        &["chart", &scene, "--until", "0.02", "--budget", "20s"],
        &["plan", &scene, "--until", "0.02", "--budget", "20s", "--tolerance", "1mm"],
        &["stability", &scene, "--until", "0.02", "--budget", "20s", "--cells", "2"],
    ];
    for study in studies {
        let out = ["--json", "--out", study[0]];
        let done = nappe_in(folder.path(), &[study, &methods, &STYLE, &out].concat()).ok();
        let said = done.json();
        let files = files(&said);
        check_pictures(folder.path(), &files);
        let is_graphic = |file: &&&str| Path::new(**file).extension().is_some_and(|end| end == "svg");
        let graphics: Vec<_> = files.iter().filter(is_graphic).collect();
        assert!(!graphics.is_empty(), "{files:?}");
        for file in graphics {
            check_style(&fs::read_to_string(folder.path().join(file)).expect("a picture"), file);
        }
        if study[0] != "stability" {
            assert_eq!(said["scene_hash"].as_str().map(str::len), Some(16), "{said}");
            assert_eq!(said["hash_of"], "the text of the scene file, xxh3 64");
        }
    }
}

/// The least seconds and counts of each method and precision in a chart.csv, of runs within a millimetre.
fn cheapest(table: &Path) -> BTreeMap<(String, String), (f64, u64)> {
    let text = fs::read_to_string(table).expect("a chart");
    let mut found = BTreeMap::new();
    for row in text.lines().skip(1) {
        let fields: Vec<&str> = row.split(',').collect();
        let number = |place: usize| fields[place].parse::<f64>().ok();
        let is_right = number(6).is_some_and(|error| error <= 1e-3) && fields[10] == "ok";
        // The scene as it is written is no row of a method.
        if !is_right || fields[21] == "true" {
            continue;
        }
        let seconds = number(7).expect("seconds");
        let count = fields[8].parse::<u64>().expect("a count") + fields[9].parse::<u64>().expect("a count");
        let best = found.entry((fields[1].to_owned(), fields[2].to_owned())).or_insert((seconds, count));
        *best = (best.0.min(seconds), best.1.min(count));
    }
    found
}

#[test]
fn several_scenes_have_a_chart_each_and_a_profile_of_what_is_in_these() {
    let folder = folder();
    let first = write_scene(folder.path(), SMALL_SCENE);
    let second = folder.path().join("soft.toml");
    fs::write(&second, SMALL_SCENE.replace("200.0", "50.0")).expect("a scene");
    let second = second.to_str().expect("a temporary path is UTF-8");
    let args = ["chart", &first, second, "--out", "out", "--until", "0.02", "--budget", "20s", "--json"];
    let done =
        nappe_in(folder.path(), &[&args[..], &["--method", "symplectic_euler,velocity_verlet"]].concat());
    let said = done.ok().json();
    let scenes: Vec<_> =
        said["scenes"].as_array().expect("scenes").iter().map(|scene| scene["scene"].as_str()).collect();
    assert_eq!(scenes, [Some("scene"), Some("soft")]);
    let files = files(&said);
    for file in ["out/scene/chart.csv", "out/soft/work_precision.svg", "out/profile.json", "out/profile.png"]
    {
        assert!(files.contains(&file), "{file} in {files:?}");
    }
    check_pictures(folder.path(), &files);

    let out = folder.path().join("out");
    let profile = fs::read_to_string(out.join("profile.csv")).expect("a profile");
    let mut lines = profile.lines();
    let columns = "scene,method,precision,seconds_per_simulated_second,seconds_ratio,counts,counts_ratio";
    assert_eq!(lines.next(), Some(columns));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    for scene in ["scene", "soft"] {
        let known = cheapest(&out.join(scene).join("chart.csv"));
        let least = known.values().map(|(seconds, _)| *seconds).fold(f64::INFINITY, f64::min);
        let fewest = known.values().map(|(_, count)| *count).min().expect("a method is right");
        for ((method, precision), (seconds, count)) in &known {
            let row = rows.iter().find(|row| row[..3] == [scene, method, precision]).expect("a row");
            let number = |place: usize| row[place].parse::<f64>().expect("a number");
            assert_eq!([number(3), number(4)], [*seconds, seconds / least], "{row:?}");
            assert_eq!([number(5), number(6)], [*count as f64, *count as f64 / fewest as f64], "{row:?}");
        }
    }
    let document = fs::read_to_string(out.join("profile.json")).expect("a document");
    let document: Value = serde_json::from_str(&document).expect("JSON");
    assert_eq!(document["methods"].as_array().map(Vec::len), Some(4), "{document}");
    let kept = nappe_in(folder.path(), &["chart", &first, second, "--out", "out", "--budget", "1s"]);
    assert!(kept.stderr.contains("profile.csv is there already: --force overwrites it"), "{kept:?}");
}

#[test]
fn what_no_picture_can_have_is_refused_before_anything_is_computed() {
    let folder = folder();
    let refused = |args: &[&str], part: &str| {
        let done = nappe_in(folder.path(), &[&["chart", "--out", "out"], args].concat());
        assert_eq!(done.code, Some(2), "{args:?}: {done:?}");
        assert!(done.stderr.contains(part), "{args:?}: {}", done.stderr);
    };
    refused(&["drap10", "--width", "20"], "'20' is not a width from 80 to 300 mm");
    refused(&["drap10", "--font", "A;B"], "'A;B' is not the name of a font");
    refused(&["drap10", "--title", "two\nlines"], "a title is one line");
    refused(&["drap10", "flag", "drap10"], "two scenes are called drap10");
    refused(&["drap10", "brasseur"], "brasseur is snow and drap10 is cloth");
    refused(&["drap10", "flag", "--until", "0.00012"], "drap10: --until:");
    assert!(!folder.path().join("out").exists(), "nothing was computed");
    let gallery = nappe(&["stability", "--gallery", "--width", "85"]);
    assert_eq!(gallery.code, Some(2), "{gallery:?}");
    assert!(gallery.stderr.contains("from 160 mm on"), "{}", gallery.stderr);
}
