"""The same names as in `nappe`, for programs of asyncio: what waits is awaited, and loops are `async for`.

    import nappe.aio

    async with nappe.aio.serve() as server, server.create("flag") as session:
        await session.play()
        async for frame in session.frames(every=True):
            print(frame.time, frame.positions.mean(axis=0))

What makes something (`connect`, `serve`, `create`, `fork`) is awaited, or entered as a context manager as above.
"""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Awaitable, Callable, Generator, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Generic, Literal, TypeVar, overload

import grpc
import grpc.aio
import numpy as np
from numpy.typing import ArrayLike, NDArray

from nappe import _requests as requests
from nappe import _sync
from nappe import _targets as targets
from nappe import _uploads as uploads
from nappe._collect import MAX_BYTES, Collector
from nappe._contract import METHODS, Message
from nappe._diagnostics import diagnostics_array
from nappe._errors import Error, NotFound, Unauthenticated, from_call
from nappe._frames import Frame
from nappe._launch import ServerProcess
from nappe._pending import Pending, read_pending
from nappe._requests import Call, Changes
from nappe._resume import ChangeReader, DiagnosticsReader, FrameReader, Reader
from nappe._session import SessionProperties
from nappe._sync import PATIENCE
from nappe._trajectory import Trajectory
from nappe._values import Accepted, Change, Diagnostics, ServerInfo

__all__ = ["DiagnosticsStream", "Frames", "Opening", "Server", "Session", "Stream", "connect", "serve"]

T = TypeVar("T")

_EOF: Any = vars(grpc.aio)["EOF"]


class Opening(Generic[T]):
    """Something that is made when it is awaited, or entered with `async with`, which also ends it."""

    def __init__(self, make: Callable[[], Awaitable[T]]) -> None:
        """What makes it; nothing happens yet."""
        self._make = make
        self._made: Any = None

    def __await__(self) -> Generator[Any, None, T]:
        """Makes it."""
        return self._make().__await__()

    async def __aenter__(self) -> T:
        """Makes it, for the block."""
        self._made = await self._make()
        entered: T = await self._made.__aenter__()
        return entered

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Ends it."""
        await self._made.__aexit__(kind, error, trace)


def connect(url: str | None = None, token: str | os.PathLike[str] | None = None) -> Opening[Server]:
    """Connects to a server that runs; see `nappe.connect`."""

    async def make() -> Server:
        server = Server(targets.read(url, token))
        try:
            await server.info()
        except BaseException:
            await server.close()
            raise
        return server

    return Opening(make)


def serve(threads: int | None = None, **settings: Any) -> Opening[Server]:
    """Starts a server of one's own, and ends it with the block, or with this process; see `nappe.serve`."""

    async def make() -> Server:
        process = await asyncio.to_thread(ServerProcess, threads, settings)
        try:
            server = Server(targets.read(process.address, process.token), process)
            await server.info()
        except BaseException:
            process.end()
            raise
        return server

    return Opening(make)


