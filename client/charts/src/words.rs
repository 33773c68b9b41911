//! Lists, names and clauses in the words of pictures.

/// Lengths, times and numbers are written here as the text of the command has them.
pub(crate) use nappe_study::quantity::{length, moment, number, time};
use nappe_study::{Chart, Method, Row, Variant, cheapest};

/// Names or clauses one after another, the last after "and".
pub(crate) fn listed(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// The name that a reader writes for a method of cloth or a variant of snow with this name; of others, that name itself.
pub(crate) fn reader(name: &str) -> String {
    let cloth = Method::studied().into_iter().find(|method| method.name() == name).map(Method::reader_name);
    let snow = || Variant::all().into_iter().find(|variant| variant.name() == name).map(Variant::reader_name);
    cloth.or_else(snow).unwrap_or_else(|| name.to_owned())
}

/// A name of a method as it stands within a sentence, where commas part names: what specifies it is in parentheses.
pub(crate) fn within(name: &str) -> String {
    name.split_once(", ").map_or_else(|| name.to_owned(), |(first, rest)| format!("{first} ({rest})"))
}

/// What errors of a chart are, beside an axis.
pub(crate) const fn error_label(chart: &Chart) -> &'static str {
    if chart.measure.is_of_positions() { "rms error (mm)" } else { "error (mm)" }
}

/// What is cheapest to a tolerance (m), as a clause.
pub(crate) fn cheapest_to(rows: &[Row], tolerance: f64) -> String {
    match cheapest(rows, tolerance) {
        None => format!("no row comes within {}", length(tolerance)),
        Some(row) => format!(
            "{} in {} with steps of {} is the cheapest to {}: {} per simulated second",
            within(&row.stepped.reader_name()),
            row.stepped.precision(),
            time(row.dt),
            length(tolerance),
            row.seconds.map_or_else(String::new, time)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_within_sentences_have_no_comma_that_parts_names() {
        let names = ["velocity Verlet", "BDF2, Newton, controlled steps"].map(within);
        assert_eq!(names, ["velocity Verlet", "BDF2 (Newton, controlled steps)"]);
    }

    #[test]
    fn names_of_tables_are_read() {
        assert_eq!(reader("implicit_midpoint_newton"), "implicit midpoint, Newton");
        assert_eq!(reader("pic_flip_cubic"), "PIC/FLIP, cubic kernel");
        assert_eq!(reader("something else"), "something else");
    }

    #[test]
    fn lists_end_in_and() {
        let names = ["a", "b", "c"].map(str::to_owned);
        assert_eq!([listed(&names), listed(&names[..1])], ["a, b and c", "a"]);
    }
}
