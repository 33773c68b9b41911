//! Numbers as the text form of USD has them, with the fewest digits that are read back to the same bits.
//!
//! Enters: arrays. Leaves: text, `[(x,y,z),...]` or `[a,b,...]`.

use std::fmt::{Debug, Write as _};

/// An array of vectors.
pub fn usda_vectors<T: Debug, const N: usize>(vectors: &[[T; N]]) -> String {
    let mut text = String::with_capacity(2 + 10 * N * vectors.len());
    text.push('[');
    for (index, vector) in vectors.iter().enumerate() {
        text.push_str(if index == 0 { "(" } else { ",(" });
        push(vector, &mut text);
        text.push(')');
    }
    text.push(']');
    text
}

/// An array of numbers.
pub fn usda_numbers<T: Debug>(numbers: &[T]) -> String {
    let mut text = String::with_capacity(2 + 10 * numbers.len());
    text.push('[');
    push(numbers, &mut text);
    text.push(']');
    text
}

/// Numbers with commas between them.
fn push<T: Debug>(numbers: &[T], text: &mut String) {
    for (index, number) in numbers.iter().enumerate() {
        if index > 0 {
            text.push(',');
        }
        let start = text.len();
        // Writing into a string does not fail.
        let _ = write!(text, "{number:?}");
        shorten(text, start);
    }
}

/// Leaves out of the number that stands at `start` what readers do not need.
fn shorten(text: &mut String, start: usize) {
    let number = &text[start..];
    let sign = usize::from(number.starts_with('-'));
    if number == "NaN" {
        text.replace_range(start.., "nan");
    } else if number == "-0.0" {
        // Without the fraction, readers forget the sign.
    } else if number.ends_with(".0") {
        text.truncate(text.len() - 2);
    } else if number[sign..].starts_with("0.") {
        text.remove(start + sign);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_read_back_to_the_bit() {
        let vectors = [[0.1_f32, -0.0, 1e-20], [1.0 / 3.0, 20_000.0, f32::MAX]];
        assert_eq!(usda_vectors(&vectors), "[(.1,-0.0,1e-20),(.33333334,20000,3.4028235e38)]");
        assert_eq!(usda_numbers(&[1_i64, -2]), "[1,-2]");
        assert_eq!(usda_numbers(&[f32::NAN, f32::INFINITY, -f32::INFINITY]), "[nan,inf,-inf]");
        assert_eq!(usda_numbers(&[1.5_f64, 0.1 + 0.2, 0.0, -0.25]), "[1.5,.30000000000000004,0,-.25]");
        assert_eq!(
            (usda_vectors::<f32, 3>(&[]), usda_numbers::<f32>(&[])),
            ("[]".to_owned(), "[]".to_owned())
        );
        let text = usda_numbers(&vectors[1]);
        let read = text[1..text.len() - 1].split(',').map(|word| word.parse::<f32>().expect("a number"));
        assert!(read.map(f32::to_bits).eq(vectors[1].map(f32::to_bits)));
    }
}
