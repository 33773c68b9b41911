"""Requests: what a caller gives, checked before a byte is sent, as messages of the contract.

Enters: arguments. Leaves: calls, each with its message, the time that it may take, and how its answer is read.
"""

from __future__ import annotations

import math
import uuid
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypedDict, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from nappe._ask._acting import Forces, States, fill_air, fill_forces, fill_state, fill_states
from nappe._ask._checks import UINT32, array, finite, index, named, whole
from nappe._ask._moving import Poses, fill_colliders
from nappe._ask._pulls import Pulls, fill_pulls
from nappe._wire._arrays import FIELDS
from nappe._wire._contract import MESSAGES, METHODS, Message, number
from nappe._wire._errors import refused
from nappe._wire._frames import Frame, field_number, read_frame
from nappe._wire._reading import read, server_info
from nappe._wire._values import Accepted, ServerInfo

T = TypeVar("T")

CALL_LIMIT = 10.0
"""Longest time of a call that the server answers at once (s)."""
CREATE_LIMIT = 120.0
"""Longest time that the building of a large scene may take (s)."""
PAGE_SIZE = 200
"""Sessions, or changes, in a page of a list."""

_KINDS = {
    "all": number("SpringKind", "SPRING_KIND_UNSPECIFIED"),
    "stretch": number("SpringKind", "SPRING_KIND_STRETCH"),
    "shear": number("SpringKind", "SPRING_KIND_SHEAR"),
    "bend": number("SpringKind", "SPRING_KIND_BEND"),
}
_ENCODINGS = {"f32": number("Encoding", "ENCODING_RAW_F32"), "f64": number("Encoding", "ENCODING_RAW_F64")}
_PRECISIONS = {
    None: number("Precision", "PRECISION_UNSPECIFIED"),
    "f32": number("Precision", "PRECISION_F32"),
    "f64": number("Precision", "PRECISION_F64"),
}
_AXES = {axis: number("Axis", f"AXIS_{axis.upper()}") for axis in "xyz"}

PerKind = float | Mapping[str, float]
"""One number for springs of all kinds, or one for each kind: `{"bend": 5}`."""


class Changes(TypedDict, total=False):
    """Changes of parameters; those that are absent stay as they are.

    `gravity` (m/s^2), `wind` (m/s), `drag` (N s/m) of the whole session. `stiffness` (N/m) and `damping` (N s/m) of
    springs: one number, or one for each of `stretch`, `shear` and `bend`. `air`: any of `density` (kg/m^3) and the
    coefficients `normal`, `lift` and `tangential` of the air. `body` names the cloth that springs and air are of, all
    without it. `pins`: for the index of a pinned particle, where it goes (m), at constant speed within `duration`
    (simulated seconds; at least one step).

    `forces` (N): for the name of a body, one vector for all its particles, an array (n, 3) with one for each, or a dict
    of vectors by the index of the particle within the body. They act until the next ones on the same particles; 0 takes
    them away. `states`: for the name of a body, the positions (m) of all its particles, which are at rest then, or a
    tuple of positions and velocities (m/s), each (n, 3).

    `colliders`: for the name of a collider, the position (m) that it goes to from where it is, or a tuple of a position
    and a turn since time 0, a quaternion x, y, z, w of length 1. It is there within `duration`. None in place of either
    leaves it as it is.

    `pulls`: for the name of a cloth, a dict of points (m) by the index of the particle within the body, or an array
    (n, 3) with one for each of its particles. The server draws each particle at x with velocity v to its point p by the
    acceleration w^2 (p - x) - 2 w v, w being `frequency` (1/s, at most 0.5 / dt), of at most `most` (m/s^2), for
    `seconds` of simulated time, 10 at most. None in place of a point ends its pull, in place of all points those of the
    body.
    """

    gravity: ArrayLike
    wind: ArrayLike
    drag: float
    stiffness: PerKind
    damping: PerKind
    body: str
    pins: Mapping[int, ArrayLike]
    duration: float
    air: Mapping[str, float]
    forces: Forces
    states: States
    colliders: Poses
    pulls: Pulls
    frequency: float
    most: float
    seconds: float


