//! What a stream makes of frames: messages with fields and nodes, or diagnostics alone.

use nappe_proto::v1::{self, watch_frames_response::Event};

use super::{
    fields::{FieldSet, Wanted},
    frame::EncodedFrame,
};

/// A kind of stream.
pub(crate) trait StreamKind: Copy + Send + Sync + 'static {
    /// A message of the stream.
    type Message: Send + 'static;

    /// What a frame must hold for it.
    fn needed(&self) -> FieldSet;

    /// The messages of a frame; `dropped_count` frames before it were not sent.
    fn messages(&self, frame: &EncodedFrame, dropped_count: u64) -> Vec<Self::Message>;

    /// The message at the end of a finished session, if there is one.
    fn end(&self, end: v1::SessionEnd) -> Option<Self::Message>;
}

/// Frames with the fields and nodes that a watcher wants.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frames(pub Wanted);

impl StreamKind for Frames {
    type Message = v1::WatchFramesResponse;

    fn needed(&self) -> FieldSet {
        self.0.needed()
    }

    fn messages(&self, frame: &EncodedFrame, dropped_count: u64) -> Vec<Self::Message> {
        let pieces = frame.pieces(&self.0, dropped_count).into_iter();
        pieces.map(|piece| v1::WatchFramesResponse { event: Some(Event::Frame(piece)) }).collect()
    }

    fn end(&self, end: v1::SessionEnd) -> Option<Self::Message> {
        Some(v1::WatchFramesResponse { event: Some(Event::End(end)) })
    }
}

/// The diagnostics of frames, without fields.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DiagnosticsOnly;

impl StreamKind for DiagnosticsOnly {
    type Message = v1::WatchDiagnosticsResponse;

    fn needed(&self) -> FieldSet {
        FieldSet::NONE
    }

    fn messages(&self, frame: &EncodedFrame, _: u64) -> Vec<Self::Message> {
        vec![v1::WatchDiagnosticsResponse { diagnostics: Some(frame.head.diagnostics.clone()) }]
    }

    fn end(&self, _: v1::SessionEnd) -> Option<Self::Message> {
        None
    }
}
