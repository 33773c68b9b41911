//! How the pictures of a study look: their title, the sentence below, their width in print, their font.

use clap::Args;

/// Widths in print (mm) that pictures can have, at least and at most.
const WIDTHS: [f64; 2] = [80.0, 300.0];

/// The options that every verb which draws pictures has.
#[derive(Args, Clone, Debug, Default)]
#[cfg_attr(not(feature = "charts"), allow(dead_code, reason = "read where pictures are drawn"))]
pub(crate) struct LookArgs {
    /// Title of the pictures, in place of the one that each makes; "" for none
    #[arg(long, value_name = "TEXT", help_heading = "Pictures", value_parser = title)]
    title: Option<String>,
    /// Leave out the sentence below the pictures
    #[arg(long, help_heading = "Pictures")]
    no_caption: bool,
    /// Width in print (mm), 80 to 300: words are printed at 7.5 pt, the PNG has 300 pixels per inch
    #[arg(long, value_name = "MM", help_heading = "Pictures", value_parser = width)]
    width: Option<f64>,
    /// Font of the words in the SVG; where it is not there, DejaVu Sans or what is like it. The PNG has DejaVu Sans
    #[arg(long, value_name = "NAME", help_heading = "Pictures", value_parser = font)]
    font: Option<String>,
}

impl LookArgs {
    /// The width in print (mm), if one is asked for.
    pub(crate) const fn width(&self) -> Option<f64> {
        self.width
    }

    /// The style of pictures.
    #[cfg(feature = "charts")]
    pub(crate) fn style(&self) -> nappe_charts::Style {
        nappe_charts::Style {
            title: self.title.clone(),
            is_without_caption: self.no_caption,
            width: self.width,
            font: self.font.clone(),
            before: None,
        }
    }
}

/// A title, which is one line of what a graphic can hold.
fn title(text: &str) -> Result<String, String> {
    let is_text = |letter: char| !letter.is_control() && !matches!(letter, '\u{fffe}' | '\u{ffff}');
    if text.chars().all(is_text) {
        Ok(text.trim().to_owned())
    } else {
        Err("a title is one line, without control characters".to_owned())
    }
}

/// A width in print (mm).
fn width(text: &str) -> Result<f64, String> {
    let [least, most] = WIDTHS;
    let number = text.trim().trim_end_matches("mm").trim_end().parse::<f64>().ok();
    number.filter(|millimetres| (least..=most).contains(millimetres)).ok_or_else(|| {
        format!("'{text}' is not a width from {least} to {most} mm, such as 85 for a column of a journal")
    })
}

/// The name of a font.
fn font(text: &str) -> Result<String, String> {
    let is_name = |letter: char| letter.is_alphanumeric() || " -_.".contains(letter);
    let name = text.trim();
    if !name.is_empty() && name.chars().all(is_name) {
        Ok(name.to_owned())
    } else {
        Err(format!(
            "'{text}' is not the name of a font: letters, digits, blanks, '-', '_' and '.', such as Arial"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_have_two_ends_and_fonts_have_plain_names() {
        assert_eq!(["85", "85mm", "180 mm"].map(width), [Ok(85.0), Ok(85.0), Ok(180.0)]);
        for wrong in ["", "mm", "79.9", "301", "-85", "nan", "inf", "8.5cm"] {
            assert!(width(wrong).is_err(), "{wrong}");
        }
        assert_eq!(font(" Source Sans 3 "), Ok("Source Sans 3".to_owned()));
        for wrong in ["", " ", "A, B", "A'B", "A\"", "A;B", "A\nB"] {
            assert!(font(wrong).is_err(), "{wrong:?}");
        }
        assert_eq!(title(""), Ok(String::new()));
        assert!(title("a\nb").is_err() && title("a & b <c>").is_ok());
    }
}
