"""Tables of diagnostics and trajectories: flat columns that pandas takes, whole numbers and hashes as such."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nappe
import nappe.aio
from nappe._server._launch import program
from nappe._wire._diagnostics import diagnostics_table

VECTORS = {"momentum_x", "momentum_y", "momentum_z"}
STEPS = 24


def table_of(server: nappe.Server, scene: str, **made: Any) -> tuple[nappe.Trajectory, dict[str, Any], dict[str, Any]]:
    """A trajectory, its table, and that of the session's diagnostics."""
    with server.create(scene, step_limit=STEPS, **made) as session:
        trajectory = session.trajectory()
        return trajectory, trajectory.table(), session.diagnostics().table()


@pytest.mark.parametrize("scene", ["flag", "two_snowballs", "snow_and_cloth"])
def test_a_table_has_flat_columns_of_one_length(server: nappe.Server, scene: str) -> None:
    trajectory, table, streamed = table_of(server, scene)
    for columns in (table, streamed):
        assert {(type(column), column.shape) for column in columns.values()} == {(np.ndarray, (len(trajectory),))}
        assert columns.keys() >= VECTORS and "momentum" not in columns
    assert set(table) - set(streamed) == {"state_hash"} and list(table)[:4] == [
        "step",
        "time_seconds",
        "frame",
        "state_hash",
    ]
    for name, column in streamed.items():
        if "seconds" not in name or name == "time_seconds":
            np.testing.assert_array_equal(column, table[name], name)
    vectors = np.stack([table[f"momentum_{axis}"] for axis in "xyz"], axis=1)
    np.testing.assert_array_equal(vectors, trajectory.diagnostics["momentum"])


def test_whole_numbers_are_such_and_what_is_absent_is_told(server: nappe.Server) -> None:
    _, cloth, _ = table_of(server, "flag")
    whole = {name for name, column in cloth.items() if column.dtype == np.int64}
    assert whole >= {"step", "frame", "contact_count", "solve_iterations", "cloth_substeps", "notices_capped_solves"}
    assert not any(name.endswith(("count", "iterations", "substeps", "rejected")) for name in cloth.keys() - whole)
    # No step made the first frame: it counted nothing, measured nothing, and said nothing.
    first = {name: column[0] for name, column in cloth.items()}
    assert (first["step"], first["cloth_substeps"], first["solve_iterations"]) == (0, 0, 0)
    assert np.isnan(first["cloth_dt_seconds"]) and first["solve_outcome"] == ""
    assert cloth["solve_iterations"][1] > 1 and cloth["solve_outcome"][1] == "converged"
    assert not any(name.startswith("snow") for name in cloth)

    _, snow, _ = table_of(server, "two_snowballs")
    assert snow["snow_bound_particle"].dtype == np.int64 and snow["snow_bound_particle"][0] == -1
    assert snow["snow_bound_particle"].max() >= 0
    assert not any(name.startswith(("cloth", "solve")) for name in snow)


def test_hashes_are_hexadecimal_everywhere(server: nappe.Server, tmp_path: Path) -> None:
    with server.create("flag", step_limit=STEPS) as session:
        with session.frames(every=True) as frames:
            begin = next(frames).state_hash
            assert begin == session.state_hash == session.info.state_hash
            session.play()
            for frame in frames:
                last = frame.state_hash
        trajectory = session.trajectory()
        told = [session.state_hash, frames.end.state_hash, last, trajectory.state_hash[-1]]
    assert len(set(told)) == 1 and told[0] != begin
    with np.load(trajectory.save(tmp_path / "run.npz")) as file:
        saved = file["state_hash"].tolist()
    table = trajectory.table()["state_hash"].tolist()
    assert saved == table == [value or "" for value in trajectory.state_hash]
    for value in (begin, told[0]):
        assert isinstance(value, str) and len(value) == 16 and f"{int(value, 16):016x}" == value
    assert (saved[0], saved[-1]) == (begin, told[0])


def listed_in(page: str, title: str) -> list[str]:
    """The names in the first column of the tables of a section."""
    text = (Path(__file__).parents[3] / "docs" / page).read_text("utf-8")
    level = title.split(" ", 1)[0]
    section = text.split(f"\n{title}\n", 1)[1].split(f"\n{level} ", 1)[0]
    rows = [line.split("|")[1] for line in section.splitlines() if line.startswith("| `")]
    return [name for row in rows for name in re.findall("`(.*?)`", row)]


