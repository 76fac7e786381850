#!/usr/bin/env python3
"""Soleus' rigid-body dynamics against Pinocchio; see README.md."""

import argparse
import json
import pathlib
import re
import subprocess
import sys
import typing

import environment

ROBOTS = [
    "talos_reduced.urdf",
    "talos_full_v2.urdf",
    "g1_29dof_rev_1_0.urdf",
    "g1_29dof_with_hand_rev_1_0.urdf",
    "romeo_small.urdf",
    "romeo.urdf",
    "simple_humanoid.urdf",
    "human.urdf",
    "icub_reduced.urdf",
    "alexander_v1.lowerBodyOnly.urdf",
    "anymal.urdf",
    "panda.urdf",
    "tiago.urdf",
]
LIMIT, GOAL = 1e-9, 1e-11
# Below this an error of the forward dynamics is a few last digits, and its estimate a matter of luck.
LAST_DIGITS = 1e-13


def random_tree(rng, links):
    """A URDF of a random tree: every joint type, arbitrary axes and frames, fixed and massless links among them."""
    def numbers(values):
        return " ".join(repr(float(x)) for x in values)

    text = ['<robot name="random">']
    for i in range(links + 1):
        massless = i > 0 and rng.random() < 0.1
        mass, edges = rng.uniform(0.2, 4.0), rng.uniform(0.05, 0.4, 3)
        ixx, iyy, izz = mass / 12 * (sum(edges**2) - edges**2)
        inertial = "" if massless else (
            f'<inertial><origin xyz="{numbers(rng.uniform(-0.2, 0.2, 3))}" rpy="{numbers(rng.uniform(-3, 3, 3))}"/>'
            f'<mass value="{mass!r}"/><inertia ixx="{ixx!r}" iyy="{iyy!r}" izz="{izz!r}" ixy="0" ixz="0" iyz="0"/></inertial>'
        )
        text.append(f'<link name="l{i}">{inertial}</link>'.replace("np.float64(", "").replace(")", ""))
        if i == 0:
            continue
        kinds = ["fixed"] if massless else ["revolute", "revolute", "revolute", "continuous", "prismatic", "fixed"]
        parent = rng.integers(i) if rng.random() < 0.3 else i - 1
        axis = [[1, 0, 0], [0, -1, 0], [0, 0, 1], rng.normal(size=3), rng.normal(size=3)][rng.integers(5)]
        text.append(
            f'<joint name="j{i}" type="{kinds[rng.integers(len(kinds))]}"><parent link="l{parent}"/><child link="l{i}"/>'
            f'<origin xyz="{numbers(rng.uniform(-0.4, 0.4, 3))}" rpy="{numbers(rng.uniform(-3, 3, 3))}"/>'
            f'<axis xyz="{numbers(axis)}"/><limit lower="-1" upper="1" effort="9" velocity="9"/></joint>'
        )
    return "\n".join([*text, "</robot>"])


def with_followers(rng, urdf):
    """Lets every third movable joint of a random tree follow another one, some of them over two steps."""
    lines = urdf.split("\n")
    movable = [k for k, line in enumerate(lines) if line.startswith("<joint") and 'type="fixed"' not in line]
    names = {k: lines[k].split('"')[1] for k in movable}
    followers = movable[1::3]
    for n, k in enumerate(followers):
        leader = followers[n - 1] if n % 3 == 2 else rng.choice([other for other in movable if other not in followers])
        # Within the limits of all of them somewhere, for those of followers bound their leaders.
        multiplier, offset = rng.uniform(0.4, 1.4) * rng.choice([-1, 1]), rng.uniform(-0.3, 0.3)
        mimic = f'<mimic joint="{names[leader]}" multiplier="{float(multiplier)!r}" offset="{float(offset)!r}"/>'
        lines[k] = lines[k].replace("</joint>", f"{mimic}</joint>")
    return "\n".join(lines)


def random_states(rng, joints, base_dofs, count):
    """States far outside all limits."""
    import numpy as np

    states = []
    for k in range(count):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        angle = np.pi - 1e-6 * rng.random() if k % 4 == 0 else np.pi * rng.random()
        nv = base_dofs + len(joints)
        states.append({
            "base_position": list(rng.uniform(-3, 3, 3)) if base_dofs else [0.0] * 3,
            "base_quaternion_xyzw": [*(axis * np.sin(angle / 2)), np.cos(angle / 2)] if base_dofs else [0, 0, 0, 1],
            "joint_angles": dict(zip(joints, rng.uniform(-6, 6, len(joints)))),
            "v": list(rng.uniform(-3, 3, nv)),
            "a": list(rng.uniform(-5, 5, nv)),
            "tau": list(rng.uniform(-50, 50, nv)),
        })
    return states


