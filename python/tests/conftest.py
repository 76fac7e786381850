"""What the tests need of the project. Run by hand:

    cargo build --bins && cargo walk --set planner.gait.walk.swings=2 --out /tmp/short
    SOLEUS_BINARIES=target/debug SOLEUS_RUN=/tmp/short python3 -m pytest python
"""

import os
import pathlib
import subprocess
import time

import pytest

ROOT = pathlib.Path(__file__).parents[2]


def named(variable, what):
    value = os.environ.get(variable)
    if not value:
        pytest.skip(f"{variable} does not name {what}")
    return pathlib.Path(value).resolve()


@pytest.fixture(scope="session")
def binaries():
    return named("SOLEUS_BINARIES", "the folder of the binaries")


@pytest.fixture(scope="session")
def run_folder():
    """The folder of a run: recording and effective configuration."""
    return named("SOLEUS_RUN", "the folder of a run")


@pytest.fixture(scope="session")
def recording(run_folder):
    return run_folder / "walk.mcap"


@pytest.fixture
def inspect(binaries):
    def call(*arguments, code=0):
        command = [binaries / "soleus-inspect", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120)
        assert done.returncode == code, done.stderr
        return done.stdout

    return call


@pytest.fixture
def processes(binaries):
    """Starts processes; ends those that still live, the last one first."""
    living = []

    def start(name, *arguments):
        process = subprocess.Popen([binaries / f"soleus-{name}", *map(str, arguments)])
        living.append(process)
        return process

    yield start
    for process in reversed(living):
        if process.poll() is None:
            process.terminate()
        process.wait(timeout=60)


@pytest.fixture
def domain(processes):
    """Name of a domain that has an owner."""
    name = f"python-{os.getpid()}-{time.monotonic_ns() % 1_000_000}"
    processes("launch", "serve", "--domain", name)
    return name
