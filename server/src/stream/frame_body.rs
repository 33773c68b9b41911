//! The body of an answer that streams frames: messages of gRPC whose arrays are the frame's own memory.
//!
//! Enters: a watcher's messages. Leaves: their bytes in pieces, and trailers. tonic would copy each array once per
//! watcher into a buffer of its own; here all watchers send the same bytes, which stay in the processor's caches.

use std::{
    collections::VecDeque,
    mem,
    pin::Pin,
    sync::{Arc, Mutex, PoisonError},
    task::{Context, Poll},
};

use bytes::{BufMut as _, Bytes, BytesMut};
use http::{HeaderMap, Response};
use hyper::body::{Body as HttpBody, Frame};
use nappe_proto::v1::{self, watch_frames_response::Event};
use prost::{
    Message as _,
    encoding::{WireType, encode_key, encode_varint, encoded_len_varint, key_len},
};
use tokio_stream::Stream;
use tonic::{Status, body::Body};

use super::{transit::Transit, watch_stream::WatchStream};

/// Number of `WatchFramesResponse.frame`.
const FRAME: u32 = 2;
/// Number of `Frame.fields`.
const FIELDS: u32 = 6;
/// Number of `FieldData.data`.
const DATA: u32 = 4;
/// Bytes before a message of gRPC: whether it is compressed, and its length.
const PREFIX_BYTES: usize = 5;

/// The messages of an answer, on their way around tonic.
#[derive(Clone)]
struct Handed(Arc<Mutex<Option<WatchStream<v1::WatchFramesResponse>>>>);

/// The body of an answer that streams frames.
#[derive(Debug)]
struct FrameBody {
    messages: WatchStream<v1::WatchFramesResponse>,
    /// What is left of the message that was fetched last.
    pieces: VecDeque<Bytes>,
    has_ended: bool,
}

/// An answer with these messages, as tonic sees it: empty, until [`with_frames`] gives it its body.
pub(crate) fn answer<T>(messages: WatchStream<v1::WatchFramesResponse>, empty: T) -> tonic::Response<T> {
    let mut answer = tonic::Response::new(empty);
    answer.extensions_mut().insert(Handed(Arc::new(Mutex::new(Some(messages)))));
    answer
}

/// Gives an answer that streams frames its body; any other one stays as it is.
pub(crate) fn with_frames(mut response: Response<Body>) -> Response<Body> {
    let handed: Option<Handed> = response.extensions_mut().remove();
    let messages = handed.and_then(|handed| handed.0.lock().unwrap_or_else(PoisonError::into_inner).take());
    match messages {
        Some(messages) => response
            .map(|_empty| Body::new(FrameBody { messages, pieces: VecDeque::new(), has_ended: false })),
        None => response,
    }
}

impl HttpBody for FrameBody {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        loop {
            if let Some(piece) = self.pieces.pop_front() {
                return Poll::Ready(Some(Ok(Frame::data(piece))));
            }
            if self.has_ended {
                return Poll::Ready(None);
            }

            let outcome = match std::task::ready!(Pin::new(&mut self.messages).poll_next(context)) {
                Some(Ok(message)) => {
                    self.pieces = pieces(message, self.messages.transit());
                    continue;
                }
                Some(Err(status)) => status,
                None => Status::ok(""),
            };
            self.has_ended = true;
            let mut trailers = HeaderMap::new();
            return Poll::Ready(Some(outcome.add_header(&mut trailers).map(|()| Frame::trailers(trailers))));
        }
    }

    fn is_end_stream(&self) -> bool {
        self.has_ended
    }
}

