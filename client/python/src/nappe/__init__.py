"""Cloth and snow, stepped on a nappe server, as numpy arrays.

    import nappe

    with nappe.serve() as server, server.create("flag") as session:
        session.play()
        for frame in session.frames(every=True):
            print(frame.time, frame.positions.mean(axis=0))

`nappe.connect()` reaches a server that runs already. `nappe.aio` has the same names with `await`; `nappe.v1` has the
raw messages of the contract. docs/python.md leads from nothing to a moving cloth, and lists everything here.
"""

from nappe import v1
from nappe._ask._requests import Changes
from nappe._ask._uploads import Uploaded
from nappe._save._trajectory import Trajectory
from nappe._server._sync_server import Server, connect, serve
from nappe._server._sync_session import Session
from nappe._server._sync_stream import DiagnosticsStream, Frames, Stream
from nappe._wire._arrays import BodyArrays
from nappe._wire._colliders import Collider
from nappe._wire._errors import (
    REASONS,
    Closed,
    Diverged,
    Error,
    Expired,
    FileNotFound,
    Full,
    NotFound,
    Reason,
    Refused,
    TooSlow,
    Unauthenticated,
    Unavailable,
)
from nappe._wire._frames import Frame, Grid
from nappe._wire._pending import Pending
from nappe._wire._reports import (
    ClothSteps,
    ColliderLoad,
    Diagnostics,
    Notices,
    RestReport,
    SnowDiagnostics,
    SolveReport,
    SurfaceReport,
)
from nappe._wire._topology import Body, Topology
from nappe._wire._values import (
    Accepted,
    Air,
    Change,
    ClothParameters,
    ColliderPose,
    Durability,
    Failure,
    Parameters,
    RejectedStep,
    ServerInfo,
    SessionEnd,
    SessionInfo,
    SessionRanks,
    SpringParameters,
)

__version__ = "0.1.0"
__all__ = [
    "REASONS",
    "Accepted",
    "Air",
    "Body",
    "BodyArrays",
    "Change",
    "Changes",
    "Closed",
    "ClothParameters",
    "ClothSteps",
    "Collider",
    "ColliderLoad",
    "ColliderPose",
    "Diagnostics",
    "DiagnosticsStream",
    "Diverged",
    "Durability",
    "Error",
    "Expired",
    "Failure",
    "FileNotFound",
    "Frame",
    "Frames",
    "Full",
    "Grid",
    "NotFound",
    "Notices",
    "Parameters",
    "Pending",
    "Reason",
    "Refused",
    "RejectedStep",
    "RestReport",
    "Server",
    "ServerInfo",
    "Session",
    "SessionEnd",
    "SessionInfo",
    "SessionRanks",
    "SnowDiagnostics",
    "SolveReport",
    "SpringParameters",
    "Stream",
    "SurfaceReport",
    "TooSlow",
    "Topology",
    "Trajectory",
    "Unauthenticated",
    "Unavailable",
    "Uploaded",
    "connect",
    "serve",
    "v1",
]
