//! Every method of the contract, as its descriptors have it, called with messages as they are.

use bytes::Bytes;
use nappe_proto::v1::FILE_DESCRIPTOR_SET;
use prost::Message as _;
use prost_types::{FileDescriptorSet, MethodDescriptorProto};
use tokio::time::timeout;
use tonic::{Request, Status, client::Grpc, codegen::http::uri::PathAndQuery, transport::Channel};

use crate::{
    HANGS, connect,
    requests::{Raw, varint},
};

/// Number and kind of a field that no message has.
const UNKNOWN: [u8; 2] = [0xC2, 0x3E];

/// A method of the contract.
#[derive(Debug)]
pub(crate) struct Method {
    pub(crate) name: String,
    path: PathAndQuery,
    takes_a_stream: bool,
    gives_a_stream: bool,
}

/// Every method of the contract.
pub(crate) fn methods() -> Vec<Method> {
    let set = FileDescriptorSet::decode(FILE_DESCRIPTOR_SET).expect("the build wrote them");
    let mut methods = Vec::new();
    for file in &set.file {
        for service in &file.service {
            let path = format!("/{}.{}", file.package(), service.name());
            methods.extend(service.method.iter().map(|method| described(&path, method)));
        }
    }
    methods
}

fn described(service: &str, method: &MethodDescriptorProto) -> Method {
    let name = method.name().to_owned();
    Method {
        path: format!("{service}/{name}").parse().expect("a path"),
        name,
        takes_a_stream: method.client_streaming(),
        gives_a_stream: method.server_streaming(),
    }
}

/// Makes calls with messages as they are.
pub(crate) struct Caller(Grpc<Channel>);

impl Caller {
    pub(crate) async fn to(url: String) -> Self {
        Self(Grpc::new(connect(url).await).max_decoding_message_size(usize::MAX))
    }

    /// Calls a method with these messages: one, unless it takes a stream. Gives the first message of the answer.
    pub(crate) async fn call(&mut self, method: &Method, messages: Vec<Bytes>) -> Result<Bytes, Status> {
        timeout(HANGS, self.answer(method, messages)).await.expect("it is answered")
    }

    async fn answer(&mut self, method: &Method, messages: Vec<Bytes>) -> Result<Bytes, Status> {
        self.0.ready().await.expect("connected");
        let path = method.path.clone();
        if method.takes_a_stream {
            let messages = Request::new(tokio_stream::iter(messages));
            return Ok(self.0.client_streaming(messages, path, Raw).await?.into_inner());
        }

        let message = Request::new(messages.into_iter().next().expect("a message"));
        if !method.gives_a_stream {
            return Ok(self.0.unary(message, path, Raw).await?.into_inner());
        }
        let mut stream = self.0.server_streaming(message, path, Raw).await?.into_inner();
        let first = stream.message().await?.unwrap_or_default();
        // A stream begins with two messages at least.
        stream.message().await?;
        Ok(first)
    }
}

/// A message with so many bytes in all: what it lacks is in a field that nobody knows. One that is larger stays as it is.
pub(crate) fn padded(mut message: Vec<u8>, bytes: usize) -> Vec<u8> {
    for width in 1..=5 {
        let Some(length) = bytes.checked_sub(message.len() + UNKNOWN.len() + width) else { break };
        let length_bytes = varint(length);
        if length_bytes.len() == width {
            message.extend(UNKNOWN);
            message.extend(length_bytes);
            message.resize(bytes, 0);
            break;
        }
    }
    message
}
