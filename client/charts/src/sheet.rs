//! A picture that draws its own axes: rectangles, lines and words where they are put (px).

use kuva::render::{
    color::Color,
    render::{PathData, Primitive, Scene},
};

use crate::{
    canvas::{Anchor, Stroke, TEXT},
    look::INK,
    page::{self, SMALL, TITLE, TITLE_LINE},
    picture::Picture,
    style::Style,
};

/// Where the first line of a title stands (px), and between titles and the edges.
const FIRST: f64 = 30.0;
const EDGE: f64 = 8.0;
/// Size of the words along axes (px).
const LABEL: u32 = 13;

/// A picture on its way, without axes.
pub(crate) struct Sheet {
    /// Width and height (px), without the sentence.
    size: [f64; 2],
    elements: Vec<Primitive>,
}

/// Where the names of rows stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Names {
    Beside,
    Above,
}

impl Sheet {
    /// Nothing, on white.
    pub(crate) fn new(size: [f64; 2]) -> Self {
        Self { size, elements: Vec::new() }
    }

    /// How wide it is (px).
    pub(crate) const fn width(&self) -> f64 {
        self.size[0]
    }

    /// Has it end below at a height (px).
    pub(crate) fn end_at(&mut self, height: f64) {
        self.size[1] = height;
    }

    /// A rectangle (left, right, above, below) without an edge.
    pub(crate) fn rectangle(&mut self, [left, right, above, below]: [f64; 4], colour: &str) {
        self.elements.push(Primitive::Rect {
            x: left,
            y: above,
            width: right - left,
            height: below - above,
            fill: Color::from(colour),
            stroke: None,
            stroke_width: None,
            opacity: None,
        });
    }

    /// The edge of a rectangle (left, right, above, below).
    pub(crate) fn outline(&mut self, [left, right, above, below]: [f64; 4], colour: &str) {
        let corners = [[left, above], [right, above], [right, below], [left, below], [left, above]];
        self.line(&corners, Stroke { colour, width: 1.0, dashes: "" });
    }

    /// A line through places.
    pub(crate) fn line(&mut self, places: &[[f64; 2]], stroke: Stroke<'_>) {
        self.elements.push(Primitive::PolyLine {
            points: places.iter().map(|[x, y]| (*x, *y)).collect(),
            stroke: Color::from(stroke.colour),
            stroke_width: stroke.width,
            stroke_dasharray: (!stroke.dashes.is_empty()).then(|| stroke.dashes.to_owned()),
        });
    }

    /// A hollow diamond about a place.
    pub(crate) fn diamond(&mut self, [x, y]: [f64; 2], half: f64, colour: &str) {
        let [left, right, above, below] = [x - half, x + half, y - half, y + half];
        let d = format!("M{x:.2},{above:.2} L{right:.2},{y:.2} L{x:.2},{below:.2} L{left:.2},{y:.2} Z");
        self.elements.push(Primitive::Path(Box::new(PathData {
            d,
            fill: Some(Color::from("white")),
            stroke: Color::from(colour),
            stroke_width: 1.6,
            opacity: None,
            stroke_dasharray: None,
        })));
    }

    /// The words above everything, in as many lines as they take. By how much (px) what stands below is to be lower than it is
    /// below one line.
    pub(crate) fn title(&mut self, text: &str) -> f64 {
        let lines = page::wrapped(text, TITLE, self.size[0] - 2.0 * EDGE);
        for (i, line) in lines.iter().enumerate() {
            let at = [0.5 * self.size[0], FIRST + TITLE_LINE * i as f64];
            self.write(line, at, Anchor::Middle, (TITLE, "black"), None);
        }
        TITLE_LINE * (lines.len() as f64 - 1.0)
    }

    /// The words along an axis, about a place.
    pub(crate) fn label(&mut self, text: &str, at: [f64; 2]) {
        self.write(text, at, Anchor::Middle, (LABEL, "black"), None);
    }

    /// The same from below upwards.
    pub(crate) fn label_upwards(&mut self, text: &str, at: [f64; 2]) {
        self.write(text, at, Anchor::Middle, (LABEL, "black"), Some(-90.0));
    }

    /// Words at a place.
    pub(crate) fn words(&mut self, text: &str, at: [f64; 2], anchor: Anchor, colour: &str) {
        self.write(text, at, anchor, (TEXT, colour), None);
    }

    /// The same, small.
    pub(crate) fn small_words(&mut self, text: &str, at: [f64; 2], anchor: Anchor, colour: &str) {
        self.write(text, at, anchor, (SMALL, colour), None);
    }

    /// Writes the name of a row and what is told of it: at both sides of the data at a height, or above the row at another one (px).
    pub(crate) fn names(
        &mut self,
        names: Names,
        [name, told]: [&str; 2],
        [left, right]: [f64; 2],
        [beside, above]: [f64; 2],
    ) {
        match names {
            Names::Beside => {
                self.words(name, [left - 10.0, beside + 4.0], Anchor::End, "black");
                self.words(told, [right + 10.0, beside + 4.0], Anchor::Start, "black");
            }
            Names::Above => {
                self.small_words(name, [left + 4.0, above], Anchor::Start, "black");
                self.small_words(told, [right - 4.0, above], Anchor::End, "black");
            }
        }
    }

    /// Words that begin at a place and go upwards.
    pub(crate) fn words_upwards(&mut self, text: &str, at: [f64; 2]) {
        self.write(text, at, Anchor::Start, (TEXT, INK), Some(-90.0));
    }

    fn write(
        &mut self,
        text: &str,
        [x, y]: [f64; 2],
        anchor: Anchor,
        (size, colour): (u32, &str),
        rotate: Option<f64>,
    ) {
        let (content, color) = (text.to_owned(), Some(Color::from(colour)));
        self.elements.push(Primitive::Text { x, y, content, size, anchor, rotate, bold: false, color });
    }

    /// Draws what was put on it, and the sentence below.
    pub(crate) fn finish(
        self,
        name: &'static str,
        title: &str,
        sentence: String,
        style: &Style,
    ) -> Result<Picture, String> {
        let mut scene = Scene::new(self.size[0], self.size[1]);
        for element in self.elements {
            scene.add(element);
        }
        page::picture(name, title, sentence, scene, style)
    }
}
