"""Layouts, codes and topics of all messages.

Made by `soleus-inspect layout --python > python/soleus/layouts.py`; a test keeps it true.

SI units and radians; the last part of a field's name is its unit. World frame with z up; feet left, right; rotations
row-major; six-vectors linear part first.
"""

from ctypes import Structure, c_double, c_int64, c_uint32, c_uint64, sizeof
from enum import IntEnum
from typing import NamedTuple

# Control period: one tick (s).
CONTROL_PERIOD_S = 0.005
# Most joints of a robot, contact nodes of a foot, phases of a walking pattern.
MAX_JOINTS = 40
MAX_CONTACT_NODES = 256
MAX_PHASES = 4096


class Process(IntEnum):
    """The processes."""

    # Plans the walk.
    PLANNER = 1
    # Estimates the deformation of the soles.
    ESTIMATOR = 2
    # Tracks pattern and ankle poses with the whole body.
    CONTROLLER = 3
    # The simulated robot.
    SIMULATOR = 4
    # Writes every topic to a file.
    RECORDER = 5
    # Starts and supervises the others.
    LAUNCHER = 6


class State(IntEnum):
    """What a process is doing."""

    # Reading its configuration, building its models.
    STARTING = 1
    # Waiting for the others.
    READY = 2
    # At work.
    RUNNING = 3
    # Alive, but in its safe behaviour (holding posture, last good value).
    HOLDING = 4
    # About to end, or done.
    STOPPING = 5


class Reason(IntEnum):
    """Why a process is in its state."""

    # Nothing special.
    NONE = 0
    # The walk is over.
    FINISHED = 1
    # The robot has fallen.
    FALLEN = 2
    # An input stayed away.
    INPUT_MISSING = 3
    # A solver failed too often.
    SOLVER_FAILED = 4
    # The plan cannot be met.
    INFEASIBLE = 5
    # Asked to stop (signal).
    ASKED = 6
    # A message of another robot arrived.
    OTHER_ROBOT = 7
    # Deadlines were missed too often.
    DEADLINE = 8
    # The disk is full or too slow.
    STORAGE = 9
    # The pattern is of another version, too long or damaged.
    PATTERN_REFUSED = 10
    # The robot did not come to stand still: the walk was not begun.
    NOT_SETTLED = 11


class Outcome(IntEnum):
    """Outcome of a computation."""

    # Nothing was computed.
    NONE = 0
    # Solved to tolerance.
    SOLVED = 1
    # The iteration limit was reached; the residual says how far it came.
    ITERATION_LIMIT = 2
    # The problem has no solution.
    INFEASIBLE = 3
    # Broken numbers.
    NUMERICAL_FAILURE = 4
    # The reference asks for what the contact cannot give (zero-moment point outside the sole, force outside the
    # cone).
    REFERENCE_OUTSIDE = 5
    # An older value is used in its place.
    HELD = 6
    # Solved to tolerance with limits widened that excluded each other.
    RELAXED = 7


class Limit(IntEnum):
    """Limits of the controller that may give way where they exclude each other, from the first to give way to the
    last."""

    # None gave way.
    NONE = 0
    # Load of a foot (N).
    LOAD = 1
    # Acceleration of two bodies towards each other (m/s^2).
    COLLISION = 2
    # Acceleration of a joint near the limits of its position and speed (rad/s^2).
    JOINT_MOTION = 3
    # Torque of a joint (N m).
    TORQUE = 4
    # Acceleration of a standing ankle away from the estimator's (m/s^2, rad/s^2).
    CONTACT = 5


class Mode(IntEnum):
    """What the controller does."""

    # Holding the posture before the walk.
    STANDING = 1
    # Walking.
    WALKING = 2
    # Holding the posture after the walk.
    FINISHED = 3
    # Holding the posture because something failed.
    HOLDING = 4


class Order(IntEnum):
    """The operator's word."""

    # None was given.
    NONE = 0
    # Walk off, as soon as the robot stands still.
    START = 1
    # Complete the step under way and stand.
    STOP = 2


class ContactState(IntEnum):
    """What a node of the sole does."""

    # No force.
    OPEN = 0
    # Force inside the friction cone, no motion along the ground.
    STICK = 1
    # Force on the cone, motion against it.
    SLIP = 2


class Fall(IntEnum):
    """Why the robot counts as fallen."""

    # It stands.
    NONE = 0
    # The base is too low.
    BASE_LOW = 1
    # The trunk is tilted too far.
    TILTED = 2
    # A part other than the soles touches the ground.
    BODY_CONTACT = 3
    # The simulation broke down.
    DIVERGED = 4


class PhaseKind(IntEnum):
    """Which part of the walk a phase belongs to."""

    # Double support before the first step.
    START = 0
    # One foot in the air.
    SINGLE_SUPPORT = 1
    # Load goes from one foot to the other.
    DOUBLE_SUPPORT = 2
    # Double support after the last step.
    STOP = 3


