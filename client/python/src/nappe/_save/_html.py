"""An HTML recording: one file that any browser opens, without a server; the page, and the frames that it shows.

Enters: a trajectory. Leaves: the text of the file, which has the structure that docs/frames.md describes and that the
command's `--save FILE.html` writes.
"""

from __future__ import annotations

import base64
import html
import json
import math
from collections.abc import Iterator
from importlib import metadata
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nappe._save._stacked import StackedFrames
from nappe._wire._colliders import Collider
from nappe._wire._errors import REASONS, Error, refused
from nappe._wire._files import packed_bytes
from nappe._wire._packed import GREATEST_EXPONENT, LIMIT, OutOfReachError, pack, quantize, step_within
from nappe._wire._poses import FramePoses
from nappe._wire._reports import Diagnostics
from nappe._wire._topology import Body
from nappe._wire._values import Failure

BLOCK_FRAMES = 32
"""Frames of a whole block."""

# The extent of the first frame over the error that is allowed where nobody said one.
_FINENESS = 16_384.0
# The error that is allowed where the first frame has no extent (m).
_ERROR_OF_A_POINT = 1e-4
# Below this, stress has the colour of none (Pa): its logarithm is packed.
_LEAST_STRESS = np.float32(1.0)
# How finely each colour's numbers are kept: finer than the eye tells colours apart. J_P, m/s, decades of Pa.
_SCALAR_STEPS = {"plastic_ratio": 2.0**-9, "speed": 2.0**-7, "stress": 2.0**-9}
# The array that each colour needs.
_ARRAYS = {"plastic_ratio": "plastic_ratio", "speed": "velocities", "stress": "stress", "body": "positions"}

Json = dict[str, Any]


def recording(trajectory: StackedFrames, color: str | None = None, max_error: float | None = None) -> str:
    """The text of an HTML file that shows a trajectory.

    `color`: what the colour of snow shows, `plastic_ratio`, `speed`, `stress`, or `body` for one colour per body. By
    default the plastic ratio, if there is snow and it was kept.
    `max_error`: how far a coordinate may be from what it was (m); by default the extent of the first frame over 16384.
    """
    shown = _color(trajectory, color)
    step = _step(trajectory, max_error)
    parts = [packed_bytes("replay.html").decode("utf-8"), _element("nappe-head", _head(trajectory, shown, step))]
    parts += [_element("nappe-block", block) for block in _blocks(trajectory, shown, step)]
    parts.append(_element("nappe-end", _end(trajectory)))
    return "".join(parts)


class Page:
    """A recording as a notebook shows it, with all of its frames: it needs no server, not even when opened later."""

    def __init__(self, text: str, height: int) -> None:
        """`text`: an HTML recording. `height`: how tall it is shown (CSS pixels)."""
        if height < 1:
            raise refused(f"height is {height}; allowed: 1 and more, in pixels", "height")
        self.text = text
        """The whole recording, as a file would hold it."""
        self.height = height
        """How tall it is shown (CSS pixels)."""

    def _repr_html_(self) -> str:
        # Scripts may run, the help's form may close it, files may be saved, and nothing of the notebook is in reach.
        return (
            f'<iframe srcdoc="{html.escape(self.text, quote=True)}" '
            f'sandbox="allow-scripts allow-forms allow-downloads" allow="fullscreen" '
            f'style="width: 100%; height: {self.height}px; border: 0"></iframe>'
        )

    def __repr__(self) -> str:
        """How large it is."""
        return f"<nappe page of {len(self.text) / 1e6:.1f} MB: a notebook shows it>"


