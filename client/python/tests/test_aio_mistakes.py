"""Mistakes with asyncio, each told in words: a forgotten `await` or `async`, a second event loop, none at all."""

from __future__ import annotations

import asyncio
import gc
import warnings
from typing import Any

import pytest

import nappe
import nappe.aio

SOME_CALL = "await nappe.aio.serve(...)"


def test_what_was_not_awaited_says_so_and_what_to_write() -> None:
    opening: Any = nappe.aio.serve()
    assert SOME_CALL in repr(opening) and not hasattr(opening, "create") and not hasattr(opening, "_repr_html_")
    with pytest.raises(
        AttributeError, match=r"nappe\.aio\.serve\(\.\.\.\) is to be awaited.*no 'create' before"
    ) as told:
        opening.create("flag")
    assert SOME_CALL in str(told.value) and "async with nappe.aio.serve(...) as ..." in str(told.value)
    with pytest.raises(TypeError, match="is to be awaited"), opening:
        pass
    with pytest.warns(RuntimeWarning, match=r"^nappe\.aio\.serve\(\.\.\.\) was never awaited$"):
        del opening, told
        gc.collect()


async def test_sessions_that_were_not_awaited_say_so(server: nappe.Server) -> None:
    async with nappe.aio.connect(server.address, server.token) as client:
        creating: Any = client.create("flag")
        with pytest.raises(AttributeError, match=r"`await server\.create\(\.\.\.\)`"):
            creating.play()
        async with creating as session:
            forking: Any = session.fork()
            with pytest.raises(AttributeError, match=r"`await session\.fork\(\.\.\.\)`"):
                forking.play()
            await (await forking).delete()
            with pytest.raises(TypeError, match="read with `async for`, not `for`"):
                for _frame in session.frames():
                    pass
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            del creating, forking  # both were awaited
            gc.collect()


def test_a_second_event_loop_is_told_as_such_and_the_first_goes_on(server: nappe.Server) -> None:
    async def opened() -> tuple[nappe.aio.Server, nappe.aio.Session, nappe.aio.Frames]:
        client = await nappe.aio.connect(server.address, server.token)
        session = await client.create("flag")
        frames = session.frames(every=True)
        await anext(frames)
        return client, session, frames

    async def read(frames: nappe.aio.Frames) -> int:
        return (await anext(frames)).number

    async def second(session: nappe.aio.Session) -> int:
        return await read(session.frames(every=True, start=1))

    async def asked(session: nappe.aio.Session) -> None:
        async for _frame in session.frames():
            break

    first = asyncio.new_event_loop()
    client, session, frames = first.run_until_complete(opened())
    for wrong in (session.step, client.info, lambda: read(frames), lambda: asked(session)):
        with pytest.raises(nappe.Error, match="belongs to another event loop, and not to this one") as told:
            asyncio.run(wrong())  # type: ignore[arg-type]
        assert client.address in str(told.value) and told.value.remedy and "asyncio.run()" in told.value.remedy
    with pytest.raises(nappe.Error, match="outside of an event loop"):
        session.frames()

    first.run_until_complete(session.step(session.frame_interval_steps))
    assert first.run_until_complete(second(session)) == 1
    first.run_until_complete(session.delete())
    first.run_until_complete(client.close())
    first.close()


def test_a_connection_outlives_no_event_loop_but_can_be_closed(server: nappe.Server) -> None:
    async def connected() -> nappe.aio.Server:
        return await nappe.aio.connect(server.address, server.token)

    client = asyncio.run(connected())
    with pytest.raises(nappe.Error, match="belongs to another event loop, which has ended"):
        asyncio.run(client.info())
    asyncio.run(client.close())
    with pytest.raises(nappe.Error, match="is closed"):
        asyncio.run(client.info())
