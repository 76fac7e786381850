import subprocess
import sys
import threading

import polars
import pytest
from conftest import ROOT

import soleus
from soleus.layouts import Health, Process, RobotState, State

PATIENCE_S = 60.0


def test_who_looks_for_nobody_is_told_how_to_begin():
    with pytest.raises(soleus.NoOwner, match="soleus-launch serve --domain nobody-here"):
        soleus.Domain("nobody-here", patience_s=0.1)


def test_there_is_one_process_of_a_kind_in_any_language(domain, processes, run_folder):
    with soleus.Domain(domain, process="controller", patience_s=PATIENCE_S):
        with pytest.raises(soleus.Occupied, match="has a controller already"):
            soleus.Domain(domain, process=Process.CONTROLLER)
        second = processes("controller", "--config", run_folder / "config/controller.toml", "--domain", domain)
        assert second.wait(timeout=PATIENCE_S) == 7
    assert not soleus.Domain(domain, process="controller").place.member_file(Process.PLANNER).exists()


def test_what_one_publishes_another_takes(domain, inspect):
    with soleus.Domain(domain, process="simulator", patience_s=PATIENCE_S) as robot, soleus.Domain(domain) as looker:
        states, late = looker.subscribe("/robot/state", depth=4), looker.subscribe("robot/state", depth=1)
        health = robot.publish("health/simulator")
        health.send(Health(process=Process.SIMULATOR, state=State.READY))
        publisher = robot.publish("robot/state")
        for tick in range(10):
            message = RobotState(joint_count=2)
            message.header.tick = tick
            message.joint_position_rad[1] = 0.25 * tick
            message.foot_wrench_n_nm[1][2] = float(tick)
            publisher.send(message)
        taken = [states.wait(PATIENCE_S) for _ in range(4)]
        assert [message.header.tick for message in taken] == [6, 7, 8, 9]
        assert [message.foot_wrench_n_nm[1][2] for message in taken] == [6.0, 7.0, 8.0, 9.0]
        assert states.wait(0.01) is None and late.latest().header.sequence == 9
        # The first of them were never heard by one who keeps four.
        assert (states.counts.taken, states.counts.lost) == (4, 0)
        # Health is kept for those who come later.
        kept = looker.subscribe("health/simulator")
        health.serve_late_joiners()
        assert kept.wait(PATIENCE_S).state == State.READY
        listed = inspect("list", "--domain", domain)
        assert "simulator" in listed and "robot/state" in listed and "RobotState" in listed


def test_only_the_publisher_of_a_topic_publishes_it(domain):
    with soleus.Domain(domain, patience_s=PATIENCE_S) as looker:
        with pytest.raises(ValueError, match='process="controller"'):
            looker.publish("robot/command")
        with pytest.raises(ValueError, match="there are walk/pattern"):
            looker.subscribe("robot/comand")
    with soleus.Domain(domain, process="simulator") as robot:
        with pytest.raises(TypeError, match="carries RobotState"):
            robot.publish("robot/state").send(Health())


def test_an_exception_is_told_as_a_death(domain):
    with pytest.raises(ZeroDivisionError):
        with soleus.Domain(domain, process="planner", patience_s=PATIENCE_S) as broken:
            member = broken.place.member_file(Process.PLANNER)
            1 / 0
    assert member.read_text().endswith("\n")


def test_rust_hears_python_and_counts(domain, binaries):
    with soleus.Domain(domain, process="simulator", patience_s=PATIENCE_S) as robot:
        publisher = robot.publish("robot/state")
        command = ["echo", "robot/state", "--domain", domain, "--count", "2", "--json", "--only", "header"]
        echo = subprocess.Popen([binaries / "soleus-inspect", *command], stdout=subprocess.PIPE, text=True)
        done = threading.Event()

        def talk():
            while not done.wait(0.005):
                message = RobotState()
                message.header.tick = publisher._sequence
                publisher.send(message)

        talker = threading.Thread(target=talk)
        talker.start()
        try:
            said, _ = echo.communicate(timeout=PATIENCE_S)
            hz = [binaries / "soleus-inspect", "hz", "robot/state", "--domain", domain, "--count", "1"]
            measured = subprocess.run(hz, capture_output=True, text=True, timeout=PATIENCE_S, check=True).stdout
        finally:
            done.set()
            talker.join()
    lines = polars.read_ndjson(said.encode())
    assert lines["header.tick"].diff()[1] == 1 == lines["header.sequence"].diff()[1]
    assert "robot/state" in measured and float(measured.splitlines()[1].split()[1]) > 1.0


def test_a_recorded_controller_walks_the_same_walk_again(domain, processes, run_folder, recording, tmp_path):
    """The example in place of the controller: the same commands make the same walk, to the bit."""
    config = run_folder / "config"
    again = tmp_path / "again.mcap"
    started = {
        name: processes(name, "--config", config / f"{name}.toml", "--domain", domain, *more)
        for name, more in {
            "planner": [],
            "estimator": [],
            "simulator": ["--wait-for", "planner,estimator,controller,recorder"],
            "recorder": ["--set", f"output_file={again}"],
        }.items()
    }
    command = [sys.executable, ROOT / "python/examples/controller.py", domain, recording]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and "0 lost; the walk is over" in done.stdout, done.stdout + done.stderr
    # It finishes its file when it is asked to stop.
    started["recorder"].terminate()
    assert started["recorder"].wait(timeout=PATIENCE_S) == 0
    before, after = soleus.read(recording, "truth/robot"), soleus.read(again, "truth/robot")
    assert before.equals(after)

