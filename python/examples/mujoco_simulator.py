#!/usr/bin/env python3
"""MuJoCo in place of the simulator: HRP-4 on hard ground, for a second opinion from another physics engine.

    pip install './python[mujoco]'
    soleus-launch serve --domain lab &
    for p in planner estimator controller recorder; do soleus-$p --config config/$p.toml --domain lab & done
    python3 python/examples/mujoco_simulator.py lab --robot robots/hrp4

MuJoCo's contact has no stiffness in N/m that a foam's could be (its `solref` is scaled by the effective mass), so the
soles are hard here: give the planner and the estimator `--set sole.level=rigid`, or see what a soft estimate does on
hard ground. No stabiliser is built in; the servos are those of robot.toml. `tools/oracles/mujoco.py` starts all of it
and puts the figures of both engines side by side.
"""

import argparse
import pathlib
import sys
import time
import tomllib

import mujoco
import numpy as np

import soleus
from soleus.layouts import (
    CONTROL_PERIOD_S,
    Fall,
    Health,
    Mode,
    Process,
    Reason,
    RobotState,
    State,
    Truth,
)

# Time step of MuJoCo (s): ten in a control period.
STEP_S = 0.0005
# How long others may take to be ready, and to answer (s): planning takes some seconds on a loaded machine.
READY_S, ANSWER_S = 120.0, 30.0
# How far the recorder may be behind (ticks) before it is waited for: half of what a subscriber keeps.
RECORDER_LAG_TICKS = 64
# The trunk lower than this part of where it began, or tilted more than this (rad), is a fall.
FALL_HEIGHT, FALL_TILT_RAD = 0.6, 0.7
# How long the robot stands after the walk (s).
AFTER_WALK_S = 1.0