# What the elements of arrays are called in tables. Joints have the names of the robot's description.
JOINTS = "joints"
NODES = "nodes"


class Layout(Structure):
    """A message, or a part of one. LABELS: what the elements of its arrays are called, outermost first. CODES: which
    numbers are codes."""

    WIRE_NAME = ""
    LABELS = {}
    CODES = {}

    @classmethod
    def type_name(cls):
        """What iceoryx2 compares."""
        return cls.WIRE_NAME


class Header(Layout):
    """Sequence, control time and robot of a message."""

    WIRE_NAME = "soleus.HeaderV1"
    _fields_ = [
        # Number of the message on its topic, counted by its publisher from zero. Filled in by the bus.
        ("sequence", c_uint64),
        # Control tick the content belongs to.
        ("tick", c_int64),
        # Hash of the robot's description: a message of another robot must not be used.
        ("robot_fingerprint", c_uint64),
        # `CLOCK_MONOTONIC` time of the tick, in real time; zero in lock-step.
        ("clock_monotonic_ns", c_uint64),
    ]


assert sizeof(Header) == 32


class PatternHeader(Layout):
    """What the phases of a walking pattern have in common. Travels as the user header of the slice of
    `PatternPhase`s."""

    WIRE_NAME = "soleus.PatternHeaderV1"
    LABELS = {
        "ankle_in_sole_m": (("left", "right"), ("x", "y"),),
        "reserved": (("0", "1", "2", "3", "4", "5", "6", "7"),),
    }
    _fields_ = [
        # Header; the tick is that of publication and has no meaning for the walk.
        ("header", Header),
        # Hash of all other fields and phases: the pattern's identity in `WalkStart`, deformations and commands.
        ("pattern_hash", c_uint64),
        # Version of the meaning of the phases' fields.
        ("version", c_uint32),
        # Number of phases in the slice, at most `MAX_PHASES`.
        ("phase_count", c_uint32),
        # Mass the pattern was planned with.
        ("mass_kg", c_double),
        # Gravity.
        ("gravity_m_per_s2", c_double),
        # Constant height of the centre of mass above the ground.
        ("com_height_m", c_double),
        # Pendulum frequency sqrt(g / z).
        ("omega_rad_per_s", c_double),
        # Height of the ankle above the ground with an undeformed sole.
        ("ankle_height_m", c_double),
        # Duration of the whole pattern.
        ("duration_s", c_double),
        # Ankle in the sole frame, x and y (m), left and right foot.
        ("ankle_in_sole_m", c_double * 2 * 2),
        # Always zero.
        ("reserved", c_double * 8),
    ]


assert sizeof(PatternHeader) == 192


class PatternFoot(Layout):
    """What one foot does during a phase."""

    WIRE_NAME = "soleus.PatternFootV1"
    LABELS = {
        "ankle_foothold": (("x", "y", "z"),),
        "swing_from_foothold": (("x", "y", "z"),),
    }
    _fields_ = [
        # Under the ankle, where it stands or will land: x, y (m), yaw (rad).
        ("ankle_foothold", c_double * 3),
        # Walk time at which it came, or will come, into contact there.
        ("contact_since_s", c_double),
        # 1 while the foot is in the air, else 0 and the fields below are zero.
        ("in_the_air", c_uint32),
        # Always zero.
        ("reserved", c_uint32),
        # Under the ankle, where it left: x, y (m), yaw (rad).
        ("swing_from_foothold", c_double * 3),
        # Walk time of take-off.
        ("swing_start_s", c_double),
        # Walk time of landing.
        ("swing_end_s", c_double),
        # Height of the highest point above the higher of the two ends.
        ("swing_apex_m", c_double),
    ]


assert sizeof(PatternFoot) == 88


