//! A gait configuration: what a person writes, with its units. What each number may be is in the module `validate`.

use pattern::Side;
use serde::{Deserialize, Serialize};

/// Everything the planner is told. Every table and every key may be left out; what stands in for it is HRP-4's walk of
/// 11 swings over 0.5 m.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GaitSettings {
    /// The robot as a cart on a table.
    pub body: BodySettings,
    /// Outline of the soles.
    pub sole: SoleOutline,
    /// Where the walk begins.
    pub start: StartSettings,
    /// Where the feet go.
    pub walk: Walk,
    /// How long the phases last.
    pub timing: TimingSettings,
    /// What is minimised.
    pub cost: CostSettings,
    /// What must hold.
    pub limits: LimitSettings,
    /// The foot in the air.
    pub swing: SwingSettings,
    /// How finely the problem is written.
    pub discretisation: DiscretisationSettings,
    /// How precisely it is solved.
    pub solver: SolverSettings,
}

/// Cart-table model, equation (8) and the ankle torques of (6). What is not given here is the robot's: the planner fills it in. Without a
/// robot it is HRP-4's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BodySettings {
    /// `M` (kg), see [`mass_kg`](Self::mass_kg).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_kg: Option<f64>,
    /// `g` (m/s^2).
    pub gravity_m_per_s2: f64,
    /// `z_COM` (m) above the ground, sole included: the pendulum's frequency is `sqrt(g / z_COM)`.
    pub com_height_m: f64,
    /// `z_a` (m), see [`ankle_height_m`](Self::ankle_height_m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ankle_height_m: Option<f64>,
}

impl Default for BodySettings {
    fn default() -> Self {
        Self { mass_kg: None, gravity_m_per_s2: 9.81, com_height_m: 0.790, ankle_height_m: None }
    }
}

impl BodySettings {
    /// `M` (kg): scales forces and torques.
    #[must_use]
    pub fn mass_kg(&self) -> f64 {
        self.mass_kg.unwrap_or(39.0)
    }

    /// `z_a` (m): height of the ankle above the ground, sole included.
    #[must_use]
    pub fn ankle_height_m(&self) -> f64 {
        self.ankle_height_m.unwrap_or(0.103)
    }
}

/// Rectangle of the sole and where the ankle stands on it. The right sole is the mirror image of the left one. What is not given here is the
/// robot's: the planner fills it in. Without a robot it is HRP-4's.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SoleOutline {
    /// See [`length_m`](Self::length_m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_m: Option<f64>,
    /// See [`width_m`](Self::width_m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width_m: Option<f64>,
    /// See [`left_ankle_in_sole_m`](Self::left_ankle_in_sole_m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left_ankle_in_sole_m: Option<[f64; 2]>,
}

impl SoleOutline {
    /// Along x (m).
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.length_m.unwrap_or(0.23)
    }

    /// Along y (m).
    #[must_use]
    pub fn width_m(&self) -> f64 {
        self.width_m.unwrap_or(0.13)
    }

    /// Projection of the left ankle in the sole frame, whose origin is the centre of the sole (m).
    #[must_use]
    pub fn left_ankle_in_sole_m(&self) -> [f64; 2] {
        self.left_ankle_in_sole_m.unwrap_or([-0.015, -0.011])
    }
}

/// Pose of the robot before the first step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StartSettings {
    /// Midpoint of the ankles (m).
    pub x_m: f64,
    /// Midpoint of the ankles (m).
    pub y_m: f64,
    /// Heading of both feet (rad).
    pub yaw_rad: f64,
    /// Distance between the ankles (m), at the start and, on straight walks, all the time.
    pub ankle_distance_m: f64,
    /// The foot that leaves the ground first; on a prescribed path its first landing says which.
    pub first_swing: Side,
}

impl Default for StartSettings {
    fn default() -> Self {
        Self { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0, ankle_distance_m: 0.163, first_swing: Side::Right }
    }
}

