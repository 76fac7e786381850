#!/usr/bin/env python3
"""Watches a domain: who lives in it, and ten times a second where the robot is.

    cargo walk --domain lab          # in one terminal
    python3 python/examples/watch.py lab
"""

import argparse
import math

import soleus
from soleus.layouts import CONTROL_PERIOD_S, Mode, Process, State


def word(table, code):
    try:
        return table(code).name.lower().replace("_", " ")
    except ValueError:
        return f"code {code}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("domain")
    parser.add_argument("--every", type=int, default=20, metavar="TICKS")
    arguments = parser.parse_args()
    # A launch takes some seconds to make its domain.
    with soleus.Domain(arguments.domain, patience_s=60.0) as domain:
        health = {process: domain.subscribe(f"health/{process.name.lower()}", depth=1) for process in Process}
        states = domain.subscribe("robot/state")
        commands = domain.subscribe("robot/command", depth=4)
        mode, told = "unknown", {}
        for state in states:
            if (command := commands.latest()) is not None:
                mode = word(Mode, command.mode)
            for process, subscriber in health.items():
                if (said := subscriber.latest()) is not None and told.get(process) != said.state:
                    told[process] = said.state
                    print(f"{process.name.lower()} (process {said.process_id}) is {word(State, said.state)}")
            if state.header.tick % arguments.every == 0:
                left, right = (foot[2] for foot in state.foot_wrench_n_nm)
                x, y, _, w = state.imu_orientation_xyzw
                # Angle between the vertical and that of the IMU.
                tilt = 2.0 * math.asin(min(1.0, math.hypot(x, y)))
                print(
                    f"{state.header.tick * CONTROL_PERIOD_S:7.2f} s  {mode:<9}  feet {left:6.1f} N {right:6.1f} N  "
                    f"tilt {1e3 * tilt:5.1f} mrad"
                )
        counts = states.counts
        print(f"the domain has ended: {counts.taken} states, {counts.lost} lost")


if __name__ == "__main__":
    main()
