//! A picture on its way: axes by the plotter, marks and words where they are put.

use kuva::{
    plot::{
        annotations::{ReferenceLine, ShadedRegion},
        line::{LinePlot, LineStyle},
        scatter::{MarkerShape, ScatterPlot},
    },
    render::{
        color::Color,
        layout::{AxisLabelOverlap, ComputedLayout, Layout, TickFormat},
        plots::Plot,
        render::{Primitive, TextAnchor, render_multiple},
    },
};

pub(crate) use crate::page::{TEXT, width};
use crate::{
    key::Key,
    look::INK,
    page::{self, SMALL, TITLE, TITLE_LINE, width_at},
    picture::Picture,
    style::Style,
};

/// Width (px) where none is asked for.
const WIDTH: f64 = 860.0;
/// Height of the data over its width, and the least (px).
const SHARE: f64 = 474.0 / 744.0;
const LEAST: f64 = 240.0;
/// Beside the data (px): left and right; the same of narrow pictures.
const BESIDE: [f64; 2] = [80.0, 36.0];
const NARROWLY: [f64; 2] = [72.0, 20.0];
/// Above the data without a title, and below it (px).
const ABOVE: f64 = 31.0;
const BELOW: f64 = 56.0;
/// Where the first line of a title stands (px), and between titles and the edges.
const FIRST: f64 = 26.42;
const EDGE: f64 = 8.0;

/// An axis: what it shows, from where to where, and whether its scale is logarithmic.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    pub(crate) label: &'static str,
    pub(crate) range: [f64; 2],
    pub(crate) is_log: bool,
}

impl Axis {
    /// Where it has a value: one beyond an end of a logarithmic axis stands at that end.
    fn held(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        if self.is_log { value.max(low).min(high) } else { value }
    }
}

/// Where words stand beside their point.
pub(crate) use kuva::render::render::TextAnchor as Anchor;

/// A picture on its way.
pub(crate) struct Canvas {
    name: &'static str,
    title: String,
    sentence: String,
    style: Style,
    /// What the numbers mean that stand at lines.
    pub(crate) key: Key,
    axes: [Axis; 2],
    layout: Layout,
    place: ComputedLayout,
    regions: Vec<ShadedRegion>,
    references: Vec<ReferenceLine>,
    plots: Vec<Plot>,
    above: Vec<Primitive>,
}

/// One of the axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Along {
    X,
    Y,
}

/// Whether marks are seen through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fill {
    Full,
    Hollow,
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stroke<'a> {
    pub(crate) colour: &'a str,
    pub(crate) width: f64,
    pub(crate) dashes: &'a str,
}

impl Canvas {
    /// Axes without data, with a title that the style may replace.
    pub(crate) fn new(
        name: &'static str,
        title: String,
        sentence: String,
        [x, y]: [Axis; 2],
        style: &Style,
    ) -> Self {
        let (title, sentence) = (style.title_or(title), style.sentence(sentence));
        let [left, right] = beside(style);
        let width = style.pixels().unwrap_or(WIDTH);
        let middle = f64::midpoint(left, width - right);
        let lines = page::wrapped(&title, TITLE, 2.0 * (middle.min(width - middle) - EDGE));
        let above = ABOVE + TITLE_LINE * lines.len() as f64;
        let height = above + (SHARE * data_width(style)).round().max(LEAST) + BELOW;
        let layout = layout([width, height], [left, right, above, BELOW], [x, y]);
        let place = ComputedLayout::from_layout(&layout);
        let (regions, references) = (Vec::new(), Vec::new());
        let mut canvas = Self {
            name,
            title,
            sentence,
            style: style.clone(),
            key: Key::default(),
            axes: [x, y],
            layout,
            place,
            regions,
            references,
            plots: Vec::new(),
            above: Vec::new(),
        };
        for (i, line) in lines.into_iter().enumerate() {
            canvas.above.push(Primitive::Text {
                x: middle,
                y: FIRST + TITLE_LINE * i as f64,
                content: line,
                size: TITLE,
                anchor: TextAnchor::Middle,
                rotate: None,
                bold: false,
                color: None,
            });
        }
        canvas
    }

