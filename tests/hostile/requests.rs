//! Requests that are small on the wire and large in memory, and uploads: what the server takes for them at most.

use bytes::{Buf as _, BufMut as _, Bytes};
use nappe_proto::v1::{
    self, MeshHeader, UploadMeshRequest, simulation_service_client::SimulationServiceClient,
    upload_mesh_request::Part,
};
use nappe_server::Limits;
use tonic::{
    Code, Status,
    client::Grpc,
    codec::{Codec, DecodeBuf, Decoder, EncodeBuf, Encoder},
    transport::Channel,
};

use crate::{alone, peak_since, server};

/// Sends and receives bytes as they are.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Raw;

impl Codec for Raw {
    type Encode = Bytes;
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
    type Item = Bytes;
    type Error = Status;

    fn encode(&mut self, item: Bytes, buffer: &mut EncodeBuf<'_>) -> Result<(), Status> {
        buffer.put(item);
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

/// Most bytes that the process took at a time while a request of these bytes was answered.
async fn peak_of(channel: &Channel, method: &'static str, bytes: Vec<u8>) -> (usize, Code) {
    let mut grpc = Grpc::new(channel.clone());
    grpc.ready().await.expect("connected");
    let path = http_path(method);
    let request = tonic::Request::new(Bytes::from(bytes));
    let mut code = Code::Ok;
    let call = async {
        let answer = grpc.unary(request, path, Raw).await;
        code = answer.map_or_else(|status| status.code(), |_| Code::Ok);
    };
    (peak_since(call).await, code)
}

fn http_path(method: &str) -> tonic::codegen::http::uri::PathAndQuery {
    format!("/nappe.v1.SimulationService/{method}").parse().expect("a path")
}

/// Two threads for server and client.
pub(crate) fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().expect("a runtime")
}

#[test]
fn empty_elements_of_a_request_never_become_memory() {
    let _alone = alone();
    runtime().block_on(async {
        let (app, channel) = server(Limits::default()).await;
        let size = Limits::default().max_message_bytes as usize - 2;

        // Springs and pins of no bytes; a number of an enum in one byte, together and each by itself.
        let together = [&[0x2A_u8][..], &varint(size - 8), &vec![1; size - 8]].concat();
        let cases = [
            ("UpdateParameters", [0x2A, 0].repeat(size / 2)),
            ("UpdateParameters", [0x32, 0].repeat(size / 2)),
            ("WatchFrames", together),
            ("WatchFrames", [0x28, 1].repeat(size / 2)),
        ];
        for (method, bytes) in cases {
            let length = bytes.len();
            let (peak, code) = peak_of(&channel, method, bytes).await;
            println!("{method}: {length} bytes of elements took {peak} bytes at most, {code:?}");
            assert_ne!(code, Code::Ok, "{method}");

            // What both sides keep to send and to receive: some copies of the message.
            assert!(peak < 6 * length, "{method}: {peak} bytes for {length}");
        }
        app.shutdown().await;
    });
}

/// A number as the wire has it.
pub(crate) fn varint(mut value: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value > 0x7F {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

/// Most memory (bytes) while a mesh is uploaded, and the size of the upload (bytes).
async fn upload(client: &mut SimulationServiceClient<Channel>, header: MeshHeader) -> (usize, u64) {
    let MeshHeader { point_count, triangle_count, mass_count, uv_count, velocity_count, .. } = header;
    let total = 24 * (point_count + velocity_count) + 12 * triangle_count + 8 * (mass_count + uv_count);
    let zeros = Bytes::from(vec![0; 1 << 20]);
    let first = UploadMeshRequest { part: Some(Part::Header(header)) };
    let pieces = (0..total.div_ceil(1 << 20)).map(move |i| {
        let length = (total - (i << 20)).min(1 << 20) as usize;
        UploadMeshRequest { part: Some(Part::Data(zeros.slice(..length))) }
    });
    let stream = tokio_stream::iter(std::iter::once(first).chain(pieces));
    let peak = peak_since(async {
        client.upload_mesh(stream).await.expect("a mesh of zeros is a mesh");
    });
    (peak.await, total)
}

#[test]
fn an_upload_takes_little_more_than_its_size() {
    let _alone = alone();
    runtime().block_on(async {
        let (app, channel) = server(Limits::default()).await;
        let mut client = SimulationServiceClient::new(channel);
        let cases = [
            [4_000_000, 0, 0, 0, 0],
            [1_000_000, 6_000_000, 0, 0, 0],
            [2_000_000, 2_000_000, 2_000_000, 2_000_000, 0],
            [2_000_000, 0, 0, 0, 2_000_000],
        ];
        for [point_count, triangle_count, mass_count, uv_count, velocity_count] in cases {
            let name = "zeros".into();
            let header =
                MeshHeader { name, point_count, triangle_count, mass_count, uv_count, velocity_count };
            let (peak, size) = upload(&mut client, header).await;

            // What both sides keep to send and to receive: windows and some pieces.
            let way = 24 << 20;
            println!(
                "{size} bytes took {peak} at most, {:.2} without the way",
                (peak as f64 - f64::from(way)) / size as f64
            );
            assert!(peak as u64 <= size * 13 / 10 + way as u64, "{peak} bytes for {size}");
        }
        let _info = client.get_server_info(v1::GetServerInfoRequest {}).await.expect("it goes on");
        app.shutdown().await;
    });
}