class PatternPhase(Layout):
    """One phase of a walking pattern; the letters are those of the crate `pattern`. Polynomials are ascending
    coefficients in powers of the phase's local time (s)."""

    WIRE_NAME = "soleus.PatternPhaseV2"
    LABELS = {
        "zmp": (("left", "right"), ("0", "1", "2", "3", "4", "5"),),
        "com_polynomial": (("left", "right"), ("0", "1", "2", "3", "4", "5"),),
        "com_decaying": (("x", "y"),),
        "com_growing": (("x", "y"),),
        "share": (("0", "1", "2", "3", "4", "5"),),
        "excess": (("left", "right"), ("0", "1", "2", "3", "4", "5"),),
        "zmp_1": (("left", "right"), ("0", "1", "2", "3", "4", "5"),),
        "zmp_shift_m": (("left", "right"), ("0", "1", "2", "3", "4", "5", "6", "7", "8"), ("x", "y", "z"),),
        "feet": (("left", "right"),),
    }
    CODES = {"kind": PhaseKind}
    _fields_ = [
        # Start in walk time.
        ("start_s", c_double),
        # Duration.
        ("duration_s", c_double),
        # `PhaseKind`.
        ("kind", c_uint32),
        # The swing it carries out, prepares or follows, counted from 1.
        ("step", c_uint32),
        # Foot 1: 0 left, 1 right.
        ("foot_1", c_uint32),
        # Power of the local time cancelled in `share` and `excess`: 0 or 3.
        ("cancelled_power", c_uint32),
        # ZMP, x and y.
        ("zmp", c_double * 6 * 2),
        # Polynomial part of the COM, x and y.
        ("com_polynomial", c_double * 6 * 2),
        # Decaying exponential part of the COM (m), x and y.
        ("com_decaying", c_double * 2),
        # Growing exponential part of the COM (m), x and y.
        ("com_growing", c_double * 2),
        # Load share of foot 2, divided by the cancelled power.
        ("share", c_double * 6),
        # ZMP of foot 1 minus ZMP, divided by the cancelled power, x and y.
        ("excess", c_double * 6 * 2),
        # ZMP of foot 1, x and y.
        ("zmp_1", c_double * 6 * 2),
        # The body's own ZMP from the planned one at equidistant knots: value (m), rate, acceleration; x and y.
        ("zmp_shift_m", c_double * 3 * 9 * 2),
        # Left and right foot.
        ("feet", PatternFoot * 2),
    ]


assert sizeof(PatternPhase) == 1104


class WalkStart(Layout):
    """Time zero of the walk, published once by the controller."""

    WIRE_NAME = "soleus.WalkStartV1"
    _fields_ = [
        # Header; the tick is that at which the decision fell.
        ("header", Header),
        # The pattern to be walked.
        ("pattern_hash", c_uint64),
        # Walk time = (tick - tick_zero) x control period; before it the pattern is held at its start.
        ("tick_zero", c_int64),
    ]


assert sizeof(WalkStart) == 48


class WalkOrder(Layout):
    """What an operator wants; the controller obeys."""

    WIRE_NAME = "soleus.WalkOrderV1"
    CODES = {"order": Order}
    _fields_ = [
        # Header; who gives an order knows no tick: -1.
        ("header", Header),
        # `Order`.
        ("order", c_uint32),
        # Always zero.
        ("reserved", c_uint32),
    ]


assert sizeof(WalkOrder) == 40


class RobotState(Layout):
    """Sensors of the robot, sampled at the tick."""

    WIRE_NAME = "soleus.RobotStateV2"
    LABELS = {
        "joint_position_rad": (JOINTS,),
        "joint_velocity_rad_per_s": (JOINTS,),
        "imu_orientation_xyzw": (("x", "y", "z", "w"),),
        "gyro_rad_per_s": (("x", "y", "z"),),
        "accelerometer_m_per_s2": (("x", "y", "z"),),
        "foot_wrench_n_nm": (
            ("left", "right"),
            ("force_x_n", "force_y_n", "force_z_n", "moment_x_nm", "moment_y_nm", "moment_z_nm"),
        ),
    }
    _fields_ = [
        # Header.
        ("header", Header),
        # Number of joints, in the order of the robot's description.
        ("joint_count", c_uint32),
        # Sensor faults, one bit each; zero: none.
        ("fault_bits", c_uint32),
        # Measured joint angles.
        ("joint_position_rad", c_double * 40),
        # Measured joint rates.
        ("joint_velocity_rad_per_s", c_double * 40),
        # Attitude of the IMU in the world, quaternion x, y, z, w.
        ("imu_orientation_xyzw", c_double * 4),
        # Angular velocity of the IMU, in its axes.
        ("gyro_rad_per_s", c_double * 3),
        # Specific force at the IMU (acceleration minus gravity), in its axes: +g upwards at rest.
        ("accelerometer_m_per_s2", c_double * 3),
        # Force (N) and moment (N m) of the sole on each foot, about the foot sensor's origin, in its axes.
        ("foot_wrench_n_nm", c_double * 6 * 2),
    ]


assert sizeof(RobotState) == 856