    /// Whether there is no room for names beside lines.
    pub(crate) fn is_narrow(&self) -> bool {
        self.style.is_narrow()
    }

    /// Where a point of the data is (px).
    pub(crate) fn at(&self, point: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.held(point);
        [self.place.map_x(x), self.place.map_y(y)]
    }

    /// How long a decade is along each axis, if both are logarithmic (px).
    pub(crate) fn decade(&self) -> [f64; 2] {
        let place = &self.place;
        [place.map_x(10.0) - place.map_x(1.0), place.map_y(1.0) - place.map_y(10.0)]
    }

    /// A point where the axes have it.
    fn held(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [along_x, along_y] = self.axes;
        [along_x.held(x), along_y.held(y)]
    }

    /// Points where the axes have them, without those that are nowhere.
    fn all_held(&self, points: &[[f64; 2]]) -> Vec<(f64, f64)> {
        let numbers = points.iter().filter(|point| !point.iter().any(|value| value.is_nan()));
        let held = numbers.map(|point| self.held(*point)).filter(|[x, y]| x.is_finite() && y.is_finite());
        held.map(|[x, y]| (x, y)).collect()
    }

    /// The frame of the data (px): left, right, above, below.
    pub(crate) fn frame(&self) -> [f64; 4] {
        let place = &self.place;
        [
            place.margin_left,
            place.width - place.margin_right,
            place.margin_top,
            place.height - place.margin_bottom,
        ]
    }

    /// Shades what lies between two values of x, or of y.
    pub(crate) fn shade(&mut self, along: Along, [from, to]: [f64; 2], colour: &str) {
        let region = match along {
            Along::X => ShadedRegion::vertical(from, to),
            Along::Y => ShadedRegion::horizontal(from, to),
        };
        self.regions.push(region.with_color(colour).with_opacity(0.5));
    }

    /// A dashed line across, at a value of x or of y.
    pub(crate) fn mark(&mut self, along: Along, value: f64) {
        let line = match along {
            Along::X => ReferenceLine::vertical(value),
            Along::Y => ReferenceLine::horizontal(value),
        };
        self.references.push(line.with_color(INK).with_stroke_width(1.0).with_dasharray("4 4"));
    }

    /// A line through points.
    pub(crate) fn line(&mut self, points: &[[f64; 2]], stroke: Stroke<'_>) {
        let style = match stroke.dashes {
            "" => LineStyle::Solid,
            dashes => LineStyle::Custom(dashes.to_owned()),
        };
        let line = LinePlot::new().with_data(self.all_held(points)).with_color(stroke.colour);
        self.plots.push(line.with_stroke_width(stroke.width).with_line_style(style).into());
    }

    /// Marks at points: filled, or hollow.
    pub(crate) fn marks(
        &mut self,
        points: &[[f64; 2]],
        mark: MarkerShape,
        colour: &str,
        size: f64,
        fill: Fill,
    ) {
        let points = self.all_held(points);
        let mut layer = |size: f64, colour: &str| {
            let marks = ScatterPlot::new().with_data(points.iter().copied());
            self.plots.push(marks.with_marker(mark).with_size(size).with_color(colour).into());
        };
        layer(size, colour);
        if fill == Fill::Hollow {
            // White within, so that no line is seen through them.
            layer(size - 1.6, "white");
        }
    }

    /// A cross at a place (px).
    pub(crate) fn cross(&mut self, [x, y]: [f64; 2], colour: &str) {
        for [dx, dy] in [[4.0, 4.0], [4.0, -4.0]] {
            self.segment([[x - dx, y - dy], [x + dx, y + dy]], colour, 1.6);
        }
    }

