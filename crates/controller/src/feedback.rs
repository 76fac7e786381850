//! What the robot measures, made into a state that the own one can be drawn towards.
//!
//! A measurement is used when it is one of a robot that stands where the plan has it: newer than the last one, without a fault that the
//! driver reports, finite, joints and rates near what they may be, an orientation that is one, and a base within
//! `integration.distance_max_m` and `distance_max_rad` of the own one. Otherwise the step goes on from its own state alone (soles go on yielding),
//! until a good measurement comes; each one that is not used is counted, with the reason ([`Refused`]).
//!
//! **Time.** The command of tick `k` holds references for `k + 1`; the drives' ramp reaches them at `k + 2`. So the robot is one tick behind
//! the plan, beside the age of its measurements: joints are anchored at the soles of that earlier tick, and the base is carried forward
//! by as much.

use messages::{CONTROL_PERIOD_S, RobotState as StateMessage, SoleDeformation};
use multibody::{Model, ModelError};
use nalgebra::DVector;
use robot::JointMap;
use spatial::{Vec3, Wrench, so3};
use std::collections::VecDeque;
use std::fmt;
use wholebody::observer::{BaseEstimate, BaseObserver, FootAnchor, Measurement, ObserverSettings};
use wholebody::{FootTarget, RobotState, SoleYield};

use crate::convert::{foot_anchor, loaded_sole, unit_rotation};
use crate::integration::IntegrationSettings;

/// Ticks by which the robot is behind the plan: the drives' ramp.
const RAMP_TICKS: usize = 1;
/// How far beyond its limits a joint may be measured (rad): encoders have offsets, limits have margins.
const JOINT_BEYOND_LIMIT_MAX_RAD: f64 = 0.1;
/// How much faster than its limit a joint may be measured: rates are noisy, and pushes are quick.
const JOINT_RATE_FACTOR_MAX: f64 = 2.0;
/// Fastest turn that is believed (rad/s): the usual range of gyros, 2000 degrees/s.
const GYRO_MAX_RAD_PER_S: f64 = 35.0;
/// Soles known of this many ticks before stand in for those of a tick whose deformation did not come: as long as the controller goes on
/// without one.
const SOLES_AGE_MAX_TICKS: i64 = 2;

/// Why a measurement is not used for feedback.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Refused {
    /// A number is not finite.
    NotFinite,
    /// The driver says that a sensor is faulty.
    SensorFault,
    /// Not newer than the one before.
    Stale,
    /// A joint is where it cannot be, or as fast as it cannot be.
    Joint,
    /// The orientation is none: its quaternion does not have length 1.
    Orientation,
    /// The gyro says more than any gyro can.
    Gyro,
    /// No deformation of the soles is known of its time.
    Soles,
    /// The base would be too far from the own one.
    Distance,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a number is not finite",
            Self::SensorFault => "a sensor is reported faulty",
            Self::Stale => "it is not newer than the one before",
            Self::Joint => "a joint is where, or as fast as, it cannot be",
            Self::Orientation => "the orientation's quaternion does not have length 1",
            Self::Gyro => "the gyro says more than any gyro can",
            Self::Soles => "where the soles were at its time is not known",
            Self::Distance => {
                "the base would be farther from its plan than integration.distance_max_m or distance_max_rad"
            }
        })
    }
}

/// The observer with what it needs to know of the past.
pub(crate) struct Feedback {
    settings: IntegrationSettings,
    observer: BaseObserver,
    soles: [SoleYield; 2],
    /// Ticks by which what arrives is older than the plan's present.
    behind_ticks: usize,
    /// The feet of the last ticks, oldest first: one that is needed, or the last before it, and the later ones.
    anchors: VecDeque<(i64, [FootAnchor; 2])>,
    measured: RobotState,
    joint_rates: DVector<f64>,
    last_tick: Option<i64>,
}

