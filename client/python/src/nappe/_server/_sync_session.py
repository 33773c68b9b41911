"""A session, with calls that wait for their answers."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, NoReturn, overload

from numpy.typing import ArrayLike

from nappe._ask import _requests as requests
from nappe._ask._acting import Forces, States
from nappe._ask._moving import Poses
from nappe._ask._pulls import Pulls
from nappe._ask._requests import Call, Changes
from nappe._ask._resume import ChangeReader, DiagnosticsReader, FrameReader
from nappe._ask._saved import Saving
from nappe._save._trajectory import Trajectory
from nappe._server._calls import CallServer
from nappe._server._collect import MAX_BYTES, Collector
from nappe._server._ctrl_c import is_ctrl_c, paused_words
from nappe._server._properties import SessionProperties
from nappe._server._sync_stream import PATIENCE, DiagnosticsStream, Frames, Stream
from nappe._wire._contract import Message
from nappe._wire._errors import Error, NotFound
from nappe._wire._frames import Frame
from nappe._wire._pending import Pending, read_pending
from nappe._wire._values import Accepted, Change


class Session(SessionProperties):
    """A session on a server. As a context manager it deletes itself at the end of the block.

    Properties are as of the last answer of the server; `refresh()` asks again.
    """

    def __init__(self, server: CallServer, raw: Message, scene: str | None = None, **made: Any) -> None:
        """A session from the message that describes it; `Server.create()` is what programs call."""
        super().__init__(raw, scene, **made)
        self._server = server

    def refresh(self) -> Session:
        """Asks how the session stands; its properties are as of now then."""
        return self._answered(requests.of_session("GetSession", self._ids, requests.CALL_LIMIT))

    def play(self, real_time_factor: float = 0.0) -> Session:
        """Steps until the session is paused, stopped or at its end.

        `real_time_factor`: simulated seconds per second of wall clock; 0: as fast as possible.
        """
        return self._answered(requests.play(self._ids, real_time_factor))

    def pause(self, *, wait: bool = True) -> Session:
        """Stops stepping after the step in progress; with `wait`, answers once the session stands."""
        return self._answered(requests.of_session("PauseSession", self._ids, wait=wait))

    @overload
    def step(
        self,
        n: int = 1,
        *,
        to: int | None = None,
        changes: Changes | None = None,
        frame: Literal[True],
        fields: Sequence[str] = ("positions",),
        precision: str = "f32",
        wait: bool = True,
    ) -> Frame: ...

    @overload
    def step(
        self,
        n: int = 1,
        *,
        to: int | None = None,
        changes: Changes | None = None,
        frame: Literal[False] = False,
        fields: Sequence[str] = ("positions",),
        precision: str = "f32",
        wait: bool = True,
    ) -> None: ...

    def step(
        self,
        n: int = 1,
        *,
        to: int | None = None,
        changes: Changes | None = None,
        frame: bool = False,
        fields: Sequence[str] = ("positions",),
        precision: str = "f32",
        wait: bool = True,
    ) -> Frame | None:
        """Takes `n` steps, then pauses: one call per step for a controller in a loop.

        `to`: instead, steps until the session has taken so many since its initial state, so that a call can be
        repeated. `changes`: parameters that change before the first step, all of them or none (see `Changes`).
        `frame`: returns the state after the steps, with the arrays of `fields`, whether a frame of the streams is due
        there or not; at most 3 MiB of it. Without `wait`, answers at once. Ctrl-C pauses the session, and says so.
        """
        if frame:
            self._check_fields(fields, None)
        call = requests.step(
            self._ids,
            n,
            to=to,
            wait=wait,
            changes=changes,
            frame=frame,
            fields=fields,
            precision=precision,
            particles=self.particle_count,
        )
        with self._pausing(wait):
            answer = self._server._call(call)
        self._told(answer.session)
        return requests.frame_of(answer)

    def stop(self) -> Session:
        """Ends the simulation; the session stays readable until it is deleted."""
        return self._answered(requests.of_session("StopSession", self._ids))

    def delete(self) -> None:
        """Ends the session and forgets it."""
        self._server._call(requests.of_session("DeleteSession", self._ids))
        self._is_deleted = True

    def fork(self, id: str = "", *, step_limit: int | None = None) -> Session:  # noqa: A002 - the contract's name
        """Makes a session that stands where this one stands, to the bit, paused; its frames begin with number 0.

        `step_limit`: steps since the initial state of this one after which it ends; 0 never.
        """
        answer = self._server._call(requests.fork(self._ids, id, step_limit))
        return Session(self._server, answer.session, self._scene, made_here=True)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Keeps the session as a file, as it stands between two steps; it goes on.

        `Server.create(checkpoint=path)` goes on from there, on this or another server of the same version, to the bit.
        A file that is there is replaced once the new one is whole.
        """
        with Saving(path) as saving:
            for piece in self._server._pieces(requests.save(self._ids)):
                saving.take(piece)
        return saving.path

    def update(
        self,
        *,
        gravity: ArrayLike | None = None,
        wind: ArrayLike | None = None,
        drag: float | None = None,
        stiffness: requests.PerKind | None = None,
        damping: requests.PerKind | None = None,
        body: str | None = None,
        pins: dict[int, ArrayLike] | None = None,
        duration: float | None = None,
        air: Mapping[str, float] | None = None,
        forces: Forces | None = None,
        states: States | None = None,
        colliders: Poses | None = None,
        pulls: Pulls | None = None,
        frequency: float | None = None,
        most: float | None = None,
        seconds: float | None = None,
        at_step: int = 0,
        wait: bool = False,
        **unknown: NoReturn,
    ) -> Accepted:
        """Changes parameters between two steps, all of them or none; what is not given stays as it is.

        See `Changes` for what each means. `at_step`: index of the step before which the change takes effect; 0: the
        next. With `wait`, answers when it does. An argument of another name is refused with the names that there are.
        """
        changes = requests.changes(
            gravity=gravity,
            wind=wind,
            drag=drag,
            stiffness=stiffness,
            damping=damping,
            body=body,
            pins=pins,
            duration=duration,
            air=air,
            forces=forces,
            states=states,
            colliders=colliders,
            pulls=pulls,
            frequency=frequency,
            most=most,
            seconds=seconds,
            **unknown,
        )
        return self._server._call(requests.update(self._ids, changes, at_step, wait, self.particle_count))

    def path(
        self, particle: int, times: ArrayLike, targets: ArrayLike, *, at_step: int = 0, wait: bool = False
    ) -> Accepted:
        """Sends a pin along a way, at constant speed from point to point.

        `times` (n,): simulated times after the change takes effect (s), above 0 and growing. `targets` (n, 3): where
        the pinned particle is at each (m). There are at most `max_changes_per_call` of them in one call, a limit of the
        server.
        """
        limits = self._server._known_limits()
        call = requests.path(self._ids, particle, times, targets, at_step, wait, self.particle_count, limits)
        return self._server._call(call)

    def place(
        self,
        body: str,
        positions: ArrayLike,
        velocities: ArrayLike | None = None,
        *,
        at_step: int = 0,
        wait: bool = False,
    ) -> Accepted:
        """Puts all particles of a body somewhere before a step: nothing stays of where and how fast they were.

        `body`: a cloth or an object of snow, which is without deformation then. `positions` and `velocities` (n, 3):
        one for each of its particles (m, m/s); without velocities it is at rest. Pins stand where they are put.
        `at_step` and `wait` are as in `update`.
        """
        call = requests.place(self._ids, body, positions, velocities, at_step, wait, self.particle_count)
        return self._server._call(call)

    def reset(self) -> Accepted:
        """Puts every body, parameter and pin back to the session's start; steps, time and frames go on.

        Colliders are back on the ways of the scene, where these are by then.

        It happens between two steps, at once where the session stands; watchers get a new frame of it.
        """
        return self._server._call(requests.reset(self._ids))

    def pending(self) -> list[Pending]:
        """The changes that wait for their step, in the order in which they take effect."""
        found: list[Pending] = []
        page_token = ""
        while True:
            page = self._server._call(requests.pending(self._ids, page_token))
            found.extend(map(read_pending, page.changes))
            page_token = page.next_page_token
            if not page_token or not page.changes:
                return found

    def drop_pending(self, orders: Iterable[int] = ()) -> int:
        """Drops changes that wait for their step, by their order numbers, or all; returns how many."""
        call = requests.of_session("DropPendingChanges", self._ids, orders=list(orders))
        return int(self._server._call(call).dropped_count)

    def frames(
        self,
        every: bool = False,
        start: int | None = None,
        rate: float | None = None,
        fields: Sequence[str] = ("positions",),
        precision: str = "f32",
        grid: str | None = None,
        paced: bool | None = None,
        *,
        patience: float = PATIENCE,
    ) -> Frames:
        """Frames as they are made, until the session ends.

        `every`: every frame in order, from number `start`, or from the first that is kept; otherwise the newest
        whenever the loop is ready, at most `rate` per second. `fields`: arrays over the particles, of `positions`,
        `velocities`, `plastic_ratio`, `stress`, `force` and `acceleration`. `precision`: `f32` or `f64`. `grid`: nodes
        of the snow's grid, `smoke` for all, `slice:y=0.5` for a plane (m). `paced`: whether the session waits for this
        reader; with `every` it does, if this program made it. A stream that breaks is asked for again for `patience`
        seconds.
        """
        self._check_fields(fields, grid)
        reader = FrameReader(
            self._ids,
            every=every,
            start=start,
            rate=rate,
            patience=patience,
            fields=fields,
            precision=precision,
            grid=grid,
            paced=every and self._made_here if paced is None else paced,
        )
        return Frames(self._server, reader)

    def diagnostics(
        self, every: bool = True, start: int | None = None, rate: float | None = None, *, patience: float = PATIENCE
    ) -> DiagnosticsStream:
        """Diagnostics of frames as they are made, without particles, by the rules of `frames`.

        Both `session.diagnostics().table()` and `.array()` read to the session's end: flat columns, for pandas too, or
        one structured array.
        """
        reader = DiagnosticsReader(self._ids, every=every, start=start, rate=rate, patience=patience)
        return DiagnosticsStream(self._server, reader)

    def changes(self, *, patience: float = PATIENCE) -> Stream[Change]:
        """How the session stands, then what happens to it: it plays, is paused, finished, changed, reset, deleted."""
        reader = ChangeReader(self._ids, every=False, start=None, rate=1.0, patience=patience)
        return Stream(self._server, reader)

    def trajectory(
        self,
        stop: int | None = None,
        every: int = 1,
        fields: Sequence[str] = ("positions",),
        precision: str = "f32",
        max_bytes: int = MAX_BYTES,
    ) -> Trajectory:
        """Frames from the first that is kept to the one at step `stop`, or to the session's end, as stacked arrays.

        A session that is paused is stepped until then. `every`: one frame of so many. Refused before more than
        `max_bytes` of memory would be taken. Ctrl-C pauses the session, and says so.
        """
        collector = Collector(self.refresh(), stop, every, fields, precision, max_bytes)
        with self._pausing(), self.frames(every=True, fields=fields, precision=precision) as frames:
            frames.opened()
            if self.state == "paused" and self.steps_taken < collector.stop:
                self.step(to=collector.stop, wait=False)
            for frame in frames:
                if collector.add(frame):
                    break
            end = frames.end
        self.refresh()
        return collector.trajectory(end)

    @contextmanager
    def _pausing(self, is_waiting: bool = True) -> Iterator[None]:
        """A wait for steps: Ctrl-C, which ends it, pauses the session, which would go on unseen otherwise."""
        try:
            yield
        except BaseException as error:
            if not is_waiting or not is_ctrl_c(error):
                raise
            met: Error | None = None
            try:
                self._answered(requests.of_session("PauseSession", self._ids, requests.CALL_LIMIT, wait=True))
            except Error as other:
                met = other
            raise KeyboardInterrupt(paused_words(self, met)) from None

    def __enter__(self) -> Session:
        """The session itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Deletes the session, if it is still there."""
        if self._is_deleted:
            return
        with suppress(NotFound) if error is None else suppress(Error):
            self.delete()

    def _answered(self, call: Call[Message]) -> Session:
        self._told(self._server._call(call).session)
        return self
