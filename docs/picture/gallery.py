#!/usr/bin/env python3
"""Computes every shipped scene, draws an instant of its page, and writes docs/gallery.md.

Enters: the built command, server/scenes, and a browser. Leaves: docs/images/gallery/*.png and docs/gallery.md.

    cargo build --release && npm ci --prefix viewer/web
    python3 docs/picture/gallery.py                  # or some scenes: gallery.py flag demo
"""

import argparse
import json
import subprocess
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "docs/images/gallery"
SIZE = "320x240"  # pixels

# What to draw: simulated time (s), and steps of the key + from where the page stands at first.
VIEWS = {
    "demo": (0.9, 5),
    "hanging_sheet": (0.35, 2),
    "flag": (3.0, 2),
    "cloth_over_sphere": (2.0, 3),
    "cloth_on_torus": (1.2, 3),
    "gripper": (1.0, 2),
    "towel": (2.6, 3),
    "walker": (1.5, 3),
    "five_sheets": (0.5, 4),
    "fifty_sheets": (1.5, 4),
    "squeezed_sheet": (1.5, 2),
    "swinging_chain": (0.5, 1),
    "stiff_sheet": (0.3, 2),
    "folded_strip": (2.5, 2),
    "drap10": (1.0, 1),
    "drap70": (0.6, 1),
    "snowball_wall": (0.2, 5),
    "two_snowballs": (0.17, 3),
    "block_on_incline": (0.8, 1),
    "rolling_snowball": (0.9, 1),
    "sphere_in_bed": (0.8, 1),
    "plough": (1.2, 1),
    "snow_in_wind": (0.5, 1),
    "elastic_beam": (1.06, 1),
    "brasseur": (0.75, 1),
    "snow_and_cloth": (0.85, 1),
}
DEFAULT_VIEW = (1.0, 3)


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
    """Computes a scene up to its instant, and draws it as its page shows it."""
    scene = text_of(name)
    seconds, closer = VIEWS.get(name, DEFAULT_VIEW)
    steps = round(seconds / scene["dt"])
    with tempfile.TemporaryDirectory() as scratch:
        page = Path(scratch) / "page.html"
        run = [nappe, "run", name, "--steps", str(steps), "--frame-interval", "1", "--save", page]
        subprocess.run(run, check=True, stdout=subprocess.DEVNULL)
        shown = ["node", ROOT / "viewer/web/tests/picture.mjs", PICTURES / f"{name}.png", f"{page}@{seconds}@{closer}"]
        subprocess.run([*shown, "--size", SIZE], check=True)


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
[a tutorial](tutorials/scene.md) writes a scene. The pictures are those of the pages.
`python3 docs/picture/gallery.py` computes the scenes, draws the pictures and writes this page.

| picture | scene |
|---|---|
{chr(10).join(rows)}
"""


if __name__ == "__main__":
    main()
