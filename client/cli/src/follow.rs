//! Shows every session of a server in Rerun, as any client could: `serve --rerun`.
//!
//! Asks for the list of sessions now and then; each new one gets a task that watches its newest
//! frames. A viewer that stalls stalls its task, never a step.

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
pub(crate) fn follow(_: &str, viewer: Viewer) -> std::future::Ready<Result<()>> {
    match viewer {}
}

/// Shows the sessions of a server, those there and those to come.
///
/// # Errors
/// When the server is gone.
#[cfg(feature = "rerun")]
pub(crate) async fn follow(url: &str, Viewer(sink): Viewer) -> Result<()> {
    use std::{collections::BTreeSet, time::Duration};

    use nappe_client::Client;
    use nappe_rerun::{ShowOptions, show};

    use crate::output;

    /// How often the list is asked for.
    const INTERVAL: Duration = Duration::from_millis(500);

    let client = Client::connect(url).await?;
    let mut shown = BTreeSet::new();
    loop {
        let ids: BTreeSet<String> =
            client.list_sessions().await?.into_iter().map(|session| session.session_id).collect();
        for id in &ids - &shown {
            let (client, sink) = (client.clone(), sink.clone());
            tokio::spawn(async move {
                let options = ShowOptions::for_sink(&sink, 0);
                if let Err(error) = show(&client, &id, sink, options, std::future::pending(), |_| {}).await {
                    output::note(&format!("nappe: session {id} is no longer shown in Rerun: {error}"));
                }
            });
        }
        // A deleted id may come again, and is then shown again.
        shown = ids;
        tokio::time::sleep(INTERVAL).await;
    }
}
