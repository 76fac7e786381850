//! The estimator is told the load that the body really makes: the plan alone, without a stabiliser, is the measure of that.

use closed_loop::{ClosedLoop, Tick};
use messages::SoleDeformation;
use messages::code::Reason;
use nalgebra::{Matrix3, Vector3};
use scenario::{Scenario, Setting};
use std::path::Path;

fn built(settings: &[&str]) -> ClosedLoop {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/no-stabiliser.toml");
    let settings: Vec<Setting> = settings.iter().map(|text| text.parse().expect("a setting")).collect();
    let scenario = Scenario::load(&path, &settings).expect("the scenarios that ship can be loaded");
    ClosedLoop::new(&scenario).expect("the scenarios that ship can be built")
}

/// Largest errors of centre of mass and ZMP (mm) of a walk to its end.
fn errors_mm(settings: &[&str], deform: impl Fn(&mut SoleDeformation), mut see: impl FnMut(&Tick)) -> [f64; 2] {
    let mut run = built(settings);
    while let Some(tick) = run.step_deforming(&deform).expect("the controller goes on") {
        see(&tick);
    }
    assert_eq!(run.over(), Some(Reason::Finished), "{settings:?}");
    let figures = run.figures();
    [figures.com_error_max_m, figures.zmp_error_max_m].map(|error_m| 1e3 * error_m.expect("it has walked"))
}

/// The soft-sole walk's own shift may differ from the rehearsal's by this much, forward and sideways (mm rms).
const SHIFT_DIFFERENCE_MM: [f64; 2] = [1.0, 1.0];

/// Alone, the walk that ships stays within 1.5 and 10 mm, and its body makes the ZMP that the rehearsal foresaw.
#[test]
fn the_plan_alone_walks_as_rehearsed() {
    let planned = built(&[]).planned;
    let shift_m = [0, 1].map(|axis| planned.rehearsal.zmp_shift_m(axis));
    let (mut zero, mut sum, mut count) = (None, [0.0; 2], 0);
    let [com_mm, zmp_mm] = errors_mm(
        &[],
        |_| {},
        |tick| {
            zero = tick.start.map(|start| start.tick_zero).or(zero);
            let Some(k) = zero.map(|zero| tick.state.header.tick - zero).filter(|k| *k >= 0) else { return };
            let Some(_) = shift_m[0].get(k as usize) else { return };
            let plan = planned.plan.pattern.evaluate(k as f64 * messages::CONTROL_PERIOD_S).zmp.position;
            for axis in 0..2 {
                let off_m = tick.command.plan.zmp_m[axis] - plan[axis] - shift_m[axis][k as usize];
                sum[axis] += off_m * off_m;
            }
            count += 1;
        },
    );
    assert!(com_mm <= 1.5 && zmp_mm <= 10.0, "COM {com_mm} mm, ZMP {zmp_mm} mm");
    for axis in 0..2 {
        let rms_mm = 1e3 * (sum[axis] / f64::from(count)).sqrt();
        assert!(rms_mm <= SHIFT_DIFFERENCE_MM[axis], "axis {axis}: {rms_mm} mm");
    }
}

/// Turns what the estimator says by a factor about the robot's forward axis, in place: the ankle goes with its sole.
fn roll(deformation: &mut SoleDeformation, factor: f64) {
    for foot in deformation.feet.iter_mut().filter(|foot| foot.loaded == 1) {
        let rotation = Matrix3::from_row_slice(&foot.ankle_rotation);
        let roll_rad = rotation[(2, 1)];
        let more = nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), (factor - 1.0) * roll_rad);
        let origin = Vector3::from(foot.sole_position_m);
        let arm = Vector3::from(foot.ankle_position_m) - origin;
        foot.ankle_position_m = (origin + more * arm).into();
        let turned = more.matrix() * rotation;
        foot.ankle_rotation = turned.transpose().as_slice().try_into().expect("3 x 3 numbers");
        let spin = (factor - 1.0) * foot.ankle_twist_m_rad_per_s[3];
        foot.ankle_twist_m_rad_per_s[3] += spin;
        // The ankle is above the sole: it moves sideways as the foot turns.
        foot.ankle_twist_m_rad_per_s[1] -= spin * arm.z;
    }
}

/// No systematic tilt is left in what the estimator says: turned less or more, its feet make the robot lean.
#[test]
fn the_estimators_own_roll_is_the_best() {
    let short = ["planner.gait.walk.swings=5"];
    let [less, own, more] =
        [0.95, 1.0, 1.05].map(|factor| errors_mm(&short, |deformation| roll(deformation, factor), |_| {})[0]);
    assert!(own < less && own < more, "COM off by {less}, {own}, {more} mm");
}

/// The paper's mesh is a tenth too stiff; the plant's own sole, known to the estimator, walks better.
#[test]
fn a_truer_sole_walks_better() {
    let short = "planner.gait.walk.swings=5";
    let coarse = [short, "estimator.sole.level=fem", "estimator.sole.cells=[12,7,3]"];
    let true_one = [short, "estimator.sole.level=patches", "estimator.sole.patch_cells=[8,7]"];
    let [coarse, true_one] = [coarse, true_one].map(|settings| errors_mm(&settings, |_| {}, |_| {}));
    assert!(true_one[0] <= coarse[0] && true_one[1] <= coarse[1], "{true_one:?} against {coarse:?} mm");
}