impl Feedback {
    pub fn new(
        settings: &IntegrationSettings,
        model: &Model,
        imu_link: &str,
        ankle_links: [String; 2],
    ) -> Result<Self, ModelError> {
        let behind_ticks = settings.measurement_delay_ticks as usize + RAMP_TICKS;
        let observer_settings = ObserverSettings {
            imu_link: imu_link.to_owned(),
            ankle_links,
            yaw: settings.yaw.into(),
            bias_time_s: settings.gyro_bias_time_s,
            velocity_time_s: settings.velocity_time_s,
            delay_s: behind_ticks as f64 * CONTROL_PERIOD_S,
        };
        Ok(Self {
            settings: *settings,
            observer: BaseObserver::new(model.clone(), observer_settings)?,
            soles: [SoleYield::new(settings.sole_yield()); 2],
            behind_ticks,
            anchors: VecDeque::with_capacity(behind_ticks + 2),
            measured: RobotState { q: model.neutral(), v: DVector::zeros(model.nv()) },
            joint_rates: DVector::zeros(model.joint_count()),
            last_tick: None,
        })
    }

    /// The last estimate of the base.
    pub fn estimate(&self) -> &BaseEstimate {
        self.observer.estimate()
    }

    /// Forgets where the soles were: another walk is to be walked.
    pub fn restart(&mut self) {
        self.anchors.clear();
        self.soles = [SoleYield::new(self.settings.sole_yield()); 2];
    }

    /// Remembers where the soles are, whatever is measured. Ticks may be missing, and the last deformation may come again.
    pub fn remember(&mut self, deformation: &SoleDeformation) {
        let tick = deformation.header.tick;
        if self.anchors.back().is_some_and(|(last, _)| *last >= tick) {
            return;
        }
        let needed_tick = tick.saturating_sub(self.behind_ticks as i64);
        while self.anchors.get(1).is_some_and(|(next, _)| *next <= needed_tick) {
            self.anchors.pop_front();
        }
        self.anchors.push_back((tick, deformation.feet.each_ref().map(foot_anchor)));
    }

    /// Where the feet were when the robot was as it is measured at this tick: at the last tick up to then, or, when there is no past, at
    /// the first one. `None` if that was long before.
    fn anchors_at(&self, measured_tick: i64) -> Option<[FootAnchor; 2]> {
        let tick = measured_tick.saturating_sub(self.behind_ticks as i64);
        let known = self.anchors.iter().rev().find(|(at, _)| *at <= tick).or(self.anchors.front());
        known.filter(|(at, _)| tick.saturating_sub(*at) <= SOLES_AGE_MAX_TICKS).map(|(_, feet)| *feet)
    }

    /// The measured state, carried forward to the present tick. `own` is the state it should be near.
    pub fn observe(
        &mut self,
        model: &Model,
        joints: &JointMap,
        message: &StateMessage,
        own: &RobotState,
    ) -> Result<&RobotState, Refused> {
        let tick = message.header.tick;
        let ticks = self.last_tick.map_or(1, |last| tick - last);
        if ticks <= 0 {
            return Err(Refused::Stale);
        }
        if message.fault_bits != 0 {
            return Err(Refused::SensorFault);
        }
        joints.from_interface(&message.joint_position_rad, self.measured.q.joints.as_mut_slice());
        joints.from_interface(&message.joint_velocity_rad_per_s, self.joint_rates.as_mut_slice());
        for ((joint, position), rate) in model.joints().iter().zip(&self.measured.q.joints).zip(&self.joint_rates) {
            let limits = &joint.limits;
            let beyond = (position - limits.upper).max(limits.lower - position);
            if beyond > JOINT_BEYOND_LIMIT_MAX_RAD || rate.abs() > JOINT_RATE_FACTOR_MAX * limits.velocity {
                return Err(Refused::Joint);
            }
        }
        let imu_rotation = unit_rotation(message.imu_orientation_xyzw).ok_or(Refused::Orientation)?;
        let gyro = Vec3::from(message.gyro_rad_per_s);
        if gyro.norm() > GYRO_MAX_RAD_PER_S {
            return Err(Refused::Gyro);
        }
        let feet = self.anchors_at(tick).ok_or(Refused::Soles)?;
        let (positions, rates) = (&self.measured.q.joints, &self.joint_rates);
        let measurement = Measurement { joints: positions, joint_rates: rates, imu_rotation, gyro, feet };
        if ticks > 1 {
            // One reading of the gyro says nothing of a turn over several ticks.
            self.observer.forget_rotation();
        }
        let estimate = self.observer.update(&measurement, ticks as f64 * CONTROL_PERIOD_S);
        self.last_tick = Some(tick);
        let away_m = (estimate.pose.translation - own.q.base.translation).norm();
        let away_rad = so3::log(&(estimate.pose.rotation * own.q.base.rotation.transpose())).norm();
        if away_m > self.settings.distance_max_m || away_rad > self.settings.distance_max_rad {
            return Err(Refused::Distance);
        }
        self.measured.q.base = estimate.pose;
        let base = model.base_dofs();
        self.measured.v.rows_mut(0, base).copy_from(&estimate.twist.to_vector());
        self.measured.v.rows_mut(base, self.joint_rates.len()).copy_from(&self.joint_rates);
        Ok(&self.measured)
    }

