//! The base from measurements with noise, bias and delay.

use crate::support::{Joints, PERIOD_S, Walk, model, robot, settings, walk};
use multibody::{Model, Workspace, forward_kinematics, forward_kinematics_velocity};
use nalgebra::DVector;
use robot::Robot;
use spatial::{Mat3, Transform, Vec3, so3};
use state::observer::{Anchoring, BaseObserver, FootAnchor, Measurement, ObserverSettings, YawSource};
use std::collections::VecDeque;
use wholebody::{RobotState, WholeBody};

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Standard normal (Box and Muller).
    fn normal(&mut self) -> f64 {
        (-2.0 * self.unit().ln()).sqrt() * (std::f64::consts::TAU * self.unit()).cos()
    }

    fn vector(&mut self, sigma: f64) -> Vec3 {
        sigma * Vec3::new(self.normal(), self.normal(), self.normal())
    }
}

#[derive(Clone, Copy)]
struct Faults {
    encoder_rad: f64,
    rate_rad_per_s: f64,
    orientation_rad: f64,
    yaw_offset_rad: f64,
    yaw_drift_rad_per_s: f64,
    gyro_rad_per_s: f64,
    gyro_bias_rad_per_s: Vec3,
    delay_ticks: usize,
}

const NONE: Faults = Faults {
    encoder_rad: 0.0,
    rate_rad_per_s: 0.0,
    orientation_rad: 0.0,
    yaw_offset_rad: 0.0,
    yaw_drift_rad_per_s: 0.0,
    gyro_rad_per_s: 0.0,
    gyro_bias_rad_per_s: Vec3::new(0.0, 0.0, 0.0),
    delay_ticks: 0,
};

struct Sample {
    joints: DVector<f64>,
    rates: DVector<f64>,
    imu: Mat3,
    gyro: Vec3,
    feet: [FootAnchor; 2],
}

#[derive(Debug, Default)]
struct Errors {
    position: f64,
    rotation: f64,
    velocity: f64,
    bias: f64,
}

fn sample(
    model: &Model,
    ws: &mut Workspace,
    state: &RobotState,
    faults: &Faults,
    t_s: f64,
    random: &mut Random,
) -> (Mat3, Vec3) {
    let moving = forward_kinematics_velocity(model, ws, &state.q, &state.v);
    let imu = model.frame("imu").expect("HRP-4 has one");
    let rotation: Mat3 = moving.pose(imu).rotation;
    let yaw = faults.yaw_offset_rad + faults.yaw_drift_rad_per_s * t_s;
    let turn = random.vector(faults.orientation_rad);
    let w = moving.velocity(imu).angular;
    let gyro = rotation.tr_mul(&w) + faults.gyro_bias_rad_per_s + random.vector(faults.gyro_rad_per_s);
    (so3::exp(&turn) * so3::about_z(yaw) * rotation, gyro)
}

/// Largest errors over a walk, after the first two seconds.
fn observe(faults: Faults, yaw: YawSource, compensated: bool) -> Errors {
    observe_with(robot(), faults, yaw, compensated)
}

fn observe_with(robot: Robot, faults: Faults, yaw: YawSource, compensated: bool) -> Errors {
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let ankle_links = [settings.feet[0].ankle_link.clone(), settings.feet[1].ankle_link.clone()];
    let delay_s = if compensated { faults.delay_ticks as f64 * PERIOD_S } else { 0.0 };
    let observer_settings = ObserverSettings {
        imu_link: "imu".to_owned(),
        ankle_links,
        yaw,
        bias_time_s: 1.0,
        velocity_time_s: if faults.rate_rad_per_s > 0.0 { 0.01 } else { 0.0 },
        delay_s,
    };
    let mut observer = BaseObserver::new(model.clone(), observer_settings).expect("names fit");
    let mut body = WholeBody::new(model.clone(), settings).expect("settings fit");
    let mut ws = Workspace::new(&model);
    let mut random = Random(5);
    let mut queue = VecDeque::new();
    let mut errors = Errors::default();
    walk(&Walk::straight(4), &mut body, PERIOD_S, |tick, state, reference, _| {
        let (imu, gyro) = sample(&model, &mut ws, state, &faults, tick as f64 * PERIOD_S, &mut random);
        let spoil = |x: f64, sigma: f64, random: &mut Random| x + sigma * random.normal();
        queue.push_back(Sample {
            joints: state.q.joints.map(|x| spoil(x, faults.encoder_rad, &mut random)),
            rates: DVector::from_fn(model.joint_count(), |i, _| {
                spoil(state.v[6 + i], faults.rate_rad_per_s, &mut random)
            }),
            imu,
            gyro,
            feet: reference.feet.map(|foot| FootAnchor {
                in_contact: foot.in_contact,
                load_share: foot.load_share,
                ankle_pose: foot.ankle_pose,
                ankle_twist: foot.ankle_twist,
            }),
        });
        if queue.len() <= faults.delay_ticks {
            return;
        }
        let late = queue.pop_front().expect("not empty");
        let measurement = Measurement {
            joints: &late.joints,
            joint_rates: &late.rates,
            imu_rotation: late.imu,
            gyro: late.gyro,
            feet: late.feet,
        };
        let estimate = observer.update(&measurement, PERIOD_S);
        assert_eq!(estimate.anchoring, Anchoring::Feet);
        if tick as f64 * PERIOD_S < 2.0 {
            return;
        }
        let truth: Transform = state.q.base;
        errors.position = errors.position.max((estimate.pose.translation - truth.translation).norm());
        errors.rotation = errors.rotation.max(so3::log(&(estimate.pose.rotation * truth.rotation.transpose())).norm());
        let v: Vec3 = state.v.fixed_rows::<3>(0).into();
        errors.velocity = errors.velocity.max((estimate.twist.linear - v).norm());
        errors.bias = (estimate.gyro_bias - faults.gyro_bias_rad_per_s).norm();
    });
    errors
}

