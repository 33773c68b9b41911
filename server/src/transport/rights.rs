//! What somebody who shows the token of a link to one session may call: a row for each method of the contract.

use super::method::Method;
use crate::passes::Right;

/// The paths of the methods begin so.
const SERVICE: &str = "/nappe.v1.SimulationService/";

/// The table. Whatever has no row is not called: other services, the page of metrics.
const RIGHTS: [(&str, Right); 23] = [
    ("GetServerInfo", Right::Always),
    ("UploadMesh", Right::Never),
    ("BeginUpload", Right::Never),
    ("AppendUpload", Right::Never),
    ("FinishUpload", Right::Never),
    ("CreateSession", Right::Never),
    ("ForkSession", Right::Shared),
    ("SaveSession", Right::Never),
    ("GetSession", Right::Shared),
    ("ListSessions", Right::Always),
    ("DeleteSession", Right::Own),
    ("PlaySession", Right::Own),
    ("PauseSession", Right::Own),
    ("StepSession", Right::Own),
    ("StopSession", Right::Own),
    ("UpdateParameters", Right::Own),
    ("ListPendingChanges", Right::Shared),
    ("ResetSession", Right::Own),
    ("DropPendingChanges", Right::Own),
    ("WatchFrames", Right::Shared),
    ("WatchDiagnostics", Right::Shared),
    ("MakeLink", Right::Never),
    ("OpenLink", Right::Always),
];

/// What the bearer of a pass may do with a method.
pub(super) fn right(method: &Method) -> Right {
    let name = method.path().strip_prefix(SERVICE);
    let row = RIGHTS.iter().find(|(known, _)| Some(*known) == name);
    row.map_or(Right::Never, |(_, right)| *right)
}

#[cfg(test)]
mod tests {
    use nappe_proto::v1::FILE_DESCRIPTOR_SET;
    use prost::Message as _;
    use prost_types::{FileDescriptorSet, MethodDescriptorProto};

    use super::*;

    #[test]
    fn every_method_of_the_contract_has_a_row_and_whatever_else_there_is_has_none() {
        let set = FileDescriptorSet::decode(FILE_DESCRIPTOR_SET).expect("the descriptors");
        let services = set.file.iter().flat_map(|file| &file.service);
        let mut methods: Vec<&str> =
            services.flat_map(|service| &service.method).map(MethodDescriptorProto::name).collect();
        let mut rows = RIGHTS.map(|(name, _)| name);
        methods.sort_unstable();
        rows.sort_unstable();
        assert_eq!(methods, rows);

        let of = |path: &str| right(&Method::new(path));
        assert_eq!(of("/nappe.v1.SimulationService/WatchFrames"), Right::Shared);
        for path in
            ["/metrics", "/", "/nappe.v1.SimulationService/", "/nappe.v2.SimulationService/GetSession"]
        {
            assert_eq!(of(path), Right::Never, "{path}");
        }
        assert_eq!(of("/grpc.health.v1.Health/Watch"), Right::Never);
    }
}
