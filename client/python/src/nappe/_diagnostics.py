"""Diagnostics of many steps as a numpy structured array: a row per step, a column per number or word.

The columns follow from the fields of `Diagnostics`: what is nested has a prefix, such as `snow_mass`. Stages are left
out. Any entry may lack any value, so that all numbers are float64 and an absent one is nan; an absent word is "".
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, is_dataclass
from functools import lru_cache
from types import NoneType
from typing import Any, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from nappe._reports import Diagnostics, Vector

_STAGES = dict[str, float]


@dataclass(frozen=True)
class _Column:
    """A column, and the names that lead to its value."""

    path: tuple[str, ...]
    kind: Any

    @property
    def name(self) -> str:
        return "_".join(self.path)

    @property
    def width(self) -> tuple[int, ...]:
        """Shape of one of its values."""
        return (3,) if self.kind == Vector else ()

    def value(self, entry: Any) -> Any:
        """Its value in an entry; what stands for none where there is none."""
        for name in self.path:
            entry = None if entry is None else getattr(entry, name)
        if entry is not None:
            return entry
        return "" if self.kind is str else np.full(self.width, np.nan)


def diagnostics_array(entries: Sequence[Diagnostics | None]) -> NDArray[np.void]:
    """One row per entry, under the names of the fields; an entry that is None has absent values only."""
    columns = _columns()
    values = {column: [column.value(entry) for entry in entries] for column in columns}
    rows = np.empty(len(entries), [_described(column, values[column]) for column in columns])
    for column, of_column in values.items():
        if of_column:
            rows[column.name] = of_column
    return rows


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
            yield _Column((*path, name), held)
        elif held != _STAGES:
            raise TypeError(f"{kind.__name__}.{name} is {hint}, which has no place in a column")
