"""The wheel with programs: `tools/wheel.py` makes it from that of the package, and pip installs it."""

from __future__ import annotations

import base64
import csv
import hashlib
import os
import platform
import subprocess
import sys
import zipfile
from pathlib import Path

PACKAGE = Path(__file__).parents[1]
LICENCE = PACKAGE.parents[1] / "LICENSE-MIT"
PLATFORM = f"manylinux_2_17_{platform.machine()}"
# No text, as programs are none.
PROGRAM = b"#!/bin/sh\necho it runs; exit\n\x00\xff\x7f"


def ran(*words: str | Path) -> str:
    return subprocess.run([*map(str, words)], check=True, capture_output=True, text=True).stdout


def made(folder: Path) -> Path:
    offline = ("--quiet", "--disable-pip-version-check", "--no-deps", "--no-build-isolation", "--no-index")
    ran(sys.executable, "-m", "pip", "wheel", *offline, "--wheel-dir", folder / "package", PACKAGE)
    (package,) = (folder / "package").iterdir()
    program = folder / "nappe-server"
    program.write_bytes(PROGRAM)
    words = ("--wheel", package, "--platform", PLATFORM, "--program", program, "--licence", LICENCE)
    for into in ("first", "second"):
        ran(sys.executable, PACKAGE / "tools/wheel.py", "--into", folder / into, *words)
    (wheel,) = (folder / "first").iterdir()
    assert wheel.name == package.name.replace("none-any", f"none-{PLATFORM}")
    assert wheel.read_bytes() == (folder / "second" / wheel.name).read_bytes(), "the same files make the same wheel"
    return wheel


def test_a_wheel_with_programs_records_each_file_and_pip_installs_them(tmp_path: Path) -> None:
    wheel, site = made(tmp_path), tmp_path / "site"
    with zipfile.ZipFile(wheel) as read:
        files = {entry: read.read(entry) for entry in read.namelist()}
    (record,) = (entry for entry in files if entry.endswith(".dist-info/RECORD"))
    info = record.removesuffix("/RECORD")
    rows = {name: (digest, size) for name, digest, size in csv.reader(files[record].decode().splitlines())}
    assert rows.pop(record) == ("", "") and rows.keys() == files.keys() - {record}
    for name, (digest, size) in rows.items():
        hashed = base64.urlsafe_b64encode(hashlib.sha256(files[name]).digest()).decode().rstrip("=")
        assert (digest, size) == (f"sha256={hashed}", str(len(files[name]))), name
    tags = [line for line in files[f"{info}/WHEEL"].decode().splitlines() if line.startswith(("Tag", "Root"))]
    assert tags == ["Root-Is-Purelib: false", f"Tag: py3-none-{PLATFORM}"]
    assert files[f"{info}/licenses/LICENSE-MIT"] == LICENCE.read_bytes()

    offline = ("--quiet", "--disable-pip-version-check", "--no-deps", "--no-index")
    ran(sys.executable, "-m", "pip", "install", *offline, "--target", site, wheel)
    program = site / "bin/nappe-server"
    assert program.read_bytes() == PROGRAM and os.access(program, os.X_OK)
    assert ran(program) == "it runs\n"
    assert (site / "nappe/__init__.py").read_bytes() == (PACKAGE / "src/nappe/__init__.py").read_bytes()
