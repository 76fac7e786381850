//! The stabiliser: keeps a planned walk upright with what the robot measures, and nothing else.
//!
//! Inputs are the plan that came with the command and the sensors; outputs are corrected joint references. A robot has it built in, between
//! command and drives, or the controller has it ([`Stabiliser::step`] is the same; there it acts one period later). With `xi = c + c'/w` the divergent component of motion, `w^2 = g / (c_z - p_z)`:
//!
//! **1. Measured motion.** The measured base orientation (inertial unit; its heading is replaced by the plan's, for a real
//! one drifts) and the encoders give centre of mass and feet relative to each other. Each planned stance foot is anchored: the place
//! where its sole stands on the ground does not move, and the ankle is where the planned ankle comes to when the foot turns about
//! that place from its planned to its measured orientation. So a sole that gives way is *seen*. With two stance feet the two
//! answers are weighted by the planned load. The velocity follows the same way from gyrometer and joint rates.
//!
//! **2. Desired ZMP** `p_d = p_ref + (1 + k_p/w) (xi - xi_ref) + k_i INT (xi - xi_ref)`, clamped to the support polygon (the convex hull
//! of the stance feet's usable rectangles); the integral rests while it is clamped. Without clamping and lag the error
//! decays as `exp(-k_p t)`.
//!
//! **3. Distribution.** The wanted shift of the ZMP needs a moment `f (p_d - p_ref)`, `f` the total vertical force. It is made of a
//! force `s` moved from right to left and moments `m_i` under each foot, with the least effort
//! `s^2 l^2 / (4 a_l a_r) + sum |m_i|^2 / a_i`, `a_i` the planned shares of the load: closed form, a 2 x 2 system. A foot without
//! load gets nothing; in single support all goes to the stance foot.
//!
//! **4. Foot damping** (Kajita et al. 2010), per foot and about its roll and pitch axis: `theta' = (tau - tau_d)/D - theta/T`, with `tau` the
//! moment of the ground on the foot about the ankle and `theta` added to the foot's orientation. The foot turns about the place where its
//! sole stands, not about the ankle: a turn about the ankle 0.1 m above would shear a sole that sticks.
//! In double support also the **force difference**: `z' = ((F_l,d - F_r,d) - (F_l - F_r))/D_z - z/T`, left ankle down by z/2,
//! right one up by z/2.
//!
//! **5. Torso.** The base is turned about the planned centre of mass against the measured tilt, `d' = -k e - d/T`.
//!
//! **6. Joint angles** follow by the inverse kinematics (`multibody::leg`) of both legs; other joints keep their references.
//!
//! The measurements of a tick are compared with the plan of the *previous* command: the drives' ramp has just reached it.
//!
//! *How the gains follow from the sole.* With the body at rest the sole answers a turn by `tau' = -K theta'`, so foot damping closes the
//! moment loop at `K/D`: 20-30 1/s in roll (K = 0.6-0.9 kN m/rad, D = 30) and in pitch (2-2.7 kN m/rad, 90); the force difference
//! closes at `K_z/D_z` = 20 1/s (500 kN/m, 2.5e4). That is an order faster than the DCM loop `k_p` = 3 1/s, and times the lag of
//! about 10 ms (ramp of the drives, their own response) it stays at 0.2-0.3, where overshoot begins. `m g h` is 0.3 kN m/rad: the loop
//! must be closed in roll wherever the ZMP leaves the sole's kern and K falls to that. The usable rectangle ends 1 cm inside 0.89 of the half
//! size, beyond which a soft sole that is set down at full load has no pose and one that stands already tilts by more than 5 degrees
//! (see `sole`). A hard foot on the same drives has
//! ten times the roll stiffness: with these gains it rattles, and wants D = 200 / 400 and D_z = 1e5.
//!
//! References: S. Kajita et al., *Biped walking stabilization based on linear inverted pendulum tracking*, IROS 2010; S. Caron,
//! A. Kheddar, O. Tempier, *Stair climbing stabilization of the HRP-4 humanoid robot using whole-body admittance control*, ICRA 2019.

#![allow(non_snake_case)] // monogram notation, see the style guide

mod measure;
mod plan;
mod settings;

pub use measure::{MeasuredMotion, Sensed};
pub use plan::{FootPlan, Plan};
pub use settings::StabiliserSettings;

use measure::Measurement;
use multibody::leg::{LegError, LegKinematics};
use multibody::{FrameIndex, JointIndex, Model, Workspace, forward_kinematics};
use nalgebra::{DVector, Matrix2, Vector2};
use spatial::polygon::ConvexPolygon;
use spatial::{Mat3, Transform, Vec3, Wrench, so3};

