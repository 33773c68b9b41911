"""A session, with calls that are awaited."""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import AsyncIterator, Iterable, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
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
from nappe._server._aio_opening import Opening
from nappe._server._aio_stream import DiagnosticsStream, Frames, Stream
from nappe._server._calls import AwaitedServer
from nappe._server._collect import MAX_BYTES, Collector
from nappe._server._ctrl_c import paused_words
from nappe._server._properties import SessionProperties
from nappe._server._sync_stream import PATIENCE
from nappe._wire._contract import Message
from nappe._wire._errors import Error, NotFound
from nappe._wire._frames import Frame
from nappe._wire._pending import Pending, read_pending
from nappe._wire._values import Accepted, Change

_log = logging.getLogger("nappe")


class Session(SessionProperties):
    """A session on a server. As a context manager it deletes itself at the end of the block.

    Properties are as of the last answer of the server; `refresh()` asks again.
    """

    def __init__(self, server: AwaitedServer, raw: Message, scene: str | None = None, **made: Any) -> None:
        """A session from the message that describes it; `Server.create()` is what programs call."""
        super().__init__(raw, scene, **made)
        self._server = server

    async def refresh(self) -> Session:
        return await self._answered(requests.of_session("GetSession", self._ids, requests.CALL_LIMIT))

    async def play(self, real_time_factor: float = 0.0) -> Session:
        return await self._answered(requests.play(self._ids, real_time_factor))

    async def pause(self, *, wait: bool = True) -> Session:
        return await self._answered(requests.of_session("PauseSession", self._ids, wait=wait))

    @overload
    async def step(
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
    async def step(
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

    async def step(
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
        async with self._pausing(wait):
            answer = await self._server._call(call)
        self._told(answer.session)
        return requests.frame_of(answer)

    async def stop(self) -> Session:
        return await self._answered(requests.of_session("StopSession", self._ids))

    async def delete(self) -> None:
        await self._server._call(requests.of_session("DeleteSession", self._ids))
        self._is_deleted = True

    def fork(self, id: str = "", *, step_limit: int | None = None) -> Opening[Session]:  # noqa: A002
        async def make() -> Session:
            answer = await self._server._call(requests.fork(self._ids, id, step_limit))
            return Session(self._server, answer.session, self._scene, made_here=True)

        return Opening("session.fork(...)", make)

    async def save(self, path: str | os.PathLike[str]) -> Path:
        with Saving(path) as saving:
            async for piece in self._server._pieces(requests.save(self._ids)):
                saving.take(piece)
        return saving.path

    async def update(
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
        return await self._server._call(requests.update(self._ids, changes, at_step, wait, self.particle_count))

    async def path(
        self, particle: int, times: ArrayLike, targets: ArrayLike, *, at_step: int = 0, wait: bool = False
    ) -> Accepted:
        limits = await self._server._known_limits()
        call = requests.path(self._ids, particle, times, targets, at_step, wait, self.particle_count, limits)
        return await self._server._call(call)

    async def place(
        self,
        body: str,
        positions: ArrayLike,
        velocities: ArrayLike | None = None,
        *,
        at_step: int = 0,
        wait: bool = False,
    ) -> Accepted:
        call = requests.place(self._ids, body, positions, velocities, at_step, wait, self.particle_count)
        return await self._server._call(call)

    async def reset(self) -> Accepted:
        return await self._server._call(requests.reset(self._ids))

    async def pending(self) -> list[Pending]:
        found: list[Pending] = []
        page_token = ""
        while True:
            page = await self._server._call(requests.pending(self._ids, page_token))
            found.extend(map(read_pending, page.changes))
            page_token = page.next_page_token
            if not page_token or not page.changes:
                return found

    async def drop_pending(self, orders: Iterable[int] = ()) -> int:
        call = requests.of_session("DropPendingChanges", self._ids, orders=list(orders))
        return int((await self._server._call(call)).dropped_count)

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
        reader = DiagnosticsReader(self._ids, every=every, start=start, rate=rate, patience=patience)
        return DiagnosticsStream(self._server, reader)

    def changes(self, *, patience: float = PATIENCE) -> Stream[Change]:
        reader = ChangeReader(self._ids, every=False, start=None, rate=1.0, patience=patience)
        return Stream(self._server, reader)

    async def trajectory(
        self,
        stop: int | None = None,
        every: int = 1,
        fields: Sequence[str] = ("positions",),
        precision: str = "f32",
        max_bytes: int = MAX_BYTES,
    ) -> Trajectory:
        collector = Collector(await self.refresh(), stop, every, fields, precision, max_bytes)
        async with self._pausing(), self.frames(every=True, fields=fields, precision=precision) as frames:
            await frames.opened()
            if self.state == "paused" and self.steps_taken < collector.stop:
                await self.step(to=collector.stop, wait=False)
            async for frame in frames:
                if collector.add(frame):
                    break
            end = frames.end
        await self.refresh()
        return collector.trajectory(end)

    @asynccontextmanager
    async def _pausing(self, is_waiting: bool = True) -> AsyncIterator[None]:
        """A wait for steps: Ctrl-C, which cancels it, pauses the session, which would go on unseen otherwise."""
        try:
            yield
        except asyncio.CancelledError:
            if is_waiting:
                met: Error | None = None
                try:
                    await self._answered(requests.of_session("PauseSession", self._ids, requests.CALL_LIMIT, wait=True))
                except Error as other:
                    met = other
                _log.warning("%s", paused_words(self, met))
            raise

    async def __aenter__(self) -> Session:
        """The session itself."""
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Deletes the session, if it is still there."""
        if self._is_deleted:
            return
        with suppress(NotFound) if error is None else suppress(Error):
            await self.delete()

    async def _answered(self, call: Call[Message]) -> Session:
        self._told((await self._server._call(call)).session)
        return self
