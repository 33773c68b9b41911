//! Requests that name a session and nothing else yet.

use crate::v1;

macro_rules! requests {
    ($($request:ident)*) => {$(
        impl v1::$request {
            /// A request about the session of an id, whatever its uid; all else is as by default.
            pub fn of(session_id: impl Into<String>) -> Self {
                Self { session_id: session_id.into(), ..Self::default() }
            }
        }
    )*};
}

requests! {
    ForkSessionRequest
    SaveSessionRequest
    GetSessionRequest
    DeleteSessionRequest
    PlaySessionRequest
    PauseSessionRequest
    StepSessionRequest
    StopSessionRequest
    UpdateParametersRequest
    ResetSessionRequest
    ListPendingChangesRequest
    DropPendingChangesRequest
    WatchFramesRequest
    WatchDiagnosticsRequest
}
