"""Changes that wait for their step, as values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from nappe._wire._contract import ENUMS, Message
from nappe._wire._reading import word


@dataclass(frozen=True)
class Pending:
    """What one call asked for, and waits for its step."""

    effective_step: int
    """Index of the step before which it takes effect."""
    order: int
    """Its number among the calls that changed the session."""
    changes: dict[str, Any]
    """What changes: `gravity` (m/s^2), `wind` (m/s), `drag` (N s/m), `springs` and `air` (a dict each), `pins` and
    `paths` (by the index of the particle), `forces` (by the name of the body: a list of pairs of indices within the
    body, None for all its particles, and forces, (3,) or one for each) and `states` (by the name of the body: positions
    and velocities, None where it is at rest, or the id of an uploaded mesh). `colliders` (by their names: position,
    turn, and duration in s) and `collider_paths` (times, positions (n, 3), turns (n, 4)) have None for what stays.
    `pulls` (by the name of the body): a list of tuples of indices within the body, None for all, points (n, 3), None
    where pulls end, frequency (1/s), most (m/s^2) and seconds."""


def read_pending(message: Message) -> Pending:
    """A change that waits, from the message that describes it."""
    asked = message.changes
    changes: dict[str, Any] = {}
    for name in ("gravity", "wind"):
        if asked.HasField(name):
            changes[name] = _vector(getattr(asked, name))
    if asked.HasField("drag"):
        changes["drag"] = asked.drag
    if asked.springs:
        changes["springs"] = [_springs(update) for update in asked.springs]
    if asked.pins:
        changes["pins"] = {pin.particle: (_vector(pin.target), pin.duration_seconds) for pin in asked.pins}
    if asked.paths:
        changes["paths"] = {
            path.particle: (np.array(path.times_seconds), np.array(path.targets).reshape(-1, 3)) for path in asked.paths
        }
    if asked.air:
        changes["air"] = [_air(update) for update in asked.air]
    if asked.forces:
        forces: dict[str, list[Any]] = {}
        for update in asked.forces:
            forces.setdefault(update.body, []).append(_forces(update))
        changes["forces"] = forces
    if asked.pulls:
        pulls: dict[str, list[Any]] = {}
        for update in asked.pulls:
            pulls.setdefault(update.body, []).append(_pull(update))
        changes["pulls"] = pulls
    if asked.colliders:
        changes["colliders"] = {move.name: _move(move) for move in asked.colliders}
    if asked.collider_paths:
        changes["collider_paths"] = {path.name: _way(path) for path in asked.collider_paths}
    if asked.states:
        changes["states"] = {update.body: _state(update) for update in asked.states}
    return Pending(message.accepted.effective_step, message.accepted.order, changes)


def _springs(update: Message) -> dict[str, Any]:
    told: dict[str, Any] = {"body": update.body or None}
    kind = word(ENUMS["SpringKind"], update.kind)
    told["kind"] = "all" if kind == "unspecified" else kind
    for name in ("stiffness", "damping"):
        if update.HasField(name):
            told[name] = getattr(update, name)
    return told


def _air(update: Message) -> dict[str, Any]:
    told: dict[str, Any] = {"body": update.body or None}
    for name in ("density", "normal", "lift", "tangential"):
        if update.HasField(name):
            told[name] = getattr(update, name)
    return told


def _forces(update: Message) -> tuple[Any, Any]:
    """Indices within the body, or None for all, and a force for each of them, or one for all."""
    indices = np.frombuffer(update.particles_u32, "<u4") if update.particles_u32 else None
    return indices, _rows(update.forces_f64) if update.forces_f64 else np.array(_vector(update.force))


def _pull(update: Message) -> tuple[Any, Any, float, float, float]:
    """Indices within the body, or None for all, a point for each of them, or None, and how they draw."""
    indices = np.frombuffer(update.particles_u32, "<u4") if update.particles_u32 else None
    points = _rows(update.points_f64) if update.points_f64 else None
    return indices, points, update.frequency, update.most, update.seconds


def _state(update: Message) -> Any:
    if update.upload_id:
        return update.upload_id
    return _rows(update.positions_f64), _rows(update.velocities_f64) if update.velocities_f64 else None


def _move(update: Message) -> tuple[Any, Any, float]:
    position = _vector(update.position) if update.HasField("position") else None
    turn = (update.turn.x, update.turn.y, update.turn.z, update.turn.w) if update.HasField("turn") else None
    return position, turn, update.duration_seconds


def _way(path: Message) -> tuple[Any, Any, Any]:
    positions = np.array(path.positions).reshape(-1, 3) if path.positions else None
    turns = np.array(path.turns).reshape(-1, 4) if path.turns else None
    return np.array(path.times_seconds), positions, turns


def _rows(packed: bytes) -> Any:
    return np.frombuffer(packed, "<f8").reshape(-1, 3)


def _vector(message: Message) -> tuple[float, float, float]:
    return (message.x, message.y, message.z)
