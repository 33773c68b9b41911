//! Links that let a browser in, once.

use nappe_proto::v1;
use tonic::Request;

use crate::{
    client::{CALL_LIMIT, Client},
    error::ClientError,
};

impl Client {
    /// Makes a code that a browser trades for the token, once: it stands behind the address of the server's page,
    /// `http://HOST:PORT/#CODE`. The oldest of more than 64 is good for nothing.
    ///
    /// # Errors
    /// If the call fails; a server from before there were links has no such method.
    pub async fn make_link(&self) -> Result<v1::MakeLinkResponse, ClientError> {
        let request = Request::new(v1::MakeLinkRequest {});
        self.call("MakeLink", CALL_LIMIT, request, async |mut calls, r| calls.make_link(r).await).await
    }
}