    /// A straight line between places (px).
    pub(crate) fn segment(&mut self, [[x1, y1], [x2, y2]]: [[f64; 2]; 2], colour: &str, stroke_width: f64) {
        let stroke = Color::from(colour);
        self.above.push(Primitive::Line { x1, y1, x2, y2, stroke, stroke_width, stroke_dasharray: None });
    }

    /// Words at a place (px), on a white ground.
    pub(crate) fn words(&mut self, text: &str, at: [f64; 2], anchor: TextAnchor, colour: &str) {
        self.write(text, at, anchor, (TEXT, colour));
    }

    /// The same, small.
    pub(crate) fn small_words(&mut self, text: &str, at: [f64; 2], anchor: TextAnchor, colour: &str) {
        self.write(text, at, anchor, (SMALL, colour));
    }

    fn write(&mut self, text: &str, [x, y]: [f64; 2], anchor: TextAnchor, (size, colour): (u32, &str)) {
        let (content, color) = (text.to_owned(), Some(Color::from(colour)));
        let width = width_at(text, size);
        let left = match anchor {
            TextAnchor::Start => x,
            TextAnchor::Middle => x - 0.5 * width,
            TextAnchor::End => x - width,
        };
        self.above.push(Primitive::Rect {
            x: left - 1.0,
            y: y - f64::from(size) + 1.5,
            width: width + 2.0,
            height: f64::from(size) + 1.0,
            fill: Color::from("white"),
            stroke: None,
            stroke_width: None,
            opacity: Some(0.75),
        });
        self.above.push(Primitive::Text { x, y, content, size, anchor, rotate: None, bold: false, color });
    }

    /// Draws what was put on it, and the key and the sentence below.
    pub(crate) fn finish(self) -> Result<Picture, String> {
        let Self { name, title, sentence, style, key, mut layout, above, plots, regions, references, .. } =
            self;
        for region in regions {
            layout = layout.with_shaded_region(region);
        }
        for line in references {
            layout = layout.with_reference_line(line);
        }
        let mut scene = render_multiple(plots, layout);
        for primitive in above {
            scene.add(primitive);
        }
        key.write_below(&mut scene);
        page::picture(name, &title, sentence, scene, &style)
    }
}

/// Beside the data (px): left and right.
fn beside(style: &Style) -> [f64; 2] {
    if style.is_narrow() { NARROWLY } else { BESIDE }
}

/// The width of the data (px).
pub(crate) fn data_width(style: &Style) -> f64 {
    style.pixels().unwrap_or(WIDTH) - beside(style).iter().sum::<f64>()
}

/// The axes of a picture of this size (px), with so much around the data: left, right, above, below.
fn layout([width, height]: [f64; 2], [left, right, above, below]: [f64; 4], [x, y]: [Axis; 2]) -> Layout {
    let mut layout = Layout::new((x.range[0], x.range[1]), (y.range[0], y.range[1]))
        .with_width(width)
        .with_height(height)
        .with_force_margins(left, right)
        .with_force_margins_y(above, below)
        .with_label_size(13)
        .with_tick_size(TEXT)
        .with_body_size(TEXT)
        .with_x_label(x.label)
        .with_y_label(y.label)
        .with_x_label_overlap(AxisLabelOverlap::Thin)
        .with_clamp_axis()
        .with_x_axis_min(x.range[0])
        .with_x_axis_max(x.range[1])
        .with_y_axis_min(y.range[0])
        .with_y_axis_max(y.range[1]);
    if x.is_log {
        layout = layout.with_log_x().with_x_tick_format(TickFormat::Custom(std::sync::Arc::new(tick)));
    }
    if y.is_log {
        layout = layout.with_log_y().with_y_tick_format(TickFormat::Custom(std::sync::Arc::new(tick)));
    }
    layout
}

/// A number of a logarithmic axis: in full where that is short.
pub(crate) fn tick(value: f64) -> String {
    if (1e-3..1e5).contains(&value) { format!("{value}") } else { format!("{value:e}") }
}
