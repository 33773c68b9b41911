//! How pictures are asked to look: their title, whether a sentence stands below, their width in print, their font.

/// Fonts of words where no other is named, and where that one is not there: what pixels are made with, and what is like it.
const FONTS: &str = "DejaVu Sans, Verdana, Liberation Sans, Arial, sans-serif";
/// Pixels per millimetre of pictures that are made for a width: words of 12 px are printed at 7.5 pt, of 25.4 mm / 72.
const PER_MILLIMETRE: f64 = 12.0 * 72.0 / (7.5 * 25.4);
/// Widths (px) that pictures are laid out for, at least and at most: those of 80 and of 300 mm.
const WIDTHS: [f64; 2] = [363.0, 1361.0];
/// Below this width (px) names stand in keys alone.
const NARROW: f64 = 640.0;
/// Pixels per inch (25.4 mm) of a picture that is made for a width.
const PER_INCH: f64 = 300.0;
/// Pixels of a picture for each of its vector graphic, where it is made for no width.
const PIXELS: f64 = 2.0;

/// How pictures are asked to look; by default as on a screen, with titles and sentences of their own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Style {
    /// In place of the title that a picture makes; an empty one leaves it out.
    pub title: Option<String>,
    /// Whether no sentence stands below. It is in the description of the vector graphic all the same.
    pub is_without_caption: bool,
    /// Width in print (mm), from 80 to 300: a picture is laid out so that its words are printed at about 7.5 pt, and has 300
    /// pixels per inch. Beyond these widths it is that of the nearest, scaled.
    pub width: Option<f64>,
    /// Font of the words of the vector graphic, before those that follow it where it is not there. Pixels keep theirs.
    pub font: Option<String>,
    /// A sentence before that of each picture of a chart or a plan.
    pub before: Option<String>,
}

impl Style {
    /// The title of a picture that makes this one.
    pub(crate) fn title_or(&self, made: String) -> String {
        self.title.clone().unwrap_or(made)
    }

    /// The sentence of a picture that makes this one.
    pub(crate) fn sentence(&self, made: String) -> String {
        match &self.before {
            Some(before) => format!("{before} {made}"),
            None => made,
        }
    }

    /// The width (px) that a picture is laid out for, where one is asked for.
    pub(crate) fn pixels(&self) -> Option<f64> {
        let [least, most] = WIDTHS;
        self.width.map(|millimetres| (millimetres * PER_MILLIMETRE).round().clamp(least, most))
    }

    /// Whether there is no room for names beside lines.
    pub(crate) fn is_narrow(&self) -> bool {
        self.pixels().is_some_and(|width| width < NARROW)
    }

    /// The fonts of words, the first that is there counts.
    pub(crate) fn fonts(&self) -> String {
        self.font.as_ref().map_or_else(|| FONTS.to_owned(), |font| format!("'{font}', {FONTS}"))
    }

    /// Pixels for each of a vector graphic that is so wide (px).
    pub(crate) fn scale(&self, width: f64) -> f64 {
        self.width.map_or(PIXELS, |millimetres| millimetres / 25.4 * PER_INCH / width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_a_picture_for_print_have_seven_and_a_half_points() {
        for width in [80.0, 85.0, 180.0, 300.0] {
            let style = Style { width: Some(width), ..Style::default() };
            let pixels = style.pixels().expect("a width was asked for");
            let points = 12.0 * width / pixels * 72.0 / 25.4;
            assert!((points - 7.5).abs() < 0.02, "{points} pt at {width} mm");
            assert!(
                (style.scale(pixels) * pixels - width / 25.4 * 300.0).abs() < 1e-9,
                "pixels at {width} mm"
            );
        }
    }

    #[test]
    fn a_font_that_is_asked_for_comes_before_the_others() {
        let style = Style { font: Some("Source Sans 3".to_owned()), ..Style::default() };
        assert_eq!(style.fonts(), format!("'Source Sans 3', {FONTS}"));
        assert_eq!(Style::default().fonts(), FONTS);
    }
}