class FootDeformation(Layout):
    """Deformation of one foot's sole under its planned force, and where the ankle is because of it."""

    WIRE_NAME = "soleus.FootDeformationV2"
    LABELS = {
        "ankle_position_m": (("x", "y", "z"),),
        "ankle_rotation": (("xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"),),
        "ankle_twist_m_rad_per_s": (
            ("linear_x_m_per_s", "linear_y_m_per_s", "linear_z_m_per_s", "angular_x_rad_per_s",
            "angular_y_rad_per_s", "angular_z_rad_per_s"),
        ),
        "ankle_acceleration_m_rad_per_s2": (
            ("linear_x_m_per_s2", "linear_y_m_per_s2", "linear_z_m_per_s2", "angular_x_rad_per_s2",
            "angular_y_rad_per_s2", "angular_z_rad_per_s2"),
        ),
        "sole_position_m": (("x", "y", "z"),),
        "sole_rotation": (("xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"),),
        "planned_force_n": (("x", "y", "z"),),
        "planned_zmp_m": (("x", "y"),),
        "compliance_m_rad_per_n_nm": (
            ("0_0", "0_1", "0_2", "0_3", "0_4", "0_5", "1_0", "1_1", "1_2", "1_3", "1_4", "1_5", "2_0", "2_1",
            "2_2", "2_3", "2_4", "2_5", "3_0", "3_1", "3_2", "3_3", "3_4", "3_5", "4_0", "4_1", "4_2", "4_3", "4_4",
            "4_5", "5_0", "5_1", "5_2", "5_3", "5_4", "5_5"),
        ),
        "wrench_n_nm": (("force_x_n", "force_y_n", "force_z_n", "moment_x_nm", "moment_y_nm", "moment_z_nm"),),
        "sole_twist_m_rad_per_s": (
            ("linear_x_m_per_s", "linear_y_m_per_s", "linear_z_m_per_s", "angular_x_rad_per_s",
            "angular_y_rad_per_s", "angular_z_rad_per_s"),
        ),
    }
    CODES = {"status": Outcome}
    _fields_ = [
        # 1 if the foot carries load, else 0; without load the poses are those of the undeformed sole at its
        # foothold.
        ("loaded", c_uint32),
        # Outcome of the estimate: `Outcome`.
        ("status", c_uint32),
        # How many ticks ago this estimate was made: 0 if fresh, more when later ones failed.
        ("age_ticks", c_uint32),
        # Iterations of the solver at this tick.
        ("iterations", c_uint32),
        # Planned fraction of the weight on this foot.
        ("load_share", c_double),
        # Position of the ankle in the world.
        ("ankle_position_m", c_double * 3),
        # Rotation of the ankle frame in the world, row-major.
        ("ankle_rotation", c_double * 9),
        # Velocity (m/s) of the ankle and angular velocity (rad/s), world axes.
        ("ankle_twist_m_rad_per_s", c_double * 6),
        # Acceleration (m/s^2) of the ankle and angular acceleration (rad/s^2), world axes.
        ("ankle_acceleration_m_rad_per_s2", c_double * 6),
        # Position of the sole frame in the world.
        ("sole_position_m", c_double * 3),
        # Rotation of the sole frame in the world, row-major.
        ("sole_rotation", c_double * 9),
        # Planned force of the ground on the foot, world axes.
        ("planned_force_n", c_double * 3),
        # Planned zero-moment point of this foot in the world.
        ("planned_zmp_m", c_double * 2),
        # Compliance, row-major 6 x 6: change of the sole frame's pose (m, rad; world axes) per change of the wrench
        # of the ground on the sole (N, N m; world axes, about the sole origin). More force upwards lets the frame
        # sink: the diagonal is negative.
        ("compliance_m_rad_per_n_nm", c_double * 36),
        # Force (N) and moment (N m) of the ground on the sole about the sole origin, world axes.
        ("wrench_n_nm", c_double * 6),
        # Velocity (m/s) and angular velocity (rad/s) of the sole frame's origin, world axes.
        ("sole_twist_m_rad_per_s", c_double * 6),
        # Nodes that stick.
        ("nodes_sticking", c_uint32),
        # Nodes that slip.
        ("nodes_slipping", c_uint32),
        # Largest scaled residual of equilibrium and contact laws.
        ("residual", c_double),
    ]


assert sizeof(FootDeformation) == 752


class SoleDeformation(Layout):
    """Deformation of both soles at the tick."""

    WIRE_NAME = "soleus.SoleDeformationV2"
    LABELS = {
        "feet": (("left", "right"),),
    }
    _fields_ = [
        # Header; the tick is that of the robot state it answers.
        ("header", Header),
        # Walk time of the estimate; negative before time zero.
        ("walk_time_s", c_double),
        # The pattern it belongs to.
        ("pattern_hash", c_uint64),
        # Left and right foot.
        ("feet", FootDeformation * 2),
    ]


assert sizeof(SoleDeformation) == 1552


class ContactNodes(Layout):
    """Nodes of one sole that may touch the ground."""

    WIRE_NAME = "soleus.ContactNodesV1"
    LABELS = {
        "position_m": (NODES, ("x", "y", "z"),),
        "force_n": (NODES, ("x", "y", "z"),),
        "state": (NODES,),
    }
    CODES = {"state": ContactState}
    _fields_ = [
        # Number of nodes.
        ("count", c_uint32),
        # Always zero.
        ("reserved", c_uint32),
        # Positions in the world.
        ("position_m", c_double * 3 * 256),
        # Forces of the ground on the nodes, world axes.
        ("force_n", c_double * 3 * 256),
        # States: `ContactState`.
        ("state", c_uint32 * 256),
    ]


