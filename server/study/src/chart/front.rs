//! The front of a chart: the rows that no other row beats in error and seconds.

use super::row::Row;

/// Marks the rows of the front, of those that are ranked: errors below a floor (m) are all alike.
pub(crate) fn mark(rows: &mut [Row], floor: f64) {
    let error = |row: &Row| row.error().filter(|_| row.is_ranked()).map(|error| error.max(floor));
    let place = |row: &Row| error(row).zip(row.seconds);
    let places: Vec<_> = rows.iter().map(place).collect();
    for (row, own) in rows.iter_mut().zip(&places) {
        let beaten = |own: [f64; 2]| places.iter().flatten().any(|other| is_better([other.0, other.1], own));
        row.front = own.is_some_and(|(error, seconds)| !beaten([error, seconds]));
    }
}

/// Whether one place is at least as good as another in both, and better in one.
fn is_better(one: [f64; 2], other: [f64; 2]) -> bool {
    one[0] <= other[0] && one[1] <= other[1] && one != other
}

/// The cheapest row whose error is known to be at most that (m).
pub fn cheapest(rows: &[Row], error: f64) -> Option<&Row> {
    let good = rows.iter().filter(|row| row.told().is_some_and(|found| found <= error));
    good.filter(|row| row.seconds.is_some()).min_by(|a, b| {
        let seconds = |row: &Row| row.seconds.unwrap_or(f64::INFINITY);
        seconds(a).total_cmp(&seconds(b))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_that_another_beats_in_both_is_not_on_the_front() {
        assert!(is_better([1.0, 1.0], [2.0, 2.0]) && is_better([1.0, 2.0], [2.0, 2.0]));
        assert!(!is_better([1.0, 3.0], [2.0, 2.0]) && !is_better([2.0, 2.0], [2.0, 2.0]));
    }
}
