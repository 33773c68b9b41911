//! A sweep of a scene over one key or two: what was measured of its runs.

mod runs;
mod values;
mod curves;
mod cells;

pub use self::runs::{Sweep, SweepRun};
use crate::picture::Picture;

/// A sweep over one key, its quantities against it, or over two, the first quantity in colours over both.
///
/// # Errors
/// A sweep over more keys, and what the plotter cannot make pixels of.
pub fn picture(sweep: &Sweep) -> Result<Picture, String> {
    match sweep.keys.as_slice() {
        [key] => curves::picture(sweep, key),
        [_, _] => cells::picture(sweep),
        keys => Err(format!("a sweep over {} keys has no picture: one key or two can be drawn", keys.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sweep in which a quantity is the sum of the keys, and a run failed.
    fn sweep(keys: &[&str], values: &[&[&str]]) -> Sweep {
        let run = |(place, values): (usize, &&[&str])| SweepRun {
            values: values.iter().map(|value| (*value).to_owned()).collect(),
            measured: (place != 1).then(|| vec![place as f64, 1.0]),
        };
        Sweep {
            scene: "flag".to_owned(),
            keys: keys.iter().map(|key| (*key).to_owned()).collect(),
            units: keys.iter().map(|key| if *key == "drag" { "N s/m" } else { "" }.to_owned()).collect(),
            quantities: vec!["sum".to_owned(), "max_stretch".to_owned()],
            runs: values.iter().enumerate().map(run).collect(),
            count: values.len(),
        }
    }

    #[test]
    fn a_picture_names_its_keys_and_quantities_whatever_their_values_are() {
        let one: [&[&[&str]]; 4] = [
            &[&["1"], &["5"], &["20"]],
            &[&["bdf2"], &["[1, 0]"], &["a < b & c"]],
            &[&["1e300"], &["-1e300"], &["0"]],
            &[&["7"], &["7"]],
        ];
        for values in one {
            let picture = picture(&sweep(&["drag"], values)).expect("a picture");
            for words in ["drag", "sum", "max_stretch", "runs finished", "crossed"] {
                assert!(picture.svg.contains(words), "{words}: {values:?}");
            }
        }
        let two: [&[&[&str]]; 3] = [
            &[&["1", "a"], &["1", "b"], &["2", "a"], &["2", "b"]],
            &[&["0.1", "0.5"], &["0.25", "30"], &["0.3", "700"], &["0.4", "1"], &["0.6", "2"]],
            &[&["1e90", "1"], &["1e90", "1"]],
        ];
        for values in two {
            let picture = picture(&sweep(&["drag", "wind.0"], values)).expect("a picture");
            for words in ["drag", "wind.0", "sum", "crossed"] {
                assert!(picture.svg.contains(words), "{words}: {values:?}");
            }
            assert!(!picture.svg.contains("NaN"), "{values:?}");
        }
    }

    #[test]
    fn an_axis_has_the_unit_of_its_key_and_one_without_a_unit_has_its_name_alone() {
        let one = picture(&sweep(&["drag"], &[&["1"], &["5"]])).expect("a picture");
        assert!(one.svg.contains(">drag (N s/m)<"), "{}", one.svg);
        let values: [&[&str]; 4] = [&["1", "1"], &["1", "2"], &["2", "1"], &["2", "2"]];
        let two = picture(&sweep(&["drag", "sweeps"], &values)).expect("a picture");
        assert!(two.svg.contains(">drag (N s/m)<") && two.svg.contains(">sweeps<"), "{}", two.svg);
    }

    #[test]
    fn a_quantity_that_spans_two_decades_is_drawn_by_logarithms() {
        let mut of = sweep(&["drag", "sweeps"], &[&["1", "1"], &["1", "2"], &["2", "1"], &["2", "2"]]);
        for (least, greatest, is_log) in
            [(0.02, 2.0, true), (0.03, 2.0, false), (0.0, 2.0, false), (-1.0, 500.0, false)]
        {
            for (place, run) in of.runs.iter_mut().enumerate() {
                run.measured = Some(vec![if place == 0 { least } else { greatest }, 1.0]);
            }
            let made = picture(&of).expect("a picture");
            assert_eq!(made.svg.contains("sum, by logarithms"), is_log, "{least} to {greatest}");
            assert!(!made.svg.contains("NaN"), "{least} to {greatest}");
        }
        let mut of = sweep(&["drag"], &[&["1"], &["2"], &["3"]]);
        for (run, quantity) in of.runs.iter_mut().zip([0.01, 1.0, 100.0]) {
            run.measured = Some(vec![quantity, 1.0]);
        }
        let made = picture(&of).expect("a picture");
        for number in [">0.01<", ">0.1<", ">1<", ">10<", ">100<"] {
            assert!(made.svg.contains(number), "{number}");
        }
    }

    #[test]
    fn more_keys_than_two_are_refused() {
        let error = picture(&sweep(&["a", "b", "c"], &[&["1", "2", "3"]])).expect_err("no picture");
        assert!(error.contains("3 keys"), "{error}");
    }
}