class Reference:
    """The same quantities by Pinocchio, in Soleus' order of joints.

    Where joints follow others (`<mimic>`), Pinocchio moves the tree without couplings and they come in as the matrix S of
    `v_tree = S v`: M = S' M_tree S, h = S' h_tree, J = J_tree S, and so on. With `native`, Pinocchio couples the joints itself, in all but
    the forward dynamics, which it does not have then.
    """

    def __init__(self, urdf, joints, fixed_base, native=False):
        import exact
        import numpy as np
        import pinocchio as pin

        root = () if fixed_base else (pin.JointModelFreeFlyer(),)
        self.model = pin.buildModelFromUrdf(str(urdf), *root, mimic=native)
        self.data = self.model.createData()
        self.fixed_base, self.native = fixed_base, native
        names = [n for n in self.model.names[1:] if n != "root_joint"]
        laws = exact.laws(urdf)
        self.laws = {name: (laws[name][0], float(laws[name][1]), float(laws[name][2])) for name in names}
        free = [name for name in names if laws[name][0] == name]
        if sorted(free) != sorted(joints):
            raise ValueError(f"joints differ: {sorted(set(free) ^ set(joints))}")
        self.followers = len(self.laws) - len(free)
        base = 0 if fixed_base else 6
        self.S = np.zeros((self.model.nv, base + len(joints)))
        self.S[:base, :base] = np.eye(base)
        column = {name: base + k for k, name in enumerate(joints)}
        for name, (leader, multiplier, _) in self.laws.items():
            if name == leader or (leader and not native):
                self.S[self.model.joints[self.model.getJointId(name)].idx_v, column[leader]] = multiplier

    def configuration(self, state):
        import numpy as np
        import pinocchio as pin

        q = pin.neutral(self.model)
        if not self.fixed_base:
            q[:3], q[3:7] = state["base_position"], state["base_quaternion_xyzw"]
            q[3:7] /= np.linalg.norm(q[3:7])
        for name, (leader, multiplier, offset) in self.laws.items():
            if self.native and name != leader:
                continue
            joint = self.model.joints[self.model.getJointId(name)]
            angle = multiplier * state["joint_angles"][leader] + offset if leader else offset
            if joint.nq == 2:
                q[joint.idx_q], q[joint.idx_q + 1] = np.cos(angle), np.sin(angle)
            else:
                q[joint.idx_q] = angle
        return q

    def terms(self, state, frames):
        import numpy as np
        import pinocchio as pin

        model, data, S = self.model, self.data, self.S
        q = self.configuration(state)
        v, a = S @ state["v"], S @ state["a"]
        zero = np.zeros(model.nv)
        out = {}
        M = pin.crba(model, data, q)
        M = np.triu(M) + np.triu(M, 1).T
        out["M"] = S.T @ M @ S
        out["nle"] = S.T @ pin.nonLinearEffects(model, data, q, v)
        out["gravity"] = S.T @ pin.computeGeneralizedGravity(model, data, q)
        out["rnea"] = S.T @ pin.rnea(model, data, q, v, a)
        if self.followers == 0:
            out["aba"] = S.T @ pin.aba(model, data, q, v, S @ state["tau"])
        elif not self.native:
            try:
                out["aba"] = np.linalg.solve(out["M"], state["tau"] - out["nle"])
            except np.linalg.LinAlgError:
                out["aba"] = np.full(S.shape[1], np.nan)
        out["Jcom"] = pin.jacobianCenterOfMass(model, data, q) @ S
        pin.centerOfMass(model, data, q, v, zero)
        out["com"], out["com_drift"] = data.com[0].copy(), data.acom[0].copy()
        pin.ccrba(model, data, q, v)
        out["Ag"], out["hg"] = data.Ag @ S, data.hg.vector.copy()
        out["hg_drift"] = pin.computeCentroidalMomentumTimeVariation(model, data, q, v, zero).vector.copy()
        pin.forwardKinematics(model, data, q, v, zero)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        for name in frames:
            frame = model.getFrameId(name, pin.FrameType.BODY)
            out["placement", name] = data.oMf[frame].homogeneous
            out["J", name] = pin.getFrameJacobian(model, data, frame, axes) @ S
            out["drift", name] = pin.getFrameClassicalAcceleration(model, data, frame, axes).vector
        return out