def test_the_columns_are_those_that_the_documents_list_for_the_command() -> None:
    listed = listed_in("command.md", "### The table")
    of_surfaces = [f"surface_{name}" for name in listed_in("laws/surfaces.md", "## What a step tells")]
    documented = [name for known in listed for name in (of_surfaces if known == "surface_*" else [known])]
    of_frame = ["step", "time_seconds", "frame", "state_hash"]
    of_step = [name for name in diagnostics_table([]) if name not in of_frame]
    assert documented == of_frame + of_step


def test_nothing_makes_an_empty_table() -> None:
    empty = diagnostics_table([])
    assert empty.keys() >= {*VECTORS, "snow_mass", "step"}
    assert {column.shape for column in empty.values()} == {(0,)}
    assert diagnostics_table([None, None]) == {}


async def test_a_table_is_awaited(server: nappe.Server) -> None:
    async with nappe.aio.connect(server.address, server.token) as client, client.create("flag") as session:
        trajectory = await session.trajectory(stop=STEPS)
        await session.stop()
        table = await session.diagnostics().table()
        np.testing.assert_array_equal(table["momentum_y"], trajectory.table()["momentum_y"])


def test_pandas_takes_both(server: nappe.Server) -> None:
    pandas = pytest.importorskip("pandas", reason="pandas is not installed, which this test needs alone")
    trajectory, table, streamed = table_of(server, "snow_and_cloth")
    for columns in (table, streamed):
        frame = pandas.DataFrame(columns)
        assert frame.shape == (len(trajectory), len(columns)) and list(frame.columns) == list(columns)
        for name, column in columns.items():
            if column.dtype.kind in "if":
                assert frame[name].dtype == column.dtype, name
            assert frame[name].tolist() == pytest.approx(column.tolist(), nan_ok=True), name
    assert pandas.DataFrame(table).set_index("step")["kinetic_energy"].idxmax() in trajectory.step


@pytest.mark.parametrize("scene", ["flag", "two_snowballs", "snow_and_cloth"])
def test_pandas_reads_the_table_of_the_command(server: nappe.Server, tmp_path: Path, scene: str) -> None:
    pandas = pytest.importorskip("pandas", reason="pandas is not installed, which this test needs alone")
    command = Path(program()).with_name("nappe")
    if not command.is_file():
        pytest.skip("the command is not beside the server, and this test needs it")
    file = tmp_path / "run.csv"
    run = [command, "run", scene, "--steps", str(STEPS), "--quiet", "--save", file]
    subprocess.run(run, check=True, stdout=subprocess.DEVNULL)
    trajectory, table, _ = table_of(server, scene)
    read = pandas.read_csv(file, dtype={"state_hash": str}, float_precision="round_trip")
    assert len(read) == len(trajectory)
    # Seconds of the clock are those of another run.
    for name in table.keys() - {"step_seconds"}:
        column, there = table[name], read[name].notna().to_numpy()
        if column.dtype.kind in "if":
            np.testing.assert_array_equal(read[name].to_numpy(np.float64)[there], column[there], name)
            assert all(value in (0, -1) or np.isnan(value) for value in column[~there]), name
        else:
            assert read[name][there].tolist() == column[there].tolist(), name
            assert set(column[~there].tolist()) <= {""}, name
    others = [name for name in read.columns if name not in table]
    assert others and read[others].isna().to_numpy().all(), others


def test_pandas_reads_the_committed_table() -> None:
    pandas = pytest.importorskip("pandas", reason="pandas is not installed, which this test needs alone")
    file = Path(__file__).parents[2] / "cli" / "tests" / "golden" / "two.csv"
    read = pandas.read_csv(file, dtype={"state_hash": str}, float_precision="round_trip")
    assert (read["step"].tolist(), read["time_seconds"].tolist()) == ([0, 2], [0.0, 0.02])
    assert read["state_hash"].tolist() == ["00000000000000ff"] * 2
    assert np.isnan(read["kinetic_energy"][0]) and read["kinetic_energy"][1] == 0.1 + 0.2
    assert read["load_ball_force_z"][1] == 1e21 and read["load_floor_contacts"].isna().all()
