//! The contract as data, for clients that make their messages at run time: descriptors without comments.
//!
//! Enters: the compiled .proto files. Leaves: bytes of a `google.protobuf.FileDescriptorSet`, which a test compares with
//! the committed ones.

use prost::Message as _;
use prost_types::FileDescriptorSet;

use crate::v1::FILE_DESCRIPTOR_SET;

/// The descriptors of the contract, and of what it imports before it, without comments and positions.
///
/// # Panics
/// Never: the descriptors were written by the build of this crate.
pub fn contract_descriptors() -> Vec<u8> {
    let mut set = FileDescriptorSet::decode(FILE_DESCRIPTOR_SET).expect("the build wrote them");
    for file in &mut set.file {
        file.source_code_info = None;
    }
    set.encode_to_vec()
}
