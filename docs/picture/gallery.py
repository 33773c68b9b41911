#!/usr/bin/env python3
"""Computes every shipped scene, draws one instant of each, and writes docs/gallery.md.

Enters: the built command and server/scenes. Leaves: docs/images/gallery/*.png and docs/gallery.md.

    cargo build --release
    python3 -m venv venv && venv/bin/pip install numpy pillow
    venv/bin/python docs/picture/gallery.py                  # or some scenes: gallery.py flag demo
"""

import argparse
import json
import subprocess
import tempfile
import tomllib
from pathlib import Path

import numpy as np
import raster
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "docs/images/gallery"
SIZE, FINER = (320, 240), 2  # pixels; drawn finer and then averaged

# What to draw: simulated time (s), azimuth and elevation of the camera (degrees).
VIEWS = {
    "demo": (0.9, 30, 14),
    "hanging_sheet": (0.35, 40, 8),
    "flag": (3.0, 150, 12),
    "cloth_over_sphere": (2.0, 30, 22),
    "drap10": (1.0, 50, 12),
    "drap70": (0.6, 55, 12),
    "snowball_wall": (0.2, -55, 14),
    "two_snowballs": (0.17, 10, 12),
    "block_on_incline": (0.8, 10, 12),
    "rolling_snowball": (0.9, 15, 16),
    "sphere_in_bed": (0.8, 30, 28),
    "brasseur": (0.75, 30, 16),
    "snow_and_cloth": (0.85, 15, 14),
}
DEFAULT_VIEW = (1.0, 30, 15)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", help="scenes to draw [default: all]")
    parser.add_argument("--nappe", type=Path, default=ROOT / "target/release/nappe", help="the built command")
    arguments = parser.parse_args()
    listed = json.loads(subprocess.run([arguments.nappe, "scenes", "--json"], check=True, capture_output=True).stdout)
    names = [scene["name"] for scene in listed]
    PICTURES.mkdir(parents=True, exist_ok=True)
    for name in arguments.scenes or names:
        draw(arguments.nappe, name)
    page = ROOT / "docs/gallery.md"
    page.write_text(written(names))
    print(f"wrote {page.relative_to(ROOT)}")


def draw(nappe, name):
    """Computes a scene up to its instant and draws the last frame."""
    scene = text_of(name)
    seconds, *view = VIEWS.get(name, DEFAULT_VIEW)
    interval = scene.get("frame_interval", 1)
    steps = max(interval * round(seconds / scene["dt"] / interval), interval)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "frames"
        command = [nappe, "run", name, "--steps", str(steps), "--save", str(folder)]
        subprocess.run(command + ["--fields", "plastic_ratio"], check=True, stdout=subprocess.DEVNULL)
        frame = raster.read_ply(sorted(folder.glob("frame-*.ply"))[-1])
    radius = scene["snow"]["cell"] / 3 if "snow" in scene else 0.01
    fine = raster.render(frame, scene.get("collider", []), view, [FINER * pixels for pixels in SIZE], radius)
    picture = Image.fromarray((fine * 255).round().astype(np.uint8)).resize(SIZE, Image.Resampling.BOX)
    # A palette keeps the file small.
    file = PICTURES / f"{name}.png"
    picture.quantize(160, dither=Image.Dither.NONE).save(file, optimize=True)
    print(f"{file.relative_to(ROOT)}: t = {steps * scene['dt']:.2f} s, {file.stat().st_size // 1024} KiB")


def text_of(name):
    return tomllib.loads((ROOT / f"server/scenes/{name}.toml").read_text())


def written(names):
    """The page: a row for each scene."""
    rows = []
    for name in names:
        scene, (seconds, *_) = text_of(name), VIEWS.get(name, DEFAULT_VIEW)
        lines = (ROOT / f"server/scenes/{name}.toml").read_text().splitlines()
        comment = " ".join(line.removeprefix("#").strip() for line in lines[: lines.index("version = 1")])
        picture = f"![{scene['title']}](images/gallery/{name}.png)"
        rows.append(f"| {picture} | **{name}**, at {seconds:g} s. {comment}<br>`nappe run {name} --save {name}.html` |")
    return f"""# Gallery

These scenes come with nappe. The command beside a picture computes the scene and writes a page, which any browser opens without a network.
`nappe scenes NAME` prints the text of a scene, as a start for your own. [The format](scenes.md) has every key, and
[a tutorial](tutorials/scene.md) writes a scene. In the pictures snow is white as it fell, blue where it is packed and amber where it has come apart.
`python3 docs/picture/gallery.py` computes the scenes, draws the pictures and writes this page.

| picture | scene |
|---|---|
{chr(10).join(rows)}
"""


if __name__ == "__main__":
    main()
