"""Packed arrays: numbers on a grid of a known step, as differences, in planes of bytes, deflated.

Enters: an array over the particles, and a step. Leaves: bytes, and from bytes the array again, each number within half
a step of what it was. docs/frames.md says what every byte means.
"""

from __future__ import annotations

import math
import sys
import zlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nappe._wire._errors import Error, refused

LIMIT = 1 << 23
"""Whole numbers stay below this: times a step they are exact in binary32."""
LEAST_EXPONENT, GREATEST_EXPONENT = -126, 104
"""A step is 2 to a power between these, both included."""

_MAX_PLANES = 4
# As deflate's own default; files, not streams, are written.
_LEVEL = 6


class OutOfReachError(Error):
    """A number that no whole number of steps below 2^23 is near to. A coarser step may reach it."""


def step_within(bound: float) -> float:
    """The largest power of two that keeps numbers within `bound` of what they were: half of it is at most `bound`."""
    twice = 2.0 * float(bound)
    if math.isfinite(twice) and twice >= sys.float_info.min:
        exponent = math.frexp(twice)[1] - 1
        if LEAST_EXPONENT <= exponent <= GREATEST_EXPONENT:
            return math.ldexp(1.0, exponent)
    raise refused(f"no packed array holds numbers within {bound!r} of what they were", "bound")


def quantize(values: ArrayLike, step: float) -> NDArray[np.int32]:
    """The whole numbers of steps nearest to `values`, in their shape; of two as near, the even one."""
    _check_step(step)
    with np.errstate(over="ignore", invalid="ignore"):
        numbers = np.asarray(values, np.float64) / step
    near = np.abs(numbers) < LIMIT - 0.5
    if near.all():
        return np.rint(numbers).astype(np.int32)
    flat = np.asarray(values).reshape(-1)
    index = int(np.argmin(near.reshape(-1)))
    if not np.isfinite(flat).all():
        index = int(np.argmin(np.isfinite(flat)))
        raise Error(f"number {index} of the array is {flat[index]!s}; what is not finite cannot be packed")
    raise OutOfReachError(f"number {index} of the array is {flat[index]!s}, 2^23 steps of {step!r} or more from 0")


def restore(numbers: NDArray[np.int32], step: float) -> NDArray[np.float32]:
    """The numbers in their unit, in the same shape, each within step / 2 of what was packed."""
    _check_step(step)
    restored: NDArray[np.float32] = numbers.astype(np.float32) * np.float32(step)
    return restored


def pack(numbers: NDArray[np.int32], base: NDArray[np.int32] | None = None) -> bytes:
    """Packs whole numbers (particles, components); with a base of the same shape, what they differ by from it."""
    if numbers.dtype != np.int32 or numbers.ndim != 2 or (base is not None and base.shape != numbers.shape):
        raise Error(f"only int32 of shape (particles, components) are packed, not {numbers.dtype} {numbers.shape}")
    if numbers.size == 0:
        return b""
    alone = numbers if base is None else numbers - base
    # Component by component; sums and differences of int32 wrap.
    differences = np.diff(alone.T, axis=1, prepend=np.int32(0)).reshape(-1)
    sign = (differences >> 31).view(np.uint32)
    zigzag = (differences.view(np.uint32) << np.uint32(1)) ^ sign
    planes = max(1, (int(zigzag.max()).bit_length() + 7) // 8)
    of_each = zigzag.astype("<u4").view(np.uint8).reshape(-1, _MAX_PLANES)
    deflate = zlib.compressobj(_LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    return deflate.compress(of_each.T[:planes].tobytes()) + deflate.flush()


def unpack(data: bytes, particles: int, components: int, base: NDArray[np.int32] | None = None) -> NDArray[np.int32]:
    """The whole numbers (particles, components) of a packed array; with the base that it was packed with.

    Bytes that hold no array of this shape are refused, and never more than 4 bytes per number are made of them.
    """
    if base is not None and base.shape != (particles, components):
        raise Error(f"a base of shape {base.shape} for an array of shape {(particles, components)}")
    count = particles * components
    planes = _inflate(data, count)
    if planes is None:
        raise Error(f"{len(data)} bytes are no packed array of {particles} particles with {components} components")
    zigzag = np.zeros(count, np.uint32)
    for index, plane in enumerate(planes):
        zigzag |= plane.astype(np.uint32) << np.uint32(8 * index)
    sign = -(zigzag & np.uint32(1)).astype(np.int32)
    differences = (zigzag >> np.uint32(1)).astype(np.int32) ^ sign
    sums = np.cumsum(differences.reshape(components, particles), axis=1, dtype=np.int32).T
    numbers = np.ascontiguousarray(sums if base is None else sums + base)
    far = (numbers <= -LIMIT) | (numbers >= LIMIT)
    if far.any():
        raise Error(f"number {int(np.argmax(far.reshape(-1)))} of a packed array is 2^23 steps or more from 0")
    return numbers


def _inflate(data: bytes, count: int) -> NDArray[Any] | None:
    """The planes (1 to 4, count) of a packed array of `count` numbers; None where the bytes hold none."""
    if count == 0:
        return None if data else np.zeros((0, 0), np.uint8)
    inflate = zlib.decompressobj(-zlib.MAX_WBITS)
    try:
        planes = inflate.decompress(data, _MAX_PLANES * count + 1)
    except zlib.error:
        return None
    if not inflate.eof or inflate.unused_data or not planes or len(planes) % count:
        return None
    return np.frombuffer(planes, np.uint8).reshape(-1, count)


def _check_step(step: float) -> None:
    mantissa, exponent = math.frexp(step)
    if mantissa != 0.5 or not LEAST_EXPONENT <= exponent - 1 <= GREATEST_EXPONENT:
        raise Error(f"a step of {step!r} is no power of two from 2^{LEAST_EXPONENT} to 2^{GREATEST_EXPONENT}")
