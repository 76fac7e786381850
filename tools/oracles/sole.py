#!/usr/bin/env python3
"""Soleus' finite elements against scikit-fem.

    python3 tools/oracles/sole.py        # worst relative difference per sole, exit code 1 above 1e-9

A sole is pressed into the ground by a given pose through `soleus-inspect sole`; its node forces are then applied to the same mesh in
scikit-fem (own assembly, SciPy's sparse solver), whose displacements of the contact nodes must be those that soleus reported.
"""

import json
import subprocess
import sys
import tempfile

import environment

VENV = environment.HERE / ".venv-sole"
LIMIT = 1e-9
SOLES = [
    # box (m), cells, E (Pa), nu
    ([0.23, 0.13, 0.021], [12, 7, 3], 0.32e6, 0.31),
    ([0.23, 0.13, 0.030], [10, 5, 5], 0.32e6, 0.31),
    ([0.23, 0.13, 0.060], [5, 4, 2], 5e6, 0.49),
    ([0.23, 0.13, 0.006], [9, 4, 2], 0.02e6, 0.0),
]


def kuhn(box, cells):
    """Nodes (3 x n) and tetrahedra (4 x m) of a box: node i + (nx+1)(j + (ny+1)k), six Kuhn tetrahedra per cell."""
    import itertools

    import numpy

    nx, ny, nz = cells
    axes = [numpy.linspace(-box[0] / 2, box[0] / 2, nx + 1), numpy.linspace(-box[1] / 2, box[1] / 2, ny + 1)]
    axes.append(numpy.linspace(0, box[2], nz + 1))
    nodes = numpy.array([(x, y, z) for z in axes[2] for y in axes[1] for x in axes[0]]).T
    number = lambda c: c[0] + (nx + 1) * (c[1] + (ny + 1) * c[2])
    tetrahedra = []
    for k, j, i in itertools.product(range(nz), range(ny), range(nx)):
        for path in itertools.permutations(range(3)):
            corner, element = [i, j, k], [number([i, j, k])]
            for axis in path:
                corner[axis] += 1
                element.append(number(corner))
            tetrahedra.append(element)
    return nodes, numpy.array(tetrahedra).T


def main():
    import numpy
    from skfem import Basis, ElementTetP1, ElementVector, MeshTet, condense, solve
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    command, worst = environment.inspect(), 0.0
    for box, cells, modulus, nu in SOLES:
        nodes, tetrahedra = kuhn(box, cells)
        contact = numpy.flatnonzero(nodes[2] == 0)
        toml = f"friction = 0.65\ncontact = \"bottom\"\n[mesh]\nbox_m = {box}\ncells = {cells}\n[material]\n"
        toml += f"young_modulus_pa = {modulus!r}\npoisson_ratio = {nu!r}\n[foot]\nankle_in_sole_m = [0.0, 0.0, 0.1]\n"
        roll, pitch = 0.004, -0.006
        sx, cx, sy, cy = numpy.sin(roll), numpy.cos(roll), numpy.sin(pitch), numpy.cos(pitch)
        rotation = numpy.array([[cy, sy * sx, sy * cx], [0, cx, -sx], [-sy, cy * sx, cy * cx]])
        height = -0.02 * box[2] - 0.0004
        flat = {"position": [0, 0, 0.001], "rotation": numpy.eye(3).tolist()}
        pressed = {"position": [0.0002, -0.0001, height], "rotation": rotation.tolist()}
        question = {"ticks": [{"pose": flat}, {"pose": pressed}]}
        with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
            file.write(toml)
            file.flush()
            run = subprocess.run(
                [command, "sole", "--sole", file.name], input=json.dumps(question), capture_output=True, text=True, check=True
            )
        tick = json.loads(run.stdout)["ticks"][1]
        force = numpy.array(tick["node_forces"]) @ rotation
        position = (numpy.array(tick["node_positions"]) - pressed["position"]) @ rotation
        displacement = position - nodes.T[contact]
        mesh = MeshTet(nodes, tetrahedra)
        basis = Basis(mesh, ElementVector(ElementTetP1()))
        stiffness = linear_elasticity(*lame_parameters(modulus, nu)).assemble(basis)
        load = basis.zeros()
        load[basis.nodal_dofs[:, contact]] = force.T
        clamped = basis.nodal_dofs[:, numpy.isclose(nodes[2], box[2])].flatten()
        answer = solve(*condense(stiffness, load, D=clamped))
        theirs = answer[basis.nodal_dofs[:, contact]].T
        difference = numpy.abs(theirs - displacement).max() / numpy.abs(theirs).max()
        worst = max(worst, difference)
        states = tick["node_states"]
        print(
            f"box {box}, cells {cells}, E {modulus:g}, nu {nu}: {len(contact)} contact nodes ({states.count('open')} open), "
            f"{force.sum(axis=0)[2]:.1f} N, displacements differ by {difference:.1e} of the largest"
        )
    print(f"worst {worst:.1e}, limit {LIMIT:.0e}")
    return 0 if worst < LIMIT else 1


if __name__ == "__main__":
    environment.enter(VENV, environment.HERE / "requirements-sole.txt")
    sys.exit(main())
