//! What is lost when forces hardly determine accelerations, and that it is reported.

use crate::random_robot::{Random, configuration, coupled_model, model};
use multibody::*;
use nalgebra::{DVector, dvector};
use spatial::Vec3;

/// Lengths (m) of the two links of a pendulum, and the mass (kg) at its end.
const UPPER_M: f64 = 0.37;
const LOWER_M: f64 = 0.71;
const MASS_KG: f64 = 1.3;

/// One point mass on two links, in a tilted plane without gravity.
fn pendulum() -> Model {
    let text = format!(
        r#"<robot name="pendulum"><link name="base"/><link name="upper"/>
        <link name="lower"><inertial><origin xyz="{LOWER_M} 0 0"/><mass value="{MASS_KG}"/>
          <inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="hip" type="continuous"><origin rpy="0.3 -0.8 1.1"/><parent link="base"/><child link="upper"/>
          <axis xyz="0 0 1"/></joint>
        <joint name="knee" type="continuous"><origin xyz="{UPPER_M} 0 0"/><parent link="upper"/><child link="lower"/>
          <axis xyz="0 0 1"/></joint></robot>"#
    );
    let options = ModelOptions { base: Base::Fixed, gravity: Vec3::zeros(), ..ModelOptions::default() };
    Model::from_urdf(&text, &options).expect("a pendulum")
}

/// Accelerations at rest under the torques 1 and -0.7, in closed form; nothing cancels.
fn in_closed_form(knee: f64) -> DVector<f64> {
    let (a, b) = (UPPER_M, LOWER_M);
    let det = MASS_KG * (a * b * knee.sin()).powi(2);
    let (both, lower) = (a * a + b * b + 2.0 * a * b * knee.cos(), b * b + a * b * knee.cos());
    dvector![(b * b + 0.7 * lower) / det, -(lower + 0.7 * both) / det]
}

fn relative_error(found: &DVector<f64>, expected: &DVector<f64>) -> f64 {
    (found - expected).amax() / expected.amax()
}

#[test]
fn what_a_stretched_pendulum_loses_is_reported() {
    let model = pendulum();
    let (mut ws, mut q) = (Workspace::new(&model), model.neutral());
    let (still, tau) = (DVector::zeros(2), dvector![1.0, -0.7]);
    let (mut vd, mut refined) = (DVector::zeros(2), DVector::zeros(2));
    for knee in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5] {
        let (mut error, mut reported) = (0.0_f64, 0.0_f64);
        // A single state may be lucky; the largest of several is not.
        for k in 0..20 {
            q.joints = dvector![0.1 * f64::from(k), knee * (1.0 + 0.01 * f64::from(k))];
            let expected = in_closed_form(q.joints[1]);
            aba(&model, &mut ws, &q, &still, &tau, &mut vd);
            error = error.max(relative_error(&vd, &expected));
            reported = reported.max(aba_refined(&model, &mut ws, &q, &still, &tau, &mut refined));
        }
        // Rounding of the inertia about the hip, over what is left of it: mass at a lever of (a b / (a + b)) sin(knee).
        let bound = f64::EPSILON / (UPPER_M * LOWER_M / (UPPER_M + LOWER_M).powi(2) * knee).powi(2);
        assert!(error < bound, "knee at {knee} rad: {error:e}, at most {bound:e} expected");
        assert!(
            reported > 0.2 * error && reported < 5.0 * error,
            "knee at {knee} rad: {error:e}, reported {reported:e}"
        );
    }
}

#[test]
fn ordinary_robots_lose_nothing_to_speak_of() {
    for (seed, make) in
        (0..6).flat_map(|seed| [(seed, model as fn(u64, &ModelOptions) -> Model), (seed, coupled_model)])
    {
        let model = make(seed, &ModelOptions::default());
        let mut random = Random(500 + seed);
        let (q, nv, mut ws) = (configuration(&model, &mut random), model.nv(), Workspace::new(&model));
        let (v, tau) = (random.list(nv, 2.0), random.list(nv, 5.0));
        let (mut vd, mut refined) = (DVector::zeros(nv), DVector::zeros(nv));
        aba(&model, &mut ws, &q, &v, &tau, &mut vd);
        let reported = aba_refined(&model, &mut ws, &q, &v, &tau, &mut refined);
        assert!(reported < 1e-11, "seed {seed}: {reported:e}");
        assert!(relative_error(&refined, &vd) <= 1.01 * reported, "it reports the difference to the plain algorithm");
    }
}