assert sizeof(ContactNodes) == 13320


class SoleContact(Layout):
    """Contact of both soles, node by node, for viewing."""

    WIRE_NAME = "soleus.SoleContactV1"
    LABELS = {
        "feet": (("left", "right"),),
    }
    _fields_ = [
        # Header.
        ("header", Header),
        # Left and right foot.
        ("feet", ContactNodes * 2),
    ]


assert sizeof(SoleContact) == 26672


class PlanFoot(Layout):
    """The plan of one foot, for the robot's stabiliser."""

    WIRE_NAME = "soleus.PlanFootV2"
    LABELS = {
        "wrench_n_nm": (("force_x_n", "force_y_n", "force_z_n", "moment_x_nm", "moment_y_nm", "moment_z_nm"),),
        "ankle_position_m": (("x", "y", "z"),),
        "ankle_rotation": (("xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"),),
    }
    _fields_ = [
        # 1 if the foot shall carry load, else 0.
        ("loaded", c_uint32),
        # Always zero.
        ("reserved", c_uint32),
        # Fraction of the weight it shall carry.
        ("load_share", c_double),
        # Force (N) and moment (N m) of the ground on the foot about the ankle, in world axes.
        ("wrench_n_nm", c_double * 6),
        # Position of the ankle in the world.
        ("ankle_position_m", c_double * 3),
        # Rotation of the ankle frame in the world, row-major.
        ("ankle_rotation", c_double * 9),
    ]


assert sizeof(PlanFoot) == 160


class Plan(Layout):
    """The whole-body plan the joint references belong to."""

    WIRE_NAME = "soleus.PlanV2"
    LABELS = {
        "base_position_m": (("x", "y", "z"),),
        "base_rotation": (("xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"),),
        "zmp_m": (("x", "y"),),
        "com_position_m": (("x", "y", "z"),),
        "com_velocity_m_per_s": (("x", "y", "z"),),
        "com_acceleration_m_per_s2": (("x", "y", "z"),),
        "feet": (("left", "right"),),
    }
    _fields_ = [
        # Position of the floating base in the world.
        ("base_position_m", c_double * 3),
        # Rotation of the floating base in the world, row-major.
        ("base_rotation", c_double * 9),
        # Zero-moment point on the ground, of the wrenches that the whole-body step computed; the pattern's without
        # a step.
        ("zmp_m", c_double * 2),
        # Centre of mass.
        ("com_position_m", c_double * 3),
        # Its velocity.
        ("com_velocity_m_per_s", c_double * 3),
        # Its acceleration.
        ("com_acceleration_m_per_s2", c_double * 3),
        # Left and right foot.
        ("feet", PlanFoot * 2),
    ]


assert sizeof(Plan) == 504


class RobotCommand(Layout):
    """References for the joints' servos and the plan behind them. Command of tick k holds references for tick k +
    1."""

    WIRE_NAME = "soleus.RobotCommandV2"
    LABELS = {
        "joint_position_reference_rad": (JOINTS,),
        "joint_velocity_reference_rad_per_s": (JOINTS,),
        "feed_forward_torque_nm": (JOINTS,),
    }
    CODES = {"mode": Mode, "status": Outcome}
    _fields_ = [
        # Header; the tick is that of the state it answers.
        ("header", Header),
        # The pattern it follows.
        ("pattern_hash", c_uint64),
        # Walk time of the references; negative before time zero.
        ("walk_time_s", c_double),
        # Number of joints, in the order of the robot's description.
        ("joint_count", c_uint32),
        # What the controller does: `Mode`.
        ("mode", c_uint32),
        # Outcome of its quadratic program: `Outcome`.
        ("status", c_uint32),
        # Iterations of the quadratic program.
        ("solver_iterations", c_uint32),
        # Joint angle references.
        ("joint_position_reference_rad", c_double * 40),
        # Joint rate references.
        ("joint_velocity_reference_rad_per_s", c_double * 40),
        # Feed-forward torques.
        ("feed_forward_torque_nm", c_double * 40),
        # The plan.
        ("plan", Plan),
        # Tick of the deformation used: who replays a controller gives it this one.
        ("deformation_tick", c_int64),
        # Its age, in ticks.
        ("deformation_age_ticks", c_uint32),
        # Number of active inequality constraints in the quadratic program.
        ("active_constraints", c_uint32),
        # KKT residual of the quadratic program.
        ("solver_residual", c_double),
        # Joints whose position or speed limit was active in the quadratic program: bit *i* is joint *i*.
        ("joints_limited_bits", c_uint64),
        # Joints whose torque limit was active in the quadratic program: bit *i* is joint *i*.
        ("torques_limited_bits", c_uint64),
    ]


