//! What the robot measures of itself: encoders, an inertial unit in the body, a six-axis force sensor in each foot.
//!
//! Exact by default. Noise (white, normal), bias (constant over a run) and delay (whole ticks) are settings; all randomness
//! comes from one seed. The accelerometer gives the mean proper acceleration over the last control period, which is what a
//! sampled sensor with its anti-aliasing filter gives; everything else is the value at the tick.
//!
//! *Not modelled*: the weight and inertia of the 1.4 kg of foot below the force sensor (the wrench is the ground's), drift of
//! the orientation estimate, saturation, quantisation.

use nalgebra::DVector;
use ranges::{OutOfRange, Range};
use serde::{Deserialize, Serialize};
use spatial::{Mat3, Vec3, Wrench, so3};
use std::f64::consts::PI;

use crate::noise::Noise;

/// Longest delay (ticks): its samples are kept.
const DELAY_MAX_TICKS: usize = 1000;

/// Errors of the sensors; all zero by default. Noise is a standard deviation per tick, bias a constant per axis.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorSettings {
    /// Seed of all noise.
    pub seed: u64,
    /// Age of everything that is measured, in control periods.
    pub delay_ticks: usize,
    /// Encoder noise (rad).
    pub joint_noise_rad: f64,
    /// Noise of the joint rates (rad/s).
    pub joint_rate_noise_rad_per_s: f64,
    /// Accelerometer noise (m/s^2).
    pub acceleration_noise_m_per_s2: f64,
    /// Accelerometer bias in the sensor's axes (m/s^2).
    pub acceleration_bias_m_per_s2: [f64; 3],
    /// Gyrometer noise (rad/s).
    pub gyro_noise_rad_per_s: f64,
    /// Gyrometer bias in the sensor's axes (rad/s).
    pub gyro_bias_rad_per_s: [f64; 3],
    /// Noise of the orientation estimate (rad, per axis).
    pub orientation_noise_rad: f64,
    /// Error of the orientation estimate as a rotation vector in world axes (rad): a robot that feels itself upright when
    /// it is not.
    pub orientation_bias_rad: [f64; 3],
    /// Force noise of the feet (N).
    pub foot_force_noise_n: f64,
    /// Moment noise of the feet (N m).
    pub foot_moment_noise_nm: f64,
    /// Force bias, left and right foot (N).
    pub foot_force_bias_n: [[f64; 3]; 2],
    /// Moment bias, left and right foot (N m).
    pub foot_moment_bias_nm: [[f64; 3]; 2],
    /// Coupling fault seen on real sensors: vertical force measured per true roll and pitch moment (N per N m).
    pub foot_vertical_force_per_moment_n_per_nm: [f64; 2],
}

impl SensorSettings {
    pub(crate) fn check(&self) -> Result<(), OutOfRange> {
        const NOISE_REMEDY: &str = "a standard deviation per tick; 0 is exact";
        for (name, value, most) in [
            ("joint_noise_rad", self.joint_noise_rad, 1.0),
            ("joint_rate_noise_rad_per_s", self.joint_rate_noise_rad_per_s, 100.0),
            ("acceleration_noise_m_per_s2", self.acceleration_noise_m_per_s2, 1000.0),
            ("gyro_noise_rad_per_s", self.gyro_noise_rad_per_s, 100.0),
            ("orientation_noise_rad", self.orientation_noise_rad, 1.0),
            ("foot_force_noise_n", self.foot_force_noise_n, 1e4),
            ("foot_moment_noise_nm", self.foot_moment_noise_nm, 1e3),
        ] {
            Range::between(0.0, most).demand(format!("sensors.{name}"), value, NOISE_REMEDY)?;
        }
        let delay = Range::between(0.0, DELAY_MAX_TICKS as f64);
        delay.demand("sensors.delay_ticks", self.delay_ticks as f64, "some ticks at most are usual")?;
        for (name, bias, size) in [
            ("acceleration_bias_m_per_s2", self.acceleration_bias_m_per_s2, 1000.0),
            ("gyro_bias_rad_per_s", self.gyro_bias_rad_per_s, 100.0),
            ("orientation_bias_rad", self.orientation_bias_rad, PI),
            ("foot_force_bias_n[0]", self.foot_force_bias_n[0], 1e4),
            ("foot_force_bias_n[1]", self.foot_force_bias_n[1], 1e4),
            ("foot_moment_bias_nm[0]", self.foot_moment_bias_nm[0], 1e3),
            ("foot_moment_bias_nm[1]", self.foot_moment_bias_nm[1], 1e3),
        ] {
            Range::within(size).demand_each(&format!("sensors.{name}"), &bias, "a constant per axis; 0 is exact")?;
        }
        let coupling = &self.foot_vertical_force_per_moment_n_per_nm;
        Range::within(1e3).demand_each("sensors.foot_vertical_force_per_moment_n_per_nm", coupling, "0 is exact")
    }
}

