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
        self.make_session_link(v1::MakeLinkRequest::default()).await
    }

    /// Makes a code for a link to one session: each who opens it may watch that session and work with copies of it, and there is no
    /// other session for him. See the fields of the request.
    ///
    /// # Errors
    /// If a field is not allowed, there is no such session, or the server asks for no token; a server from before there were such
    /// links ignores the fields, and makes a code for its token.
    pub async fn make_session_link(
        &self,
        request: v1::MakeLinkRequest,
    ) -> Result<v1::MakeLinkResponse, ClientError> {
        let request = Request::new(request);
        self.call("MakeLink", CALL_LIMIT, request, async |mut calls, r| calls.make_link(r).await).await
    }
}
