"""A server, with calls that are awaited: connected to, or started. For one event loop."""

from __future__ import annotations

import asyncio
import os
import weakref
from collections.abc import AsyncIterator
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

import grpc
import grpc.aio
from numpy.typing import ArrayLike

from nappe._ask import _requests as requests
from nappe._ask import _uploads as uploads
from nappe._ask._begun import read_begin
from nappe._ask._requests import Call
from nappe._server import _targets as targets
from nappe._server._aio_loop import OwnLoop, is_cancelled
from nappe._server._aio_opening import Opening
from nappe._server._aio_session import Session
from nappe._server._launch import ServerProcess
from nappe._server._sync_server import check_usable
from nappe._wire._contract import METHODS, Message
from nappe._wire._errors import Unauthenticated, from_call
from nappe._wire._frames import Frame
from nappe._wire._values import ServerInfo

T = TypeVar("T")


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

    return Opening("nappe.aio.connect(...)", make)


def serve(threads: int | None = None, **settings: Any) -> Opening[Server]:
    """Starts a server of one's own, and ends it with the block, or with this process; see `nappe.serve`."""

    async def make() -> Server:
        process = await asyncio.to_thread(ServerProcess, threads, settings)
        try:
            server = Server(targets.read(process.address, process.token), process)
            await server.info()
        except BaseException:
            await asyncio.to_thread(process.end)
            raise
        return server

    return Opening("nappe.aio.serve(...)", make)


class Server:
    """A connection to a server, for one event loop."""

    def __init__(self, target: targets.Target, process: ServerProcess | None = None) -> None:
        """A connection that is made when it is needed; `connect()` and `serve()` are what programs call."""
        self._target = target
        self.process = process
        """The server's process, if `serve()` started it."""
        self._pid = os.getpid()
        self._closed = False
        self._loop = OwnLoop()
        self._channels: dict[bool, Any] = {}
        self._methods: dict[tuple[bool, str], Any] = {}
        self._limits: dict[str, int] = {}
        self._is_shut = asyncio.Event()
        # Calls and streams that may wait for the server.
        self._waiting: weakref.WeakSet[Any] = weakref.WeakSet()

    @property
    def address(self) -> str:
        return self._target.address

    @property
    def token(self) -> str | None:
        return self._target.token

    async def info(self) -> ServerInfo:
        found = await self._call(requests.info())
        self._limits = found.limits
        return found

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

    async def make_link(
        self, session: Session | str | None = None, *, forks: int = 0, uses: int = 0, seconds: int = 0
    ) -> str:
        session_id = session.id if isinstance(session, Session) else session or ""
        return await self._call(requests.link(self.address, session_id, forks, uses, seconds))

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
    ) -> Opening[Session]:
        async def make() -> Session:
            begun = read_begin(begin)
            given = uploads.read_scene(scene) if checkpoint is None else uploads.NOTHING
            ids = {name: (await self._upload(given.mesh(name))).mesh_id for name in given.meshes}
            at = None if begun is None else begun.message((await self._upload(begun.mesh)).mesh_id)
            file = None if checkpoint is None else uploads.from_checkpoint(Path(checkpoint))
            kept = None if file is None else (await self._upload(file)).mesh_id
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
                    begin=at,
                    checkpoint_id=kept,
                )
            )
            told = (*answer.warnings, *(begun.warnings if begun else ()))
            made = Session(self, answer.session, given.text, made_here=True, warnings=told)
            fault = begun.fault(answer.session) if begun else None
            if fault is not None:
                await made.delete()
                raise fault
            return made

        return Opening("server.create(...)", make)

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
        if self._loop.is_running:
            self._is_shut.set()
            # Which of them a channel would end differs from version to version of gRPC.
            for call in list(self._waiting):
                call.cancel()
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

    async def _pieces(self, call: Call[Message]) -> AsyncIterator[Message]:
        stream = self._stream(call.name, call.message, False)
        try:
            async for piece in stream:
                yield piece
        except grpc.RpcError as status:
            self._check_usable()
            raise from_call(status, self.address, call.name, call.limit) from None
        finally:
            self._waiting.discard(stream)

    async def _known_limits(self) -> dict[str, int]:
        return self._limits or (await self.info()).limits

    async def _ask(self, name: str, message: Any, limit: float | None) -> Any:
        """One call; once more if the server was started anew and left another token."""
        try:
            return await self._once(name, message, limit)
        except Unauthenticated:
            if not self._target.find_again():
                raise
        return await self._once(name, message, limit)

    async def _once(self, name: str, message: Any, limit: float | None) -> Any:
        call = self._method(name, False)(message(), timeout=limit, metadata=self._target.metadata)
        self._waiting.add(call)
        try:
            return await call
        except grpc.RpcError as status:
            self._check_usable()
            raise from_call(status, self.address, name, limit) from None
        except asyncio.CancelledError:
            if not is_cancelled():
                self._check_usable()
            raise
        finally:
            self._waiting.discard(call)

    async def _rest(self, seconds: float) -> None:
        """Waits, but no longer than until the connection is closed."""
        closing = asyncio.ensure_future(self._is_shut.wait())
        try:
            await asyncio.wait({closing}, timeout=seconds)
        finally:
            closing.cancel()

    def _stream(self, name: str, message: Message, every: bool) -> Any:
        """A stream, on the connection of its kind."""
        call = self._method(name, every)(message, metadata=self._target.metadata)
        self._waiting.add(call)
        return call

    def _find_token_again(self) -> bool:
        return self._target.find_again()

    def _check_usable(self) -> None:
        check_usable(self._pid, self._closed, self.address)
        self._loop.check(self.address)

    def _method(self, name: str, bulk: bool) -> Any:
        self._check_usable()
        if (bulk, name) not in self._methods:
            if bulk not in self._channels:
                options = self._target.options(bulk)
                self._channels[bulk] = grpc.aio.insecure_channel(self._target.grpc, options)
            self._methods[(bulk, name)] = METHODS[name].on(self._channels[bulk])
        return self._methods[(bulk, name)]
