//! Coarser copies of a scene that is studied: what both have in common, and the copy that fits into a budget where the scene does not.

use nappe_scene::{Body, CoarserGrid, MeshSource, Scene};
use nappe_study::{Chart, Coarser, CommonPoints, NoReference, Term};

use super::{source::Source, subject::Subject};
use crate::words::output::three;

/// By how much the copies are coarser that are tried, one after another, where a scene does not fit into its budget.
const COPIES: [u32; 4] = [2, 4, 8, 16];

/// A coarser copy of a scene.
pub(crate) struct CoarserCopy {
    /// Its case, called by the name of the scene and by how much it is coarser, and the points in common.
    pub(crate) coarser: Coarser,
    /// Columns and rows of the grid of each body and of that of the copy, `[fine, coarse]`.
    pub(crate) grids: Vec<[[u32; 2]; 2]>,
    /// How many of the particles it has, as a term of a plan: `particles: a quarter`.
    pub(crate) term: String,
}

impl CoarserCopy {
    /// By how much the copy is coarser that is a term of a plan.
    pub(crate) const BY: u32 = 2;
    /// What the name of that term begins with.
    const PARTICLES: &str = "particles: ";

    /// Whether it is that term.
    pub(crate) fn is_term(term: &Term) -> bool {
        term.name.starts_with(Self::PARTICLES)
    }

    /// The copy of a scene, coarser by a whole number, 2 or more.
    ///
    /// # Errors
    /// Why there is none that can be compared, and what works.
    pub(crate) fn of(source: &Source, by: u32, meshes: &dyn MeshSource) -> Result<Self, String> {
        let copy = source.coarser(by, meshes)?;
        let grids = grids(&source.scene, &copy.scene).ok_or("a body is no grid and no chain")?;
        let points = CommonPoints::between(&source.case, &copy.case, &grids);
        let points = points.ok_or("the coarser copy has no free particle at a place of the scene")?;
        let share = share(source.case.particle_count(), copy.case.particle_count());
        let term = format!("{}{share}", Self::PARTICLES);
        Ok(Self { coarser: Coarser { case: copy.case, points }, grids, term })
    }
}

/// The finest copy of a scene that fits into its budget, in place of it.
pub(crate) struct Instead {
    pub(crate) source: Source,
    /// About how many seconds the scene itself would take.
    needed: f64,
}

impl Instead {
    /// Has the copy as what is studied.
    pub(crate) fn take_over(&self, subject: &mut Subject) {
        let name = &self.source.name;
        let takes = if self.needed.is_finite() {
            format!("would take about {} s", three(self.needed))
        } else {
            "did not come far enough to tell how long it takes".to_owned()
        };
        subject.instead = Some(format!(
            "The scene itself does not fit into the budget: it {takes}. This is of the finest copy that fits, {name}, which is another model of it."
        ));
        subject.name.clone_from(name);
    }
}

/// Seconds that a chart would need, where there was no time for its reference.
pub(crate) fn unfit(chart: &Chart) -> Option<f64> {
    match chart.missing {
        Some(NoReference::Time(needed)) if chart.reference.is_none() && !chart.is_stopped => Some(needed),
        _ => None,
    }
}

/// What is computed of a scene; where it needs more seconds than there are, as `unfit` says, that of its finest copy which does not.
pub(crate) fn fitted<T>(
    source: &Source,
    meshes: &dyn MeshSource,
    compute: &dyn Fn(&Source) -> T,
    unfit: fn(&T) -> Option<f64>,
) -> (T, Option<Instead>) {
    let found = compute(source);
    let Some(needed) = unfit(&found) else { return (found, None) };
    for by in COPIES {
        let Ok(copy) = source.coarser(by, meshes) else { continue };
        let of_copy = compute(&copy);
        if unfit(&of_copy).is_none() {
            return (of_copy, Some(Instead { source: copy, needed }));
        }
    }
    (found, None)
}

/// Columns and rows of the grid of each body of a scene and of that of a copy; none where one is no grid.
fn grids(fine: &Scene, coarse: &Scene) -> Option<Vec<[[u32; 2]; 2]>> {
    let of_body = |(fine, coarse): (&Body, &Body)| {
        let CoarserGrid { fine, coarse } = CoarserGrid::between(&fine.mesh, &coarse.mesh)?;
        Some([fine, coarse])
    };
    fine.bodies.iter().zip(&coarse.bodies).map(of_body).collect()
}

/// How many of some particles a copy has, in words, to the nearest whole part.
fn share(fine: usize, coarse: usize) -> String {
    match (fine as f64 / coarse.max(1) as f64).round() as u64 {
        0 | 1 => "most of them".to_owned(),
        2 => "a half".to_owned(),
        3 => "a third".to_owned(),
        4 => "a quarter".to_owned(),
        8 => "an eighth".to_owned(),
        part => format!("1 in {part}"),
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use nappe_scene::NoMeshes;

    use super::*;

    #[test]
    fn the_finest_copy_that_fits_is_computed_in_place_of_a_scene_that_does_not() {
        let source = Source::read("hanging_sheet", "chart").expect("it is shipped");
        let count = |source: &Source| source.case.particle_count();
        // Of 40 x 40 particles: copies have 20 x 20, 10 x 10, 5 x 5.
        let all = fitted(&source, &NoMeshes, &count, |_| None);
        assert!(all.0 == 1600 && all.1.is_none());
        let (found, instead) =
            fitted(&source, &NoMeshes, &count, |count: &usize| (*count > 200).then_some(338.0));
        let instead = instead.expect("a copy");
        assert_eq!((found, instead.source.name.as_str()), (100, "hanging_sheet coarser by 4"));
        let mut subject = source.subject(None, Duration::from_mins(1), Instant::now());
        instead.take_over(&mut subject);
        let said = subject.said("Words.");
        assert!(said.contains("about 338 s") && said.ends_with("\n\nWords."), "{said}");
        let (found, instead) = fitted(&source, &NoMeshes, &count, |_| Some(f64::INFINITY));
        assert!(found == 1600 && instead.is_none());
    }

    #[test]
    fn a_share_of_particles_is_the_nearest_whole_part() {
        for (fine, coarse, words) in [
            (1600, 400, "a quarter"),
            (441, 121, "a quarter"),
            (12, 6, "a half"),
            (900, 100, "1 in 9"),
            (8000, 1000, "an eighth"),
            (3, 2, "a half"),
            (9, 8, "most of them"),
        ] {
            assert_eq!(share(fine, coarse), words, "{coarse} of {fine}");
        }
    }
}
