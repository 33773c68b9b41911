"""The shell of asyncio on a real server, and that it has the names and signatures of the other one."""

from __future__ import annotations

import asyncio
import inspect
import time
from typing import Any

import numpy as np
import pytest
from conftest import Proxy

import nappe
import nappe.aio


def public(kind: type[Any]) -> dict[str, Any]:
    return {name: member for name, member in inspect.getmembers(kind) if not name.startswith("_")}


def parameters(function: Any) -> list[tuple[str, Any, Any]]:
    return [(p.name, p.kind, p.default) for p in inspect.signature(function).parameters.values()]


@pytest.mark.parametrize("name", ["Server", "Session", "Stream", "Frames", "DiagnosticsStream"])
def test_both_shells_have_the_same_names_and_signatures(name: str) -> None:
    plain, awaited = public(getattr(nappe, name)), public(getattr(nappe.aio, name))
    assert plain.keys() == awaited.keys()
    for member, function in plain.items():
        assert awaited[member].__doc__ and function.__doc__, member
        if callable(function):
            assert parameters(function) == parameters(awaited[member]), member
    for function_name in ("connect", "serve"):
        assert parameters(getattr(nappe, function_name)) == parameters(getattr(nappe.aio, function_name))


async def eventually(session: nappe.aio.Session, watchers: int) -> None:
    begin = time.monotonic()
    while (await session.refresh()).watcher_count != watchers:
        assert time.monotonic() - begin < 120
        await asyncio.sleep(0.005)


async def test_every_frame_comes_once_and_in_order() -> None:
    async with nappe.aio.serve() as server, server.create("flag", precision="f32", step_limit=40) as session:
        assert session.id in [other.id for other in await server.sessions()]
        await session.play()
        frames = session.frames(every=True)
        seen = [(frame.number, frame.step) async for frame in frames]
        assert [number for number, _ in seen] == list(range(len(seen))) and seen[-1][1] == 40
        assert frames.end is not None and (await session.refresh()).state_hash == frames.end.state_hash
        trajectory = await session.trajectory(every=2)
        assert len(trajectory) == len(seen[::2])
        assert len(await session.diagnostics().array()) == len(seen)


async def test_a_controller_changes_waits_and_forks(server: nappe.Server) -> None:
    async with nappe.aio.connect(server.address, server.token) as client, client.create("flag") as session:
        pin = int((await anext(aiter(session.frames()))).pins[0])
        frame = await session.step(changes={"wind": (1, 2, 3)}, frame=True)
        assert frame.step == session.steps_taken == 1
        assert session.parameters is not None and session.parameters.wind == (1.0, 2.0, 3.0)
        await session.path(pin, [0.1], [(0, 1, 0)], at_step=50)
        await session.update(drag=0.1, at_step=60)
        first, second = await session.pending()
        assert (first.effective_step, second.effective_step) == (50, 60)
        assert await session.drop_pending() == 2
        async with session.fork() as fork:
            assert fork.state_hash == (await session.refresh()).state_hash
        with pytest.raises(nappe.Refused):
            await session.update(pins={99999: (0, 0, 0)})
        changes = session.changes()
        assert (await anext(aiter(changes))).kind == "present"
        await session.play()
        await session.pause()
        await session.stop()
        assert [change.state async for change in changes][-1] == "finished"


async def test_leaving_a_loop_or_cancelling_its_task_ends_the_stream(server: nappe.Server) -> None:
    async with nappe.aio.connect(server.address, server.token) as client, client.create("flag") as session:
        await session.play()
        for _ in range(3):
            async for _frame in session.frames():
                break
            await eventually(session, 0)
        await session.pause()

        async def read() -> None:
            async for _frame in session.frames(every=True):
                pass

        task = asyncio.create_task(read())
        await eventually(session, 1)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        await eventually(session, 0)


async def test_two_tasks_on_one_stream_are_an_error(server: nappe.Server) -> None:
    async with nappe.aio.connect(server.address, server.token) as client, client.create("flag") as session:
        frames = session.frames()
        await anext(frames)
        waiting = asyncio.ensure_future(anext(frames))
        await asyncio.sleep(0)
        with pytest.raises(nappe.Error, match="two tasks"):
            await anext(frames)
        frames.close()
        with pytest.raises(StopAsyncIteration):
            await waiting


async def test_three_cuts_lose_and_repeat_nothing(server: nappe.Server, proxy: Proxy) -> None:
    async with (
        nappe.aio.connect(server.address, server.token) as client,
        client.create("demo", step_limit=120, frame_interval_steps=1) as session,
    ):
        async with nappe.aio.connect(proxy.address, server.token) as through:
            frames = (await through.session(session.id)).frames(every=True, start=0, paced=True)
            await frames.opened()
            proxy.cut_after = [session.particle_count * 12 * 120 // 5] * 3
            await session.play()
            cut = [(frame.number, frame.state_hash, frame.positions) async for frame in frames]
            assert proxy.cuts == 3 and 1 <= frames.reconnects <= 3
        whole = [(frame.number, frame.state_hash, frame.positions) async for frame in session.frames(every=True)]
        assert len(cut) == len(whole) == 121
        for (number, state_hash, positions), (n, h, p) in zip(cut, whole, strict=True):
            assert (number, state_hash) == (n, h)
            np.testing.assert_array_equal(positions, p)


async def test_what_is_not_there_is_told(server: nappe.Server) -> None:
    with pytest.raises(nappe.Unauthenticated):
        await nappe.aio.connect(server.address, "0" * 32)
    with pytest.raises(nappe.Unavailable):
        await nappe.aio.connect("127.0.0.1:9")
    async with nappe.aio.connect(server.address, server.token) as client:
        with pytest.raises(nappe.NotFound):
            await client.session("nobody")
        session = await client.create("flag")
        frames = session.frames()
        await anext(frames)
        await session.delete()
        with pytest.raises(nappe.NotFound):
            await anext(frames)