@dataclass(frozen=True)
class Call(Generic[T]):
    """One call: its method's name in the contract, its message, the seconds that it may take (None: any), how its
    answer is read."""

    name: str
    message: Message
    limit: float | None
    read: Callable[[Message], T]


def of_session(name: str, ids: tuple[str, str], limit: float | None = None, **fields: Any) -> Call[Message]:
    """A call about a session, by its id and uid, that answers how the session stands."""
    session_id, uid = ids
    message = METHODS[name].request(session_id=session_id, session_uid=uid, **fields)
    return Call(name, message, limit, lambda answer: answer)


def info() -> Call[ServerInfo]:
    """What the server is."""
    return Call("GetServerInfo", MESSAGES["GetServerInfoRequest"](), CALL_LIMIT, server_info)


def link(address: str, session_id: str, forks: int, uses: int, seconds: int) -> Call[str]:
    """A link to the page of the server at an address; with the id of a session, one that is good for that alone."""
    if address.startswith("unix:"):
        raise refused(f"no browser opens {address}; a server at HOST:PORT has links", "url")
    message = MESSAGES["MakeLinkRequest"](
        session_id=session_id,
        forks=whole(forks, "forks", most=UINT32),
        uses=whole(uses, "uses", most=UINT32),
        seconds=whole(seconds, "seconds", most=UINT32),
    )
    query = f"?session={session_id}" if session_id else ""
    return Call("MakeLink", message, CALL_LIMIT, lambda answer: f"{address}/{query}#{answer.code}")


def create(
    *,
    scene_name: str | None,
    scene_text: str | None,
    session_id: str,
    precision: str | None,
    thread_count: int,
    step_limit: int | None,
    frame_interval_steps: int,
    rank_count: int,
    begin: Message | None = None,
    checkpoint_id: str | None = None,
) -> Call[Message]:
    """A new session. Its request id makes a repeated request return the session of the first."""
    if precision not in tuple(_PRECISIONS):
        raise refused(f"precision is {precision!r}; allowed: 'f32', 'f64', or None, as the scene says", "precision")
    message = MESSAGES["CreateSessionRequest"](
        session_id=session_id,
        precision=_PRECISIONS[precision],
        thread_count=whole(thread_count, "thread_count", most=UINT32),
        frame_interval_steps=whole(frame_interval_steps, "frame_interval_steps", most=UINT32),
        rank_count=whole(rank_count, "rank_count", most=UINT32),
        request_id=str(uuid.uuid4()),
    )
    if step_limit is not None:
        message.step_limit = whole(step_limit, "step_limit")
    if checkpoint_id is not None:
        message.checkpoint_id = checkpoint_id
    elif scene_text is not None:
        message.scene_text = scene_text
    else:
        message.scene_name = scene_name or ""
    if begin is not None:
        message.begin.CopyFrom(begin)
    return Call("CreateSession", message, CREATE_LIMIT, lambda answer: answer)


def sessions(page_token: str) -> Call[Message]:
    """A page of the list of sessions."""
    message = MESSAGES["ListSessionsRequest"](page_size=PAGE_SIZE, page_token=page_token)
    return Call("ListSessions", message, CALL_LIMIT, lambda answer: answer)


def pending(ids: tuple[str, str], page_token: str) -> Call[Message]:
    """A page of the list of changes that wait."""
    return of_session("ListPendingChanges", ids, CALL_LIMIT, page_size=PAGE_SIZE, page_token=page_token)


def changes(**given: Any) -> Changes:
    """The changes among arguments: those that are not None, and those of unknown names, which are refused later."""
    known = Changes.__annotations__
    kept: Any = {name: value for name, value in given.items() if value is not None or name not in known}
    return cast(Changes, kept)


def fork(ids: tuple[str, str], new_id: str, step_limit: int | None) -> Call[Message]:
    """A session that stands where another one stands."""
    made = of_session("ForkSession", ids, new_session_id=new_id)
    if step_limit is not None:
        made.message.step_limit = whole(step_limit, "step_limit")
    return made


def save(ids: tuple[str, str]) -> Call[Message]:
    """The file of a session, in pieces."""
    return of_session("SaveSession", ids)


