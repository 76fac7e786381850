"""Forward dynamics of a URDF with 60 digits: who is right where two programs differ.

Shares nothing with either of them: no library reads the file, no link is merged, no recursion goes back to the base. By the principle
of virtual power every link adds `m Jv' (Jv vd + a - g) + Jw' (I (Jw vd + e) + w x I w)` to the generalised force, where `a` and `e`
are the accelerations of its centre of mass and of its rotation when vd = 0. That gives M and h; `M vd = tau - h` is solved by LU.

A joint with `<mimic>` moves at its multiplier times the rate of the joint that it follows: it is one more part of that one's column.

The numbers of the file and of the state are taken as doubles, which is how both programs receive them; everything after that
(rotations from roll, pitch and yaw, unit axes, sines) is exact to 60 digits.
"""

import xml.etree.ElementTree as ElementTree

from mpmath import mp, mpf

# With a condition number of 1e20 there would still be 40 digits left.
mp.dps = 60
GRAVITY = [mpf(0), mpf(0), mpf(9.81)]  # a base that accelerates upwards; 9.81 as a double


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def add(*vectors):
    return [sum(entries) for entries in zip(*vectors)]


def scale(vector, factor):
    return [entry * factor for entry in vector]


def times(matrix, vector):
    return [dot(row, vector) for row in matrix]


def product(a, b):
    columns = list(zip(*b))
    return [[dot(row, column) for column in columns] for row in a]


def transpose(matrix):
    return [list(column) for column in zip(*matrix)]


def about(axis, angle):
    """Rotation by Rodrigues' formula."""
    x, y, z = axis
    s, c = mp.sin(angle), mp.cos(angle)
    k = 1 - c
    return [
        [c + k * x * x, k * x * y - s * z, k * x * z + s * y],
        [k * x * y + s * z, c + k * y * y, k * y * z - s * x],
        [k * x * z - s * y, k * y * z + s * x, c + k * z * z],
    ]


def unit(vector):
    return scale(vector, 1 / mp.sqrt(dot(vector, vector)))


def numbers(element, attribute, default):
    text = default if element is None else element.get(attribute, default)
    return [mpf(float(number)) for number in text.split()]


def pose(element):
    """Rotation and position of an `<origin>`."""
    origin = element.find("origin")
    roll, pitch, yaw = numbers(origin, "rpy", "0 0 0")
    rotation = product(about([0, 0, 1], yaw), product(about([0, 1, 0], pitch), about([1, 0, 0], roll)))
    return rotation, numbers(origin, "xyz", "0 0 0")


def laws(urdf):
    """Of every joint that is not fixed: leader, multiplier and offset. It leads itself if it follows nobody; no leader: it cannot move."""
    joints = {joint.get("name"): joint for joint in ElementTree.parse(urdf).getroot().findall("joint")}

    def law(name):
        joint, mimic = joints[name], joints[name].find("mimic")
        if joint.get("type") == "fixed":
            return None, mpf(0), mpf(0)
        if mimic is None:
            return name, mpf(1), mpf(0)
        (multiplier,), (offset,) = numbers(mimic, "multiplier", "1"), numbers(mimic, "offset", "0")
        leader, factor, shift = law(mimic.get("joint"))
        return (leader if multiplier else None), multiplier * factor, multiplier * shift + offset

    return {name: law(name) for name, joint in joints.items() if joint.get("type") != "fixed"}


