"""Measures the package on this machine: throughput, memory, a call per step, import, and how soon things end."""

from __future__ import annotations

import asyncio
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import nappe
import nappe.aio

CLOTH = """version = 1
title = "A large cloth"
dt = 1e-5
[[body]]
name = "cloth"
mesh = { grid = [316, 316], spacing = 0.01 }
mass = { density = 0.15 }
integrator = "symplectic_euler"
[body.springs]
stretch = { stiffness = 1, damping = 0 }
shear = { stiffness = 1, damping = 0 }
bend = { stiffness = 0, damping = 0 }
"""
# Only frames that are already made are read, so that the physics does not matter, and the steps do not count.
FRAMES, PASSES = 50, 20


def throughput(server: nappe.Server) -> None:
    """Reads kept frames of 100 000 particles, over and over, and tells MB/s."""
    with server.create(CLOTH, frame_interval_steps=1) as session:
        session.step(FRAMES)
        megabytes = session.particle_count * 12 * (FRAMES + 1) * PASSES / 1e6
        print(f"{session.particle_count} particles, raw f32, loopback, {PASSES} times {FRAMES + 1} frames:")
        begin = time.perf_counter()
        for _ in range(PASSES):
            read(session)
        print(f"  plain calls {megabytes / (time.perf_counter() - begin):.0f} MB/s")
        asyncio.run(read_with_asyncio(server, session.id, megabytes))
        before = memory()
        for _ in range(5000 // (FRAMES + 1)):
            read(session)
        print(f"  memory grew by {memory() - before:.1f} MiB over 5 000 frames")


def read(session: nappe.Session) -> None:
    """Reads all frames that are kept."""
    for frame in session.frames(every=True, start=0):
        if frame.number == FRAMES:
            break


async def read_with_asyncio(server: nappe.Server, session_id: str, megabytes: float) -> None:
    """The same with asyncio."""
    async with nappe.aio.connect(server.address, server.token) as client:
        session, begin = await client.session(session_id), time.perf_counter()
        for _ in range(PASSES):
            async for frame in session.frames(every=True, start=0):
                if frame.number == FRAMES:
                    break
        print(f"  asyncio     {megabytes / (time.perf_counter() - begin):.0f} MB/s")


def memory() -> float:
    """The memory that this process has now (MiB)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


def latency(server: nappe.Server) -> None:
    """One call per step of drap10, step and frame included."""
    with server.create("drap10") as session:
        for wanted in (False, True):
            times = []
            for _ in range(400):
                begin = time.perf_counter()
                session.step(frame=wanted)  # type: ignore[call-overload]
                times.append(time.perf_counter() - begin)
            times.sort()
            told = "with its frame" if wanted else "without frame "
            print(f"drap10, a call per step, {told}: median {1e3 * times[200]:.2f} ms, 95 % {1e3 * times[380]:.2f} ms")


def imports() -> None:
    """Seconds of `import nappe` in a new interpreter."""
    program = "import time; t = time.perf_counter(); import nappe; print(time.perf_counter() - t)"
    taken = min(float(subprocess.check_output([sys.executable, "-c", program])) for _ in range(5))
    print(f"import nappe: {taken:.3f} s")


def ends(server: nappe.Server) -> None:
    """How soon a server ends after its interpreter was killed, and a watcher after its loop was left."""
    program = "import nappe, time; s = nappe.serve(); print(s.process.pid, flush=True); time.sleep(60)"
    slowest = 0.0
    for _ in range(20):
        with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as python:
            assert python.stdout is not None
            stat = Path(f"/proc/{int(python.stdout.readline())}/stat")
            assert stat.exists(), "it runs"
            python.send_signal(signal.SIGKILL)
            begin = time.perf_counter()
            while stat.exists() and stat.read_text().split(")")[1].split()[0] != "Z":
                time.sleep(0.001)
            slowest = max(slowest, time.perf_counter() - begin)
    told = f"within {1e3 * slowest:.0f} ms, 20 times"
    print(f"kill -9 of the interpreter: the server ended {told}")
    slowest = 0.0
    with server.create("flag") as session:
        session.play()
        for _ in range(100):
            for _frame in session.frames():
                break
            begin = time.perf_counter()
            while session.refresh().watcher_count:
                time.sleep(0.001)
            slowest = max(slowest, time.perf_counter() - begin)
    print(f"a loop that was left: no watcher within {slowest:.3f} s, 100 times")


def interrupt(server: nappe.Server) -> None:
    """How soon Ctrl-C ends a loop that waits for a frame."""
    program = (
        "import sys, time, nappe\n"
        "frames = nappe.connect(sys.argv[1], sys.argv[2]).session(sys.argv[3]).frames(every=True)\n"
        "print(next(frames), flush=True)\n"
        "try:\n    next(frames)\nexcept KeyboardInterrupt:\n    print(time.monotonic(), flush=True)\n"
    )
    slowest = 0.0
    with server.create("flag") as session:
        command = [sys.executable, "-c", program, server.address, str(server.token), session.id]
        for _ in range(10):
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as python:
                assert python.stdout is not None
                python.stdout.readline()
                time.sleep(0.1)
                begin = time.monotonic()
                python.send_signal(signal.SIGINT)
                slowest = max(slowest, float(python.stdout.readline()) - begin)
    print(f"Ctrl-C ended a loop within {slowest:.2f} s, 10 times")


if __name__ == "__main__":
    imports()
    with nappe.serve(history_bytes_per_session=256 << 20) as started:
        throughput(started)
        latency(started)
        ends(started)
        interrupt(started)
