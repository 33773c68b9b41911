//! The key of a picture: numbers that stand at its lines, and below the data what each of them means.

use kuva::{
    plot::scatter::MarkerShape,
    render::{
        color::Color,
        render::{PathData, Primitive, Scene, TextAnchor},
    },
};

use crate::{
    look::{GREY, INK, Look, NUMBER},
    page::{SMALL, width_at},
};

/// Beside the key (px).
const BESIDE: f64 = 20.0;
/// Between its lines, and above the first (px).
const LINE: f64 = 13.0;
/// Width of a sample of a line, of the place of a number, and between columns (px).
const SAMPLE: f64 = 18.0;
const PLACE: f64 = 18.0;
const GAP: f64 = 14.0;

/// Half the size of a mark on a sample (px).
const MARK: f64 = 3.5;

/// How a line looks: a sample of it is drawn beside its name, with its mark, so that it is found without colour.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) colour: &'static str,
    pub(crate) dashes: &'static str,
    /// None of a line without marks.
    pub(crate) mark: Option<MarkerShape>,
}

impl Sample {
    /// That of a line of a look, or of one that is not named.
    pub(crate) fn of(look: Option<Look>) -> Self {
        let grey = Self { colour: GREY, dashes: "", mark: None };
        look.map_or(grey, |look| Self { colour: look.colour, dashes: look.dashes, mark: Some(look.mark) })
    }
}

/// What a number means.
#[derive(Clone, Debug)]
struct Entry {
    name: String,
    sample: Sample,
}

/// The key of a picture.
#[derive(Clone, Debug, Default)]
pub(crate) struct Key {
    entries: Vec<Entry>,
}

impl Key {
    /// The number of a name, from 1 on; one that has none yet is the next, with this sample.
    pub(crate) fn number(&mut self, name: &str, sample: Sample) -> usize {
        let known = self.entries.iter().position(|entry| entry.name == name);
        known.unwrap_or_else(|| {
            self.entries.push(Entry { name: name.to_owned(), sample });
            self.entries.len() - 1
        }) + 1
    }

    /// Writes all below what was drawn, in as many columns as there is room for.
    pub(crate) fn write_below(&self, scene: &mut Scene) {
        let widest = self.entries.iter().map(|entry| width_at(&entry.name, SMALL)).fold(0.0, f64::max);
        let column = SAMPLE + PLACE + widest + GAP;
        let columns = ((scene.width - 2.0 * BESIDE + GAP) / column).floor().max(1.0) as usize;
        let lines = self.entries.len().div_ceil(columns);
        let above = scene.height + LINE;
        for (place, entry) in self.entries.iter().enumerate() {
            let x = BESIDE + (place / lines) as f64 * column;
            entry.write(scene, place + 1, [x, above + (place % lines) as f64 * LINE]);
        }
        if lines > 0 {
            scene.height = above + (lines as f64 - 0.5) * LINE;
        }
    }
}

impl Entry {
    /// Writes it from a place (px) on.
    fn write(&self, scene: &mut Scene, number: usize, [x, y]: [f64; 2]) {
        let middle = y - 3.5;
        let Sample { colour, dashes, mark } = self.sample;
        scene.add(Primitive::Line {
            x1: x,
            y1: middle,
            x2: x + SAMPLE,
            y2: middle,
            stroke: Color::from(colour),
            stroke_width: 1.8,
            stroke_dasharray: (!dashes.is_empty()).then(|| dashes.to_owned()),
        });
        if let Some(mark) = mark {
            draw_mark(scene, mark, [x + 0.5 * SAMPLE, middle], colour);
        }
        let end = x + SAMPLE + PLACE;
        write(scene, number.to_string(), [end - 4.0, y], TextAnchor::End, NUMBER);
        write(scene, self.name.clone(), [end, y], TextAnchor::Start, INK);
    }
}

