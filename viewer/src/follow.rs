//! Shows every session of a server, those there and those to come: `--every-session`.
//!
//! Asks for the list of sessions now and then; each new one gets a task that watches its newest frames. A Rerun viewer
//! that stalls stalls its task, never a step.

use std::{collections::BTreeSet, convert::Infallible, time::Duration};

use nappe_client::{Client, ClientError};
use nappe_rerun::{ShowOptions, Sink, show};

use crate::{server::Server, tell::Audience};

/// How often the list is asked for.
const INTERVAL: Duration = Duration::from_millis(500);

/// Shows the sessions of a server as long as it is polled: a call that fails is told once and tried again.
pub(crate) async fn follow(server: &Server, sink: Sink, audience: Audience) -> Infallible {
    let mut client = None;
    let mut shown = BTreeSet::new();
    let mut has_failed = false;
    loop {
        match listed(server, &mut client).await {
            Ok((client, ids)) => {
                has_failed = false;
                for id in &ids - &shown {
                    tokio::spawn(show_one(client.clone(), id, sink.clone(), audience));
                }
                // A deleted id may come again, and is then shown again.
                shown = ids;
            }
            Err(error) if !has_failed => {
                has_failed = true;
                audience.note(&format!("no new session is shown in Rerun for now: {error}"));
            }
            Err(_same) => {}
        }
        tokio::time::sleep(INTERVAL).await;
    }
}

/// Shows a session until it ends.
async fn show_one(client: Client, id: String, sink: Sink, audience: Audience) {
    let options = ShowOptions::for_sink(&sink, 0);
    let shown = show(&client, &id, sink, options, std::future::pending(), |_| {}).await;
    if let Err(error) = shown {
        audience.note(&format!("session {id} is no longer shown in Rerun: {error}"));
    }
}

/// The ids of all sessions, through a client that is made when it is first needed.
async fn listed(
    server: &Server,
    client: &mut Option<Client>,
) -> Result<(Client, BTreeSet<String>), ClientError> {
    let connected = match client {
        Some(client) => client,
        None => client.insert(server.connect().await?),
    };
    let sessions = connected.list_sessions().await?;
    Ok((connected.clone(), sessions.into_iter().map(|session| session.session_id).collect()))
}
