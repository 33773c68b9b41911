//! Shows every session of a server in Rerun, as any client could: `serve --rerun`.
//!
//! Asks for the list of sessions now and then; each new one gets a task that watches its newest
//! frames. A viewer that stalls stalls its task, never a step.

use nappe_server::App;

use crate::error::Result;

/// The viewer that sessions are shown in.
#[cfg(feature = "rerun")]
#[derive(Clone, Debug)]
pub(crate) struct Viewer(nappe_rerun::Sink);

/// No viewer: this build has no Rerun.
#[cfg(not(feature = "rerun"))]
#[derive(Clone, Copy, Debug)]
pub(crate) enum Viewer {}

impl Viewer {
    /// The viewer at a URL; with an empty one, a viewer that is started here.
    ///
    /// # Errors
    /// In a build without Rerun.
    #[cfg(feature = "rerun")]
    #[allow(clippy::unnecessary_wraps, reason = "a build without Rerun refuses here")]
    pub(crate) fn new(url: &str) -> Result<Self> {
        Ok(Self(match url {
            "" => nappe_rerun::Sink::Spawn,
            url => nappe_rerun::Sink::Connect(url.to_owned()),
        }))
    }

    /// A refusal.
    ///
    /// # Errors
    /// Always: this build has no Rerun.
    #[cfg(not(feature = "rerun"))]
    pub(crate) fn new(_: &str) -> Result<Self> {
        use crate::error::CliError;
        Err(CliError::usage("--rerun: this build has no Rerun")
            .hint("build nappe with its feature `rerun`, which is on by default"))
    }
}

/// Never called: there is no viewer.
#[cfg(not(feature = "rerun"))]
pub(crate) fn follow(_: &App, viewer: Viewer) -> std::future::Ready<std::convert::Infallible> {
    match viewer {}
}

/// Shows the sessions of a server, those there and those to come, as long as it is polled: a call that fails is told
/// once and tried again, and never ends the server.
#[cfg(feature = "rerun")]
pub(crate) async fn follow(app: &App, Viewer(sink): Viewer) -> std::convert::Infallible {
    use std::{collections::BTreeSet, time::Duration};

    use nappe_client::Client;
    use nappe_rerun::{ShowOptions, show};

    use crate::output;

    /// How often the list is asked for.
    const INTERVAL: Duration = Duration::from_millis(500);

    let mut client = None;
    let mut shown = BTreeSet::new();
    let mut has_failed = false;
    loop {
        match listed(app, &mut client).await {
            Ok((client, ids)) => {
                has_failed = false;
                for id in &ids - &shown {
                    let (client, sink): (Client, _) = (client.clone(), sink.clone());
                    tokio::spawn(async move {
                        let options = ShowOptions::for_sink(&sink, 0);
                        let shown = show(&client, &id, sink, options, std::future::pending(), |_| {}).await;
                        if let Err(error) = shown {
                            output::note(&format!(
                                "nappe: session {id} is no longer shown in Rerun: {error}"
                            ));
                        }
                    });
                }
                // A deleted id may come again, and is then shown again.
                shown = ids;
            }
            Err(error) if !has_failed => {
                has_failed = true;
                output::note(&format!("nappe: no new session is shown in Rerun for now: {error}"));
            }
            Err(_same) => {}
        }
        tokio::time::sleep(INTERVAL).await;
    }
}

/// The ids of all sessions, through a client that is made when it is first needed.
#[cfg(feature = "rerun")]
async fn listed(
    app: &App,
    client: &mut Option<nappe_client::Client>,
) -> std::result::Result<(nappe_client::Client, std::collections::BTreeSet<String>), nappe_client::ClientError>
{
    let connected = match client {
        Some(client) => client,
        None => client.insert(match app.token() {
            None => nappe_client::Client::connect(&app.url()).await?,
            Some(token) => nappe_client::Client::connect_with(&app.url(), token).await?,
        }),
    };
    let sessions = connected.list_sessions().await?;
    Ok((connected.clone(), sessions.into_iter().map(|session| session.session_id).collect()))
}
