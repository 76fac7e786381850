#!/usr/bin/env python3
"""Opens a recording with Rerun and checks that it shows a robot: no viewer needs to be on a screen for it.

    python3 tools/oracles/viewers.py runs/.../walk.mcap

`rerun mcap check` must find nothing wrong, and what Rerun's own importer makes of the file must hold a shape for every link of the
URDF that has one, transforms, curves of the joints by name, and lines of the log. Usage data of Rerun is switched off.
Ends with code 1 if anything is missing.
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

import environment


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "NO_COLOR": "1"})
    return done.returncode, done.stdout + done.stderr


def importer(rerun, path):
    """What Rerun's importer makes of a recording: entity paths and their components, a line for each chunk."""
    with tempfile.TemporaryDirectory() as folder:
        rrd = pathlib.Path(folder) / "walk.rrd"
        code, said = run(rerun, "mcap", "convert", path, "-o", str(rrd))
        if code != 0:
            raise SystemExit(f"rerun mcap convert: {said}")
        code, said = run(rerun, "rrd", "print", str(rrd))
        lines = re.findall(r"rows \([^)]*\) - (/\S+) - data columns: \[([^\]]*)", said)
        return {(entity, component.split(":")[0]) for entity, components in lines for component in components.split()}


def drawn_links(path):
    """Links of the attached URDF that have a shape."""
    from mcap.reader import make_reader

    with open(path, "rb") as file:
        for attachment in make_reader(file).iter_attachments():
            if attachment.name.endswith(".urdf"):
                links = xml.etree.ElementTree.fromstring(attachment.data).iter("link")
                return [link.get("name") for link in links if link.find("visual") is not None]
    raise SystemExit("no URDF is attached")


def main(path):
    rerun = str(pathlib.Path(sys.executable).with_name("rerun"))
    run(rerun, "analytics", "disable")
    wrong = []
    code, said = run(rerun, "mcap", "check", path)
    print(said.strip())
    if code != 0 or "PROBLEM" in said:
        wrong.append("rerun mcap check")
    found = importer(rerun, path)
    shapes = ("Boxes3D", "Mesh3D", "Asset3D", "Capsules3D", "Cylinders3D", "Ellipsoids3D")
    links = drawn_links(path)
    drawn = [link for link in links if any(f"/{link}/" in entity and component in shapes for entity, component in found)]
    print(f"{len(drawn)} of {len(links)} links with a shape are drawn")
    if len(drawn) < len(links):
        wrong.append("links " + ", ".join(sorted(set(links) - set(drawn))))
    for entity, component in [
        ("/tf", "Transform3D"),
        ("/joint_states/position", "SeriesLines"),
        ("/joint_states/velocity", "SeriesLines"),
        ("/joint_states/effort", "SeriesLines"),
        ("/log", "TextLog"),
    ]:
        if (entity, component) not in found:
            wrong.append(f"{component} of {entity}")
    if wrong:
        print("missing:", ", ".join(wrong))
        return 1
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: viewers.py FILE.mcap")
    environment.enter(environment.HERE / ".venv-viewers", environment.HERE / "requirements-viewers.txt")
    sys.exit(main(sys.argv[1]))
