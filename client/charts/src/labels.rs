//! Words beside points, where nothing else is written.

use crate::{
    canvas::{Anchor, Canvas, TEXT},
    page::{SMALL, width_at},
};

/// Words that were placed.
#[derive(Debug, Default)]
pub(crate) struct Labels {
    /// Left, right, above, below (px).
    taken: Vec<[f64; 4]>,
}

/// Where words may stand beside a point: their distance (px), and which end of them is there.
const PLACES: [([f64; 2], Anchor); 12] = [
    ([9.0, 4.0], Anchor::Start),
    ([-9.0, 4.0], Anchor::End),
    ([0.0, -9.0], Anchor::Middle),
    ([0.0, 18.0], Anchor::Middle),
    ([8.0, -8.0], Anchor::Start),
    ([8.0, 16.0], Anchor::Start),
    ([-8.0, -8.0], Anchor::End),
    ([-8.0, 16.0], Anchor::End),
    ([8.0, -22.0], Anchor::Start),
    ([-8.0, -22.0], Anchor::End),
    ([8.0, 30.0], Anchor::Start),
    ([-8.0, 30.0], Anchor::End),
];

impl Labels {
    /// Writes words beside a point (px), if there is room; says whether there was.
    pub(crate) fn write(&mut self, canvas: &mut Canvas, text: &str, at: [f64; 2], colour: &str) -> bool {
        let place = self.place(canvas.frame(), [width_at(text, TEXT), f64::from(TEXT)], at);
        if let Some((place, anchor)) = place {
            canvas.words(text, place, anchor, colour);
        }
        place.is_some()
    }

    /// Writes a number beside the first of some points (px) that has room for it, over the first of all where none has.
    pub(crate) fn number(&mut self, canvas: &mut Canvas, number: usize, points: &[[f64; 2]], colour: &str) {
        let text = number.to_string();
        let size = [width_at(&text, SMALL), f64::from(SMALL)];
        let place = points.iter().find_map(|point| self.place(canvas.frame(), size, *point));
        let over = || points.first().map(|[x, y]| ([*x, y + 4.0], Anchor::Middle));
        if let Some((place, anchor)) = place.or_else(over) {
            canvas.small_words(&text, place, anchor, colour);
        }
    }

    /// Where words of this width and height (px) stand beside a point (px) within a frame, if there is room, which they take.
    fn place(&mut self, frame: [f64; 4], size: [f64; 2], at: [f64; 2]) -> Option<([f64; 2], Anchor)> {
        let [left, right, above, below] = frame;
        for ([dx, dy], anchor) in PLACES {
            let [x, y] = [at[0] + dx, at[1] + dy];
            let from = match anchor {
                Anchor::Start => x,
                Anchor::Middle => x - 0.5 * size[0],
                Anchor::End => x - size[0],
            };
            let room = [from, from + size[0], y - size[1] + 1.0, y + 3.0];
            let is_inside =
                room[0] > left + 2.0 && room[1] < right - 2.0 && room[2] > above && room[3] < below;
            if is_inside && !self.taken.iter().any(|other| overlap(&room, other)) {
                self.taken.push(room);
                return Some(([x, y], anchor));
            }
        }
        None
    }

    /// Keeps words away from a point (px).
    pub(crate) fn keep_off(&mut self, [x, y]: [f64; 2]) {
        self.taken.push([x - 4.0, x + 4.0, y - 4.0, y + 4.0]);
    }
}

fn overlap(a: &[f64; 4], b: &[f64; 4]) -> bool {
    a[0] < b[1] && b[0] < a[1] && a[2] < b[3] && b[2] < a[3]
}
