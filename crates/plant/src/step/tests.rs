//! A block on two feet: closed forms for the integrator and the contact.

use multibody::{Model, ModelOptions};
use nalgebra::DVector;
use sole::{Level, MeshSource, SoleModel, SoleSettings};
use spatial::{Transform, Vec3, so3};

use super::*;
use crate::corners::CornerSettings;
use crate::foot::PlantSole;
use crate::ground::{GroundSettings, GroundShape};
use crate::settings::{ContactSettings, ServoSettings};

const MASS_KG: f64 = 39.0;
const GRAVITY: f64 = 9.81;

/// A flat block without joints, a foot under each side, its centre of mass 5 cm above the soles.
const BLOCK: &str = r#"<robot name="block"><link name="block"><inertial><mass value="39.0"/>
    <inertia ixx="1.0" iyy="1.0" izz="1.0" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;

struct Block {
    model: Model,
    stepper: Stepper,
    servo: Servo,
    feet: [Foot; 2],
    ground: GroundSettings,
    state: State,
    flows: EnergyFlows,
    step_s: f64,
}

impl Block {
    /// At a pose, at rest; soles below it have long carried what they carry there.
    fn new(soles: [PlantSole; 2], viscosity_time_s: f64, ground: GroundSettings, pose: Transform, step_s: f64) -> Self {
        let mut model = Model::from_urdf(BLOCK, &ModelOptions::default()).unwrap();
        let frames = [1.0, -1.0].map(|side| {
            let under = Transform::from_translation(Vec3::new(0.0, 0.08 * side, -0.05));
            model.add_frame(&format!("sole {side}"), model.base_frame(), under)
        });
        let settings = StepSettings {
            step_s,
            control_period_s: step_s,
            force_tolerance_n: 1e-7,
            newton_steps_max: 20,
            work_error_max_j: 1e9,
        };
        let contact = ContactSettings { viscosity_time_s, tolerance: 1e-12 };
        let mut feet = soles.map(|sole| Foot::new(sole, &contact));
        let state = State { q: Configuration { base: pose, ..model.neutral() }, v: DVector::zeros(6) };
        let mut stepper = Stepper::new(&model, settings, frames, 0);
        let mut ws = Workspace::new(&model);
        let placed = forward_kinematics(&model, &mut ws, &state.q);
        let wrenches = [0, 1].map(|i| feet[i].place(&placed.pose(frames[i]), &ground).wrench);
        stepper.place(&model, &state, wrenches);
        let servo = Servo::new(&model, &ServoSettings::default()).unwrap();
        Self { model, stepper, servo, feet, ground, state, flows: EnergyFlows::default(), step_s }
    }

    fn step(&mut self) -> StepReport {
        let scene = Scene { model: &self.model, servo: &self.servo, ground: &self.ground, applied: &[] };
        let time = StepTime { step_s: self.step_s, period_s: self.step_s, share_at_end: 1.0, last_resort: true };
        let report = self.stepper.step(&scene, &mut self.state, &mut self.feet, time, &mut self.flows);
        assert!(report.converged && report.contacts_converged, "{report:?}");
        report
    }

    fn run(&mut self, duration_s: f64) {
        for _ in 0..(duration_s / self.step_s).round() as usize {
            self.step();
        }
    }

    /// Velocity of the block in world axes.
    fn velocity(&self) -> Vec3 {
        let linear: Vec3 = self.state.v.fixed_rows::<3>(0).into();
        self.state.q.base.rotation * linear
    }

    fn energy(&self) -> f64 {
        let v = &self.state.v;
        0.5 * v.dot(&(self.stepper.mass_matrix() * v)) + MASS_KG * GRAVITY * self.state.q.base.translation.z
    }
}

fn corners(stiffness: f64, viscosity_time_s: f64, friction: f64) -> [PlantSole; 2] {
    let settings = CornerSettings {
        normal_stiffness_n_per_m: stiffness,
        tangential_stiffness_n_per_m: stiffness,
        viscosity_time_s,
        friction,
        ..Default::default()
    };
    [settings.into(), settings.into()]
}

/// Soft soles on a coarse mesh: the laws tested with them do not depend on it.
fn foam(friction: f64) -> [PlantSole; 2] {
    let settings = SoleSettings {
        mesh: MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [5, 4, 2] },
        level: Level::Fem,
        friction,
        ..Default::default()
    };
    let left = SoleModel::build(&settings).unwrap();
    let right = left.mirrored();
    [left.into(), right.into()]
}

fn standing(z_m: f64) -> Transform {
    Transform::from_translation(Vec3::new(0.0, 0.0, 0.05 + z_m))
}

