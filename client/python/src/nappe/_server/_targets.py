"""Which server is meant: its address, the token that it is shown, how a connection to it is set up.

Enters: what a user types. Leaves: a target for gRPC. The token of a server of the same user on this machine is found in
the file that it left, as docs/service.md says; a server elsewhere is shown none that was not given.
"""

from __future__ import annotations

import ipaddress
import os
import re
import stat
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from nappe._wire._errors import Error, refused

DEFAULT_SERVER = "127.0.0.1:6277"
"""Where a server listens unless it is told otherwise."""

# A host, or an address of version 6 in brackets, and a port.
_ADDRESS = re.compile(r"(?P<host>[^\s:/\[\]@]+|\[[0-9A-Fa-f:.]+\])(?::(?P<port>[0-9]{1,5}))?")
_Option = tuple[str, int]
_COMMON: tuple[_Option, ...] = (
    ("grpc.max_receive_message_length", 8 << 20),
    ("grpc.max_send_message_length", -1),
    ("grpc.enable_http_proxy", 0),
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.min_reconnect_backoff_ms", 1000),
    ("grpc.max_reconnect_backoff_ms", 1000),
    # A server that is gone without a word is noticed within half a minute.
    ("grpc.keepalive_time_ms", 10_000),
    ("grpc.keepalive_timeout_ms", 20_000),
    ("grpc.http2.max_pings_without_data", 0),
    ("grpc.http2.bdp_probe", 0),
)
FRESH: tuple[_Option, ...] = (*_COMMON, ("grpc.http2.lookahead_bytes", 256 << 10))
"""For calls and streams of the newest: what is on its way ages."""
BULK: tuple[_Option, ...] = (*_COMMON, ("grpc.http2.lookahead_bytes", 4 << 20), ("grpc.http2.max_frame_size", 1 << 20))
"""For streams of every frame: fast, over long lines too."""


@dataclass
class Target:
    """A server that can be connected to."""

    address: str
    """The address in words."""
    grpc: str
    """The same in the words of gRPC."""
    token: str | None
    """What it is shown."""
    port: int | None = None
    """Where the token of a server of this user is looked for; None where one was given, or none may be shown."""

    def options(self, bulk: bool) -> tuple[tuple[str, int | str], ...]:
        """How a connection is set up: for streams of every frame, or for everything else."""
        kind = BULK if bulk else FRESH
        # A path is no host, to which requests over a socket of Unix could be addressed.
        return (*kind, ("grpc.default_authority", "localhost")) if self.grpc.startswith("unix:") else kind

    @property
    def metadata(self) -> tuple[tuple[str, str], ...]:
        """What every call shows."""
        return () if self.token is None else (("authorization", f"Bearer {self.token}"),)

    def find_again(self) -> bool:
        """Looks for the token again: a server that was started anew has another. True if it has."""
        if self.port is None:
            return False
        before, found = self.token, _local(self.port, _reached(self.grpc))
        self.token = found[1] if found else None
        return self.token is not None and self.token != before

    def __repr__(self) -> str:
        """The address; never the token."""
        return f"Target({self.address!r})"


def read(url: str | None, token: str | os.PathLike[str] | None) -> Target:
    """Reads `HOST:PORT`, `http://HOST:PORT` or `unix:PATH`; without one, `NAPPE_SERVER` or the usual port.

    `token`: the token itself, or the `Path` of a file whose first line it is; without one, `NAPPE_TOKEN_FILE`.
    """
    typed = url if url is not None else os.environ.get("NAPPE_SERVER", DEFAULT_SERVER)
    given = _given(token)
    if typed.startswith("unix:"):
        if typed == "unix:":
            raise _no_address(typed, "it names no path")
        return Target(typed, typed, given)
    scheme, _, rest = typed.rpartition("://")
    if "://" in typed and scheme != "http":
        raise _no_address(typed, "only http:// and unix: are spoken; put TLS in a proxy")
    found = _ADDRESS.fullmatch(rest.rstrip("/"))
    if found is None or not 0 < int(found["port"] or 80) < 65536:
        raise _no_address(typed, "it has no host and port")
    host, port_text = found["host"], found["port"] or "80"
    port, address = int(port_text), f"{host}:{port_text}"
    if given is not None or not _is_loopback(host):
        return Target(f"http://{address}", address, given)
    # `localhost` means two addresses, and somebody else may listen on one of them.
    local = _local(port, None if host == "localhost" else _reached(address))
    if local is None:
        return Target(f"http://{address}", address, None, None if host == "localhost" else port)
    return Target(f"http://{address}", local[0], local[1], port)


