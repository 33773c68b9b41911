//! The key of a picture: numbers that stand at its lines, and below the data what each of them means.

use kuva::render::{
    color::Color,
    render::{Primitive, Scene, TextAnchor},
};

use crate::{
    look::{INK, NUMBER},
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

/// What a number means.
#[derive(Clone, Debug)]
struct Entry {
    name: String,
    colour: &'static str,
    dashes: &'static str,
}

/// The key of a picture.
#[derive(Clone, Debug, Default)]
pub(crate) struct Key {
    entries: Vec<Entry>,
}

impl Key {
    /// The number of a name, from 1 on; one that has none yet is the next, and its sample a line of this colour and these dashes.
    pub(crate) fn number(&mut self, name: &str, colour: &'static str, dashes: &'static str) -> usize {
        let known = self.entries.iter().position(|entry| entry.name == name);
        known.unwrap_or_else(|| {
            self.entries.push(Entry { name: name.to_owned(), colour, dashes });
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
        scene.add(Primitive::Line {
            x1: x,
            y1: middle,
            x2: x + SAMPLE,
            y2: middle,
            stroke: Color::from(self.colour),
            stroke_width: 1.8,
            stroke_dasharray: (!self.dashes.is_empty()).then(|| self.dashes.to_owned()),
        });
        let end = x + SAMPLE + PLACE;
        write(scene, number.to_string(), [end - 4.0, y], TextAnchor::End, NUMBER);
        write(scene, self.name.clone(), [end, y], TextAnchor::Start, INK);
    }
}

fn write(scene: &mut Scene, content: String, [x, y]: [f64; 2], anchor: TextAnchor, colour: &str) {
    let color = Some(Color::from(colour));
    scene.add(Primitive::Text { x, y, content, size: SMALL, anchor, rotate: None, bold: false, color });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_keeps_its_number_and_every_name_is_written_once() {
        let mut key = Key::default();
        assert_eq!(["a", "b", "a", "c"].map(|name| key.number(name, INK, "")), [1, 2, 1, 3]);
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
    fn an_empty_key_takes_no_room() {
        let mut scene = Scene::new(400.0, 300.0);
        Key::default().write_below(&mut scene);
        assert_eq!((scene.height, scene.elements.len()), (300.0, 0));
    }
}