/// One sample of everything the robot measures.
#[derive(Debug, Clone, PartialEq)]
pub struct PlantSensors {
    /// When it was sampled, in time since [`crate::Plant::place`] (s).
    pub t_s: f64,
    /// Joint positions in the model's order (rad).
    pub joint_positions: DVector<f64>,
    /// Joint rates (rad/s).
    pub joint_rates: DVector<f64>,
    /// Torque the drives apply (N m). HRP-4 does not measure it; it is here for logs.
    pub joint_torques: DVector<f64>,
    /// Proper acceleration (acceleration less gravity) of the sensor, in its axes (m/s^2).
    pub acceleration: Vec3,
    /// Angular velocity of the sensor in its axes (rad/s).
    pub angular_velocity: Vec3,
    /// Orientation estimate `R_WI` of the sensor.
    pub orientation: Mat3,
    /// Wrench of the ground on each foot about the force sensor's origin, in its axes.
    pub foot_wrenches: [Wrench; 2],
}

impl PlantSensors {
    /// All zero, orientation identity.
    #[must_use]
    pub fn zero(joint_count: usize) -> Self {
        Self {
            t_s: 0.0,
            joint_positions: DVector::zeros(joint_count),
            joint_rates: DVector::zeros(joint_count),
            joint_torques: DVector::zeros(joint_count),
            acceleration: Vec3::zeros(),
            angular_velocity: Vec3::zeros(),
            orientation: Mat3::identity(),
            foot_wrenches: [Wrench::zero(); 2],
        }
    }

    fn copy_from(&mut self, other: &Self) {
        self.t_s = other.t_s;
        self.joint_positions.copy_from(&other.joint_positions);
        self.joint_rates.copy_from(&other.joint_rates);
        self.joint_torques.copy_from(&other.joint_torques);
        self.acceleration = other.acceleration;
        self.angular_velocity = other.angular_velocity;
        self.orientation = other.orientation;
        self.foot_wrenches = other.foot_wrenches;
    }
}

/// Makes measurements of exact values: errors and delay.
#[derive(Debug, Clone)]
pub struct SensorBank {
    settings: SensorSettings,
    noise: Noise,
    /// The last `delay_ticks + 1` samples, a ring.
    samples: Vec<PlantSensors>,
    newest: usize,
    filled: bool,
}

impl SensorBank {
    /// A bank for a robot with this many joints.
    #[must_use]
    pub fn new(settings: SensorSettings, joint_count: usize) -> Self {
        let samples = vec![PlantSensors::zero(joint_count); settings.delay_ticks + 1];
        Self { settings, noise: Noise::from_seed(settings.seed), samples, newest: 0, filled: false }
    }

    /// Starts anew: the same seed gives the same run.
    pub fn restart(&mut self) {
        self.noise = Noise::from_seed(self.settings.seed);
        self.filled = false;
    }

    /// Takes the exact values of this tick, gives the measured ones (of `delay_ticks` ago; the first sample stands for
    /// times before it).
    pub fn measure(&mut self, exact: &PlantSensors) -> &PlantSensors {
        self.newest = (self.newest + 1) % self.samples.len();
        let newest = self.newest;
        self.samples[newest].copy_from(exact);
        add_errors(&self.settings, &mut self.noise, &mut self.samples[newest]);
        if !self.filled {
            self.filled = true;
            let (first, rest) = self.samples.split_at_mut(newest);
            if let Some((sample, after)) = rest.split_first_mut() {
                first.iter_mut().chain(after).for_each(|s| s.copy_from(sample));
            }
        }
        self.current()
    }

