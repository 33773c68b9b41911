//! Words beside points, where nothing else is written.

use crate::canvas::{Anchor, Canvas, TEXT, width};

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
        let size = [width(text), f64::from(TEXT)];
        let [left, right, above, below] = canvas.frame();
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
                canvas.words(text, [x, y], anchor, colour);
                return true;
            }
        }
        false
    }

    /// Keeps words away from a point (px).
    pub(crate) fn keep_off(&mut self, [x, y]: [f64; 2]) {
        self.taken.push([x - 4.0, x + 4.0, y - 4.0, y + 4.0]);
    }
}

fn overlap(a: &[f64; 4], b: &[f64; 4]) -> bool {
    a[0] < b[1] && b[0] < a[1] && a[2] < b[3] && b[2] < a[3]
}
