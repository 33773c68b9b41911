"""What a server says, as values: sessions, diagnostics, changes of state. Names and units are those of the contract.

Values of enums are words (`paused`), a vector is a tuple of x, y and z, and what is absent is None.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from datetime import datetime, timezone
from typing import Any, TypeVar

from nappe._contract import Message

Vector = tuple[float, float, float]
"""Three components along right-handed axes, y up."""

T = TypeVar("T")


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
class SolveReport:
    """How a linear solve ended."""

    outcome: str
    """How it ended, such as `converged` or `iteration_cap`."""
    iterations: int
    """Iterations that were made."""
    relative_residual: float
    """Norm of the residual divided by that of the right-hand side: of cloth sqrt(r.z), z = M^-1 r with the
    preconditioner M; of snow the same with the nodes' masses for M."""


@dataclass(frozen=True)
class ClothSteps:
    """How one step of the scene was divided into sub-steps, which all cloths share."""

    substeps: int
    """Sub-steps that were taken."""
    rejected: int
    """Sub-steps that were not accepted, and taken again shorter."""
    dt_seconds: float
    """Length of the last sub-step (s)."""
    bound: str
    """What bounds the next sub-step."""
    bound_particle: int | None
    """The particle that sets the bound. None if none does."""
    bound_seconds: float
    """Longest sub-step that the bound allows (s)."""
    error_rms: float
    """Estimated error that a sub-step makes in positions (m), the largest of all sub-steps and bodies: root of the
    mean square over the free particles of a body."""
    error_largest: float
    """The same of the particle with the largest error."""
    preconditioner: str | None
    """Preconditioner of the linear solves, as scenes name it: what "auto" chose, where the scene leaves the choice.
    None where no linear system is solved."""


@dataclass(frozen=True)
class SnowDiagnostics:
    """What the snow reported after one step of the scene."""

    substeps: int
    """Steps of the snow within this step of the scene."""
    dt_seconds: float
    """Length of the last step of the snow (s)."""
    bound: str
    """What bounds the next step of the snow."""
    bound_particle: int | None
    """The particle that sets the bound, over all particles. None if none does."""
    bound_seconds: float
    """Longest step that the bound allows (s). The largest finite number if nothing bounds the step."""
    mass: float
    """Mass of all particles (kg)."""
    grid_mass_error: float
    """Mass on the grid divided by mass of the particles, minus 1."""
    plastic_count: int
    """Particles that yielded in the last step."""
    inverted_count: int
    """Particles that were inverted."""
    clamped_count: int
    """Particles whose plastic volume ratio was clamped to its range."""
    ballistic_count: int
    """Particles that are nearly alone on the grid and move without stress."""
    min_plastic_ratio: float
    """Smallest plastic volume ratio J_P."""
    max_plastic_ratio: float
    """Largest plastic volume ratio J_P."""
    max_speed: float
    """Speed of the fastest particle (m/s)."""
    dropped_momentum: float
    """Momentum of nodes that are too light to carry a velocity (kg m/s)."""
    angular_momentum: Vector
    """Angular momentum about the origin (kg m^2/s)."""
    block_count: int
    """Blocks of 4 x 4 x 4 nodes in use."""


@dataclass(frozen=True)
class Notices:
    """How often something happened that does not fail a step, but makes its result doubtful."""

    capped_solves: int
    """Solves of cloth that ended at their largest number of iterations above their tolerance. A scene that fixes the
    number of iterations has none."""
    indefinite_solves: int
    """Solves of cloth that met a curvature or a preconditioner that is not positive."""
    passed_particles: int
    """Particles of cloth, pins too, that went through a collider or into it within a step, each once per sub-step in
    which it did."""
    rejected_steps: int
    """Sub-steps of cloth that were not accepted, and taken again shorter."""


