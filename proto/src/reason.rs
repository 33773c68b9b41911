//! Why a call can fail: the one table of reasons. The server's codes, the constants of the clients,
//! docs/errors.md and `nappe/v1/reasons.json` are made from it.
//!
//! Every status that the server sends carries one of these in a `google.rpc.ErrorInfo`.

use tonic::Code;

/// The domain of every `ErrorInfo`.
pub const DOMAIN: &str = "nappe.v1";

macro_rules! reasons {
    ($($variant:ident $name:literal $code:ident $($diverged:ident)? $meaning:literal $remedy:literal)*) => {
        /// A reason why a call failed.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Reason {
            $(#[doc = $meaning] $variant,)*
        }

        impl Reason {
            /// Every reason, in the order of the table.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// The word in `ErrorInfo.reason`; it never changes.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// The status code that comes with it.
            pub const fn code(self) -> Code {
                match self { $(Self::$variant => Code::$code,)* }
            }

            /// Whether it says that a simulation diverged: its numbers left what the scene allows.
            pub const fn is_divergence(self) -> bool {
                const fn is_set(flags: &[&str]) -> bool {
                    !flags.is_empty()
                }
                match self { $(Self::$variant => is_set(&[$(stringify!($diverged))?]),)* }
            }

            /// What happened, in one sentence.
            pub const fn meaning(self) -> &'static str {
                match self { $(Self::$variant => $meaning,)* }
            }

            /// What the caller can do.
            pub const fn remedy(self) -> &'static str {
                match self { $(Self::$variant => $remedy,)* }
            }

            /// The reason of a word in `ErrorInfo.reason`; none for one of a newer server.
            pub fn of(name: &str) -> Option<Self> {
                match name {
                    $($name => Some(Self::$variant),)*
                    _ => None,
                }
            }
        }
    };
}

