#!/usr/bin/env python3
"""Renders one instant of a recording to a picture, without a screen.

Enters: a recording (.rrd) and a simulated time (s). Leaves: a PNG of the viewer, cropped to what is asked for.

    nappe run demo --save demo.rrd
    python3 -m venv venv && venv/bin/pip install rerun-sdk==0.36.3 grpcio pillow
    PATH=venv/bin:$PATH venv/bin/python docs/picture/render.py demo.rrd docs/images/demo.png --time 1.2

Without a graphics card it needs a Vulkan driver in software (Debian: mesa-vulkan-drivers).
"""

import argparse
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import grpc
from PIL import Image
from rerun.experimental import ViewerClient

SET_TIME = "/rerun.sdk_comms.v1alpha1.ViewerControlService/SetTimeCursor"
START_LIMIT_SECONDS = 60


def main() -> int:
    arguments = parse()
    port = free_port()
    with tempfile.TemporaryDirectory() as scratch, open(Path(scratch) / "log", "w+b") as log:
        viewer = subprocess.Popen(
            [
                "rerun", "--headless", "--bind=127.0.0.1", f"--port={port}", "--hide-welcome-screen",
                f"--window-size={arguments.size}", str(arguments.recording),
            ],
            env={**os.environ, "XDG_RUNTIME_DIR": scratch, "HOME": scratch},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=log,
            # A group of its own: the command is a launcher, and what it launches must end with it.
            start_new_session=True,
        )
        try:
            shot = Path(scratch) / "shot.png"
            wait_for(port, viewer)
            # The file loads in the background, and the first pictures lack what is not there yet.
            time.sleep(arguments.settle)
            seek(port, arguments.time)
            time.sleep(arguments.settle)
            ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy").save_screenshot(str(shot))
            save(shot, arguments.picture, arguments.crop)
        except Exception:
            log.seek(0)
            sys.stderr.write(log.read().decode(errors="replace"))
            raise
        finally:
            os.killpg(viewer.pid, signal.SIGKILL)
            viewer.wait(timeout=10)
    return 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--time", type=float, default=1.0, help="simulated time (s)")
    parser.add_argument("--size", default="1600x900", help="size of the window (points)")
    parser.add_argument("--crop", default="0,28,0,0", help="left, top, right, bottom margins to cut (pixels)")
    parser.add_argument("--settle", type=float, default=6.0, help="seconds to wait for loading and drawing")
    return parser.parse_args()


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def wait_for(port: int, viewer: subprocess.Popen) -> None:
    deadline = time.monotonic() + START_LIMIT_SECONDS
    while time.monotonic() < deadline:
        if viewer.poll() is not None:
            sys.exit(f"the viewer ended with status {viewer.returncode}: is there a Vulkan driver?")
        try:
            socket.create_connection(("127.0.0.1", port), timeout=1).close()
            return
        except OSError:
            time.sleep(0.2)
    sys.exit(f"the viewer did not listen within {START_LIMIT_SECONDS} s")


def seek(port: int, seconds: float) -> None:
    """Moves the time cursor of the active recording and pauses. The Python SDK has no call for it yet."""
    nanoseconds = round(seconds * 1e9)
    # SetTimeCursorRequest { time = 3: TimelineTime { time = 1: int64 } }
    inner = b"\x08" + varint(nanoseconds)
    request = b"\x1a" + varint(len(inner)) + inner
    with grpc.insecure_channel(f"127.0.0.1:{port}") as channel:
        channel.unary_unary(SET_TIME)(request, timeout=10)


def varint(value: int) -> bytes:
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)


def read(shot: Path) -> Image.Image:
    """Reads the picture once the viewer has written all of it."""
    for _ in range(50):
        try:
            return Image.open(shot).convert("RGB")
        except OSError:
            time.sleep(0.2)
    sys.exit("the viewer has not written the picture within 10 s")


def save(shot: Path, picture: Path, crop: str) -> None:
    left, top, right, bottom = (int(margin) for margin in crop.split(","))
    image = read(shot)
    image = image.crop((left, top, image.width - right, image.height - bottom))
    if all(low == high for low, high in image.getextrema()):
        sys.exit("the picture is empty")
    picture.parent.mkdir(parents=True, exist_ok=True)
    image.save(picture, optimize=True)
    print(f"{picture}: {image.width} x {image.height}, {picture.stat().st_size // 1024} KiB")


if __name__ == "__main__":
    sys.exit(main())
