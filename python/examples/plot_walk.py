#!/usr/bin/env python3
"""Plots a recorded walk: zero-moment point, centre of mass, and forces of the feet.

    pip install './python[examples]'
    python3 python/examples/plot_walk.py runs/.../walk.mcap -o walk.png
"""

import argparse

import matplotlib

import soleus
from soleus.layouts import CONTROL_PERIOD_S

# The drives have reached the plan of command k at tick k + 2 (docs/messages.md).
REACHED_TICKS = 2


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording")
    parser.add_argument("-o", "--output", default="walk.png", help="the picture")
    arguments = parser.parse_args()
    matplotlib.use("Agg")
    from matplotlib import pyplot

    with soleus.Recording(arguments.recording) as recording:
        command = recording.read("robot/command")
        truth = recording.read("truth/robot")
        title = recording.facts.get("scenario") or arguments.recording
    # Plan and truth of the same tick.
    plan = command.with_columns(tick=command["header.tick"] + REACHED_TICKS)
    both = truth.join(plan, left_on="header.tick", right_on="tick", suffix=".command")
    time_s = both["header.tick"] * CONTROL_PERIOD_S

    figure, axes = pyplot.subplots(3, 1, figsize=(10, 9), sharex=True, layout="constrained")
    for axis, name in ((axes[0], "zmp_m.y"), (axes[1], "com_position_m.y")):
        axis.plot(time_s, 1e3 * both[name], label="real")
        axis.plot(time_s, 1e3 * both[f"plan.{name}"], "--", label="planned")
        axis.set_ylabel(f"{name.split('_')[0].upper()} y (mm)")
    for foot in ("left", "right"):
        axes[2].plot(time_s, both[f"foot_wrench_n_nm.{foot}.force_z_n"], label=foot)
    axes[2].set_ylabel("normal force (N)")
    axes[2].set_xlabel("time (s)")
    for axis in axes:
        axis.legend(loc="upper right")
        axis.grid(alpha=0.3)
    figure.suptitle(title)
    figure.savefig(arguments.output, dpi=120)
    error_m = ((both["zmp_m.y"] - both["plan.zmp_m.y"]) ** 2).mean() ** 0.5
    print(f"{both.height} ticks, ZMP y off its plan by {1e3 * error_m:.2f} mm (rms); {arguments.output}")


if __name__ == "__main__":
    main()
