"""Diagnostics of many steps as numpy arrays: a row per step, a column per number or word.

The columns follow from the fields of `Diagnostics`: what is nested has a prefix, such as `snow_mass`. Stages are left
out, and loads of colliders stand in the table alone, under the collider's name: `load_floor_force_x`. An absent number
is nan, an absent word is "". In the structured array all numbers are float64, and a vector is one column. In the table
a vector is three columns and a whole number is int64, which has no nan: an absent count is 0, an absent index is -1,
and so is a count that the scene does not ask for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, is_dataclass
from functools import lru_cache
from types import NoneType
from typing import Any, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from nappe._wire._reports import ColliderLoad, Diagnostics, Vector

_LEFT_OUT = (dict[str, float], tuple[ColliderLoad, ...])
"""Stages and loads: their names are those of the program and of the scene."""


@dataclass(frozen=True)
class _Column:
    """A column, and the names that lead to its value."""

    path: tuple[str, ...]
    kind: Any
    is_index: bool
    """A whole number that says which, so that 0 stands for the first, or a count that may not be made."""

    @property
    def name(self) -> str:
        return "_".join(self.path)

    @property
    def width(self) -> tuple[int, ...]:
        """Shape of one of its values."""
        return (3,) if self.kind == Vector else ()

    def value(self, entry: Any) -> Any:
        """Its value in an entry, or None."""
        for name in self.path:
            entry = None if entry is None else getattr(entry, name)
        return entry

    def values(self, entries: Sequence[Diagnostics | None]) -> list[Any]:
        """Its value in each entry, or None."""
        return [self.value(entry) for entry in entries]

    @property
    def absent(self) -> Any:
        """What stands for none in an array."""
        return "" if self.kind is str else np.full(self.width, np.nan)


def diagnostics_array(entries: Sequence[Diagnostics | None]) -> NDArray[np.void]:
    """One row per entry, under the names of the fields; an entry that is None has absent values only."""
    columns = _columns()
    values = {column: _filled(column.values(entries), column.absent) for column in columns}
    rows = np.empty(len(entries), [_described(column, values[column]) for column in columns])
    for column, of_column in values.items():
        if of_column:
            rows[column.name] = of_column
    return rows


def diagnostics_table(entries: Sequence[Diagnostics | None]) -> dict[str, NDArray[Any]]:
    """Flat columns under their names, a row per entry; a column that has no value in any row is left out."""
    table: dict[str, NDArray[Any]] = {}
    for column in _columns():
        values = column.values(entries)
        if values and all(value is None for value in values):
            continue
        if column.kind is int:
            table[column.name] = np.array(_filled(values, -1 if column.is_index else 0), np.int64)
        elif column.kind is str:
            table[column.name] = np.array(_filled(values, ""), np.str_)
        else:
            names = [f"{column.name}_{axis}" for axis in "xyz"] if column.width else [column.name]
            numbers = np.array(_filled(values, column.absent), np.float64).reshape(len(values), len(names))
            # Each on its own, so that one that is kept keeps no other.
            table.update(zip(names, map(np.array, numbers.T), strict=True))
    return table | _loads(entries)


def _loads(entries: Sequence[Diagnostics | None]) -> dict[str, NDArray[Any]]:
    """Columns of what colliders felt; 0 in the first frame, which no step made."""
    of_entries = [() if entry is None else entry.loads for entry in entries]
    table: dict[str, NDArray[Any]] = {}
    for place, collider in enumerate(next((loads for loads in of_entries if loads), ())):
        loads = [loads[place] if loads else None for loads in of_entries]
        for part in ("force", "torque"):
            for axis, letter in enumerate("xyz"):
                column = [0.0 if load is None else getattr(load, part)[axis] for load in loads]
                table[f"load_{collider.name}_{part}_{letter}"] = np.array(column, np.float64)
        contacts = [0 if load is None else load.contacts for load in loads]
        table[f"load_{collider.name}_contacts"] = np.array(contacts, np.int64)
    return table


def loads_arrays(entries: Sequence[Diagnostics | None]) -> dict[str, NDArray[Any]]:
    """What colliders felt, under the names that a saved file has; 0 in the first frame, which no step made.

    `load_names` (colliders,), `load_force` (N) and `load_torque` (N m) (entries, colliders, 3), `load_contacts`
    (entries, colliders).
    """
    of_entries = [() if entry is None else entry.loads for entry in entries]
    names = [load.name for load in next((loads for loads in of_entries if loads), ())]
    force, torque = (np.zeros((len(of_entries), len(names), 3)) for _ in range(2))
    contacts = np.zeros((len(of_entries), len(names)), np.int64)
    for row, loads in enumerate(of_entries):
        for place, load in enumerate(loads):
            force[row, place], torque[row, place], contacts[row, place] = load.force, load.torque, load.contacts
    return {
        "load_names": np.array(names, np.str_),
        "load_force": force,
        "load_torque": torque,
        "load_contacts": contacts,
    }


def _filled(values: list[Any], absent: Any) -> list[Any]:
    return [absent if value is None else value for value in values]


def _described(column: _Column, values: list[Any]) -> tuple[str, str, tuple[int, ...]]:
    """Name, type and shape of a column; words take as much room as the longest."""
    letters = max((len(value) for value in values), default=0) if column.kind is str else 0
    return column.name, f"<U{max(1, letters)}" if column.kind is str else "<f8", column.width


@lru_cache(maxsize=1)
def _columns() -> tuple[_Column, ...]:
    return tuple(_columns_of(Diagnostics, ()))


def _columns_of(kind: type[Any], path: tuple[str, ...]) -> Iterator[_Column]:
    """The columns of a dataclass that stands at a path."""
    for name, hint in get_type_hints(kind).items():
        present = [part for part in get_args(hint) if part is not NoneType] if NoneType in get_args(hint) else [hint]
        held = present[0]
        if is_dataclass(held) and isinstance(held, type):
            yield from _columns_of(held, (*path, name))
        elif held in (int, float, str, Vector):
            yield _Column((*path, name), held, held is int and held is not hint)
        elif held not in _LEFT_OUT:
            raise TypeError(f"{kind.__name__}.{name} is {hint}, which has no place in a column")
