//! Calls of any method with any bytes, and the methods that there are, from the descriptors of the contract.

use bytes::{Buf as _, BufMut as _, Bytes};
use prost::Message as _;
use prost_types::{
    DescriptorProto, FileDescriptorSet,
    field_descriptor_proto::{Label, Type},
};
use tonic::{
    Code, Request, Status,
    client::Grpc,
    codec::{Codec, DecodeBuf, Decoder, EncodeBuf, Encoder},
    codegen::http::uri::PathAndQuery,
    transport::Channel,
};
use tonic_types::StatusExt as _;

use crate::frames::PATIENCE;

/// An enum value that no version of the contract has.
const UNKNOWN: u64 = 999;

/// A method, and what it is asked with.
#[derive(Clone, Debug)]
pub(crate) struct Method {
    /// `/package.Service/Method`.
    pub(crate) path: String,
    input: String,
}

/// The contract, with the services that stand beside it.
pub(crate) struct Contract(Vec<FileDescriptorSet>);

impl Contract {
    pub(crate) fn read() -> Self {
        let sets = [
            nappe_proto::v1::FILE_DESCRIPTOR_SET,
            tonic_health::pb::FILE_DESCRIPTOR_SET,
            tonic_reflection::pb::v1::FILE_DESCRIPTOR_SET,
            tonic_reflection::pb::v1alpha::FILE_DESCRIPTOR_SET,
        ];
        Self(sets.map(|set| FileDescriptorSet::decode(set).expect("descriptors")).to_vec())
    }

    /// Every method that the server has, in the order of the contract.
    pub(crate) fn methods(&self) -> Vec<Method> {
        let mut methods = Vec::new();
        for file in self.0.iter().flat_map(|set| &set.file) {
            for service in &file.service {
                for method in &service.method {
                    let path = format!("/{}.{}/{}", file.package(), service.name(), method.name());
                    methods.push(Method { path, input: method.input_type().to_owned() });
                }
            }
        }
        methods
    }

    /// A request of a method that names a session, if the method takes one.
    pub(crate) fn naming(&self, method: &Method, session_id: &str) -> Vec<u8> {
        let Some(message) = self.message(&method.input) else { return Vec::new() };
        let named = message.field.iter().find(|field| field.name() == "session_id");
        named.map_or_else(Vec::new, |field| tagged(field.number(), session_id.as_bytes()))
    }

    /// Every enum that a request of a method holds: its path, and bytes that give it a value that is not known.
    pub(crate) fn unknown_enums(&self, method: &Method) -> Vec<(String, Vec<u8>)> {
        self.message(&method.input).map_or_else(Vec::new, |message| self.enums_of(message))
    }

    fn enums_of(&self, message: &DescriptorProto) -> Vec<(String, Vec<u8>)> {
        let mut found = Vec::new();
        for field in &message.field {
            match field.r#type() {
                Type::Enum if field.label() == Label::Repeated => {
                    found.push((field.name().to_owned(), tagged(field.number(), &varint(UNKNOWN))));
                }
                Type::Enum => {
                    let tag = varint((field.number() as u64) << 3);
                    found.push((field.name().to_owned(), [tag, varint(UNKNOWN)].concat()));
                }
                Type::Message => {
                    let inner = self.message(field.type_name()).into_iter();
                    found.extend(inner.flat_map(|message| self.enums_of(message)).map(|(name, bytes)| {
                        (format!("{}.{name}", field.name()), tagged(field.number(), &bytes))
                    }));
                }
                _ => {}
            }
        }
        found
    }

    /// The message of a full name, `.package.Message`.
    fn message(&self, name: &str) -> Option<&DescriptorProto> {
        self.0.iter().flat_map(|set| &set.file).find_map(|file| {
            let prefix = format!(".{}.", file.package());
            let inner = name.strip_prefix(&prefix)?;
            file.message_type.iter().find(|message| message.name() == inner)
        })
    }
}

/// A field of bytes: its tag, their length, they.
fn tagged(number: i32, bytes: &[u8]) -> Vec<u8> {
    [varint((number as u64) << 3 | 2), varint(bytes.len() as u64), bytes.to_vec()].concat()
}

fn varint(value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    prost::encoding::encode_varint(value, &mut bytes);
    bytes
}

/// Calls a method and tells how it ends: `OK` once something or nothing is answered, or the code and the reason.
pub(crate) async fn outcome(
    channel: &Channel,
    path: &str,
    message: Vec<u8>,
    authorization: Option<&str>,
) -> String {
    let mut request = Request::new(tokio_stream::once(message));
    if let Some(value) = authorization {
        request.metadata_mut().insert("authorization", value.parse().expect("a header"));
    }
    let mut grpc = Grpc::new(channel.clone());
    let answer = async {
        grpc.ready().await.expect("connected");
        let path = PathAndQuery::try_from(path).expect("a path");
        grpc.streaming(request, path, Raw).await?.into_inner().message().await
    };
    match tokio::time::timeout(PATIENCE, answer).await.expect("an answer in time") {
        Ok(Some(_)) => "OK".to_owned(),
        Ok(None) => "OK, and nothing".to_owned(),
        Err(status) => in_words(&status),
    }
}

/// A status as the tables write it.
pub(crate) fn in_words(status: &Status) -> String {
    let code = nappe_proto::code_name(status.code());
    match status.get_details_error_info() {
        Some(info) => format!("{code} `{}`", info.reason),
        None if status.code() == Code::Unavailable => format!("{code} (no status)"),
        None => panic!("no reason: {status:?}"),
    }
}

/// Messages as they are.
#[derive(Clone, Copy, Debug)]
struct Raw;

impl Codec for Raw {
    type Encode = Vec<u8>;
    type Decode = Bytes;
    type Encoder = Self;
    type Decoder = Self;

    fn encoder(&mut self) -> Self {
        Self
    }

    fn decoder(&mut self) -> Self {
        Self
    }
}

impl Encoder for Raw {
    type Item = Vec<u8>;
    type Error = Status;

    fn encode(&mut self, item: Vec<u8>, buffer: &mut EncodeBuf<'_>) -> Result<(), Status> {
        buffer.put_slice(&item);
        Ok(())
    }
}

impl Decoder for Raw {
    type Item = Bytes;
    type Error = Status;

    fn decode(&mut self, buffer: &mut DecodeBuf<'_>) -> Result<Option<Bytes>, Status> {
        Ok(Some(buffer.copy_to_bytes(buffer.remaining())))
    }
}
