//! A tick of feedback allocates nothing.

use crate::support::{Joints, PERIOD_S, Walk, model, robot, settings, start};
use nalgebra::DVector;
use spatial::Vec3;
use state::observer::{BaseObserver, FootAnchor, Measurement, ObserverSettings, YawSource};
use state::{IntegrationMode, IntegrationSettings, InternalState};
use wholebody::RobotState;

#[test]
fn observing_the_base_and_blending_allocates_nothing() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let reference = Walk::straight(1).reference(0.0);
    let state = start(&model, &settings, &reference);
    let observer_settings = ObserverSettings {
        imu_link: "imu".to_owned(),
        ankle_links: settings.feet.each_ref().map(|foot| foot.ankle_link.clone()),
        yaw: YawSource::Legs,
        bias_time_s: 5.0,
        velocity_time_s: 0.01,
        delay_s: 0.02,
    };
    let mut observer = BaseObserver::new(model.clone(), observer_settings).expect("names fit");
    let feedback = IntegrationSettings {
        mode: IntegrationMode::Feedback,
        joint_rate_per_s: 1.0,
        ..IntegrationSettings::default()
    };
    let mut internal = InternalState::new(&feedback, state.clone(), 2);
    let joint_rates = DVector::zeros(model.joint_count());
    let mut measured: RobotState = state.clone();
    let count = allocation_counter::measure(|| {
        for _ in 0..10 {
            let estimate = observer.update(
                &Measurement {
                    joints: &state.q.joints,
                    joint_rates: &joint_rates,
                    imu_rotation: state.q.base.rotation,
                    gyro: Vec3::zeros(),
                    feet: reference.feet.map(|foot| FootAnchor {
                        in_contact: foot.in_contact,
                        load_share: foot.load_share,
                        ankle_pose: foot.ankle_pose,
                        ankle_twist: foot.ankle_twist,
                    }),
                },
                PERIOD_S,
            );
            measured.q.base = estimate.pose;
            internal.begin(&model, Some(&measured), PERIOD_S);
            internal.rest();
        }
    });
    assert_eq!(count.count_total, 0);
    assert!(internal.distance().base_m < 1e-6, "the observed base is that of the start");
}