class Plant:
    """The robot in MuJoCo."""

    def __init__(self, folder):
        description = tomllib.loads((folder / "robot.toml").read_text())
        sole = tomllib.loads((folder / "sole.toml").read_text())
        self.joints = description["joints"]
        self.base = description["base_link"]
        feet = description["feet"]
        groups = description.get("groups", {})
        servos = {
            joint: servo
            for servo in description["servos"]
            for name in servo["of"]
            for joint in groups.get(name, [name])
        }
        urdf = (folder / description["urdf"]).read_text()
        # Nothing is fused or thrown away: masses of links on fixed joints and frames of sensors count.
        at = urdf.index(">", urdf.index("<robot")) + 1
        options = '<mujoco><compiler fusestatic="false" discardvisual="true"/></mujoco>'
        spec = mujoco.MjSpec.from_string(urdf[:at] + options + urdf[at:])
        spec.body(self.base).add_freejoint()
        spec.option.timestep = STEP_S
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        # Only soles touch the ground.
        for geom in spec.geoms:
            geom.contype = geom.conaffinity = 0
        friction = [sole["friction"], 0.005, 0.0001]
        touches = {"contype": 1, "conaffinity": 1, "friction": friction}
        plane = mujoco.mjtGeom.mjGEOM_PLANE
        spec.worldbody.add_geom(name="ground", type=plane, size=[5, 5, 0.1], **touches)
        self.size = np.array(sole["mesh"]["box_m"])
        ankle = np.array(sole["foot"]["ankle_in_sole_m"])
        self.feet = []
        for side, sign in (("left", 1.0), ("right", -1.0)):
            link = feet[side]["link"]
            middle = [-ankle[0], -sign * ankle[1], -ankle[2] + 0.5 * self.size[2]]
            box = mujoco.mjtGeom.mjGEOM_BOX
            spec.body(link).add_geom(name=f"{side}_sole", type=box, size=0.5 * self.size, pos=middle, mass=0, **touches)
            self.feet.append((link, f"{side}_sole", feet[side]["force_sensor_frame"]))
        imu = spec.body(description["imu_frame"]).add_site(name="imu_site")
        sensors = mujoco.mjtSensor
        for name, kind in (
            ("attitude", sensors.mjSENS_FRAMEQUAT),
            ("gyro", sensors.mjSENS_GYRO),
            ("accelerometer", sensors.mjSENS_ACCELEROMETER),
        ):
            spec.add_sensor(name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=imu.name)
        for name in self.joints:
            servo, joint = servos[name], spec.joint(name)
            joint.armature = servo["rotor_inertia_kg_m2"]
            joint.damping = [servo["viscous_friction_nm_s_per_rad"], 0, 0]
            joint.frictionloss = servo["coulomb_friction_nm"]
            actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            actuator.set_to_position(kp=servo["kp_nm_per_rad"], kv=servo["kd_nm_s_per_rad"])
        self.kp = np.array([servos[name]["kp_nm_per_rad"] for name in self.joints])
        self.kd = np.array([servos[name]["kd_nm_s_per_rad"] for name in self.joints])
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        model = self.model
        self.q_at = np.array([model.jnt_qposadr[model.joint(name).id] for name in self.joints])
        self.v_at = np.array([model.jnt_dofadr[model.joint(name).id] for name in self.joints])
        self.u_at = np.array([model.actuator(name).id for name in self.joints])
        self.base_id = model.body(self.base).id
        self.mass = float(model.body_subtreemass[self.base_id])
        self.last_zmp = np.zeros(2)
        self.reference = np.zeros(len(self.joints))

    def references(self, command):
        """Angles at which the servos make the torques that the command asks for."""
        count = len(self.joints)
        q, v, torque = (
            np.array(values[:count])
            for values in (
                command.joint_position_reference_rad,
                command.joint_velocity_reference_rad_per_s,
                command.feed_forward_torque_nm,
            )
        )
        return q + (torque + self.kd * v) / self.kp

    def place(self, command):
        """Puts the robot where a command has it."""
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, np.array(command.plan.base_rotation))
        data = self.data
        data.qpos[:3], data.qpos[3:7] = command.plan.base_position_m, quaternion
        data.qpos[self.q_at] = command.joint_position_reference_rad[: len(self.joints)]
        mujoco.mj_forward(self.model, data)
        self.height = float(data.qpos[2])
        self.reference = self.references(command)

    def advance(self, command):
        """A control period; the drives come to the command's references by a ramp."""
        before, self.reference = self.reference, self.references(command)
        steps = round(CONTROL_PERIOD_S / STEP_S)
        for step in range(1, steps + 1):
            self.data.ctrl[self.u_at] = before + (self.reference - before) * step / steps
            mujoco.mj_step(self.model, self.data)
        mujoco.mj_forward(self.model, self.data)

    def wrenches(self, points):
        """Force and moment of the ground on each foot about a point, world axes."""
        model, data, out, wrench = self.model, self.data, np.zeros((2, 6)), np.zeros(6)
        ids = [model.geom(sole).id for _, sole, _ in self.feet]
        for index in range(data.ncon):
            contact = data.contact[index]
            for foot, sole in enumerate(ids):
                if sole not in (contact.geom1, contact.geom2):
                    continue
                mujoco.mj_contactForce(model, data, index, wrench)
                # Rows of the frame are the axes; the force acts on the second body.
                axes = contact.frame.reshape(3, 3)
                force, moment = axes.T @ wrench[:3], axes.T @ wrench[3:]
                if contact.geom1 == sole:
                    force, moment = -force, -moment
                out[foot, :3] += force
                out[foot, 3:] += moment + np.cross(contact.pos - points[foot], force)
        return out

    def measure(self, state):
        """Fills in what the robot measures."""
        model, data, count = self.model, self.data, len(self.joints)
        state.joint_count = count
        state.joint_position_rad[:count] = data.qpos[self.q_at]
        state.joint_velocity_rad_per_s[:count] = data.qvel[self.v_at]
        w, x, y, z = data.sensor("attitude").data
        state.imu_orientation_xyzw[:] = (x, y, z, w)
        state.gyro_rad_per_s[:] = data.sensor("gyro").data
        state.accelerometer_m_per_s2[:] = data.sensor("accelerometer").data
        frames = [model.body(frame).id for _, _, frame in self.feet]
        for foot, wrench in enumerate(self.wrenches([data.xpos[frame] for frame in frames])):
            axes = data.xmat[frames[foot]].reshape(3, 3).T
            state.foot_wrench_n_nm[foot][:] = np.concatenate([axes @ wrench[:3], axes @ wrench[3:]])

    def tell(self, truth):
        """Fills in what really is."""
        model, data, count = self.model, self.data, len(self.joints)
        mujoco.mj_subtreeVel(model, data)
        rotation = data.xmat[self.base_id].reshape(3, 3)
        truth.joint_count = count
        truth.base_position_m[:] = data.xpos[self.base_id]
        truth.base_rotation[:] = rotation.ravel()
        truth.base_twist_m_rad_per_s[:] = np.concatenate([data.qvel[:3], rotation @ data.qvel[3:6]])
        truth.joint_position_rad[:count] = data.qpos[self.q_at]
        truth.joint_velocity_rad_per_s[:count] = data.qvel[self.v_at]
        truth.joint_torque_nm[:count] = data.qfrc_actuator[self.v_at]
        truth.com_position_m[:] = data.subtree_com[self.base_id]
        truth.com_velocity_m_per_s[:] = data.subtree_linvel[self.base_id]
        truth.linear_momentum_kg_m_per_s[:] = self.mass * data.subtree_linvel[self.base_id]
        truth.angular_momentum_kg_m2_per_s[:] = data.subtree_angmom[self.base_id]
        soles = []
        for foot, (link, sole, _) in enumerate(self.feet):
            axes = data.geom(sole).xmat.reshape(3, 3)
            bottom = data.geom(sole).xpos - 0.5 * self.size[2] * axes[:, 2]
            truth.sole_position_m[foot][:], truth.sole_rotation[foot][:] = bottom, axes.ravel()
            truth.ankle_position_m[foot][:] = data.body(link).xpos
            soles.append(bottom)
        for foot, wrench in enumerate(self.wrenches(soles)):
            truth.foot_wrench_n_nm[foot][:] = wrench
        force, moment = (total := self.wrenches(np.zeros((2, 3))).sum(axis=0))[:3], total[3:]
        truth.com_acceleration_m_per_s2[:] = force / self.mass + model.opt.gravity
        # Nearly nothing carries: the last point stands in.
        if force[2] > 1.0:
            self.last_zmp = np.array([-moment[1], moment[0]]) / force[2]
        truth.zmp_m[:] = self.last_zmp

    def fall(self):
        """Why it counts as fallen."""
        if not np.isfinite(self.data.qpos).all():
            return Fall.DIVERGED
        if self.data.qpos[2] < FALL_HEIGHT * self.height:
            return Fall.BASE_LOW
        tilt = np.arccos(np.clip(self.data.xmat[self.base_id].reshape(3, 3)[2, 2], -1.0, 1.0))
        return Fall.TILTED if tilt > FALL_TILT_RAD else Fall.NONE


