//! What a scene can do without: each of its terms removed in turn, and how far that moves the answer.

use super::reach::{Found, Reach, reach};
use crate::{
    case::{Case, CommonPoints, Measure, Times},
    chart::{Row, median_seconds},
    method::{Setting, SnowSetting, Stepped, Variant},
    reference::Reference,
    run::{Cut, End, Phase, Run, run},
};

/// Whether what can go is left out of the scene that is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Terms {
    /// All of them stay.
    Kept,
    /// Those that can go together are left out.
    LeftOut,
}

/// Builds the case of a scene that is written with a setting, without some of its terms, which are known by their places.
pub type Without<'a> = dyn Fn(&Stepped, &[usize]) -> Result<Case, String> + Sync + 'a;

/// What a scene knows of its terms, which has its text.
#[derive(Clone, Copy)]
pub struct SceneTerms<'a> {
    /// Names of the terms, in words, of the scene that is written with a setting.
    pub names: &'a (dyn Fn(&Stepped) -> Vec<String> + Sync),
    /// The case of that scene without some of them, by their places among the names.
    pub without: &'a Without<'a>,
    /// Columns and rows of the grid of each body, and of the one that it has in a coarser copy, `[fine, coarse]`, where a term is that a
    /// copy would have fewer particles.
    pub grids: &'a [[[u32; 2]; 2]],
    /// Whether what can go is left out.
    pub wanted: Terms,
}

impl SceneTerms<'_> {
    /// Of a scene of which no term can be removed.
    pub const NONE: SceneTerms<'static> =
        SceneTerms { names: &no_names, without: &nothing_without, grids: &[], wanted: Terms::Kept };
}

fn no_names(_: &Stepped) -> Vec<String> {
    Vec::new()
}

fn nothing_without(_: &Stepped, _: &[usize]) -> Result<Case, String> {
    Err("the scene has no terms".to_owned())
}

/// A term of a scene, and what becomes of the answer without it.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// In words: `springs of bend`, `friction of table`.
    pub name: String,
    /// Its place among the terms of the scene.
    pub place: usize,
    /// How far (m) the answer moves: the largest over the comparison times of the rms distance, of a coarser copy at the points that both
    /// have in common; none where a run without it fails, and where there was no time for one.
    pub change: Option<f64>,
    /// Why a run without it fails.
    pub failure: Option<String>,
    /// The share of evaluations and products that is saved.
    pub saved_counts: Option<f64>,
    /// The share of seconds that is saved.
    pub saving: Option<f64>,
    /// Whether it was looked at; there was no time otherwise.
    pub is_looked_at: bool,
    /// Whether the answer moves by more than the tolerance leaves, as far as is known.
    pub is_needed: bool,
    /// Whether it is among those that can go together.
    pub is_left_out: bool,
}

/// What is recommended for a case, of which terms are removed.
pub(super) struct Recommended<'a> {
    pub(super) case: &'a Case,
    /// Its row, how it was verified, and how far it runs.
    pub(super) found: &'a Found,
    /// The reference, the times at which runs are compared, and their places in the reference.
    pub(super) reference: &'a Reference,
    pub(super) times: &'a Times,
    pub(super) places: &'a [usize],
    /// The error (m) that is allowed.
    pub(super) tolerance: f64,
    /// Steps of the window, and of the scene.
    pub(super) steps: [u64; 2],
}

/// What was found of the terms of a case.
#[derive(Clone, Debug, Default)]
pub(super) struct Looked {
    pub(super) terms: Vec<Term>,
    /// How far (m) the answer moves without all that can go.
    pub(super) together_change: Option<f64>,
    /// The row of the case without them, and how far it runs; where they are left out.
    pub(super) reduced: Option<(Row, Reach)>,
    /// Whether there was no time to find out what can go.
    pub(super) is_cut: bool,
}

/// The case without some terms.
struct Left {
    case: Case,
    /// How it is stepped.
    stepped: Stepped,
    /// What it has in common with the whole, where it has other particles.
    points: Option<CommonPoints>,
}

/// Several terms that can go together.
struct Together {
    /// How far (m) the answer moves without them.
    change: f64,
    reduced: Option<(Row, Reach)>,
}

/// The terms of what is recommended, and which of them can go together: those that move the answer least, as many as move it by less
/// than what the error leaves of the tolerance. Where one was not looked at, nothing can go.
pub(super) fn terms(
    recommended: &Recommended<'_>,
    scene: &SceneTerms<'_>,
    phase: &Phase,
    tell: &dyn Fn(&str),
) -> Looked {
    let names = (scene.names)(&recommended.found.row.stepped);
    let mut looked = Looked::default();
    if names.is_empty() {
        return looked;
    }
    let whole = run(recommended.case, recommended.found.row.stepped, recommended.times, phase);
    for (place, name) in names.into_iter().enumerate() {
        tell(&format!("without {name}"));
        looked.terms.push(recommended.without((place, name), scene, &whole, phase));
    }
    looked.is_cut = looked.terms.iter().any(|term| !term.is_looked_at);
    let mut small: Vec<(usize, f64)> = looked
        .terms
        .iter()
        .filter(|term| !term.is_needed)
        .filter_map(|term| Some((term.place, term.change?)))
        .collect();
    small.sort_by(|(_, a), (_, b)| a.total_cmp(b));
    let mut places: Vec<usize> = small.into_iter().map(|(place, _)| place).collect();
    while !looked.is_cut && !places.is_empty() {
        tell("without all that can go");
        match recommended.together(&places, scene, &whole, phase) {
            Ok(Some(Together { change, reduced })) => {
                (looked.together_change, looked.reduced) = (Some(change), reduced);
                looked.terms.iter_mut().for_each(|term| term.is_left_out = places.contains(&term.place));
                break;
            }
            Ok(None) => {
                places.pop();
            }
            Err(_) => looked.is_cut = true,
        }
    }
    looked
}

