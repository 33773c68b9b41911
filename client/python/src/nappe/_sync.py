"""Calls that wait for their answers: servers, sessions and streams for plain programs and notebooks.

`nappe.aio` has the same names with `await`. What is asked and what answers mean is elsewhere: nothing here but calls.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Generic, Literal, TypeVar, overload

import grpc
import numpy as np
from numpy.typing import ArrayLike, NDArray

from nappe import _requests as requests
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
from nappe._trajectory import Trajectory
from nappe._values import Accepted, Change, Diagnostics, ServerInfo

T = TypeVar("T")

PATIENCE = 60.0
"""How long a broken stream is asked for again (s)."""


def connect(url: str | None = None, token: str | os.PathLike[str] | None = None) -> Server:
    """Connects to a server that runs: `HOST:PORT`, `http://HOST:PORT` or `unix:PATH`.

    Without `url`, to the one that the variable `NAPPE_SERVER` names, or to port 6277 of this machine. `token`: the
    token itself, or the `Path` of a file whose first line it is; without it, the file that `NAPPE_TOKEN_FILE` names,
    or what a server of the same user on this machine left. Raises `Unavailable` if nothing answers, `Unauthenticated`
    if the token is missing or wrong.
    """
    server = Server(targets.read(url, token))
    try:
        server.info()
    except BaseException:
        server.close()
        raise
    return server


def serve(threads: int | None = None, **settings: Any) -> Server:
    """Starts a server of one's own on a free port of this machine, and ends it with the block, or with this process.

    The program is the one that `NAPPE_SERVER_PROGRAM` names, `nappe-server` on PATH, or the one built in the
    repository. `threads`: most threads per session. `settings`: flags of the program, such as `max_sessions=3` for
    `--max-sessions 3`; `nappe-server --help` lists them.
    """
    process = ServerProcess(threads, settings)
    try:
        server = Server(targets.read(process.address, process.token), process)
        server.info()
    except BaseException:
        process.end()
        raise
    return server


class Server:
    """A connection to a server. Threads may share it; a forked process may not."""

    def __init__(self, target: targets.Target, process: ServerProcess | None = None) -> None:
        """A connection that is made when it is needed; `connect()` and `serve()` are what programs call."""
        self._target = target
        self.process = process
        """The server's process, if `serve()` started it."""
        self._pid = os.getpid()
        self._closed = False
        self._lock = threading.Lock()
        self._channels: dict[bool, Any] = {}
        self._methods: dict[tuple[bool, str], Any] = {}

    @property
    def address(self) -> str:
        """Where the server listens."""
        return self._target.address

    @property
    def token(self) -> str | None:
        """The token that calls show. Keep it to yourself."""
        return self._target.token

    def info(self) -> ServerInfo:
        """Version, limits and shipped scenes of the server."""
        return self._call(requests.info())

    def sessions(self) -> list[Session]:
        """All sessions, in the order of their ids."""
        found: list[Session] = []
        page_token = ""
        while True:
            page = self._call(requests.sessions(page_token))
            found.extend(Session(self, raw) for raw in page.sessions)
            page_token = page.next_page_token
            if not page_token or not page.sessions:
                return found

    def session(self, id: str) -> Session:  # noqa: A002 - the contract's name
        """The session of this id."""
        return Session(self, self._call(requests.of_session("GetSession", (id, ""), requests.CALL_LIMIT)).session)

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
    ) -> Session:
        """Makes a session, paused before its first step.

        `scene`: the name of a scene that the server ships, the text of a scene file, or a path to one (a text that
        ends in `.toml`, or a `Path`), whose mesh files are uploaded. `id`: 4 to 63 of a-z, 0-9 and '-', starting with
        a letter; the server chooses without it. `precision`: `f32` or `f64`. `thread_count`: 0 for as many as the
        server has cores. `step_limit`: steps after which it ends by itself; 0 never. `frame_interval_steps`: steps
        between frames. `rank_count`: ranks of a cluster that step it. What is not given is as the scene says.
        """
        given = uploads.read_scene(scene)
        ids = {name: self.upload_file(path).mesh_id for name, path in given.meshes.items()}
        answer = self._call(
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

    def upload(
        self,
        points: ArrayLike,
        triangles: ArrayLike,
        *,
        masses: ArrayLike | None = None,
        uv: ArrayLike | None = None,
        name: str = "mesh",
    ) -> uploads.Uploaded:
        """Uploads a mesh as arrays: points (n, 3) (m), triangles (m, 3), masses (n,) (kg; 0 pins), uv (n, 2)."""
        return self._upload(uploads.from_arrays(points, triangles, masses, uv, name))

    def upload_file(self, path: str | os.PathLike[str], *, missing_mass: float | None = None) -> uploads.Uploaded:
        """Uploads a mesh file as it is: OBJ, OFF, PLY, or a set of the MecaSim course.

        `missing_mass`: the mass (kg) of points that a masses.eti leaves out; without it, such a set is refused.
        """
        return self._upload(uploads.from_file(Path(path), missing_mass))

    def close(self) -> None:
        """Ends the connection, and the server if `serve()` started it."""
        self._closed = True
        if os.getpid() != self._pid:
            return
        with self._lock:
            channels, self._channels = list(self._channels.values()), {}
            self._methods = {}
        for channel in channels:
            channel.close()
        if self.process is not None:
            self.process.end()

    def __enter__(self) -> Server:
        """The server itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Closes it."""
        self.close()

    def __repr__(self) -> str:
        """Where it listens; never the token."""
        return f"<nappe.Server {self.address}>"

    def _upload(self, mesh: uploads.Mesh) -> uploads.Uploaded:
        answer = self._ask("UploadMesh", mesh.messages, uploads.UPLOAD_LIMIT)
        return uploads.Uploaded(answer.mesh_id, tuple(answer.warnings))

    def _call(self, call: Call[T]) -> T:
        return call.read(self._ask(call.name, lambda: call.message, call.limit))

    def _ask(self, name: str, message: Any, limit: float | None) -> Any:
        """One call; once more if the server was started anew and left another token."""
        try:
            return self._once(name, message, limit)
        except Unauthenticated:
            if not self._target.find_again():
                raise
        return self._once(name, message, limit)

    def _once(self, name: str, message: Any, limit: float | None) -> Any:
        method = self._method(name, False)
        try:
            return method(message(), timeout=limit, metadata=self._target.metadata)
        except grpc.RpcError as status:
            raise from_call(status, self.address, name, limit) from None

    def _stream(self, name: str, message: Message, every: bool) -> Any:
        """A stream, on the connection of its kind."""
        return self._method(name, every)(message, metadata=self._target.metadata)

    def _method(self, name: str, bulk: bool) -> Any:
        check_usable(self._pid, self._closed, self.address)
        found = self._methods.get((bulk, name))
        return found if found is not None else self._open(name, bulk)

    def _open(self, name: str, bulk: bool) -> Any:
        with self._lock:
            if bulk not in self._channels:
                options = self._target.options(bulk)
                self._channels[bulk] = grpc.insecure_channel(self._target.grpc, options)
            made = self._methods[(bulk, name)] = METHODS[name].on(self._channels[bulk])
            return made


def check_usable(pid: int, closed: bool, address: str) -> None:
    """Refuses a connection that another process made, or that was closed."""
    if os.getpid() != pid:
        raise Error(
            "this process was forked from the one that connected, and connections of gRPC do not survive that",
            remedy="Start processes by multiprocessing's 'spawn' or 'forkserver', or before the first connection.",
        )
    if closed:
        raise Error(f"the connection to {address} is closed")


class Session(SessionProperties):
    """A session on a server. As a context manager it deletes itself at the end of the block.

    Properties are as of the last answer of the server; `refresh()` asks again.
    """

    def __init__(self, server: Server, raw: Message, scene: str | None = None, **made: Any) -> None:
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
        there or not; at most 3 MiB of it. Without `wait`, answers at once.
        """
        if frame:
            self._check_fields(fields, None)
        answer = self._server._call(
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
        at_step: int = 0,
        wait: bool = False,
    ) -> Accepted:
        """Changes parameters between two steps, all of them or none; what is not given stays as it is.

        See `Changes` for what each means. `at_step`: index of the step before which the change takes effect; 0: the
        next. With `wait`, answers when it does.
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
        )
        return self._server._call(requests.update(self._ids, changes, at_step, wait, self.particle_count))

    def path(
        self, particle: int, times: ArrayLike, targets: ArrayLike, *, at_step: int = 0, wait: bool = False
    ) -> Accepted:
        """Sends a pin along a way, at constant speed from point to point.

        `times` (n,): simulated times after the change takes effect (s), above 0 and growing. `targets` (n, 3): where
        the pinned particle is at each (m).
        """
        call = requests.path(self._ids, particle, times, targets, at_step, wait, self.particle_count)
        return self._server._call(call)

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
        `velocities`, `plastic_ratio` and `stress`. `precision`: `f32` or `f64`. `grid`: nodes of the snow's grid,
        `smoke` for all, `slice:y=0.5` for a plane (m). `paced`: whether the session waits for this reader; with
        `every` it does, if this program made it. A stream that breaks is asked for again for `patience` seconds.
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
        return Frames(self._server, reader, every)

    def diagnostics(
        self, every: bool = True, start: int | None = None, rate: float | None = None, *, patience: float = PATIENCE
    ) -> DiagnosticsStream:
        """Diagnostics of frames as they are made, without particles, by the rules of `frames`.

        `session.diagnostics().array()` reads to the session's end and returns one structured array.
        """
        reader = DiagnosticsReader(self._ids, every=every, start=start, rate=rate, patience=patience)
        return DiagnosticsStream(self._server, reader, every)

    def changes(self, *, patience: float = PATIENCE) -> Stream[Change]:
        """How the session stands, then what happens to it: it plays, is paused, finished, changed, deleted."""
        reader = ChangeReader(self._ids, every=False, start=None, rate=1.0, patience=patience)
        return Stream(self._server, reader, False)

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
        `max_bytes` of memory would be taken.
        """
        collector = Collector(self.refresh(), stop, every, fields, precision, max_bytes)
        with self.frames(every=True, fields=fields, precision=precision) as frames:
            frames.opened()
            if self.state == "paused" and self.steps_taken < collector.stop:
                self.step(to=collector.stop, wait=False)
            for frame in frames:
                if collector.add(frame):
                    break
            end = frames.end
        self.refresh()
        return collector.trajectory(end)

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


class Stream(Generic[T]):
    """A stream of the server, to be read in a loop. Leaving the loop, or `close()`, ends it on the server too."""

    def __init__(self, server: Server, reader: Reader[T], every: bool) -> None:
        """Asks for the stream; errors come with the first read."""
        self._call: Any = None
        self._server = server
        self._reader = reader
        self._every = every
        self._closed = False
        self._first: Any = None
        self._reading = threading.Lock()
        self._open()

    @property
    def reconnects(self) -> int:
        """How often the connection broke and came back."""
        return self._reader.reconnects

    @property
    def end(self) -> Any:
        """How the session finished (`SessionEnd`), once the stream is at its end."""
        return self._reader.end

    def opened(self) -> None:
        """Waits until the server has begun to answer: what is made from then on comes, with all that was asked for."""
        if self._first is None:
            with suppress(StopIteration, grpc.RpcError):  # the first read meets it again
                self._first = next(self._call)

    def close(self) -> None:
        """Ends the stream."""
        self._closed = True
        if self._call is not None:
            self._call.cancel()

    def __iter__(self) -> Iterator[T]:
        """The stream itself."""
        return self

    def __next__(self) -> T:
        """What comes next. Raises an error where the stream broke for good."""
        if not self._reading.acquire(blocking=False):
            raise Error("two threads read from one stream; give each its own", remedy="Ask for a stream per thread.")
        try:
            return self._next()
        except BaseException:
            self.close()
            raise
        finally:
            self._reading.release()

    def _next(self) -> T:
        while not self._closed:
            if self._reader.end is not None:
                break
            try:
                message, self._first = self._first or next(self._call), None
            except StopIteration:
                self._reader.over()
                break
            except grpc.RpcError as status:
                self._broken(from_call(status, self._server.address, self._reader.method, None))
                continue
            item = self._reader.take(message)
            if item is not None:
                return item
        raise StopIteration

    def _broken(self, error: Error) -> None:
        """Waits and asks again, if that can help."""
        if self._closed:
            return
        if not (isinstance(error, Unauthenticated) and self._server._target.find_again()):
            time.sleep(self._reader.failed(error, time.monotonic()))
        self._open()

    def _open(self) -> None:
        self._call = self._server._stream(self._reader.method, self._reader.request(), self._every)

    def __enter__(self: S) -> S:
        """The stream itself."""
        return self

    def __exit__(
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

    def array(self) -> NDArray[np.void]:
        """All that come until the session ends, as one structured array: a row per frame, a column per number."""
        return diagnostics_array(list(self))