assert sizeof(RobotCommand) == 1568


class Truth(Layout):
    """The simulated robot at the tick."""

    WIRE_NAME = "soleus.TruthV2"
    LABELS = {
        "base_position_m": (("x", "y", "z"),),
        "base_rotation": (("xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"),),
        "base_twist_m_rad_per_s": (
            ("linear_x_m_per_s", "linear_y_m_per_s", "linear_z_m_per_s", "angular_x_rad_per_s",
            "angular_y_rad_per_s", "angular_z_rad_per_s"),
        ),
        "joint_position_rad": (JOINTS,),
        "joint_velocity_rad_per_s": (JOINTS,),
        "joint_torque_nm": (JOINTS,),
        "com_position_m": (("x", "y", "z"),),
        "com_velocity_m_per_s": (("x", "y", "z"),),
        "com_acceleration_m_per_s2": (("x", "y", "z"),),
        "linear_momentum_kg_m_per_s": (("x", "y", "z"),),
        "angular_momentum_kg_m2_per_s": (("x", "y", "z"),),
        "zmp_m": (("x", "y"),),
        "foot_wrench_n_nm": (
            ("left", "right"),
            ("force_x_n", "force_y_n", "force_z_n", "moment_x_nm", "moment_y_nm", "moment_z_nm"),
        ),
        "sole_position_m": (("left", "right"), ("x", "y", "z"),),
        "sole_rotation": (("left", "right"), ("xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"),),
        "ankle_position_m": (("left", "right"), ("x", "y", "z"),),
        "push_force_n": (("x", "y", "z"),),
        "push_point_m": (("x", "y", "z"),),
    }
    CODES = {"fall_cause": Fall}
    _fields_ = [
        # Header.
        ("header", Header),
        # Simulated time since tick 0.
        ("time_s", c_double),
        # Walk time; negative before time zero.
        ("walk_time_s", c_double),
        # Number of joints, in the order of the robot's description.
        ("joint_count", c_uint32),
        # 1 once the robot has fallen.
        ("fallen", c_uint32),
        # Tick of the fall; meaningless while `fallen` is 0.
        ("fall_tick", c_int64),
        # Why it counts as fallen: `Fall`.
        ("fall_cause", c_uint32),
        # Newton steps of the plant's integration in the tick.
        ("contact_iterations", c_uint32),
        # Position of the floating base in the world.
        ("base_position_m", c_double * 3),
        # Rotation of the floating base in the world, row-major.
        ("base_rotation", c_double * 9),
        # Velocity (m/s) of the base's origin and angular velocity (rad/s), world axes.
        ("base_twist_m_rad_per_s", c_double * 6),
        # Real joint angles.
        ("joint_position_rad", c_double * 40),
        # Real joint rates.
        ("joint_velocity_rad_per_s", c_double * 40),
        # Torques at the joints.
        ("joint_torque_nm", c_double * 40),
        # Centre of mass.
        ("com_position_m", c_double * 3),
        # Its velocity.
        ("com_velocity_m_per_s", c_double * 3),
        # Its acceleration.
        ("com_acceleration_m_per_s2", c_double * 3),
        # Linear momentum.
        ("linear_momentum_kg_m_per_s", c_double * 3),
        # Angular momentum about the centre of mass.
        ("angular_momentum_kg_m2_per_s", c_double * 3),
        # Zero-moment point of both feet's wrenches on the ground; the last one while nothing carries.
        ("zmp_m", c_double * 2),
        # Force (N) and moment (N m) of the ground on each sole about its sole origin, world axes.
        ("foot_wrench_n_nm", c_double * 6 * 2),
        # Positions of the sole frames in the world.
        ("sole_position_m", c_double * 3 * 2),
        # Rotations of the sole frames in the world, row-major.
        ("sole_rotation", c_double * 9 * 2),
        # Positions of the ankles in the world.
        ("ankle_position_m", c_double * 3 * 2),
        # Kinetic energy.
        ("kinetic_energy_j", c_double),
        # Potential energy of gravity.
        ("potential_energy_j", c_double),
        # Elastic energy of both soles; zero for hard feet.
        ("elastic_energy_j", c_double),
        # Work of the servos since tick 0.
        ("servo_work_j", c_double),
        # Largest violation of the contact laws at the tick, over the largest nodal force; zero for hard feet.
        ("contact_residual", c_double),
        # Tick of the command under which the robot came here: that of the placing command at tick 0.
        ("command_tick", c_int64),
        # Joints at or beyond the limits of their position: bit *i* is joint *i*.
        ("joints_at_limit_bits", c_uint64),
        # Drives at the limit of their torque: bit *i* is joint *i*.
        ("drives_saturated_bits", c_uint64),
        # Sum of the forces that push the robot, the ground's aside; zero while none does.
        ("push_force_n", c_double * 3),
        # Where the strongest of them acts, in the world.
        ("push_point_m", c_double * 3),
    ]


