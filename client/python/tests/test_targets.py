"""Which server is meant and what it is shown: a token that was found goes only to the server that left it."""

from __future__ import annotations

import contextlib
import fcntl
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import nappe
from nappe._server._launch import flags
from nappe._server._targets import DEFAULT_SERVER, Target, read

TOKEN = "0123456789abcdef0123456789abcdef"
OTHER = "fedcba9876543210fedcba9876543210"
# No server of a user's listens there.
PORT = 1
HERE = f"127.0.0.1:{PORT}"
LOCK = """
import fcntl, sys
with open(sys.argv[1]) as file:
    fcntl.flock(file, fcntl.LOCK_EX)
    print("locked", flush=True)
    sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where a server of this user leaves its token; nothing of the real environment counts."""
    for name in ("NAPPE_SERVER", "NAPPE_TOKEN_FILE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    made = tmp_path / "nappe"
    made.mkdir(mode=0o700)
    return made


def left(folder: Path, address: str = HERE, token: str = TOKEN) -> Path:
    """The file of a server, which nobody has locked yet."""
    path = folder / f"{PORT}.token"
    path.write_text(f"{token}\n{address}\n", encoding="utf-8")
    path.chmod(0o600)
    return path


@contextlib.contextmanager
def locked(path: Path) -> Iterator[None]:
    """A server lives: the lock belongs to a descriptor, and conflicts with every other one."""
    with path.open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def refusal(field: str, url: str | None = None, token: Any = None) -> str:
    with pytest.raises(nappe.Refused) as told:
        read(url, token)
    assert told.value.field == field
    return str(told.value)


@pytest.mark.parametrize(
    ("typed", "grpc", "address"),
    [
        (HERE, HERE, f"http://{HERE}"),
        ("http://127.0.0.1:6277", "127.0.0.1:6277", "http://127.0.0.1:6277"),
        ("http://127.0.0.1:6277/", "127.0.0.1:6277", "http://127.0.0.1:6277"),
        ("localhost:6277", "localhost:6277", "http://localhost:6277"),
        ("[::1]:6277", "[::1]:6277", "http://[::1]:6277"),
        ("server.example", "server.example:80", "http://server.example:80"),
        ("http://192.0.2.1", "192.0.2.1:80", "http://192.0.2.1:80"),
        ("a:65535", "a:65535", "http://a:65535"),
        ("unix:/run/nappe.sock", "unix:/run/nappe.sock", "unix:/run/nappe.sock"),
        ("unix:relative/nappe.sock", "unix:relative/nappe.sock", "unix:relative/nappe.sock"),
    ],
)
def test_an_address_is_read_as_it_is_typed(typed: str, grpc: str, address: str) -> None:
    target = read(typed, TOKEN)
    assert (target.grpc, target.address, target.token) == (grpc, address, TOKEN)


@pytest.mark.parametrize(
    "typed",
    [
        "",
        "http://",
        "https://127.0.0.1:6277",
        "ftp://x",
        "://x:1",
        "a:b://c:1",
        ":6277",
        "a:",
        "a:0",
        "a:65536",
        "a:-1",
        "a:6277x",
        "a:²",
        "http://a:6277/path",
        "unix:",
        "::1",
        "::1:6277",
    ],
)
def test_what_is_no_address_is_refused_with_one_that_is(typed: str) -> None:
    told = refusal("url", typed)
    assert told.startswith(f"{typed!r} is not the address of a server: ") and DEFAULT_SERVER in told


def test_an_address_that_would_need_tls_says_what_to_do() -> None:
    assert "put TLS in a proxy" in refusal("url", "https://server.example:443")
    assert "names no path" in refusal("url", "unix:")


def test_without_an_address_the_variable_counts_then_the_usual_port(monkeypatch: pytest.MonkeyPatch) -> None:
    assert DEFAULT_SERVER == "127.0.0.1:6277" and read(None, TOKEN).grpc == DEFAULT_SERVER
    monkeypatch.setenv("NAPPE_SERVER", "server.example:1234")
    assert read(None, TOKEN).grpc == "server.example:1234"
    assert read(HERE, TOKEN).grpc == HERE
    monkeypatch.setenv("NAPPE_SERVER", "https://server.example")
    assert "https://server.example" in refusal("url")


def test_a_token_is_shown_as_a_bearer_and_nothing_without_one() -> None:
    assert read("a:1", TOKEN).metadata == (("authorization", f"Bearer {TOKEN}"),)
    assert read("a:1", None).metadata == ()


@pytest.mark.parametrize("typed", [HERE, "localhost:1", "server.example:1", "unix:/run/nappe.sock"])
def test_a_token_is_never_printed(typed: str, folder: Path) -> None:
    given = read(typed, TOKEN)
    assert repr(given) == f"Target({given.address!r})"
    with locked(left(folder)):
        for target in (given, read(typed, None)):
            assert TOKEN not in f"{target} {target!r} {[target]}"


@pytest.mark.parametrize("text", ["x" * 16, "x" * 512, "!~0123456789abcdef"])
def test_a_token_has_16_to_512_printable_characters(text: str, tmp_path: Path) -> None:
    assert read("a:1", text).token == text
    file = private(tmp_path / "t", f"  {text}\t\r\nsecond line\n")
    assert read("a:1", file).token == text


def private(path: Path, text: str) -> Path:
    """A file that its user alone can read."""
    path.touch(mode=0o600)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(("mode", "is_allowed"), [(0o644, False), (0o602, False), (0o640, True), (0o600, True)])
def test_a_token_that_every_user_may_read_is_refused_with_the_command_that_mends_it(
    mode: int, is_allowed: bool, tmp_path: Path
) -> None:
    file = private(tmp_path / "t", TOKEN)
    file.chmod(mode)
    if is_allowed:
        assert read("a:1", file).token == TOKEN
        return
    with pytest.raises(nappe.Error) as told:
        read("a:1", file)
    assert f"`chmod 600 {file}`" in str(told.value) and TOKEN not in str(told.value)


@pytest.mark.parametrize(
    "text",
    ["", "x" * 15, "x" * 513, "0123456789 abcdef", "0123456789\tabcdef", "0123456789abcdé0", "0123456789abcdef\x7f"],
)
def test_what_is_no_token_is_refused_and_not_told(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told = [refusal("token", "a:1", text)]
    file = private(tmp_path / "t", text + "\n")
    told.append(refusal("token", "a:1", file))
    monkeypatch.setenv("NAPPE_TOKEN_FILE", str(file))
    told.append(refusal("token", "a:1"))
    assert "is no token: 16 to 512" in told[0] and str(file) in told[1] and str(file) in told[2]
    assert not any(text and text in message for message in told)


def test_an_argument_with_blanks_around_it_is_no_token() -> None:
    for text in (f" {TOKEN}", f"{TOKEN}\n"):
        assert "no blanks" in refusal("token", "a:1", text)


def test_a_token_is_given_in_a_file_or_by_the_variable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, token in (("one", TOKEN), ("two", OTHER)):
        private(tmp_path / name, f"{token}\n127.0.0.1:6277\n")
    assert read("a:1", tmp_path / "one").token == TOKEN
    monkeypatch.setenv("NAPPE_TOKEN_FILE", str(tmp_path / "two"))
    for typed in ("a:1", HERE, "unix:/run/nappe.sock"):
        assert read(typed, None).token == OTHER
    assert read("a:1", tmp_path / "one").token == TOKEN and read("a:1", TOKEN).token == TOKEN


def test_a_token_file_that_cannot_be_read_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(nappe.Error, match=rf"token file {tmp_path}/none cannot be read: No such file"):
        read("a:1", tmp_path / "none")
    monkeypatch.setenv("NAPPE_TOKEN_FILE", str(tmp_path))
    with pytest.raises(nappe.Error, match=rf"token file {tmp_path} cannot be read: Is a directory"):
        read("a:1", None)


@pytest.mark.parametrize(
    ("typed", "listens", "grpc"),
    [
        (HERE, HERE, HERE),
        (f"http://{HERE}/", HERE, HERE),
        (HERE, "0.0.0.0:1", HERE),
        ("127.0.0.2:1", "127.0.0.2:1", "127.0.0.2:1"),
        ("[::1]:1", "[::1]:1", "[::1]:1"),
        ("[::1]:1", "[::]:1", "[::1]:1"),
        ("localhost:1", HERE, HERE),
        ("localhost:1", "0.0.0.0:1", HERE),
        ("localhost:1", "[::1]:1", "[::1]:1"),
        ("localhost:1", "[::]:1", "[::1]:1"),
    ],
)
def test_the_token_of_a_server_of_this_user_is_found(folder: Path, typed: str, listens: str, grpc: str) -> None:
    with locked(left(folder, listens)):
        target = read(typed, None)
    assert (target.token, target.grpc, target.port) == (TOKEN, grpc, PORT)


@pytest.mark.parametrize(
    ("typed", "listens"),
    [
        (HERE, "127.0.0.2:1"),
        (HERE, "127.0.0.1:2"),
        (HERE, "[::1]:1"),
        ("[::1]:1", HERE),
        # Who listens on all addresses of version 4 does not listen there, and somebody else may.
        ("[::1]:1", "0.0.0.0:1"),
        ("127.0.0.1:2", HERE),
        ("localhost:2", HERE),
    ],
)
def test_a_token_is_not_shown_where_its_server_does_not_listen(folder: Path, typed: str, listens: str) -> None:
    with locked(left(folder, listens)):
        target = read(typed, None)
    assert target.token is None and target.metadata == ()


@pytest.mark.parametrize(
    "typed", ["192.0.2.1:1", "server.example:1", "localhost.example:1", "0.0.0.0:1", "[2001:db8::1]:1", "unix:/run/n"]
)
def test_a_server_elsewhere_is_shown_no_token_that_was_not_given(folder: Path, typed: str) -> None:
    for listens in (typed, HERE, "0.0.0.0:1", "[::]:1"):
        with locked(left(folder, listens)):
            target = read(typed, None)
            assert (target.token, target.port, target.find_again()) == (None, None, False)


def test_a_file_that_no_server_has_locked_is_nobodys(folder: Path) -> None:
    path = left(folder)
    assert read(HERE, None).token is None and read("localhost:1", None).token is None
    with path.open() as file:
        # Whoever looks takes the lock for a moment, with others.
        fcntl.flock(file, fcntl.LOCK_SH)
        assert read(HERE, None).token is None
    with locked(path):
        assert read(HERE, None).token == TOKEN
    assert read(HERE, None).token is None


def test_the_lock_is_that_of_another_process_and_ends_with_it(folder: Path) -> None:
    path = left(folder)
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-S", "-c", LOCK, str(path)], stdin=pipe, stdout=pipe) as server:
        assert server.stdin is not None and server.stdout is not None
        assert server.stdout.readline() == b"locked\n"
        target = read(HERE, None)
        assert target.token == TOKEN and target.find_again() is False and target.token == TOKEN
        server.stdin.close()
        assert server.wait(30) == 0
    assert target.find_again() is False and target.token is None and target.metadata == ()
    assert read(HERE, None).token is None


def test_a_server_that_was_started_anew_is_found_with_its_other_token(folder: Path) -> None:
    target = read(HERE, None)
    assert target.find_again() is False
    with locked(left(folder)):
        assert target.find_again() is True and target.token == TOKEN
        assert target.find_again() is False
    with locked(left(folder, token=OTHER)):
        assert target.find_again() is True and target.metadata == (("authorization", f"Bearer {OTHER}"),)
        given = read(HERE, TOKEN)
        assert given.find_again() is False and given.token == TOKEN


def test_the_name_of_this_machine_is_shown_no_token_of_a_server_that_came_later(folder: Path) -> None:
    target = read("localhost:1", None)
    # The connection is to the name: which of its addresses answers is not known.
    with locked(left(folder)):
        assert target.find_again() is False and target.metadata == ()


@pytest.mark.parametrize("text", ["", TOKEN, "\n\n", f"short\n{HERE}\n", f"{'é' * 20}\n{HERE}\n", "\udcff"])
def test_a_file_that_holds_no_token_and_address_is_passed_over(folder: Path, text: str) -> None:
    path = left(folder)
    path.write_bytes(text.encode("utf-8", errors="surrogateescape"))
    with locked(path):
        assert read(HERE, None).token is None


def test_a_file_that_others_own_or_may_read_is_passed_over(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = left(folder)
    user = os.getuid()
    with locked(path):
        monkeypatch.setattr(os, "getuid", lambda: user + 1)
        assert read(HERE, None).token is None
        monkeypatch.setattr(os, "getuid", lambda: user)
        assert read(HERE, None).token == TOKEN
        path.chmod(0o644)
        assert read(HERE, None).token is None


def test_the_runtime_directory_comes_before_the_temporary_files(folder: Path, tmp_path: Path) -> None:
    temporary = tmp_path / "temporary" / f"nappe-{os.getuid()}"
    temporary.mkdir(parents=True, mode=0o700)
    with locked(left(temporary, token=OTHER)):
        assert read(HERE, None).token == OTHER
        with locked(left(folder)):
            assert read(HERE, None).token == TOKEN
        with locked(left(folder, "127.0.0.2:1")):
            assert read(HERE, None).token == OTHER


def test_a_target_is_a_value_with_nothing_hidden_but_the_token() -> None:
    target = Target("http://a:1", "a:1", TOKEN)
    assert target.port is None and target == read("a:1", TOKEN)


def test_streams_of_every_frame_have_a_wide_window_and_the_newest_a_narrow_one() -> None:
    target = read("a:1", TOKEN)
    every, newest = dict(target.options(True)), dict(target.options(False))
    assert (every["grpc.http2.lookahead_bytes"], newest["grpc.http2.lookahead_bytes"]) == (4 << 20, 256 << 10)
    assert every["grpc.http2.max_frame_size"] == 1 << 20 and "grpc.default_authority" not in every | newest
    for bulk in (True, False):
        assert dict(read("unix:/run/n", None).options(bulk))["grpc.default_authority"] == "localhost"


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({}, []),
        ({"max_sessions": 3}, ["--max-sessions=3"]),
        ({"max_sessions": 0, "log": "warn"}, ["--max-sessions=0", "--log=warn"]),
        ({"verbose": True, "quiet": False, "threads": None}, ["--verbose"]),
        ({"allow_host": ["a.example", "b.example"]}, ["--allow-host=a.example,b.example"]),
        ({"idle_seconds": 0.5, "allow_origin": ("http://a",)}, ["--idle-seconds=0.5", "--allow-origin=http://a"]),
        ({"log": "--no-token"}, ["--log=--no-token"]),
    ],
)
def test_settings_are_flags_of_the_program(settings: dict[str, Any], words: list[str]) -> None:
    assert flags(settings) == words


@pytest.mark.parametrize("name", ["address", "token", "no_token", "until_stdin_closes", "allow_remote"])
def test_what_a_server_of_ones_own_is_given_by_itself_is_refused(name: str) -> None:
    for value in (True, None, "x"):
        with pytest.raises(nappe.Refused, match=f"gives {name} by itself") as told:
            flags({"max_sessions": 3, name: value})
        assert told.value.field == name
