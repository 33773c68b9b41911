"""Sessions that begin at a frame, of a stream or a file: as the one that was never cut, or refused by what is wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nappe
import nappe.aio

# A sheet in a wind that rises, with a pin on its way.
SCENE = """
version = 1
dt = 0.005
steps = 40
frame_interval = 5
wind_at = [{ time = 0.02, velocity = [0, 0, 0] }, { time = 0.1, velocity = [3, 0, 2] }]

[[body]]
name = "sheet"
mesh = { grid = [6, 6], spacing = 0.1 }
mass = { density = 0.2 }
drag = 1e-3
pins = ["top_left", "top_right"]
moving_pin = [{ pin = "top_left", offset = [0.05, 0.05, 0], duration = 0.14 }]
springs = { stretch = { stiffness = 50, damping = 0.02 }, shear = { stiffness = 20, damping = 0.01 } }
"""
STATE = ("positions", "velocities")
STEPS = [5 * number for number in range(9)]


def played(session: nappe.Session, precision: str) -> list[nappe.Frame]:
    """All frames of a session that stands, to its end."""
    frames = session.frames(every=True, fields=STATE, precision=precision)
    frames.opened()
    session.play()
    found = list(frames)
    session.refresh()
    return found


def stepped(server: nappe.Server, count: int, **asked: Any) -> nappe.Frame:
    """The frame after so many steps."""
    with server.create(SCENE, precision="f64") as session:
        return session.step(count, frame=True, **({"fields": STATE, "precision": "f64"} | asked))


def noted(file: Path, frame: nappe.Frame, version: str = "0.0.1") -> None:
    """Adds to a file what the command writes beside step and time."""
    carried = frame._carried
    numbers = " ".join(repr(number) for number in carried.numbers)
    lines = [f"nappe {version}", "scene 0123456789abcdef", *(f"missing {name}" for name in carried.missing)]
    told = "".join(f"comment {line}\n" for line in (*lines, f"carried {numbers}"))
    head, mark, rest = file.read_bytes().partition(b"element vertex")
    file.write_bytes(head + told.encode() + mark + rest)


@pytest.mark.parametrize("precision", ["f32", "f64"])
def test_a_session_that_begins_at_a_frame_goes_on_to_the_same_end(server: nappe.Server, precision: str) -> None:
    with server.create(SCENE, precision=precision) as whole:
        all_frames = played(whole, precision)
        assert [frame.step for frame in all_frames] == STEPS
        for at in (1, 3, 7):
            cut = all_frames[at]
            with server.create(SCENE, precision=precision, begin=cut) as begun:
                assert (begun.steps_taken, begun.time_seconds, begun.warnings) == (cut.step, cut.time, ())
                rest = played(begun, precision)
                assert [(frame.number, frame.step) for frame in rest] == list(enumerate(STEPS[at:]))
                for mine, its in zip(rest, all_frames[at:], strict=True):
                    assert np.array_equal(mine.positions, its.positions), (at, its.step)
                    assert np.array_equal(mine.velocities, its.velocities), (at, its.step)
                assert begun.state_hash == whole.state_hash


def test_a_session_begins_at_a_saved_frame_or_at_the_last_one_of_a_folder(server: nappe.Server, tmp_path: Path) -> None:
    folder = tmp_path / "frames"
    with server.create(SCENE, precision="f64") as session:
        session.trajectory(stop=20, fields=STATE, precision="f64").save(folder)
    last = folder / "frame-000004.ply"
    with server.create(SCENE, precision="f64") as whole:
        end = played(whole, "f64")
    # What the package saves says nothing of what steps depend on besides.
    with server.create(SCENE, precision="f64", begin=folder) as begun:
        (told,) = begun.warnings
        assert begun.steps_taken == 20 and "does not say what steps depend on" in told
    noted(last, end[4])
    for given in (folder, str(folder), last):
        with server.create(SCENE, precision="f64", begin=given) as begun:
            assert (begun.steps_taken, begun.warnings) == (20, ())
            begun.step(20)
            assert begun.state_hash == whole.state_hash
    # A file that another program wrote.
    last.write_bytes(last.read_bytes().replace(b"comment step 20\n", b"").replace(b"comment carried", b"comment other"))
    with server.create(SCENE, precision="f64", begin=last) as begun:
        assert begun.steps_taken == 0 and any("says no step" in told for told in begun.warnings)


def test_the_frame_after_a_step_is_one_to_begin_at(server: nappe.Server) -> None:
    # Numbers of binary32 are exact in wide arrays, too.
    with server.create(SCENE, precision="f32") as whole:
        frame = whole.step(15, frame=True, fields=STATE, precision="f64")
        whole.step(25)
        with server.create(SCENE, precision="f32", begin=frame) as begun:
            assert (begun.steps_taken, begun.warnings) == (15, ())
            begun.step(25)
            assert begun.state_hash == whole.state_hash


def refusal(server: nappe.Server, begin: Any, **other: Any) -> str:
    """What the package refuses of a frame; no session is left."""
    with pytest.raises(nappe.Refused) as told:
        server.create(SCENE, id="refused", begin=begin, **({"precision": "f64"} | other))
    assert (told.value.field, told.value.reason) == ("begin", None)
    assert "allowed: " in told.value.message
    assert "refused" not in {session.id for session in server.sessions()}
    return told.value.message


def test_frames_at_which_no_session_begins_are_refused_by_what_is_wrong(server: nappe.Server) -> None:
    # The pin has arrived.
    assert "is in f64, and the session is to be in f32" in refusal(server, stepped(server, 30), precision="f32")
    assert "is in f32, and the session is to be in f64" in refusal(server, stepped(server, 30, precision="f32"))
    frame = stepped(server, 10)
    still = stepped(server, 10, fields=("positions",))
    assert "has no velocities; allowed: frames with fields=" in refusal(server, still)
    assert refusal(server, 3).startswith("begin is a int; allowed: a Frame with velocities")
    with pytest.raises(nappe.Refused, match="36 particles, and the scene has 42") as told:
        server.create(SCENE.replace("[6, 6]", "[6, 7]"), precision="f64", begin=frame)
    assert told.value.reason == "INVALID_FIELD"
    with pytest.raises(nappe.Refused, match="the session ends after 10 steps"):
        server.create(SCENE, precision="f64", step_limit=10, begin=frame)
    with pytest.raises(nappe.Refused, match=r"step 10 of the scene, whose dt is 0\.0025 s"):
        server.create(SCENE.replace("dt = 0.005", "dt = 0.0025"), precision="f64", begin=frame)


def test_files_at_which_no_session_begins_are_refused_by_their_names(server: nappe.Server, tmp_path: Path) -> None:
    with pytest.raises(nappe.FileNotFound, match=r"none\.ply"):
        server.create(SCENE, begin=tmp_path / "none.ply")
    assert "holds no frame" in refusal(server, tmp_path)
    (tmp_path / "mesh.obj").write_text("v 0 0 0\n")
    assert "is no saved frame" in refusal(server, tmp_path / "mesh.obj")

    for name, fields in (("frames", STATE), ("plain", ("positions",))):
        with server.create(SCENE, precision="f64") as session:
            session.trajectory(stop=30, fields=fields, precision="f64").save(tmp_path / name)
    assert "frame-000006.ply has no velocities" in refusal(server, tmp_path / "plain")
    file = tmp_path / "frames" / "frame-000006.ply"
    assert "is in f64, and the session is to be in f32" in refusal(server, file, precision="f32")
    whole = file.read_bytes()
    noted(file, stepped(server, 30), version="99.0.0")
    assert "frame-000006.ply was saved by nappe 99.0.0" in refusal(server, file)
    for length in (len(whole) // 2, whole.index(b"end_header")):
        file.write_bytes(whole[:length])
        with pytest.raises(nappe.Refused, match=r"frame-000006\.ply") as told:
            server.create(SCENE, precision="f64", begin=file)
        assert told.value.reason == "INVALID_MESH"


async def test_sessions_of_asyncio_begin_at_frames_too(server: nappe.Server) -> None:
    async with nappe.aio.connect(server.address, server.token) as client:
        async with client.create(SCENE, precision="f64") as whole:
            frame = await whole.step(30, frame=True, fields=STATE, precision="f64")
            await whole.step(10)
            async with client.create(SCENE, precision="f64", begin=frame) as begun:
                assert (begun.steps_taken, begun.warnings) == (30, ())
                await begun.step(10)
                assert begun.state_hash == whole.state_hash
        with pytest.raises(nappe.Refused, match="is in f64, and the session is to be in f32"):
            await client.create(SCENE, id="refused", precision="f32", begin=frame)
        assert "refused" not in {session.id for session in await client.sessions()}