class NotRead(Exception):
    """One of the two programs cannot read a robot: a result. Anything else that goes wrong is a bug and ends the comparison."""


def compare(binary, urdf, seed, count, fixed_base=False, decide_all=False):
    """Worst relative error per quantity, joints with followers and whether Pinocchio couples them too, and the states whose forward dynamics 60 digits decided."""
    import exact
    import numpy as np
    import pinocchio as pin

    base = ["--fixed-base"] if fixed_base else []
    command = [binary, "dynamics", "--robot", urdf, *base]
    run = lambda extra, text="": subprocess.run(command + extra, input=text, capture_output=True, text=True)
    listed = run(["--joints"])
    if listed.returncode != 0:
        raise NotRead(listed.stderr.strip())
    joints = json.loads(listed.stdout)
    try:
        references = [Reference(urdf, joints, fixed_base)]
    except (RuntimeError, ValueError) as error:
        raise NotRead(f"Pinocchio: {error}") from error
    if references[0].followers:
        try:
            references.append(Reference(urdf, joints, fixed_base, native=True))
        except (RuntimeError, ValueError):
            pass  # Pinocchio couples joints only where the leader comes first; its tree with S remains
    rng = np.random.default_rng(seed)
    states = random_states(rng, joints, 0 if fixed_base else 6, count)
    bodies = [f.name for f in references[0].model.frames if f.type == pin.FrameType.BODY]
    frames = sorted(set(rng.choice(bodies, size=min(8, len(bodies)), replace=False)))
    answer = run(["--frames", *frames], json.dumps({"states": states}))
    if answer.returncode not in (0, 1):
        raise ValueError(answer.stderr.strip())
    worst, decided = {}, []
    for k, (state, ours) in enumerate(zip(states, json.loads(answer.stdout)["states"])):
        found, expected = {}, {}
        for key, value in (item for reference in references for item in reference.terms(state, frames).items()):
            name, answer = (key, ours[key]) if isinstance(key, str) else (key[0], ours["frames"][key[1]][key[0]])
            if answer is not None:  # aba of a robot with a joint that moves nothing: nobody has an answer
                found.setdefault(name, []).extend(np.ravel(answer))
                expected.setdefault(name, []).extend(np.ravel(value))
        for name in found:
            scale = np.max(np.abs(expected[name]), initial=np.finfo(float).tiny)
            error = float(np.max(np.abs(np.subtract(found[name], expected[name])), initial=0.0) / scale)
            error = error if np.isfinite(error) else float("inf")
            if name == "aba" and (decide_all or error > LIMIT):
                truth, rounded = exact.Robot(urdf, joints, fixed_base).forward_dynamics(state)
                errors = [exact.error(map(float, vd), truth) for vd in (found[name], expected[name], rounded)]
                decided.append(Decision(k, error, *errors, ours["aba_error"]))
                error = decided[-1].soleus
            worst[name] = max(worst.get(name, 0.0), error)
    return worst, (len(joints), references[0].followers, len(references) == 2), decided


class Decision(typing.NamedTuple):
    """Relative errors of one state's forward dynamics."""

    state: int
    difference: float  # between the two programs
    soleus: float  # from the solution with 60 digits
    pinocchio: float
    rounding: float  # of nothing but M's entries to doubles
    reported: float  # by Soleus, of its own error


def without_mimic(urdf, folder):
    """A copy without `<mimic>`, for a file in which one names a joint that does not exist."""
    path = folder / urdf.name
    path.write_text(re.sub(r"<mimic\b[^>]*?/>|<mimic\b.*?</mimic>", "", urdf.read_text(), flags=re.DOTALL))
    return path


def by_pinocchio(urdf):
    """What Pinocchio says of a file that was not compared."""
    import numpy as np
    import pinocchio as pin

    try:
        model = pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())
    except Exception as error:
        return f"refuses it too: {error}"
    moment = lambda k: np.linalg.eigvalsh(model.inertias[k].inertia)[0]
    worst = min(range(1, model.njoints), key=moment)
    return f"reads it; smallest principal moment of a body {moment(worst):.2g} kg m^2, at {model.names[worst]}"


