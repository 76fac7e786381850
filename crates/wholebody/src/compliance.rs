//! Compliance feed-forward: where a standing ankle goes when its sole carries another wrench than the planned one.
//!
//! The estimator places the ankle for the *planned* wrench `W_p`. A step with feedback asks the ground for another one, `W`: that is how
//! it pushes the centre of mass back. A robot with position-controlled joints gets the difference from its soles only if the feet move
//! as the soles give way under it,
//!
//! ```text
//! d <- d + (1 - exp(-dt/T)) (part C (W - W_p) - d)
//! X_WA <- d applied at the sole's origin
//! ```
//!
//! with the estimator's compliance `C` (6 x 6, world axes, about the sole's origin). Without this (`part = 0`) feedback does the opposite: it
//! turns the feet of a tilting robot back to where the plan has them, which takes away the moment with which the soles hold the robot up.
//!
//! The vertical moment is left out: the plan has none, and the step's own is whatever its damping leaves. `d` is limited, for `C` is
//! linear and a sole that just touches the ground is soft without bound. What is left of it when a foot lifts off fades in the air with
//! the same time constant, so the foot's target does not jump.

use spatial::{Mat6, Transform, Vec3, Vec6, Wrench, so3};

/// Largest displacement of a sole from its plan (m): a quarter of its thickness.
const DISPLACEMENT_MAX_M: f64 = 0.005;
/// Largest rotation of a sole from its plan (rad): 3 degrees; from 5 on linear elasticity is doubtful.
const ROTATION_MAX_RAD: f64 = 0.05;

/// Settings of [`ComplianceFeedForward`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ComplianceSettings {
    /// Part of the sole's own answer, 0 to 1; 0 = the ankle stays where the plan has it.
    pub part: f64,
    /// Time constant `T` (s); 0 = none.
    pub time_s: f64,
}

/// A sole under its planned load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadedSole {
    /// Origin of the sole in the world (m).
    pub origin: Vec3,
    /// Planned wrench of the ground on it about its origin, world axes.
    pub wrench: Wrench,
    /// Change of its pose per change of that wrench: a sole gives way, so its diagonal is negative.
    pub compliance: Mat6,
}

/// Displacement of one sole from its plan, over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ComplianceFeedForward {
    settings: ComplianceSettings,
    displacement: Vec6,
    /// Ankle from the sole's origin when the foot stood last, world axes (m).
    arm: Vec3,
}

impl ComplianceFeedForward {
    /// Nothing has given way yet.
    #[must_use]
    pub fn new(settings: ComplianceSettings) -> Self {
        Self { settings, displacement: Vec6::zeros(), arm: Vec3::zeros() }
    }

    /// One period. `computed` is the wrench of the ground on the foot that the last step asked for, about `ankle`, world axes; `ankle` the
    /// ankle's pose for the planned wrench. Returns the pose for the computed one. A foot in the air has no sole: it loses what is
    /// left of its displacement.
    pub fn update(&mut self, sole: Option<&LoadedSole>, computed: &Wrench, ankle: &Transform, dt_s: f64) -> Transform {
        let loaded = sole.filter(|_| computed.force.z > 0.0);
        let goal = loaded.map_or_else(Vec6::zeros, |sole| self.answer(sole, computed, ankle));
        let gain = 1.0 - (-dt_s / self.settings.time_s).exp(); // 1 without a low-pass
        self.displacement += gain * (goal - self.displacement);
        if let Some(sole) = sole {
            self.arm = ankle.translation - sole.origin;
        }
        let d = &self.displacement;
        if *d == Vec6::zeros() {
            return *ankle; // to the bit
        }
        let turn = so3::exp(&Vec3::new(d[3], d[4], d[5]));
        let shift = Vec3::new(d[0], d[1], d[2]) + turn * self.arm - self.arm;
        Transform::new(turn * ankle.rotation, ankle.translation + shift)
    }

