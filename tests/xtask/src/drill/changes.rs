//! A client that changes a session while its server is killed, and remembers what was answered.
//!
//! Enters: a session that plays. Leaves: its changes, each with the step before which it takes effect.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::Duration,
};

use super::server::{Caller, number, step, until};
use crate::shell::Failure;

/// How many steps ahead a change is sent: three seconds of a session at the pace of a clock.
const AHEAD: u64 = 600;
/// Changes that a server is sent before the steps are taken that need them.
const AT_ONCE: usize = 100;

/// What changes a session.
#[derive(Clone, Copy, Debug)]
pub(super) struct Changer {
    /// Between two changes.
    pub(super) pause: Duration,
    /// The options of `nappe update` that make the change of a number.
    pub(super) options: fn(u64) -> Vec<String>,
}

/// A change that a session has taken, or will.
#[derive(Clone, Debug)]
pub(super) struct Change {
    /// The step before which it takes effect.
    pub(super) step: u64,
    options: Vec<String>,
}

/// What became of a call.
enum Answer {
    /// It is accepted, with its place in the order of all.
    Accepted { order: u64, step: u64 },
    /// The server was killed meanwhile.
    Cut,
}

/// Changes a session until it is told to end; what was accepted, in its order.
pub(super) fn change(
    caller: &Caller,
    id: &str,
    changer: Changer,
    is_over: &AtomicBool,
) -> Result<Vec<Change>, Failure> {
    let (mut changes, mut last) = (Vec::new(), None);
    let mut least = 0;
    for count in 0_u64.. {
        if is_over.load(Ordering::Relaxed) {
            break;
        }
        let at_step = least.max(taken(caller, id)? + AHEAD);
        let options = (changer.options)(count);
        let (order, effective) = insist(caller, id, at_step, &options, last, &mut changes)?;
        changes.push(Change { step: effective, options });
        last = Some(order);
        least = effective + 1;
        thread::sleep(changer.pause);
    }
    Ok(changes)
}

/// The steps that a session has taken, whenever the server answers.
fn taken(caller: &Caller, id: &str) -> Result<u64, Failure> {
    let mut taken = None;
    until("the server lists its sessions", || {
        taken = caller.call(&["list", "--json"]).ok().and_then(|list| step_of(&list, id));
        Ok(taken.is_some())
    })?;
    taken.ok_or_else(|| Failure(format!("the session {id} is in no list")))
}

/// Sends a change until it is answered: its order, and the step before which it takes effect. One that was accepted before an answer
/// could be sent does the same, unless this one comes too late: then it is remembered too.
fn insist(
    caller: &Caller,
    id: &str,
    at_step: u64,
    options: &[String],
    last: Option<u64>,
    changes: &mut Vec<Change>,
) -> Result<(u64, u64), Failure> {
    let mut cuts = 0;
    loop {
        let Answer::Accepted { order, step } = send(caller, id, at_step, options)? else {
            cuts += 1;
            caller.wait()?;
            continue;
        };
        // Each call has the order after that of the one before. Nothing is known before the first.
        let before = last.unwrap_or(order.saturating_sub(1));
        let unanswered = order.checked_sub(before + 1).filter(|unanswered| *unanswered <= cuts);
        let unanswered = unanswered.ok_or_else(|| {
            Failure(format!("{id}: a call has the order {order} after {before} and {cuts} without an answer"))
        })?;
        if unanswered > 0 && step != at_step {
            changes.push(Change { step: at_step, options: options.to_vec() });
        }
        return Ok((order, step));
    }
}

/// Sends a change once.
fn send(caller: &Caller, id: &str, at_step: u64, options: &[String]) -> Result<Answer, Failure> {
    /// The exit code of a refusal.
    const REFUSED: i32 = 5;
    let at_step = at_step.to_string();
    let mut command = caller.command(&["update", id, "--json", "--at-step", &at_step]);
    let done = command.args(options).output().map_err(|error| Failure(format!("nappe update: {error}")))?;
    let said = String::from_utf8_lossy(&done.stdout);
    match (done.status.code(), number(&said, "order"), number(&said, "effective_step")) {
        (Some(0), Some(order), Some(step)) => Ok(Answer::Accepted { order, step }),
        (Some(REFUSED), ..) => {
            let told = String::from_utf8_lossy(&done.stderr);
            Err(Failure(format!("{id}: {} is refused: {}", options.join(" "), told.trim())))
        }
        _ => Ok(Answer::Cut),
    }
}

/// Repeats changes on a session that stands at its start, and takes so many steps: what the last call says.
pub(super) fn repeat(caller: &Caller, id: &str, changes: &[Change], steps: u64) -> Result<String, Failure> {
    for part in changes.chunks(AT_ONCE) {
        if let Some(first) = part.first() {
            caller.call(&["step", id, "--to", &first.step.to_string()])?;
        }
        for Change { step, options } in part {
            let at_step = step.to_string();
            let options = options.iter().map(String::as_str);
            let words: Vec<&str> =
                ["update", id, "--json", "--at-step", &at_step].into_iter().chain(options).collect();
            let said = caller.call(&words)?;
            if number(&said, "effective_step") != Some(*step) {
                return Err(Failure(format!("{id}: a change for step {step} comes too late: {said}")));
            }
        }
    }
    caller.call(&["step", id, "--to", &steps.to_string(), "--json"])
}

/// The steps that a session has taken, in a list of sessions.
pub(super) fn step_of(list: &str, id: &str) -> Option<u64> {
    step(list.split_once(&format!("\"session_id\":\"{id}\""))?.1)
}
