"""A server, with calls that wait for their answers: connected to, or started.

Threads may share a connection; a process that was forked may not use the one of its parent.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

import grpc
from numpy.typing import ArrayLike

from nappe._ask import _requests as requests
from nappe._ask import _uploads as uploads
from nappe._ask._begun import read_begin
from nappe._ask._requests import Call
from nappe._server import _targets as targets
from nappe._server._launch import ServerProcess
from nappe._server._sync_session import Session
from nappe._wire._contract import METHODS, Message
from nappe._wire._errors import Closed, Error, Unauthenticated, from_call
from nappe._wire._frames import Frame
from nappe._wire._values import ServerInfo

T = TypeVar("T")


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
        self._limits: dict[str, int] = {}

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
        found = self._call(requests.info())
        self._limits = found.limits
        return found

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

    def make_link(
        self, session: Session | str | None = None, *, forks: int = 0, uses: int = 0, seconds: int = 0
    ) -> str:
        """A link to the page of the server, which lets browsers in.

        Without `session` it is good once and for ten minutes, and gives the token of the server. With one, a `Session`
        or its id, it is opened `uses` times (0: once; at most 1 000) within `seconds` (0: ten minutes; at most 43 200),
        and gives each who opens it a token of his own: that may watch the session, have `forks` copies of it at a time
        (at most 4), and do everything with these. There is no other session for it.
        """
        session_id = session.id if isinstance(session, Session) else session or ""
        return self._call(requests.link(self.address, session_id, forks, uses, seconds))

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
        begin: Frame | str | os.PathLike[str] | None = None,
        checkpoint: str | os.PathLike[str] | None = None,
    ) -> Session:
        """Makes a session, paused before its first step.

        `begin`: a frame of this scene at which it begins, with its step and its time, instead of at the start: a
        `Frame` with velocities, or the path of a PLY file with them, or of a folder of such, of which the last frame
        counts. The session goes on as the one that the frame is of, to the bit; `warnings` tells what the frame lacks.
        A frame in another precision is refused, and so are scenes with snow.

        `checkpoint`: the file of a session that `Session.save()` or `nappe save` kept, in place of a scene: the new
        session goes on from there at the same step, to the bit, also with snow. What is not given is as it was there.

        `scene`: the name of a scene that the server ships, the text of a scene file, or a path to one (a text that
        ends in `.toml`, or a `Path`), whose mesh files are uploaded. `id`: 1 to 63 letters (a-z, A-Z), digits and '-',
        which is not the first; the server chooses without it. `precision`: `f32` or `f64`. `thread_count`: 0 for as
        many as the server has cores. `step_limit`: steps after which it ends by itself; 0 never.
        `frame_interval_steps`: steps between frames. `rank_count`: ranks of a cluster that step it. What is not given
        is as the scene says.
        """
        begun = read_begin(begin)
        given = uploads.read_scene(scene) if checkpoint is None else uploads.NOTHING
        ids = {name: self._upload(given.mesh(name)).mesh_id for name in given.meshes}
        at = None if begun is None else begun.message(self._upload(begun.mesh).mesh_id)
        kept = None if checkpoint is None else self._upload(uploads.from_checkpoint(Path(checkpoint))).mesh_id
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
                begin=at,
                checkpoint_id=kept,
            )
        )
        told = (*answer.warnings, *(begun.warnings if begun else ()))
        made = Session(self, answer.session, given.text, made_here=True, warnings=told)
        fault = begun.fault(answer.session) if begun else None
        if fault is not None:
            made.delete()
            raise fault
        return made

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
        """Uploads a mesh file as it is: OBJ, OFF, PLY, STL, or a set of the MecaSim course.

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

    def _pieces(self, call: Call[Message]) -> Iterator[Message]:
        try:
            yield from self._stream(call.name, call.message, False)
        except grpc.RpcError as status:
            self._check_usable()
            raise from_call(status, self.address, call.name, call.limit) from None

    def _known_limits(self) -> dict[str, int]:
        return self._limits or self.info().limits

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
            self._check_usable()
            raise from_call(status, self.address, name, limit) from None
        except ValueError:  # of a channel that another thread has closed just now
            self._check_usable()
            raise

    def _stream(self, name: str, message: Message, every: bool) -> Any:
        """A stream, on the connection of its kind."""
        return self._method(name, every)(message, metadata=self._target.metadata)

    def _find_token_again(self) -> bool:
        return self._target.find_again()

    def _check_usable(self) -> None:
        check_usable(self._pid, self._closed, self.address)

    def _method(self, name: str, bulk: bool) -> Any:
        self._check_usable()
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
        raise Closed(f"the connection to {address} is closed") from None