/// What the stabiliser saw, wanted and did in one tick; for logs.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StabiliserReport {
    /// Centre of mass and divergent component as measured.
    pub measured: MeasuredMotion,
    /// `xi - xi_ref` (m).
    pub dcm_error: Vector2<f64>,
    /// Desired ZMP (m).
    pub zmp_desired: Vector2<f64>,
    /// The desired ZMP had to be clamped.
    pub zmp_clamped: bool,
    /// Desired vertical force of each foot (N).
    pub vertical_force_desired: [f64; 2],
    /// Desired roll and pitch moment about each ankle, heading axes (N m).
    pub moment_desired: [Vector2<f64>; 2],
    /// Measured ones.
    pub moment_measured: [Vector2<f64>; 2],
    /// Roll and pitch added to each foot, heading axes (rad).
    pub foot_rotation: [Vector2<f64>; 2],
    /// Left ankle below the right one by this much more than planned (m).
    pub vertical_shift: f64,
    /// Roll and pitch added to the base, world axes (rad).
    pub torso_rotation: Vector2<f64>,
    /// Largest length by which a leg could not reach its target (m).
    pub out_of_reach_m: f64,
}

/// A leg as the stabiliser knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// Its inverse kinematics.
    pub kinematics: LegKinematics,
    /// Its joints in the model's order, from the hip; the fourth is the knee.
    pub joints: [usize; 6],
    /// Foot link, origin at the ankle.
    pub ankle: FrameIndex,
    /// `X_AS`: sole frame in the ankle frame.
    pub sole_in_ankle: Transform,
    /// Force sensor in the ankle frame.
    pub sensor_in_ankle: Transform,
}

impl Leg {
    /// Of a model: joints from the hip, the frames of ankle and force sensor, and where the ankle is in the sole frame (m), whose axes are
    /// the foot's.
    ///
    /// # Errors
    /// [`LegError`] if no inverse kinematics holds.
    pub fn of_model(
        model: &Model,
        joints: [JointIndex; 6],
        ankle: FrameIndex,
        sensor: FrameIndex,
        ankle_in_sole_m: &Vec3,
    ) -> Result<Self, LegError> {
        let mut ws = Workspace::new(model);
        let neutral = model.neutral();
        let placed = forward_kinematics(model, &mut ws, &neutral);
        Ok(Self {
            kinematics: LegKinematics::of_model(model, &joints, ankle)?,
            joints: joints.map(|joint| joint.0),
            ankle,
            sole_in_ankle: Transform::from_translation(-ankle_in_sole_m),
            sensor_in_ankle: placed.pose(ankle).inverse() * placed.pose(sensor),
        })
    }
}

/// The stabiliser with its state.
pub struct Stabiliser {
    settings: StabiliserSettings,
    legs: [Leg; 2],
    gravity: f64,
    measurement: Measurement,
    memory: Memory,
    joint_positions: DVector<f64>,
}

/// What is remembered from tick to tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Memory {
    dcm_integral: Vector2<f64>,
    foot_rotation: [Vector2<f64>; 2],
    vertical_shift: f64,
    torso_rotation: Vector2<f64>,
    reached: Option<Plan>,
}

/// What one foot should feel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct WantedFoot {
    vertical_force: f64,
    /// Moment about the ankle, world axes, roll and pitch of the heading frame.
    moment: Vector2<f64>,
}

impl Stabiliser {
    /// For a robot with these legs (left, right), whose inertial unit is turned in the base by `imu_in_base`.
    #[must_use]
    pub fn new(settings: StabiliserSettings, model: &Model, legs: [Leg; 2], imu_in_base: Mat3) -> Self {
        Self {
            settings,
            legs,
            gravity: model.gravity().norm(),
            measurement: Measurement::new(model, legs, imu_in_base),
            memory: Memory::default(),
            joint_positions: DVector::zeros(model.joint_count()),
        }
    }

    /// Forgets everything.
    pub fn restart(&mut self) {
        self.memory = Memory::default();
    }

    /// The corrected joint references of the last step (rad).
    #[must_use]
    pub fn joint_positions(&self) -> &DVector<f64> {
        &self.joint_positions
    }

