#!/usr/bin/env python3
"""The walk by another physics engine: HRP-4 walked in MuJoCo by the same planner, estimator and controller.

    python3 tools/oracles/mujoco.py              # both engines on hard ground, side by side; some two minutes
    python3 tools/oracles/mujoco.py --swings 3   # shorter

MuJoCo takes the simulator's place in the domain (`python/examples/mujoco_simulator.py`); both walks are recorded and
judged by `soleus-inspect figures`. Ends with code 1 if MuJoCo's robot falls or does not walk as far as planned.
"""

import argparse
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

import environment

# Shortest distance that counts as walked, as a part of the planned one.
DISTANCE_MIN = 0.9
# Hard ground and hard soles for both. The stabiliser of our simulator is soft-sole tuned and MuJoCo has none: open loop for both.
HARD = ["estimator.sole.level=rigid"]
ROWS = [
    ("verdict", "verdict", 1.0),
    ("distance walked (m)", "distance_m", 1.0),
    ("distance planned (m)", "planned_distance_m", 1.0),
    ("COM off its plan, rms (mm)", "com_error_rms_m", 1e3),
    ("COM off its plan, max (mm)", "com_error_max_m", 1e3),
    ("ZMP off its plan, rms (mm)", "zmp_error_rms_m", 1e3),
    ("ZMP off its plan, max (mm)", "zmp_error_max_m", 1e3),
]
ROOT = environment.ROOT


def figures(binaries, path):
    done = subprocess.run([binaries / "soleus-inspect", "figures", "--json", path], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    return found[0] if isinstance(found, list) else found


def walk_in_mujoco(binaries, config, folder):
    """Starts the processes one by one, the simulator being MuJoCo; returns the recording."""
    domain, recording = f"mujoco-{os.getpid()}", folder / "mujoco.mcap"
    living = [subprocess.Popen([binaries / "soleus-launch", "serve", "--domain", domain])]
    try:
        for name in ("planner", "estimator", "controller", "recorder"):
            more = ["--set", f"output_file={recording}"] if name == "recorder" else []
            command = [binaries / f"soleus-{name}", "--config", config / f"{name}.toml", "--domain", domain, *more]
            living.append(subprocess.Popen(command))
        example = ROOT / "python/examples/mujoco_simulator.py"
        done = subprocess.run([sys.executable, example, domain, "--robot", ROOT / "robots/hrp4"], timeout=1800)
        if done.returncode not in (0, 1):
            raise SystemExit("MuJoCo did not walk: see above")
    finally:
        # The owner last: the others end in order when they are asked to.
        for process in reversed(living[1:]):
            process.send_signal(signal.SIGTERM)
        for process in living[1:]:
            process.wait(timeout=60)
        living[0].send_signal(signal.SIGTERM)
        living[0].wait(timeout=60)
    while not recording.exists():
        time.sleep(0.1)
    return recording


def main(swings, binaries, keep):
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(keep or temporary).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        ours = folder / "ours"
        settings = [*HARD, "simulator.sole.level=rigid", f"planner.gait.walk.swings={swings}"]
        sets = [part for setting in settings for part in ("--set", setting)]
        scenario = ROOT / "config/scenarios/no-stabiliser.toml"
        command = [binaries / "soleus-launch", scenario, "--out", ours, "--overwrite", *sets]
        subprocess.run(command, stdout=subprocess.DEVNULL, check=False)
        theirs = figures(binaries, walk_in_mujoco(binaries, ours / "config", folder))
        ours = figures(binaries, ours / "walk.mcap")
    show = lambda found, scale: f"{found * scale:.2f}" if isinstance(found, float) else str(found)
    print(f"\n{'':<28} {'Soleus':>12} {'MuJoCo':>12}")
    for title, key, scale in ROWS:
        print(f"{title:<28} {show(ours[key], scale):>12} {show(theirs[key], scale):>12}")
    walked = theirs["distance_m"] or 0.0
    if theirs["fallen"] or walked < DISTANCE_MIN * theirs["planned_distance_m"]:
        print("MuJoCo's robot did not walk as planned")
        return 1
    return 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--swings", type=int, default=11)
    parser.add_argument("--binaries", type=pathlib.Path, default=ROOT / "target/release")
    parser.add_argument("--keep", metavar="FOLDER", help="leave both recordings there")
    arguments = parser.parse_args()
    environment.enter(environment.HERE / ".venv-mujoco", environment.HERE / "requirements-mujoco.txt")
    sys.exit(main(arguments.swings, arguments.binaries.resolve(), arguments.keep))