#[test]
fn exact_measurements_give_the_base_as_exactly_as_the_feet_follow_their_anchors() {
    let errors = observe(NONE, YawSource::Legs, true);
    // The anchors are references; the ankles follow them to some micrometres.
    assert!(errors.position < 1e-4 && errors.rotation < 2e-4, "{errors:?}");
    assert!(errors.velocity < 5e-3, "{errors:?}");
}

/// About twice what HRP-4's encoders and a good inertial unit show.
const NOISY: Faults = Faults {
    encoder_rad: 2e-4,
    rate_rad_per_s: 0.02,
    orientation_rad: 1e-3,
    gyro_rad_per_s: 5e-3,
    gyro_bias_rad_per_s: Vec3::new(0.01, -0.02, 0.015),
    ..NONE
};

#[test]
fn noise_and_bias_leave_millimetres() {
    let errors = observe(NOISY, YawSource::Legs, true);
    assert!(errors.position < 5e-3, "{errors:?}");
    assert!(errors.rotation < 6e-3, "{errors:?}");
    assert!(errors.velocity < 0.06, "{errors:?}");
    // The bias was 0.027 rad/s.
    assert!(errors.bias < 0.01, "{errors:?}");
}

#[test]
fn noise_bias_drift_and_a_delay_of_20_ms_together_leave_millimetres() {
    let faults = Faults { delay_ticks: 4, yaw_drift_rad_per_s: 0.005, ..NOISY };
    let carried = observe(faults, YawSource::Legs, true);
    let plain = observe(faults, YawSource::Legs, false);
    // As much as noise and bias alone leave: the delay costs nothing when it is carried forward.
    assert!(carried.position < 4e-3 && carried.rotation < 6e-3, "{carried:?}");
    assert!(carried.velocity < 0.06, "{carried:?}");
    // A drifting yaw looks like a bias of the gyro to whoever compares the two.
    assert!(carried.bias < 0.005 + 0.005, "{carried:?}");
    // And without carrying forward the delay is what matters most.
    assert!(plain.position > 1.5 * carried.position, "{plain:?} against {carried:?}");
}

#[test]
fn yaw_of_the_legs_does_not_drift_with_the_inertial_unit() {
    let faults = Faults { yaw_drift_rad_per_s: 0.02, ..NONE };
    let legs = observe(faults, YawSource::Legs, true);
    let unit = observe(faults, YawSource::InertialUnit, true);
    assert!(legs.rotation < 1e-3, "{legs:?}");
    assert!(unit.rotation > 0.05, "{unit:?}");
}

#[test]
fn whatever_the_inertial_unit_calls_north_the_legs_say_where_the_robot_faces() {
    let exact = observe(NONE, YawSource::Legs, true);
    // At half a round the two feet may see it on either side.
    for yaw_offset_rad in [2.1, -std::f64::consts::FRAC_PI_2, std::f64::consts::PI] {
        let turned = observe(Faults { yaw_offset_rad, ..NONE }, YawSource::Legs, true);
        assert!(turned.rotation < 2.0 * exact.rotation, "{turned:?} {exact:?}");
        assert!(
            turned.position < 2.0 * exact.position && turned.velocity < 2.0 * exact.velocity,
            "{turned:?} {exact:?}"
        );
    }
}

