"""What is known of a session from the last answer of its server: properties that both kinds of client share."""

from __future__ import annotations

from typing import Any

from nappe._ask._requests import field_names
from nappe._wire._contract import ENUMS, Message
from nappe._wire._errors import Error, of_failure, refused
from nappe._wire._reading import hexadecimal, read, word
from nappe._wire._values import Failure, Parameters, SessionInfo

SCALARS_OF_SNOW = ("plastic_ratio", "stress")
"""Arrays that say something of snow alone."""


# Uids of the sessions that this process made.
_MADE_HERE: set[str] = set()


class SessionProperties:
    """A session as of the last answer of its server; `refresh()` asks again."""

    def __init__(self, raw: Message, scene: str | None = None, *, made_here: bool = False, warnings: Any = ()) -> None:
        """A session from the message that describes it."""
        self._raw = raw
        self._scene = scene
        if made_here:
            _MADE_HERE.add(raw.uid)
        self._info: SessionInfo | None = None
        self._is_deleted = False
        self.warnings: tuple[str, ...] = tuple(warnings)
        """What is odd about its scene but does not stop a simulation; told when it is created."""

    def _told(self, raw: Message) -> None:
        self._raw, self._info = raw, None

    @property
    def _made_here(self) -> bool:
        return self._raw.uid in _MADE_HERE

    @property
    def _ids(self) -> tuple[str, str]:
        return (self._raw.session_id, self._raw.uid)

    @property
    def info(self) -> SessionInfo:
        """All that the server said of the session, as one value."""
        if self._info is None:
            self._info = read(SessionInfo, self._raw)
        return self._info

    @property
    def id(self) -> str:
        """Its name among the sessions of the server."""
        return str(self._raw.session_id)

    @property
    def uid(self) -> str:
        """A UUID that no other session ever has, not even a later one with the same id."""
        return str(self._raw.uid)

    @property
    def title(self) -> str:
        """Title of the scene."""
        return str(self._raw.title)

    @property
    def state(self) -> str:
        """What the session was doing: `paused`, `playing`, `finished` or `failed`."""
        return word(ENUMS["SessionState"], self._raw.state)

    @property
    def failure(self) -> Failure | None:
        """Why the session failed; None unless it did."""
        return self.info.failure

    @property
    def error(self) -> Error | None:
        """The failure as the error that frames of the session end with; None unless it failed."""
        return of_failure(self._raw.failure) if self._raw.HasField("failure") else None

    @property
    def steps_taken(self) -> int:
        """Steps taken since the initial state; `step` of the contract."""
        return int(self._raw.step)

    @property
    def time_seconds(self) -> float:
        """Simulated time (s)."""
        return float(self._raw.time_seconds)

    @property
    def frame(self) -> int:
        """Number of the newest frame."""
        return int(self._raw.frame)

    @property
    def oldest_frame(self) -> int:
        """Number of the oldest frame that a reader can still start from."""
        return int(self._raw.oldest_frame)

    @property
    def dt_seconds(self) -> float:
        """Time step (s)."""
        return float(self._raw.dt_seconds)

    @property
    def step_limit(self) -> int:
        """The session ends after this many steps. 0: never by itself."""
        return int(self._raw.step_limit)

    @property
    def frame_interval_steps(self) -> int:
        """Steps between frames, at least 1."""
        return int(self._raw.frame_interval_steps)

    @property
    def precision(self) -> str:
        """Precision of positions and velocities on the server: `f32` or `f64`."""
        return word(ENUMS["Precision"], self._raw.precision)

    @property
    def thread_count(self) -> int:
        """Threads that step the session."""
        return int(self._raw.thread_count)

    @property
    def particle_count(self) -> int:
        """Particles of cloth and snow together."""
        return int(self._raw.particle_count)

    @property
    def snow_particle_count(self) -> int:
        """Particles of snow; they are the last ones."""
        return int(self._raw.snow_particle_count)

    @property
    def spring_count(self) -> int:
        """Springs of all cloths together."""
        return int(self._raw.spring_count)

    @property
    def watcher_count(self) -> int:
        """Streams that watched the session."""
        return int(self._raw.watcher_count)

    @property
    def state_hash(self) -> str | None:
        """Hash of the state at `step`, 16 hexadecimal digits; None while the session is playing."""
        return hexadecimal(self._raw.state_hash) if self._raw.HasField("state_hash") else None

    @property
    def parameters(self) -> Parameters | None:
        """Parameters of the newest step; changes that wait for their step are not in them."""
        return self.info.parameters

    def _check_fields(self, fields: Any, grid: str | None) -> None:
        """What only snow has is refused for a session without."""
        names = field_names(fields)
        if self.snow_particle_count == 0:
            for name in SCALARS_OF_SNOW:
                if name in names:
                    raise refused(f"session {self.id!r} has no snow, and {name} says something of snow alone", "fields")
            if grid is not None:
                raise refused(f"session {self.id!r} has no snow, and so no grid", "grid")

    def __repr__(self) -> str:
        """What the session is, in a line."""
        kind = "nappe.aio" if type(self).__module__.startswith("nappe._server._aio") else "nappe"
        return f"<{kind}.Session {self.id!r}: {self.state}, step {self.steps_taken}, {self.particle_count} particles>"

    def _repr_html_(self) -> str:
        cells = {
            "session": self.id,
            "title": self.title,
            "state": self.state,
            "step": self.steps_taken,
            "time": f"{self.time_seconds:g} s",
            "particles": self.particle_count,
            "precision": self.precision,
        }
        rows = "".join(f"<tr><th>{name}</th><td>{_escaped(value)}</td></tr>" for name, value in cells.items())
        return f"<table>{rows}</table>"


def _escaped(value: object) -> str:
    return str(value).replace("&", "&amp;").replace("<", "&lt;")
