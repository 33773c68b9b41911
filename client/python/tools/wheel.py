"""Adds programs to the wheel of the package, which then is one for a platform; `cargo xtask wheel` calls it.

    python client/python/tools/wheel.py --wheel FILE --into FOLDER --platform TAG --program FILE... --licence FILE...

Enters: the wheel that the package's backend built, programs, and the licences of what is in them. Leaves: a wheel from
which pip puts the programs beside the Python that it installs for.
"""

from __future__ import annotations

import argparse
import base64
import hashlib
import zipfile
from pathlib import Path

MOMENT = (1980, 1, 1, 0, 0, 0)
"""The time of every file, so that the same files make the same bytes."""
FILE, PROGRAM = 0o100644, 0o100755
"""Kind and permissions of what the wheel holds."""


def recorded(name: str, content: bytes) -> str:
    """The line of RECORD about a file: its name, its hash and its size."""
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).decode().rstrip("=")
    return f"{name},sha256={digest},{len(content)}\n"


def retagged(text: str, platform: str) -> str:
    """The file WHEEL of a wheel for one platform, and for every Python 3."""
    kept = [line for line in text.splitlines() if line and not line.startswith(("Root-Is-Purelib:", "Tag:"))]
    return "\n".join([*kept, "Root-Is-Purelib: false", f"Tag: py3-none-{platform}", ""])


def with_programs(wheel: Path, into: Path, platform: str, programs: list[Path], licences: list[Path]) -> Path:
    """Writes the wheel that has the programs too, and returns where it is."""
    name, version = wheel.name.split("-")[:2]
    info, scripts = f"{name}-{version}.dist-info", f"{name}-{version}.data/scripts"
    with zipfile.ZipFile(wheel) as package:
        files = {entry: package.read(entry) for entry in package.namelist() if entry != f"{info}/RECORD"}
    files[f"{info}/WHEEL"] = retagged(files[f"{info}/WHEEL"].decode(), platform).encode()
    files |= {f"{info}/licenses/{path.name}": path.read_bytes() for path in licences}
    files |= {f"{scripts}/{path.name}": path.read_bytes() for path in programs}
    lines = [recorded(entry, content) for entry, content in files.items()]
    files[f"{info}/RECORD"] = "".join([*lines, f"{info}/RECORD,,\n"]).encode()

    into.mkdir(parents=True, exist_ok=True)
    made = into / f"{name}-{version}-py3-none-{platform}.whl"
    with zipfile.ZipFile(made, "w") as out:
        for entry, content in files.items():
            item = zipfile.ZipInfo(entry, MOMENT)
            item.external_attr = (PROGRAM if entry.startswith(f"{scripts}/") else FILE) << 16
            out.writestr(item, content, zipfile.ZIP_DEFLATED, 9)
    return made


def main() -> None:
    """Reads the command line, and says how large the wheel is."""
    parser = argparse.ArgumentParser(description="Adds programs to the wheel of the package.")
    parser.add_argument("--wheel", type=Path, required=True, help="the wheel of the package alone")
    parser.add_argument("--into", type=Path, required=True, help="the folder for the new wheel")
    parser.add_argument("--platform", required=True, help="the tag of the platform that runs the programs")
    parser.add_argument("--program", type=Path, nargs="+", required=True, help="programs")
    parser.add_argument("--licence", type=Path, nargs="+", required=True, help="files with licences")
    said = parser.parse_args()
    made = with_programs(said.wheel, said.into, said.platform, said.program, said.licence)
    print(f"{made.name}: {made.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
