//! Points that are one: files for drawing have a point several times, once for each of its normals.

use std::collections::HashMap;

use super::frame::Frame;

/// Makes one point of those that are in the same place in every frame, and leaves out triangles that have a corner twice
/// then. Points stay in the order in which each comes first. Returns how many are gone.
pub(super) fn join(frames: &mut [Frame], triangles: &mut Vec<[u32; 3]>) -> usize {
    let before = frames.first().map_or(0, Vec::len);
    let mut numbers = vec![0_u32; before];
    for frame in &*frames {
        let mut known: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
        for (number, place) in numbers.iter_mut().zip(frame) {
            let next = known.len() as u32;
            // 0 and -0 are one place.
            let bits = place.map(|c| (c + 0.0).to_bits());
            *number = *known.entry((*number, bits)).or_insert(next);
        }
    }
    let mut firsts = Vec::new();
    for (point, number) in numbers.iter().enumerate() {
        if *number as usize == firsts.len() {
            firsts.push(point);
        }
    }

    for frame in &mut *frames {
        *frame = firsts.iter().map(|point| frame[*point]).collect();
    }
    for corners in &mut *triangles {
        *corners = corners.map(|corner| numbers[corner as usize]);
    }
    triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    before - firsts.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_one_only_where_they_stay_together() {
        let places = |of: [f32; 5]| of.map(|x| [x, 0.0, -1.0]).to_vec();
        // The second is with the first, but for its sign of 0; the fourth leaves the third in the second frame.
        let mut frames = [places([0.0, -0.0, 2.0, 2.0, 5.0]), places([1.0, 1.0, 2.0, 3.0, 5.0])];
        let mut triangles = vec![[0, 1, 2], [1, 2, 3], [0, 3, 4]];
        assert_eq!(join(&mut frames, &mut triangles), 1);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3]]);
        let along = frames.map(|frame| frame.iter().map(|place| place[0]).collect::<Vec<f32>>());
        assert_eq!(along, [[0.0, 2.0, 2.0, 5.0], [1.0, 2.0, 3.0, 5.0]]);
    }
}
