import os
import pathlib
import subprocess
import tempfile
import tomllib

import pytest

from soleus.layouts import Process
from soleus.place import Life, Place, Taken, Unusable, fnv_1a


@pytest.fixture
def short_path():
    """A folder whose path leaves room for the names of sockets."""
    with tempfile.TemporaryDirectory(dir="/tmp", prefix="s") as folder:
        yield pathlib.Path(folder)


def contract(binaries, domain, **environment):
    done = subprocess.run(
        [binaries / "soleus-launch", "domain", "--domain", domain],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, **environment},
    )
    return tomllib.loads(done.stdout)


def agrees(place, said):
    assert str(place.runtime) == said["runtime_folder"]
    assert str(place.root) == said["iceoryx2"]["root-path"]
    assert place.prefix == said["iceoryx2"]["prefix"]
    assert str(place.ready_file) == said["owner"]["file"]
    assert {process.name.lower(): str(place.member_file(process)) for process in Process} == said["processes"]


def test_a_domain_is_where_the_launcher_says(binaries, monkeypatch, short_path):
    monkeypatch.delenv("SOLEUS_RUNTIME_DIR", raising=False)
    agrees(Place("lab-1"), contract(binaries, "lab-1"))
    monkeypatch.setenv("SOLEUS_RUNTIME_DIR", str(short_path / "r"))
    agrees(Place("lab-1"), contract(binaries, "lab-1"))
    # By a link in front of it, too.
    (short_path / "link").symlink_to(short_path)
    monkeypatch.setenv("SOLEUS_RUNTIME_DIR", str(short_path / "link/r"))
    agrees(Place("lab-1"), contract(binaries, "lab-1"))


def test_the_hash_is_the_published_one():
    # From the authors' test vectors.
    assert [fnv_1a(text) for text in (b"", b"a", b"foobar")] == [0x811C9DC5, 0xE40C292C, 0xBF9CF968]


def test_names_and_folders_that_cannot_be_are_refused(monkeypatch, short_path):
    for name in ("", "Lab", "a_b", "x" * 33, "../x"):
        with pytest.raises(Unusable, match="lower-case"):
            Place(name)
    monkeypatch.setenv("SOLEUS_RUNTIME_DIR", "relative")
    with pytest.raises(Unusable, match="absolute"):
        Place("lab")
    runtime = short_path / "r"
    monkeypatch.setenv("SOLEUS_RUNTIME_DIR", str(runtime))
    assert Place("lab").owner() is None
    runtime.mkdir(mode=0o755)
    with pytest.raises(Unusable, match="chmod 700"):
        Place("lab").owner()
    runtime.rmdir()
    runtime.symlink_to(short_path)
    with pytest.raises(Unusable, match="not a real folder"):
        Place("lab").owner()
    monkeypatch.setenv("SOLEUS_RUNTIME_DIR", str(short_path / ("long" * 20)))
    with pytest.raises(Unusable, match="bytes"):
        Place("lab")


def test_there_is_one_life_at_a_time_and_its_end_is_told(tmp_path):
    path = tmp_path / "controller"
    life = Life(path)
    assert path.read_text().split()[0] == str(os.getpid())
    with pytest.raises(Taken, match=str(os.getpid())):
        Life(path)
    life.end(badly=False)
    assert not path.exists()
    Life(path).end(badly=True)
    assert path.read_text().endswith("\n"), "the dead leave their file"
    # The next one takes its place.
    Life(path).end(badly=False)
    assert not path.exists()