class Others:
    """The processes that are waited for."""

    def __init__(self, domain, names):
        self.health = {name: domain.subscribe(f"health/{name}", depth=4) for name in names}
        self.fingerprint = 0
        self.stored_tick = -1

    def wait_until_ready(self):
        end = time.monotonic() + READY_S
        for name, health in self.health.items():
            state = None
            while state not in (State.READY, State.RUNNING, State.HOLDING):
                if (said := health.latest()) is not None:
                    state = said.state
                    self.fingerprint = said.header.robot_fingerprint or self.fingerprint
                if state == State.STOPPING or time.monotonic() > end:
                    sys.exit(f"the {name} is not ready")
                time.sleep(0.002)

    def wait_for_recorder(self, tick):
        health = self.health.get("recorder")
        end = time.monotonic() + ANSWER_S
        while health is not None:
            if (said := health.latest()) is not None:
                self.stored_tick = max(self.stored_tick, said.recorder.stored_tick)
            if tick - self.stored_tick <= RECORDER_LAG_TICKS:
                return
            if time.monotonic() > end:
                sys.exit("the recorder does not come along")
            time.sleep(0.0005)


def wait_for_command(commands, tick):
    """The command of a tick."""
    end = time.monotonic() + ANSWER_S
    while time.monotonic() < end:
        command = commands.wait(1.0)
        if command is not None and command.header.tick >= tick:
            return command
    sys.exit(f"no command for tick {tick}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("domain")
    parser.add_argument("--robot", type=pathlib.Path, default=pathlib.Path("robots/hrp4"))
    parser.add_argument("--without-recorder", action="store_true", help="do not wait for a recorder")
    arguments = parser.parse_args()
    plant = Plant(arguments.robot)
    print(f"{plant.mass:.3f} kg, {plant.model.nv} degrees of freedom, {plant.model.nu} drives")
    with soleus.Domain(arguments.domain, process="simulator", patience_s=READY_S) as domain:
        code = walk(domain, plant, not arguments.without_recorder)
    sys.exit(code)


def walk(domain, plant, with_recorder):
    """The whole walk; returns the exit code."""
    commands = domain.subscribe("robot/command", depth=8)
    starts = domain.subscribe("walk/start", depth=1)
    states, truths = domain.publish("robot/state"), domain.publish("truth/robot")
    health = domain.publish("health/simulator")
    others = Others(domain, ["planner", "estimator", "controller", *(["recorder"] if with_recorder else [])])
    others.wait_until_ready()
    said = Health(process=Process.SIMULATOR, state=State.RUNNING)
    said.header.robot_fingerprint = others.fingerprint

    def header(message, tick):
        message.header.tick, message.header.robot_fingerprint = tick, others.fingerprint
        return message

    unplaced = header(RobotState(joint_count=len(plant.joints)), -1)
    unplaced.imu_orientation_xyzw[3] = 1.0
    unplaced.accelerometer_m_per_s2[2] = -plant.model.opt.gravity[2]
    states.send(unplaced)
    command = wait_for_command(commands, -1)
    plant.place(command)
    tick, start, finished, acting, middle = 0, None, None, -1, None
    while True:
        fall = plant.fall()
        walk_time_s = -CONTROL_PERIOD_S if start is None else (tick - start) * CONTROL_PERIOD_S
        state, truth = header(RobotState(), tick), header(Truth(), tick)
        plant.measure(state)
        plant.tell(truth)
        truth.time_s, truth.walk_time_s, truth.command_tick = tick * CONTROL_PERIOD_S, walk_time_s, acting
        truth.fallen, truth.fall_cause, truth.fall_tick = int(fall != Fall.NONE), fall, tick
        states.send(state)
        truths.send(truth)
        now = 0.5 * sum(np.array(truth.sole_position_m[foot][:2]) for foot in (0, 1))
        middle = now if middle is None else middle
        said.simulator.distance_m = float(np.hypot(*(now - middle)))
        said.simulator.fallen, said.simulator.fall_cause = truth.fallen, fall
        said.walk_time_s, said.header.tick, said.cycles = walk_time_s, tick, tick
        over = finished is not None and (tick - finished) * CONTROL_PERIOD_S >= AFTER_WALK_S
        if fall != Fall.NONE or over:
            said.state, said.reason = State.STOPPING, Reason.FINISHED if over else Reason.FALLEN
            health.send(said)
            print(f"{'walked' if over else 'FELL'}: tick {tick}, {said.simulator.distance_m:.3f} m")
            # The last state is answered too, so that every recording of a walk ends with the same message.
            if over:
                wait_for_command(commands, tick)
                others.wait_for_recorder(tick + RECORDER_LAG_TICKS)
            return 0 if over else 1
        health.send(said)
        # The plant moves under the command before, while the others compute the answer to this state.
        plant.advance(command)
        acting = command.header.tick
        command = wait_for_command(commands, tick)
        if (message := starts.latest()) is not None:
            start = message.tick_zero
        if command.mode == Mode.FINISHED and finished is None:
            finished = tick
        others.wait_for_recorder(tick)
        tick += 1


if __name__ == "__main__":
    main()
