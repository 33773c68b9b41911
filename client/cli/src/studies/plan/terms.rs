//! What a scene can do without, in words: a table of its terms, and which of them can go together.

use nappe_study::{Plan, Term};

use crate::{
    studies::study::CoarserCopy,
    words::output::{Column, length, table},
};

/// The least share of the time that is no noise.
const LEAST_SAVING: f64 = 0.05;

/// What the scene can do without, as a table and a sentence; nothing where no term was looked at.
pub(crate) fn terms(plan: &Plan) -> String {
    if plan.terms.is_empty() {
        return String::new();
    }
    let row = |term: &Term| {
        let (moves, what) = match term.change {
            _ if !term.is_looked_at => ("not known".to_owned(), "was not looked at: out of time"),
            None => ("fails".to_owned(), "needed"),
            Some(change) if term.is_left_out => (moved(change), "can go"),
            Some(change) if term.is_needed => (moved(change), "needed"),
            Some(change) if plan.is_terms_cut => (moved(change), "small"),
            Some(change) => (moved(change), "small, but not with the others"),
        };
        vec![term.name.clone(), moves, term.saving.map_or_else(String::new, saved), what.to_owned()]
    };
    let columns = [
        Column::Left("without"),
        Column::Right("the answer moves by"),
        Column::Right("time saved"),
        Column::Left("so it"),
    ];
    let table = table(&columns, &plan.terms.iter().map(row).collect::<Vec<_>>());
    format!("{table}\n\n{} Terms were compared {}.", sentence(plan), plan.chart.compared())
}

/// What can go, with its evidence.
fn sentence(plan: &Plan) -> String {
    let names = |is_one: &dyn Fn(&Term) -> bool| {
        let names: Vec<&str> =
            plan.terms.iter().filter(|term| is_one(term)).map(|term| term.name.as_str()).collect();
        names.join(", ")
    };
    let left = left(plan);
    if let Some(change) = plan.together_change {
        let gone = names(&|term| term.is_left_out);
        let copy = if plan.terms.iter().any(|term| term.is_left_out && CoarserCopy::is_term(term)) {
            " A coarser copy of the scene has that share of the particles; --leave-out with --write writes it."
        } else {
            ""
        };
        return format!(
            "With all of these removed the answer moves by {}, less than {left}: together these can go: {gone}.{copy}",
            moved(change)
        );
    }
    let unknown = names(&|term| !term.is_looked_at);
    if !unknown.is_empty() {
        return format!("Nothing is left out, since these were not looked at: out of time: {unknown}.");
    }
    if plan.is_terms_cut {
        return "Nothing is left out: out of time before it was known which of them can go together."
            .to_owned();
    }
    if plan.terms.iter().all(|term| term.is_needed) {
        return format!("Every term moves the answer by more than {left}, or fails without it.");
    }
    "Nothing can go: without any of the small ones the scene does not run as far as with it.".to_owned()
}

/// What its error leaves of the tolerance; of snow also what is not known of its reference.
fn left(plan: &Plan) -> String {
    let (tolerance, floor) = (plan.chart.tolerance, plan.chart.floor);
    let error = plan.verified.map_or(0.0, |verified| verified.error);
    let is_snow = plan.row.as_ref().is_some_and(|row| row.stepped.cell().is_some());
    let (all, of) = ([tolerance, error].map(length), tolerance - error);
    if is_snow {
        let left = length((of - floor).max(0.0));
        format!(
            "the {left} that its error of {} and the {} that its reference is known to leave of {}",
            all[1],
            length(floor),
            all[0]
        )
    } else {
        format!("the {} that its error of {} leaves of {}", length(of.max(0.0)), all[1], all[0])
    }
}

/// How far an answer moves (m).
fn moved(change: f64) -> String {
    if change == 0.0 { "0".to_owned() } else { length(change) }
}

/// A share of the time that is saved; what is below a twentieth is noise.
fn saved(share: f64) -> String {
    if share.abs() < LEAST_SAVING {
        "none".to_owned()
    } else if share < 0.0 {
        let times = format!("{:.2}", 1.0 - share);
        format!("takes {} times as long", times.trim_end_matches('0').trim_end_matches('.'))
    } else {
        format!("{:.0} %", 100.0 * share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_saving_is_a_share_none_or_a_multiple() {
        for (share, words) in [
            (0.11, "11 %"),
            (0.049, "none"),
            (-0.049, "none"),
            (0.0, "none"),
            (-0.4, "takes 1.4 times as long"),
            (-4.1, "takes 5.1 times as long"),
            (-1.0, "takes 2 times as long"),
        ] {
            assert_eq!(saved(share), words, "{share}");
        }
    }
}
