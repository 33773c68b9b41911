//! A performance profile: on what share of several scenes each method is within a factor of the cheapest (Dolan and Moré 2002).

use nappe_study::profile::{Line, Profile};

use crate::{
    canvas::{Axis, Canvas},
    key::Sample,
    labels::Labels,
    lines::trace,
    look::{self, Look, NAMED, NUMBER},
    picture::Picture,
    style::Style,
    words::{length, listed, within},
};

/// The largest ratio that is drawn, at least.
const LEAST: f64 = 2.0;
/// Room beyond the largest ratio, as a factor, and above the largest share.
const BEYOND: f64 = 1.05;
const TOP: f64 = 1.04;

/// The upper corners of a method's steps: ratios, ascending, and on what share of the scenes it is within them.
fn tops(line: &Line) -> Vec<[f64; 2]> {
    let mut ratios: Vec<f64> = line.ratios().collect();
    ratios.sort_by(f64::total_cmp);
    let share = |ratio: f64| line.within(ratio) as f64 / line.costs.len() as f64;
    ratios.into_iter().map(|ratio| [ratio, share(ratio)]).collect()
}

/// All corners of its steps until an end; none where it is nowhere accurate enough.
fn corners(line: &Line, end: f64) -> Vec<[f64; 2]> {
    let mut corners = Vec::new();
    let mut share = 0.0;
    for [ratio, next] in tops(line) {
        // What is the cheapest somewhere begins at its share.
        if ratio > 1.0 {
            corners.push([ratio, share]);
        }
        corners.push([ratio, next]);
        share = next;
    }
    corners.extend((!corners.is_empty()).then_some([end, share]));
    corners
}

/// On what share of several scenes each method is within a factor of the cheapest that is accurate enough.
///
/// # Errors
/// What the plotter cannot make pixels of.
pub fn picture(profile: &Profile, style: &Style) -> Result<Picture, String> {
    let end = profile.largest_ratio().max(LEAST) * BEYOND;
    let x = Axis { label: "cost over that of the cheapest", range: [1.0, end], is_log: true };
    let y = Axis { label: "share of scenes", range: [0.0, TOP], is_log: false };
    let title = format!(
        "{} scenes: cost within {}, over that of the cheapest",
        profile.scenes.len(),
        length(profile.tolerance)
    );
    let mut canvas = Canvas::new("profile", title, sentence(profile), [x, y], style);
    let lines = looks(profile);
    let mut labels = Labels::default();
    // The best are drawn above the others.
    for (line, look) in lines.iter().rev() {
        let tops = tops(line);
        trace(&mut canvas, (*look, line.precision), &corners(line, end), &tops);
        for top in tops {
            labels.keep_off(canvas.at(top));
        }
    }
    for (line, look) in &lines {
        let number = canvas.key.number(&line.name, Sample::of(*look));
        let places = middles(&canvas, &corners(line, end));
        labels.number(&mut canvas, number, &places, look.map_or(NUMBER, |look| look.colour));
    }
    canvas.finish()
}

/// The lines that are accurate enough somewhere, with the looks of the best of them.
fn looks(profile: &Profile) -> Vec<(&Line, Option<Look>)> {
    let mut methods: Vec<&str> = Vec::new();
    let mut lines = Vec::new();
    for (place, line) in profile.lines.iter().filter(|line| line.ratios().next().is_some()).enumerate() {
        if place >= NAMED {
            lines.push((line, None));
            continue;
        }
        let number = methods.iter().position(|name| *name == line.name).unwrap_or_else(|| {
            methods.push(&line.name);
            methods.len() - 1
        });
        lines.push((line, Some(look::of(number))));
    }
    lines
}

/// The middles (px) of the level pieces of a line, the last one first.
fn middles(canvas: &Canvas, corners: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let level = corners.windows(2).rev().filter(|pair| pair[0][1] == pair[1][1]);
    let middle = |pair: &[[f64; 2]]| {
        let [from, to] = [canvas.at(pair[0]), canvas.at(pair[1])];
        [f64::midpoint(from[0], to[0]), from[1]]
    };
    level.map(middle).collect()
}

fn sentence(profile: &Profile) -> String {
    let tolerance = length(profile.tolerance);
    // Of several that are alike the first one, which is the best.
    let most = |factor: f64| {
        let best = profile.lines.iter().rev().max_by_key(|line| line.within(factor));
        best.filter(|line| line.within(factor) > 0)
            .map(|line| (format!("{} in {}", within(&line.name), line.precision), line.within(factor)))
    };
    let of = profile.scenes.len();
    let unsolved = profile.unsolved();
    let best = match (most(1.0), most(2.0)) {
        (Some((cheapest, count)), Some((near, more))) => format!(
            "{cheapest} is the cheapest on {count} of {of}, {near} takes at most twice as long as the cheapest on {more}."
        ),
        _ => "No method is on any.".to_owned(),
    };
    let unsolved = if unsolved.is_empty() {
        String::new()
    } else {
        format!(" On {} nothing is; they count for no method.", listed(&unsolved))
    };
    let cut = if profile.cut.is_empty() {
        String::new()
    } else {
        format!(" Out of time: not every method was followed to its end on {}.", listed(&profile.cut))
    };
    format!(
        "On what share of {of} scenes a method is within {tolerance} in at most so many times the seconds of the cheapest that is (Dolan and Moré 2002). {best}{unsolved}{cut} Filled marks are f64, hollow ones f32; numbers are named below the data."
    )
}

#[cfg(test)]
mod tests {
    use nappe_sim::math::Precision;
    use nappe_study::profile::Cost;

