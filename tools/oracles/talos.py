"""Walks TALOS, a robot that nobody here made: 90 kg, other legs, other drives, its URDF read from example-robot-data.

    python3 tools/oracles/talos.py [FOLDER]    # exit code 1 if a walk does not come to its end within the limits below

Writes a robot's folder (to FOLDER, else into tools/oracles/.venv/talos), then walks it with the example `walks` of crate closed_loop.
"""

import pathlib
import shutil
import subprocess
import sys

import environment

# Largest errors of centre of mass and zero-moment point (mm) at which TALOS counts as walking as planned: twice of what HRP-4 does.
COM_MAX_MM, ZMP_MAX_MM = 3.0, 20.0

LEG = range(1, 7)
SIDES = ("left", "right")
LEGS = [f"leg_{side}_{i}_joint" for side in SIDES for i in LEG]
ARMS = [f"arm_{side}_{i}_joint" for side in SIDES for i in range(1, 8)]
REST = ["torso_1_joint", "torso_2_joint", "head_1_joint", "head_2_joint", "gripper_left_joint", "gripper_right_joint"]

# The half-sitting posture of its SRDF (degrees).
POSTURE = {
    **{f"leg_{side}_3_joint": -23.57 for side in SIDES},
    **{f"leg_{side}_4_joint": 49.24 for side in SIDES},
    **{f"leg_{side}_5_joint": -25.67 for side in SIDES},
    "arm_left_1_joint": 14.81, "arm_right_1_joint": -14.81, "arm_left_2_joint": 9.91, "arm_right_2_joint": -9.91,
    "arm_left_4_joint": -30.1, "arm_right_4_joint": -30.1,
}

# Drives are assumed: as stiff against the robot's weight as HRP-4's.
ROBOT = """name = "TALOS"
urdf = "talos_reduced.urdf"
base_link = "base_link"
torso_link = "torso_2_link"
imu_frame = "imu_link"
joints = {joints}
walking_locked = ["still"]
collision_pairs = [["left_shank", "right_shank"], ["left_foot", "right_foot"]]

[groups]
left_leg = {left_leg}
right_leg = {right_leg}
arms = {arms}
trunk = ["torso_1_joint", "torso_2_joint"]
still = {still}

[half_sitting_deg]
{posture}

[feet.left]
link = "leg_left_6_link"
ankle_frame = "leg_left_6_link"
force_sensor_frame = "leg_left_6_link"

[feet.right]
link = "leg_right_6_link"
ankle_frame = "leg_right_6_link"
force_sensor_frame = "leg_right_6_link"

[[servos]]
of = ["left_leg", "right_leg", "trunk"]
kp_nm_per_rad = 35000.0
kd_nm_s_per_rad = 500.0
rotor_inertia_kg_m2 = 0.3
coulomb_friction_nm = 4.0
viscous_friction_nm_s_per_rad = 2.0

[[servos]]
of = ["arms", "still"]
kp_nm_per_rad = 5000.0
kd_nm_s_per_rad = 80.0
rotor_inertia_kg_m2 = 0.05
coulomb_friction_nm = 1.0
viscous_friction_nm_s_per_rad = 0.5

[[energy]]
of = ["left_leg", "right_leg", "trunk", "arms", "still"]
torque_squared_w_per_nm2 = 0.005
power = 1.0
speed_squared_w_s2_per_rad2 = 1.0

[limits]
position_margin_deg = 0.5
velocity_factor = 0.5
torque_factor = 1.0
"""

CAPSULE = """
[[capsules]]
name = "{side}_{part}"
link = "leg_{side}_{joint}_link"
from_m = {start}
to_m = {end}
radius_m = {radius}
"""

# HRP-4's foam made stiffer by the ratio of the robots' weights; the ankle is 107 mm above the foot's plate, which the foam raises by 21 mm.
SOLE = """friction = 0.65
contact = "bottom"

[mesh]
box_m = [0.21, 0.13, 0.021]
cells = [12, 7, 3]

[material]
young_modulus_pa = 0.74e6
poisson_ratio = 0.31

[foot]
ankle_in_sole_m = [0.0, 0.0, 0.128]

[solver]
level = "fem"
"""

GAIT = "planner.gait.body.com_height_m=0.87 planner.gait.start.ankle_distance_m=0.17"
WALKS = {
    "0.5 m": f"no-stabiliser.toml {GAIT}",
    "0.5 m, the cart-table's ZMP": f"no-stabiliser.toml {GAIT} planner.rehearsal.body_zmp=false",
    "around a circle": f"no-stabiliser.toml {GAIT} planner.gait.walk={{kind='circle',swings=12,step_length_m=0.05,radius_m=0.8}}",
}


def names(joints):
    return "[" + ", ".join(f'"{joint}"' for joint in joints) + "]"


def robot_folder(folder):
    """Writes the folder of the robot."""
    folder.mkdir(parents=True, exist_ok=True)
    (urdf,) = environment.robots(sys.executable).rglob("talos_reduced.urdf")
    shutil.copy(urdf, folder / urdf.name)
    # Hands and the forearms' rolls stay where they are.
    still = [joint for joint in ARMS if joint.split("_")[2] in "567"] + REST[2:]
    text = ROBOT.format(
        joints=names(LEGS + REST[:2] + ARMS + REST[2:]),
        left_leg=names(LEGS[:6]),
        right_leg=names(LEGS[6:]),
        arms=names([joint for joint in ARMS if joint not in still]),
        still=names(still),
        posture="\n".join(f"{joint} = {degrees}" for joint, degrees in POSTURE.items()),
    )
    for side in SIDES:
        text += CAPSULE.format(side=side, part="shank", joint=4, start=[0.0, 0.0, -0.05], end=[0.0, 0.0, -0.28], radius=0.06)
        text += CAPSULE.format(side=side, part="foot", joint=6, start=[-0.03, 0.0, -0.06], end=[0.03, 0.0, -0.06], radius=0.065)
    (folder / "robot.toml").write_text(text)
    (folder / "sole.toml").write_text(SOLE)


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else environment.VENV / "talos").resolve()
    robot_folder(folder)
    walks = folder / "walks.txt"
    lines = (f"{name}: config/scenarios/{rest} robot={folder}" for name, rest in WALKS.items())
    walks.write_text("\n".join(lines) + "\n")
    command = ["cargo", "run", "--quiet", "-p", "closed_loop", "--example", "walks", "--", walks]
    table = subprocess.run(command, cwd=environment.ROOT, check=True, capture_output=True, text=True).stdout
    print(table, end="")
    bad = []
    for name in (name for name in WALKS if "cart-table" not in name):
        cells = next(line for line in table.splitlines() if line.startswith(f"| {name} |")).split("|")
        if cells[2].strip() != "Finished":
            bad.append(f"{name}: {cells[2].strip()}")
            continue
        com_mm, zmp_mm = (float(cells[column].split(",")[1]) for column in (4, 5))
        if com_mm > COM_MAX_MM or zmp_mm > ZMP_MAX_MM:
            bad.append(f"{name}: COM {com_mm} mm, ZMP {zmp_mm} mm")
    print("\n".join(bad), file=sys.stderr)
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