assert sizeof(Truth) == 1760


class LatenessFigures(Layout):
    """Times of many cycles (HdrHistogram, two digits). A percentile is zero while fewer than ten samples lie beyond
    it."""

    WIRE_NAME = "soleus.LatenessFiguresV1"
    _fields_ = [
        # Number of cycles.
        ("count", c_uint64),
        # Median.
        ("p50_ns", c_uint64),
        # What 99 of 100 do not exceed.
        ("p99_ns", c_uint64),
        # What 999 of 1000 do not exceed.
        ("p999_ns", c_uint64),
        # The largest.
        ("max_ns", c_uint64),
    ]


assert sizeof(LatenessFigures) == 40


class TimingFigures(Layout):
    """What a process's cycles so far were like, against the tick's time; brought up to date once a second."""

    WIRE_NAME = "soleus.TimingFiguresV1"
    _fields_ = [
        # From the tick's time to when the thread ran, in real time.
        ("woke", LatenessFigures),
        # From the tick's time to when all inputs were there, in real time.
        ("inputs", LatenessFigures),
        # From the tick's time to when the answer was published, in real time.
        ("published", LatenessFigures),
        # Time of the processor that the thread used in a cycle.
        ("processor", LatenessFigures),
    ]


assert sizeof(TimingFigures) == 160


class ControllerFigures(Layout):
    """What the controller counts; all zero in the health of other processes."""

    WIRE_NAME = "soleus.ControllerFiguresV1"
    CODES = {"worst_limit": Limit}
    _fields_ = [
        # Steps in which all limits held, so far.
        ("steps_solved", c_uint64),
        # Steps whose limits had to be widened, so far.
        ("steps_relaxed", c_uint64),
        # Steps without a usable solution, so far.
        ("steps_held", c_uint64),
        # Steps that the backup solver answered, so far.
        ("steps_by_backup", c_uint64),
        # Robot states that were not used, so far.
        ("states_refused", c_uint64),
        # Measurements that were not used for feedback, so far.
        ("measurements_refused", c_uint64),
        # Largest distance of a joint from its reference.
        ("joint_distance_max_rad", c_double),
        # Distance of the model's centre of mass from its plan.
        ("com_distance_m", c_double),
        # Smallest distance of a collision pair; infinite: none is near.
        ("collision_distance_m", c_double),
        # The worst limit that gave way so far: `Limit`.
        ("worst_limit", c_uint32),
        # Which of its kind: foot, joint of the model, collision pair.
        ("worst_limit_index", c_uint32),
        # By how much, in the unit of `Limit`.
        ("worst_limit_amount", c_double),
        # Distance of the observed base from that of the model; feedback only.
        ("base_distance_m", c_double),
        # The same of its orientation.
        ("base_distance_rad", c_double),
        # Distance between where the two standing feet place the base; feedback only.
        ("feet_disagreement_m", c_double),
    ]


assert sizeof(ControllerFigures) == 112


class SimulatorFigures(Layout):
    """What the simulator keeps; all zero in the health of other processes."""

    WIRE_NAME = "soleus.SimulatorFiguresV1"
    CODES = {"fall_cause": Fall}
    _fields_ = [
        # How far the middle of the feet has moved along the ground.
        ("distance_m", c_double),
        # 1 once the robot has fallen.
        ("fallen", c_uint32),
        # Why it counts as fallen: `Fall`.
        ("fall_cause", c_uint32),
        # Control periods in which integration or contact did not reach its tolerance, so far.
        ("periods_unconverged", c_uint64),
        # Commands that no robot could follow, so far.
        ("commands_refused", c_uint64),
        # Joints at or beyond the limits of their position at any tick so far: bit *i* is joint *i*.
        ("joints_at_limit_bits", c_uint64),
        # Drives at the limit of their torque at any tick so far: bit *i* is joint *i*.
        ("drives_saturated_bits", c_uint64),
    ]


assert sizeof(SimulatorFigures) == 48


class RecorderFigures(Layout):
    """What the recorder keeps; all zero in the health of other processes."""

    WIRE_NAME = "soleus.RecorderFiguresV1"
    _fields_ = [
        # Last tick that is safely stored; -1 before the first.
        ("stored_tick", c_int64),
    ]


assert sizeof(RecorderFigures) == 8


