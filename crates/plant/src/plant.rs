//! The simulated robot as one thing: what a control computer would be connected to.

use multibody::{
    Configuration, FrameIndex, JointIndex, Model, ModelError, Workspace, forward_kinematics,
    forward_kinematics_velocity,
};
use nalgebra::DVector;
use sole::{ContactReport, Ground};
use spatial::{Transform, Vec3, Wrench};

use crate::energy::{Energies, EnergyFlows};
use crate::fall::{Fall, detect};
use crate::foot::{Foot, PlantSole};
use crate::sensor::{PlantSensors, SensorBank};
use crate::servo::{Servo, UnknownDrive};
use crate::settings::PlantSettings;
use crate::step::{AppliedForce, Scene, State, StepTime, Stepper};
use crate::truth::{FootTruth, Integration, Truth};
use multibody::leg::LegError;
use ranges::OutOfRange;
use stabiliser::{Leg, Plan, Sensed, Stabiliser, StabiliserReport};

/// Names of the frames and joints that the plant needs to know. Feet and legs are left, right.
#[derive(Debug, Clone, PartialEq)]
pub struct PlantFrames {
    /// Inertial unit.
    pub imu: String,
    /// Foot links, origin at the ankle.
    pub ankles: [String; 2],
    /// Six-axis force sensors.
    pub force_sensors: [String; 2],
    /// Hip yaw, roll, pitch, knee, ankle pitch, roll.
    pub legs: [[String; 6]; 2],
}

/// What the controller asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct PlantCommand {
    /// Joint references in the model's order (rad), reached at the end of the period.
    pub joint_positions: DVector<f64>,
    /// Feed-forward torques (N m).
    pub joint_torques: DVector<f64>,
    /// The plan that the stabiliser needs; without one it does nothing.
    pub plan: Option<Plan>,
}

