"""Makes tools/oracles/.venv with the pinned packages, fetches the URDFs of example-robot-data, builds soleus-inspect."""

import os
import pathlib
import subprocess
import sys
import venv
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
VENV = HERE / ".venv"
PYTHON = VENV / "bin" / "python"
# Its wheel is mostly meshes: only the URDFs are taken out of it.
ROBOT_DATA = "example-robot-data==6.0.0"


def enter(folder=VENV, requirements=HERE / "requirements.txt"):
    """Continues inside the venv, making it first if it is missing or older than the requirements."""
    python, stamp = folder / "bin" / "python", folder / "installed"
    if not stamp.exists() or stamp.stat().st_mtime < requirements.stat().st_mtime:
        print(f"installing {requirements.name} into {folder} (once) ...", file=sys.stderr)
        venv.create(folder, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "-r", requirements], check=True, cwd=ROOT)
        stamp.touch()
    if pathlib.Path(sys.prefix) != folder:
        os.execv(python, [str(python), *sys.argv])


def robots(python=PYTHON):
    """Folder with the URDFs of example-robot-data, fetched by the pip of `python`."""
    folder = VENV / "robots"
    if not folder.exists():
        print(f"downloading {ROBOT_DATA} for its URDFs (once) ...", file=sys.stderr)
        wheels = VENV / "wheels"
        command = [python, "-m", "pip", "download", "--quiet", "--no-deps", "-d", wheels, ROBOT_DATA]
        subprocess.run(command, check=True)
        (wheel,) = wheels.glob("example_robot_data-*.whl")
        with zipfile.ZipFile(wheel) as archive:
            for name in archive.namelist():
                if name.endswith(".urdf"):
                    archive.extract(name, folder)
        wheel.unlink()
    return folder


def packaged(package, pattern):
    """URDFs of an installed package."""
    folders = list((VENV / "lib").glob(f"python3.*/site-packages/{package}"))
    return sorted(path for folder in folders for path in folder.rglob(pattern))


def inspect(profile="dev"):
    """Path of soleus-inspect, built."""
    subprocess.run(["cargo", "build", "--quiet", "--package", "soleus-inspect", "--profile", profile], cwd=ROOT, check=True)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    return target / ("debug" if profile == "dev" else profile) / "soleus-inspect"
