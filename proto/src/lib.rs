//! The contract between server and clients: package `nappe.v1` of the .proto files beside this
//! crate. Other languages compile the same files.
//!
//! Sessions and diagnostics are also written as JSON, by serde: the names of the fields are those of the contract,
//! values of enums are words (`paused`), a vector is `[x, y, z]`, a state hash has 16 hexadecimal digits, and a
//! number that is infinite or not a number becomes `null`, since JSON has none.
//!
//! [`Reason`] is the table of the reasons for which a call can fail, which server and clients share.
//! How a server and the clients of the same user agree on a token is in [`token`]; how arrays of frames are made
//! small, in [`packed`].

/// Messages and services of `nappe.v1`, generated.
#[allow(
    clippy::all,
    clippy::pedantic,
    clippy::allow_attributes_without_reason,
    missing_docs,
    unreachable_pub,
    reason = "generated from the .proto files, which carry the documentation"
)]
pub mod v1 {
    tonic::include_proto!("nappe.v1");

    /// The compiled .proto files, for server reflection.
    pub const FILE_DESCRIPTOR_SET: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/nappe_v1.bin"));
}

mod words;
mod json;
mod requests;
mod reason;
mod reason_pages;
mod contract_page;
mod descriptors;
pub mod packed;
mod permissions;
pub mod token;

pub use contract_page::contract_page;
pub use descriptors::contract_descriptors;
pub use reason::{DOMAIN, Reason};
pub use reason_pages::{code_name, errors_page, reasons_json};

impl From<[f64; 3]> for v1::Vector3 {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

impl From<v1::Vector3> for [f64; 3] {
    fn from(v1::Vector3 { x, y, z }: v1::Vector3) -> Self {
        [x, y, z]
    }
}

impl From<[f64; 4]> for v1::Quaternion {
    fn from([x, y, z, w]: [f64; 4]) -> Self {
        Self { x, y, z, w }
    }
}

impl From<v1::Quaternion> for [f64; 4] {
    fn from(v1::Quaternion { x, y, z, w }: v1::Quaternion) -> Self {
        [x, y, z, w]
    }
}
