"""Packed arrays: golden vectors, random numbers, bounds, and bytes that hold none."""

from __future__ import annotations

import json
import tracemalloc
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nappe._wire._errors import Error, Refused
from nappe._wire._packed import OutOfReachError, pack, quantize, restore, step_within, unpack

GOLDEN = sorted((Path(__file__).parents[3] / "proto/tests/packed").glob("*.json"))


def test_there_are_golden_vectors() -> None:
    assert len(GOLDEN) >= 9


@pytest.mark.parametrize("path", GOLDEN, ids=lambda path: path.stem)
def test_golden_vectors_have_the_same_bits_here(path: Path) -> None:
    golden = json.loads(path.read_text())
    shape = golden["particles"], golden["components"]
    base = None if golden["base"] is None else np.array(golden["base"], np.int32).reshape(shape)
    numbers = unpack(bytes.fromhex(golden["bytes"]), *shape, base)
    assert numbers.dtype == np.int32
    assert numbers.ravel().tolist() == golden["numbers"]
    restored = restore(numbers, golden["step"])
    assert restored.dtype == np.float32
    assert restored.ravel().tolist() == np.array(golden["restored"], np.float32).tolist()
    values = np.array(golden["values"], np.float32).reshape(shape)
    assert np.array_equal(quantize(values, golden["step"]), numbers)
    # Before deflate the bytes are the same too: as many planes, and the same ones.
    again = pack(numbers, base)
    assert np.array_equal(unpack(again, *shape, base), numbers)
    if values.size:
        assert zlib.decompress(again, -15) == zlib.decompress(bytes.fromhex(golden["bytes"]), -15)


@pytest.mark.parametrize("bits", [1, 6, 7, 14, 15, 22, 23])
@pytest.mark.parametrize("shape", [(1, 1), (1, 3), (57, 1), (40, 2), (33, 3)])
def test_random_numbers_come_back(bits: int, shape: tuple[int, int]) -> None:
    random = np.random.default_rng(bits)
    numbers, base = (random.integers(1 - 2**bits, 2**bits, shape, dtype=np.int32) for _ in range(2))
    assert np.array_equal(unpack(pack(numbers), *shape), numbers)
    assert np.array_equal(unpack(pack(numbers, base), *shape, base), numbers)
    # A frame as arrays over the particles hold it, with components apart.
    assert pack(np.asfortranarray(numbers), base) == pack(numbers, base)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_random_values_stay_within_half_a_step(dtype: type[Any]) -> None:
    step = 2.0**-13
    values = np.random.default_rng(3).uniform(-1000.0, 1000.0, (500, 3)).astype(dtype)
    restored = restore(quantize(values, step), step)
    errors = np.abs(values.astype(np.float64) - restored)
    assert errors.max() <= step / 2
    assert errors.max() > step / 2.5, "numbers are rounded, not kept"


@pytest.mark.parametrize("far", [8_388_607.5, -8_388_608.0, 1e30, 1.7e308])
def test_a_number_out_of_reach_is_named(far: float) -> None:
    with pytest.raises(OutOfReachError, match="number 2 of the array"):
        quantize(np.array([0.0, 1.0, far, far]), 1.0)
    assert quantize(np.array([8_388_607.49, -8_388_607.49]), 1.0).tolist() == [8_388_607, -8_388_607]


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_not_packed(wrong: float) -> None:
    with pytest.raises(Error, match=r"number 1 of the array is -?(nan|inf)") as caught:
        quantize(np.array([1e30, wrong]), 1.0)
    assert not isinstance(caught.value, OutOfReachError), "no coarser step helps"


def test_a_step_within_a_bound_is_the_largest_power_of_two() -> None:
    for bound, exponent in [(0.5, 0), (0.499, -1), (1.0, 1), (6.2e-5, -13), (6.1e-5, -14), (3.0, 2)]:
        assert step_within(bound) == 2.0**exponent
    assert (step_within(2.0**-127), step_within(2.0**103)) == (2.0**-126, 2.0**104)
    for wrong in (0.0, -1.0, np.nan, np.inf, 1e-300, 1e300, 2.0**-128, 2.0**104):
        with pytest.raises(Refused):
            step_within(wrong)
    for step in (0.75, 0.0, -1.0, 2.0**105, np.nan, np.inf):
        with pytest.raises(Error, match="no power of two"):
            quantize([1.0], step)


def test_bytes_that_hold_no_array_of_the_shape_are_refused() -> None:
    numbers = np.arange(60, dtype=np.int32).reshape(20, 3)
    data = pack(numbers)
    bomb = zlib.compressobj(9, zlib.DEFLATED, -15)
    many = bomb.compress(bytes(10_000_000)) + bomb.flush()
    tracemalloc.start()
    for wrong in (b"", data[:-1], data + b"\0", b"no deflate", many, pack(numbers[:19])):
        with pytest.raises(Error, match="no packed array of 20 particles"):
            unpack(wrong, 20, 3)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000, "no more is inflated than the array can have"
    assert unpack(b"", 0, 3).shape == (0, 3)
    for broken in (
        lambda: unpack(data, 0, 3),
        lambda: unpack(data, 20, 3, numbers[:19]),
        lambda: unpack(pack(numbers + (1 << 23) - 1), 20, 3),
        lambda: pack(numbers.astype(np.int64)),  # type: ignore[arg-type]
        lambda: pack(numbers, numbers[:1]),
    ):
        with pytest.raises(Error):
            broken()
