//! The token that a server asks for, and the file in which clients of the same user find it.
//!
//! Enters: the configuration and the address. Leaves: a token, and a task that keeps its file until the drain.

use std::{io, time::Duration};

use nappe_proto::token::{Token, TokenFile};
use tokio_util::sync::CancellationToken;

use crate::{
    address::Address,
    config::{Config, TokenPlace},
    secret,
    start_error::StartError,
    state::StateFolder,
};

/// How often the file is looked for: a runtime directory goes away when its user logs out.
const INTERVAL: Duration = Duration::from_secs(5);

/// The token that a configuration asks for, if any: that of its file, that of the folder of sessions, or another one at each start.
///
/// # Errors
/// If its file holds none, or none can be drawn or kept.
pub(crate) fn token(config: &Config, state: Option<&StateFolder>) -> Result<Option<Token>, StartError> {
    match &config.token_file {
        _ if config.no_token => Ok(None),
        // Nobody else can open the socket.
        None if matches!(config.address, Address::Unix(_)) => Ok(None),
        Some(path) => Token::read(path).map(Some).map_err(StartError::Token),
        None => state.map_or_else(secret::draw, kept).map(Some).map_err(StartError::Token),
    }
}

/// The token of a folder of sessions, which has it from its first start on.
fn kept(state: &StateFolder) -> io::Result<Token> {
    let path = state.token_path();
    if path.try_exists()? {
        return Token::read(&path);
    }
    let token = secret::draw()?;
    state.put_token(token.reveal())?;
    Ok(token)
}

/// Leaves the token for clients of the same user, unless it stays in memory.
///
/// # Errors
/// If it cannot be left, and nobody could know it otherwise.
pub(crate) fn leave(
    config: &Config,
    token: Option<&Token>,
    address: &Address,
) -> Result<Option<TokenFile>, StartError> {
    let token = token.filter(|_| config.token_place == TokenPlace::RuntimeFolder);
    let (Some(token), Address::Tcp(address)) = (token, address) else { return Ok(None) };
    match TokenFile::leave(token, *address) {
        Ok(file) => Ok(Some(file)),
        // Clients read the file that the server was started with.
        Err(error) if config.token_file.is_some() => {
            tracing::info!("clients do not find the token by themselves: {error}");
            Ok(None)
        }
        Err(error) => Err(StartError::TokenFile(error)),
    }
}

/// Keeps the file where it is until the drain begins.
pub(crate) async fn keep(mut file: TokenFile, draining: CancellationToken) {
    while tokio::time::timeout(INTERVAL, draining.cancelled()).await.is_err() {
        if let Err(error) = file.renew() {
            tracing::debug!("the token's file is gone and cannot be left again: {error}");
        }
    }
}
