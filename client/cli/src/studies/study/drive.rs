//! A study on threads of its own, until its budget is used up or a signal comes.

use std::{convert::Infallible, future, sync::Arc, time::Duration};

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use nappe_scene::printable;
use nappe_study::{Budget, Stop};
use rayon::ThreadPoolBuilder;

use crate::{
    outside::remote,
    words::{
        error::{CliError, Exit, Result},
        output,
    },
};

/// Time between two lines in a file or a pipe.
const INTERVAL: Duration = Duration::from_secs(10);

/// Computes on so many threads of its own, until its seconds are over, if they are limited, or a signal comes. The work is given
/// the budget, and what tells what is done now.
///
/// # Errors
/// Threads that cannot be started, and a panic.
pub(crate) fn compute<T: Send + 'static>(
    threads: usize,
    seconds: Option<Duration>,
    work: impl FnOnce(&Budget, &dyn Fn(&str)) -> T + Send + 'static,
) -> Result<T> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| {
        let threads = output::several(threads as u64, "thread");
        CliError::failure(format!("cannot start {threads}: {error}"))
    })?;
    let budget = Budget::start(seconds).map_err(|error| {
        CliError::failure(format!("cannot start a thread that looks at the time: {error}"))
    })?;
    let (stop, bar) = (budget.stop(), progress(budget.stop()));
    remote::block_on(async move {
        let signals = remote::catch_signals()?;
        let shown = Arc::new(bar);
        let told = Arc::clone(&shown);
        let mut work = tokio::task::spawn_blocking(move || {
            pool.install(|| work(&budget, &|what| told.set_message(printable(what).into_owned())))
        });
        let ended = tokio::select! {
            ended = &mut work => ended,
            never = tell(&shown, &stop) => match never {},
            signal = remote::interrupted_by(signals) => {
                signal?;
                stop.stop();
                work.await
            }
        };
        shown.finish_and_clear();
        ended.map_err(|error| {
            CliError::failure(format!("the study ended in an error of this program: {error}"))
        })
    })
}

/// Writes what is done now as lines where standard error is a file or a pipe, until nobody waits for it any more.
async fn tell(bar: &ProgressBar, stop: &Stop) -> Infallible {
    if !bar.is_hidden() {
        return future::pending().await;
    }
    loop {
        tokio::time::sleep(INTERVAL).await;
        let left = stop.left().map_or_else(String::new, |left| format!("{} s left: ", left.as_secs()));
        output::note(&format!("{left}{}", bar.message()));
    }
}

/// The end of a study that a signal came to.
pub(crate) fn interrupted() -> CliError {
    CliError::new(Exit::Interrupted, "interrupted: what was found until then is written")
}

/// What is done now, and the time that is left.
fn progress(stop: Stop) -> ProgressBar {
    let left = move |_: &ProgressState, out: &mut dyn std::fmt::Write| {
        if let Some(left) = stop.left() {
            // A bar that is not shown is no failure.
            let _ = write!(out, "{} s left: ", left.as_secs());
        }
    };
    let style = ProgressStyle::with_template("{spinner} {left}{msg}").expect("a template that is right");
    let bar = ProgressBar::new_spinner().with_style(style.with_key("left", left));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