def play(ids: tuple[str, str], real_time_factor: float) -> Call[Message]:
    """Steps until paused, stopped or at the end."""
    factor = finite(real_time_factor, "real_time_factor")
    return of_session("PlaySession", ids, real_time_factor=factor)


def step(
    ids: tuple[str, str],
    count: int,
    *,
    to: int | None,
    wait: bool,
    changes: Changes | None,
    frame: bool,
    fields: Sequence[str],
    precision: str,
    particles: int,
) -> Call[Message]:
    """Some steps, with changes before the first and a frame after the last."""
    made = of_session("StepSession", ids, wait=wait)
    if to is not None:
        made.message.to_step = whole(to, "to")
    else:
        made.message.step_count = whole(count, "n", least=1)
    if changes:
        fill(made.message.changes, changes, particles)
    if frame and not wait:
        raise refused("frame needs wait: there is no frame before the steps are taken", "frame")
    if frame:
        made.message.frame.fields.extend(field_numbers(fields))
        made.message.frame.encoding = encoding(precision)
    return made


def frame_of(answer: Message) -> Frame | None:
    """The frame of an answer to StepSession, if it has one."""
    return read_frame([answer.frame], answer.session.particle_count) if answer.HasField("frame") else None


def update(ids: tuple[str, str], changes: Changes, at_step: int, wait: bool, particles: int) -> Call[Accepted]:
    """Changes between two steps."""
    made = _changing(ids, at_step, wait)
    fill(made.message, changes, particles)
    return made


def path(
    ids: tuple[str, str],
    particle: int,
    times: ArrayLike,
    targets: ArrayLike,
    at_step: int,
    wait: bool,
    particles: int,
    limits: Mapping[str, int],
) -> Call[Accepted]:
    """The way of a pin, point after point: no more of them than the server lets one call have."""
    when = array(times, "times", (-1,))
    most = limits["max_changes_per_call"]
    if len(when) > most:
        raise refused(
            f"times has {len(when)} points; allowed: at most {most} in one call, the server's max_changes_per_call. "
            "Send the way in several calls, or raise the limit (--max-changes-per-call)",
            "times",
        )
    where = array(targets, "targets", (-1, 3))
    if len(when) == 0 or len(when) != len(where):
        raise refused(f"{len(when)} times came with {len(where)} targets; as many of each, and at least one", "times")
    grows = np.diff(when, prepend=0.0) > 0
    if not grows.all():
        at = int(np.argmin(grows))
        raise refused(f"times[{at}] is {when[at]:g} s; allowed: above 0 and above the time before", "times")
    made = _changing(ids, at_step, wait)
    one = made.message.paths.add(particle=index(particle, particles, "particle"))
    one.times_seconds.extend(when.tolist())
    one.targets.extend(where.ravel().tolist())
    return made


def place(
    ids: tuple[str, str],
    body: str,
    positions: ArrayLike,
    velocities: ArrayLike | None,
    at_step: int,
    wait: bool,
    particles: int,
) -> Call[Accepted]:
    """Where all particles of a body are, and how fast."""
    made = _changing(ids, at_step, wait)
    fill_state(made.message, named(body, "body"), (positions, velocities), ("positions", "velocities"), particles)
    return made


def reset(ids: tuple[str, str]) -> Call[Accepted]:
    """Everything as at the session's start."""
    made = of_session("ResetSession", ids)
    return Call(made.name, made.message, made.limit, lambda answer: read(Accepted, answer))


def _changing(ids: tuple[str, str], at_step: int, wait: bool) -> Call[Accepted]:
    """A call that changes nothing yet."""
    session_id, uid = ids
    message = MESSAGES["UpdateParametersRequest"](session_id=session_id, session_uid=uid, wait=wait)
    message.at_step = whole(at_step, "at_step")
    return Call("UpdateParameters", message, None, lambda answer: read(Accepted, answer))


