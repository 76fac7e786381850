#!/usr/bin/env python3
"""Time per call of Soleus and of Pinocchio's C++ on the same robots, interleaved on this machine; see README.md."""

import argparse
import json
import pathlib
import os
import subprocess
import sys

import environment

CASES = [
    ("talos_reduced.urdf", ["left_sole_link", "right_sole_link", "gripper_left_base_link", "gripper_right_base_link", "torso_2_link"]),
    ("g1_29dof_rev_1_0.urdf", ["left_ankle_roll_link", "right_ankle_roll_link", "left_wrist_yaw_link", "right_wrist_yaw_link", "torso_link"]),
    ("hrp4.urdf", ["l_ankle", "r_ankle", "l_wrist", "r_wrist", "torso"]),
]
FLAGS = ["-std=c++17", "-O3", "-march=native", "-DNDEBUG", "-w"]
# Pinocchio has more joint types than Boost lists hold by default.
FLAGS += ["-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS", "-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-DBOOST_FUSION_INVOKE_MAX_ARITY=12"]


def dump(urdf, frames, path):
    """The model as numbers, so that the C++ side needs no parser (and no library compiled with other flags)."""
    import pinocchio as pin

    model = pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())
    row = lambda X: " ".join(repr(float(x)) for x in [*X.rotation.flatten(), *X.translation])
    lines = [str(model.njoints - 1)]
    for k in range(1, model.njoints):
        joint, inertia = model.joints[k], model.inertias[k]
        extracted = joint.extract() if hasattr(joint, "extract") else joint
        axis = getattr(extracted, "axis", [0.0, 0.0, 0.0])
        numbers = [inertia.mass, *inertia.lever, *inertia.inertia.flatten()]
        lines.append(" ".join([joint.shortname(), str(model.parents[k]), *(repr(float(x)) for x in axis)]))
        lines.append(row(model.jointPlacements[k]))
        lines.append(" ".join(repr(float(x)) for x in numbers))
    lines.append(str(len(frames)))
    for name in frames:
        frame = model.frames[model.getFrameId(name)]
        lines.append(f"{frame.parentJoint} {row(frame.placement)}")
    path.write_text("\n".join(lines))


def build():
    prefix = next((environment.VENV / "lib").glob("python3.*/site-packages/cmeel.prefix"))
    source, binary = environment.HERE / "speed.cpp", environment.VENV / "speed"
    if not binary.exists() or binary.stat().st_mtime < source.stat().st_mtime:
        includes = [f"-I{prefix}/include", f"-I{prefix}/include/eigen3"]
        print("compiling speed.cpp (a minute or two) ...", file=sys.stderr)
        subprocess.run(["g++", *FLAGS, *includes, source, "-o", binary], check=True)
    command = ["cargo", "build", "--quiet", "--release", "--package", "multibody", "--example", "speed"]
    subprocess.run(command, cwd=environment.ROOT, check=True)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", environment.ROOT / "target"))
    return binary, target / "release" / "examples" / "speed"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7, help="A B A B ... rounds; the fastest counts (default 7)")
    arguments = parser.parse_args()
    environment.enter()
    cpp, rust = build()
    run = lambda command: json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    for name, frames in CASES:
        (urdf, *_) = [*environment.robots().rglob(name), *(environment.ROOT / "robots").rglob(name)]
        model = environment.VENV / f"{name}.txt"
        dump(urdf, frames, model)
        theirs, ours = {}, {}
        for _ in range(arguments.rounds):
            for best, command in ((theirs, [cpp, model, str(len(frames))]), (ours, [rust, urdf, *frames])):
                for key, value in run(command).items():
                    best[key] = min(best.get(key, value), value)
        print(f"\n{name}, nv = {ours['nv']}\n| ns per call | Soleus | Pinocchio | ratio |\n|---|---|---|---|")
        for key, value in ours.items():
            if key == "nv":
                continue
            yardstick = min((time for other, time in theirs.items() if other.startswith(key)), default=None)
            theirs_and_ratio = f"{yardstick:.0f} | {value / yardstick:.2f}" if yardstick else "- | -"
            print(f"| {key} | {value:.0f} | {theirs_and_ratio} |")


if __name__ == "__main__":
    main()
