"""What a caller gives, checked: whole numbers, indices, numbers that are finite, names, arrays of a shape.

Enters: an argument and its name. Leaves: its value, or an error with the name and what is allowed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nappe._wire._errors import Refused, refused

UINT32 = 2**32 - 1
"""Largest whole number that fields of 32 bits hold."""


def whole(value: Any, name: str, least: int = 0, most: int = 2**63 - 1) -> int:
    """A whole number of at least `least` and at most `most`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not least <= value <= most:
        allowed = f"a whole number of at least {least}" if most > UINT32 else f"a whole number, {least} to {most}"
        raise refused(f"{name} is {value!r}; allowed: {allowed}", name)
    return int(value)


def index(value: Any, particles: int, name: str) -> int:
    """The index of a particle of the session."""
    at = whole(value, name)
    if at >= particles:
        raise refused(f"{name} names particle {at}; allowed: 0 to {particles - 1}", name)
    return at


def named(value: Any, name: str, what: str = "a body") -> str:
    """The name of a body, or of something else."""
    if not isinstance(value, str) or not value:
        raise refused(f"{name} is {value!r}; allowed: the name of {what}", name)
    return value


def finite(value: Any, name: str) -> float:
    """A number that is finite."""
    try:
        read_value = math.nan if isinstance(value, (bool, str, np.bool_)) else float(value)
    except (TypeError, ValueError, OverflowError):
        read_value = math.nan
    if not math.isfinite(read_value):
        raise refused(f"{name} is {value!r}; allowed: a finite number", name)
    return read_value


def array(value: Any, name: str, shape: tuple[int, ...], dtype: str = "<f8") -> Any:
    """A contiguous array of finite numbers of a shape, in which -1 stands for any length."""
    try:
        given = np.asarray(value)
    except (TypeError, ValueError) as error:
        raise _wrong_shape(name, shape, f"no array ({error})") from None
    if given.dtype.kind not in "iuf" and given.size:
        raise refused(f"{name} is an array of {given.dtype}; allowed: numbers", name)
    fits = given.ndim == len(shape) and all(want in (-1, have) for want, have in zip(shape, given.shape, strict=True))
    if not fits:
        raise _wrong_shape(name, shape, f"of shape {given.shape}")
    with np.errstate(over="ignore"):
        packed = np.ascontiguousarray(given, dtype)
    if packed.dtype.kind == "f" and not np.isfinite(packed).all():
        at = np.unravel_index(int(np.argmin(np.isfinite(packed))), packed.shape)
        where = "".join(f"[{int(i)}]" for i in at)
        raise refused(f"{name}{where} is {given[at]!s}; allowed: a finite number", name)
    return packed


def _wrong_shape(name: str, shape: tuple[int, ...], found: str) -> Refused:
    wanted = ", ".join("n" if length == -1 else str(length) for length in shape)
    return refused(f"{name} is {found}; allowed: ({wanted})", name)