/// The bytes of a message. Arrays stand after everything else of a frame, each in a piece of its own: the order of
/// fields on the wire is free.
fn pieces(message: v1::WatchFramesResponse, transit: &Arc<Transit>) -> VecDeque<Bytes> {
    let Some(Event::Frame(mut frame)) = message.event else {
        let mut whole = begin(message.encoded_len());
        message.encode_raw(&mut whole);
        return [transit.give(whole.freeze())].into();
    };

    let arrays = mem::take(&mut frame.fields);
    let with_key = |key: u32, length: usize| key_len(key) + encoded_len_varint(length as u64) + length;
    let fields: usize = arrays.iter().map(|array| with_key(FIELDS, array.encoded_len())).sum();
    let length = frame.encoded_len() + fields;

    let mut head = begin(with_key(FRAME, length));
    put_key(&mut head, FRAME, length);
    frame.encode_raw(&mut head);
    let mut pieces = VecDeque::with_capacity(2 * arrays.len() + 1);
    for mut array in arrays {
        put_key(&mut head, FIELDS, array.encoded_len());
        let data = mem::take(&mut array.data);
        array.encode_raw(&mut head);
        if !data.is_empty() {
            put_key(&mut head, DATA, data.len());
            pieces.extend([transit.give(mem::take(&mut head).freeze()), transit.lend(data)]);
        }
    }
    if !head.is_empty() {
        pieces.push_back(transit.give(head.freeze()));
    }
    pieces
}

/// A message of gRPC of so many bytes, before its first: not compressed.
fn begin(length: usize) -> BytesMut {
    let mut message = BytesMut::with_capacity(PREFIX_BYTES + length.min(512));
    message.put_u8(0);
    message.put_u32(length as u32);
    message
}

fn put_key(to: &mut BytesMut, key: u32, length: usize) {
    encode_key(key, WireType::LengthDelimited, to);
    encode_varint(length as u64, to);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(field: v1::Field, data: &[u8]) -> v1::FieldData {
        let mut made =
            v1::FieldData { first_particle: 70_000, data: data.to_vec().into(), ..v1::FieldData::default() };
        made.set_field(field);
        made
    }

    #[test]
    fn the_bytes_of_a_message_are_read_as_the_message() {
        let frame = |fields| v1::Frame {
            frame: 300,
            step: 70_000,
            time_seconds: 1.5,
            state_hash: Some(u64::MAX),
            fields,
            chunk: Some(v1::Chunk { index: 1, count: 3 }),
            diagnostics: Some(v1::Diagnostics { frame: 300, ..v1::Diagnostics::default() }),
            ..v1::Frame::default()
        };
        let (positions, velocities) = (v1::Field::Positions, v1::Field::Velocities);
        let events = [
            Event::Frame(frame(vec![])),
            Event::Frame(frame(vec![field(positions, &[7; 100_000])])),
            Event::Frame(frame(vec![field(positions, &[]), field(velocities, &[1; 24])])),
            Event::Frame(frame(vec![field(positions, &[2; 300]), field(velocities, &[])])),
            Event::Frame(v1::Frame::default()),
            Event::Topology(v1::Topology { particle_count: 3, ..v1::Topology::default() }),
            Event::Progress(v1::Progress::default()),
        ];
        for event in events {
            let message = v1::WatchFramesResponse { event: Some(event) };
            let sent: Vec<u8> =
                pieces(message.clone(), &Transit::new(Arc::default())).into_iter().flatten().collect();
            let (prefix, body) = sent.split_at(PREFIX_BYTES);
            assert_eq!(prefix[0], 0, "not compressed");
            assert_eq!(prefix[1..], (body.len() as u32).to_be_bytes());
            assert_eq!(body.len(), message.encoded_len());
            assert_eq!(v1::WatchFramesResponse::decode(body), Ok(message));
        }
    }

    #[test]
    fn arrays_are_sent_from_where_they_are() {
        let array = field(v1::Field::Positions, &[5; 4096]);
        let memory = array.data.as_ptr();
        let frame = v1::Frame { fields: vec![array], ..v1::Frame::default() };
        let message = v1::WatchFramesResponse { event: Some(Event::Frame(frame)) };
        let sent = pieces(message, &Transit::new(Arc::default()));
        assert!(sent.iter().any(|piece| piece.as_ptr() == memory && piece.len() == 4096));
    }
}
