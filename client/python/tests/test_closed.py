"""A connection that this program closes: before a call, while it waits, after it; with asyncio, and with threads."""

from __future__ import annotations

import asyncio
import sys
import threading
import time
from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np
import pytest
from conftest import Proxy, eventually, proxy_before

import nappe
import nappe.aio

Connection = nappe.aio.Server
Act = Callable[[Connection, nappe.aio.Session], Awaitable[Any]]


async def drained(stream: Any) -> int:
    return len([item async for item in stream])


POINTS = np.eye(3)
CALLS: dict[str, Act] = {
    "info": lambda connection, session: connection.info(),
    "sessions": lambda connection, session: connection.sessions(),
    "session": lambda connection, session: connection.session(session.id),
    "make_link": lambda connection, session: connection.make_link(session, forks=1),
    "create": lambda connection, session: connection.create("flag"),
    "upload": lambda connection, session: connection.upload(POINTS, [[0, 1, 2]]),
    "refresh": lambda connection, session: session.refresh(),
    "play": lambda connection, session: session.play(),
    "pause": lambda connection, session: session.pause(),
    "step": lambda connection, session: session.step(),
    "step with a frame": lambda connection, session: session.step(2, frame=True),
    "step without waiting": lambda connection, session: session.step(wait=False),
    "stop": lambda connection, session: session.stop(),
    "delete": lambda connection, session: session.delete(),
    "fork": lambda connection, session: session.fork(),
    "update": lambda connection, session: session.update(drag=0.1),
    "update that waits": lambda connection, session: session.update(drag=0.1, at_step=9, wait=True),
    "path": lambda connection, session: session.path(0, [0.1], [(0, 1, 0)]),
    "place": lambda connection, session: session.place("flag", POINTS),
    "reset": lambda connection, session: session.reset(),
    "pending": lambda connection, session: session.pending(),
    "drop_pending": lambda connection, session: session.drop_pending(),
    "frames": lambda connection, session: drained(session.frames()),
    "every frame": lambda connection, session: drained(session.frames(every=True)),
    "opened": lambda connection, session: session.frames().opened(),
    "diagnostics": lambda connection, session: session.diagnostics().array(),
    "changes": lambda connection, session: drained(session.changes()),
    "trajectory": lambda connection, session: session.trajectory(),
}


async def carried_out(act: Act, connection: Connection, session: nappe.aio.Session) -> Any:
    return await act(connection, session)


async def turns(count: int) -> None:
    """Lets other tasks go on so often."""
    for _ in range(count):
        await asyncio.sleep(0)


@pytest.mark.parametrize("call", CALLS)
async def test_a_call_that_waits_ends_with_closed_wherever_it_stands(server: nappe.Server, call: str) -> None:
    with server.create("flag", thread_count=1) as made:
        # Nothing is sent yet, it is about to be, it is under way.
        for count in (0, 1, 2, 3, 5, 100):
            # gRPC may share connections to one address: each has an address of its own.
            proxy = proxy_before(server)
            connection = await nappe.aio.connect(proxy.address, server.token)
            session = await connection.session(made.id)
            proxy.hold()
            task = asyncio.create_task(carried_out(CALLS[call], connection, session))
            await turns(count)
            assert not task.done(), "the server does not answer"
            await connection.close()
            with pytest.raises(nappe.Closed, match="is closed") as told:
                await asyncio.wait_for(task, 60)
            assert connection.address in str(told.value) and told.value.__suppress_context__
            proxy.close()


@pytest.mark.parametrize("call", CALLS)
async def test_a_call_on_a_connection_that_is_closed_ends_with_closed(server: nappe.Server, call: str) -> None:
    with server.create("flag", thread_count=1) as made:
        connection = await nappe.aio.connect(server.address, server.token)
        session = await connection.session(made.id)
        await connection.close()
        for _ in range(2):
            with pytest.raises(nappe.Closed, match="is closed"):
                await carried_out(CALLS[call], connection, session)
            await connection.close()  # once more does nothing
        assert session.state == "paused" and session.particle_count == made.particle_count


