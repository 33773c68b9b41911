"""What a server says of itself and of its sessions, as values. Names and units are those of the contract.

Values of enums are words (`paused`), a vector is a tuple of x, y and z, and what is absent is None.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from nappe._wire._reports import Diagnostics, Quaternion, Vector


@dataclass(frozen=True)
class ServerInfo:
    """What a server is, and what it allows."""

    version: str
    """Version of the server, such as 1.2.3."""
    thread_count: int
    """Logical cores that the server may use."""
    limits: dict[str, int]
    """Bounds of everything that a client can send or hold, under the names of the contract (`Limits`)."""
    scenes: tuple[str, ...]
    """Names of the scenes that the server ships."""


@dataclass(frozen=True)
class SpringParameters:
    """Springs of one kind in one body; the two ends of a range are equal unless the scene gives different numbers."""

    kind: str
    """`stretch`, `shear` or `bend`."""
    min_stiffness: float
    """Stiffness of the softest (N/m)."""
    max_stiffness: float
    """Stiffness of the stiffest (N/m)."""
    min_damping: float
    """Damping of the least damped (N s/m)."""
    max_damping: float
    """Damping of the most damped (N s/m)."""


@dataclass(frozen=True)
class Air:
    """The air around a body of cloth, and how its triangles feel it: docs/laws/medium.md."""

    density: float
    """Density (kg/m^3)."""
    normal: float
    """Coefficient of the velocity across a triangle."""
    lift: float
    """Coefficient of the velocity across a triangle that slides through the air."""
    tangential: float
    """Coefficient of the velocity along a triangle."""


@dataclass(frozen=True)
class ClothParameters:
    """Drag, air and springs of a body of cloth."""

    body: str
    """Name of the body."""
    drag: float
    """Linear drag of the medium on each of its particles (N s/m)."""
    springs: tuple[SpringParameters, ...]
    """Its springs, one entry for each kind that it has."""
    air: Air | None
    """The air that acts on its triangles. None where it feels none."""
    pull_count: int
    """How many of its particles are pulled."""


@dataclass(frozen=True)
class ColliderPose:
    """Where a collider is, and how it is turned."""

    name: str
    """The collider's name in the scene."""
    position: Vector
    """Position of its reference point (m): the centre of a sphere or a box, the middle of the segment of a capsule or a
    cylinder, the point of a plane or a half-pipe, the place where the transform of a mesh puts the mesh's origin."""
    turn: Quaternion
    """How it is turned since time 0: a quaternion x, y, z, w of length 1."""


@dataclass(frozen=True)
class Parameters:
    """Parameters of the newest step."""

    gravity: Vector
    """Gravity (m/s^2)."""
    wind: Vector
    """Velocity of the medium around the cloth (m/s)."""
    cloths: tuple[ClothParameters, ...]
    """The bodies of cloth, in the order of their particles."""
    collider_poses: tuple[ColliderPose, ...]
    """Where the colliders are after the newest step, in the order of the scene."""
    forces: dict[str, Vector | dict[int, Vector] | None]
    """Forces that calls have set (N), by the name of the body, as `Session.update` takes them: one vector where all
    particles that are not pinned feel the same, a dict of vectors by the index of the particle within the body where
    others do. None in place of such a dict where those of all bodies have more than 4096 entries, and in lists of
    sessions."""


@dataclass(frozen=True)
class SessionRanks:
    """Ranks of a cluster that step a session together."""

    rank_count: int
    """How many ranks there are."""
    thread_count: int
    """Threads of each rank."""
    hosts: tuple[str, ...]
    """The host of each rank."""
    message_count: int
    """Messages that rank 0 sent to its neighbours."""
    message_bytes: int
    """Bytes of these."""
    gather_count: int
    """Short lists that all ranks gathered."""


@dataclass(frozen=True)
class Durability:
    """How far what a folder has of a session is behind the session."""

    step: int | None
    """Steps at the newest state in the folder; the log has what happened since. None until one is there."""
    age_seconds: float | None
    """Wall-clock seconds since that state was taken, or since the server made the session again."""
    problem: str
    """Why the session is not kept at the moment; empty while it is. It goes on all the same."""


@dataclass(frozen=True)
class Failure:
    """Why a session failed."""

    reason: str
    """A reason of docs/errors.md."""
    message: str
    """What happened, in one sentence."""
    step: int
    """Index of the step that failed, from 0."""
    time_seconds: float
    """Simulated time before that step (s)."""
    particle: int | None
    """The first particle concerned, over all particles; absent if none is known."""
    value: float | None
    """The value that is not allowed; absent if there is none."""