    /// Corrects the joint references of a command, `period_s` after the last call.
    pub fn step(
        &mut self,
        model: &Model,
        references: &DVector<f64>,
        plan: &Plan,
        sensors: &Sensed<'_>,
        period_s: f64,
    ) -> StabiliserReport {
        let reached = self.memory.reached.unwrap_or(*plan);
        self.memory.reached = Some(*plan);
        let measured = self.measurement.motion(model, &reached, sensors, self.gravity);
        let mut report = StabiliserReport { measured, ..Default::default() };

        let zmp_desired = self.desired_zmp(&reached, &measured, period_s, &mut report);
        let wanted = self.distribute(&reached, &measured, &zmp_desired);
        self.damp_feet(&reached, sensors, &wanted, period_s, &mut report);
        self.turn_torso(&measured, period_s);
        report.out_of_reach_m = self.inverse_kinematics(references, plan);

        report.zmp_desired = zmp_desired;
        report.foot_rotation = self.memory.foot_rotation;
        report.vertical_shift = self.memory.vertical_shift;
        report.torso_rotation = self.memory.torso_rotation;
        report
    }

    /// Step 2.
    fn desired_zmp(
        &mut self,
        plan: &Plan,
        measured: &MeasuredMotion,
        period_s: f64,
        report: &mut StabiliserReport,
    ) -> Vector2<f64> {
        let s = &self.settings;
        let omega = measured.omega;
        let dcm_planned = plan.com.xy() + plan.com_velocity.xy() / omega;
        let error = measured.dcm - dcm_planned;
        let integral = self.memory.dcm_integral + period_s * error;
        let wanted = plan.zmp + (1.0 + s.dcm_gain_per_s / omega) * error + s.dcm_integral_gain_per_s * integral;
        let desired = self.support(plan).nearest(&wanted);
        report.dcm_error = error;
        report.zmp_clamped = desired != wanted;
        if !report.zmp_clamped {
            self.memory.dcm_integral = integral;
        }
        desired
    }