#[test]
fn a_robot_at_rest_reports_zero() {
    let model = pendulum();
    let mut vd = DVector::zeros(2);
    let (still, q) = (DVector::zeros(2), Configuration { joints: dvector![0.3, 0.4], ..model.neutral() });
    assert_eq!(aba_refined(&model, &mut Workspace::new(&model), &q, &still, &still, &mut vd), 0.0);
}

#[test]
fn a_result_that_is_no_number_is_reported_as_infinitely_wrong() {
    let model = pendulum();
    let mut vd = DVector::zeros(2);
    let (still, q) = (DVector::zeros(2), Configuration { joints: dvector![0.3, 0.4], ..model.neutral() });
    let tau = dvector![f64::NAN, 0.0];
    assert_eq!(aba_refined(&model, &mut Workspace::new(&model), &q, &still, &tau, &mut vd), f64::INFINITY);
}

/// What is kept: a tenth of it is found, and seven times as much without the residual.
const KEPT: f64 = 2e-12;

#[test]
fn light_tweezers_on_a_heavy_arm_keep_their_digits() {
    // Four links of 8 kg, half a metre each; two tips of tweezers, a tenth of a gram each, one of which follows the other. In M
    // their share is what is left of the arm's: digits are lost there, and come back with the residual of the inverse dynamics.
    let link = |name: &str, mass: f64, length: f64| {
        let moment = mass * length * length / 12.0;
        format!(
            r#"<link name="{name}"><inertial><origin xyz="{} 0 0"/><mass value="{mass}"/><inertia ixx="{moment}" iyy="{moment}"
            izz="{moment}" ixy="0" ixz="0" iyz="0"/></inertial></link>"#,
            0.5 * length
        )
    };
    let joint = |name: &str, parent: &str, child: &str, at: &str, axis: &str, mimic: &str| {
        format!(
            r#"<joint name="{name}" type="continuous"><origin xyz="{at}"/><parent link="{parent}"/><child link="{child}"/>
            <axis xyz="{axis}"/>{mimic}</joint>"#
        )
    };
    let mut text = r#"<robot name="arm"><link name="l0"/>"#.to_owned();
    for (i, axis) in (1..).zip(["0 0 1", "0 1 0", "0.6 0 0.8", "0 1 0"]) {
        text += &link(&format!("l{i}"), 8.0, 0.5);
        let at = if i == 1 { "0 0 0" } else { "0.5 0 0" };
        text += &joint(&format!("j{i}"), &format!("l{}", i - 1), &format!("l{i}"), at, axis, "");
    }
    text += &(link("finger", 1e-4, 0.005) + &joint("close", "l4", "finger", "0.5 0.02 0", "0 0 1", ""));
    let mimic = r#"<mimic joint="close" multiplier="-1"/>"#;
    text += &(link("thumb", 1e-4, 0.005) + &joint("follow", "l4", "thumb", "0.5 -0.02 0", "0 0 1", mimic));
    text += "</robot>";
    let model =
        Model::from_urdf(&text, &ModelOptions { base: Base::Fixed, ..ModelOptions::default() }).expect("an arm");
    let (nv, mut ws, mut random) = (model.nv(), Workspace::new(&model), Random(7));
    let mut worst = 0.0_f64;
    for _ in 0..20 {
        let (q, v, a) = (configuration(&model, &mut random), random.list(nv, 2.0), random.list(nv, 5.0));
        let (mut tau, mut again) = (DVector::zeros(nv), DVector::zeros(nv));
        rnea(&model, &mut ws, &q, &v, &a, &mut tau);
        aba(&model, &mut ws, &q, &v, &tau, &mut again);
        worst = worst.max(relative_error(&again, &a));
    }
    assert!(worst < KEPT, "{worst:e}");
}