def _given(token: str | os.PathLike[str] | None) -> str | None:
    file = os.environ.get("NAPPE_TOKEN_FILE") if token is None else token if isinstance(token, os.PathLike) else None
    if file is None:
        return None if token is None else _checked(str(token), "token")
    try:
        with Path(file).open(encoding="ascii", errors="replace") as opened:
            mode = os.fstat(opened.fileno()).st_mode
            if hasattr(os, "getuid") and stat.S_ISREG(mode) and mode & 0o006:
                raise Error(
                    f"the token file {os.fspath(file)}: every user of this machine may read or write it "
                    f"(mode {mode & 0o777:03o}); allowed: its owner, and a group: `chmod 600 {os.fspath(file)}`"
                )
            text = opened.read(4096)
    except OSError as error:
        raise Error(f"the token file {os.fspath(file)} cannot be read: {error.strerror}") from error
    return _checked(text.partition("\n")[0].strip(), f"the first line of {os.fspath(file)}")


def _checked(token: str, name: str) -> str:
    if not _is_token(token):
        raise refused(f"{name} is no token: 16 to 512 printable characters of ASCII and no blanks", "token")
    return token


def _is_token(text: str) -> bool:
    return 16 <= len(text) <= 512 and all("!" <= character <= "~" for character in text)


def _no_address(typed: str, cause: str) -> Error:
    return refused(
        f"{typed!r} is not the address of a server: {cause} (expected, for example, {DEFAULT_SERVER})", "url"
    )


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def _local(port: int, address: str | None) -> tuple[str, str] | None:
    """Address and token of a server of this user that lives and listens on a port, at an address if one is given."""
    for folder in _folders():
        token, _, rest = (_locked(folder / f"{port}.token") or "").partition("\n")
        listens = _reached(rest.partition("\n")[0])
        if _is_token(token) and listens is not None and address in (None, listens):
            return (listens, token)
    return None


def _reached(address: str) -> str | None:
    """Where a client of this machine reaches a server that listens at `IP:PORT`; None if that is no address."""
    host, _, port = address.rpartition(":")
    try:
        ip = ipaddress.ip_address(host.strip("[]"))
    except ValueError:
        return None
    if ip.is_unspecified:
        return f"127.0.0.1:{port}" if ip.version == 4 else f"[::1]:{port}"
    return f"{ip}:{port}" if ip.version == 4 else f"[{ip}]:{port}"


def _folders() -> Iterator[Path]:
    if not hasattr(os, "getuid"):
        return
    user = os.getuid()
    if runtime := os.environ.get("XDG_RUNTIME_DIR"):
        yield Path(runtime) / "nappe"
    yield Path(f"/run/user/{user}/nappe")
    yield Path(tempfile.gettempdir()) / f"nappe-{user}"


def _locked(path: Path) -> str | None:
    """The text of a token file, if its server lives: it is this user's, and a process holds the lock on it."""
    import fcntl

    try:
        with path.open(encoding="ascii") as file:
            held = os.fstat(file.fileno())
            if held.st_uid != os.getuid() or held.st_mode & 0o077:
                return None
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return file.read(4096)
    except (OSError, UnicodeDecodeError):
        pass
    return None
