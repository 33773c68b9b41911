//! Computes a whole scene on a server, embedded or remote: the common part of `run`, `mecasim` and the demo.
//!
//! Enters: a scene and the options of the command line. Leaves: saved frames, and a summary on standard output.

mod embedded;
mod start;
mod pace;
mod progress;
mod record;
mod drive;
mod summary;

use nappe_client::Client;

pub(crate) use self::embedded::Embedded;
use self::{drive::Driven, progress::Shown, start::SavedFrame, summary::Summary};
use crate::{
    args::{ComputeArgs, OtherServerArgs, TokenArgs},
    error::Result,
    output::Format,
    remote,
    save::Destination,
    scene::{self, Input},
    viewer::Place,
};

/// Which server computes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Server<'a> {
    /// One inside this command.
    Embedded,
    /// The one at this address, which is shown a token.
    At(&'a str, &'a TokenArgs),
}

impl<'a> Server<'a> {
    /// The server that was asked for, or an embedded one.
    pub(crate) fn new(args: &'a OtherServerArgs) -> Self {
        args.server.as_deref().map_or(Self::Embedded, |address| Self::At(address, &args.token))
    }

    /// Who must know the name of a shipped scene.
    pub(crate) fn names(self) -> scene::Names {
        match self {
            Self::Embedded => scene::Names::Ours,
            Self::At(..) => scene::Names::Servers,
        }
    }
}

/// Computes a scene, saves its frames if asked to, prints the summary.
///
/// # Errors
/// When the scene is refused, the simulation fails, a frame cannot be saved, or the user ends it.
pub(crate) async fn compute(
    scene: &Input,
    args: &ComputeArgs,
    server: Server<'_>,
    format: Format,
) -> Result<()> {
    // First, so that a path that cannot be written is known before hours are computed.
    args.fields.check(args.save.as_deref())?;
    let destination = match &args.save {
        Some(path) => {
            let existing = args.force.existing();
            Some(Destination::open(path, existing, &args.fields, scene.text()).await?)
        }
        None => None,
    };
    let start = args.start.as_deref().map(SavedFrame::read).transpose()?;
    let (driven, summary) = match server {
        Server::At(address, token) => {
            let client = remote::connect_to(address, token).await?;
            let place = Place::at(address, token);
            Box::pin(compute_on(&client, &place, scene, (args, start.as_ref()), destination)).await?
        }
        Server::Embedded => {
            let embedded = Embedded::start(args.ranks.clone()).await?;
            let place = embedded.place();
            let done =
                Box::pin(compute_on(&embedded.client, &place, scene, (args, start.as_ref()), destination))
                    .await;
            embedded.shutdown().await;
            done?
        }
    };
    summary.print(&driven, format)
}

async fn compute_on(
    client: &Client,
    place: &Place,
    scene: &Input,
    (args, start): (&ComputeArgs, Option<&SavedFrame>),
    mut destination: Option<Destination>,
) -> Result<(Driven, Summary)> {
    let session = scene.create(client, String::new(), &args.overrides).await?;
    let begun = match start {
        Some(start) => start.put(client, &session.session_id).await,
        None => Ok(()),
    };
    let shown = if args.quiet { Shown::Nothing } else { Shown::Progress };
    let driven = match begun {
        Ok(()) => drive::drive(client, place, &session, destination.as_mut(), shown).await,
        Err(error) => Err(error),
    };
    let told = driven.as_ref().ok().and_then(|driven| driven.told);
    let failure = driven.as_ref().ok().and_then(|driven| driven.session.failure.as_ref());
    let saved = destination.map(|destination| destination.finish(told, failure));

    // A remote server is left as it was found, also after a failure. An error of the drive is reported first.
    let deleted = client.delete_session(&session.session_id).await;
    let driven = driven?;
    deleted?;
    let summary = Summary::new(scene.name().to_owned(), &driven, saved.transpose()?);
    Ok((driven, summary))
}
