//! What the steps of each method are, from the runs that were tried: stable, wrong, failed.

use nappe_study::{Method, Over, Stability, StabilityRow, Stepping, Verdict};

/// What steps are; what lies between two of them is the later one of the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    Stable,
    Wrong,
    Failed,
    Unknown,
}

impl Kind {
    const fn of(verdict: Verdict) -> Self {
        match verdict {
            Verdict::NotKnown | Verdict::Warned | Verdict::None => Self::Unknown,
            Verdict::Wrong => Self::Wrong,
            Verdict::Stable | Verdict::Survived | Verdict::Recovered => Self::Stable,
            Verdict::Grows
            | Verdict::Diverged
            | Verdict::Indefinite
            | Verdict::Refused
            | Verdict::Detected
            | Verdict::Lost => Self::Failed,
        }
    }
}

/// Steps (s) of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Part {
    pub(crate) kind: Kind,
    pub(crate) from: f64,
    pub(crate) to: f64,
}

/// What a method bears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Bears {
    /// Steps up to this (s).
    UpTo(f64),
    /// None that was tried.
    Nothing,
    /// All that were tried, up to this (s).
    All(f64),
    /// Time was over before it was known, or its steps are refused.
    Unfinished,
}

/// The steps of a method.
#[derive(Clone, Debug)]
pub(crate) struct Bar<'a> {
    pub(crate) name: String,
    method: Method,
    /// The limit of the runs that are drawn.
    limit: Option<&'a StabilityRow>,
    /// The same at rest.
    at_rest: Option<&'a StabilityRow>,
    /// From the shortest steps to the longest.
    pub(crate) parts: Vec<Part>,
}

impl Bar<'_> {
    /// What it bears.
    pub(crate) fn bears(&self) -> Bears {
        match self.limit {
            Some(row) if is_known(row) => match row.limit {
                Some(limit) if limit > 0.0 => Bears::UpTo(limit),
                Some(_) => Bears::Nothing,
                None => Bears::All(row.dt),
            },
            _ => Bears::Unfinished,
        }
    }

    /// Why its limit is not known, where it is not.
    pub(crate) fn cause(&self) -> Option<String> {
        let limit = self.limit.filter(|limit| !is_known(limit))?;
        // The reason stands in the table: each method has one of its own.
        if limit.is_refused() { Some("refused".to_owned()) } else { limit.cause.clone() }
    }

    /// The certified bound (s), where there is one.
    pub(crate) fn bound(&self) -> Option<f64> {
        self.limit?.bound.filter(|bound| is_length(*bound))
    }

    /// What theory says at rest (s), where it names a step.
    pub(crate) fn theory(&self) -> Option<f64> {
        self.at_rest?.theory.filter(|theory| is_length(*theory))
    }

    /// The limit that was measured at rest (s), where there is one.
    pub(crate) fn measured(&self) -> Option<f64> {
        self.at_rest?.limit.filter(|limit| is_length(*limit))
    }

    /// Steps (s) that its picture should show.
    pub(crate) fn shown(&self) -> Vec<f64> {
        let marks = [self.bound(), self.theory(), self.measured()].into_iter().flatten();
        marks.chain(self.parts.iter().map(|part| part.from)).filter(|step| is_length(*step)).collect()
    }
}

/// Whether a limit was found.
fn is_known(limit: &StabilityRow) -> bool {
    limit.verdict != Verdict::NotKnown && !limit.is_refused()
}

fn is_length(step: f64) -> bool {
    step.is_finite() && step > 0.0
}

fn is_probe(row: &StabilityRow, over: Over) -> bool {
    !row.is_limit && row.over == over && row.across.is_none() && row.stepping == Stepping::Raw
}

/// The runs that are drawn: those under load; those at rest where there are none.
pub(crate) fn drawn(stability: &Stability) -> Over {
    let has_load = stability.rows.iter().any(|row| is_probe(row, Over::Load));
    if has_load { Over::Load } else { Over::Rest }
}

