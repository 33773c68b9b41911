//! Links: what a request for one asks for, and what an opened one gives.

use std::{
    io,
    time::{Duration, Instant},
};

use nappe_proto::v1;

use super::shared::Shared;
use crate::{
    error::{Reason, ServiceError},
    links::Opened,
    passes::{self, Grant, Visitor},
};

/// Copies that each who opens a link may have at a time, at most.
const MOST_FORKS: u32 = 4;
/// How often a link can be opened at most.
const MOST_USES: u32 = 1000;
/// How long a link to a session is good at most, and what it gave (s).
const MOST_SECONDS: u32 = 12 * 3600;

/// Makes a link: to everything, or to one session.
///
/// # Errors
/// If a field is not allowed, there is no such session, or the system has no random numbers.
pub(super) fn make(
    shared: &Shared,
    visitor: &Visitor,
    request: &v1::MakeLinkRequest,
    now: Instant,
) -> Result<v1::MakeLinkResponse, ServiceError> {
    let v1::MakeLinkRequest { session_id, forks, uses, seconds } = request;
    let links = &shared.links;
    if session_id.is_empty() {
        if *forks > 0 || *uses > 0 || *seconds > 0 {
            let problem = "is empty: forks, uses and seconds are those of a link to one session";
            return Err(ServiceError::field("session_id", problem));
        }
        let code = links.make(now).map_err(|error| no_random_numbers(&error))?;
        return Ok(answer(code.reveal(), links.time()));
    }

    if links.token().is_none() {
        let problem = "is set, and this server asks for no token: whoever reaches it may do everything";
        return Err(ServiceError::field("session_id", problem));
    }
    for (name, value, most) in
        [("forks", *forks, MOST_FORKS), ("uses", *uses, MOST_USES), ("seconds", *seconds, MOST_SECONDS)]
    {
        if value > most {
            let problem = format!("is {value}: allowed are at most {most}");
            return Err(ServiceError::field(name, problem).with("value", value).with("allowed", most));
        }
    }
    let session = shared.session(visitor, session_id, "")?;
    let time = if *seconds == 0 { links.time() } else { Duration::from_secs(u64::from(*seconds)) };
    let grant = Grant { session_uid: session.uid().to_owned(), forks: *forks, until: now + time };
    let code = links.make_for(grant, (*uses).max(1), now).map_err(|error| no_random_numbers(&error))?;
    Ok(answer(code.reveal(), time))
}

fn answer(code: &str, time: Duration) -> v1::MakeLinkResponse {
    v1::MakeLinkResponse { code: code.to_owned(), expires_in_seconds: time.as_secs_f64() }
}

/// The token that a code is traded for; empty where the server asks for none.
///
/// # Errors
/// If the code is not good, as many tokens of links are good as may be, or the system has no random numbers.
pub(super) fn open(shared: &Shared, code: &str, now: Instant) -> Result<String, ServiceError> {
    let not_found = |message: String| ServiceError::new(Reason::LinkNotFound, message);
    let told = "no link has this code: it was opened before, is too old, or gave way to newer ones";
    match shared.links.open(code, now, shared.passes.places(now)) {
        None => Err(not_found(told.to_owned())),
        Some(Opened::Everything) => {
            Ok(shared.links.token().map_or_else(String::new, |token| token.reveal().to_owned()))
        }
        Some(Opened::Session(grant)) if !shared.registry.has(&grant.session_uid) => {
            Err(not_found("the session of this link is deleted".to_owned()))
        }
        Some(Opened::Session(grant)) => {
            let given = shared.passes.give(grant, now).map_err(|error| no_random_numbers(&error))?;
            given.map(|token| token.reveal().to_owned()).ok_or_else(|| {
                not_found(format!("{} tokens of links are good, which is as many as may be", passes::MOST))
            })
        }
    }
}

fn no_random_numbers(error: &io::Error) -> ServiceError {
    ServiceError::internal(format!("the system gives no random numbers: {error}"))
}
