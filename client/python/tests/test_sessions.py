"""Sessions on a real server: what a program does with them, sync; `test_aio.py` does the same with asyncio."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import nappe


def test_every_frame_of_a_played_session_comes_once_and_in_order(server: nappe.Server) -> None:
    with server.create("flag", precision="f32", step_limit=40) as session:
        session.play()
        frames = session.frames(every=True)
        numbers, steps = zip(*((frame.number, frame.step) for frame in frames), strict=True)
        assert numbers == tuple(range(len(numbers))) and len(numbers) > 5
        assert steps[-1] == 40 and frames.end is not None and frames.end.step == 40
        assert session.refresh().state == "finished"
        assert session.state_hash == frames.end.state_hash


def test_a_frame_is_read_only_and_its_bodies_are_views(server: nappe.Server) -> None:
    with server.create("flag") as session:
        frame = next(session.frames(fields=("positions", "velocities")))
        assert frame.positions.shape == (session.particle_count, 3) == frame.velocities.shape
        with pytest.raises(ValueError, match="read-only"):
            frame.positions[0] = 0.0
        flag = frame.body("flag")
        assert np.shares_memory(flag.positions, frame.positions)
        assert frame.triangles.max() < session.particle_count and len(frame.pins) > 0
        with pytest.raises(nappe.Error, match="plastic_ratio"):
            _ = frame.plastic_ratio
        with pytest.raises(nappe.Error, match="'flag'"):
            frame.body("sail")


def test_the_newest_frames_say_how_many_were_left_out(server: nappe.Server) -> None:
    with server.create("flag", step_limit=2000) as session:
        frames = session.frames(rate=20)
        session.play()
        seen = []
        for frame in frames:
            seen.append((frame.number, frame.dropped))
            if len(seen) == 4:
                break
        for (before, _), (number, dropped) in pairwise(seen):
            assert number == before + dropped + 1


def test_a_controller_gets_the_state_after_each_step(server: nappe.Server) -> None:
    with server.create("flag", precision="f64") as session:
        first = next(session.frames(precision="f64"))
        pin = int(first.pins[0])
        for step in range(1, 4):
            target = first.positions[pin] + (0.0, 0.001 * step, 0.0)
            frame = session.step(changes={"pins": {pin: target}}, frame=True, precision="f64")
            assert (frame.step, session.steps_taken) == (step, step)
            np.testing.assert_allclose(frame.positions[pin], target, atol=1e-12)
        assert session.step(to=3) is None and session.steps_taken == 3


def test_changes_wait_for_their_step_and_can_be_dropped(server: nappe.Server) -> None:
    with server.create("flag") as session:
        pin = int(next(session.frames()).pins[0])
        accepted = session.update(wind=(5, 0, 0), stiffness={"bend": 5}, drag=0.1, at_step=100)
        session.path(pin, [0.1, 0.2], [(0, 1, 0), (0, 2, 0)], at_step=200)
        most = server.info().limits["max_changes_per_call"]
        with pytest.raises(nappe.Refused, match=f"times has {most + 1} points; allowed: at most {most} in one call"):
            session.path(pin, range(1, most + 2), np.zeros((most + 1, 3)))
        first, second = session.pending()
        assert (first.effective_step, first.order) == (100, accepted.order) == (accepted.effective_step, 1)
        assert first.changes["wind"] == (5.0, 0.0, 0.0)
        assert first.changes["springs"] == [{"body": None, "kind": "bend", "stiffness": 5.0}]
        np.testing.assert_array_equal(second.changes["paths"][pin][1], [(0, 1, 0), (0, 2, 0)])
        assert session.drop_pending([second.order]) == 1 and len(session.pending()) == 1
        for unknown in ({"force": {"flag": (0, 1, 0)}}, {"force": None}):
            told = "no change is called 'force'; there are: gravity, wind, .*forces"
            with pytest.raises(nappe.Refused, match=told):
                session.update(**unknown)
        session.update(wind=(1, 2, 3))
        session.step()
        assert session.parameters is not None and session.parameters.wind == (1.0, 2.0, 3.0)


def test_a_fork_stands_where_its_original_stands(server: nappe.Server) -> None:
    with server.create("flag") as session:
        session.step(5)
        with session.fork("fork-of-flag") as fork:
            assert (fork.id, fork.steps_taken, fork.state_hash) == ("fork-of-flag", 5, session.state_hash)
            assert {session.id, fork.id} <= {other.id for other in server.sessions()}
            assert server.session("fork-of-flag").uid == fork.uid
        with pytest.raises(nappe.NotFound):
            server.session("fork-of-flag")


def test_meshes_come_as_arrays_and_with_scene_files(server: nappe.Server, tmp_path: Path) -> None:
    points = [(x / 4, 1.0, z / 4) for z in range(5) for x in range(5)]
    corners = [5 * z + x for z in range(4) for x in range(4)]
    triangles = [t for c in corners for t in ((c, c + 1, c + 5), (c + 1, c + 6, c + 5))]
    uploaded = server.upload(points, triangles, masses=[0.0] + [0.01] * 24, name="square")
    assert uploaded.mesh_id
    lines = [f"v {x} {y} {z}" for x, y, z in points] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]
    (tmp_path / "sheet.obj").write_text("\n".join(lines) + "\n")
    text = shipped_like(tmp_path)
    with server.create(text) as session:
        assert session.particle_count == 25
        assert next(session.frames()).body("sheet").triangles.shape == (32, 3)


def test_a_mesh_collider_comes_with_its_arrays(server: nappe.Server) -> None:
    points = np.array([(0, -3, 0), (0.1, -3, 0), (0, -2.9, 0), (0, -3, 0.1)])
    triangles = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    uploaded = server.upload(points, triangles, name="tetrahedron")
    text = """version = 1