class Health(Layout):
    """State, timing and solver figures of a process; the only message that holds wall-clock measurements."""

    WIRE_NAME = "soleus.HealthV2"
    CODES = {"process": Process, "state": State, "reason": Reason, "solver_status": Outcome}
    _fields_ = [
        # Header; the tick is the last one the process has finished, -1 before the first.
        ("header", Header),
        # Who: `Process`.
        ("process", c_uint32),
        # `State`.
        ("state", c_uint32),
        # Why it is in that state: `Reason`.
        ("reason", c_uint32),
        # Operating-system process id.
        ("process_id", c_uint32),
        # Time from the start of the cycle before to the start of this one.
        ("cycle_time_ns", c_uint64),
        # Time spent computing in this cycle, without waiting.
        ("compute_time_ns", c_uint64),
        # Longest computing time so far.
        ("compute_time_max_ns", c_uint64),
        # Sum of all computing times so far: divided by `cycles` their mean.
        ("compute_time_sum_ns", c_uint64),
        # Time of the processor that the thread used in this cycle; zero where it is not measured.
        ("processor_time_ns", c_uint64),
        # From the tick's time to the start of this cycle, in real time.
        ("wake_lateness_ns", c_uint64),
        # From the tick's time to when all inputs of this cycle were there, in real time.
        ("inputs_lateness_ns", c_uint64),
        # From the tick's time to when the answer was published, in real time.
        ("publish_lateness_ns", c_uint64),
        # Cycles so far.
        ("cycles", c_uint64),
        # Cycles that ended more than a control period after the tick's time, in real time.
        ("misses", c_uint64),
        # Cycles that began too late, in real time.
        ("late_wakes", c_uint64),
        # Answers that were published after their deadline, in real time.
        ("late_answers", c_uint64),
        # Inputs that were missing or came too late.
        ("late", c_uint64),
        # Messages lost (recorder: not stored).
        ("lost", c_uint64),
        # Outcome of the solver in this cycle: `Outcome`.
        ("solver_status", c_uint32),
        # Its iterations.
        ("solver_iterations", c_uint32),
        # Its residual.
        ("solver_residual", c_double),
        # Walk time; negative before time zero.
        ("walk_time_s", c_double),
        # Duration of the pattern; zero while unknown.
        ("walk_duration_s", c_double),
        # 1 if the process runs under a real-time scheduling policy.
        ("real_time_policy", c_uint32),
        # Its priority under SCHED_FIFO; zero under the ordinary policy.
        ("real_time_priority", c_uint32),
        # The only core it may run on, plus one; zero: any.
        ("core_plus_one", c_uint32),
        # 1 if all its memory is locked.
        ("memory_locked", c_uint32),
        # Minor page faults of the thread since its first tick with a time.
        ("minor_faults", c_uint64),
        # Major page faults of the thread since then.
        ("major_faults", c_uint64),
        # How often the clock grid was moved by the process that owns it, in real time.
        ("clock_slips", c_uint64),
        # The cycles so far.
        ("timing", TimingFigures),
        # The controller's own.
        ("controller", ControllerFigures),
        # The simulator's own.
        ("simulator", SimulatorFigures),
        # The recorder's own.
        ("recorder", RecorderFigures),
    ]


assert sizeof(Health) == 560


class Topic(NamedTuple):
    """What travels where."""

    name: str
    # The message, or the header of a slice.
    message: type
    # What the slice is made of.
    element: type | None
    # Messages per second; zero: once.
    rate_hz: int
    # How many past messages a late subscriber gets.
    kept: int
    # Whether publishing wakes those who wait.
    wakes: bool
    # Who publishes.
    publisher: Process


TOPICS = {
    topic.name: topic
    for topic in (
        Topic("walk/pattern", PatternHeader, PatternPhase, 0, 1, True, Process.PLANNER),
        Topic("walk/start", WalkStart, None, 0, 1, True, Process.CONTROLLER),
        Topic("walk/order", WalkOrder, None, 0, 1, False, Process.LAUNCHER),
        Topic("robot/state", RobotState, None, 200, 0, True, Process.SIMULATOR),
        Topic("sole/deformation", SoleDeformation, None, 200, 0, True, Process.ESTIMATOR),
        Topic("sole/contact", SoleContact, None, 200, 0, False, Process.ESTIMATOR),
        Topic("robot/command", RobotCommand, None, 200, 0, True, Process.CONTROLLER),
        Topic("truth/robot", Truth, None, 200, 0, False, Process.SIMULATOR),
        Topic("health/planner", Health, None, 200, 1, False, Process.PLANNER),
        Topic("health/estimator", Health, None, 200, 1, False, Process.ESTIMATOR),
        Topic("health/controller", Health, None, 200, 1, False, Process.CONTROLLER),
        Topic("health/simulator", Health, None, 200, 1, False, Process.SIMULATOR),
        Topic("health/recorder", Health, None, 200, 1, False, Process.RECORDER),
        Topic("health/launcher", Health, None, 200, 1, False, Process.LAUNCHER),
    )
}