class Server:
    """A connection to a server, for one event loop."""

    def __init__(self, target: targets.Target, process: ServerProcess | None = None) -> None:
        """A connection that is made when it is needed; `connect()` and `serve()` are what programs call."""
        self._target = target
        self.process = process
        """The server's process, if `serve()` started it."""
        self._pid = os.getpid()
        self._closed = False
        self._channels: dict[bool, Any] = {}
        self._methods: dict[tuple[bool, str], Any] = {}

    @property
    def address(self) -> str:
        return self._target.address

    @property
    def token(self) -> str | None:
        return self._target.token

    async def info(self) -> ServerInfo:
        return await self._call(requests.info())

    async def sessions(self) -> list[Session]:
        found: list[Session] = []
        page_token = ""
        while True:
            page = await self._call(requests.sessions(page_token))
            found.extend(Session(self, raw) for raw in page.sessions)
            page_token = page.next_page_token
            if not page_token or not page.sessions:
                return found

    async def session(self, id: str) -> Session:  # noqa: A002 - the contract's name
        call = requests.of_session("GetSession", (id, ""), requests.CALL_LIMIT)
        return Session(self, (await self._call(call)).session)

    def create(
        self,
        scene: str | os.PathLike[str] = "demo",
        *,
        id: str = "",  # noqa: A002 - the contract's name
        precision: str | None = None,
        thread_count: int = 0,
        step_limit: int | None = None,
        frame_interval_steps: int = 0,
        rank_count: int = 0,
    ) -> Opening[Session]:
        async def make() -> Session:
            given = uploads.read_scene(scene)
            ids = {name: (await self.upload_file(path)).mesh_id for name, path in given.meshes.items()}
            answer = await self._call(
                requests.create(
                    scene_name=given.name,
                    scene_text=None if given.text is None else given.with_uploads(ids),
                    session_id=id,
                    precision=precision,
                    thread_count=thread_count,
                    step_limit=step_limit,
                    frame_interval_steps=frame_interval_steps,
                    rank_count=rank_count,
                )
            )
            return Session(self, answer.session, given.text, made_here=True, warnings=answer.warnings)

        return Opening(make)

    async def upload(
        self,
        points: ArrayLike,
        triangles: ArrayLike,
        *,
        masses: ArrayLike | None = None,
        uv: ArrayLike | None = None,
        name: str = "mesh",
    ) -> uploads.Uploaded:
        return await self._upload(uploads.from_arrays(points, triangles, masses, uv, name))

    async def upload_file(self, path: str | os.PathLike[str], *, missing_mass: float | None = None) -> uploads.Uploaded:
        return await self._upload(uploads.from_file(Path(path), missing_mass))

    async def close(self) -> None:
        self._closed = True
        if os.getpid() != self._pid:
            return
        channels, self._channels, self._methods = list(self._channels.values()), {}, {}
        for channel in channels:
            await channel.close()
        if self.process is not None:
            await asyncio.to_thread(self.process.end)

    async def __aenter__(self) -> Server:
        """The server itself."""
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Closes it."""
        await self.close()

    def __repr__(self) -> str:
        """Where it listens; never the token."""
        return f"<nappe.aio.Server {self.address}>"

    async def _upload(self, mesh: uploads.Mesh) -> uploads.Uploaded:
        answer = await self._ask("UploadMesh", mesh.messages, uploads.UPLOAD_LIMIT)
        return uploads.Uploaded(answer.mesh_id, tuple(answer.warnings))

    async def _call(self, call: Call[T]) -> T:
        return call.read(await self._ask(call.name, lambda: call.message, call.limit))

    async def _ask(self, name: str, message: Any, limit: float | None) -> Any:
        """One call; once more if the server was started anew and left another token."""
        try:
            return await self._once(name, message, limit)
        except Unauthenticated:
            if not self._target.find_again():
                raise
        return await self._once(name, message, limit)

    async def _once(self, name: str, message: Any, limit: float | None) -> Any:
        method = self._method(name, False)
        try:
            return await method(message(), timeout=limit, metadata=self._target.metadata)
        except grpc.RpcError as status:
            raise from_call(status, self.address, name, limit) from None

    def _stream(self, name: str, message: Message, every: bool) -> Any:
        """A stream, on the connection of its kind."""
        return self._method(name, every)(message, metadata=self._target.metadata)

    def _method(self, name: str, bulk: bool) -> Any:
        _sync.check_usable(self._pid, self._closed, self.address)
        if (bulk, name) not in self._methods:
            if bulk not in self._channels:
                options = self._target.options(bulk)
                self._channels[bulk] = grpc.aio.insecure_channel(self._target.grpc, options)
            self._methods[(bulk, name)] = METHODS[name].on(self._channels[bulk])
        return self._methods[(bulk, name)]


class Session(SessionProperties):
    """A session on a server. As a context manager it deletes itself at the end of the block.

    Properties are as of the last answer of the server; `refresh()` asks again.
    """

    def __init__(self, server: Server, raw: Message, scene: str | None = None, **made: Any) -> None:
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
        answer = await self._server._call(
            requests.step(
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
        )
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

        return Opening(make)

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
        at_step: int = 0,
        wait: bool = False,
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
        )
        return await self._server._call(requests.update(self._ids, changes, at_step, wait, self.particle_count))

    async def path(
        self, particle: int, times: ArrayLike, targets: ArrayLike, *, at_step: int = 0, wait: bool = False
    ) -> Accepted:
        call = requests.path(self._ids, particle, times, targets, at_step, wait, self.particle_count)
        return await self._server._call(call)

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
        return Frames(self._server, reader, every)

    def diagnostics(
        self, every: bool = True, start: int | None = None, rate: float | None = None, *, patience: float = PATIENCE
    ) -> DiagnosticsStream:
        reader = DiagnosticsReader(self._ids, every=every, start=start, rate=rate, patience=patience)
        return DiagnosticsStream(self._server, reader, every)

    def changes(self, *, patience: float = PATIENCE) -> Stream[Change]:
        reader = ChangeReader(self._ids, every=False, start=None, rate=1.0, patience=patience)
        return Stream(self._server, reader, False)

    async def trajectory(
        self,
        stop: int | None = None,
        every: int = 1,
        fields: Sequence[str] = ("positions",),
        precision: str = "f32",
        max_bytes: int = MAX_BYTES,
    ) -> Trajectory:
        collector = Collector(await self.refresh(), stop, every, fields, precision, max_bytes)
        async with self.frames(every=True, fields=fields, precision=precision) as frames:
            await frames.opened()
            if self.state == "paused" and self.steps_taken < collector.stop:
                await self.step(to=collector.stop, wait=False)
            async for frame in frames:
                if collector.add(frame):
                    break
            end = frames.end
        await self.refresh()
        return collector.trajectory(end)

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


class Stream(Generic[T]):
    """A stream of the server, to be read with `async for`. Leaving the loop, `close()`, or cancelling the task ends
    it."""

    def __init__(self, server: Server, reader: Reader[T], every: bool) -> None:
        """Asks for the stream; errors come with the first read."""
        self._call: Any = None
        self._server = server
        self._reader = reader
        self._every = every
        self._closed = False
        self._first: Any = None
        self._is_reading = False
        self._open()

    @property
    def reconnects(self) -> int:
        return self._reader.reconnects

    @property
    def end(self) -> Any:
        return self._reader.end

    async def opened(self) -> None:
        if self._first is None:
            with suppress(grpc.RpcError):  # the first read meets it again
                self._first = await self._call.read()

    def close(self) -> None:
        self._closed = True
        if self._call is not None:
            self._call.cancel()

    def __aiter__(self: S) -> S:
        """The stream itself."""
        return self

    async def __anext__(self) -> T:
        """What comes next. Raises an error where the stream broke for good."""
        if self._is_reading:
            raise Error("two tasks read from one stream; give each its own", remedy="Ask for a stream per task.")
        self._is_reading = True
        try:
            return await self._next()
        except BaseException:
            self.close()
            raise
        finally:
            self._is_reading = False

    async def _next(self) -> T:
        while not self._closed and self._reader.end is None:
            try:
                message, self._first = self._first or await self._call.read(), None
                if message is _EOF:
                    await self._call.code()
                    self._reader.over()
                    break
            except grpc.RpcError as status:
                await self._broken(from_call(status, self._server.address, self._reader.method, None))
                continue
            except asyncio.CancelledError:
                if self._closed:  # by `close()` in another task, not a cancelled task
                    break
                raise
            item = self._reader.take(message)
            if item is not None:
                return item
        raise StopAsyncIteration

    async def _broken(self, error: Error) -> None:
        """Waits and asks again, if that can help."""
        if self._closed:
            return
        if not (isinstance(error, Unauthenticated) and self._server._target.find_again()):
            await asyncio.sleep(self._reader.failed(error, time.monotonic()))
        self._open()

    def _open(self) -> None:
        self._call = self._server._stream(self._reader.method, self._reader.request(), self._every)

    async def __aenter__(self: S) -> S:
        """The stream itself."""
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Ends the stream."""
        self.close()

    def __del__(self) -> None:
        """Ends the stream that nobody reads any more."""
        self.close()


S = TypeVar("S", bound=Stream[Any])


class Frames(Stream[Frame]):
    """Frames of a session; see `Session.frames`."""


class DiagnosticsStream(Stream[Diagnostics]):
    """Diagnostics of a session; see `Session.diagnostics`."""

    async def array(self) -> NDArray[np.void]:
        return diagnostics_array([step async for step in self])


def _borrow_words(own: type[Any], other: type[Any]) -> None:
    """What a method does is said once, in `nappe`."""
    for name, member in vars(own).items():
        words = getattr(other, name, None)
        if getattr(member, "__doc__", "") is None and words is not None:
            member.__doc__ = words.__doc__


for _kind in (Server, Session, Stream, DiagnosticsStream):
    _borrow_words(_kind, getattr(_sync, _kind.__name__))