    /// Moves the ankles as their soles give way under the wrenches that the last step computed, about the ankles; in the air they come
    /// back from it.
    pub fn move_ankles(&mut self, deformation: &SoleDeformation, computed: [Wrench; 2], feet: &mut [FootTarget; 2]) {
        for (i, foot) in feet.iter_mut().enumerate() {
            let sole = foot.in_contact.then(|| loaded_sole(&deformation.feet[i]));
            foot.ankle_pose = self.soles[i].update(sole.as_ref(), &computed[i], &foot.ankle_pose, CONTROL_PERIOD_S);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::Header;
    use robot::Robot;
    use robot_model::walking_model;
    use spatial::Transform;
    use std::path::Path;

    const ANKLE_SPEED_M_PER_S: f64 = 0.2;

    struct Bench {
        feedback: Feedback,
        model: Model,
        joints: JointMap,
        /// All joints in the middle of their ranges, at rest.
        message: StateMessage,
    }

    fn bench(settings: IntegrationSettings) -> Bench {
        let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4")).expect("it ships");
        let (model, joints) = walking_model(&robot).expect("it ships");
        let feet = &robot.description.feet;
        let ankles = [feet[0].ankle_frame.clone(), feet[1].ankle_frame.clone()];
        let feedback = Feedback::new(&settings, &model, &robot.description.imu_frame, ankles).expect("its frames");
        let mut message = StateMessage { header: Header::new(0, 1), ..Default::default() };
        message.imu_orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
        let middle: Vec<f64> = model.joints().iter().map(|j| 0.5 * (j.limits.lower + j.limits.upper)).collect();
        joints.to_interface(&middle, &mut message.joint_position_rad);
        Bench { feedback, model, joints, message }
    }

    /// Both soles at a tick: all ankles slide forwards together, one above the other.
    fn soles(tick: i64) -> SoleDeformation {
        let mut deformation = SoleDeformation { header: Header::new(tick, 1), ..Default::default() };
        for foot in &mut deformation.feet {
            foot.in_contact = 1;
            foot.load_share = 0.5;
            foot.ankle_position_m = [ANKLE_SPEED_M_PER_S * tick as f64 * CONTROL_PERIOD_S, 0.0, 0.1];
            foot.ankle_rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
            foot.ankle_twist[0] = ANKLE_SPEED_M_PER_S;
        }
        deformation
    }

    impl Bench {
        fn see(&mut self, tick: i64, own: &RobotState) -> Result<RobotState, Refused> {
            self.feedback.remember(&soles(tick));
            self.message.header.tick = tick;
            self.feedback.observe(&self.model, &self.joints, &self.message, own).cloned()
        }

        /// Where the base is said to be, whatever that is.
        fn base(&mut self) -> RobotState {
            let far = RobotState { q: self.model.neutral(), v: DVector::zeros(self.model.nv()) };
            let _ = self.see(0, &far);
            RobotState { q: multibody::Configuration { base: self.feedback.estimate().pose, ..far.q }, ..far }
        }
    }

    #[test]
    fn what_is_measured_late_is_anchored_where_the_soles_were_and_carried_forward_to_now() {
        let joints_apart = |delay: u32| {
            let mut bench = bench(IntegrationSettings {
                measurement_delay_ticks: delay,
                distance_max_m: 1.0,
                velocity_time_s: 0.0,
                ..Default::default()
            });
            let start = bench.base();
            let mut seen = start.clone();
            for tick in 1..20 {
                seen = bench.see(tick, &seen).expect("it is near the last one");
            }
            (seen.q.base.translation.x, start.q.base.translation.x, seen.v[0])
        };
        let (here, start, speed) = joints_apart(0);
        assert!((speed - ANKLE_SPEED_M_PER_S).abs() < 1e-12, "{speed}");
        // At the start there is no past: the first sole stands in, and the base is carried forward from it by the ramp's tick.
        let per_tick = ANKLE_SPEED_M_PER_S * CONTROL_PERIOD_S;
        assert!((here - (start - per_tick) - 19.0 * per_tick).abs() < 1e-12, "{here} {start}");
        let (late, ..) = joints_apart(3);
        assert!((late - here).abs() < 1e-12, "the delay is made up for: {late} {here}");
    }

    #[test]
    fn ticks_that_are_missed_and_soles_that_come_twice_shift_no_anchor() {
        let delay_ticks = 3;
        let per_tick = ANKLE_SPEED_M_PER_S * CONTROL_PERIOD_S;
        let mut bench = bench(IntegrationSettings {
            measurement_delay_ticks: delay_ticks,
            distance_max_m: 1.0,
            velocity_time_s: 0.0,
            ..Default::default()
        });
        // With a single sole there is no past: the base is carried forward from it by the delay and the ramp's tick.
        let own = bench.base();
        let start = own.q.base.translation.x - f64::from(delay_ticks + 1) * per_tick;
        let mut known = vec![0];
        for tick in 1..60 {
            // The controller misses a tick now and then, and sometimes the estimator does.
            if tick % 7 == 3 {
                continue;
            }
            let newest = if tick % 11 == 5 { tick - 1 } else { tick };
            known.push(newest);
            bench.feedback.remember(&soles(newest));
            bench.message.header.tick = tick;
            let seen = bench.feedback.observe(&bench.model, &bench.joints, &bench.message, &own);
            let x = seen.expect("near enough").q.base.translation.x;
            // The sole of the very tick, or the one before it.
            let at = (tick - i64::from(delay_ticks) - 1).max(0);
            let expected = known.iter().copied().filter(|known| *known <= at).max().expect("the first");
            let found = (x - start) / per_tick - f64::from(delay_ticks + 1);
            assert!((found - expected as f64).abs() < 1e-9, "tick {tick}: anchored at {found}, not {expected}");
            let capacity = bench.feedback.behind_ticks + 2;
            assert!(bench.feedback.anchors.len() <= capacity && bench.feedback.anchors.capacity() == capacity);
        }
    }

    #[test]
    fn soles_of_long_before_anchor_nothing() {
        let mut bench = bench(IntegrationSettings { distance_max_m: 1.0, ..Default::default() });
        let own = bench.base();
        let mut see = |soles_tick: i64, tick: i64| {
            bench.feedback.remember(&soles(soles_tick));
            bench.message.header.tick = tick;
            bench.feedback.observe(&bench.model, &bench.joints, &bench.message, &own).err()
        };
        for tick in 1..10 {
            assert_eq!(see(tick, tick), None, "tick {tick}");
        }
        // Those of tick 9 stand in for two more, beside the one by which the robot is behind.
        for (tick, refused) in [(10, None), (12, None), (13, Some(Refused::Soles))] {
            assert_eq!(see(9, tick), refused, "tick {tick}");
        }
        // After a gap the newest are too new for what is measured now, the last ones too old.
        assert_eq!([see(100, 100), see(101, 101)], [Some(Refused::Soles), None]);
        assert_eq!(see(i64::MAX, 102), None);
    }

    #[test]
    fn an_ankle_follows_its_sole_and_comes_back_in_the_air_and_another_walk_begins_without() {
        let settings = IntegrationSettings::default();
        let mut feedback = bench(settings).feedback;
        let mut loaded = soles(0);
        for foot in &mut loaded.feet {
            foot.wrench[2] = 200.0;
            foot.compliance[14] = -2e-6; // m/N, vertical
        }
        let ankle = Transform::from_translation(Vec3::new(0.0, 0.1, 0.1));
        let height = |feedback: &mut Feedback, in_contact: bool, force_n: f64| {
            let force = Vec3::new(0.0, 0.0, force_n);
            let mut feet = [FootTarget { in_contact, ..FootTarget::hanging(ankle) }; 2];
            feedback.move_ankles(&loaded, [Wrench { force, moment: Vec3::zeros() }; 2], &mut feet);
            feet[1].ankle_pose.translation.z - ankle.translation.z
        };
        assert_eq!(height(&mut feedback, true, 200.0), 0.0, "as planned");
        let stay = (-CONTROL_PERIOD_S / settings.sole_yield_time_s).exp();
        let sunk = -2e-6 * 100.0 * settings.sole_yield * (1.0 - stay);
        for (in_contact, force_n, expected) in
            [(true, 300.0, sunk), (false, 0.0, stay * sunk), (false, 0.0, stay * stay * sunk)]
        {
            let found = height(&mut feedback, in_contact, force_n);
            assert!((found - expected).abs() < 1e-15, "{found:e} {expected:e}");
        }
        feedback.restart();
        assert_eq!(height(&mut feedback, false, 0.0), 0.0);
    }

    #[test]
    fn joints_are_taken_over_as_measured_and_another_walk_begins_with_its_own_soles() {
        let mut bench = bench(IntegrationSettings::default());
        let own = bench.base();
        let here = bench.see(1, &own).expect("near").q.base.translation;
        bench.feedback.restart();
        let mut elsewhere = soles(2);
        elsewhere.feet.iter_mut().for_each(|foot| foot.ankle_position_m[1] += 7.0);
        bench.feedback.remember(&elsewhere);
        bench.message.header.tick = 2;
        let far = bench.feedback.observe(&bench.model, &bench.joints, &bench.message, &own).err();
        assert_eq!(far, Some(Refused::Distance));
        let moved = bench.feedback.estimate().pose.translation - here;
        assert!((moved.y - 7.0).abs() < 1e-9, "{moved}");
        let rates: Vec<f64> = (0..bench.model.joint_count()).map(|joint| 0.01 * joint as f64 - 0.1).collect();
        bench.joints.to_interface(&rates, &mut bench.message.joint_velocity_rad_per_s);
        bench.feedback.restart();
        let seen = bench.see(4, &own).expect("slow");
        let base = bench.model.base_dofs();
        assert_eq!(seen.v.as_slice()[base..], rates);
        for (joint, limits) in seen.q.joints.iter().zip(bench.model.joints().iter().map(|joint| joint.limits)) {
            assert_eq!(*joint, 0.5 * (limits.lower + limits.upper));
        }
    }

    #[test]
    fn over_missed_ticks_the_low_pass_goes_on_and_a_turn_that_no_gyro_saw_teaches_no_bias() {
        let velocity_time_s = 0.01;
        let mut bench = bench(IntegrationSettings { velocity_time_s, ..Default::default() });
        let own = bench.base();
        let mut see = |tick: i64, sole: SoleDeformation, turn_rad: f64| {
            bench.feedback.remember(&sole);
            bench.message.header.tick = tick;
            bench.message.imu_orientation_xyzw = [(0.5 * turn_rad).sin(), 0.0, 0.0, (0.5 * turn_rad).cos()];
            let speed = bench
                .feedback
                .observe(&bench.model, &bench.joints, &bench.message, &own)
                .expect("near")
                .v
                .rows(0, 3)
                .norm();
            (speed, bench.feedback.estimate().gyro_bias.norm())
        };
        let resting = |tick| {
            let mut sole = soles(tick);
            sole.feet.iter_mut().for_each(|foot| foot.ankle_twist[0] = 0.0);
            sole
        };
        // The first one is that of `base`, whose soles moved.
        for tick in 1..50 {
            see(tick, resting(tick), 0.0);
        }
        let (speed, bias) = see(50, resting(50), 0.0);
        assert!(speed < 1e-9 && bias < 1e-12, "{speed} {bias}");
        // Five ticks later the soles move, and the body has turned by 0.05 rad.
        let (speed, bias) = see(55, soles(54), 0.05);
        let expected = ANKLE_SPEED_M_PER_S * (1.0 - (-5.0 * CONTROL_PERIOD_S / velocity_time_s).exp());
        assert!((speed - expected).abs() < 1e-9, "{speed} {expected}");
        assert!(bias < 1e-12, "{bias}");
    }

    #[test]
    fn every_measurement_that_no_standing_robot_makes_is_refused_with_its_reason_and_the_next_good_one_is_used() {
        let mut bench = bench(IntegrationSettings::default());
        let own = bench.base();
        let good = bench.message;
        let (limits, count) = (bench.model.joints()[3].limits, bench.model.joint_count());
        let at_joint = move |values: &mut [f64; messages::MAX_JOINTS], joints: &JointMap, value: f64| {
            let mut all = vec![0.0; count];
            joints.from_interface(values, &mut all);
            all[3] = value;
            joints.to_interface(&all, values);
        };
        let beyond = |margin: f64| {
            move |m: &mut StateMessage, j: &JointMap| at_joint(&mut m.joint_position_rad, j, limits.upper + margin)
        };
        let below = |m: &mut StateMessage, j: &JointMap| at_joint(&mut m.joint_position_rad, j, limits.lower - 0.11);
        let fast = |factor: f64| {
            move |m: &mut StateMessage, j: &JointMap| {
                at_joint(&mut m.joint_velocity_rad_per_s, j, factor * limits.velocity)
            }
        };
        type Fault<'a> = &'a dyn Fn(&mut StateMessage, &JointMap);
        let faults: [(Refused, Fault); 8] = [
            (Refused::SensorFault, &|m, _| m.fault_bits = 4),
            (Refused::Joint, &beyond(0.11)),
            (Refused::Joint, &below),
            (Refused::Joint, &fast(-2.1)),
            (Refused::Orientation, &|m, _| m.imu_orientation_xyzw = [0.0; 4]),
            (Refused::Orientation, &|m, _| m.imu_orientation_xyzw = [0.0, 0.0, 0.0, 1.01]),
            (Refused::Gyro, &|m, _| m.gyro_rad_per_s = [0.0, 36.0, 0.0]),
            // The base hangs about half a metre above the ankles: a tilt by 0.4 rad is too far either way.
            (Refused::Distance, &|m, _| m.imu_orientation_xyzw = [0.2_f64.sin(), 0.0, 0.0, 0.2_f64.cos()]),
        ];
        let mut tick = 0;
        for (reason, fault) in faults {
            for spoilt in [true, false] {
                tick += 1;
                bench.message = good;
                if spoilt {
                    fault(&mut bench.message, &bench.joints);
                }
                let found = bench.see(tick, &own).err();
                assert_eq!(found, spoilt.then_some(reason), "tick {tick}");
            }
        }
        // Just within.
        for fault in [&beyond(0.09) as Fault, &fast(1.9)] {
            tick += 1;
            bench.message = good;
            fault(&mut bench.message, &bench.joints);
            assert_ne!(bench.see(tick, &own).err(), Some(Refused::Joint));
        }
        bench.message = good;
        bench.see(tick + 1, &own).expect("good");
        for old in [tick + 1, tick] {
            assert_eq!(bench.see(old, &own).err(), Some(Refused::Stale));
        }
    }

    #[test]
    fn a_base_too_far_from_its_plan_is_not_believed_in_position_alone_either() {
        let mut bench = bench(IntegrationSettings::default());
        let mut own = bench.base();
        own.q.base.translation.y += 0.09;
        bench.see(1, &own).expect("0.1 m are believed");
        own.q.base.translation.y += 0.02;
        assert_eq!(bench.see(2, &own).err(), Some(Refused::Distance));
        // And in orientation alone: 0.3 rad.
        let mut own = bench.base();
        own.q.base = bench.feedback.estimate().pose;
        let straight = own.q.base.rotation;
        for (tick, turn_rad, refused) in [(3, 0.29, None), (4, -0.29, None), (5, 0.31, Some(Refused::Distance))] {
            own.q.base.rotation = so3::about_z(turn_rad) * straight;
            own.q.base.translation = bench.feedback.estimate().pose.translation;
            assert_eq!(bench.see(tick, &own).err(), refused, "{turn_rad} rad");
        }
    }
}
