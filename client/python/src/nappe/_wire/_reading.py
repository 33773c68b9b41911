"""Messages of the contract to the values that stand for them."""

from __future__ import annotations

from dataclasses import fields
from datetime import datetime, timezone
from typing import Any, TypeVar

import numpy as np

from nappe._wire._contract import Message
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
from nappe._wire._values import (
    Accepted,
    Air,
    Change,
    ClothParameters,
    ColliderPose,
    Durability,
    Failure,
    Parameters,
    Progress,
    RejectedStep,
    ServerInfo,
    SessionEnd,
    SessionInfo,
    SessionRanks,
    SpringParameters,
)

T = TypeVar("T")

NO_TURN = (0.0, 0.0, 0.0, 1.0)
"""The quaternion of what is not turned."""

_CLASSES: dict[str, type[Any]] = {
    kind.__name__: kind
    for kind in (
        SolveReport,
        ClothSteps,
        SnowDiagnostics,
        Notices,
        ColliderLoad,
        SurfaceReport,
        RestReport,
        Diagnostics,
        SpringParameters,
        Air,
        ClothParameters,
        ColliderPose,
        Parameters,
        SessionRanks,
        Durability,
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
    if field.message_type is not None and field.message_type.name == "ForceUpdate":
        return {update.body: _forces(update) for update in getattr(message, field.name)}
    if is_repeated(field):
        return tuple(_single(item, field) for item in getattr(message, field.name))
    if field.has_presence and not message.HasField(field.name):
        return (0.0, 0.0, 0.0) if is_vector(field) else NO_TURN if is_turn(field) else None
    return _single(getattr(message, field.name), field)


def _single(value: Any, field: Any) -> Any:
    if field.enum_type is not None:
        return word(field.enum_type, value)
    if field.message_type is None:
        return hexadecimal(value) if field.name == "state_hash" else value
    if is_vector(field):
        return (value.x, value.y, value.z)
    if is_turn(field):
        return (value.x, value.y, value.z, value.w)
    if field.message_type.name == "Timestamp":
        return datetime.fromtimestamp(value.seconds + value.nanos * 1e-9, tz=timezone.utc)
    return read(_CLASSES[field.message_type.name], value)


def _forces(update: Message) -> Any:
    """Forces on a body as calls take them: one for all its particles, one for each, or by the index of the particle."""
    names = np.frombuffer(update.particles_u32, "<u4").tolist()
    rows = [tuple(row) for row in np.frombuffer(update.forces_f64, "<f8").reshape(-1, 3).tolist()]
    if update.HasField("force"):
        one = (update.force.x, update.force.y, update.force.z)
        return dict.fromkeys(names, one) if names else one
    return dict(zip(names, rows, strict=True)) if names else rows or None


def hexadecimal(state_hash: int) -> str:
    """A hash of a state as 16 hexadecimal digits, as the command writes it."""
    return f"{state_hash:016x}"


def is_vector(field: Any) -> bool:
    """Whether a field holds three components."""
    return field.message_type is not None and field.message_type.name == "Vector3"


def is_turn(field: Any) -> bool:
    """Whether a field holds a quaternion."""
    return field.message_type is not None and field.message_type.name == "Quaternion"


def is_repeated(field: Any) -> bool:
    """Whether a field holds a list; protobuf says it in another way from version to version."""
    told = getattr(field, "is_repeated", None)
    return bool(told) if told is not None else field.label == field.LABEL_REPEATED