/// Where the feet go, in the frame of the starting pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Walk {
    /// Forward (backward if negative): swing q lands `q` step lengths ahead, the last one beside the one before.
    Straight {
        /// N.
        swings: u32,
        /// Advance of the body per swing (m).
        step_length_m: f64,
    },
    /// To the left (to the right if negative): the leading foot opens by the width, the other one closes.
    Sideways {
        /// N.
        swings: u32,
        /// By how much the leading foot opens (m).
        step_width_m: f64,
    },
    /// On a circle to the left (to the right if the radius is negative).
    Circle {
        /// N.
        swings: u32,
        /// Advance along the circle per swing (m).
        step_length_m: f64,
        /// Radius of the path of the feet's midpoint (m).
        radius_m: f64,
    },
    /// On the spot, turning by an angle at every swing.
    InPlace {
        /// N.
        swings: u32,
        /// Turn to the left per swing (rad).
        turn_per_swing_rad: f64,
    },
    /// Straight ahead by a distance; all landings but the last two are chosen by the optimisation.
    Free {
        /// N.
        swings: u32,
        /// How far the feet's midpoint gets (m).
        distance_m: f64,
    },
    /// Prescribed landings.
    Path {
        /// One landing after the other, feet alternating.
        landings: Vec<Landing>,
    },
}

impl Default for Walk {
    fn default() -> Self {
        Self::Straight { swings: 11, step_length_m: 0.05 }
    }
}

/// One prescribed landing of the ankle's projection, in the frame of the starting pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Landing {
    /// Which foot.
    pub foot: Side,
    /// Forward (m).
    pub x_m: f64,
    /// To the left (m).
    pub y_m: f64,
    /// Heading (rad).
    #[serde(default)]
    pub yaw_rad: f64,
    /// Whether the position is only a first guess that the optimisation may move. Never the last two.
    #[serde(default)]
    pub free: bool,
}

/// Durations. A step is a single support with the double support that follows it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TimingSettings {
    /// Double support before the first swing (s).
    pub start_s: f64,
    /// Every single support (s).
    pub single_support_s: f64,
    /// Every double support between two swings (s).
    pub double_support_s: f64,
    /// Double support after the last swing (s).
    pub stop_s: f64,
    /// Single supports one by one (s), if they differ: N numbers, or none.
    pub single_support_each_s: Vec<f64>,
    /// Double supports one by one (s), if they differ: N - 1 numbers, or none.
    pub double_support_each_s: Vec<f64>,
}

impl Default for TimingSettings {
    fn default() -> Self {
        Self {
            start_s: 0.81,
            single_support_s: 0.80,
            double_support_s: 0.40,
            stop_s: 0.81,
            single_support_each_s: Vec::new(),
            double_support_each_s: Vec::new(),
        }
    }
}

/// Weights of (4).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CostSettings {
    /// 0: only ankle torques count, 1: only the horizontal force on the COM.
    pub lambda: f64,
    /// Weight of the accelerations of the two feet's ZMPs in double support, beside forces in N. Useful: 0 to 100.
    pub mu: f64,
}

impl Default for CostSettings {
    fn default() -> Self {
        Self { lambda: 0.6, mu: 15.0 }
    }
}

/// Inequalities.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LimitSettings {
    /// By how much the sole's rectangle is shrunk on each side for the ZMPs (m): 5 to 10 % of the length.
    pub zmp_margin_m: f64,
    /// Least distance between the inner edges of the soles (m).
    pub feet_gap_min_m: f64,
    /// Largest distance between the ankles along the stance foot (m).
    pub step_length_max_m: f64,
    /// Largest distance between the ankles across the stance foot (m).
    pub step_width_max_m: f64,
}

impl Default for LimitSettings {
    fn default() -> Self {
        Self { zmp_margin_m: 0.02, feet_gap_min_m: 0.03, step_length_max_m: 0.30, step_width_max_m: 0.35 }
    }
}

/// The foot in the air.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SwingSettings {
    /// Height of the highest point above the stance (m).
    pub apex_m: f64,
}

impl Default for SwingSettings {
    fn default() -> Self {
        Self { apex_m: 0.04 }
    }
}

/// How finely the problem is written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DiscretisationSettings {
    /// Evenly spaced instants per polynomial at which the ZMPs must lie in their polygon, both ends included; at least 3.
    pub samples_per_polynomial: u32,
    /// Gauss-Legendre nodes per panel of a polynomial; at least 6, with which products of quintics are exact.
    pub quadrature_nodes: u32,
    /// Polynomials per single support between the first and the last one, which have one.
    pub single_support_polynomials: u32,
}

impl Default for DiscretisationSettings {
    fn default() -> Self {
        Self { samples_per_polynomial: 11, quadrature_nodes: 12, single_support_polynomials: 2 }
    }
}

/// How precisely the problem is solved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolverSettings {
    /// Tolerance on residuals and gap of the scaled problem.
    pub tolerance: f64,
    /// Limit of interior-point iterations.
    pub iterations_max: u32,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self { tolerance: 1e-10, iterations_max: 200 }
    }
}
