"""Servers started, reached, and not: programs that die, wrong tokens, interpreters that are killed."""

from __future__ import annotations

import http.server
import os
import signal
import stat
import subprocess
import sys
import sysconfig
import textwrap
import threading
import time
from pathlib import Path

import pytest
from conftest import eventually

import nappe
from nappe import v1
from nappe._server import _launch, _targets


def program_that(folder: Path, does: str) -> str:
    path = folder / "server"
    path.write_text(f"#!{sys.executable}\n{does}\n")
    path.chmod(0o755)
    return str(path)


@pytest.mark.parametrize(
    ("does", "told"),
    [
        ("import sys; print('the moon is full', file=sys.stderr); sys.exit(3)", ["code 3", "the moon is full"]),
        ("import time; time.sleep(60)", ["did not say where it listens"]),
        ("print('hello', flush=True); import time; time.sleep(60)", ["'hello'"]),
    ],
)
def test_a_program_that_does_not_serve_is_told_in_its_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, does: str, told: list[str]
) -> None:
    if "time.sleep" in does and "print" not in does:
        monkeypatch.setattr(_launch, "START_LIMIT", 1.0)
    monkeypatch.setenv("NAPPE_SERVER_PROGRAM", program_that(tmp_path, does))
    with pytest.raises(nappe.Error) as error:
        nappe.serve()
    for words in told:
        assert words in str(error.value)
    assert str(tmp_path) in str(error.value)


def test_a_program_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NAPPE_SERVER_PROGRAM", "/nowhere/nappe-server")
    with pytest.raises(nappe.Error, match="/nowhere/nappe-server"):
        nappe.serve()


def test_without_a_program_it_says_how_to_install_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NAPPE_SERVER_PROGRAM", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("CARGO_TARGET_DIR", str(tmp_path))
    monkeypatch.setattr(sysconfig, "get_path", lambda _: str(tmp_path))
    with pytest.raises(nappe.Error, match="cargo install --locked --path server"):
        nappe.serve()


def test_the_program_of_a_wheel_comes_before_another_one_on_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    beside, on_path = tmp_path / "beside", tmp_path / "path"
    for folder in (beside, on_path):
        folder.mkdir()
        (folder / "nappe-server").write_text("#!/bin/sh\n")
        (folder / "nappe-server").chmod(0o755)
    monkeypatch.delenv("NAPPE_SERVER_PROGRAM", raising=False)
    monkeypatch.setenv("PATH", str(on_path))
    monkeypatch.setattr(sysconfig, "get_path", {"scripts": str(beside)}.__getitem__)
    assert _launch.program() == str(beside / "nappe-server")
    (beside / "nappe-server").unlink()
    assert _launch.program() == str(on_path / "nappe-server")


def test_settings_are_flags_and_a_wrong_one_is_told_in_the_servers_words() -> None:
    with nappe.serve(threads=1, max_sessions=2, allow_host=["a.example", "b.example"]) as server:
        limits = server.info().limits
        assert (limits["max_threads_per_session"], limits["max_sessions"]) == (1, 2)
        with server.create("flag"), server.create("flag"), pytest.raises(nappe.Full) as full:
            server.create("flag")
        assert full.value.reason == "TOO_MANY_SESSIONS" and full.value.remedy
    with pytest.raises(nappe.Error, match="--maxi-sessions"):
        nappe.serve(maxi_sessions=2)
    with pytest.raises(nappe.Refused, match="by itself"):
        nappe.serve(address="0.0.0.0:1")


def test_the_token_is_in_a_file_of_its_own_that_goes_with_the_server() -> None:
    with nappe.serve() as server:
        assert server.process is not None
        file = server.process.token_file
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
        assert file.read_text().strip() == server.token and str(server.token) not in repr(server)
        process = server.process
    assert not file.exists() and process.poll() == 0
    with pytest.raises(nappe.Error, match="closed"):
        server.info()


def test_an_exception_in_the_block_ends_the_server() -> None:
    with pytest.raises(ZeroDivisionError), nappe.serve() as server:
        _ = 1 / 0
    assert server.process is not None and server.process.poll() is not None