    /// The last measurement again.
    #[must_use]
    pub fn current(&self) -> &PlantSensors {
        &self.samples[(self.newest + 1) % self.samples.len()]
    }
}

fn add_errors(settings: &SensorSettings, noise: &mut Noise, sample: &mut PlantSensors) {
    let white =
        |noise: &mut Noise, deviation: f64| if deviation > 0.0 { deviation * noise.normal3() } else { Vec3::zeros() };
    for (deviation, values) in [
        (settings.joint_noise_rad, &mut sample.joint_positions),
        (settings.joint_rate_noise_rad_per_s, &mut sample.joint_rates),
    ] {
        if deviation > 0.0 {
            values.iter_mut().for_each(|value| *value += deviation * noise.normal());
        }
    }
    sample.acceleration +=
        Vec3::from(settings.acceleration_bias_m_per_s2) + white(noise, settings.acceleration_noise_m_per_s2);
    sample.angular_velocity += Vec3::from(settings.gyro_bias_rad_per_s) + white(noise, settings.gyro_noise_rad_per_s);
    let turned = Vec3::from(settings.orientation_bias_rad) + white(noise, settings.orientation_noise_rad);
    if turned != Vec3::zeros() {
        sample.orientation = so3::exp(&turned) * sample.orientation;
    }
    for (foot, wrench) in sample.foot_wrenches.iter_mut().enumerate() {
        let [per_roll, per_pitch] = settings.foot_vertical_force_per_moment_n_per_nm;
        let coupled = per_roll * wrench.moment.x + per_pitch * wrench.moment.y;
        wrench.force += Vec3::from(settings.foot_force_bias_n[foot]) + white(noise, settings.foot_force_noise_n);
        wrench.force.z += coupled;
        wrench.moment += Vec3::from(settings.foot_moment_bias_nm[foot]) + white(noise, settings.foot_moment_noise_nm);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exact(t_s: f64) -> PlantSensors {
        let mut sample = PlantSensors::zero(3);
        sample.t_s = t_s;
        sample.joint_positions.fill(t_s);
        sample.foot_wrenches[0] = Wrench { force: Vec3::new(0.0, 0.0, 190.0), moment: Vec3::new(2.0, -1.0, 0.0) };
        sample
    }

    #[test]
    fn sensors_are_exact_unless_told_otherwise() {
        let mut bank = SensorBank::new(SensorSettings::default(), 3);
        for k in 0..5 {
            assert_eq!(bank.measure(&exact(f64::from(k))), &exact(f64::from(k)));
        }
    }

    #[test]
    fn delay_counts_whole_ticks() {
        let mut bank = SensorBank::new(SensorSettings { delay_ticks: 2, ..Default::default() }, 3);
        let seen: Vec<f64> = (0..6).map(|k| bank.measure(&exact(f64::from(k))).t_s).collect();
        assert_eq!(seen, [0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
        assert_eq!(bank.current().t_s, 3.0);
    }

    #[test]
    fn noise_has_the_stated_deviation_and_repeats_with_its_seed() {
        let settings = SensorSettings { seed: 5, joint_noise_rad: 0.02, ..Default::default() };
        let run = |settings| {
            let mut bank = SensorBank::new(settings, 3);
            (0..20_000)
                .flat_map(|_| bank.measure(&exact(1.0)).joint_positions.iter().copied().collect::<Vec<_>>())
                .collect::<Vec<_>>()
        };
        let values = run(settings);
        let variance = values.iter().map(|v| (v - 1.0f64).powi(2)).sum::<f64>() / values.len() as f64;
        // Three standard errors of a sample deviation over 60,000 values: 0.87 %.
        assert!((variance.sqrt() / 0.02 - 1.0).abs() < 0.0087);
        assert_eq!(values, run(settings));
        assert_ne!(values, run(SensorSettings { seed: 6, ..settings }));
    }

    #[test]
    fn bias_and_coupling_enter_where_they_are_named() {
        let settings = SensorSettings {
            orientation_bias_rad: [0.01, 0.0, 0.0],
            foot_force_bias_n: [[1.0, 2.0, 3.0], [0.0; 3]],
            foot_vertical_force_per_moment_n_per_nm: [5.0, 0.0],
            ..Default::default()
        };
        let mut bank = SensorBank::new(settings, 3);
        let measured = bank.measure(&exact(0.0));
        assert!((so3::log(&measured.orientation) - Vec3::new(0.01, 0.0, 0.0)).norm() < 1e-15);
        assert_eq!(measured.foot_wrenches[0].force, Vec3::new(1.0, 2.0, 203.0));
        assert_eq!(measured.foot_wrenches[1], Wrench::zero());
    }

    #[test]
    fn every_error_disturbs_its_own_sensor_by_its_own_amount() {
        // Turned by a quarter about x: an orientation's error is in world axes, the others' in the sensor's.
        let mut sample = exact(0.0);
        sample.orientation = so3::about_x(std::f64::consts::FRAC_PI_2);
        let settings = SensorSettings {
            acceleration_bias_m_per_s2: [0.1, 0.2, 0.3],
            gyro_bias_rad_per_s: [0.4, 0.5, 0.6],
            orientation_bias_rad: [0.0, 0.0, 0.01],
            foot_moment_bias_nm: [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
            foot_vertical_force_per_moment_n_per_nm: [5.0, 7.0],
            ..Default::default()
        };
        let mut bank = SensorBank::new(settings, 3);
        let measured = bank.measure(&sample);
        assert_eq!(measured.acceleration, Vec3::new(0.1, 0.2, 0.3));
        assert_eq!(measured.angular_velocity, Vec3::new(0.4, 0.5, 0.6));
        let error = measured.orientation * sample.orientation.transpose();
        assert!((so3::log(&error) - Vec3::new(0.0, 0.0, 0.01)).norm() < 1e-15);
        // The coupling is with the true moment, 2 N m and -1 N m.
        assert_eq!(measured.foot_wrenches[0].force.z, 190.0 + 5.0 * 2.0 - 7.0);
        assert_eq!(measured.foot_wrenches[0].moment, Vec3::new(3.0, 1.0, 3.0));
        assert_eq!(measured.foot_wrenches[1].moment, Vec3::new(4.0, 5.0, 6.0));

        // Noise of one kind at a time: only its own sensor scatters, as much as is said.
        type Values = fn(&PlantSensors) -> Vec3;
        let kinds: [(SensorSettings, Values); 5] = [
            (SensorSettings { acceleration_noise_m_per_s2: 0.3, ..Default::default() }, |s| s.acceleration),
            (SensorSettings { gyro_noise_rad_per_s: 0.3, ..Default::default() }, |s| s.angular_velocity),
            (SensorSettings { orientation_noise_rad: 0.3, ..Default::default() }, |s| so3::log(&s.orientation)),
            (SensorSettings { foot_force_noise_n: 0.3, ..Default::default() }, |s| s.foot_wrenches[1].force),
            (SensorSettings { foot_moment_noise_nm: 0.3, ..Default::default() }, |s| s.foot_wrenches[1].moment),
        ];
        for (kind, (settings, _)) in kinds.iter().enumerate() {
            let mut bank = SensorBank::new(*settings, 3);
            let mut squares = [0.0; 5];
            let samples = 5000;
            for _ in 0..samples {
                let measured = bank.measure(&exact(0.0));
                for (square, (_, values)) in squares.iter_mut().zip(&kinds) {
                    *square += values(measured).norm_squared() / f64::from(3 * samples);
                }
            }
            for (other, square) in squares.iter().enumerate() {
                let expected = if other == kind { 0.3 } else { 0.0 };
                // Three standard errors of a deviation over 15,000 values: 1.7 %.
                assert!((square.sqrt() - expected).abs() <= 0.017 * expected, "kind {kind} in {other}: {square}");
            }
        }
    }
}
