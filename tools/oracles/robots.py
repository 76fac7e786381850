#!/usr/bin/env python3
"""Robots that nobody here made walk from the draft of their folder: JVRC-1 and TALOS, from their packages on PyPI."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import environment

# What a draft cannot know: which changes make the robot walk, each a key of its walk.
ROBOTS = {
    "jvrc1": [],
    "talos": [],
}


def urdfs():
    (jvrc1,) = environment.packaged("jvrc_description", "jvrc1.urdf")
    talos = next(environment.robots().rglob("talos_reduced.urdf"))
    return {"jvrc1": jvrc1, "talos": talos}


def built():
    command = ["cargo", "build", "--quiet", "--package", "soleus-inspect", "--package", "closed_loop", "--example", "walks"]
    subprocess.run([*command, "--bin", "soleus-inspect"], cwd=environment.ROOT, check=True)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", environment.ROOT / "target")) / "debug"
    return target / "soleus-inspect", target / "examples" / "walks"


def main():
    environment.enter()
    inspect, walks = built()
    with tempfile.TemporaryDirectory() as name:
        root = pathlib.Path(name)
        shutil.copytree(environment.ROOT / "config", root / "config")
        lines = []
        for robot, urdf in urdfs().items():
            folder = root / "robots" / robot
            subprocess.run([inspect, "robot", urdf, "--out", folder], check=True)
            lines.append(f"{robot}: {folder / 'walk.toml'} {' '.join(ROBOTS[robot])}")
        table = root / "walks.txt"
        table.write_text("\n".join(lines))
        found = subprocess.run([walks, table], check=True, capture_output=True, text=True).stdout
    print(found)
    finished = [line for line in found.splitlines() if "| Finished |" in line]
    return 0 if len(finished) == len(ROBOTS) else 1


if __name__ == "__main__":
    sys.exit(main())
