"""Streams that break, are left, or end in every other way; and the same bytes as the client in Rust gets."""

from __future__ import annotations

import logging
import os
import signal
import struct
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import Proxy, eventually

import nappe

ROOT = Path(__file__).parents[3]
RAW = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release/examples/raw"


def rust_frames(output: bytes) -> list[tuple[int, int, bytes]]:
    frames, at = [], 0
    while at < len(output):
        number, state_hash, length = struct.unpack_from("<QQQ", output, at)
        at += 24
        frames.append((number, state_hash, output[at : at + length]))
        at += length
    return frames


@pytest.mark.skipif(
    not RAW.exists() and os.environ.get("CI") != "true", reason="the example `raw` of the Rust client is not built"
)
@pytest.mark.parametrize("precision", ["f32", "f64"])
@pytest.mark.parametrize(("scene", "steps"), [("demo", 120), ("two_snowballs", 16), ("snow_and_cloth", 40)])
def test_what_comes_through_three_cuts_is_what_the_rust_client_gets(
    server: nappe.Server, proxy: Proxy, scene: str, steps: int, precision: str
) -> None:
    assert server.process is not None
    through = nappe.connect(proxy.address, server.token)
    with server.create(scene, step_limit=steps, frame_interval_steps=1) as session:
        command = [RAW, server.address, session.id, precision, server.process.token_file]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as rust:
            outputs: list[bytes] = []
            reading = threading.Thread(target=lambda: outputs.append(rust.stdout.read() if rust.stdout else b""))
            reading.start()
            frames = through.session(session.id).frames(every=True, start=0, precision=precision, paced=True)
            frames.opened()
            eventually(lambda: session.refresh().watcher_count == 2)
            total = session.particle_count * (12 if precision == "f32" else 24) * steps
            proxy.cut_after = [total // 5] * 3
            session.play()
            ours = [(frame.number, int(frame.state_hash or "0", 16), frame.positions.tobytes()) for frame in frames]
            reading.join()
        assert ours == rust_frames(outputs[0])
        assert len(ours) == steps + 1 and proxy.cuts == 3
        # Two cuts are one break where nothing came between them.
        assert 1 <= frames.reconnects <= 3
        assert frames.end is not None and frames.end.state_hash == session.refresh().state_hash
    through.close()


def test_a_break_is_logged_and_a_partial_frame_is_asked_for_again(
    server: nappe.Server, proxy: Proxy, caplog: pytest.LogCaptureFixture
) -> None:
    through = nappe.connect(proxy.address, server.token)
    with server.create("flag") as session:
        frames = through.session(session.id).frames(every=True)
        assert next(frames).number == 0
        proxy.cut()
        session.step(session.frame_interval_steps)
        with caplog.at_level(logging.WARNING, "nappe"):
            assert next(frames).number == 1
        assert frames.reconnects == 1 and "broke and is back: the connection to" in caplog.text
    through.close()


def test_patience_ends(server: nappe.Server) -> None:
    host, port = server.address.removeprefix("http://").split(":")
    between = Proxy((host, int(port)))
    through = nappe.connect(between.address, server.token)
    with server.create("flag") as session:
        frames = through.session(session.id).frames(every=True, patience=0.3)
        next(frames)
        between.close()
        with pytest.raises(nappe.Unavailable):
            next(frames)
        assert list(frames) == []
    through.close()


def test_leaving_a_loop_ends_the_stream_on_the_server(server: nappe.Server) -> None:
    with server.create("flag") as session:
        session.play()
        for _ in range(5):
            for _frame in session.frames():
                break
            eventually(lambda: session.refresh().watcher_count == 0)
        with session.frames(every=True) as frames:
            next(frames)
            frames.close()
            assert list(frames) == []
        eventually(lambda: session.refresh().watcher_count == 0)


def test_a_session_deleted_while_it_is_watched_is_told(server: nappe.Server) -> None:
    session = server.create("flag")
    frames = session.frames()
    next(frames)
    session.delete()
    with pytest.raises(nappe.NotFound) as told:
        next(frames)
    assert told.value.reason == "SESSION_DELETED"


def test_frames_of_another_session_of_the_same_id_never_come(server: nappe.Server, proxy: Proxy) -> None:
    through = nappe.connect(proxy.address, server.token)
    first = server.create("flag", id="once-and-again")
    frames = through.session("once-and-again").frames(every=True)
    next(frames)
    proxy.cut()
    first.delete()
    with server.create("flag", id="once-and-again"):
        with pytest.raises(nappe.Error) as told:
            next(frames)
        assert told.value.reason == "SESSION_REPLACED"
        with pytest.raises(nappe.Error) as replaced:
            first.play()
        assert replaced.value.reason == "SESSION_REPLACED"
    through.close()


def test_a_session_that_fails_while_it_is_watched_says_where(server: nappe.Server) -> None:
    with server.create("flag") as session:
        frames = session.frames(every=True)
        pin = int(next(frames).pins[0])
        session.update(pins={pin: (0.0, 99.0, 0.0)}, duration=0.05)
        session.play()
        with pytest.raises(nappe.Diverged) as told:
            for _frame in frames:
                pass
        assert told.value.step is not None and told.value.particle is not None
        assert told.value.reason == "STRETCH_LIMIT" and told.value.cause
        assert session.refresh().state == "failed" and session.failure is not None
        assert isinstance(session.error, nappe.Diverged) and session.error.step == told.value.step


def test_two_threads_on_one_stream_are_an_error_and_one_each_are_not(server: nappe.Server) -> None:
    with server.create("flag") as session:
        frames = session.frames()
        next(frames)
        met: list[nappe.Error] = []

        def read() -> None:
            try:
                next(frames)
            except nappe.Error as error:
                met.append(error)
            except StopIteration:
                pass

        threads = [threading.Thread(target=read) for _ in range(2)]
        for thread in threads:
            thread.start()
        eventually(lambda: len(met) == 1)
        assert "two threads" in str(met[0])
        frames.close()
        for thread in threads:
            thread.join()


def test_threads_share_a_client(server: nappe.Server) -> None:
    finals: dict[int, bytes] = {}

    def run(number: int) -> None:
        with server.create("flag", step_limit=20, thread_count=1) as session:
            session.play()
            for frame in session.frames(every=True):
                finals[number] = frame.positions.tobytes()

    threads = [threading.Thread(target=run, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(finals) == 4 and len(set(finals.values())) == 1


def test_a_forked_process_is_told_why_it_cannot_call(server: nappe.Server) -> None:
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            server.info()
        except nappe.Error as error:
            os.write(writing, str(error).encode())
        os._exit(0)
    os.close(writing)
    os.waitpid(child, 0)
    with os.fdopen(reading) as told:
        assert "forked" in told.read()
    assert server.info().scenes


def test_ctrl_c_ends_a_loop(server: nappe.Server) -> None:
    program = textwrap.dedent("""
        import sys, time, nappe
        server = nappe.connect(sys.argv[1], sys.argv[2])
        frames = server.session(sys.argv[3]).frames(every=True)
        next(frames)
        print("ready", flush=True)
        try:
            for frame in frames:
                pass
        except KeyboardInterrupt:
            print(time.monotonic(), flush=True)
    """)
    with server.create("flag") as session:
        command = [sys.executable, "-c", program, server.address, str(server.token), session.id]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as waiting:
            assert waiting.stdout is not None and waiting.stdout.readline() == "ready\n"
            time.sleep(0.05)
            sent = time.monotonic()
            waiting.send_signal(signal.SIGINT)
            took = float(waiting.stdout.readline()) - sent
        assert waiting.returncode == 0
        # On a machine with nothing else to do it is 0.1 s.
        assert took < 5.0


class InterruptedWithinItsLock:
    """A call of gRPC that Ctrl-C meets where its lock is between two hands."""

    def __next__(self) -> None:
        try:
            raise KeyboardInterrupt
        finally:
            raise RuntimeError("cannot release un-acquired lock")

    def cancel(self) -> None:
        pass


def test_ctrl_c_is_told_as_such_wherever_it_comes(server: nappe.Server) -> None:
    with server.create("flag") as session:
        frames = session.frames()
        frames.close()
        frames._closed, frames._call = False, InterruptedWithinItsLock()
        with pytest.raises(KeyboardInterrupt):
            next(frames)
        assert list(frames) == []


def test_a_slow_reader_that_is_not_waited_for_is_told(server: nappe.Server) -> None:
    with (
        nappe.serve(history_bytes_per_session=4 << 20) as small,
        small.create("flag", step_limit=0, frame_interval_steps=1) as session,
    ):
        session.play()
        frames = session.frames(every=True, paced=False)
        first = next(frames)
        eventually(lambda: session.refresh().oldest_frame > first.number + 1200)
        with pytest.raises(nappe.TooSlow):
            for _frame in frames:
                pass
        with pytest.raises(nappe.Expired) as told:
            next(session.frames(every=True, start=first.number))
        assert told.value.oldest_frame is not None and told.value.oldest_frame > first.number


def test_a_session_waits_for_the_program_that_made_it_however_it_was_found(server: nappe.Server) -> None:
    with server.create("flag") as session:
        assert server.session(session.id).frames(every=True)._reader.request().pace_to_watcher
        assert not session.frames(every=True, paced=False)._reader.request().pace_to_watcher
        assert not session.frames()._reader.request().pace_to_watcher


def test_diagnostics_resume_like_frames(server: nappe.Server, proxy: Proxy) -> None:
    through = nappe.connect(proxy.address, server.token)
    with server.create("flag", step_limit=40) as session:
        stream = through.session(session.id).diagnostics()
        session.step(20)
        seen = [next(stream).frame for _ in range(3)]
        proxy.cut()
        session.step(20)
        seen += [step.frame for step in stream]
        assert seen == list(range(seen[-1] + 1)) and stream.reconnects == 1
        energies = session.diagnostics().array()["kinetic_energy"]
        assert len(energies) == len(seen) and np.isfinite(energies[1:]).all()
    through.close()
