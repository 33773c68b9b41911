//! Which method a request calls, and what the transport has to know of it.

use std::sync::Arc;

/// The simulation service's paths begin so.
const SIMULATION: &str = "/nappe.v1.";
/// The reflection services' paths begin so, in both versions.
const REFLECTION: &str = "/grpc.reflection.";
/// The health service's.
const HEALTH: &str = "/grpc.health.v1.Health/";
/// The method whose requests end when the client likes, within limits of their own.
const UPLOAD: &str = "/nappe.v1.SimulationService/UploadMesh";

/// The method that gives the token for a code.
const OPEN_LINK: &str = "/nappe.v1.SimulationService/OpenLink";

/// The path of a call.
#[derive(Clone, Debug)]
pub(super) struct Method(Arc<str>);

impl Method {
    pub(super) fn new(path: &str) -> Self {
        Self(path.into())
    }

    pub(super) fn path(&self) -> &str {
        &self.0
    }

    /// Of the simulation service, which answers a drain by itself.
    pub(super) fn is_simulation(&self) -> bool {
        self.0.starts_with(SIMULATION)
    }

    pub(super) fn is_reflection(&self) -> bool {
        self.0.starts_with(REFLECTION)
    }

    /// The question whether the server serves, which is answered until the end.
    pub(super) fn is_health_check(&self) -> bool {
        self.0.strip_prefix(HEALTH) == Some("Check")
    }

    /// Whether the caller has a code, and no token yet.
    fn opens_a_link(&self) -> bool {
        &*self.0 == OPEN_LINK
    }

    /// Whether those call it who have no token: whoever watches over the process asks whether it serves, and is answered with
    /// one bit; and whoever opens a link wants the token.
    pub(super) fn needs_no_token(&self) -> bool {
        self.is_health_check() || self.opens_a_link()
    }

    /// Whether the request is a stream that need not arrive within the time of a message.
    pub(super) fn takes_a_stream(&self) -> bool {
        &*self.0 == UPLOAD || self.is_reflection()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_are_known_by_their_paths() {
        let upload = Method::new(UPLOAD);
        assert!(upload.is_simulation() && upload.takes_a_stream() && !upload.is_health_check());
        let reflection = Method::new("/grpc.reflection.v1.ServerReflection/ServerReflectionInfo");
        assert!(reflection.is_reflection() && reflection.takes_a_stream() && !reflection.is_simulation());
        let get = Method::new("/nappe.v1.SimulationService/GetSession");
        assert!(get.is_simulation() && !get.takes_a_stream() && !get.needs_no_token());
        assert!(Method::new(OPEN_LINK).needs_no_token());
        let health = |method: &str| Method::new(&format!("/grpc.health.v1.Health/{method}"));
        assert!(health("Check").is_health_check() && !health("Watch").is_health_check());
        assert!(health("Check").needs_no_token() && !health("Watch").needs_no_token());
    }
}
