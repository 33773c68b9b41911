//! How far the runs of a sweep go: so many steps, until a time, or to the end that each scene has.

use nappe_scene::Scene;
use nappe_study::Times;

use crate::{
    studies::study::asked,
    words::error::{CliError, Result},
};

/// How far runs go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum End {
    /// So many steps, whatever their length.
    Steps(u64),
    /// Until this time (s), which the steps of each run have to divide.
    Until(f64),
    /// The steps that the scene of the run has.
    Own,
}

impl End {
    /// As it is asked for. Where it is not, runs go to the end of the scene: to its time, if its step is among the keys, so that
    /// all end at the same time; as many steps as each of them has, if their number is.
    ///
    /// # Errors
    /// A time that is not above 0, and a scene without end.
    pub(crate) fn asked(
        steps: Option<u64>,
        until: Option<f64>,
        scene: &Scene,
        keys: &[String],
    ) -> Result<Self> {
        let is_set = |name: &str| keys.iter().any(|key| key == name);
        match (steps, until) {
            (Some(steps), _) => Ok(Self::Steps(steps)),
            (None, Some(_)) => asked::end(until, scene).map(Self::Until),
            (None, None) if is_set("steps") => Ok(Self::Own),
            (None, None) if scene.steps == 0 => Err(CliError::usage(
                "the scene has no end, steps = 0: say how many with --steps N, or until when with --until S",
            )),
            (None, None) if is_set("dt") => asked::end(None, scene).map(Self::Until),
            (None, None) => Ok(Self::Steps(scene.steps)),
        }
    }

    /// The steps of the run of a scene.
    ///
    /// # Errors
    /// Why it has none that end there.
    pub(crate) fn steps(self, scene: &Scene) -> std::result::Result<u64, String> {
        match self {
            Self::Steps(steps) => Ok(steps),
            Self::Own if scene.steps == 0 => {
                Err("the scene has no end, steps = 0: 1 or more are needed".to_owned())
            }
            Self::Own => Ok(scene.steps),
            Self::Until(time) => match Times::until(time, scene.dt) {
                Ok(_) => Ok((time / scene.dt).round() as u64),
                Err(error) => Err(error.to_string()),
            },
        }
    }

    /// The steps of all runs, where they have as many.
    pub(crate) fn same_steps(self) -> Option<u64> {
        if let Self::Steps(steps) = self { Some(steps) } else { None }
    }

    /// The time (s) at which all runs end, where it is set.
    pub(crate) fn time(self) -> Option<f64> {
        if let Self::Until(time) = self { Some(time) } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_that_steps_do_not_divide_is_refused_with_the_nearest_times() {
        let scene = |dt| Scene { dt, steps: 40, ..Scene::default() };
        assert_eq!(End::Until(0.2).steps(&scene(0.005)), Ok(40));
        assert_eq!(End::Until(0.2).steps(&scene(0.01)), Ok(20));
        let error = End::Until(0.2).steps(&scene(0.03)).expect_err("it does not divide it");
        assert!(error.contains("the nearest are 0.18 s and 0.21 s"), "{error}");
    }

    #[test]
    fn without_a_wish_runs_end_where_the_scene_does() {
        let scene = Scene { dt: 0.005, steps: 40, ..Scene::default() };
        let end = |keys: &[&str]| {
            let keys: Vec<String> = keys.iter().map(|key| (*key).to_owned()).collect();
            End::asked(None, None, &scene, &keys).expect("an end")
        };
        assert_eq!(end(&["gravity.1"]), End::Steps(40));
        assert_eq!(end(&["dt"]), End::Until(0.2));
        assert_eq!([end(&["steps"]), end(&["dt", "steps"])], [End::Own, End::Own]);
        let endless = Scene { steps: 0, ..scene.clone() };
        assert!(End::asked(None, None, &endless, &[]).is_err());
        assert_eq!(End::Own.steps(&scene), Ok(40));
        assert!(End::Own.steps(&endless).is_err());
    }
}
