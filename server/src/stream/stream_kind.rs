//! What a stream makes of frames: messages with fields and nodes, or diagnostics alone.

use nappe_proto::v1::{
    self, watch_diagnostics_response::Event as DiagnosticsEvent, watch_frames_response::Event,
};

use super::{
    fields::{FieldSet, Wanted},
    frame::EncodedFrame,
};

/// A kind of stream.
pub(crate) trait StreamKind: Copy + Send + Sync + 'static {
    /// A message of the stream.
    type Message: Clone + Send + Sync + 'static;

    /// What a frame must hold for it.
    fn needed(&self) -> FieldSet;

    /// The messages of a frame; `dropped_count` frames before it were not sent.
    fn messages(&self, frame: &EncodedFrame, dropped_count: u64) -> Vec<Self::Message>;

    /// The message of a change of state.
    fn change(&self, change: v1::StateChange) -> Self::Message;

    /// The message when there was nothing to send for a while.
    fn progress(&self, progress: v1::Progress) -> Self::Message;

    /// The message at the end of a finished session.
    fn end(&self, end: v1::SessionEnd) -> Self::Message;
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

    fn change(&self, change: v1::StateChange) -> Self::Message {
        v1::WatchFramesResponse { event: Some(Event::Change(change)) }
    }

    fn progress(&self, progress: v1::Progress) -> Self::Message {
        v1::WatchFramesResponse { event: Some(Event::Progress(progress)) }
    }

    fn end(&self, end: v1::SessionEnd) -> Self::Message {
        v1::WatchFramesResponse { event: Some(Event::End(end)) }
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

    fn messages(&self, frame: &EncodedFrame, dropped_count: u64) -> Vec<Self::Message> {
        let event = Some(DiagnosticsEvent::Diagnostics(frame.head.diagnostics.clone()));
        vec![v1::WatchDiagnosticsResponse { event, dropped_count }]
    }

    fn change(&self, change: v1::StateChange) -> Self::Message {
        bare(DiagnosticsEvent::Change(change))
    }

    fn progress(&self, progress: v1::Progress) -> Self::Message {
        bare(DiagnosticsEvent::Progress(progress))
    }

    fn end(&self, end: v1::SessionEnd) -> Self::Message {
        bare(DiagnosticsEvent::End(end))
    }
}

/// A message without frames before it.
fn bare(event: DiagnosticsEvent) -> v1::WatchDiagnosticsResponse {
    v1::WatchDiagnosticsResponse { event: Some(event), dropped_count: 0 }
}
