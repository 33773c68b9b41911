"""A server of one's own: the program `nappe-server` as a child of this process, which it never outlives.

Enters: settings. Leaves: a process that listens, its address and its token. It ends when its input closes, which the
system does where this process is killed.
"""

from __future__ import annotations

import contextlib
import logging
import os
import secrets
import shutil
import subprocess
import sysconfig
import tempfile
import threading
import weakref
from collections import deque
from pathlib import Path
from queue import Empty, Queue
from typing import IO, Any

from nappe._wire._errors import Error, refused
from nappe._wire._files import REPOSITORY

START_LIMIT = 8.0
"""Longest time until a server says where it listens (s)."""
_END_LIMIT = 10.0
_PROGRAM = "nappe-server"
_OPENING = "nappe-server listens on "
# Settings that `serve` gives by itself.
_OWN = {"address", "token", "no_token", "until_stdin_closes", "allow_remote"}

_log = logging.getLogger("nappe.server")


def program() -> str:
    """The program: that of `NAPPE_SERVER_PROGRAM`, the one that a wheel put beside this Python, the one on PATH, or the
    one built in the repository."""
    if named := os.environ.get("NAPPE_SERVER_PROGRAM"):
        return named
    if found := shutil.which(_PROGRAM, path=sysconfig.get_path("scripts")) or shutil.which(_PROGRAM):
        return found
    target = Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target"))
    built = target / "release" / _PROGRAM
    if built.is_file():
        return str(built)
    raise Error(
        f"the program {_PROGRAM} is not found",
        remedy="`cargo install --locked --path server`, in a clone of nappe, puts it on PATH; a wheel that "
        "`cargo xtask wheel` makes there brings it; or name it in NAPPE_SERVER_PROGRAM.",
    )


def flags(settings: dict[str, Any]) -> list[str]:
    """Settings as flags of the program: `max_sessions=3` is `--max-sessions 3`."""
    words = []
    for name, value in settings.items():
        if name in _OWN:
            raise refused(f"serve() gives {name} by itself; start nappe-server to set it, and connect()", name)
        flag = "--" + name.replace("_", "-")
        if value is True:
            words.append(flag)
        elif value is not None and value is not False:
            joined = ",".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)
            words.append(f"{flag}={joined}")
    return words


def _forget_in_children(server: ServerProcess) -> None:
    """A process that is forked from this one must not keep the server's input open: the server ends with this one."""
    known = weakref.ref(server)

    def forget() -> None:
        held = known()
        if held is not None and held._process.stdin is not None:
            with contextlib.suppress(OSError):
                held._process.stdin.close()

    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=forget)


class ServerProcess:
    """A server that runs, until it is ended."""

    def __init__(self, threads: int | None, settings: dict[str, Any]) -> None:
        """Starts the program and waits until it listens; its words are in the error where it does not."""
        if threads is not None:
            settings = {"max_threads_per_session": threads, **settings}
        self.token = secrets.token_hex(16)
        self._folder = tempfile.TemporaryDirectory(prefix="nappe-")
        self.token_file = Path(self._folder.name) / "token"
        """The file in which the token is, for other programs that are to call the server."""
        self._said: deque[str] = deque(maxlen=20)
        try:
            self._process = self._started(flags({"log": "warn", **settings}))
            self.address = self._listens()
            _forget_in_children(self)
        except BaseException:
            self.end(patience=0.0)
            raise

    def _started(self, words: list[str]) -> subprocess.Popen[str]:
        descriptor = os.open(self.token_file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(descriptor, "w") as file:
            file.write(self.token + "\n")
        path = self._program = program()
        command = [path, "--address", "127.0.0.1:0", "--token", str(self.token_file), "--until-stdin-closes", *words]
        # What the environment says of these is meant for another server.
        kept = {name: value for name, value in os.environ.items() if name not in ("NAPPE_ADDRESS", "NAPPE_NO_TOKEN")}
        kept["NO_COLOR"] = "1"
        pipe = subprocess.PIPE
        try:
            return subprocess.Popen(
                command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, env=kept, start_new_session=True
            )
        except OSError as error:
            raise Error(f"{path} cannot be started: {error.strerror}") from error

    def _listens(self) -> str:
        """The address in the first line of its output."""
        lines: Queue[str] = Queue()
        errors = self._follow(self._process.stderr, self._hear)
        self._follow(self._process.stdout, lines.put)
        try:
            line = lines.get(timeout=START_LIMIT)
        except Empty:
            line = None
        if line is not None and line.startswith(_OPENING):
            return line.removeprefix(_OPENING).strip()
        if line == "":  # the output is at its end: so will be the program, and what it had to say
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(1.0)
            errors.join(1.0)
        code = self._process.poll()
        what = (
            f"ended with code {code}" if code is not None else f"did not say where it listens within {START_LIMIT:g} s"
        )
        if line:
            what = f"said {line.strip()!r} and no address"
        told = "\n".join(self._said)
        raise Error(f"{self._program} {what}" + (f":\n{told}" if told else ""))

    def _follow(self, output: IO[str] | None, hear: Any) -> threading.Thread:
        """Reads an output on a thread of its own, so that the program never waits for it; an empty line is its end."""

        def read() -> None:
            if output is not None:
                for line in output:
                    hear(line)
                hear("")

        thread = threading.Thread(target=read, name="nappe-server output", daemon=True)
        thread.start()
        return thread

    def _hear(self, line: str) -> None:
        if line.strip():
            self._said.append(line.rstrip())
            _log.info("%s", line.rstrip())

    @property
    def pid(self) -> int:
        """The number of the process."""
        return self._process.pid

    @property
    def said(self) -> str:
        """The last lines that it wrote."""
        return "\n".join(self._said)

    def poll(self) -> int | None:
        """Its exit code, if it has ended."""
        return self._process.poll()

    def end(self, patience: float = _END_LIMIT) -> None:
        """Ends it: asks, waits so many seconds, and kills what does not end."""
        process = getattr(self, "_process", None)
        if process is not None and process.poll() is None:
            with contextlib.suppress(OSError):
                process.stdin.close()
            try:
                process.wait(patience)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._folder.cleanup()