reasons! {
    InvalidField "INVALID_FIELD" InvalidArgument
        "A field of the request is missing or outside its range; `BadRequest` lists the fields."
        "Correct the fields named and send the request again."

    InvalidMessage "INVALID_MESSAGE" InvalidArgument
        "The request is not a message of the method that was called."
        "Compile the client from the .proto files of this version."

    NotACall "NOT_A_CALL" InvalidArgument
        "The request is no call of gRPC or gRPC-Web: another method of HTTP than POST (answered with 405), or other content (415)."
        "Use a client of gRPC, or over HTTP/1.1 one of gRPC-Web."

    CompressionNotSupported "COMPRESSION_NOT_SUPPORTED" Unimplemented
        "The request is compressed in a way that the server does not read; the header `grpc-accept-encoding` lists what it reads."
        "Send uncompressed messages."

    InvalidScene "INVALID_SCENE" InvalidArgument
        "The scene cannot be read, or what it describes cannot be simulated; the metadata `violation`, `line`, `column` and `field` name the first error, and `BadRequest` lists those with a field."
        "Correct the scene at the place named."

    InvalidMesh "INVALID_MESH" InvalidArgument
        "The uploaded mesh cannot be read or simulated: an index out of range, a number that is not finite, a file that is not of its format; of a file, the metadata `violation`, `file`, `line` and `column` name the place."
        "Correct the mesh."

    InvalidCheckpoint "INVALID_CHECKPOINT" InvalidArgument
        "The uploaded file is no session that a server of this version can go on with: it was cut or altered, has another format, or says what no session can have; the metadata `section` names the part of it, where one is known."
        "Upload the file as it was saved, or save the session again."

    InvalidUpload "INVALID_UPLOAD" InvalidArgument
        "The pieces of an upload do not follow its header: no header first, too many bytes, too few, or a piece that is empty or above 1 MiB."
        "Send the header once and first, then exactly the bytes that it announces."

    InvalidChange "INVALID_CHANGE" InvalidArgument
        "A change of parameters is not possible in this session; nothing was changed."
        "Check names of bodies, kinds of springs, numbers of pinned particles and ranges."

    InvalidPageToken "INVALID_PAGE_TOKEN" InvalidArgument
        "The page token was not made by this server."
        "Start again with an empty token."

    RequestIdReused "REQUEST_ID_REUSED" InvalidArgument
        "The request id belongs to an earlier request with other fields."
        "Use a new UUID for every new request; repeat one only to retry the same request."

    SessionNotFound "SESSION_NOT_FOUND" NotFound
        "No session has this id."
        "List the sessions; it may have been deleted, or the server restarted."

    SessionReplaced "SESSION_REPLACED" FailedPrecondition
        "The session of this id is not the one that was asked for: that one was deleted, and another was given its id. `session_uid` is the uid of the one that is there."
        "Start anew with the session that is there, or stop: the one asked for is gone."

    SceneNotFound "SCENE_NOT_FOUND" NotFound
        "The server ships no scene of this name; `known` lists them."
        "Choose one of the names, or send the scene's text."

    MeshNotFound "MESH_NOT_FOUND" NotFound
        "The scene names an uploaded mesh that the server does not have, or no longer has."
        "Upload the mesh again and name the new id: only the newest are kept, within `max_meshes` and `max_mesh_store_bytes`."

    CheckpointNotFound "CHECKPOINT_NOT_FOUND" NotFound
        "No uploaded file of a session has this id: it was never uploaded, or dropped for newer uploads."
        "Upload the file again and name the new id: only the newest uploads are kept, within `max_meshes` and `max_mesh_store_bytes`."

    UploadNotFound "UPLOAD_NOT_FOUND" NotFound
        "No upload in progress has this id: it paused for too long, took too long or came too slowly, or the server restarted."
        "Begin the upload again, and send its pieces without pausing."

    LinkNotFound "LINK_NOT_FOUND" NotFound
        "No link has this code: it was opened before, is too old, gave way to newer ones, or is of another server."
        "Make a new link (`nappe view --web`), or show the token itself."

    LinkTooNarrow "LINK_TOO_NARROW" PermissionDenied
        "The token is that of a link to one session: it may watch and copy that session, and do everything with copies of its own, and nothing else."
        "Fork the session and work with the copy, or show the token of the server."

    UnknownMethod "UNKNOWN_METHOD" Unimplemented
        "The server has no such service or method."
        "Compare the versions of client and server (`GetServerInfo`)."

    UnknownService "UNKNOWN_SERVICE" NotFound
        "The health service does not know the service that it was asked about."
        "Ask about \"\" or `nappe.v1.SimulationService`."

    UnknownSymbol "UNKNOWN_SYMBOL" NotFound
        "The reflection service does not know the symbol, the file or the extension that it was asked about."
        "List the services first; extensions are not used."

    SessionExists "SESSION_EXISTS" AlreadyExists
        "Another session has this id."
        "Choose another id, or leave it empty and let the server choose."

    SessionPlaying "SESSION_PLAYING" FailedPrecondition
        "The session is playing until it is paused: a number of steps cannot be added."
        "Pause it first."

    SessionFinished "SESSION_FINISHED" FailedPrecondition
        "The session came to its end or was stopped: it takes no more steps or changes."
        "Create a new session to go on."

    SessionFailed "SESSION_FAILED" FailedPrecondition
        "The session failed earlier: it takes no more steps or changes; `failure` says why."
        "Read the session's failure; correct the scene and create a new session."

    StepsInterrupted "STEPS_INTERRUPTED" Aborted
        "The steps that the call waited for were cut short by a pause, a stop or another command."
        "Read the session to see how far it came; step again if wanted."

    SessionDeleted "SESSION_DELETED" NotFound
        "The session was deleted while the call was in progress."
        "Nothing: the session is gone."

    NotFinite "NOT_FINITE" FailedPrecondition diverged
        "The simulation diverged: a position, a velocity or another number of the state is no longer finite. `step`, `particle` and `value` say where."
        "Reduce dt or the stiffness; cloth: choose an implicit integrator; snow: let its step be certified."

    StretchLimit "STRETCH_LIMIT" FailedPrecondition diverged
        "A spring became longer than the scene allows."
        "Reduce dt, raise the stiffness or the damping, or raise the scene's limit."

    EnergyLimit "ENERGY_LIMIT" FailedPrecondition diverged
        "The energy exceeded the limit of the scene: the simulation is about to diverge."
        "Reduce dt or the stiffness, or raise the scene's limit."

    SolverFailed "SOLVER_FAILED" FailedPrecondition diverged
        "The linear system of an implicit step has no solution."
        "Look for free particles without mass or springs; change the treatment of the Hessian; snow: shorten its step or integrate it explicitly."

    TimeStepLimit "TIME_STEP_LIMIT" FailedPrecondition diverged
        "The step of snow or of explicit cloth that the scene fixes is longer than the bound within which it is stable; the message has both numbers and the bound's name."
        "Let the step be certified, fix a smaller one, or mark it unchecked and accept that it may diverge."

    SubstepLimit "SUBSTEP_LIMIT" FailedPrecondition diverged
        "One step of the scene would need more substeps than allowed; the message names the bound that makes them short."
        "Shorten the scene's dt or raise its limit of substeps; look at the particle named: snow that is pressed hard, or very fast, needs short steps."

    PotentialDescent "POTENTIAL_DESCENT" FailedPrecondition diverged
        "The forces of a cloth change so much within an implicit step that its linear solve leads astray, at a 64th of the step too."
        "Reduce dt, choose hessian = absolute if it is another, or mark the step unchecked and accept that it may diverge."

    EnergyGain "ENERGY_GAIN" FailedPrecondition diverged
        "A cloth or snow gains energy that nothing accounts for: in an implicit step of cloth, at a 64th of it too, or over the explicit steps of the run."
        "Of explicit steps: fix substeps = n, or take a smaller safety. Of implicit ones: reduce dt, or choose hessian = absolute if it is another. Or mark the step unchecked and accept that it may diverge."

    MomentumBalance "MOMENTUM_BALANCE" FailedPrecondition diverged
        "The sweeps of vertex block descent do not bring the momentum of a cloth into balance with gravity, the medium and pins: 16 times as many as asked for, at a 64th of the step too."
        "Ask for more sweeps, or reduce dt; choose newton where the cloth is very stiff or very fine."

    StepAccuracy "STEP_ACCURACY" FailedPrecondition diverged
        "The potential of an implicit step of cloth does not fall as its linear solves predict, to what `accuracy` allows: after four of them, at a 64th of the step too."
        "Reduce dt, or allow more with `accuracy`; choose newton, which makes as many solves as are needed, or one_step, which makes one and is not judged so."

    ErrorTolerance "ERROR_TOLERANCE" FailedPrecondition diverged
        "The estimated error of a step of cloth is above the tolerance of the scene, at a 64th of the step too."
        "Reduce dt, or raise the tolerance."

    ColliderPassed "COLLIDER_PASSED" FailedPrecondition diverged
        "A particle of cloth goes through a collider, or into it, at a 64th of the step too; the scene asks that such steps be rejected."
        "Reduce dt, make the collider thicker or slower, or choose on_pass = warn."

    Contact "CONTACT" FailedPrecondition diverged
        "Surfaces of cloth cannot be kept apart at a 64th of the step too: what holds them, pins or colliders, closes further than the cloth yields, or they lie closer than rounding can tell apart; `particle` is of the first surface, `value` the gap in metres. Or so much cloth comes together at `particle` that its pairs are too many; there is no value then."
        "Leave the surfaces more room, move what closes more slowly or less far, or reduce dt or the thickness."

    NeverStable "NEVER_STABLE" FailedPrecondition diverged
        "Explicit Euler gains energy in every motion that is not damped: no step is stable."
        "Choose symplectic_euler, add drag, or mark the step unchecked and accept that it may diverge."

    NodeSpeed "NODE_SPEED" FailedPrecondition diverged
        "A node of the snow's grid would move more than a cell in one step: the simulation is about to diverge."
        "Reduce the fixed step, or let the step be certified."

    DeformationLimit "DEFORMATION_LIMIT" FailedPrecondition diverged
        "The deformation gradient of a particle of snow became larger than any snow allows: the simulation diverged."
        "Reduce the fixed step, or let the step be certified; check the material's numbers."

    OutOfRange "OUT_OF_RANGE" FailedPrecondition diverged
        "A particle of snow left the range of the grid, which is bounded only by its 32-bit indices."
        "Put a collider where snow is to stop, end the scene earlier, or look at what threw the particle."

    GridMemory "GRID_MEMORY" FailedPrecondition diverged
        "The snow flies apart: its grid would take more bytes than particles of their number may; the message has both numbers and the particle farthest out."
        "Put a collider where snow is to stop, end the scene earlier, or look at what threw the particle; a larger cell needs fewer of them."

    MassLost "MASS_LOST" FailedPrecondition diverged
        "The grid does not hold the mass of the particles: particles were lost between them. This is a bug in the server."
        "Report it with the scene and the message."

    SessionPanicked "SESSION_PANICKED" Internal
        "A bug in the server ended this session; others are not affected."
        "Report it with the scene and the message."

    FrameExpired "FRAME_EXPIRED" OutOfRange
        "The frame asked for is no longer kept in the form asked for; `oldest_frame` is the oldest that is."
        "Watch again from `oldest_frame`, or from the newest."

    FrameNotMade "FRAME_NOT_MADE" OutOfRange
        "The frame asked for will never be made: the session finished before it; `newest_frame` is its last."
        "Watch from a frame up to the last; one that is only not made yet can be waited for."

    FrameTooLarge "FRAME_TOO_LARGE" ResourceExhausted
        "The frame asked for in an answer is larger than one message holds."
        "Watch the frames as a stream, or ask for fewer fields."

    WatcherTooSlow "WATCHER_TOO_SLOW" ResourceExhausted
        "The watcher of every frame fell behind what the session keeps; `next_frame` was due, `oldest_frame` is kept."
        "Read faster, ask for fewer fields, watch LATEST, or raise the server's history."

    WatcherStalled "WATCHER_STALLED" ResourceExhausted
        "The watcher fetched nothing for `watcher_stall_seconds` while a message waited, or had waited longest when watchers held more than `max_held_bytes`."
        "Read what comes, ask for fewer fields, or watch again."

    TooManySessions "TOO_MANY_SESSIONS" ResourceExhausted
        "The server holds as many sessions as it allows."
        "Delete sessions that are no longer needed, or raise the limit."

    TooManyWatchers "TOO_MANY_WATCHERS" ResourceExhausted
        "The session has as many watchers as the server allows."
        "End other watchers, or raise the limit."

    TooManyUploads "TOO_MANY_UPLOADS" ResourceExhausted
        "As many uploads are in progress as the server allows."
        "Try again in a moment."

    TooManyChanges "TOO_MANY_CHANGES" ResourceExhausted
        "One call has more changes of parameters than the server reads, or more would wait for their step than it keeps."
        "Divide the changes over several calls, and send them closer to the step at which they take effect."

    TooManyCommands "TOO_MANY_COMMANDS" ResourceExhausted
        "As many calls wait for the session as it allows."
        "Wait for answers before sending more, or do not ask to wait."

    TooManyConnections "TOO_MANY_CONNECTIONS" ResourceExhausted
        "As many connections are open as the server allows, in all or from one address, and none of them is a stranger's, which would give way: the new one is closed without an answer. The log and the metrics of the server have this reason."
        "Close connections that are no longer needed, make several calls on one, or raise the limit (`--max-connections`, `--max-connections-per-address`)."

    SceneTooLarge "SCENE_TOO_LARGE" ResourceExhausted
        "The scene's text, particles or springs are more than the server allows."
        "Make the scene smaller, or raise the limit."

    MeshTooLarge "MESH_TOO_LARGE" ResourceExhausted
        "The upload announces more bytes or points than the server allows."
        "Make the mesh smaller, or raise the limit."

    MessageTooLarge "MESSAGE_TOO_LARGE" ResourceExhausted
        "A request message is larger than the server reads."
        "Send less in one message; meshes go through UploadMesh in pieces."

    HeadersTooLarge "HEADERS_TOO_LARGE" ResourceExhausted
        "The headers of a request have more than 16 KiB. Above 64 KiB the answer is 431 of HTTP, without a reason."
        "Send fewer or shorter headers."

    RequestMemoryFull "REQUEST_MEMORY_FULL" ResourceExhausted
        "The requests in progress, uploads included, hold as many bytes as the server allows; `needed_bytes`, `left_bytes` and `allowed_bytes` say how many. One that never fits says by how much (`over_bytes`), and which option raises the limit (`option`)."
        "Raise the limit that the message names; where it names none, try again in a moment."

    ServerMemoryFull "SERVER_MEMORY_FULL" ResourceExhausted
        "What the call needs does not fit into the memory that the server allows all sessions, meshes and requests; `needed_bytes` and `left_bytes` say how much."
        "Delete sessions that are no longer needed, make the scene smaller, or raise the limit."

    TooManyRanks "TOO_MANY_RANKS" ResourceExhausted
        "The session asks for more ranks than the server allows; `value` and `allowed` say how many."
        "Ask for fewer ranks, or raise the limit (`--max-ranks`)."

    RanksUnsupported "RANKS_UNSUPPORTED" InvalidArgument
        "The scene has something that several ranks cannot step together: semi-implicit snow, vertex block descent, an assembled matrix, or cloth with a thickness, whose crossings are counted or that is watched for rest; the message names the body and the setting."
        "Choose another setting, or step the scene without ranks."

    RanksUnavailable "RANKS_UNAVAILABLE" FailedPrecondition
        "The server finds no launcher or no program for ranks; the message names what is missing."
        "Install MPI, build the program with `cargo ranks`, or name both (`--launcher`, `--rank-program`)."

    RanksNotStarted "RANKS_NOT_STARTED" FailedPrecondition
        "The launcher ended, no rank of this version connected within 30 s, or another number of ranks was started; the message ends with the last lines of the launcher."
        "Look at these lines: hosts, slots, versions, and whether rank 0 reaches the server (`--link-address`)."

    RankLost "RANK_LOST" Aborted
        "A rank that stepped the session ended or hangs, or its link ended or was altered; the message says which. The session failed; what it streamed until then stands."
        "Look at the log of the server for the last lines of the launcher, and create the session again."

    BuildTooLong "BUILD_TOO_LONG" ResourceExhausted
        "Building the scene would take longer than the server allows, by the estimate `needed_seconds`, or was given up after so long."
        "Make the scene smaller, or raise the limit."

    UploadTimedOut "UPLOAD_TIMED_OUT" DeadlineExceeded
        "The upload paused for longer than the server waits, or took longer in all; what had come was dropped."
        "Upload again without pausing."

    UploadTooSlow "UPLOAD_TOO_SLOW" DeadlineExceeded
        "The upload sent fewer bytes per second than the server's least rate; what had come was dropped."
        "Upload again over a faster line, or lower the server's least rate."

    DeadlineExceeded "DEADLINE_EXCEEDED" DeadlineExceeded
        "The call did not end within the deadline that the client set."
        "Set a longer deadline; a call that changes something may still have taken effect."

    RequestCancelled "REQUEST_CANCELLED" Cancelled
        "The client ended the call before it was done."
        "Nothing, if the client meant it; otherwise check the connection."

    TokenMissing "TOKEN_MISSING" Unauthenticated
        "The server asks for a token, and the call shows none."
        "Call as the user who started the server, on its machine; or give the client the token's file, with --token FILE or NAPPE_TOKEN_FILE."

    TokenWrong "TOKEN_WRONG" Unauthenticated
        "The token that the call shows is not the server's."
        "A server that was started again has a new token: read it again, or fix one with --token FILE when the server is started."

    OriginNotAllowed "ORIGIN_NOT_ALLOWED" PermissionDenied
        "A web page of an origin that is not allowed called the server."
        "Start the server with --allow-origin for the page's origin."

    HostNotAllowed "HOST_NOT_ALLOWED" PermissionDenied
        "The request is addressed to a host name that is not the server's own, as when a web page has its name mean this machine."
        "Call the server by an address, as localhost or by the machine's name, or start it with --allow-host for the name."

    RequestTooSlow "REQUEST_TOO_SLOW" DeadlineExceeded
        "The request did not arrive whole in the time that the server waits."
        "Send the request at once; check the connection."

    ServerDraining "SERVER_DRAINING" Unavailable
        "The server is shutting down and ends calls and streams."
        "Connect again later; sessions survive a restart where they are kept (--state-dir)."

    Internal "INTERNAL" Internal
        "A bug in the server."
        "Report it with what was done."
}
