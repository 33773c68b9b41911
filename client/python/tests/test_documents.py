"""Runs what readers are told to run: the examples, the notebook, and every block of Python in docs/."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import nappe

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "client/python/src/nappe/examples"
# A block that a tutorial writes into a file is run by `cargo xtask tutorials`.
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PAGES = sorted(
    page.relative_to(ROOT)
    for page in [*ROOT.glob("docs/**/*.md"), ROOT / "client/python/README.md", ROOT / "README.md"]
    if BLOCK.search(page.read_text())
)

ARGUMENTS = {
    "sweep": ["--count", "6", "--steps", "40"],
    "drag": [],
    "controller": [],
    "plastic_histogram": [],
    "export": [],
    "gripper": [],
    "gym_env": ["--episodes", "2"],
    "tunic": [],
}


def run(words: list[str], folder: Path, server: nappe.Server | None = None) -> str:
    environment = dict(os.environ)
    if server is not None and server.process is not None:
        environment |= {"NAPPE_SERVER": server.address, "NAPPE_TOKEN_FILE": str(server.process.token_file)}
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, cwd=folder, env=environment)
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    return done.stdout


def test_every_example_has_arguments_here() -> None:
    names = {file.stem for file in EXAMPLES.glob("*.py") if not file.stem.startswith("_")}
    assert names == set(ARGUMENTS)


@pytest.mark.parametrize("name", sorted(ARGUMENTS))
def test_an_example_runs_on_a_server_that_runs(server: nappe.Server, tmp_path: Path, name: str) -> None:
    if name == "gym_env":
        pytest.importorskip("gymnasium", reason="Gymnasium is not installed, which this example needs alone")
    words = ["-m", f"nappe.examples.{name}", "--server", server.address, *ARGUMENTS[name]]
    if name == "export":
        words += ["--out", str(tmp_path / "frames.npz")]
    told = run(words, tmp_path, server)
    if name == "export":
        assert (tmp_path / "frames.npz").stat().st_size > 10_000
    elif name == "sweep":
        rows = list(csv.DictReader(told.splitlines()))
        assert len(rows) == 6 and {row["outcome"] for row in rows} <= {"finished", *nappe.REASONS}
    elif name == "gripper":
        assert "it has let go" in told and "the sheet lies on the floor" in told
    else:
        assert any(character.isdigit() for character in told)


def test_an_example_starts_a_server_of_its_own(tmp_path: Path) -> None:
    run(["-m", "nappe.examples.export", "--out", str(tmp_path / "page.html")], tmp_path)
    assert "nappe-end" in (tmp_path / "page.html").read_text()


def test_the_notebook_runs_from_top_to_bottom(tmp_path: Path) -> None:
    notebook = json.loads((EXAMPLES / "notebook.ipynb").read_text())
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert len(cells) > 3 and all(not cell.get("outputs") for cell in notebook["cells"])
    (tmp_path / "cells.py").write_text("\n\n".join(cells) + "\n")
    run(["cells.py"], tmp_path)


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_the_blocks_of_a_page_run_one_after_the_other(tmp_path: Path, page: Path) -> None:
    blocks = BLOCK.findall((ROOT / page).read_text())
    program = tmp_path / "blocks.py"
    program.write_text("\n".join(blocks))
    run([str(program)], ROOT)
