#!/usr/bin/env python3
"""The picture of a recording in Rerun, without a screen.

    python3 tools/pictures/in_rerun.py /tmp/walk/walk.mcap --output docs/rerun.webp

Rerun draws by Vulkan; where there is no graphics card Mesa's software one will do (apt-get install
mesa-vulkan-drivers). Usage data of Rerun is switched off. It and Pillow are installed into
tools/pictures/.venv-rerun only.
"""

import argparse
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "oracles"))
import environment

HERE = pathlib.Path(__file__).resolve().parent
PORT = 19876
# How long a viewer without a graphics card takes to open, to load a walk, and to draw it (s).
OPEN_S, LOAD_S, DRAW_S = 8, 30, 15
WIDTH_PX = 1400


def main(arguments):
    import rerun
    import rerun.blueprint as blueprint
    from PIL import Image
    from rerun.experimental import ViewerClient

    program = pathlib.Path(sys.executable).with_name("rerun")
    subprocess.run([program, "analytics", "disable"], capture_output=True)
    flags = ["--headless", "--renderer", "vulkan", "--window-size", "1590x980", "--port", str(PORT)]
    # The program is a script that starts the viewer: both are ended.
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
    viewer = subprocess.Popen([program, *flags], **quiet)
    try:
        time.sleep(OPEN_S)
        rerun.init("walk")
        rerun.connect_grpc(f"rerun+http://127.0.0.1:{PORT}/proxy")
        joints = [blueprint.TimeSeriesView(origin=f"/joint_states/{name}") for name in ("position", "effort")]
        # The robot is what Rerun makes of the recording; only the arrangement is ours.
        shown = blueprint.Horizontal(
            blueprint.Spatial3DView(origin="/", contents=["/**"]),
            blueprint.Vertical(*joints, blueprint.TextLogView(origin="/log")),
        )
        rerun.send_blueprint(blueprint.Blueprint(shown, collapse_panels=True))
        rerun.log_file_from_path(arguments.recording)
        time.sleep(LOAD_S)
        with tempfile.TemporaryDirectory() as folder:
            taken = pathlib.Path(folder) / "rerun.png"
            ViewerClient(f"rerun+http://127.0.0.1:{PORT}/proxy").save_screenshot(str(taken))
            end = time.monotonic() + DRAW_S
            while not taken.exists() and time.monotonic() < end:
                time.sleep(0.2)
            time.sleep(1.0)
            image = Image.open(taken).convert("RGB")
        image = image.resize((WIDTH_PX, round(image.height * WIDTH_PX / image.width)), Image.LANCZOS)
        image.save(arguments.output, quality=80, method=6)
        print(f"{arguments.output}: {image.width} x {image.height}, {os.path.getsize(arguments.output) / 1000:.0f} kB")
    finally:
        os.killpg(viewer.pid, signal.SIGTERM)
        viewer.wait()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", type=pathlib.Path)
    parser.add_argument("--output", default="docs/rerun.webp")
    arguments = parser.parse_args()
    environment.enter(HERE / ".venv-rerun", HERE / "requirements-rerun.txt")
    main(arguments)