def fill(message: Message, changes: Changes, particles: int) -> None:
    """Puts changes into a message that has their fields, and checks each."""
    unknown = sorted(set(changes) - set(Changes.__annotations__))
    if unknown:
        raise refused(
            f"no change is called {unknown[0]!r}; there are: {', '.join(Changes.__annotations__)}", unknown[0]
        )
    for name in ("gravity", "wind"):
        if name in changes:
            x, y, z = array(changes.get(name), name, (3,)).tolist()
            getattr(message, name).CopyFrom(MESSAGES["Vector3"](x=x, y=y, z=z))
    if "drag" in changes:
        message.drag = finite(changes["drag"], "drag")
    body = changes.get("body", "")
    if not isinstance(body, str):
        raise refused(f"body is {body!r}; allowed: the name of a cloth", "body")
    for name in ("stiffness", "damping"):
        for kind, value in _per_kind(changes.get(name, {}), name):
            message.springs.add(body=body, kind=kind, **{name: value})
    if "air" in changes:
        fill_air(message, changes["air"], body)
    duration = finite(changes.get("duration", 0.0), "duration")
    pins = changes.get("pins", {})
    if not isinstance(pins, Mapping):
        raise refused(f"pins is {pins!r}; allowed: a dict of targets by the index of the particle", "pins")
    for particle, target in pins.items():
        at = index(particle, particles, "pins")
        x, y, z = array(target, f"pins[{at}]", (3,)).tolist()
        message.pins.add(particle=at, target=MESSAGES["Vector3"](x=x, y=y, z=z), duration_seconds=duration)
    fill_colliders(message, changes.get("colliders", {}), duration)
    fill_forces(message, changes.get("forces", {}), particles)
    fill_pulls(message, changes.get("pulls", {}), changes, particles)
    fill_states(message, changes.get("states", {}), particles)


def _per_kind(given: Any, name: str) -> Iterable[tuple[int, float]]:
    kinds = given if isinstance(given, Mapping) else {"all": given}
    for kind, value in kinds.items():
        if kind not in _KINDS:
            raise refused(f"{name} has a kind {kind!r}; allowed: {', '.join(_KINDS)}", name)
        yield _KINDS[kind], finite(value, f"{name}[{kind!r}]")


def field_numbers(fields: Sequence[str]) -> list[int]:
    """The numbers of fields on the wire."""
    names = field_names(fields)
    for name in names:
        if name not in FIELDS:
            raise refused(f"no array is called {name!r}; there are: {', '.join(FIELDS)}", "fields")
    if not names:
        raise refused("fields names no array; there are: " + ", ".join(FIELDS), "fields")
    return [field_number(name) for name in names]


def field_names(fields: Sequence[str]) -> tuple[str, ...]:
    """The names of fields, each once; one name alone may be given as it is."""
    names = [fields] if isinstance(fields, str) else list(fields) if isinstance(fields, Iterable) else [fields]
    for name in names:
        if not isinstance(name, str):
            raise refused(f"fields names {name!r}; allowed: {', '.join(FIELDS)}", "fields")
    return tuple(dict.fromkeys(names))


def encoding(precision: str) -> int:
    """The number of an encoding on the wire."""
    if precision not in tuple(_ENCODINGS):
        raise refused(f"precision is {precision!r}; allowed: 'f32', 'f64'", "precision")
    return _ENCODINGS[precision]


def grid_request(grid: str | None) -> Message | None:
    """Nodes of the snow's grid: `smoke` for all, `slice:y=0.5` for the plane nearest to y = 0.5 m."""
    if grid is None:
        return None
    message = MESSAGES["GridRequest"]()
    if grid == "smoke":
        message.all.SetInParent()
        return message
    if not isinstance(grid, str):
        raise refused(f"grid is {grid!r}; allowed: a text such as 'smoke' or 'slice:y=0.5'", "grid")
    axis, equals, coordinate = grid.removeprefix("slice:").partition("=")
    try:
        at = float(coordinate)
    except ValueError:
        at = math.nan
    if not grid.startswith("slice:") or axis not in _AXES or not equals or not math.isfinite(at):
        told = "allowed: 'smoke' for all nodes, or 'slice:' with x, y or z, '=' and metres, for example 'slice:y=0.5'"
        raise refused(f"grid is {grid!r}; {told}", "grid")
    message.slice.axis, message.slice.coordinate = _AXES[axis], at
    return message
