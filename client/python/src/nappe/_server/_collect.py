"""Frames of a stream, stacked to a trajectory, whose size is known and checked from the start.

Enters: a session, what is wanted, then frames. Leaves: a Trajectory.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nappe._ask import _requests as requests
from nappe._ask._checks import whole
from nappe._save._trajectory import Trajectory
from nappe._server._properties import SessionProperties
from nappe._wire._arrays import FIELDS, Array
from nappe._wire._errors import Error, refused
from nappe._wire._frames import Frame
from nappe._wire._poses import FramePoses
from nappe._wire._reports import Diagnostics
from nappe._wire._topology import Topology
from nappe._wire._values import SessionEnd

MAX_BYTES = 2 * 2**30
"""Memory that a trajectory may take unless it is told otherwise (bytes)."""


class Collector:
    """Collects every n-th frame up to a step."""

    def __init__(
        self,
        session: SessionProperties,
        stop: int | None,
        every: int,
        fields: Sequence[str],
        precision: str,
        max_bytes: int,
    ) -> None:
        """Checks that it will end, and how much memory it takes then."""
        self._session = session
        self._every = whole(every, "every", least=1)
        requests.field_numbers(fields)
        requests.encoding(precision)
        self._names = requests.field_names(fields)
        self._number = np.dtype("<f4" if precision == "f32" else "<f8")
        limit = session.step_limit if session.state != "finished" else session.steps_taken
        if stop is None and not limit:
            raise refused(
                f"session {session.id!r} has no last step: give stop, the number of steps after which it is enough",
                "stop",
            )
        wanted = limit if stop is None else whole(stop, "stop")
        self.stop = min(wanted, limit) if limit else wanted
        # The session finishes there, and the stream says how.
        self._to_the_end = self.stop == limit
        self._allowed = whole(max_bytes, "max_bytes")
        self._capacity = self.stop // session.frame_interval_steps // self._every + 2
        self._check_size()
        self._arrays: dict[str, Array] = {}
        self._frames: list[tuple[int, int, float, str | None]] = []
        self._steps: list[Diagnostics | None] = []
        self._poses: list[FramePoses] = []
        self._topology: Topology | None = None

    def _check_size(self) -> None:
        per_particle = sum(FIELDS[name] for name in self._names) * self._number.itemsize
        per_frame = per_particle * self._session.particle_count
        needed = per_frame * self._capacity
        if needed > self._allowed:
            fit = max(self._allowed // max(per_frame, 1), 1)
            step = self.stop // self._session.frame_interval_steps // fit + 1
            raise refused(
                f"the trajectory would take {needed} bytes ({self._capacity} frames of {per_frame} bytes), and "
                f"max_bytes is {self._allowed}: a larger max_bytes, an earlier stop, or every={step} would do",
                "max_bytes",
            )

    def add(self, frame: Frame) -> bool:
        """Takes a frame; true if it is the last one that is wanted."""
        if self._topology is None:
            self._topology = frame.topology
            for name in self._names:
                shape = getattr(frame, name).shape
                self._arrays[name] = np.empty((self._capacity, *shape), self._number)
        elif self._topology is not frame.topology:
            raise Error(f"session {self._session.id!r} is made of something else from frame {frame.number} on")
        if frame.step <= self.stop and frame.number % self._every == 0 and len(self._frames) < self._capacity:
            for name, array in self._arrays.items():
                array[len(self._frames)] = getattr(frame, name)
            self._frames.append((frame.number, frame.step, frame.time, frame.state_hash))
            self._steps.append(frame.diagnostics)
            self._poses.append(frame.poses)
        return not self._to_the_end and frame.step + self._session.frame_interval_steps > self.stop

    def trajectory(self, end: SessionEnd | None) -> Trajectory:
        """What was collected."""
        if self._topology is None:
            raise Error(f"no frame of session {self._session.id!r} came")
        count = len(self._frames)
        columns = list(zip(*self._frames, strict=True)) if count else [(), (), (), ()]
        number: NDArray[np.uint64] = np.array(columns[0], np.uint64)
        return Trajectory(
            info=self._session.info,
            topology=self._topology,
            number=number,
            step=np.array(columns[1], np.uint64),
            time=np.array(columns[2], np.float64),
            state_hash=tuple(columns[3]),
            arrays={name: array[:count] for name, array in self._arrays.items()},
            steps=tuple(self._steps),
            end=end,
            scene=self._session._scene,
            poses=tuple(self._poses),
        )
