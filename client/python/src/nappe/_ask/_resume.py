"""What to ask a stream for next: from where it stands, after the connection broke, and until when.

Enters: messages and errors of a stream. Leaves: frames, diagnostics or changes of state, requests, seconds to wait.
Nothing here calls or sleeps.
"""

from __future__ import annotations

import logging
import random
from collections.abc import Sequence
from typing import Any, Generic, TypeVar

from nappe._ask import _requests as requests
from nappe._ask._checks import finite, whole
from nappe._wire._contract import MESSAGES, Message, number
from nappe._wire._errors import Error, Expired, NotFound, TooSlow, refused
from nappe._wire._frames import Frame, FrameJoiner
from nappe._wire._reading import read
from nappe._wire._reports import Diagnostics
from nappe._wire._topology import Topology, TopologyJoiner
from nappe._wire._values import Change, SessionEnd

T = TypeVar("T")

_log = logging.getLogger("nappe")
_EVERY = number("Delivery", "DELIVERY_EVERY")
_LATEST = number("Delivery", "DELIVERY_LATEST")
_FIRST_WAIT, _LONGEST_WAIT = 0.1, 5.0


class Patience:
    """How long a broken stream is asked for again: waits double, and each is drawn from half of that to all of it."""

    def __init__(self, seconds: float) -> None:
        """Gives up when a stream has been broken for so many seconds; 0: at once."""
        self._seconds = finite(seconds, "patience")
        self._broken_since: float | None = None
        self._failures = 0

    def arrived(self) -> None:
        """A message came: the connection is good."""
        self._broken_since, self._failures = None, 0

    def wait(self, now: float, draw: float | None = None) -> float | None:
        """Seconds to wait before the next attempt, or None to give up; `now` is a monotonic clock (s)."""
        if self._broken_since is None:
            self._broken_since = now
        self._failures += 1
        left = self._seconds - (now - self._broken_since)
        if left <= 0:
            return None
        longest = min(_FIRST_WAIT * 2.0 ** min(self._failures - 1, 16), _LONGEST_WAIT)
        drawn = random.random() if draw is None else draw
        return min(longest * (0.5 + 0.5 * drawn), left)


class Reader(Generic[T]):
    """Reads one stream: what to ask for, what a message brings, what to do about an error."""

    method = ""

    def __init__(self, ids: tuple[str, str], *, every: bool, start: int | None, rate: float | None, patience: float):
        """Checks what the caller wants of a session, given by its id and uid."""
        if rate is not None and every:
            raise refused("rate goes with the newest frames; every frame comes as it is made", "rate")
        if start is not None and not every:
            raise refused("start goes with every=True; the newest frame is the first otherwise", "start")
        self._ids = ids
        self.every = every
        """Whether every frame comes, and not the newest alone."""
        self._rate = 0.0 if rate is None else finite(rate, "rate")
        if self._rate < 0:
            raise refused(f"rate is {rate!r}; allowed: frames per second, or 0 for no limit", "rate")
        self._next = whole(start, "start") if start is not None else 0
        # Where the caller named no first frame, the oldest that is kept will do.
        self._seeks = every and start is None
        self._patience = Patience(patience)
        self._cause: Error | None = None
        self.reconnects = 0
        self.end: SessionEnd | None = None

    def request(self) -> Message:
        """The request, from where the stream stands."""
        session_id, uid = self._ids
        delivery = _EVERY if self.every else _LATEST
        message = MESSAGES[f"{self.method}Request"](
            session_id=session_id, session_uid=uid, delivery=delivery, max_rate_hz=self._rate
        )
        if self.every:
            message.from_frame = self._next
        return message

    def take(self, message: Message) -> T | None:
        """What a message brings; nothing when it is a piece of a frame, or not what the stream is for."""
        self._patience.arrived()
        if self._cause is not None:
            self.reconnects += 1
            _log.warning("the stream of session %s broke and is back: %s", self._ids[0], self._cause.message)
            self._cause = None
        event = message.WhichOneof("event")
        if event is None:  # an event of a newer server
            return None
        body = getattr(message, event)
        if event == "end":
            self.end = read(SessionEnd, body)
            return None
        return self._read(event, body, message)

    def failed(self, error: Error, now: float) -> float:
        """Seconds to wait before the stream is asked for again. Raises the error if that would not help."""
        if self._seeks and isinstance(error, (Expired, TooSlow)):
            oldest = error.oldest_frame
            if oldest is not None and oldest > self._next:
                _log.warning("frames %d to %d of session %s are no longer kept", self._next, oldest - 1, self._ids[0])
                self._next = oldest
                return 0.0
        if not error.is_transient:
            raise error
        wait = self._patience.wait(now)
        if wait is None:
            raise error
        self._cause = error
        return wait

    def over(self) -> None:
        """The stream stopped without an error: an error, unless the session ended."""
        if self.end is None:
            raise NotFound(f"the stream of session {self._ids[0]!r} stopped without its end")

    def numbered(self, frame: int) -> None:
        """A frame came: the next one is asked for where the stream breaks."""
        if self.every and frame != self._next:
            raise Error(f"frame {frame} of session {self._ids[0]!r} came where {self._next} was next")
        self._next, self._seeks = frame + 1, False

    def _read(self, event: str, body: Message, message: Message) -> T | None:
        raise NotImplementedError


class FrameReader(Reader[Frame]):
    """Reads frames."""

    method = "WatchFrames"

    def __init__(
        self,
        ids: tuple[str, str],
        *,
        fields: Sequence[str],
        precision: str,
        grid: str | None,
        paced: bool,
        **which: Any,
    ) -> None:
        """Checks which arrays and nodes the caller wants."""
        super().__init__(ids, **which)
        self._fields = requests.field_numbers(fields)
        self._encoding = requests.encoding(precision)
        self._grid = requests.grid_request(grid)
        self._paced = paced
        self._names = requests.field_names(fields)
        if self._grid is not None and "force" in self._names:
            self._grid.force = True
        self._topologies = TopologyJoiner()
        self._topology: Topology | None = None
        self.frames = FrameJoiner()

    def request(self) -> Message:
        """The request, from where the stream stands."""
        message = super().request()
        message.fields.extend(self._fields)
        message.encoding = self._encoding
        message.pace_to_watcher = self._paced and self.every
        if self._grid is not None:
            message.grid.CopyFrom(self._grid)
        return message

    def _read(self, event: str, body: Message, message: Message) -> Frame | None:
        if event == "topology":
            self._ids = (self._ids[0], body.session_uid)
            whole = self._topologies.add(body)
            if whole is not None and (self._topology is None or self._topology.packed != whole.packed):
                self._topology = whole
            self.frames.begin(None if whole is None else self._topology)
            return None
        if event != "frame":
            return None
        frame = self.frames.add(body)
        if frame is not None:
            for name in self._names:
                if name not in frame.fields and frame.topology.particle_count:
                    raise Error(f"the server's stream does not decode: frame {frame.number}: it has no {name}")
            self.numbered(frame.number)
        return frame


class DiagnosticsReader(Reader[Diagnostics]):
    """Reads the diagnostics of frames."""

    method = "WatchDiagnostics"

    def _read(self, event: str, body: Message, message: Message) -> Diagnostics | None:
        if event != "diagnostics":
            return None
        self.numbered(body.frame)
        return read(Diagnostics, body)


class ChangeReader(Reader[Change]):
    """Reads changes of state."""

    method = "WatchDiagnostics"

    def _read(self, event: str, body: Message, message: Message) -> Change | None:
        return read(Change, body) if event == "change" else None
