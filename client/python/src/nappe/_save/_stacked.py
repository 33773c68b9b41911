"""Frames of a session, stacked into arrays: what a trajectory holds.

Enters: what a session is made of, and its frames. Leaves: numpy arrays.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nappe._wire._arrays import Array, Arrays, BodyArrays
from nappe._wire._diagnostics import diagnostics_array, diagnostics_table
from nappe._wire._poses import FramePoses
from nappe._wire._reports import Diagnostics
from nappe._wire._topology import Topology
from nappe._wire._values import SessionEnd, SessionInfo


@dataclass(frozen=True, eq=False, repr=False)
class StackedFrames(Arrays):
    """Frames of a session in the order of time. Arrays are stacked: the first axis is the frame."""

    info: SessionInfo
    """The session, as of its last answer."""
    topology: Topology
    """Bodies, triangles, pins, colliders, which never change."""
    number: NDArray[np.uint64]
    """Number of each frame in its session (frames,)."""
    step: NDArray[np.uint64]
    """Steps taken before each frame (frames,)."""
    time: NDArray[np.float64]
    """Simulated time of each frame (frames,) (s)."""
    state_hash: tuple[str | None, ...]
    """Hash of the state of each frame, on which all further steps depend, 16 hexadecimal digits; None where a frame
    carries none."""
    arrays: dict[str, Array]
    """What was kept, under its name: (frames, particles, 3) or (frames, particles)."""
    steps: tuple[Diagnostics | None, ...]
    """Diagnostics of the step that made each frame; None where there are none."""
    end: SessionEnd | None = None
    """How the session finished; None if it goes on."""
    scene: str | None = None
    """Text of the scene, if it is known."""
    poses: tuple[FramePoses, ...] = ()
    """Where the colliders are in each frame that keys or calls move, as `Frame.poses` has it."""

    @cached_property
    def diagnostics(self) -> NDArray[np.void]:
        """Diagnostics as a structured array (frames,): `diagnostics["kinetic_energy"]`, `diagnostics["snow_mass"]`.

        Absent numbers are nan, absent words are "".
        """
        return diagnostics_array(self.steps)

    def table(self) -> dict[str, NDArray[Any]]:
        """A row per frame, as flat columns by their names: `pandas.DataFrame(trajectory.table())`.

        `step`, `time_seconds`, `frame` and `state_hash` of the frame, then what its step reported, as
        `DiagnosticsStream.table` has it. The hash of a frame that carries none is "".
        """
        table: dict[str, NDArray[Any]] = {
            "step": self.step.astype(np.int64),
            "time_seconds": self.time.copy(),
            "frame": self.number.astype(np.int64),
            "state_hash": np.array([value or "" for value in self.state_hash], "<U16"),
        }
        return table | {name: values for name, values in diagnostics_table(self.steps).items() if name not in table}

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays over the particles."""
        return sum(array.nbytes for array in self.arrays.values())

    def body(self, name: str) -> BodyArrays:
        """The arrays of one body, as views."""
        return BodyArrays(self.topology.body(name), self.arrays)

    def __len__(self) -> int:
        """How many frames there are."""
        return len(self.number)
