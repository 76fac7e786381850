//! Feedback: the measured state, and ankles that follow their soles; messages in.

use messages::timing::DRIVES_BEHIND_TICKS;
use messages::{CONTROL_PERIOD_S, SoleDeformation};
use multibody::{Model, ModelError};
use spatial::Wrench;
use state::observer::BaseEstimate;
use state::{FeedbackFrames, IntegrationSettings, InternalState, Measured, Refused};
use wholebody::{ComplianceFeedForward, FootTarget, RobotState};

use crate::convert::{foot_anchor, loaded_sole};

/// What the robot measures, and how its soles give way.
pub(crate) struct Feedback {
    state: state::Feedback,
    compliance: [ComplianceFeedForward; 2],
    resting: ComplianceFeedForward,
}

impl Feedback {
    pub fn new(settings: &IntegrationSettings, model: &Model, frames: FeedbackFrames) -> Result<Self, ModelError> {
        let resting = ComplianceFeedForward::new(settings.compliance());
        let state = state::Feedback::new(settings, model, frames, DRIVES_BEHIND_TICKS, CONTROL_PERIOD_S)?;
        Ok(Self { state, compliance: [resting; 2], resting })
    }

    /// The last estimate of the base.
    pub fn estimate(&self) -> &BaseEstimate {
        self.state.estimate()
    }

    /// Forgets where the soles were: another walk is to be walked.
    pub fn restart(&mut self) {
        self.state.restart();
        self.compliance = [self.resting; 2];
    }

    /// Remembers where the soles are, whatever is measured.
    pub fn remember(&mut self, deformation: &SoleDeformation) {
        self.state.remember(deformation.header.tick, deformation.feet.each_ref().map(foot_anchor));
    }

    /// The measured state, carried forward to the present tick; `None`: a number is not finite.
    pub fn observe(
        &mut self,
        model: &Model,
        measured: Option<&Measured>,
        internal: &InternalState,
    ) -> Result<&RobotState, Refused> {
        self.state.observe(model, measured.ok_or(Refused::NotFinite)?, internal)
    }

    /// Moves the ankles as their soles give way under the wrenches that the last step computed, about the ankles; in the air they come
    /// back from it.
    pub fn move_ankles(&mut self, deformation: &SoleDeformation, computed: [Wrench; 2], feet: &mut [FootTarget; 2]) {
        for (i, foot) in feet.iter_mut().enumerate() {
            let sole = foot.in_contact.then(|| loaded_sole(&deformation.feet[i]));
            foot.ankle_pose =
                self.compliance[i].update(sole.as_ref(), &computed[i], &foot.ankle_pose, CONTROL_PERIOD_S);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::convert;
    use messages::{Header, RobotState as StateMessage};
    use robot::{JointMap, Robot};
    use robot_model::walking_model;
    use spatial::{Transform, Vec3, so3};
    use std::path::Path;

    const ANKLE_SPEED_M_PER_S: f64 = 0.2;

    struct Bench {
        settings: IntegrationSettings,
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
        let frames = FeedbackFrames { imu_link: robot.description.imu_frame.clone(), ankle_links: ankles };
        let feedback = Feedback::new(&settings, &model, frames).expect("its frames");
        let mut message = StateMessage { header: Header::new(0, 1), ..Default::default() };
        message.imu_orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
        let middle: Vec<f64> = model.joints().iter().map(|j| 0.5 * (j.limits.lower + j.limits.upper)).collect();
        joints.to_interface(&middle, &mut message.joint_position_rad);
        Bench { settings, feedback, model, joints, message }
    }

    /// Both soles at a tick: all ankles slide forwards together, one above the other.
    fn soles(tick: i64) -> SoleDeformation {
        let mut deformation = SoleDeformation { header: Header::new(tick, 1), ..Default::default() };
        for foot in &mut deformation.feet {
            foot.loaded = 1;
            foot.load_share = 0.5;
            foot.ankle_position_m = [ANKLE_SPEED_M_PER_S * tick as f64 * CONTROL_PERIOD_S, 0.0, 0.1];
            foot.ankle_rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
            foot.ankle_twist_m_rad_per_s[0] = ANKLE_SPEED_M_PER_S;
        }
        deformation
    }

    impl Bench {
        fn see(&mut self, tick: i64, own: &RobotState) -> Result<RobotState, Refused> {
            self.feedback.remember(&soles(tick));
            self.message.header.tick = tick;
            self.observe(own)
        }

        /// What the robot measures now.
        fn observe(&mut self, own: &RobotState) -> Result<RobotState, Refused> {
            let mut measured = Measured::new(&self.model);
            convert::measured(&self.message, &self.joints, &mut measured);
            // Without a past the model is taken for one that stood still.
            let own = InternalState::new(&self.settings, own.clone(), 0);
            self.feedback.observe(&self.model, Some(&measured), &own).cloned()
        }

        /// Where the base is said to be, whatever that is.
        fn base(&mut self) -> RobotState {
            let far = RobotState { q: self.model.neutral(), v: nalgebra::DVector::zeros(self.model.nv()) };
            let _ = self.see(0, &far);
            RobotState { q: multibody::Configuration { base: self.feedback.estimate().pose, ..far.q }, ..far }
        }
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
        let own = bench.base();
        let start = own.q.base.translation.x;
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
            let seen = bench.observe(&own);
            let x = seen.expect("near enough").q.base.translation.x;
            // The sole of the very tick, or the one before it.
            let at = (tick - i64::from(delay_ticks) - 1).max(0);
            let expected = known.iter().copied().filter(|known| *known <= at).max().expect("the first");
            let found = (x - start) / per_tick;
            assert!((found - expected as f64).abs() < 1e-9, "tick {tick}: anchored at {found}, not {expected}");
        }
    }

    #[test]
    fn soles_of_long_before_anchor_nothing() {
        let mut bench = bench(IntegrationSettings { distance_max_m: 1.0, ..Default::default() });
        let own = bench.base();
        let mut see = |soles_tick: i64, tick: i64| {
            bench.feedback.remember(&soles(soles_tick));
            bench.message.header.tick = tick;
            bench.observe(&own).err()
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
            foot.wrench_n_nm[2] = 200.0;
            foot.compliance_m_rad_per_n_nm[14] = -2e-6; // m/N, vertical
        }
        let ankle = Transform::from_translation(Vec3::new(0.0, 0.1, 0.1));
        let height = |feedback: &mut Feedback, in_contact: bool, force_n: f64| {
            let force = Vec3::new(0.0, 0.0, force_n);
            let mut feet = [FootTarget { in_contact, ..FootTarget::hanging(ankle) }; 2];
            feedback.move_ankles(&loaded, [Wrench { force, moment: Vec3::zeros() }; 2], &mut feet);
            feet[1].ankle_pose.translation.z - ankle.translation.z
        };
        assert_eq!(height(&mut feedback, true, 200.0), 0.0, "as planned");
        let stay = (-CONTROL_PERIOD_S / settings.compliance_time_s).exp();
        let sunk = -2e-6 * 100.0 * settings.compliance_feed_forward * (1.0 - stay);
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
        let far = bench.observe(&own).err();
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
            let speed = bench.observe(&own).expect("near").v.rows(0, 3).norm();
            (speed, bench.feedback.estimate().gyro_bias.norm())
        };
        let resting = |tick| {
            let mut sole = soles(tick);
            sole.feet.iter_mut().for_each(|foot| foot.ankle_twist_m_rad_per_s[0] = 0.0);
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