impl Recommended<'_> {
    /// The case without some terms, and how it is stepped: by the same setting, but for what is removed of it.
    fn left(&self, places: &[usize], scene: &SceneTerms<'_>) -> Result<Left, String> {
        let stepped = self.found.row.stepped;
        let case = (scene.without)(&stepped, places)?;
        let is_copy = case.particle_count() != self.case.particle_count();
        let measure = self.case.measure();
        if is_copy && matches!(measure, Measure::Coordinate { .. }) {
            return Err("without it the scene has other particles".to_owned());
        }
        let case = case.measuring(measure.clone()).map_err(|error| error.to_string())?;
        let points = if is_copy && measure.is_of_positions() {
            let points = CommonPoints::between(self.case, &case, scene.grids);
            let nowhere = || "without it no particle is at a place of the whole scene".to_owned();
            Some(points.ok_or_else(nowhere)?)
        } else {
            None
        };
        let stepped = match stepped {
            Stepped::Cloth(setting) => Stepped::Cloth(Setting { precision: case.precision, ..setting }),
            Stepped::Snow(setting) => {
                let own = case.setup.snow.as_ref().map(|snow| &snow.settings);
                let variant = own.map_or(setting.variant, Variant::of);
                let cell = own.map_or(setting.cell, |own| own.cell);
                Stepped::Snow(SnowSetting { precision: case.precision, variant, cell, ..setting })
            }
        };
        Ok(Left { case, stepped, points })
    }

    /// How far (m) a run is from that of the whole case.
    pub(super) fn change(&self, whole: &Run, left: &Run, points: Option<&CommonPoints>) -> f64 {
        let pairs = whole.states.iter().zip(&left.states);
        // What is not a number is no answer.
        let distance = |(whole, left): (&Vec<f64>, &Vec<f64>)| {
            let distance = CommonPoints::apart(points, self.case, left, whole);
            if distance.is_nan() { f64::INFINITY } else { distance }
        };
        pairs.map(distance).fold(0.0, f64::max)
    }

    /// What the error leaves of the tolerance (m).
    pub(super) fn allowed(&self) -> f64 {
        self.tolerance - self.found.verified.error
    }

    /// The case without a term.
    fn without(
        &self,
        (place, name): (usize, String),
        scene: &SceneTerms<'_>,
        whole: &Run,
        phase: &Phase,
    ) -> Term {
        let unknown = Term {
            name,
            place,
            change: None,
            failure: None,
            saved_counts: None,
            saving: None,
            is_looked_at: false,
            is_needed: true,
            is_left_out: false,
        };
        if whole.end != End::Reached || phase.is_over() {
            return unknown;
        }
        let failed =
            |unknown: Term, cause: String| Term { failure: Some(cause), is_looked_at: true, ..unknown };
        let left = match self.left(&[place], scene) {
            Ok(left) => left,
            Err(cause) => return failed(unknown, cause),
        };
        let made = run(&left.case, left.stepped, self.times, phase);
        match &made.end {
            End::Cut(_) | End::Costly => unknown,
            End::Failed(failure) => failed(unknown, failure.cause.clone()),
            End::Reached => {
                let change = self.change(whole, &made, left.points.as_ref());
                let counts = |run: &Run, case: &Case| {
                    (run.work.force_evaluations + run.work.matrix_products) as f64
                        * case.particle_count() as f64
                };
                let seconds = [&made, whole].map(|run| median_seconds(&run.seconds));
                let saved =
                    |left: f64, whole: f64| Some(1.0 - left / whole).filter(|share| share.is_finite());
                Term {
                    change: Some(change),
                    saved_counts: saved(counts(&made, &left.case), counts(whole, self.case)),
                    saving: seconds[0].zip(seconds[1]).and_then(|(left, whole)| saved(left, whole)),
                    is_looked_at: true,
                    is_needed: change >= self.allowed(),
                    ..unknown
                }
            }
        }
    }

    /// The case without several terms; none where it fails, moves too far, or ends earlier. Where they are left out, it is also run on
    /// as a scene.
    fn together(
        &self,
        places: &[usize],
        scene: &SceneTerms<'_>,
        whole: &Run,
        phase: &Phase,
    ) -> Result<Option<Together>, Cut> {
        if phase.is_over() {
            return Err(phase.cut());
        }
        let Ok(Left { case, stepped, points }) = self.left(places, scene) else { return Ok(None) };
        let made = run(&case, stepped, self.times, phase);
        match made.end {
            End::Cut(cut) => return Err(cut),
            End::Failed(_) | End::Costly => return Ok(None),
            End::Reached => {}
        }
        let change = self.change(whole, &made, points.as_ref());
        if change >= self.allowed() {
            return Ok(None);
        }
        if scene.wanted == Terms::Kept {
            return Ok(Some(Together { change, reduced: None }));
        }
        let against = (self.reference, self.places);
        let row = Row::compared(&case, stepped, &made, against, points.as_ref());
        if row.error().is_none_or(|error| error > self.tolerance) {
            return Ok(None);
        }
        let reach = reach(&case, stepped, self.steps, phase);
        if reach.end.failure().is_some() && reach.steps < self.found.reach.steps {
            return Ok(None);
        }
        Ok(Some(Together { change, reduced: Some((row, reach)) }))
    }
}