def is_there(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().split(")")[1].split()[0] != "Z"
    except OSError:
        return False


def test_a_killed_interpreter_takes_its_server_along() -> None:
    program = textwrap.dedent("""
        import time, nappe
        server = nappe.serve()
        session = server.create("flag", step_limit=0)
        frames = session.frames(every=True)
        session.play()
        next(frames)
        print(server.process.pid, flush=True)
        time.sleep(60)
    """)
    for _ in range(3):
        with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as python:
            assert python.stdout is not None
            pid = int(python.stdout.readline())
            assert is_there(pid)
            python.send_signal(signal.SIGKILL)
        # On a machine with nothing else to do it takes 0.1 s.
        eventually(lambda pid=pid: not is_there(pid))


def test_a_forked_child_does_not_keep_the_server_of_a_killed_parent() -> None:
    program = textwrap.dedent("""
        import os, time, nappe
        server = nappe.serve()
        if os.fork() == 0:
            time.sleep(60)
            os._exit(0)
        print(server.process.pid, os.getpgrp(), flush=True)
        time.sleep(60)
    """)
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as python:
        assert python.stdout is not None
        pid, group = map(int, python.stdout.readline().split())
        python.send_signal(signal.SIGKILL)
        python.wait()
        eventually(lambda: not is_there(pid))
        os.killpg(group, signal.SIGKILL)


def test_tokens_that_are_missing_or_wrong_are_refused(server: nappe.Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_targets, "_folders", list)  # where it would be found
    for token, reason in ((None, "TOKEN_MISSING"), ("0" * 32, "TOKEN_WRONG")):
        with pytest.raises(nappe.Unauthenticated) as refused:
            nappe.connect(server.address, token)
        assert refused.value.reason == reason and refused.value.remedy
    with nappe.connect(server.address, server.process.token_file if server.process else None) as again:
        assert again.info().version == server.info().version


def test_nobody_who_answers_is_unavailable() -> None:
    begin = time.monotonic()
    with pytest.raises(nappe.Unavailable, match=r"no server answers at http://127\.0\.0\.1:9"):
        nappe.connect("127.0.0.1:9")
    assert time.monotonic() - begin < 10


def test_a_server_of_something_else_is_told_as_such() -> None:
    web = http.server.ThreadingHTTPServer(("127.0.0.1", 0), http.server.BaseHTTPRequestHandler)
    threading.Thread(target=web.serve_forever, daemon=True).start()
    try:
        with pytest.raises(nappe.Error, match=str(web.server_port)):
            nappe.connect(f"http://127.0.0.1:{web.server_port}")
    finally:
        web.shutdown()


def start(address: str, token: Path | None, folder: Path, *options: str) -> subprocess.Popen[str]:
    shown = ["--token", str(token)] if token else []
    words = [_launch.program(), "--address", address, "--log", "error", *shown, *options]
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None and "listens on" in process.stdout.readline()
    return process


def test_a_server_that_is_started_anew_on_its_port_is_found_again_with_its_new_token(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with nappe.serve() as server:  # to find a port that is free
        address = server.address.removeprefix("http://")
    first = start(address, None, tmp_path)
    try:
        client = nappe.connect(address)
        session = client.create("flag")
        frames = session.frames(every=True)
        next(frames)
        token = client.token
        first.kill()
        first.wait()
        second = start(address, None, tmp_path)
        try:
            with pytest.raises(nappe.NotFound) as told:
                next(frames)
            assert told.value.reason == "SESSION_NOT_FOUND"
            assert client.sessions() == [] and client.token not in (None, token)
        finally:
            second.kill()
            second.wait()
        client.close()
    finally:
        first.kill()
        first.wait()


def test_who_reads_every_frame_goes_on_where_the_server_was_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with nappe.serve() as server:  # to find a port that is free
        address = server.address.removeprefix("http://")
    # The start is kept, and all since then is in the log: every frame is made again.
    options = ("--state-dir", str(tmp_path / "states"), "--checkpoint-seconds", "3600")
    kept = start(address, None, tmp_path, *options)
    try:
        with nappe.connect(address) as client:
            session = client.create("flag", step_limit=0)
            frames = session.frames(every=True)
            numbers = [next(frames).number]
            session.play(real_time_factor=1.0)
            for _ in range(3):
                numbers += [next(frames).number for _ in range(5)]
                kept.kill()
                kept.wait()
                kept = start(address, None, tmp_path, *options)
            numbers += [next(frames).number for _ in range(5)]
            assert numbers == list(range(21)) and frames.reconnects > 0
    finally:
        kept.kill()
        kept.wait()


def test_a_socket_of_unix_is_a_server_too(tmp_path: Path) -> None:
    socket = tmp_path / "s"
    process = start(f"unix:{socket}", None, tmp_path)
    try:
        with nappe.connect(f"unix:{socket}") as server, server.create("flag") as session:
            assert next(session.frames()).number == 0
    finally:
        process.terminate()
        process.wait()


def opened(server: nappe.Server, link: str) -> nappe.Server:
    """A connection with the token that a link gives, as a browser gets it."""
    code = link.rpartition("#")[2]
    token = server._ask("OpenLink", lambda: v1.OpenLinkRequest(code=code), 10.0).token
    return nappe.connect(server.address, token)


def test_a_link_to_a_session_is_opened_so_often_and_gives_copies_of_one_s_own(server: nappe.Server) -> None:
    with server.create("flag", thread_count=1) as shown:
        link = server.make_link(shown, forks=1, uses=2, seconds=60)
        assert link.startswith(f"{server.address}/?session={shown.id}#")
        with opened(server, link) as first, opened(server, link) as second:
            with pytest.raises(nappe.NotFound):
                opened(server, link)
            copy = first.session(shown.id).fork()
            copy.step(2)
            assert {session.id for session in first.sessions()} == {shown.id, copy.id}
            assert [session.id for session in second.sessions()] == [shown.id]
            for refused in (first.session(shown.id).fork, first.session(shown.id).step):
                with pytest.raises(nappe.Error) as told:
                    refused()
                assert told.value.reason == "LINK_TOO_NARROW"
            copy.delete()
    assert server.make_link().startswith(f"{server.address}/#")