/// Draws a mark about a place (px), of the shape that the plotter gives it at lines.
fn draw_mark(scene: &mut Scene, mark: MarkerShape, [x, y]: [f64; 2], colour: &str) {
    let fill = Color::from(colour);
    let corners = corners(mark);
    if corners.is_empty() {
        scene.add(Primitive::Circle {
            cx: x,
            cy: y,
            r: MARK,
            fill,
            fill_opacity: None,
            stroke: None,
            stroke_width: None,
        });
        return;
    }
    let way = corners.iter().map(|[dx, dy]| format!("{:.2},{:.2}", x + MARK * dx, y + MARK * dy));
    let d = format!("M{} Z", way.collect::<Vec<_>>().join(" L"));
    let stroke = Color::from(colour);
    let stroke_width = 0.5;
    let path = PathData { d, fill: Some(fill), stroke, stroke_width, opacity: None, stroke_dasharray: None };
    scene.add(Primitive::Path(Box::new(path)));
}

/// The corners of a mark of half the size 1; none of a circle.
fn corners(mark: MarkerShape) -> Vec<[f64; 2]> {
    let regular = |count: u32, size: f64| -> Vec<[f64; 2]> {
        let corner = |i: u32| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(count);
            [size * angle.sin(), -size * angle.cos()]
        };
        (0..count).map(corner).collect()
    };
    match mark {
        MarkerShape::Square => vec![[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]],
        MarkerShape::Triangle => vec![[0.0, -1.02], [1.0, 0.68], [-1.0, 0.68]],
        MarkerShape::TriangleDown => vec![[0.0, 1.02], [1.0, -0.68], [-1.0, -0.68]],
        MarkerShape::Diamond => regular(4, 1.3),
        MarkerShape::Pentagon => regular(5, 1.2),
        MarkerShape::Hexagon => regular(6, 1.15),
        MarkerShape::Plus => [[0, 1], [1, 0], [0, -1], [-1, 0]].into_iter().flat_map(arm).collect(),
        MarkerShape::Circle | MarkerShape::Cross | MarkerShape::Star => Vec::new(),
    }
}

/// The corners of an arm of a plus that points into a direction, in the order in which an outline meets them.
fn arm([x, y]: [i32; 2]) -> [[f64; 2]; 3] {
    let [x, y] = [x, y].map(f64::from);
    let half = 0.2;
    // From one side of its end to the other, and into the corner between it and the next.
    [
        [0.9 * x - half * y, 0.9 * y + half * x],
        [0.9 * x + half * y, 0.9 * y - half * x],
        [half * (x + y), half * (y - x)],
    ]
}

fn write(scene: &mut Scene, content: String, [x, y]: [f64; 2], anchor: TextAnchor, colour: &str) {
    let color = Some(Color::from(colour));
    scene.add(Primitive::Text { x, y, content, size: SMALL, anchor, rotate: None, bold: false, color });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::look;

    #[test]
    fn a_name_keeps_its_number_and_every_name_is_written_once() {
        let mut key = Key::default();
        let sample = Sample::of(None);
        assert_eq!(["a", "b", "a", "c"].map(|name| key.number(name, sample)), [1, 2, 1, 3]);
        let mut scene = Scene::new(400.0, 300.0);
        key.write_below(&mut scene);
        let written = |text: &str| {
            let is_it = |one: &&Primitive| matches!(one, Primitive::Text { content, .. } if content == text);
            scene.elements.iter().filter(is_it).count()
        };
        assert_eq!(["a", "b", "c", "1", "2", "3"].map(written), [1; 6]);
        assert!(scene.height > 300.0 && scene.height < 330.0, "{} px", scene.height);
    }

    #[test]
    fn samples_of_named_lines_have_the_marks_of_their_lines() {
        let mut key = Key::default();
        for number in 0..look::NAMED {
            key.number(&number.to_string(), Sample::of(Some(look::of(number))));
        }
        key.number("grey", Sample::of(None));
        let mut scene = Scene::new(400.0, 300.0);
        key.write_below(&mut scene);
        let outlines: Vec<usize> =
            (0..look::NAMED).map(|number| corners(look::of(number).mark).len()).collect();
        assert_eq!(outlines, [0, 4, 3, 4, 3, 5, 6, 12]);
        let marks =
            scene.elements.iter().filter(|one| matches!(one, Primitive::Path(_) | Primitive::Circle { .. }));
        assert_eq!(marks.count(), look::NAMED);
    }

    #[test]
    fn an_empty_key_takes_no_room() {
        let mut scene = Scene::new(400.0, 300.0);
        Key::default().write_below(&mut scene);
        assert_eq!((scene.height, scene.elements.len()), (300.0, 0));
    }
}