    use super::*;

    /// A method on four scenes, with ratios on some of them.
    fn line(name: &str, precision: Precision, ratios: &[f64]) -> Line {
        let cost = |place: usize| Cost { seconds_ratio: ratios.get(place).copied(), ..Cost::default() };
        let (method, name) = (name.to_owned(), name.to_owned());
        Line { method, name, precision, costs: (0..4).map(cost).collect() }
    }

    /// Four scenes and twelve methods in both precisions, with a scene that none is right on.
    fn example() -> Profile {
        let names = ["velocity Verlet, predicted", "implicit midpoint, vertex block descent", "BDF2, Newton"];
        let of = |number: usize| {
            let name = format!("{} {number}", names[number % 3]);
            let first = 1.0 + number as f64 * 0.5;
            let precision = if number.is_multiple_of(2) { Precision::F64 } else { Precision::F32 };
            line(&name, precision, &[first, first, 3.0 * first])
        };
        Profile {
            tolerance: 1e-3,
            scenes: ["a", "b", "c", "hard"].map(str::to_owned).to_vec(),
            cut: vec!["long".to_owned()],
            lines: (0..12).map(of).chain([line("nowhere right", Precision::F64, &[])]).collect(),
        }
    }

    /// The elements of text of a graphic: where, how large (px), from which end, whether upwards, and the words.
    fn texts(svg: &str) -> Vec<([f64; 2], u32, String, bool, String)> {
        let texts = svg.split("<text ").skip(1).filter_map(|rest| rest.split_once("</text>"));
        let read = |(element, _): (&str, &str)| {
            let (head, words) = element.split_once('>').expect("the end of a tag");
            let value = |name: &str| {
                let (_, rest) = head.split_once(&format!("{name}=\"")).expect("an attribute");
                rest.split_once('"').expect("its end").0.to_owned()
            };
            let number = |name: &str| value(name).parse::<f64>().expect("a number");
            let size = value("font-size").parse().expect("a size");
            let place = [number("x"), number("y")];
            (place, size, value("text-anchor"), head.contains("rotate(-90"), words.to_owned())
        };
        texts.map(read).collect()
    }

    #[test]
    fn steps_rise_where_a_method_is_within_a_ratio() {
        let steps = line("a", Precision::F64, &[2.0, 1.0, 2.0]);
        assert_eq!(tops(&steps), [[1.0, 0.25], [2.0, 0.75], [2.0, 0.75]]);
        let found = corners(&steps, 5.0);
        assert_eq!([found[0], found[1], found[2]], [[1.0, 0.25], [2.0, 0.25], [2.0, 0.75]]);
        assert_eq!(found.last(), Some(&[5.0, 0.75]));
        assert!(corners(&line("b", Precision::F64, &[]), 5.0).is_empty());
    }

    #[test]
    fn a_profile_in_a_style_has_its_title_its_width_its_font_and_no_caption() {
        let style = Style {
            title: Some("Cost & error".to_owned()),
            is_without_caption: true,
            width: Some(85.0),
            font: Some("Libertinus".to_owned()),
            before: None,
        };
        let picture = picture(&example(), &style).expect("a picture");
        let (head, rest) = picture.svg.split_once('>').expect("a tag");
        assert!(head.contains(" width=\"85mm\"") && head.contains(" viewBox=\"0 0 386.00 "), "{head}");
        assert!(head.contains("font-family=\"&apos;Libertinus&apos;, DejaVu Sans"), "{head}");
        assert!(rest.contains("<title>Cost &amp; error</title>"), "{rest}");
        let texts = texts(&picture.svg);
        assert!(texts.iter().any(|text| text.4 == "Cost &amp; error"), "{texts:?}");
        assert!(!texts.iter().any(|text| text.4.contains("Filled marks")), "{texts:?}");
        for name in ["velocity Verlet, predicted 0", "implicit midpoint, vertex block descent 10"] {
            assert!(texts.iter().any(|text| text.4 == name), "{name} in {texts:?}");
        }
        assert!(!texts.iter().any(|text| text.4 == "nowhere right"), "{texts:?}");
    }

    #[test]
    fn every_word_of_a_picture_is_inside_it() {
        for width in [None, Some(80.0), Some(85.0), Some(180.0)] {
            let title = (width == Some(80.0)).then(|| "a title that is too long for one line ".repeat(4));
            let style = Style { title, width, ..Style::default() };
            let picture = picture(&example(), &style).expect("a picture");
            let size: Vec<f64> = if width.is_none() {
                vec![860.0, f64::INFINITY]
            } else {
                let (_, rest) = picture.svg.split_once("viewBox=\"0 0 ").expect("a frame");
                let frame = rest.split_once('"').expect("its end").0;
                frame.split(' ').map(|side| side.parse().expect("a number")).collect()
            };
            let texts = texts(&picture.svg);
            assert!(texts.len() > 20, "{texts:?}");
            for ([x, y], height, anchor, is_upwards, words) in texts {
                let long = crate::page::width_at(&words, height);
                let back = match anchor.as_str() {
                    "start" => 0.0,
                    "middle" => 0.5 * long,
                    _ => long,
                };
                let high = f64::from(height);
                let [left, right, above, below] = if is_upwards {
                    [x - high, x + 3.0, y - (long - back), y + back]
                } else {
                    [x - back, x - back + long, y - high, y + 3.0]
                };
                let is_inside = left >= 0.0 && right <= size[0] && above >= 0.0 && below <= size[1];
                assert!(is_inside, "{words} at {x}, {y} of {size:?} px, {width:?} mm");
            }
        }
    }
}