dt = 0.001

[[body]]
name = "sheet"
mesh = { grid = [4, 4], spacing = 0.1 }
mass = { particle = 0.01 }
[body.springs]
stretch = { stiffness = 10 }

[[collider]]
name = "solid"
mesh = { upload = "ID" }
velocity = [0, 0, 0.5]
"""
    with server.create(text.replace("ID", uploaded.mesh_id)) as session:
        (collider,) = next(session.frames()).topology.colliders
        assert (collider.name, collider.kind, collider.velocity) == ("solid", "mesh", (0.0, 0.0, 0.5))
        assert np.array_equal(collider.shape["points"], points.astype(np.float32))
        assert np.array_equal(collider.shape["triangles"], triangles)
        assert collider.shape["origin"] == (0.0, 0.0, 0.0)
        session.step(2)
        told = session.refresh().info.diagnostics
        assert told is not None and told.notices.pinched_particles == 0


def shipped_like(folder: Path) -> Path:
    """A scene file beside its mesh."""
    path = folder / "sheet.toml"
    path.write_text(SCENE)
    return path


SCENE = """# a comment: file = "not-this.obj"
version = 1
title = "A sheet from a file"
dt = 0.001
steps = 10

[[body]]
name = "sheet"
mesh = { file = "sheet.obj" }
mass = { total = 0.1 }
pins = [0]

