//! A picture on its way: axes by the plotter, marks and words where they are put.

use kuva::{
    PngBackend,
    backend::svg::SvgBackend,
    plot::{
        annotations::{ReferenceLine, ShadedRegion},
        line::{LinePlot, LineStyle},
        scatter::{MarkerShape, ScatterPlot},
    },
    render::{
        color::Color,
        layout::{ComputedLayout, Layout, TickFormat},
        plots::Plot,
        render::{Primitive, Scene, TextAnchor, render_multiple},
    },
};

use crate::{look::INK, picture::Picture};

/// Width and height (px), without the sentence.
const SIZE: [f64; 2] = [860.0, 580.0];
/// Around the data (px): left, right, above, below.
const MARGINS: [f64; 4] = [80.0, 36.0, 50.0, 56.0];
/// Size of words (px).
pub(crate) const TEXT: u32 = 12;
/// Between the lines of the sentence below (px).
const LINE: f64 = 16.0;

/// An axis: what it shows, from where to where, and whether its scale is logarithmic.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    pub(crate) label: &'static str,
    pub(crate) range: [f64; 2],
    pub(crate) is_log: bool,
}

/// Where words stand beside their point.
pub(crate) use kuva::render::render::TextAnchor as Anchor;

/// A picture on its way.
pub(crate) struct Canvas {
    name: &'static str,
    title: String,
    sentence: String,
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
    /// Axes without data.
    pub(crate) fn new(name: &'static str, title: String, sentence: String, [x, y]: [Axis; 2]) -> Self {
        let layout = layout(&title, [x, y]);
        let place = ComputedLayout::from_layout(&layout);
        let (regions, references) = (Vec::new(), Vec::new());
        Self {
            name,
            title,
            sentence,
            layout,
            place,
            regions,
            references,
            plots: Vec::new(),
            above: Vec::new(),
        }
    }

    /// Where a point of the data is (px).
    pub(crate) fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.place.map_x(x), self.place.map_y(y)]
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
        let line = LinePlot::new().with_data(points.iter().map(|[x, y]| (*x, *y))).with_color(stroke.colour);
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
        let mut layer = |size: f64, colour: &str| {
            let marks = ScatterPlot::new().with_data(points.iter().map(|[x, y]| (*x, *y)));
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
    pub(crate) fn words(&mut self, text: &str, [x, y]: [f64; 2], anchor: TextAnchor, colour: &str) {
        let (content, color) = (text.to_owned(), Some(Color::from(colour)));
        let width = width(text);
        let left = match anchor {
            TextAnchor::Start => x,
            TextAnchor::Middle => x - 0.5 * width,
            TextAnchor::End => x - width,
        };
        self.above.push(Primitive::Rect {
            x: left - 1.0,
            y: y - 10.5,
            width: width + 2.0,
            height: 13.0,
            fill: Color::from("white"),
            stroke: None,
            stroke_width: None,
            opacity: Some(0.75),
        });
        self.above.push(Primitive::Text {
            x,
            y,
            content,
            size: TEXT,
            anchor,
            rotate: None,
            bold: false,
            color,
        });
    }

    /// Draws what was put on it.
    pub(crate) fn finish(self) -> Result<Picture, String> {
        let Self { name, title, sentence, mut layout, above, plots, regions, references, .. } = self;
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
        picture(name, &title, sentence, scene)
    }
}

/// A picture of what was drawn, with the sentence below it.
pub(crate) fn picture(
    name: &'static str,
    title: &str,
    sentence: String,
    mut scene: Scene,
) -> Result<Picture, String> {
    write_below(&mut scene, &sentence);
    let png = PngBackend::new().with_scale(2.0).render_scene(&scene)?;
    let svg = named(&SvgBackend::new().render_scene(&scene), title, &sentence);
    Ok(Picture { name, svg, png, sentence })
}

/// How wide words are (px).
pub(crate) fn width(text: &str) -> f64 {
    // Shares of the size that letters of DejaVu Sans take, which pixels are made with; other fonts are narrower.
    let share = |letter: char| match letter {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | ' ' | '\'' => 0.32,
        'f' | 'r' | 't' | '(' | ')' | '-' | '/' => 0.40,
        'm' | 'w' | 'M' | 'W' => 0.97,
        _ => 0.63,
    };
    f64::from(TEXT) * text.chars().map(share).sum::<f64>()
}

fn layout(title: &str, [x, y]: [Axis; 2]) -> Layout {
    let [width, height] = SIZE;
    let [left, right, above, below] = MARGINS;
    let mut layout = Layout::new((x.range[0], x.range[1]), (y.range[0], y.range[1]))
        .with_width(width)
        .with_height(height)
        .with_force_margins(left, right)
        .with_force_margins_y(above, below)
        .with_title(title)
        .with_title_size(15)
        .with_label_size(13)
        .with_tick_size(TEXT)
        .with_body_size(TEXT)
        .with_x_label(x.label)
        .with_y_label(y.label)
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

/// Writes the sentence below the axes, in as many lines as it takes.
fn write_below(scene: &mut Scene, sentence: &str) {
    let room = scene.width - 40.0;
    scene.height += 0.5 * LINE;
    let mut lines: Vec<String> = Vec::new();
    for word in sentence.split(' ') {
        match lines.last_mut() {
            Some(last) if width(last) + width(word) + width(" ") <= room => *last = format!("{last} {word}"),
            _ => lines.push(word.to_owned()),
        }
    }
    for line in lines {
        scene.height += LINE;
        scene.add(Primitive::Text {
            x: 20.0,
            y: scene.height - LINE + 4.0,
            content: line,
            size: TEXT,
            anchor: TextAnchor::Start,
            rotate: None,
            bold: false,
            color: Some(Color::from(INK)),
        });
    }
    scene.height += 0.5 * LINE;
}

/// The graphic with a title and a description, for those who do not see it.
fn named(svg: &str, title: &str, sentence: &str) -> String {
    let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let names = format!("<title>{}</title><desc>{}</desc>", escaped(title), escaped(sentence));
    let start = svg.find("<svg").and_then(|begin| Some(begin + svg[begin..].find('>')? + 1)).unwrap_or(0);
    format!("{}{names}{}", &svg[..start], &svg[start..])
}
