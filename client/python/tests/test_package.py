"""The package alone, without the rest of the repository: it installs, from its folder and from an sdist, and saves."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import nappe
from nappe._wire._errors import REASONS

PACKAGE = Path(__file__).parents[1]
ROOT = PACKAGE.parents[1]
COPIES = {
    "replay.html": ("viewer/web/dist/replay.html", "npm --prefix viewer/web run build"),
    "reasons.json": ("proto/nappe/v1/reasons.json", "cargo xtask bless pages"),
}


@pytest.mark.parametrize("name", COPIES)
def test_what_the_package_holds_is_what_the_repository_holds(name: str) -> None:
    original, remedy = COPIES[name]
    copy = PACKAGE / "src/nappe" / name
    assert copy.read_bytes() == (ROOT / original).read_bytes(), f"{copy} is not {original}: run {remedy}"


def ran(*words: str | Path, folder: Path, **environment: str) -> str:
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [sys.executable, *map(str, words)], cwd=folder, env=kept | environment, capture_output=True, text=True
    )
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.mark.parametrize("kind", ["folder", "sdist"])
def test_the_package_alone_can_be_installed_and_saves_a_page(server: nappe.Server, tmp_path: Path, kind: str) -> None:
    alone, site = tmp_path / "alone", tmp_path / "site"
    shutil.copytree(PACKAGE, alone, ignore=shutil.ignore_patterns("__pycache__", ".*_cache", "dist", "build"))
    if kind == "sdist":
        ran("-m", "hatchling", "build", "-t", "sdist", "-d", tmp_path / "out", folder=alone)
        shutil.rmtree(alone)
        (alone,) = (tmp_path / "out").iterdir()
    offline = ("--no-deps", "--no-build-isolation", "--no-index", "--disable-pip-version-check")
    ran("-m", "pip", "install", "--quiet", *offline, "--target", site, alone, folder=tmp_path)

    told = ran("-c", "import nappe; print(nappe.__file__, len(nappe.REASONS))", folder=tmp_path, PYTHONPATH=str(site))
    assert told.split() == [str(site / "nappe/__init__.py"), str(len(REASONS))]
    assert server.process is not None
    page = tmp_path / "page.html"
    words = ("--server", server.address, "--token-file", server.process.token_file, "--steps", "8", "--out", page)
    ran("-m", "nappe.examples.export", *words, folder=tmp_path, PYTHONPATH=str(site))
    assert page.read_bytes().startswith((ROOT / "viewer/web/dist/replay.html").read_bytes())
