import ctypes
import importlib.metadata
import tomllib

import iceoryx2
from conftest import ROOT

import soleus
from soleus import layouts


def test_the_version_of_iceoryx2_is_the_one_that_is_built_in():
    packages = tomllib.loads((ROOT / "Cargo.lock").read_text())["package"]
    (built_in,) = [package["version"] for package in packages if package["name"] == "iceoryx2"]
    assert importlib.metadata.version("iceoryx2") == built_in
    assert iceoryx2.get_type_name(layouts.RobotState) == layouts.RobotState.WIRE_NAME


def test_the_layouts_are_those_that_the_binaries_have(inspect):
    assert inspect("layout", "--python") == (ROOT / "python/soleus/layouts.py").read_text()


def test_every_array_has_a_label_for_each_element():
    kinds = [kind for kind in vars(layouts).values() if isinstance(kind, type)]
    structures = [kind for kind in kinds if issubclass(kind, layouts.Layout) and kind is not layouts.Layout]
    assert len(structures) > 15
    for structure in structures:
        for name, kind in structure._fields_:
            labels = list(structure.LABELS.get(name, ()))
            while issubclass(kind, ctypes.Array):
                label = labels.pop(0)
                assert isinstance(label, str) or len(label) == kind._length_, f"{structure.__name__}.{name}"
                kind = kind._type_
            assert not labels, f"{structure.__name__}.{name}"


def test_version_and_names_are_the_projects():
    cargo = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]
    project = tomllib.loads((ROOT / "python/pyproject.toml").read_text())["project"]
    assert cargo["version"] == project["version"] == soleus.__version__
