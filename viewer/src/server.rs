//! The server that is watched: its address, and the token that it is shown.

use nappe_client::{Client, ClientError, Token};

/// Where a server is, and what it is shown.
pub(crate) struct Server {
    pub(crate) address: String,
    /// The token; `None`: the one that is found, if the server is the user's and on this machine.
    pub(crate) token: Option<Token>,
}

impl Server {
    /// Connects to it.
    ///
    /// # Errors
    /// When nothing answers at the address.
    pub(crate) async fn connect(&self) -> Result<Client, ClientError> {
        match &self.token {
            None => Client::connect(&self.address).await,
            Some(token) => Client::connect_with(&self.address, token).await,
        }
    }
}
