//! How lines are told apart: by colour, by dashes, by marks. Without colour the others remain.

use kuva::plot::scatter::MarkerShape;

/// The look of a line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    pub(crate) colour: &'static str,
    pub(crate) dashes: &'static str,
    pub(crate) mark: MarkerShape,
}

/// Lines that are named, at most.
pub(crate) const NAMED: usize = 8;

/// Colours that are told apart also by the colour-blind (Okabe and Ito 2008); yellow, which is lost on white, is a grey.
const LOOKS: [Look; NAMED] = [
    Look { colour: "#0072B2", dashes: "", mark: MarkerShape::Circle },
    Look { colour: "#D55E00", dashes: "8 3", mark: MarkerShape::Square },
    Look { colour: "#009E73", dashes: "2 3", mark: MarkerShape::Triangle },
    Look { colour: "#CC79A7", dashes: "10 3 2 3", mark: MarkerShape::Diamond },
    Look { colour: "#56B4E9", dashes: "5 2", mark: MarkerShape::TriangleDown },
    Look { colour: "#E69F00", dashes: "12 4", mark: MarkerShape::Pentagon },
    Look { colour: "#000000", dashes: "3 2 3 6", mark: MarkerShape::Hexagon },
    Look { colour: "#777777", dashes: "1 2", mark: MarkerShape::Plus },
];

/// Lines that are not named, and what belongs to no line.
pub(crate) const GREY: &str = "#C4C4C4";
/// Numbers of lines that are not named.
pub(crate) const NUMBER: &str = "#6B6B6B";
/// Words and lines beside the data.
pub(crate) const INK: &str = "#333333";

/// The look of the named line with this number.
pub(crate) const fn of(number: usize) -> Look {
    LOOKS[number % NAMED]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn named_lines_are_told_apart_without_colour() {
        for (place, one) in LOOKS.iter().enumerate() {
            for other in &LOOKS[place + 1..] {
                assert_ne!(one.dashes, other.dashes, "{one:?}, {other:?}");
                assert!(one.mark != other.mark, "{one:?}, {other:?}");
                assert_ne!(one.colour, other.colour, "{one:?}, {other:?}");
            }
        }
    }
}