@dataclass(frozen=True)
class SessionInfo:
    """A session as of one answer of the server. All quantities are in SI units."""

    session_id: str
    """Its name among the sessions of the server."""
    title: str
    """Title of the scene."""
    state: str
    """What the session is doing: `paused`, `playing`, `finished` or `failed`."""
    failure: Failure | None
    """Why the session failed. Only in state `failed`."""
    step: int
    """Steps taken since the initial state."""
    time_seconds: float
    """Simulated time (s)."""
    frame: int
    """Number of the newest frame."""
    oldest_frame: int
    """Number of the oldest frame that a watcher can still start from."""
    dt_seconds: float
    """Time step (s)."""
    step_limit: int
    """The session ends after this many steps. 0: never by itself."""
    frame_interval_steps: int
    """Steps between frames, at least 1."""
    precision: str
    """Precision of positions and velocities: `f32` or `f64`."""
    thread_count: int
    """Threads that step the session."""
    particle_count: int
    """Particles of cloth and snow together."""
    spring_count: int
    """Springs of all cloths together."""
    watcher_count: int
    """Streams that watch the session now."""
    state_hash: str | None
    """Hash of the state at `step`, 16 hexadecimal digits. None while the session is playing."""
    diagnostics: Diagnostics | None
    """Diagnostics of the newest step."""
    stepping_seconds: float
    """Wall-clock seconds spent stepping."""
    snow_particle_count: int
    """Particles of snow; they are the last ones."""
    uid: str
    """A UUID that no other session ever has, not even a later one with the same id."""
    create_time: datetime
    """When it was made, by the server's clock."""
    parameters: Parameters | None
    """Parameters of the newest step; changes that wait for their step are not in them."""
    expires_in_seconds: float | None
    """Seconds until the server deletes the session, unless somebody calls, watches or plays it before. None while
    it is in use, and on a server that keeps sessions until they are deleted."""
    ranks: SessionRanks | None
    """The ranks that step it. None where the server does."""
    largest_stretch: float
    """The largest `max_stretch` of diagnostics since the session was made, where it began counted."""
    largest_stretch_seconds: float
    """Simulated time at which it was so for the first time (s)."""
    durability: Durability | None
    """What a server that is started again would have of it. None on a server that keeps no sessions in a folder."""


@dataclass(frozen=True)
class RejectedStep:
    """A sub-step of the cloths that was not accepted. No particle moved by it."""

    time_seconds: float
    """Simulated time at its start (s)."""
    dt_seconds: float
    """Its length (s)."""
    body: str
    """Name of the body that it was not good for."""
    reason: str
    """What stood against it: a reason of docs/errors.md."""
    message: str
    """The same in one sentence."""
    particle: int | None
    """The particle at fault. None where none is."""
    value: float | None
    """The value at fault. None where there is none."""


@dataclass(frozen=True)
class Change:
    """What happened to a session beside its frames, and how it stands since."""

    number: int
    """Number of the change in its session, from 1. A number that is not one more than the last: the changes between
    were too many to be kept, or belong to this watcher's past. `present` has the number of the last change, 0 if
    there was none; `draining` has it too, since it is the server's."""
    kind: str
    """`present` (how it stands where the stream begins), `state`, `parameters`, `reset` (everything is as at the
    session's start), `notice`, `rejected`, `draining` or `deleted`."""
    state: str
    """State of the session after the change."""
    failure: Failure | None
    """Why the session failed. Only in state `failed`."""
    step: int
    """Steps taken before the change."""
    frame: int
    """Number of the newest frame made before the change."""
    session_uid: str
    """Uid of the session."""
    notice: str
    """What happened, and what helps. Only of kind `notice`."""
    rejected: RejectedStep | None
    """Only of kind `rejected`."""


@dataclass(frozen=True)
class Progress:
    """A sign of life and a bookmark of a stream."""

    frame: int
    """The newest frame that was sent, or, before any, the newest made."""
    step: int
    """Steps that the session has taken."""
    time_seconds: float
    """Simulated time of the session (s)."""


@dataclass(frozen=True)
class SessionEnd:
    """How a session finished."""

    frame: int
    """Number of the newest frame."""
    step: int
    """Steps taken in all."""
    state_hash: str
    """Hash of the final state, 16 hexadecimal digits."""


@dataclass(frozen=True)
class Accepted:
    """When a change takes effect."""

    effective_step: int
    """Index of the step before which the change takes effect."""
    order: int
    """Number of the call among those that changed the session, from 1: changes before one step take effect in this
    order."""