#[test]
fn a_block_on_springs_oscillates_as_the_closed_form_with_first_order() {
    // Eight corners of 5e4 N/m: w = 101 rad/s, damping ratio eta w / 2 = 0.2; never off the ground.
    let (corner, eta, release_m, duration_s) = (5e4, 0.004, -2e-4, 0.1);
    let stiffness = 8.0 * corner;
    let rest_m = -MASS_KG * GRAVITY / stiffness;
    let w = (stiffness / MASS_KG).sqrt();
    let zeta = 0.5 * eta * w;
    let wd = w * (1.0 - zeta * zeta).sqrt();
    let exact = rest_m
        + (release_m - rest_m)
            * (-zeta * w * duration_s).exp()
            * ((wd * duration_s).cos() + zeta * w / wd * (wd * duration_s).sin());
    let errors: Vec<f64> = [1e-3, 5e-4, 2.5e-4, 1.25e-4]
        .into_iter()
        .map(|step_s| {
            let soles = corners(corner, eta, 0.65);
            let mut block = Block::new(soles, 0.0, GroundSettings::default(), standing(release_m), step_s);
            block.run(duration_s);
            (block.state.q.base.translation.z - 0.05 - exact).abs()
        })
        .collect();
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((0.85..1.3).contains(&order), "order {order}, errors {errors:?}");
    }
}

#[test]
fn the_integrator_takes_energy_and_never_makes_any_and_that_vanishes_with_the_step() {
    // Elastic soles ring at 100 to 450 rad/s after the impact: steps that resolve it.
    for (viscosity_time_s, name) in [(0.0, "elastic"), (0.02, "viscous")] {
        let lost: Vec<f64> = [4e-4, 2e-4, 1e-4]
            .into_iter()
            .map(|step_s| {
                let pose = Transform::new(so3::exp(&Vec3::new(0.01, 0.02, 0.0)), Vec3::new(0.0, 0.0, 0.056));
                let mut block = Block::new(foam(0.65), viscosity_time_s, GroundSettings::default(), pose, step_s);
                let start_j = block.energy();
                block.run(0.12);
                let numerical_j = block.energy() - start_j - block.flows.contact_j;
                // What it fell, it has lost to the soles, to slip and to the integrator.
                assert!(block.flows.slip_j <= 0.0, "{name}: slip made {} J", block.flows.slip_j);
                assert!(numerical_j < 0.0, "{name}: the integrator made {numerical_j} J");
                -numerical_j
            })
            .collect();
        for pair in lost.windows(2) {
            let order = (pair[0] / pair[1]).log2();

            assert!(order > 0.75, "{name}: order {order} of {lost:?}");
        }
    }
}

#[test]
fn a_block_settles_with_its_weight_on_the_soles() {
    for soles in [corners(1e5, 0.01, 0.65), foam(0.65)] {
        let mut block = Block::new(soles, 0.02, GroundSettings::default(), standing(1e-3), 1e-3);
        block.run(2.0);
        let force: Vec3 = block.stepper.wrenches.iter().map(|wrench| wrench.force).sum();
        assert!((force - Vec3::new(0.0, 0.0, MASS_KG * GRAVITY)).norm() < 1e-6, "{force}");
        assert!(block.state.v.norm() < 1e-7);
    }
}

/// On a slope of 0.3: below the friction coefficient the block stays, above it slides with g (sin a - mu cos a).
#[test]
fn a_block_on_a_slope_stays_or_slides_as_coulomb_says() {
    let rise = 0.3f64;
    let angle = rise.atan();
    let ground = || GroundSettings { shape: GroundShape::Slope { rise_x: rise, rise_y: 0.0 }, ..Default::default() };
    let normal = Vec3::new(-angle.sin(), 0.0, angle.cos());
    let down = Vec3::new(-angle.cos(), 0.0, -angle.sin());
    let pose = Transform::new(so3::about_y(-angle), normal * 0.0499);
    type Soles = fn(f64) -> [PlantSole; 2];
    for soles in [(|mu| corners(1e5, 0.01, mu)) as Soles, foam] {
        let mut stays = Block::new(soles(0.35), 0.02, ground(), pose, 1e-3);
        stays.run(1.0);
        assert!(stays.velocity().norm() < 1e-6, "{}", stays.velocity());

        let mu = 0.1;
        let mut slides = Block::new(soles(mu), 0.02, ground(), pose, 1e-3);
        slides.run(0.3);
        let before = slides.velocity();
        slides.run(0.2);
        let acceleration = (slides.velocity() - before) / 0.2;
        let expected = GRAVITY * (angle.sin() - mu * angle.cos());
        assert!((acceleration.dot(&down) - expected).abs() < 1e-3 * expected, "{acceleration} not {expected}");
        assert!(acceleration.dot(&normal).abs() < 1e-3 * expected);
        assert!(slides.flows.slip_j < 0.0);
    }
}

#[test]
fn on_slippery_ground_the_block_slides_further() {
    let patch = crate::ground::FrictionPatch { lower_m: [-9.0, -9.0], upper_m: [9.0, 9.0], factor: 0.0 };
    let ground = GroundSettings { friction_patches: vec![patch], ..Default::default() };
    let mut block = Block::new(foam(0.65), 0.02, ground, standing(-4e-4), 1e-3);
    block.state.v[0] = 0.1;
    block.run(0.2);
    assert!((block.velocity().x - 0.1).abs() < 1e-6, "{}", block.velocity());
}
