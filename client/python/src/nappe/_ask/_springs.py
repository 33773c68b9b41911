"""Springs of a mesh as a table of text, and the PLY of the mesh with them.

Enters: the bytes of a PLY without edges, and those of a table. Leaves: the bytes of one PLY that holds both.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from nappe._wire._errors import Refused, refused

_COLUMNS = ("particle_a", "particle_b", "stiffness", "damping", "rest_length", "kind")
_NEEDED = _COLUMNS[:3]
_KINDS = ("stretch", "shear", "bend")
_MOST_SPRINGS = 40_000_000
_MOST_PAIRS = 65_534

_PROPERTIES = (
    ("uint", "vertex1", "u4"),
    ("uint", "vertex2", "u4"),
    ("double", "stiffness", "f8"),
    ("double", "damping", "f8"),
    ("double", "rest_length", "f8"),
    ("uchar", "kind", "u1"),
)
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}

_Spring = tuple[int, int, float, float, float, int]


@dataclass(frozen=True)
class _Value:
    """A value of a line, and the column at which it begins, from 1."""

    text: str
    column: int


_ABSENT = _Value("", 1)


@dataclass(frozen=True)
class _Line:
    """A line of a table, from 1."""

    file: str
    number: int
    text: str

    def error(self, column: int, message: str) -> Refused:
        return refused(f"{self.file}:{self.number}:{column}: {message}", "scene")

    def values(self) -> list[_Value]:
        """What stands between commas, without the blanks around it."""
        found, column = [], 1
        for raw in self.text.split(","):
            found.append(_Value(raw.strip(), column + len(raw) - len(raw.lstrip())))
            column += len(raw) + 1
        return found


def with_springs(ply: bytes, name: str, table: bytes, file: str) -> bytes:
    """A PLY, called `name` in messages, with the springs of a table, called `file`, as its element `edge`."""
    newline = b"\r\n" if ply.startswith(b"ply\r\n") else b"\n"
    head, end, body = ply.partition(newline + b"end_header" + newline)
    if not ply.startswith(b"ply" + newline) or not end:
        raise refused(f"{name} is no PLY: it does not begin with 'ply', or has no line 'end_header'", "scene")
    words = [line.split() for line in head.decode("latin-1").splitlines()]
    encoding = next((line[1] for line in words if len(line) == 3 and line[0] == "format"), "none")
    counts = {line[1]: line[2] for line in words if len(line) == 3 and line[0] == "element"}
    if "edge" in counts:
        told = f"{name} has edges of its own; allowed beside a table of springs: a PLY without"
        remedy = "`nappe mesh springs MESH TABLE --out FILE.ply` puts those of the table in their place"
        raise refused(f"{told}. {remedy}", "scene")
    if encoding not in (*_ORDERS, "ascii"):
        told = f"{name} has the format {encoding}; allowed: ascii, {', '.join(_ORDERS)}"
        raise refused(told, "scene")
    if not counts.get("vertex", "").isdecimal():
        raise refused(f"{name} announces no points: a PLY has them as the element vertex", "scene")

    springs = read_springs(table, file, int(counts["vertex"]))
    lines = [f"element edge {len(springs)}", *(f"property {kind} {name}" for kind, name, _ in _PROPERTIES)]
    announced = newline.join(line.encode() for line in ("", *lines))
    if encoding == "ascii":
        text = "".join(f"{a} {b} {k!r} {damping!r} {length!r} {kind}\n" for a, b, k, damping, length, kind in springs)
        body = body if not body or body.endswith((b"\n", b"\r")) else body + newline
        return head + announced + end + body + text.encode().replace(b"\n", newline)
    order = _ORDERS[encoding]
    rows = np.array(springs, [(name, order + number) for _, name, number in _PROPERTIES])
    return head + announced + end + body + rows.tobytes()


def read_springs(table: bytes, file: str, points: int) -> list[_Spring]:
    """The springs of a mesh of so many points: both particles, stiffness, damping, rest length (NaN: as the mesh lies),
    and the number of the kind."""
    lines = _lines(table, file)
    header = next(lines, None)
    if header is None:
        message = f"is empty; allowed: a line such as {','.join(_COLUMNS)}, and a line for each spring"
        raise refused(f"{file}:1: {message}", "scene")
    columns = _columns(header)
    springs: list[_Spring] = []
    first: dict[tuple[int, int], int] = {}
    pairs: set[tuple[int, float, float]] = set()
    for line in lines:
        if len(springs) == _MOST_SPRINGS:
            raise line.error(1, f"has more than {_MOST_SPRINGS} springs; allowed: {_MOST_SPRINGS}")
        spring = _spring(line, columns, points)
        a, b, stiffness, damping, _, kind = spring
        before = first.setdefault((min(a, b), max(a, b)), line.number)
        if before != line.number:
            told = f"joins the points {a} and {b}, as line {before} does; allowed: one spring between two points"
            raise line.error(1, told)
        pairs.add((kind, stiffness, damping))
        if len(pairs) > _MOST_PAIRS:
            told = f"has one more pair of stiffness and damping than the {_MOST_PAIRS} before"
            raise line.error(1, f"{told}; allowed: {_MOST_PAIRS} different pairs in a cloth")
        springs.append(spring)
    if not springs:
        raise header.error(1, "names columns, and no springs follow; allowed: a line for each spring, one at least")
    return springs


def _lines(table: bytes, file: str) -> Iterator[_Line]:
    """Lines that are not blank."""
    try:
        text = table.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        at = table.count(b"\n", 0, error.start) + 1
        raise refused(f"{file}:{at}: is no text in UTF-8; allowed: a table of springs", "scene") from None
    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), 1):
        if line.strip():
            yield _Line(file, number, line)


def _columns(header: _Line) -> list[str]:
    """The columns of a table, in its order."""
    if "," not in header.text and re.search(r"[;\t]", header.text):
        told = "has other marks than commas between its values; allowed: commas, and points within numbers"
        raise header.error(1, told)
    columns: list[str] = []
    for value in header.values():
        if value.text not in _COLUMNS:
            told = f"has no meaning for a column '{value.text[:40]}'; allowed: {', '.join(_COLUMNS)}"
            raise header.error(value.column, told)
        if value.text in columns:
            raise header.error(value.column, f"has the column '{value.text}' a second time; allowed: once")
        columns.append(value.text)
    for name in _NEEDED:
        if name not in columns:
            raise header.error(1, f"has no column '{name}'; needed: {', '.join(_NEEDED)}")
    return columns


def _spring(line: _Line, columns: list[str], points: int) -> _Spring:
    values = line.values()
    if len(values) != len(columns):
        raise line.error(1, f"has {len(values)} values; allowed: {len(columns)}, one for each column")
    by_name = dict(zip(columns, values, strict=True))
    a, b = (_point(line, by_name[name], points) for name in _COLUMNS[:2])
    if a == b:
        raise line.error(by_name["particle_b"].column, f"joins point {a} to itself; allowed: two points")
    kind = by_name.get("kind", _ABSENT)
    if kind.text not in ("", *_KINDS):
        raise line.error(kind.column, f"is of the kind '{kind.text[:40]}'; allowed: {', '.join(_KINDS)}")
    stiffness = _number(line, by_name, "stiffness", None)
    damping = _number(line, by_name, "damping", 0.0)
    length = _number(line, by_name, "rest_length", math.nan)
    return a, b, stiffness, damping, length, _KINDS.index(kind.text) if kind.text else 0


def _point(line: _Line, value: _Value, points: int) -> int:
    """The index of a point, below `points`."""
    if not re.fullmatch(r"\+?[0-9]{1,10}", value.text) or int(value.text) >= points:
        allowed = f"0 to {points - 1}, the points of the mesh" if points else "none, there are no points"
        raise line.error(value.column, f"names point '{value.text[:40]}'; allowed: {allowed}")
    return int(value.text)


def _number(line: _Line, values: Mapping[str, _Value], name: str, absent: float | None) -> float:
    """A number of a spring; where nothing is written, that which is `absent`, if one may be."""
    value = values.get(name, _ABSENT)
    if not value.text and absent is not None:
        return absent
    try:
        number = math.inf if "_" in value.text else float(value.text)
    except ValueError:
        told = f"has '{value.text[:40]}'; allowed: a number, with a point for fractions"
        raise line.error(value.column, told) from None
    is_length = name == "rest_length"
    if is_length and math.isnan(number):
        return number
    if not math.isfinite(number) or number < 0.0 or (is_length and number == 0.0):
        allowed = "a finite number above 0, or none: as the mesh lies" if is_length else "a finite number, 0 or more"
        raise line.error(value.column, f"has the {name.replace('_', ' ')} {value.text[:40]}; allowed: {allowed}")
    return number