/// A plant that cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum PlantError {
    /// A setting cannot be.
    #[error(transparent)]
    Settings(#[from] OutOfRange),
    /// A frame or joint is not in the model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The settings name a drive that is not there.
    #[error(transparent)]
    Drive(#[from] UnknownDrive),
    /// The stabiliser's inverse kinematics do not hold for a leg.
    #[error("the {side} leg has no closed-form inverse kinematics: {error}")]
    Leg {
        /// Which leg.
        side: &'static str,
        /// What is wrong with it.
        error: LegError,
    },
    /// The model's base is fixed: such a robot does not walk.
    #[error("the model has a fixed base, a floating one is needed")]
    FixedBase,
}

/// How often a step may be halved.
const HALVINGS_MAX: u32 = 4;
/// Steps become longer when their error is less than this part of the largest: one of twice the length has four times the error.
const CALM: f64 = 1.0 / 16.0;

/// The simulated robot.
pub struct Plant {
    settings: PlantSettings,
    model: Model,
    imu: FrameIndex,
    legs: [Leg; 2],
    sole_frames: [FrameIndex; 2],
    /// Links that must not touch the ground.
    links: Vec<FrameIndex>,
    /// Frame of each push.
    pushed: Vec<FrameIndex>,
    applied: Vec<AppliedForce>,
    stepper: Stepper,
    /// Length of the next step, in the shortest steps there are.
    step_units: u64,
    servo: Servo,
    feet: [Foot; 2],
    stabiliser: Stabiliser,
    sensors: SensorBank,
    exact: PlantSensors,
    ws: Workspace,
    state: State,
    ticks: u64,
    clock_start: Option<u64>,
    imu_velocity: Vec3,
    flows: EnergyFlows,
    truth: Truth,
    fallen: Option<Fall>,
    resting_ticks: u64,
}

impl Plant {
    /// A robot of the given model on the given soles (left, right). It stands nowhere until it is [placed](Self::place).
    ///
    /// # Errors
    /// Settings that cannot be, names that the model does not know, a leg without closed-form inverse kinematics.
    pub fn new(
        settings: PlantSettings,
        mut model: Model,
        soles: [impl Into<PlantSole>; 2],
        frames: &PlantFrames,
    ) -> Result<Self, PlantError> {
        settings.check()?;
        if model.base_dofs() != 6 {
            return Err(PlantError::FixedBase);
        }
        let servo = Servo::new(&model, &settings.servo)?;
        for i in 0..model.joint_count() {
            model.set_rotor_inertia(JointIndex(i), servo.rotor_inertia_kg_m2(i));
        }
        let imu = model.frame(&frames.imu)?;
        let ankles = [model.frame(&frames.ankles[0])?, model.frame(&frames.ankles[1])?];
        let sensors = [model.frame(&frames.force_sensors[0])?, model.frame(&frames.force_sensors[1])?];
        let links = links_off_the_ground(&model, &ankles);
        let mut pushed = Vec::with_capacity(settings.pushes.len());
        for (i, push) in settings.pushes.iter().enumerate() {
            let link = model.frame(&push.link)?;
            let point = Transform::from_translation(Vec3::from(push.point_in_link_m));
            pushed.push(model.add_frame(&format!("push {i}"), link, point));
        }

        let soles = soles.map(Into::into);
        let mut ws = Workspace::new(&model);
        let placed = forward_kinematics(&model, &mut ws, &model.neutral());
        let mut legs = Vec::with_capacity(2);
        for (foot, side) in ["left", "right"].into_iter().enumerate() {
            let mut joints = [JointIndex(0); 6];
            for (joint, name) in joints.iter_mut().zip(&frames.legs[foot]) {
                *joint = model.joint(name)?;
            }
            let leg = Leg::of_model(&model, joints, ankles[foot], sensors[foot], &soles[foot].ankle_in_sole_m());
            legs.push(leg.map_err(|error| PlantError::Leg { side, error })?);
        }
        let legs = [legs[0], legs[1]];
        let imu_in_base = (placed.pose(model.base_frame()).inverse() * placed.pose(imu)).rotation;
        let sole_frames =
            [0, 1].map(|i| model.add_frame(["left sole", "right sole"][i], ankles[i], legs[i].sole_in_ankle));
        let stepper = Stepper::new(&model, settings.step, sole_frames, pushed.len());
        let joint_count = model.joint_count();
        let state = State { q: model.neutral(), v: DVector::zeros(model.nv()) };
        Ok(Self {
            imu,
            legs,
            sole_frames,
            links,
            applied: Vec::with_capacity(pushed.len()),
            pushed,
            stepper,
            step_units: 1 << HALVINGS_MAX,
            servo,
            feet: soles.map(|sole| Foot::new(sole, &settings.contact)),
            stabiliser: Stabiliser::new(settings.stabiliser, &model, legs, imu_in_base),
            sensors: SensorBank::new(settings.sensors, joint_count),
            exact: PlantSensors::zero(joint_count),
            ws: Workspace::new(&model),
            state,
            ticks: 0,
            clock_start: None,
            imu_velocity: Vec3::zeros(),
            flows: EnergyFlows::default(),
            truth: Truth::default(),
            fallen: None,
            resting_ticks: 0,
            model,
            settings,
        })
    }

    /// The model that is simulated: the caller's, with rotor inertias, sole and push frames.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The settings it was built with.
    #[must_use]
    pub fn settings(&self) -> &PlantSettings {
        &self.settings
    }

    /// Puts the robot into a configuration, at rest, and forgets everything before. Soles that the configuration presses into
    /// the ground have stood so for long: put them where they carry the robot (the pattern's start, deformed by the estimator), and
    /// nothing jumps.
    pub fn place(&mut self, q: &Configuration) {
        let v = DVector::zeros(self.model.nv());
        self.place_moving(q, &v);
    }

    /// Puts the robot into a configuration with a velocity (base twist in the base frame, joint rates).
    pub fn place_moving(&mut self, q: &Configuration, v: &DVector<f64>) {
        self.state.q.base = q.base;
        self.state.q.joints.copy_from(&q.joints);
        self.state.v.copy_from(v);
        self.servo.hold(&q.joints);
        let moving = forward_kinematics_velocity(&self.model, &mut self.ws, &self.state.q, &self.state.v);
        self.imu_velocity = moving.velocity(self.imu).linear;
        let wrenches =
            [0, 1].map(|i| self.feet[i].place(&moving.pose(self.sole_frames[i]), &self.settings.ground).wrench);
        self.stepper.place(&self.model, &self.state, wrenches);
        self.step_units = 1 << HALVINGS_MAX;
        self.stabiliser.restart();
        self.sensors.restart();
        self.ticks = 0;
        self.clock_start = None;
        self.flows = EnergyFlows::default();
        self.fallen = None;
        self.resting_ticks = 0;
        self.truth = Truth::default();
        let (kinetic_j, potential_j) = self.energies();
        self.truth.energies.initial_j = kinetic_j + potential_j;
        self.observe(Integration::default(), StabiliserReport::default());
    }

    /// Starts the clock of the pushes now; before, none acts.
    pub fn start_clock(&mut self) {
        self.clock_start = Some(self.ticks);
    }

    /// One control period under a command; returns what is measured at its end. A fallen robot no longer moves.
    ///
    /// # Panics
    /// The command has not as many joints as the model.
    pub fn tick(&mut self, command: &PlantCommand) -> &PlantSensors {
        let joint_count = self.model.joint_count();
        assert_eq!((command.joint_positions.len(), command.joint_torques.len()), (joint_count, joint_count));
        if self.fallen.is_some() {
            return self.sensors.current();
        }
        let period_s = self.settings.step.control_period_s;
        let mut stabiliser = StabiliserReport::default();
        let references = match &command.plan {
            Some(plan) if self.settings.stabiliser.enabled => {
                let measured = self.sensors.current();
                let sensed = Sensed {
                    joint_positions: &measured.joint_positions,
                    joint_rates: &measured.joint_rates,
                    orientation: measured.orientation,
                    angular_velocity: measured.angular_velocity,
                    foot_wrenches: measured.foot_wrenches,
                };
                stabiliser = self.stabiliser.step(&self.model, &command.joint_positions, plan, &sensed, period_s);
                self.stabiliser.joint_positions()
            }
            _ => &command.joint_positions,
        };
        self.servo.command(references, &command.joint_torques, period_s);
        let integration = self.integrate(period_s);
        self.ticks += 1;
        self.observe(integration, stabiliser);
        self.sensors.current()
    }

    /// What is measured now.
    #[must_use]
    pub fn sensors(&self) -> &PlantSensors {
        self.sensors.current()
    }

    /// What really is.
    #[must_use]
    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    /// Configuration and velocity, really.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Contact points of a foot (0 = left) at the tick: positions, forces, states. `None` for a hard foot.
    #[must_use]
    pub fn contact(&self, foot: usize) -> Option<&ContactReport> {
        self.feet[foot].report()
    }

    /// Is the drive of a joint at the limit of its torque at the tick?
    #[must_use]
    pub fn drive_saturated(&self, joint: usize) -> bool {
        self.stepper.drives()[joint].saturated
    }

    /// Has it fallen?
    #[must_use]
    pub fn fallen(&self) -> Option<&Fall> {
        self.fallen.as_ref()
    }

    /// Has it been at rest (see [`crate::settings::RestSettings`]) for the time set?
    #[must_use]
    pub fn at_rest(&self) -> bool {
        self.resting_ticks as f64 * self.settings.step.control_period_s >= self.settings.rest.duration_s
    }

    /// Repeats a command until the robot is at rest, has fallen or the time is up; returns the time it took (s), or `None`.
    pub fn settle(&mut self, command: &PlantCommand, time_max_s: f64) -> Option<f64> {
        let ticks_max = (time_max_s / self.settings.step.control_period_s).ceil() as u64;
        let first = self.ticks;
        while !self.at_rest() {
            if self.fallen.is_some() || self.ticks - first >= ticks_max {
                return None;
            }
            self.tick(command);
        }
        Some((self.ticks - first) as f64 * self.settings.step.control_period_s)
    }

    fn integrate(&mut self, period_s: f64) -> Integration {
        let mut integration = Integration::default();
        // Time is counted in the shortest steps there are, so that it adds up.
        let longest = 1 << HALVINGS_MAX;
        let all = (period_s / self.settings.step.step_s).round().max(1.0) as u64 * longest;
        let unit_s = period_s / all as f64;
        let mut passed = 0;
        while passed < all {
            // A step begins at a multiple of its own length.
            let length = self.step_units.min(1 << passed.trailing_zeros().min(HALVINGS_MAX));
            let step_s = length as f64 * unit_s;
            let t_s = self.clock_start.map(|start| (self.ticks - start) as f64 * period_s + passed as f64 * unit_s);
            self.applied.clear();
            for (push, &frame) in self.settings.pushes.iter().zip(&self.pushed) {
                let share = t_s.map_or(0.0, |t_s| push.active_share(t_s, step_s));
                if share > 0.0 {
                    self.applied.push(AppliedForce { frame, force: share * Vec3::from(push.force_n) });
                }
            }
            let share_at_end = (passed + length) as f64 / all as f64;
            let time = StepTime { step_s, period_s, share_at_end, last_resort: length == 1 };
            let scene =
                Scene { model: &self.model, servo: &self.servo, ground: &self.settings.ground, applied: &self.applied };
            let report = self.stepper.step(&scene, &mut self.state, &mut self.feet, time, &mut self.flows);
            integration.newton_steps += report.newton_steps;
            if report.rejected {
                self.step_units = length / 2;
                integration.rejected_steps += 1;
                continue;
            }
            passed += length;
            if report.work_error_j < CALM * self.settings.step.work_error_max_j {
                self.step_units = (2 * self.step_units).min(longest);
            }
            let force_n: f64 = self.stepper.wrenches.iter().map(|wrench| wrench.force.z).sum();
            integration.vertical_force_max_n = integration.vertical_force_max_n.max(force_n);
            integration.steps += 1;
            integration.unconverged_steps += usize::from(!report.converged);
            integration.unconverged_contacts += usize::from(!report.contacts_converged);
            integration.saturated_drives_max = integration.saturated_drives_max.max(report.saturated_drives);
        }
        integration
    }

    /// Fills sensors and truth from the state.
    fn observe(&mut self, integration: Integration, stabiliser: StabiliserReport) {
        for foot in &mut self.feet {
            foot.complete();
        }
        let model = &self.model;
        let moving = forward_kinematics_velocity(model, &mut self.ws, &self.state.q, &self.state.v);
        let t_s = self.ticks as f64 * self.settings.step.control_period_s;
        let momentum = self.stepper.momentum(&self.state);
        let mass = model.total_mass_kg();
        let base_frame = model.base_frame();

        let mut feet = [FootTruth::default(); 2];
        let mut total = Wrench::zero();
        for (i, foot) in feet.iter_mut().enumerate() {
            let sole = moving.pose(self.sole_frames[i]);
            let wrench = self.stepper.wrenches[i];
            let ground_height_m = self.settings.ground.height_and_normal(sole.translation.x, sole.translation.y).0;
            let zmp = wrench.zmp(&sole.translation, ground_height_m);
            *foot = FootTruth { sole, ankle: moving.pose(self.legs[i].ankle), wrench, zmp, ground_height_m };
            total = total + wrench.about(&-sole.translation);
        }
        let ground_height_m = 0.5 * (feet[0].ground_height_m + feet[1].ground_height_m);
        let pushes: Vec3 = self.applied.iter().map(|push| push.force).sum();
        let strongest = self.applied.iter().max_by(|a, b| a.force.norm().total_cmp(&b.force.norm()));
        let push_point = strongest.map_or(Vec3::zeros(), |push| moving.pose(push.frame).translation);

        // Exact measurements.
        let exact = &mut self.exact;
        let X_WI = moving.pose(self.imu);
        let twist = moving.velocity(self.imu);
        let passed = if self.ticks == 0 { f64::INFINITY } else { self.settings.step.control_period_s };
        exact.t_s = t_s;
        exact.joint_positions.copy_from(&self.state.q.joints);
        exact.joint_rates.copy_from(&self.state.v.rows(model.base_dofs(), model.joint_count()));
        for (torque, drive) in exact.joint_torques.iter_mut().zip(self.stepper.drives()) {
            *torque = drive.motor_nm;
        }
        exact.acceleration = X_WI.rotation.tr_mul(&((twist.linear - self.imu_velocity) / passed - model.gravity()));
        exact.angular_velocity = X_WI.rotation.tr_mul(&twist.angular);
        exact.orientation = X_WI.rotation;
        self.imu_velocity = twist.linear;
        for ((measured, foot), leg) in exact.foot_wrenches.iter_mut().zip(&feet).zip(&self.legs) {
            let sensor = foot.ankle * leg.sensor_in_ankle;
            let about_sensor = foot.wrench.about(&(sensor.translation - foot.sole.translation));
            *measured = Wrench {
                force: sensor.rotation.tr_mul(&about_sensor.force),
                moment: sensor.rotation.tr_mul(&about_sensor.moment),
            };
        }
        self.sensors.measure(exact);

        let base_twist = moving.velocity(base_frame);
        let rest = &self.settings.rest;
        let resting = base_twist.linear.norm() < rest.base_speed_max_m_per_s
            && base_twist.angular.norm() < rest.base_rate_max_rad_per_s;
        self.resting_ticks = if resting && self.ticks > 0 { self.resting_ticks + 1 } else { 0 };
        if let Some(reason) = detect(&self.settings.fall, model, &moving, &self.links, &self.settings.ground) {
            self.fallen = Some(Fall { t_s, reason });
        }
        self.truth = Truth {
            t_s,
            base: moving.pose(base_frame),
            base_twist,
            com: momentum.com,
            com_velocity: momentum.linear / mass,
            com_acceleration: (total.force + pushes) / mass + model.gravity(),
            angular_momentum: momentum.angular,
            zmp: total.zmp(&Vec3::zeros(), ground_height_m),
            push_force: pushes,
            push_point,
            feet,
            energies: self.truth.energies,
            integration,
            stabiliser,
            limited_references: self.servo.limited_references(),
        };
        let (kinetic_j, potential_j) = self.energies();
        let initial_j = self.truth.energies.initial_j;
        self.truth.energies = Energies { kinetic_j, potential_j, initial_j, flows: self.flows };
    }

    /// Kinetic and potential energy (J).
    fn energies(&self) -> (f64, f64) {
        let M = self.stepper.mass_matrix();
        let kinetic =
            0.5 * M.row_iter().zip(self.state.v.iter()).map(|(row, v)| v * row.tr_dot(&self.state.v)).sum::<f64>();
        let com = self.stepper.momentum(&self.state).com;
        (kinetic, -self.model.total_mass_kg() * self.model.gravity().dot(&com))
    }
}

/// Every link but the feet and what moves with them.
fn links_off_the_ground(model: &Model, ankles: &[FrameIndex; 2]) -> Vec<FrameIndex> {
    let feet = ankles.map(|ankle| model.joint_above(ankle));
    // The link between the ankle's pitch and roll axes has its origin at the ankle too.
    let mut ws = Workspace::new(model);
    let placed = forward_kinematics(model, &mut ws, &model.neutral());
    let at_ankle = |frame: FrameIndex| {
        ankles.iter().any(|&ankle| (placed.pose(frame).translation - placed.pose(ankle).translation).norm() == 0.0)
    };
    (0..model.frames().len())
        .map(FrameIndex)
        .filter(|&frame| !feet.contains(&model.joint_above(frame)) && !at_ankle(frame))
        .collect()
}