class Robot:
    """The tree of a URDF; `joints` names those with a coordinate in the order of v."""

    def __init__(self, urdf, joints, fixed_base):
        root = ElementTree.parse(urdf).getroot()
        self.fixed_base = fixed_base
        self.column = {name: k + (0 if fixed_base else 6) for k, name in enumerate(joints)}
        self.nv = len(joints) + (0 if fixed_base else 6)
        self.laws = laws(urdf)
        self.below = {link.get("name"): [] for link in root.findall("link")}
        moved = set()
        for joint in root.findall("joint"):
            parent, child = joint.find("parent").get("link"), joint.find("child").get("link")
            axis = numbers(joint.find("axis"), "xyz", "1 0 0")
            kind = joint.get("type")
            axis = None if kind == "fixed" else unit(axis)
            self.below[parent].append((joint.get("name"), kind, pose(joint), axis, child))
            moved.add(child)
        (self.root,) = set(self.below) - moved
        self.inertial = {}
        for link in root.findall("link"):
            inertial = link.find("inertial")
            if inertial is not None:
                (mass,) = numbers(inertial.find("mass"), "value", "0")
                xx, xy, xz, yy, yz, zz = (
                    numbers(inertial.find("inertia"), name, "0")[0] for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
                )
                rotation, com = pose(inertial)
                about_com = product(rotation, product([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], transpose(rotation)))
                self.inertial[link.get("name")] = mass, com, about_com

    def equations(self, state):
        """M and h."""
        M, h = mp.zeros(self.nv), mp.zeros(self.nv, 1)
        v = [mpf(x) for x in state["v"]]
        zero, one = [mpf(0)] * 3, [[mpf(i == j) for j in range(3)] for i in range(3)]
        rotation, position, w, a, columns = one, zero, zero, GRAVITY, []
        if not self.fixed_base:
            position = [mpf(x) for x in state["base_position"]]
            x, y, z, c = (mpf(x) for x in state["base_quaternion_xyzw"])
            half = mp.atan2(mp.sqrt(x * x + y * y + z * z), c)
            rotation = about(unit([x, y, z]), 2 * half) if half else one
            w = times(rotation, v[3:6])
            a = add(GRAVITY, times(rotation, cross(v[3:6], v[:3])))
            axes = transpose(rotation)
            columns = [(k, "prismatic", axes[k], position) for k in range(3)]
            columns += [(3 + k, "revolute", axes[k], position) for k in range(3)]
        # Rotation, position, angular velocity, acceleration of the origin and of the rotation when vd = 0, and the columns above.
        pending = [(self.root, rotation, position, w, a, zero, columns)]
        while pending:
            link, rotation, position, w, a, e, columns = pending.pop()
            self.add_link(M, h, link, rotation, position, w, a, e, columns)
            for name, kind, (R, p), axis, child in self.below[link]:
                R, r = product(rotation, R), times(rotation, p)
                w_child, e_child, above, coriolis = w, e, columns, zero
                if kind != "fixed":
                    leader, multiplier, angle = self.laws[name]
                    rate = mpf(0)
                    if leader:
                        rate = multiplier * v[self.column[leader]]
                        angle += multiplier * mpf(state["joint_angles"][leader])
                    z = times(R, axis)
                    if kind == "prismatic":
                        r = add(r, scale(z, angle))
                        coriolis = scale(cross(w, z), 2 * rate)
                    else:
                        R = product(R, about(axis, angle))
                        w_child, e_child = add(w, scale(z, rate)), add(e, scale(cross(w, z), rate))
                    motion = "prismatic" if kind == "prismatic" else "revolute"
                    above = columns
                    if leader:
                        above = [*columns, (self.column[leader], motion, scale(z, multiplier), add(position, r))]
                a_child = add(a, cross(e, r), cross(w, cross(w, r)), coriolis)
                pending.append((child, R, add(position, r), w_child, a_child, e_child, above))
        return M, h

    def add_link(self, M, h, link, rotation, position, w, a, e, columns):
        if link not in self.inertial:
            return
        mass, com, about_com = self.inertial[link]
        r = times(rotation, com)
        inertia = product(rotation, product(about_com, transpose(rotation)))
        force = scale(add(a, cross(e, r), cross(w, cross(w, r))), mass)
        moment = add(times(inertia, e), cross(w, times(inertia, w)))
        zero, com_in_world = [mpf(0)] * 3, add(position, r)
        jacobian = []
        for column, motion, axis, origin in columns:
            lever = add(com_in_world, scale(origin, -1))
            jacobian.append((column, axis, zero) if motion == "prismatic" else (column, cross(axis, lever), axis))
        for i, linear, angular in jacobian:
            h[i] += dot(linear, force) + dot(angular, moment)
            momentum = scale(linear, mass), times(inertia, angular)
            for j, other_linear, other_angular in jacobian:
                M[i, j] += dot(other_linear, momentum[0]) + dot(other_angular, momentum[1])

    def forward_dynamics(self, state):
        """vd with 60 digits, and what the same solution gives when only M's entries are rounded to doubles."""
        M, h = self.equations(state)
        forces = mp.matrix([mpf(x) for x in state["tau"]]) - h
        rounded = M.apply(lambda entry: mpf(float(entry)))
        return list(mp.lu_solve(M, forces)), list(mp.lu_solve(rounded, forces))


def error(found, truth):
    """Largest absolute difference over the largest entry of the truth."""
    largest = max((abs(x) for x in truth), default=mpf(1))
    return float(max((abs(mpf(x) - y) for x, y in zip(found, truth)), default=mpf(0)) / largest)