#[test]
fn an_inertial_unit_that_is_mounted_turned_says_the_same_of_the_base() {
    // HRP-4's own axes are those of its body; here the unit's x axis points to the left and down.
    let mut turned = robot();
    let mount = "<origin xyz=\"-0.0325 0 0.1095\"/>";
    let other = "<origin xyz=\"-0.0325 0 0.1095\" rpy=\"0.4 -0.9 2.0\"/>";
    assert_eq!(turned.urdf.matches(mount).count(), 1);
    turned.urdf = turned.urdf.replace(mount, other);
    let model = model(&turned, Joints::Walking);
    let mut ws = Workspace::new(&model);
    let placed = forward_kinematics(&model, &mut ws, &model.neutral());
    let rotation = placed.pose(model.frame("imu").expect("it has one")).rotation;
    assert!(so3::log(&rotation).norm() > 1.5, "the unit is turned");
    for yaw in [YawSource::Legs, YawSource::InertialUnit] {
        let plain = observe(NONE, yaw, true);
        let found = observe_with(turned.clone(), NONE, yaw, true);
        for (found, plain) in [
            (found.position, plain.position),
            (found.rotation, plain.rotation),
            (found.velocity, plain.velocity),
            (found.bias, plain.bias),
        ] {
            assert!((found - plain).abs() < 1e-9 + 1e-6 * plain, "{yaw:?}: {found} {plain}");
        }
    }
}

#[test]
fn a_delay_of_20_ms_is_carried_forward() {
    let faults = Faults { delay_ticks: 4, ..NONE };
    let plain = observe(faults, YawSource::Legs, false);
    let carried = observe(faults, YawSource::Legs, true);
    assert!(plain.position > 2e-3, "{plain:?}");
    // Position: half of the acceleration, 0.5 m/s², times the square of 20 ms; velocity: that acceleration times 20 ms.
    assert!(carried.position < 2e-4 && carried.rotation < 4e-4, "{carried:?} against {plain:?}");
    assert!(carried.velocity < 0.015, "{carried:?}");
}

#[test]
fn without_feet_the_base_moves_on_and_says_so() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let feet = &robot.description.feet;
    let settings = ObserverSettings {
        imu_link: "imu".to_owned(),
        ankle_links: [feet.left.ankle_frame.clone(), feet.right.ankle_frame.clone()],
        yaw: YawSource::Legs,
        bias_time_s: 5.0,
        velocity_time_s: 0.0,
        delay_s: 0.0,
    };
    let mut observer = BaseObserver::new(model.clone(), settings).expect("names fit");
    let joints = DVector::zeros(model.joint_count());
    let pose = Transform::from_translation(Vec3::new(0.0, 0.08, 0.1));
    let standing = FootAnchor {
        in_contact: true,
        load_share: 1.0,
        ankle_pose: pose,
        ankle_twist: spatial::Twist { linear: Vec3::new(0.3, 0.0, 0.0), angular: Vec3::zeros() },
    };
    let flying = FootAnchor { in_contact: false, ..standing };
    let measurement = |feet| Measurement {
        joints: &joints,
        joint_rates: &joints,
        imu_rotation: Mat3::identity(),
        gyro: Vec3::zeros(),
        feet,
    };
    let start = observer.update(&measurement([standing, flying]), PERIOD_S).pose.translation;
    for _ in 0..20 {
        observer.update(&measurement([flying, flying]), PERIOD_S);
    }
    let estimate = observer.estimate();
    assert_eq!(estimate.anchoring, Anchoring::None);
    assert!((estimate.pose.translation - start - Vec3::new(0.03, 0.0, 0.0)).norm() < 1e-12);
}

#[test]
fn a_jump_of_the_orientation_teaches_no_bias_wherever_it_leads() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let ankle_links = [settings.feet[0].ankle_link.clone(), settings.feet[1].ankle_link.clone()];
    let joints = model.neutral().joints;
    let rates = DVector::zeros(joints.len());
    let foot = FootAnchor {
        in_contact: true,
        load_share: 0.5,
        ankle_pose: Transform::identity(),
        ankle_twist: spatial::Twist::zero(),
    };
    let about_x = |angle: f64| so3::exp(&Vec3::new(angle, 0.0, 0.0));
    let about_z = so3::about_z(std::f64::consts::PI);
    // Upside down, from and back to either side of the upright, where half a turn has no sign of its own; and a heading set anew.
    for (before, there, after) in [
        (about_x(1e-3), about_x(std::f64::consts::PI), about_x(1e-3)),
        (about_x(1e-3), about_x(std::f64::consts::PI), about_x(-1e-3)),
        (about_x(1e-3), about_z, about_z),
    ] {
        let observer_settings = ObserverSettings {
            imu_link: "imu".to_owned(),
            ankle_links: ankle_links.clone(),
            yaw: YawSource::Legs,
            bias_time_s: 5.0,
            velocity_time_s: 0.0,
            delay_s: 0.0,
        };
        let mut observer = BaseObserver::new(model.clone(), observer_settings).expect("names fit");
        for tick in 0..80 {
            let imu_rotation = if tick < 20 { before } else { [there, after][usize::from(tick >= 60)] };
            let measurement = Measurement {
                joints: &joints,
                joint_rates: &rates,
                imu_rotation,
                gyro: Vec3::zeros(),
                feet: [foot; 2],
            };
            let estimate = observer.update(&measurement, PERIOD_S);
            // A sound unit at rest has none at all.
            assert!(estimate.gyro_bias.norm() < 1e-12, "tick {tick}: {}", estimate.gyro_bias);
        }
    }
}