def _color(trajectory: StackedFrames, color: str | None) -> str | None:
    """The colour that is shown; None for one colour per body."""
    if color is None:
        has_ratio = trajectory.info.snow_particle_count > 0 and "plastic_ratio" in trajectory.arrays
        return "plastic_ratio" if has_ratio else None
    if color not in _ARRAYS:
        raise refused(f"color is {color!r}; allowed: {', '.join(map(repr, _ARRAYS))}", "color")
    needed = _ARRAYS[color]
    if needed not in trajectory.arrays:
        raise refused(
            f"color={color!r} shows {needed}, which this trajectory has not: record it, fields=({needed!r}, ...)",
            "color",
        )
    return None if color == "body" else color


def _step(trajectory: StackedFrames, max_error: float | None) -> float:
    """The step of the positions of the first block (m)."""
    if max_error is not None:
        try:
            return step_within(max_error)
        except Error:
            raise refused(f"max_error is {max_error!r}; allowed: a number above 0 (m)", "max_error") from None
    positions = trajectory.positions
    extent = 0.0
    if len(positions) and positions.shape[1]:
        first = positions[0].astype(np.float32).astype(np.float64)
        extent = float(np.max(first.max(axis=0) - first.min(axis=0)))
    return step_within(extent / _FINENESS if extent > 0.0 else _ERROR_OF_A_POINT)


def _head(trajectory: StackedFrames, color: str | None, step: float) -> Json:
    info, topology = trajectory.info, trajectory.topology
    if topology.particle_count >= LIMIT:
        raise Error(f"{topology.particle_count} particles are too many for an HTML file, which holds less than {LIMIT}")
    return {
        "format": 1,
        "program": _program(),
        "title": info.title or info.session_id,
        "scene": trajectory.scene,
        "particles": topology.particle_count,
        "dt_seconds": info.dt_seconds,
        "precision": info.precision,
        "bound": step / 2,
        "color": color,
        "bodies": [_body(body) for body in topology.bodies],
        "colliders": [_collider(collider) for collider in topology.colliders],
    }


def _program() -> str:
    try:
        return f"nappe (Python) {metadata.version('nappe')}"
    except metadata.PackageNotFoundError:
        return "nappe (Python)"


def _body(body: Body) -> Json:
    return {
        "name": body.name,
        "first_particle": body.first_particle,
        "particle_count": body.particle_count,
        "triangles": _indices(body.triangles),
        "springs": _indices(body.springs),
        "pins": body.pins.tolist(),
        "color": body.color,
    }


def _indices(elements: NDArray[np.uint32]) -> Json | None:
    """Indices as a packed array, a triangle or a spring in place of a particle; None where there are none."""
    if len(elements) == 0:
        return None
    return {"count": len(elements), "data": _packed(elements.astype(np.int32), None)}


def _collider(collider: Collider) -> Json:
    shape: Json = dict(collider.shape)
    if collider.kind == "mesh":
        points = np.asarray(shape["points"], "<f4").tobytes()
        shape |= {"points": base64.b64encode(points).decode("ascii"), "triangles": _indices(shape["triangles"])}
    return {
        "name": collider.name,
        "velocity": collider.velocity,
        "shape": {"kind": collider.kind, **shape},
    }


def _blocks(trajectory: StackedFrames, color: str | None, step: float) -> Iterator[Json]:
    """Blocks in order. From the frame on in which a particle is out of reach, their step is larger."""
    frames: list[Json] = []
    before: NDArray[np.int32] | None = None
    scalar_before: NDArray[np.int32] | None = None
    for index in range(len(trajectory)):
        numbers, needed = _quantized(trajectory.positions[index], step)
        if frames and (needed != step or len(frames) == BLOCK_FRAMES):
            yield _block(frames, color, step)
            frames, before, scalar_before = [], None, None
        step = needed
        scalars = None if color is None else _scalars(trajectory, color, index)
        frames.append(
            {
                "frame": int(trajectory.number[index]),
                "step": int(trajectory.step[index]),
                "time": float(trajectory.time[index]),
                "positions": _packed(numbers, before),
                "scalar": None if scalars is None else _packed(scalars, scalar_before),
                "poses": _poses(trajectory.poses[index]) if trajectory.poses else None,
                **_plotted(trajectory.steps[index]),
            }
        )
        before, scalar_before = numbers, scalars
    if frames:
        yield _block(frames, color, step)


