//! Computes a whole scene on a server, embedded or remote: the common part of `run`, `mecasim`
//! and the demo.

use std::path::PathBuf;

use nappe_client::{Client, CreateSession};

use crate::{
    args::ComputeArgs,
    drive::{self, Driven},
    embedded::Embedded,
    error::Result,
    meshes,
    output::Format,
    save::Sink,
    scene,
    summary::Summary,
};

/// Where a scene is computed.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Place<'a> {
    /// In this command.
    Here,
    /// On the server at this address.
    Server(&'a str),
}

impl<'a> Place<'a> {
    /// As the command line says.
    pub(crate) fn new(server: Option<&'a str>) -> Self {
        server.map_or(Self::Here, Self::Server)
    }
}

/// Computes a scene, saves its frames if asked to, prints the summary.
///
/// # Errors
/// When the scene is refused, the simulation fails, a frame cannot be saved, or the user ends it.
pub(crate) async fn compute(
    scene: &scene::Input,
    args: &ComputeArgs,
    place: Place<'_>,
    format: Format,
) -> Result<()> {
    let (driven, summary) = match place {
        Place::Server(address) => compute_on(&Client::connect(address).await?, scene, args).await?,
        Place::Here => {
            let embedded = Embedded::start().await?;
            let done = compute_on(&embedded.client, scene, args).await;
            embedded.shutdown().await;
            done?
        }
    };
    summary.print(&driven, format)
}

async fn compute_on(client: &Client, scene: &scene::Input, args: &ComputeArgs) -> Result<(Driven, Summary)> {
    // First, so that a path that cannot be written is known before hours are computed.
    args.contents.check(args.save.as_deref())?;
    let mut sink = args.save.as_deref().map(|path| Sink::create(path, &args.contents)).transpose()?;
    let created = client
        .create_session(CreateSession {
            session_id: String::new(),
            scene: scene.send(client).await?,
            precision: args.precision.map(Into::into),
            thread_count: args.threads.unwrap_or(0),
            step_limit: args.steps.unwrap_or(0),
            frame_interval_steps: args.frame_every.unwrap_or(0),
        })
        .await?;
    meshes::note(&created.remarks);
    let id = created.session.session_id.clone();
    let driven = drive::drive(client, &created.session, sink.as_mut()).await;
    let saved: Option<PathBuf> = sink.map(Sink::finish).transpose()?;
    // A remote server is left as it was found, also after a failure, which is then the news.
    let deleted = client.delete_session(&id).await;
    let driven = driven?;
    deleted?;
    let summary = Summary::new(scene.name().to_owned(), &driven, saved);
    Ok((driven, summary))
}