    /// Where the displacement goes.
    fn answer(&self, sole: &LoadedSole, computed: &Wrench, ankle: &Transform) -> Vec6 {
        let about_origin = computed.about(&(sole.origin - ankle.translation));
        let mut more = about_origin.to_vector() - sole.wrench.to_vector();
        more[5] = 0.0;
        let d = self.settings.part * (sole.compliance * more);
        let beyond = |first: usize, max: f64| d.fixed_rows::<3>(first).norm() / max;
        // Shortened as a whole: it keeps its direction.
        d / beyond(0, DISPLACEMENT_MAX_M).max(beyond(3, ROTATION_MAX_RAD)).max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.005;
    /// Of a sole that is a spring per direction (m/N, rad/(N m)): what the ground pushes, the sole gives way to.
    const PER_FORCE: f64 = -2e-6;
    const PER_MOMENT: f64 = -1e-3;

    fn ankle() -> Transform {
        Transform::from_translation(Vec3::new(0.3, 0.1, 0.103))
    }

    fn sole() -> LoadedSole {
        let diagonal = Vec6::new(PER_FORCE, PER_FORCE, PER_FORCE, PER_MOMENT, PER_MOMENT, PER_MOMENT);
        let wrench = Wrench { force: Vec3::new(0.0, 0.0, 300.0), moment: Vec3::new(2.0, -1.0, 0.0) };
        LoadedSole { origin: Vec3::new(0.31, 0.11, 0.0), wrench, compliance: Mat6::from_diagonal(&diagonal) }
    }

    /// The wrench on the sole as the step says it: about the ankle.
    fn about_ankle(on_sole: Wrench) -> Wrench {
        on_sole.about(&(ankle().translation - sole().origin))
    }

    fn now(part: f64) -> ComplianceFeedForward {
        ComplianceFeedForward::new(ComplianceSettings { part, time_s: 0.0 })
    }

    fn moved(part: f64, more: Wrench) -> Transform {
        let planned = sole().wrench;
        let wrench = Wrench { force: planned.force + more.force, moment: planned.moment + more.moment };
        now(part).update(Some(&sole()), &about_ankle(wrench), &ankle(), PERIOD_S)
    }

    #[test]
    fn the_planned_wrench_leaves_the_ankle_where_the_estimator_has_it() {
        let still = moved(1.0, Wrench::zero());
        assert!((still.translation - ankle().translation).norm() < 1e-15);
        assert!(so3::log(&still.rotation).norm() < 1e-15);
    }

    #[test]
    fn more_load_presses_the_foot_and_a_moment_turns_it_about_the_sole_both_by_the_part_that_is_set() {
        for part in [0.5, 1.0] {
            // The ground carries 100 N more: the foot is that much lower.
            let pushed = moved(part, Wrench { force: Vec3::new(10.0, -20.0, 100.0), moment: Vec3::zeros() });
            let expected = ankle().translation + part * PER_FORCE * Vec3::new(10.0, -20.0, 100.0);
            assert!((pushed.translation - expected).norm() < 1e-15, "{pushed:?}");
            assert!(pushed.translation.z < ankle().translation.z);
            let turned = moved(part, Wrench { force: Vec3::zeros(), moment: Vec3::new(8.0, -6.0, 5.0) });
            // Not about the vertical.
            let rotation = part * PER_MOMENT * Vec3::new(8.0, -6.0, 0.0);
            assert!((so3::log(&turned.rotation) - rotation).norm() < 1e-15);
            let arm = ankle().translation - sole().origin;
            let place = sole().origin + so3::exp(&rotation) * arm;
            assert!((turned.translation - place).norm() < 1e-15);
        }
    }

    #[test]
    fn displacement_is_limited_and_keeps_its_direction() {
        let far = moved(1.0, Wrench { force: Vec3::zeros(), moment: Vec3::new(300.0, -400.0, 0.0) });
        assert!((so3::log(&far.rotation) + ROTATION_MAX_RAD * Vec3::new(0.6, -0.8, 0.0)).norm() < 1e-12);
        let deep = moved(1.0, Wrench { force: Vec3::new(0.0, 0.0, 1e5), moment: Vec3::zeros() });
        assert!((deep.translation.z - ankle().translation.z + DISPLACEMENT_MAX_M).abs() < 1e-12);
    }

    #[test]
    fn it_comes_and_goes_with_its_time_constant_in_the_air_too() {
        let time_s = 0.05;
        let mut compliance = ComplianceFeedForward::new(ComplianceSettings { part: 1.0, time_s });
        let more = Wrench { force: Vec3::new(0.0, 0.0, 400.0), moment: sole().wrench.moment };
        let loaded = about_ankle(more);
        let mut height = 0.0;
        for _ in 0..10 {
            height =
                compliance.update(Some(&sole()), &loaded, &ankle(), PERIOD_S).translation.z - ankle().translation.z;
        }
        let whole = 100.0 * PER_FORCE;
        assert!((height / whole - (1.0 - (-1.0_f64).exp())).abs() < 1e-9, "{height}");
        let left = |periods: usize| (-(periods as f64) * PERIOD_S / time_s).exp();
        for periods in 1..=10 {
            let flying = compliance.update(None, &Wrench::zero(), &ankle(), PERIOD_S).translation.z;
            assert!((flying - ankle().translation.z - height * left(periods)).abs() < 1e-12);
        }
        // What is left when it stands again without load.
        let back = compliance.update(Some(&sole()), &Wrench::zero(), &ankle(), PERIOD_S).translation.z;
        assert!((back - ankle().translation.z - height * left(11)).abs() < 1e-12);
        // A foot that lifts off while its sole is turned stays turned about where the sole was, wherever it flies.
        let loaded = about_ankle(Wrench { moment: sole().wrench.moment + Vec3::new(20.0, 0.0, 0.0), ..sole().wrench });
        let mut compliance = ComplianceFeedForward::new(ComplianceSettings { part: 1.0, time_s });
        let standing = compliance.update(Some(&sole()), &loaded, &ankle(), PERIOD_S);
        let elsewhere = Transform::from_translation(Vec3::new(5.0, -1.0, 0.4));
        let flying = compliance.update(None, &Wrench::zero(), &(elsewhere * ankle()), PERIOD_S);
        let [turned, still_turned] = [standing, flying].map(|pose| so3::log(&pose.rotation));
        assert!((still_turned - left(1) * turned).norm() < 1e-15 && turned.norm() > 1e-3);
        let arm = ankle().translation - sole().origin;
        let place = elsewhere.point(&(sole().origin + so3::exp(&still_turned) * arm));
        assert!((flying.translation - place).norm() < 1e-14);
    }
}