/// The longest step (s) that was tried with any method; 0 where there was no run.
pub(crate) fn longest(stability: &Stability, over: Over) -> f64 {
    let steps = stability.rows.iter().filter(|row| is_probe(row, over)).map(|row| row.dt);
    steps.fold(0.0, f64::max)
}

/// The steps of each method that has rows, in the order in which they first appear.
pub(crate) fn of(stability: &Stability, over: Over) -> Vec<Bar<'_>> {
    let end = longest(stability, over);
    let mut bars: Vec<Bar<'_>> = Vec::new();
    let rows = stability.rows.iter().filter(|row| row.across.is_none() && row.stepping == Stepping::Raw);
    for row in rows {
        if !bars.iter().any(|bar| bar.method == row.method) {
            let of_method = |over: Over| stability.limits(over).find(|limit| limit.method == row.method);
            let probes =
                stability.rows.iter().filter(|probe| is_probe(probe, over) && probe.method == row.method);
            let mut probes: Vec<_> = probes.map(|probe| (probe.dt, Kind::of(probe.verdict))).collect();
            probes.sort_by(|a, b| a.0.total_cmp(&b.0));
            let limit = of_method(over);
            // Of a limit that was not found, single steps say nothing that a bar could show.
            let is_known = limit.is_some_and(is_known);
            let unknown = || vec![Part { kind: Kind::Unknown, from: 0.0, to: end }];
            bars.push(Bar {
                name: row.method.reader_name(),
                method: row.method,
                limit,
                at_rest: of_method(Over::Rest),
                parts: if is_known { parts(&probes, end) } else { unknown() },
            });
        }
    }
    bars
}

/// What lies between steps (s) of some kinds, and beyond them until an end (s).
fn parts(probes: &[(f64, Kind)], end: f64) -> Vec<Part> {
    let (Some(first), Some(last)) = (probes.first(), probes.last()) else { return Vec::new() };
    // Steps shorter than the shortest are as that is, unless it is wrong: an error falls with the step.
    let kind = if first.1 == Kind::Wrong { Kind::Unknown } else { first.1 };
    let mut parts = vec![Part { kind, from: 0.0, to: first.0 }];
    for (below, above) in probes.iter().zip(&probes[1..]) {
        parts.push(Part { kind: below.1.max(above.1), from: below.0, to: above.0 });
    }
    if last.1 == Kind::Failed {
        parts.push(Part { kind: Kind::Failed, from: last.0, to: end.max(last.0) });
    }
    parts.retain(|part| part.to > part.from);
    parts.dedup_by(|next, kept| {
        let is_same = next.kind == kept.kind;
        if is_same {
            kept.to = next.to;
        }
        is_same
    });
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(probes: &[(f64, Kind)]) -> Vec<(Kind, f64, f64)> {
        parts(probes, 100.0).into_iter().map(|part| (part.kind, part.from, part.to)).collect()
    }

    #[test]
    fn what_lies_between_two_kinds_belongs_to_the_worse() {
        use Kind::{Failed, Stable, Unknown, Wrong};
        assert!(kinds(&[]).is_empty());
        assert_eq!(kinds(&[(1.0, Failed)]), [(Failed, 0.0, 100.0)]);
        assert_eq!(kinds(&[(1.0, Stable), (100.0, Stable)]), [(Stable, 0.0, 100.0)]);
        assert_eq!(
            kinds(&[(1.0, Stable), (2.0, Wrong), (4.0, Wrong), (5.0, Failed)]),
            [(Stable, 0.0, 1.0), (Wrong, 1.0, 4.0), (Failed, 4.0, 100.0)]
        );
        assert_eq!(
            kinds(&[(1.0, Stable), (2.0, Unknown), (4.0, Wrong)]),
            [(Stable, 0.0, 1.0), (Unknown, 1.0, 4.0)]
        );
        assert_eq!(kinds(&[(4.0, Wrong)]), [(Unknown, 0.0, 4.0)]);
    }
}
