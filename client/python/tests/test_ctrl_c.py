"""Ctrl-C in a program that waits for steps: the session is paused, the program is told, and all can go on."""

from __future__ import annotations

import asyncio
import logging
import re
import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable

import pytest
from conftest import eventually

import nappe
import nappe.aio

PLAIN = """
import sys, nappe
session = nappe.connect(sys.argv[1], sys.argv[2]).session(sys.argv[3])
print("ready", flush=True)
{wait}
"""
AWAITED = """
import asyncio, sys, nappe.aio
async def main():
    session = await (await nappe.aio.connect(sys.argv[1], sys.argv[2])).session(sys.argv[3])
    print("ready", flush=True)
    await {wait}
asyncio.run(main())
"""
PAUSED = re.compile(
    r"session '(\S+)' is paused after step (\d+): step\(\) or play\(\) goes on, and trajectory\(stop=\2\)"
)


def interrupted(server: nappe.Server, session: nappe.Session, program: str, until: Callable[[], bool]) -> str:
    """What a program wrote that met Ctrl-C after it was ready and something came to hold."""
    command = [sys.executable, "-c", textwrap.dedent(program), server.address, str(server.token), session.id]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as waiting:
        assert waiting.stdout is not None and waiting.stdout.readline() == "ready\n"
        eventually(lambda: until() or waiting.poll() is not None)
        waiting.send_signal(signal.SIGINT)
        _, told = waiting.communicate(timeout=60)
    assert waiting.returncode != 0
    return told


@pytest.mark.parametrize("wait", ["session.step(10**6)", "session.trajectory(stop=10**5)"])
@pytest.mark.parametrize("program", [PLAIN, AWAITED], ids=["plain", "asyncio"])
def test_the_session_is_paused_and_the_program_told(server: nappe.Server, program: str, wait: str) -> None:
    with server.create("flag", step_limit=0) as session:
        told = interrupted(server, session, program.format(wait=wait), lambda: session.refresh().steps_taken > 20)
        found = PAUSED.search(told)
        assert found is not None and "KeyboardInterrupt" in told, told
        assert (session.refresh().state, session.id, session.steps_taken) == ("paused", found[1], int(found[2]))
        assert session.trajectory(stop=session.steps_taken).step[-1] > session.steps_taken - 4
        session.step()
        assert session.steps_taken == int(found[2]) + 1


def test_a_session_that_somebody_plays_is_paused_too(server: nappe.Server) -> None:
    with server.create("flag", step_limit=0) as session:
        session.play(real_time_factor=1.0)
        program = PLAIN.format(wait="session.trajectory(stop=10**5)")
        told = interrupted(server, session, program, lambda: session.refresh().watcher_count == 1)
        assert PAUSED.search(told) and session.refresh().state == "paused", told


def test_where_the_server_is_gone_the_session_may_go_on() -> None:
    class Gone:
        """A server that Ctrl-C meets and that answers nothing after it."""

        address = "127.0.0.1:9"

        def _call(self, call: object) -> None:
            if call.name == "StepSession":  # type: ignore[attr-defined]
                raise KeyboardInterrupt
            raise nappe.Unavailable("no server answers at 127.0.0.1:9")

    raw = nappe.v1.Session(session_id="flag", state=nappe.v1.SESSION_STATE_PLAYING)
    session = nappe.Session(Gone(), raw)  # type: ignore[arg-type]
    with pytest.raises(KeyboardInterrupt) as told:
        session.step(5)
    assert str(told.value) == ("session 'flag' was told to pause, but it may go on: no server answers at 127.0.0.1:9")
    with pytest.raises(KeyboardInterrupt) as silent:
        session.step(5, wait=False)
    assert str(silent.value) == ""


async def test_a_cancelled_wait_pauses_the_session(server: nappe.Server, caplog: pytest.LogCaptureFixture) -> None:
    async with (
        nappe.aio.connect(server.address, server.token) as client,
        client.create("flag", step_limit=0) as session,
    ):
        for waits in (lambda: session.step(10**6), lambda: session.trajectory(stop=10**5)):
            caplog.clear()
            with caplog.at_level(logging.WARNING, "nappe"), pytest.raises(asyncio.TimeoutError):
                await asyncio.wait_for(waits(), 0.2)
            assert (await session.refresh()).state == "paused" and session.steps_taken > 0
            assert f"is paused after step {session.steps_taken}" in caplog.text
