//! What every picture has around its data: a title, a sentence below, and the size in which it is printed.

use kuva::{
    PngBackend,
    backend::svg::SvgBackend,
    render::{
        color::Color,
        render::{Primitive, Scene, TextAnchor},
    },
};

use crate::{look::INK, picture::Picture, style::Style};

/// Size of words (px), of small ones in keys, and of titles.
pub(crate) const TEXT: u32 = 12;
pub(crate) const SMALL: u32 = 10;
pub(crate) const TITLE: u32 = 15;
/// Between the lines of the sentence below and of a title (px).
const LINE: f64 = 16.0;
pub(crate) const TITLE_LINE: f64 = 19.0;
/// Beside a sentence (px).
const BESIDE: f64 = 20.0;

/// How wide words of the usual size are (px).
pub(crate) fn width(text: &str) -> f64 {
    width_at(text, TEXT)
}

/// How wide words of a size (px) are (px).
pub(crate) fn width_at(text: &str, size: u32) -> f64 {
    // Shares of the size that letters of DejaVu Sans take, which pixels are made with; other fonts are narrower.
    let share = |letter: char| match letter {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | ' ' | '\'' => 0.32,
        'f' | 'r' | 't' | '(' | ')' | '-' | '/' => 0.40,
        'm' | 'w' | 'M' | 'W' => 0.97,
        _ => 0.63,
    };
    f64::from(size) * text.chars().map(share).sum::<f64>()
}

/// Words of a size (px) in lines that fit into a room (px). A word that does not is broken.
pub(crate) fn wrapped(text: &str, size: u32, room: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let blank = width_at(" ", size);
        match lines.last_mut() {
            Some(last) if width_at(last, size) + width_at(word, size) + blank <= room => {
                last.push(' ');
                last.push_str(word);
            }
            _ => {
                lines.push(word.to_owned());
                while let Some((first, rest)) = lines.last().and_then(|last| broken(last, size, room)) {
                    lines.pop();
                    lines.extend([first, rest]);
                }
            }
        }
    }
    lines
}

/// A line that does not fit into a room (px), in two: as many letters as fit, at least one, and the others.
fn broken(line: &str, size: u32, room: f64) -> Option<(String, String)> {
    if width_at(line, size) <= room {
        return None;
    }
    let fits = |end: usize| width_at(&line[..end], size) <= room;
    let ends = line.char_indices().map(|(start, _)| start).skip(1);
    let (first, others): (Vec<usize>, Vec<usize>) = ends.partition(|end| fits(*end));
    let end = first.last().or(others.first())?;
    let (first, rest) = line.split_at(*end);
    Some((first.to_owned(), rest.to_owned()))
}

/// A picture of what was drawn, with the sentence below it unless a style leaves it out.
pub(crate) fn picture(
    name: &'static str,
    title: &str,
    sentence: String,
    mut scene: Scene,
    style: &Style,
) -> Result<Picture, String> {
    if !style.is_without_caption {
        write_below(&mut scene, &sentence);
    }
    scene.font_family = Some(style.fonts());
    let png = PngBackend::new().with_scale(style.scale(scene.width) as f32).render_scene(&scene)?;
    let svg = printed(&SvgBackend::new().render_scene(&scene), [scene.width, scene.height], style.width);
    Ok(Picture { name, svg: named(&svg, title, &sentence), png, sentence })
}

/// Writes the sentence below the axes, in as many lines as it takes.
fn write_below(scene: &mut Scene, sentence: &str) {
    scene.height += 0.5 * LINE;
    for line in wrapped(sentence, TEXT, scene.width - 2.0 * BESIDE) {
        scene.height += LINE;
        scene.add(Primitive::Text {
            x: BESIDE,
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

/// The graphic of this size (px) with a width (mm) in print, if there is one.
fn printed(svg: &str, [width, height]: [f64; 2], millimetres: Option<f64>) -> String {
    let Some(millimetres) = millimetres else { return svg.to_owned() };
    let size = |text: &str| {
        let begin = text.find(" width=\"")?;
        let after = begin + text[begin..].find(" height=\"")? + " height=\"".len();
        Some((begin, after + text[after..].find('"')? + 1))
    };
    let Some((begin, end)) = size(svg) else { return svg.to_owned() };
    let high = millimetres * height / width;
    format!(
        "{} width=\"{millimetres}mm\" height=\"{high:.3}mm\" viewBox=\"0 0 {width:.2} {height:.2}\"{}",
        &svg[..begin],
        &svg[end..]
    )
}

/// The graphic with a title and a description, for those who do not see it.
fn named(svg: &str, title: &str, sentence: &str) -> String {
    let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let names = format!("<title>{}</title><desc>{}</desc>", escaped(title), escaped(sentence));
    let start = svg.find("<svg").and_then(|begin| Some(begin + svg[begin..].find('>')? + 1)).unwrap_or(0);
    format!("{}{names}{}", &svg[..start], &svg[start..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_fit_into_their_room_and_lose_nothing() {
        let text =
            "a sentence of some words, and of_one_word_that_is_longer_than_any_line_has_room_for, ends";
        let lines = wrapped(text, TEXT, 120.0);
        assert!(lines.len() > 4, "{lines:?}");
        assert!(lines.iter().all(|line| width(line) < 120.01), "{lines:?}");
        let letters = |text: &str| text.split_whitespace().collect::<String>();
        assert_eq!(letters(&lines.concat()), letters(text));
        assert!(wrapped("", TEXT, 120.0).is_empty());
        assert_eq!(wrapped("äöü", TEXT, 1.0), ["ä", "ö", "ü"]);
    }

    #[test]
    fn a_graphic_for_print_has_its_width_in_millimetres() {
        let svg = "<svg xmlns=\"x\" width=\"386\" height=\"193\" font-family=\"F\"><rect width=\"1\" height=\"2\" /></svg>";
        let printed = printed(svg, [386.0, 193.0], Some(85.0));
        let head = "<svg xmlns=\"x\" width=\"85mm\" height=\"42.500mm\" viewBox=\"0 0 386.00 193.00\" font-family=\"F\">";
        assert_eq!(printed, format!("{head}<rect width=\"1\" height=\"2\" /></svg>"));
    }
}