@dataclass(frozen=True)
class Diagnostics:
    """What one step reported."""

    step: int
    """Steps taken, this one included."""
    time_seconds: float
    """Simulated time (s)."""
    frame: int
    """Number of the newest frame after the step."""
    kinetic_energy: float
    """Kinetic energy (J)."""
    elastic_energy: float
    """Elastic energy of springs and snow (J)."""
    gravitational_energy: float
    """Gravitational energy (J). 0 at the origin."""
    momentum: Vector
    """Linear momentum of the free particles (kg m/s)."""
    max_stretch: float
    """Largest ratio of length to rest length among the springs. 0 without springs."""
    contact_count: int
    """Particles of cloth in contact with a collider, each once per sub-step, and nodes of the snow's grid."""
    solve: SolveReport | None
    """The linear solve of cloth with the largest residual, with the iterations that its body made in the step; the
    last solve of snow. None with explicit integrators."""
    stages: dict[str, float]
    """Wall-clock time of each stage of the step (s), by its name."""
    step_seconds: float
    """Wall-clock time of the whole step."""
    snow: SnowDiagnostics | None
    """Diagnostics of the snow. None without snow, and before the first step."""
    notices: Notices
    """What makes the results of the session doubtful, counted since the session was made; a fork begins with none."""
    cloth: ClothSteps | None
    """How the step was divided for the cloths. None without cloth, and before the first step."""


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
class ClothParameters:
    """Drag and springs of a body of cloth."""

    body: str
    """Name of the body."""
    drag: float
    """Linear drag of the medium on each of its particles (N s/m)."""
    springs: tuple[SpringParameters, ...]
    """Its springs, one entry for each kind that it has."""


@dataclass(frozen=True)
class Parameters:
    """Parameters of the newest step."""

    gravity: Vector
    """Gravity (m/s^2)."""
    wind: Vector
    """Velocity of the medium around the cloth (m/s)."""
    cloths: tuple[ClothParameters, ...]
    """The bodies of cloth, in the order of their particles."""


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
    state_hash: int | None
    """Hash of the state at `step`. None while the session is playing."""
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
    """`present` (how it stands where the stream begins), `state`, `parameters`, `notice`, `rejected`, `draining` or
    `deleted`."""
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
    state_hash: int
    """Hash of the final state."""


@dataclass(frozen=True)
class Accepted:
    """When a change takes effect."""

    effective_step: int
    """Index of the step before which the change takes effect."""
    order: int
    """Number of the call among those that changed the session, from 1: changes before one step take effect in this
    order."""


_CLASSES: dict[str, type[Any]] = {
    kind.__name__: kind
    for kind in (
        SolveReport,
        ClothSteps,
        SnowDiagnostics,
        Notices,
        Diagnostics,
        SpringParameters,
        ClothParameters,
        Parameters,
        SessionRanks,
        Failure,
        RejectedStep,
        Progress,
        SessionEnd,
    )
}
_CLASSES |= {"Session": SessionInfo, "StateChange": Change, "UpdateParametersResponse": Accepted}


def read(kind: type[T], message: Message) -> T:
    """A message as a value of the class that stands for it."""
    names = message.DESCRIPTOR.fields_by_name
    return kind(**{field.name: _value(message, names[field.name]) for field in fields(kind)})  # type: ignore[arg-type]


def server_info(message: Message) -> ServerInfo:
    """What a server says of itself (`GetServerInfoResponse`)."""
    limits = {field.name: int(getattr(message.limits, field.name)) for field in message.limits.DESCRIPTOR.fields}
    return ServerInfo(message.version, message.thread_count, limits, tuple(message.scenes))


def word(enum: Any, number: int) -> str:
    """A value of an enum as a word: `paused` for SESSION_STATE_PAUSED."""
    value = enum.values_by_number.get(number)
    if value is None:
        return str(number)
    common = "".join("_" + c if c.isupper() else c for c in enum.name).upper().lstrip("_") + "_"
    return str(value.name).removeprefix(common).lower()


def _value(message: Message, field: Any) -> Any:
    """A field of a message, as a value."""
    if field.message_type is not None and field.message_type.name == "StageTime":
        return {stage.stage: stage.seconds for stage in getattr(message, field.name)}
    if is_repeated(field):
        return tuple(_single(item, field) for item in getattr(message, field.name))
    if field.has_presence and not message.HasField(field.name):
        return (0.0, 0.0, 0.0) if is_vector(field) else None
    return _single(getattr(message, field.name), field)


def _single(value: Any, field: Any) -> Any:
    if field.enum_type is not None:
        return word(field.enum_type, value)
    if field.message_type is None:
        return value
    if is_vector(field):
        return (value.x, value.y, value.z)
    if field.message_type.name == "Timestamp":
        return datetime.fromtimestamp(value.seconds + value.nanos * 1e-9, tz=timezone.utc)
    return read(_CLASSES[field.message_type.name], value)


def is_vector(field: Any) -> bool:
    """Whether a field holds three components."""
    return field.message_type is not None and field.message_type.name == "Vector3"


def is_repeated(field: Any) -> bool:
    """Whether a field holds a list; protobuf says it in another way from version to version."""
    told = getattr(field, "is_repeated", None)
    return bool(told) if told is not None else field.label == field.LABEL_REPEATED