    /// Hull of the usable rectangles of the feet that carry load.
    fn support(&self, plan: &Plan) -> ConvexPolygon {
        let mut corners = [Vector2::zeros(); 8];
        let mut count = 0;
        for (leg, foot) in self.legs.iter().zip(&plan.feet) {
            if foot.in_contact {
                let (centre, heading) = standing_place(leg, foot);
                for (x, y) in [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)] {
                    let corner = Vector2::new(x * self.settings.zmp_half_length_m, y * self.settings.zmp_half_width_m);
                    corners[count] = centre.xy() + heading * corner;
                    count += 1;
                }
            }
        }
        ConvexPolygon::hull(&corners[..count])
    }

    /// Step 3.
    fn distribute(&self, plan: &Plan, measured: &MeasuredMotion, zmp_desired: &Vector2<f64>) -> [WantedFoot; 2] {
        let total: f64 = plan.feet.iter().map(|foot| foot.force.z).sum();
        let shift = zmp_desired - plan.zmp;
        let shares = plan.feet.map(|foot| if foot.in_contact { foot.load_share } else { 0.0 });
        let between = plan.feet[0].zmp - plan.feet[1].zmp;
        let length = self.settings.load_shift_length_m;
        let willing = 4.0 * shares[0] * shares[1] / (length * length);
        // s = willing (d . lambda), m_i = a_i lambda:  (willing d d^T + sum a_i) lambda = f (p_d - p_ref)
        let system = willing * between * between.transpose() + Matrix2::identity() * (shares[0] + shares[1]);
        let lambda = system.try_inverse().map_or(Vector2::zeros(), |inverse| inverse * shift * total);
        // A plan may have forces of rounding below zero: a foot that carries nothing gives nothing away.
        let [left, right] = plan.feet.map(|foot| foot.force.z.max(0.0));
        let moved = (willing * between.dot(&lambda)).clamp(-left, right);

        std::array::from_fn(|i| {
            let (foot, leg) = (&plan.feet[i], &self.legs[i]);
            let vertical = foot.force.z + if i == 0 { moved } else { -moved };
            if !foot.in_contact || vertical <= 0.0 {
                return WantedFoot::default();
            }
            let (centre, heading) = standing_place(leg, foot);
            let offset = heading.tr_mul(&(foot.zmp + shares[i] * lambda / vertical - centre.xy()));
            let (x, y) = (self.settings.zmp_half_length_m, self.settings.zmp_half_width_m);
            let inside = centre.xy() + heading * Vector2::new(offset.x.clamp(-x, x), offset.y.clamp(-y, y));
            // Horizontal force of the pendulum at the measured centre of mass and desired ZMP, by load.
            let horizontal =
                vertical * measured.omega * measured.omega / self.gravity * (measured.com.xy() - zmp_desired);
            let force = Vec3::new(horizontal.x, horizontal.y, vertical);
            let point = Vec3::new(inside.x, inside.y, centre.z);
            let about_ankle = Wrench::of_force_at(&force, &point, &foot.ankle.translation);
            WantedFoot { vertical_force: vertical, moment: heading.tr_mul(&about_ankle.moment.xy()) }
        })
    }

    /// Step 4.
    fn damp_feet(
        &mut self,
        plan: &Plan,
        sensors: &Sensed<'_>,
        wanted: &[WantedFoot; 2],
        period_s: f64,
        report: &mut StabiliserReport,
    ) {
        let s = self.settings;
        let mut vertical = [0.0; 2];
        for i in 0..2 {
            let (foot, leg) = (&plan.feet[i], &self.legs[i]);
            let (_, heading) = standing_place(leg, foot);
            let about_ankle: Wrench = leg.sensor_in_ankle.wrench(&sensors.foot_wrenches[i]);
            let R_WA = self.measurement.ankle(i).rotation;
            vertical[i] = (R_WA * about_ankle.force).z;
            let moment = heading.tr_mul(&(R_WA * about_ankle.moment).xy());
            report.moment_measured[i] = moment;
            report.moment_desired[i] = wanted[i].moment;
            report.vertical_force_desired[i] = wanted[i].vertical_force;

            let rotation = &mut self.memory.foot_rotation[i];
            if foot.in_contact {
                let error = moment - wanted[i].moment;
                let rate = Vector2::new(error.x / s.roll_damping_nm_s_per_rad, error.y / s.pitch_damping_nm_s_per_rad);
                *rotation += period_s * rate;
            }
            let relaxation = if foot.in_contact { s.relaxation_s } else { s.swing_relaxation_s };
            *rotation /= 1.0 + period_s / relaxation;
            *rotation = rotation.map(|angle| angle.clamp(-s.foot_rotation_max_rad, s.foot_rotation_max_rad));
        }

        let both = plan.feet[0].in_contact && plan.feet[1].in_contact;
        let shift = &mut self.memory.vertical_shift;
        if both {
            let wanted_difference = wanted[0].vertical_force - wanted[1].vertical_force;
            *shift += period_s * (wanted_difference - (vertical[0] - vertical[1])) / s.vertical_damping_n_s_per_m;
        }
        *shift /= 1.0 + period_s / if both { s.relaxation_s } else { s.swing_relaxation_s };
        *shift = shift.clamp(-s.vertical_shift_max_m, s.vertical_shift_max_m);
    }

    /// Step 5.
    fn turn_torso(&mut self, measured: &MeasuredMotion, period_s: f64) {
        let s = &self.settings;
        let rotation = &mut self.memory.torso_rotation;
        *rotation -= period_s * s.torso_gain_per_s * measured.base_tilt;
        *rotation /= 1.0 + period_s / s.torso_relaxation_s;
        *rotation = rotation.map(|angle| angle.clamp(-s.torso_rotation_max_rad, s.torso_rotation_max_rad));
    }

    /// Step 6; returns by how much the worse leg misses its target (m).
    fn inverse_kinematics(&mut self, references: &DVector<f64>, plan: &Plan) -> f64 {
        self.joint_positions.copy_from(references);
        let turn = so3::exp(&Vec3::new(self.memory.torso_rotation.x, self.memory.torso_rotation.y, 0.0));
        let about_com = Transform::new(turn, plan.com - turn * plan.com);
        let X_BW = (about_com * plan.base).inverse();
        let mut out_of_reach_m = 0.0f64;
        for (i, leg) in self.legs.iter().enumerate() {
            let near_rad = leg.joints.map(|joint| references[joint]);
            let X_BA = leg.kinematics.forward(&near_rad);
            let X_WA = plan.base * X_BA;
            let planned = FootPlan { ankle: X_WA, ..plan.feet[i] };
            let (place, heading) = standing_place(leg, &planned);
            let angles = heading * self.memory.foot_rotation[i];
            let turn = so3::exp(&Vec3::new(angles.x, angles.y, 0.0));
            let down = 0.5 * self.memory.vertical_shift * if i == 0 { 1.0 } else { -1.0 };
            let moved = Transform::new(turn, place - turn * place - Vec3::new(0.0, 0.0, down)) * X_WA;
            let found = leg.kinematics.inverse(&(X_BW * moved), &near_rad);
            for (joint, angle) in leg.joints.into_iter().zip(found.joints_rad) {
                self.joint_positions[joint] = angle;
            }
            out_of_reach_m = out_of_reach_m.max(found.out_of_reach_m.abs());
        }
        out_of_reach_m
    }
}

/// Centre of the sole's bottom face as planned, and the foot's heading as a plane rotation.
fn standing_place(leg: &Leg, foot: &FootPlan) -> (Vec3, Matrix2<f64>) {
    let centre = foot.ankle.point(&leg.sole_in_ankle.translation);
    let forward = foot.ankle.rotation.column(0);
    let forward = Vector2::new(forward.x, forward.y).normalize();
    (centre, Matrix2::new(forward.x, -forward.y, forward.y, forward.x))
}
