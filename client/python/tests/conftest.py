"""One real server for all tests, and what goes wrong between it and a client."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Callable, Iterator

import pytest

import nappe


@pytest.fixture(scope="session")
def server() -> Iterator[nappe.Server]:
    with nappe.serve(max_sessions=100) as started:
        yield started


def eventually(holds: Callable[[], bool], seconds: float = 120.0) -> float:
    """Waits until something holds, and returns how long that took (s)."""
    begin = time.monotonic()
    while not holds():
        assert time.monotonic() - begin < seconds, "it does not come to hold"
        time.sleep(0.005)
    return time.monotonic() - begin


class Proxy:
    """Carries bytes between clients and a server, and cuts all connections when told so, or after so many bytes. It can
    hold bytes back, as if the server did not answer."""

    def __init__(self, target: tuple[str, int]) -> None:
        self._target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._open: set[socket.socket] = set()
        self._lock = threading.Lock()
        self.cut_after: list[int] = []
        self._carried = 0
        self._flows = threading.Event()
        self._flows.set()
        self.cuts = 0
        threading.Thread(target=self._accept, daemon=True).start()

    @property
    def address(self) -> str:
        return f"127.0.0.1:{self._listener.getsockname()[1]}"

    def hold(self) -> None:
        """Holds back what comes from now on, until the connections are cut, with which it is lost."""
        self._flows.clear()

    def cut(self) -> None:
        with self._lock:
            cut, self._open = self._open, set()
            self._carried = 0
        for end in cut:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
        self._flows.set()

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)  # wakes who accepts
        self._listener.close()
        self.cut()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
                server = socket.create_connection(self._target)
            except OSError:
                return
            with self._lock:
                self._open |= {client, server}
            threading.Thread(target=self._carry, args=(client, server, False), daemon=True).start()
            threading.Thread(target=self._carry, args=(server, client, True), daemon=True).start()

    def _carry(self, source: socket.socket, sink: socket.socket, counts: bool) -> None:
        try:
            while data := source.recv(1 << 16):
                self._flows.wait()
                sink.sendall(data)
                if counts and self._is_enough(len(data)):
                    self.cuts += 1
                    self.cut()
        except OSError:
            pass
        for end in (source, sink):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def _is_enough(self, count: int) -> bool:
        with self._lock:
            self._carried += count
            if self.cut_after and self._carried >= self.cut_after[0]:
                self.cut_after.pop(0)
                return True
            return False


def proxy_before(server: nappe.Server) -> Proxy:
    host, port = server.address.removeprefix("http://").split(":")
    return Proxy((host, int(port)))


@pytest.fixture
def proxy(server: nappe.Server) -> Iterator[Proxy]:
    between = proxy_before(server)
    yield between
    between.close()