[body.springs]
stretch = { stiffness = 100, damping = 0.01 }
shear = { stiffness = 20, damping = 0.01 }
bend = { stiffness = 0.1, damping = 0 }
"""


def test_a_trajectory_is_every_frame_stacked(server: nappe.Server) -> None:
    with server.create("flag", step_limit=40) as session:
        whole = session.trajectory(fields=("positions", "velocities"))
        assert whole.end is not None and session.state == "finished"
        again = session.trajectory(every=2)
        assert whole.positions.shape == (len(whole), session.particle_count, 3)
        np.testing.assert_array_equal(again.positions, whole.positions[::2])
        assert whole.time[-1] == pytest.approx(session.time_seconds)
        energies = whole.diagnostics["kinetic_energy"]
        streamed = session.diagnostics().array()["kinetic_energy"]
        np.testing.assert_array_equal(energies[1:], streamed[1:])
        with pytest.raises(nappe.Refused, match="max_bytes"):
            session.trajectory(max_bytes=1000)
    with server.create("flag", step_limit=0) as session:
        with pytest.raises(nappe.Refused, match="stop"):
            session.trajectory()
        assert list(session.trajectory(stop=8).step) == [0, 4, 8] and session.steps_taken == 8


def test_changes_of_state_are_told_in_order(server: nappe.Server) -> None:
    with server.create("flag", step_limit=8) as session:
        changes = session.changes()
        assert next(changes).kind == "present"
        session.play()
        states = [change.state for change in changes]
        assert states[-1] == "finished" and changes.end is not None


def test_nodes_of_the_grid_come_with_snow_and_are_refused_without(server: nappe.Server) -> None:
    with server.create("two_snowballs") as session:
        session.step(session.frame_interval_steps)
        frame = next(session.frames(fields=("positions", "plastic_ratio", "stress"), grid="smoke"))
        assert frame.plastic_ratio.shape == (session.particle_count,) == frame.stress.shape
        assert frame.grid is not None and len(frame.grid.masses) == frame.grid.node_count
        assert frame.grid.masses.sum() > 0 and frame.grid.positions.shape == frame.grid.velocities.shape
    with server.create("flag") as session:
        for wanted in ({"fields": ("stress",)}, {"grid": "smoke"}):
            with pytest.raises(nappe.Refused, match="no snow"):
                session.frames(**wanted)


def test_what_is_refused_leaves_everything_as_it_was(server: nappe.Server) -> None:
    with server.create("flag") as session:
        for wrong in (
            {"pins": {99999: (0, 0, 0)}},
            {"wind": (1, float("nan"), 0)},
            {"stiffness": {"bent": 1}},
            {"gravity": (0, 0)},
        ):
            with pytest.raises(nappe.Refused) as refused:
                session.update(**wrong)
            assert refused.value.field is not None and refused.value.reason is None
        with pytest.raises(nappe.Refused) as told:
            session.update(drag=-1.0)
        assert told.value.reason in ("INVALID_CHANGE", "INVALID_FIELD")
        assert session.pending() == []


def test_an_error_in_a_scene_names_its_line(server: nappe.Server) -> None:
    with pytest.raises(nappe.Refused) as refused:
        server.create(
            SCENE.replace('{ file = "sheet.obj" }', "{ grid = [4, 4], spacing = 0.1 }", 2).replace(
                "steps = 10", "steps = 10\nstep = 10"
            )
        )
    assert (refused.value.reason, refused.value.line) == ("INVALID_SCENE", 6), refused.value
    assert refused.value.remedy and refused.value.remedy in str(refused.value)


def test_a_session_that_was_saved_goes_on_to_the_bit(server: nappe.Server, tmp_path: Path) -> None:
    path = tmp_path / "flag.session"
    with server.create("flag", precision="f64", step_limit=0) as session:
        session.update(wind=(6, 0, 6))
        session.step(7)
        assert session.save(path) == path and [file.name for file in tmp_path.iterdir()] == [path.name]
        with server.create(checkpoint=path) as again:
            assert (again.steps_taken, again.state_hash) == (7, session.state_hash)
            again.step(9)
            session.step(9)
            assert again.state_hash == session.state_hash
    with pytest.raises(nappe.NotFound):
        session.save(path)
    assert path.stat().st_size > 1000 and [file.name for file in tmp_path.iterdir()] == [path.name]
    whole = path.read_bytes()
    path.write_bytes(whole[:-1])
    with pytest.raises(nappe.Error) as told:
        server.create(checkpoint=path)
    assert told.value.reason == "INVALID_CHECKPOINT"