def _block(frames: list[Json], color: str | None, step: float) -> Json:
    scalar_step = None if color is None else _SCALAR_STEPS[color]
    return {"step": step, "bound": step / 2, "scalar_step": scalar_step, "frames": frames}


def _quantized(positions: NDArray[Any], step: float) -> tuple[NDArray[np.int32], float]:
    """Whole numbers of the smallest step, `step` (m) or larger, that reaches all positions; and that step."""
    while True:
        try:
            return quantize(positions, step), step
        except OutOfReachError:
            if step >= 2.0**GREATEST_EXPONENT:
                raise Error("a particle is farther away than an HTML file can hold") from None
            step *= 2.0


def _scalars(trajectory: StackedFrames, color: str, index: int) -> NDArray[np.int32]:
    """What the colour shows of a frame, as whole numbers (particles, 1); beyond their reach, as the farthest."""
    with np.errstate(over="ignore", invalid="ignore"):
        values = trajectory.arrays[_ARRAYS[color]][index].astype(np.float32)
        if color == "speed":
            values = np.sqrt((values * values).sum(axis=1))
        elif color == "stress":
            values = np.log10(np.maximum(values, _LEAST_STRESS))
    step = _SCALAR_STEPS[color]
    farthest = np.float32(step * (1 << 22))
    near = np.where(np.isnan(values), np.float32(0.0), np.clip(values, -farthest, farthest))
    return quantize(near.reshape(-1, 1), step)


def _poses(poses: FramePoses) -> list[Json] | None:
    """Where colliders are that keys or calls move; None if there are none."""
    return [{"name": name, "position": place, "turn": turn} for name, (place, turn) in poses.items()] or None


def _plotted(step: Diagnostics | None) -> Json:
    """What the page plots of a step; None for what there is not."""
    if step is None:
        return dict.fromkeys(("kinetic", "elastic", "gravitational", "stretch", "dt"))
    lengths = [part.dt_seconds for part in (step.cloth, step.snow) if part is not None and part.dt_seconds > 0.0]
    numbers = {
        "kinetic": step.kinetic_energy,
        "elastic": step.elastic_energy,
        "gravitational": step.gravitational_energy,
        "stretch": step.max_stretch if step.max_stretch > 0.0 else None,
        "dt": min(lengths, default=None),
    }
    return {name: number if number is not None and math.isfinite(number) else None for name, number in numbers.items()}


def _end(trajectory: StackedFrames) -> Json:
    end = trajectory.end
    last = int(trajectory.step[-1]) if len(trajectory) else 0
    told: Json = {
        "frames": len(trajectory),
        "steps": last if end is None else end.step,
        "hash": None if end is None else end.state_hash,
        "finished": end is not None,
    }
    failure = trajectory.info.failure
    # Frames that end before the failure do not show it.
    if failure and len(trajectory) and int(trajectory.number[-1]) == trajectory.info.frame:
        told["failure"] = _failure(failure)
    return told


def _failure(failure: Failure) -> Json:
    reason = REASONS.get(failure.reason)
    return {
        "reason": failure.reason,
        "message": failure.message,
        "diverged": reason is not None and reason.is_divergence,
        "step": failure.step,
        "time": failure.time_seconds,
        "particle": failure.particle,
        "value": failure.value if failure.value is not None and math.isfinite(failure.value) else None,
    }


def _packed(numbers: NDArray[np.int32], base: NDArray[np.int32] | None) -> str:
    return base64.b64encode(pack(numbers, base)).decode("ascii")


def _element(name: str, value: Json) -> str:
    """An element of data. No text within can end it."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return f'<script type="application/json" class="{name}">{text}</script>\n'