def print_decisions(decisions, robots):
    """What 60 digits say of the forward dynamics."""
    import numpy as np

    print("\nforward dynamics, decided with 60 digits (relative errors):")
    print(f"  {'robot':56} {'state':>5} {'difference':>10} {'Soleus':>9} {'Pinocchio':>9} {'M rounded':>9} {'reported':>9}")
    for name in robots:
        of_robot = [decision for other, decision in decisions if other == name]
        if of_robot:
            worst = max(of_robot, key=lambda decision: decision.soleus)
            numbers = " ".join(f"{x:9.1e}" for x in worst[2:])
            print(f"  {name:56} {worst.state:5} {worst.difference:10.1e} {numbers}")
    for label, column in (("Soleus", "soleus"), ("Pinocchio", "pinocchio"), ("M rounded", "rounding")):
        errors = [getattr(decision, column) for _, decision in decisions]
        print(f"  {label}: median {np.median(errors):.1e}, worst {max(errors):.1e} of {len(errors)} states")
    ratios = [decision.reported / decision.soleus for _, decision in decisions if decision.soleus > LAST_DIGITS]
    if ratios:
        low, median, high = np.quantile(ratios, [0.05, 0.5, 0.95])
        spread = f"median {median:.2g}, 90 % within {low:.2g} .. {high:.2g}"
        print(f"  reported over true error, {len(ratios)} states above {LAST_DIGITS:g}: {spread}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--urdf", type=pathlib.Path, nargs="*", help="your own robots instead")
    parser.add_argument("--all", action="store_true", help="every URDF of the packages")
    parser.add_argument("--exact", action="store_true", help="hold the forward dynamics of every state against 60 digits (minutes)")
    parser.add_argument("--trees", type=int, default=20, help="number of random trees (default 20)")
    parser.add_argument("--states", type=int, default=20, help="states per robot (default 20)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--binary", type=pathlib.Path, help="soleus-inspect, if already built")
    arguments = parser.parse_args()
    environment.enter()
    import numpy as np

    binary = arguments.binary or environment.inspect()
    if arguments.urdf:
        robots, arguments.trees = arguments.urdf, 0
    else:
        available = sorted(environment.robots().rglob("*.urdf"))
        robots = [path for path in available if arguments.all or path.name in ROBOTS]
        robots += environment.packaged("jvrc_description", "jvrc1.urdf")
        robots += [path for path in environment.packaged("icub_models", "*.urdf") if arguments.all or "V2_7" in str(path)]
        robots += [environment.ROOT / "robots" / "hrp4" / "hrp4.urdf"]
    cases = [(f"{path.parent.parent.name}/{path.name}", path, False) for path in robots]
    trees = environment.VENV / "random"
    trees.mkdir(exist_ok=True)
    for k in range(arguments.trees):
        path = trees / f"tree_{arguments.seed}_{k}.urdf"
        path.write_text(random_tree(np.random.default_rng([arguments.seed, k]), 3 + 2 * k))
        cases.append((path.name, path, k % 4 == 3))
        coupled = trees / f"tree_{arguments.seed}_{k}_coupled.urdf"
        coupled.write_text(with_followers(np.random.default_rng([arguments.seed, k, 1]), path.read_text()))
        cases.append((coupled.name, coupled, k % 4 == 3))
    total, failed, unread, decisions = {}, [], [], []
    print(f"{'robot':58} {'joints':>6} {'followers':>9} {'worst':>9}  of")
    for name, path, fixed_base in cases:
        try:
            worst, (joints, followers, native), decided = compare(binary, path, arguments.seed, arguments.states, fixed_base, arguments.exact)
        except NotRead as error:
            unread.append((name, str(error), by_pinocchio(path)))
            if " mimics " in str(error) and not name.endswith(" without <mimic>"):
                cases.append((f"{name} without <mimic>", without_mimic(path, trees), fixed_base))
            continue
        quantity = max(worst, key=worst.get)
        print(f"{name:58} {joints:6} {followers or '':8}{'*' if native else ' '} {worst[quantity]:9.1e}  {quantity}")
        decisions += [(name, decision) for decision in decided]
        failed += [name] if worst[quantity] > LIMIT else []
        for key, error in worst.items():
            total[key] = max(total.get(key, 0.0), error)
    print("\nworst relative error per quantity:")
    for key, error in total.items():
        print(f"  {key:10} {error:9.1e}  {'ok' if error <= GOAL else 'ok, above the goal' if error <= LIMIT else 'TOO LARGE'}")
    if decisions:
        print_decisions(decisions, [name for name, _, _ in cases])
    print()
    for name, error, pinocchio in unread:
        print(f"not compared: {name}\n  Soleus: {error}\n  Pinocchio: {pinocchio}")
    print("* Pinocchio couples followers itself; without, its tree is coupled here")
    print(f"{len(cases) - len(unread)} robots compared, {len(failed)} above {LIMIT:g}")
    return 1 if failed or (unread and not arguments.all) else 0


if __name__ == "__main__":
    sys.exit(main())
