"""A frame at which a session begins: one that a server sent, or a file that was saved.

Enters: a frame, or the path of a PLY file or of a folder of them. Leaves: a mesh to send, what a request says of the
frame, and what is wrong with a session that does not begin there.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path

import numpy as np

from nappe._ask._uploads import Mesh, from_file, from_state
from nappe._wire._arrays import Array
from nappe._wire._contract import MESSAGES, Message, number
from nappe._wire._errors import Error, refused
from nappe._wire._frames import Frame

_WORDS = {number("Precision", "PRECISION_F32"): "f32", number("Precision", "PRECISION_F64"): "f64"}
# What files call the type of a coordinate.
_TYPES = {"float": ("f32",), "float32": ("f32",), "double": ("f64",), "float64": ("f64",)}
# Numbers of fewer digits have 64 bits at most.
_STEP_DIGITS = 20
_FRAME = re.compile(r"frame-(\d+)\.ply")


@dataclass(frozen=True)
class Begun:
    """A frame to begin at."""

    name: str
    """What it is called in messages."""
    mesh: Mesh
    """Its positions and velocities, to be sent."""
    step: int | None
    """Steps taken before it; None where a file does not say so."""
    time: float | None
    """Its time (s)."""
    carried: Message | None
    """What steps depend on beside positions and velocities."""
    holds: tuple[str, ...]
    """The precisions in which it is exact; none if that is not known."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is odd about it."""
        return () if self.step is not None else (f"{self.name} says no step: the clock of the scene begins at 0",)

    def message(self, upload_id: str) -> Message:
        """What a request says of it, once it was sent."""
        made = MESSAGES["Begin"](step=self.step or 0, upload_id=upload_id)
        if self.step is not None and self.time is not None:
            made.time_seconds = self.time
        if self.carried is not None:
            made.carried.CopyFrom(self.carried)
        return made

    def fault(self, session: Message) -> Error | None:
        """What is wrong with a session that was to begin at it, if anything is."""
        if self.step is not None and session.step != self.step:
            told = f"the server does not begin at step {self.step}, that of {self.name}: its version is an earlier one"
            return Error(told)
        own = _WORDS.get(session.precision)
        if own is None or not self.holds or own in self.holds:
            return None
        held = self.holds[0]
        return refused(
            f"{self.name} is in {held}, and the session is to be in {own}; allowed: a frame in {own}, "
            f"or precision={held!r}, which goes on in that of the frame",
            "begin",
        )


def read_begin(begin: Frame | str | os.PathLike[str] | None) -> Begun | None:
    """The frame that a caller gives, if any."""
    if begin is None:
        return None
    if isinstance(begin, Frame):
        return _of_frame(begin)
    if isinstance(begin, (str, os.PathLike)):
        return _of_path(Path(begin))
    allowed = "a Frame with velocities, or the path of a saved frame or of a folder of them"
    raise refused(f"begin is a {type(begin).__name__}; allowed: {allowed}", "begin")


def _of_frame(frame: Frame) -> Begun:
    name = f"frame {frame.number}"
    missing = [wanted for wanted in ("positions", "velocities") if wanted not in frame.arrays]
    if missing:
        told = f"{name} has no {missing[0]}; allowed: frames with fields=('positions', 'velocities')"
        raise refused(told, "begin")
    state = (frame.positions, frame.velocities)
    return Begun(name, from_state(*state, name), frame.step, frame.time, frame._carried, _precisions(state))


def _precisions(arrays: Iterable[Array]) -> tuple[str, ...]:
    """The precisions in which these numbers are exact."""
    wide = [array for array in arrays if array.dtype.itemsize == 8]
    if not wide:
        return ("f32",)
    with np.errstate(over="ignore"):
        is_narrow = all(np.array_equal(array.astype("<f4").astype("<f8"), array) for array in wide)
    return ("f64", "f32") if is_narrow else ("f64",)


def _of_path(path: Path) -> Begun:
    """A saved frame; of a folder, the last one."""
    if path.is_dir():
        found = [(int(match[1]), entry) for entry in path.iterdir() if (match := _FRAME.fullmatch(entry.name))]
        if not found:
            raise refused(f"the folder {path} holds no frame; allowed: one with frame-000000.ply and so on", "begin")
        path = max(found)[1]
    if path.suffix.lower() != ".ply":
        raise refused(f"{path} is no saved frame; allowed: a file that ends in .ply, or a folder of them", "begin")
    mesh = from_file(path)
    return _noted(str(path), mesh)


@dataclass
class _Notes:
    """What the header of a file says."""

    step: int | None = None
    time: float | None = None
    version: str | None = None
    numbers: list[float] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    types: dict[str, str] = field(default_factory=dict)

    def take(self, line: str) -> None:
        """A line of it."""
        match line.split():
            case ["property", kind, word]:
                self.types[word] = kind
            case ["comment", "step", value] if value.isdecimal() and len(value) < _STEP_DIGITS:
                self.step = int(value)
            case ["comment", "time_seconds", value]:
                self.time = _number(value)
            case ["comment", "nappe", *words]:
                self.version = " ".join(words)
            case ["comment", "missing", *words]:
                self.missing.append(" ".join(words))
            case ["comment", "carried", *words]:
                # A word that is no number is none that a server goes on from.
                self.numbers.extend(map(_number, words))
            case _:
                pass


def _noted(name: str, mesh: Mesh) -> Begun:
    """A file, by what its header says."""
    header, end, _ = bytes(mesh.data[0]).partition(b"end_header")
    notes = _Notes()
    for line in header.split(b"\n"):
        notes.take(line.decode("utf-8", errors="replace"))
    if notes.version is not None and _is_newer(notes.version):
        told = f"{name} was saved by nappe {notes.version}, and this is {_own_version()}"
        raise refused(f"{told}; allowed: frames of this version or an earlier one", "begin")
    # A header that was cut off says too little; the server tells what is wrong with such a file.
    if end and not {"vx", "vy", "vz"} <= notes.types.keys():
        told = f"{name} has no velocities (vx, vy, vz); allowed: frames saved with velocities, as by --fields velocity"
        raise refused(told, "begin")
    carried = None
    if notes.numbers or notes.missing:
        carried = MESSAGES["Carried"](numbers=notes.numbers, missing=notes.missing)
    return Begun(name, mesh, notes.step, notes.time, carried, _TYPES.get(notes.types.get("x", ""), ()))


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return math.nan


def _own_version() -> str | None:
    """The version of this package; None where it is not installed."""
    try:
        return metadata.version("nappe")
    except metadata.PackageNotFoundError:
        return None


def _is_newer(version: str) -> bool:
    """Whether a version is later than this one, or of a form that this one does not know."""
    theirs, own = (_parts(text) for text in (version, _own_version() or ""))
    return theirs is None or (own is not None and theirs > own)


def _parts(version: str) -> tuple[int, ...] | None:
    if re.fullmatch(r"\d+(\.\d+)*", version) is None:
        return None
    return tuple(int(part) for part in version.split("."))
