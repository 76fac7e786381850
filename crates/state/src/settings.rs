//! Section `[integration]`: from accelerations to the state of the next step.

use crate::observer::YawSource;
use ranges::{OutOfRange, Range};
use serde::Deserialize;
use wholebody::ComplianceSettings;

/// Which state a step starts from, and how much of what is measured is in it. All but `mode` counts in feedback only.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct IntegrationSettings {
    /// Which of the two.
    pub mode: IntegrationMode,
    /// How fast the internal base goes to the observed one: position and orientation (1/s). 2 to 20: below the robot's rocking on its soles
    /// (8 rad/s) it sees too little of a push, above it the noise. 0 = not at all.
    pub base_pose_rate_per_s: f64,
    /// The same for its velocity and angular velocity (1/s).
    pub base_twist_rate_per_s: f64,
    /// The same for joint angles and rates (1/s). 0 for drives that follow positions: what they lag behind must not become reference.
    pub joint_rate_per_s: f64,
    /// Age of what the robot measures when it arrives (ticks). It is held against the model of that time.
    pub measurement_delay_ticks: u32,
    /// Where the yaw comes from.
    pub yaw: YawSource,
    /// Time constant of the gyro's bias (s).
    pub gyro_bias_time_s: f64,
    /// Time constant of the low-pass on the difference of the base's velocity from the model's (s): it has the noise of the joint rates times
    /// the leg's length. 0 = none.
    pub velocity_time_s: f64,
    /// Part of a sole's own answer to the wrench that the step asks for, by which the ankle moves:
    /// [`wholebody::ComplianceFeedForward`]. 0 = none.
    pub compliance_feed_forward: f64,
    /// Time constant of that (s), and of how it is lost in the air.
    pub compliance_time_s: f64,
    /// A base observed farther from the internal one is not believed (m).
    pub distance_max_m: f64,
    /// The same for its orientation (rad).
    pub distance_max_rad: f64,
}

/// Which state a step starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IntegrationMode {
    /// The last step's result, as in the paper.
    OpenLoop,
    /// That, blended with what is measured.
    Feedback,
}

impl Default for IntegrationSettings {
    fn default() -> Self {
        Self {
            mode: IntegrationMode::OpenLoop,
            base_pose_rate_per_s: 5.0,
            base_twist_rate_per_s: 5.0,
            joint_rate_per_s: 0.0,
            measurement_delay_ticks: 0,
            yaw: YawSource::Legs,
            gyro_bias_time_s: 5.0,
            velocity_time_s: 0.01,
            compliance_feed_forward: 0.5,
            compliance_time_s: 0.03,
            distance_max_m: 0.1,
            distance_max_rad: 0.3,
        }
    }
}

/// Longest delay (ticks): half a second, in which the robot would have fallen.
const DELAY_MAX_TICKS: u32 = 100;

impl IntegrationSettings {
    /// Is every number one that can be, at this control period (s)?
    ///
    /// # Errors
    /// The first that is not, by its key below `integration`.
    pub fn check(&self, period_s: f64) -> Result<(), OutOfRange> {
        // A rate of one per control period takes over 63 % at once.
        let rate = Range::between(0.0, 1.0 / period_s);
        rate.demand("integration.base_pose_rate_per_s", self.base_pose_rate_per_s, "2 to 20 is useful")?;
        rate.demand("integration.base_twist_rate_per_s", self.base_twist_rate_per_s, "2 to 20 is useful")?;
        rate.demand("integration.joint_rate_per_s", self.joint_rate_per_s, "0 for drives that follow positions")?;
        let delay = Range::between(0.0, f64::from(DELAY_MAX_TICKS));
        let ticks = f64::from(self.measurement_delay_ticks);
        delay.demand("integration.measurement_delay_ticks", ticks, "the age of what the robot measures")?;
        Range::between(0.1, 1e6).demand("integration.gyro_bias_time_s", self.gyro_bias_time_s, "1 to 20 is useful")?;
        let (part, time, distance) = (Range::between(0.0, 1.0), Range::between(0.0, 1.0), Range::between(0.001, 1.0));
        time.demand("integration.velocity_time_s", self.velocity_time_s, "0.01 is usual, 0 is none")?;
        part.demand("integration.compliance_feed_forward", self.compliance_feed_forward, "0.5 is usual, 0 is none")?;
        time.demand("integration.compliance_time_s", self.compliance_time_s, "0.03 is usual, 0 is none")?;
        distance.demand("integration.distance_max_m", self.distance_max_m, "0.1 is usual")?;
        distance.demand("integration.distance_max_rad", self.distance_max_rad, "0.3 is usual")
    }

    /// How the ankles follow their soles.
    #[must_use]
    pub fn compliance(&self) -> ComplianceSettings {
        ComplianceSettings { part: self.compliance_feed_forward, time_s: self.compliance_time_s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.005;

    #[test]
    fn numbers_beyond_their_range_are_refused_with_the_full_key() {
        type Field = fn(&mut IntegrationSettings) -> &mut f64;
        let fields: [(&str, Field, [f64; 2]); 9] = [
            ("integration.base_pose_rate_per_s", |s| &mut s.base_pose_rate_per_s, [0.0, 200.0]),
            ("integration.base_twist_rate_per_s", |s| &mut s.base_twist_rate_per_s, [0.0, 200.0]),
            ("integration.joint_rate_per_s", |s| &mut s.joint_rate_per_s, [0.0, 200.0]),
            ("integration.gyro_bias_time_s", |s| &mut s.gyro_bias_time_s, [0.1, 1e6]),
            ("integration.velocity_time_s", |s| &mut s.velocity_time_s, [0.0, 1.0]),
            ("integration.compliance_feed_forward", |s| &mut s.compliance_feed_forward, [0.0, 1.0]),
            ("integration.compliance_time_s", |s| &mut s.compliance_time_s, [0.0, 1.0]),
            ("integration.distance_max_m", |s| &mut s.distance_max_m, [0.001, 1.0]),
            ("integration.distance_max_rad", |s| &mut s.distance_max_rad, [0.001, 1.0]),
        ];
        let with = |field: Field, value: f64| {
            let mut settings = IntegrationSettings::default();
            *field(&mut settings) = value;
            settings.check(PERIOD_S)
        };
        for (key, field, [least, most]) in fields {
            with(field, least).expect(key);
            with(field, most).expect(key);
            for wrong in [least - 1e-6, most * 1.001, f64::NAN, f64::INFINITY] {
                let said = with(field, wrong).expect_err(key).to_string();
                assert!(said.contains(&format!("`{key}` is {}", ranges::number(wrong))), "{said}");
            }
        }
        let late = |ticks| IntegrationSettings { measurement_delay_ticks: ticks, ..Default::default() }.check(PERIOD_S);
        late(100).expect("half a second");
        let said = late(101).expect_err("more").to_string();
        assert!(
            said.contains("`integration.measurement_delay_ticks` is 101, must be at least 0 and at most 100"),
            "{said}"
        );
    }
}
