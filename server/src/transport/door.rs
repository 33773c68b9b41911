//! Who comes in: requests to the server's own hosts, of pages that may call, with the token.

use http::{HeaderValue, Request, header};

use super::{connections::Standing, cors::AllowedOrigins, host::AllowedHosts, method::Method, token::Guard};
use crate::{
    error::{Reason, ServiceError},
    passes::Visitor,
};

/// Lets requests in.
#[derive(Clone, Debug)]
pub(super) struct Door {
    origins: AllowedOrigins,
    hosts: AllowedHosts,
    guard: Guard,
}

impl Door {
    pub(super) fn new(origins: AllowedOrigins, hosts: AllowedHosts, guard: Guard) -> Self {
        Self { origins, hosts, guard }
    }

    /// Who makes a request. Who shows a token with one that may come in is known from then on.
    ///
    /// # Errors
    /// If it may not come in.
    pub(super) fn admit<B>(&self, request: &Request<B>, method: &Method) -> Result<Visitor, ServiceError> {
        if let Some(refusal) = self.of_host(request).or_else(|| self.of_origin(request)) {
            return Err(refusal);
        }
        let visitor = self.guard.admit(request.headers(), method)?;
        if self.guard.has_seen_it(method) {
            Standing::of(request.extensions()).becomes_known();
        }
        Ok(visitor)
    }

    /// Why a request for what is open to those who have no token may not come in, if so.
    #[cfg(feature = "page")]
    pub(super) fn refusal_without_token<B>(&self, request: &Request<B>) -> Option<ServiceError> {
        self.of_host(request).or_else(|| self.of_origin(request))
    }

    fn of_host<B>(&self, request: &Request<B>) -> Option<ServiceError> {
        let host = self.hosts.check(request).err()?;
        let message = match &*host {
            "" => "the request names no host".to_owned(),
            host => format!("requests to the host '{host}' are not for this server"),
        };
        Some(ServiceError::new(Reason::HostNotAllowed, message).with("host", host))
    }

    fn of_origin<B>(&self, request: &Request<B>) -> Option<ServiceError> {
        let is_allowed =
            |origin: &HeaderValue| self.origins.allow(origin) || self.hosts.is_own_origin(request, origin);
        let origin = request.headers().get(header::ORIGIN).filter(|origin| !is_allowed(origin))?;
        let origin = String::from_utf8_lossy(origin.as_bytes()).into_owned();
        let message = format!("web pages of the origin '{origin}' may not call this server");
        Some(ServiceError::new(Reason::OriginNotAllowed, message).with("origin", origin))
    }
}
