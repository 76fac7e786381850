#!/usr/bin/env python3
"""A stand-in for the controller: answers every state with the command of a recorded walk.

On the simulated robot, in lock-step, the same commands make the same walk, to the bit. Change `answer` to try a control
law of your own.

    soleus-launch serve --domain lab &
    for p in planner estimator simulator recorder; do soleus-$p --config config/$p.toml --domain lab & done
    python3 python/examples/controller.py lab runs/.../walk.mcap
"""

import argparse
import sys

import soleus
from soleus.layouts import Health, Mode, Process, Reason, RobotCommand, State, WalkStart

# How long a robot may be silent before one gives up (s).
PATIENCE_S = 60.0


def fill(message, recorded):
    """Copies a protobuf message of a recording into the structure of the same name."""
    for name, _ in message._fields_:
        value, field = getattr(recorded, name), getattr(message, name)
        if hasattr(value, "DESCRIPTOR"):
            fill(field, value)
        elif not hasattr(field, "_length_"):
            setattr(message, name, value)
        else:
            _fill_array(field, list(value))
    return message


def _fill_array(array, values):
    """Arrays of arrays lie flat in a recording."""
    if values and hasattr(values[0], "DESCRIPTOR"):
        for element, value in zip(array, values):
            fill(element, value)
    elif hasattr(array[0], "_length_"):
        length = len(array[0])
        for index, inner in enumerate(array):
            _fill_array(inner, values[index * length : (index + 1) * length])
    else:
        array[: len(values)] = values


def answer(state, commands):
    """The command for a state: here the recorded one of its tick."""
    return commands.get(state.header.tick)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("domain")
    parser.add_argument("recording")
    arguments = parser.parse_args()
    with soleus.Recording(arguments.recording) as recording:
        messages = [fill(RobotCommand(), message) for _, message, _ in recording.messages("robot/command")]
        starts = [fill(WalkStart(), message) for _, message, _ in recording.messages("walk/start")]
    commands = {message.header.tick: message for message in messages}
    fingerprint = messages[0].header.robot_fingerprint
    with soleus.Domain(arguments.domain, process="controller", patience_s=PATIENCE_S) as domain:
        states = domain.subscribe("robot/state", depth=8)
        publisher = domain.publish("robot/command")
        start = domain.publish("walk/start")
        health = domain.publish("health/controller")
        said = Health(process=Process.CONTROLLER, state=State.READY)
        said.header.robot_fingerprint = fingerprint
        said.header.tick = -1
        pattern = domain.subscribe("walk/pattern")
        if (found := pattern.wait(PATIENCE_S)) is None:
            sys.exit("no walking pattern")
        header, phases = found
        print(f"a pattern of {len(phases)} phases, {header.duration_s:.2f} s")
        health.send(said)
        answered, robot, over = 0, domain.subscribe("health/simulator", depth=1), False
        command = None
        while not over:
            # While nobody asks, who waits for us must hear that we are ready.
            if (state := states.wait(0.1)) is None:
                health.send(said)
                ends = (news := robot.latest()) is not None and news.state == State.STOPPING
                over = ends or not domain.owner_is_alive()
                continue
            if state.header.robot_fingerprint != fingerprint:
                sys.exit(f"a robot with fingerprint {state.header.robot_fingerprint:#x}, recorded {fingerprint:#x}")
            command = answer(state, commands)
            if command is None:
                print(f"tick {state.header.tick}: nothing more is recorded")
                break
            # Whoever has the command of this tick must also have the start decided at it.
            for message in starts:
                if message.header.tick == state.header.tick:
                    start.send(message)
            publisher.send(command)
            answered += 1
            said.state, said.walk_time_s = State.RUNNING, command.walk_time_s
            said.header.tick = state.header.tick
            said.cycles = answered
            health.send(said)
        said.state, said.reason = State.STOPPING, Reason.FINISHED
        health.send(said)
        ended = "the walk is over" if command is not None and command.mode == Mode.FINISHED else "broken off"
        print(f"{answered} states answered, {states.counts.lost} lost; {ended}")


if __name__ == "__main__":
    main()
