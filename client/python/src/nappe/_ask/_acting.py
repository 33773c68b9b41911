"""What acts on bodies, checked and put into messages: the air around them, forces, positions and velocities.

Enters: what a caller gives, and a message that has the fields. Leaves: the message, with numbers packed as bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nappe._ask._checks import array, finite, index, named
from nappe._wire._contract import MESSAGES, Message
from nappe._wire._errors import Refused, refused

Forces = Mapping[str, ArrayLike | Mapping[int, ArrayLike]]
"""Forces (N) by the name of the body: `{"cloth": (0, 1, 0)}` on all its particles, an array (n, 3) with one for each,
or `{"cloth": {7: (0, 1, 0)}}` by the index of the particle within the body."""
States = Mapping[str, ArrayLike | tuple[ArrayLike, ArrayLike | None]]
"""Positions (m) of all particles of a body (n, 3) by its name, or a tuple of positions and velocities (m/s)."""

_AIR = ("density", "normal", "lift", "tangential")


def fill_air(message: Message, air: Any, body: str) -> None:
    """Adds new numbers of the air around a body; around all that feel air if it has no name."""
    there = f"there are: {', '.join(_AIR)}"
    if not isinstance(air, Mapping):
        raise refused(f"air is {air!r}; allowed: a dict of numbers by their name; {there}", "air")
    if not air:
        raise refused(f"air is empty; {there}", "air")
    for name in air:
        if name not in _AIR:
            raise refused(f"air has no number {name!r}; {there}", "air")
    message.air.add(body=body, **{name: finite(value, f"air[{name!r}]") for name, value in air.items()})


def fill_forces(message: Message, forces: Any, particles: int) -> None:
    """Adds forces on particles of bodies."""
    if not isinstance(forces, Mapping):
        raise refused(f"forces is {forces!r}; allowed: a dict of forces by the name of the body", "forces")
    for body, given in forces.items():
        name = f"forces[{named(body, 'forces')!r}]"
        made = message.forces.add(body=body)
        if isinstance(given, Mapping):
            _fill_some(made, given, name, particles)
        elif _dimensions(given) == 1:
            x, y, z = array(given, name, (3,)).tolist()
            made.force.CopyFrom(MESSAGES["Vector3"](x=x, y=y, z=z))
        else:
            made.forces_f64 = _rows(given, name, particles).tobytes()


def _fill_some(made: Message, given: Mapping[Any, Any], name: str, particles: int) -> None:
    """Forces on the particles that are named. An empty list of particles would stand for all of them."""
    if not given:
        raise refused(f"{name} names no particle; allowed: a dict of vectors by the index of the particle", name)
    indices = [index(at, particles, name) for at in given]
    rows = [array(force, f"{name}[{at}]", (3,)) for at, force in zip(indices, given.values(), strict=True)]
    made.particles_u32 = np.array(indices, "<u4").tobytes()
    made.forces_f64 = np.concatenate(rows).tobytes()


def fill_states(message: Message, states: Any, particles: int) -> None:
    """Adds positions and velocities of bodies."""
    if not isinstance(states, Mapping):
        raise refused(f"states is {states!r}; allowed: a dict of positions by the name of the body", "states")
    for body, given in states.items():
        name = f"states[{named(body, 'states')!r}]"
        if not isinstance(given, tuple):
            fill_state(message, body, (given, None), (name, name), particles)
        elif len(given) == 2:
            fill_state(message, body, (given[0], given[1]), (f"{name}[0]", f"{name}[1]"), particles)
        else:
            raise _no_state(name, len(given))


def fill_state(
    message: Message, body: str, state: tuple[ArrayLike, ArrayLike | None], names: tuple[str, str], particles: int
) -> None:
    """Adds positions and velocities of a body, which callers know under two names."""
    positions, velocities = state
    where = _rows(positions, names[0], particles)
    made = message.states.add(body=body, positions_f64=where.tobytes())
    if velocities is not None:
        made.velocities_f64 = array(velocities, names[1], where.shape).tobytes()


def _rows(given: Any, name: str, particles: int) -> Any:
    """A vector for each particle of a body; how many these are, the server alone knows."""
    rows = array(given, name, (-1, 3))
    if not 0 < len(rows) <= particles:
        told = f"allowed: one for each particle of the body; the session has {particles} in all"
        raise refused(f"{name} has {len(rows)} vectors; {told}", name)
    return rows


def _dimensions(given: Any) -> int:
    """How many indices an entry has; 0 of what is no array, about which `array` says more."""
    try:
        return np.ndim(given)
    except ValueError:
        return 0


def _no_state(name: str, length: int) -> Refused:
    return refused(f"{name} is a tuple of {length}; allowed: positions, or a tuple of positions and velocities", name)