async def test_readers_of_a_session_that_plays_end_with_closed() -> None:
    connection = await nappe.aio.serve(threads=1)
    session = await connection.create("hanging_sheet", step_limit=0)
    stepping = await connection.create("hanging_sheet", step_limit=0)
    streams = [session.frames(), session.frames(every=True), session.diagnostics(), session.changes()]
    await session.play(real_time_factor=1)
    read = [0] * len(streams)

    async def reader(which: int) -> None:
        async for _item in streams[which]:
            read[which] += 1

    tasks = [asyncio.create_task(reader(which)) for which in range(len(streams))]
    tasks.append(asyncio.create_task(stepping.step(1_000_000)))
    begin = time.monotonic()
    while not all(read) or (await stepping.refresh()).steps_taken == 0:
        assert time.monotonic() - begin < 120 and not any(task.done() for task in tasks)
        await asyncio.sleep(0.005)
    await connection.close()
    for task in tasks:
        with pytest.raises(nappe.Closed):
            await asyncio.wait_for(task, 60)


async def test_what_was_read_stays_and_a_stream_that_ended_stays_so(server: nappe.Server) -> None:
    connection = await nappe.aio.connect(server.address, server.token)
    session = await connection.create("flag", step_limit=3, frame_interval_steps=1)
    begun = session.frames()
    await begun.opened()
    frame = await session.step(3, frame=True)
    ended, left = session.frames(every=True), session.frames(every=True)
    numbers = [read.number async for read in ended]
    left.close()
    await session.delete()
    await connection.close()
    assert numbers == [0, 1, 2, 3] and frame.step == session.steps_taken == 3
    assert np.isfinite(frame.positions).all()
    for over in (ended, left):
        await over.opened()
        with pytest.raises(StopAsyncIteration):
            await anext(over)
    with pytest.raises(nappe.Closed):
        await anext(begun)


@pytest.mark.parametrize("first", ["the task is cancelled", "the connection is closed"])
@pytest.mark.parametrize("call", ["frames", "step", "upload"])
async def test_a_task_that_is_cancelled_itself_is_cancelled(
    server: nappe.Server, proxy: Proxy, call: str, first: str
) -> None:
    with server.create("flag", thread_count=1) as made:
        connection = await nappe.aio.connect(proxy.address, server.token)
        session = await connection.session(made.id)
        proxy.hold()
        task = asyncio.create_task(carried_out(CALLS[call], connection, session))
        await turns(100)
        if first == "the task is cancelled":
            task.cancel()
            await connection.close()
        else:
            closing = asyncio.create_task(connection.close())
            await turns(1)
            task.cancel()
            await closing
        # Python 3.10 does not say whether a task was cancelled.
        allowed = asyncio.CancelledError if sys.version_info >= (3, 11) else (asyncio.CancelledError, nappe.Closed)
        with pytest.raises(allowed):
            await task


async def test_a_stream_that_waits_to_be_asked_for_again_ends_with_closed(server: nappe.Server, proxy: Proxy) -> None:
    with server.create("flag", thread_count=1) as made:
        connection = await nappe.aio.connect(proxy.address, server.token)
        frames = (await connection.session(made.id)).frames(patience=1e6)
        await anext(frames)
        task = asyncio.ensure_future(anext(frames))
        proxy.close()
        await asyncio.sleep(0.5)
        assert not task.done()
        await connection.close()
        with pytest.raises(nappe.Closed):
            await asyncio.wait_for(task, 60)


def test_threads_that_read_and_step_end_with_closed(server: nappe.Server) -> None:
    connection = nappe.connect(server.address, server.token)
    with server.create("hanging_sheet", step_limit=0) as playing, server.create("flag", step_limit=0) as stepped:
        met: list[BaseException] = []
        counts = [0, 0, 0]
        watched, stepping = connection.session(playing.id), connection.session(stepped.id)
        streams: list[Any] = [watched.frames(), watched.diagnostics()]

        def noting(which: int, act: Callable[[], object]) -> None:
            try:
                while True:
                    act()
                    counts[which] += 1
            except BaseException as error:
                met.append(error)

        acts: list[Callable[[], object]] = [*(lambda stream=stream: next(stream) for stream in streams), stepping.step]
        threads = [threading.Thread(target=noting, args=pair, daemon=True) for pair in enumerate(acts)]
        playing.play(real_time_factor=1)
        for thread in threads:
            thread.start()
        eventually(lambda: all(counts))
        connection.close()
        for thread in threads:
            thread.join(60)
        assert [type(error) for error in met] == [nappe.Closed] * 3, met
        with pytest.raises(nappe.Closed):
            watched.frames()
