//! Closed loop on an ideal plant, which moves exactly as the step says.

use crate::support::watch::Watch;
use crate::support::{Joints, PERIOD_S, Walk, Yield, model, robot, settings, walk};
use wholebody::{Backend, SolverSettings, StepStatus, TaskId, WholeBody};

/// The pattern's own load transfer: `k` is a quintic over 0.4 s, its largest rate 1.875 / 0.4 s; M g = 383 N. The two feet's
/// loads may change at most 1.6 times as fast as the pattern's, in any period; a corner's no faster than its foot's.
const LOAD_SLOPE_N_PER_S: f64 = 1.6 * 383.0 * 1.875 / 0.4;
/// M g times the pattern's largest sideways acceleration, 0.05 g, changes its sign and its foot within the same 0.4 s.
const TANGENTIAL_SLOPE_N_PER_S: f64 = 2.0 * 0.05 * 383.0 * 1.875 / 0.4;

#[test]
fn hrp4_follows_a_planned_walk_with_every_constraint_met() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    // At every tick: solved, residuals at rounding, positions, speeds, torques, loads, every corner's cone, distances.
    let mut watch = Watch::new(&body);
    walk(&Walk::straight(11), &mut body, PERIOD_S, |tick, _, reference, report| watch.look(tick, reference, report));
    let said = watch.figures();
    assert!(watch.com_error_m < 1e-3, "{said}");
    // The plant holds accelerations over a period: the soles' jerk leaves this much.
    assert!(watch.contact_error_m < 2e-5 && watch.contact_error_rad < 1e-5, "{said}");
    assert!(watch.distance_min_m > 0.03 && watch.distance_min_m < 0.04, "{said}");
    assert!(watch.load_slope_n_per_s < LOAD_SLOPE_N_PER_S, "{said}");
    assert!(watch.corner_slope_n_per_s < LOAD_SLOPE_N_PER_S, "{said}");
    assert!(watch.tangential_slope_n_per_s < TANGENTIAL_SLOPE_N_PER_S, "{said}");
    assert!(watch.turns() <= 2, "{said}");
}

/// Changes of the active set in the step at which a foot comes or goes. Found one by one, the intensities of a foot that
/// carries nothing yet would take as many changes as there are generators: 16 to 64.
const CHANGES_AT_SWITCHING_MAX: u32 = 2;

#[test]
fn a_foot_that_comes_or_goes_hardly_changes_the_active_set_however_many_generators_there_are() {
    let robot = robot();
    let plan = Walk::straight(2);
    for generators_per_point in [4, 8, 16] {
        let model = model(&robot, Joints::Legs);
        let mut settings = settings(&robot, &model);
        settings.constraints.generators_per_point = generators_per_point;
        let mut body = WholeBody::new(model, settings).expect("settings fit the model");
        let (mut before, mut switchings) = ([true; 2], 0);
        walk(&plan, &mut body, PERIOD_S, |tick, _, reference, report| {
            let now = [0, 1].map(|foot: usize| reference.feet[foot].in_contact);
            if now != before {
                switchings += 1;
                let changes = report.iterations;
                assert!(changes <= CHANGES_AT_SWITCHING_MAX, "{generators_per_point}, tick {tick}: {changes} changes");
            }
            before = now;
        });
        assert_eq!(switchings, 4, "two steps");
    }
}

#[test]
fn stages_are_timed_by_the_clock_that_is_handed_in() {
    use std::sync::atomic::{AtomicU64, Ordering};
    static NOW: AtomicU64 = AtomicU64::new(0);
    let robot = robot();
    let model = model(&robot, Joints::Legs);
    let settings = settings(&robot, &model);
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let reference = Walk::straight(1).reference(0.0);
    let state = crate::support::start(body.model(), body.settings(), &reference);
    assert_eq!(body.step(&state, &reference, PERIOD_S).timings, wholebody::Timings::default());
    body.set_clock(|| NOW.fetch_add(1000, Ordering::Relaxed)); // every look takes a microsecond
    let timings = body.step(&state, &reference, PERIOD_S).timings;
    let stages = [timings.terms_ns, timings.collision_ns, timings.assembly_ns, timings.solve_ns, timings.output_ns];
    assert_eq!(stages, [1000; 5]);
}

#[test]
fn all_34_joints_and_rigid_soles_walk_too() {
    let robot = robot();
    let model = model(&robot, Joints::Full);
    let settings = settings(&robot, &model);
    assert_eq!(model.nv(), 40);
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let plan = Walk { soles: Yield::RIGID, ..Walk::straight(3) };
    walk(&plan, &mut body, PERIOD_S, |tick, _, _, report| {
        assert_eq!(report.status, StepStatus::Solved, "tick {tick}");
        assert!(report.body_error.fixed_rows::<3>(0).norm() < 1e-3, "tick {tick}");
    });
}

#[test]
fn both_backends_walk_the_same_walk() {
    let robot = robot();
    let plan = Walk::straight(1);
    let run = |backend: Backend| {
        let model = model(&robot, Joints::Legs);
        let mut settings = settings(&robot, &model);
        settings.solver = SolverSettings { backend, interior_tolerance: 1e-8, ..settings.solver };
        let mut body = WholeBody::new(model, settings).expect("settings fit the model");
        let mut torques = Vec::new();
        walk(&plan, &mut body, PERIOD_S, |_, _, _, report| {
            assert_eq!(report.status, StepStatus::Solved);
            torques.push(report.torques.clone());
        });
        torques
    };
    let own = run(Backend::ActiveSet);
    let clarabel = run(Backend::Interior);
    let worst = own.iter().zip(&clarabel).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max);
    // Intensities are damped by 1e-5 only: an interior point at 1e-8 knows them to about a newton.
    assert!(worst < 0.5, "{worst} N m");
}

#[test]
fn costs_sum_to_twice_the_objective_up_to_the_constant_of_the_targets() {
    let robot = robot();
    let plan = Walk::straight(1);
    let model = model(&robot, Joints::Walking);
    let free = settings(&robot, &model);
    // The constant is the sum of squared targets, which tight and loose limits share: what tighter limits cost must show in
    // the reported terms as it shows in the objective.
    let mut tight = free.clone();
    tight.constraints.torque_factor = 0.16;
    let solve = |settings: &wholebody::WholeBodySettings| {
        let mut body = WholeBody::new(model.clone(), settings.clone()).expect("settings fit the model");
        let state = crate::support::start(body.model(), body.settings(), &plan.reference(0.0));
        let reference = plan.reference(1.2);
        let report = body.step(&state, &reference, PERIOD_S).clone();
        assert_eq!(report.status, StepStatus::Solved, "{:?}", report.relaxed);
        let problem = body.last_program().expect("a step was made");
        let mut solver = qp::dense::ActiveSet::new(problem.size(), qp::dense::ActiveSetSettings::default());
        let objective = qp::dense::Solver::solve(&mut solver, problem).report.objective;
        (report.tasks.iter().map(|task| task.cost).sum::<f64>(), objective)
    };
    let ((free_cost, free_objective), (tight_cost, tight_objective)) = (solve(&free), solve(&tight));
    assert!(tight_cost > free_cost, "tighter limits cost something: {tight_cost} {free_cost}");
    let (costs, objectives) = (tight_cost - free_cost, 2.0 * (tight_objective - free_objective));
    assert!((costs - objectives).abs() < 1e-6 * free_cost.max(costs), "{costs} {objectives}");
}

#[test]
fn every_cost_term_is_reported_and_the_program_can_be_solved_again() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings = settings(&robot, &model);
    settings.tasks.torque_weight = 1e-4;
    settings.tasks.angular_momentum.weight = 1.0;
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let plan = Walk::straight(1);
    let reference = plan.reference(1.2);
    let state = crate::support::start(body.model(), body.settings(), &plan.reference(0.0));
    let report = body.step(&state, &reference, PERIOD_S).clone();
    assert_eq!(report.status, StepStatus::Solved);
    let ids: Vec<_> = report.tasks.iter().map(|task| task.id).collect();
    for id in [TaskId::Com, TaskId::Torso, TaskId::Posture, TaskId::Damping, TaskId::Torque, TaskId::AngularMomentum] {
        assert!(ids.contains(&id), "{id:?} in {ids:?}");
    }
    let problem = body.last_program().expect("a step was made").clone();
    assert!(report.tasks.iter().all(|task| task.cost >= 0.0 && task.cost.is_finite()));
    // The program that was dumped is the program that was solved, whoever solves it again.
    let mut other = qp::dense::Interior::new(problem.size(), qp::dense::InteriorSettings::default());
    let outcome = qp::dense::Solver::solve(&mut other, &problem);
    let mut own = qp::dense::ActiveSet::new(problem.size(), qp::dense::ActiveSetSettings::default());
    let again = qp::dense::Solver::solve(&mut own, &problem);
    let (a, b) = (outcome.report.objective, again.report.objective);
    assert!((a - b).abs() < 1e-6 * a.abs().max(1.0), "a dumped program is solved again: {a} {b}");
    assert!((again.report.x.rows(0, report.acceleration.len()) - &report.acceleration).amax() < 1e-9);
    let nv = report.acceleration.len();
    let intensities = again.report.x.rows(nv, again.report.x.len() - nv);
    let damping = report.tasks.iter().find(|task| task.id == TaskId::Damping).expect("reported").cost;
    let expected = body.settings().tasks.intensity_damping * intensities.norm_squared();
    assert!((damping - expected).abs() < 1e-9 * expected, "{damping} {expected}");
}

#[test]
fn errors_of_the_body_and_of_the_contacts_are_those_of_the_state_and_corners_carry_the_wrench() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let mut reference = Walk::straight(1).reference(0.0);
    let state = crate::support::start(body.model(), body.settings(), &reference);
    let (com_m, torso_rad, contact_m, contact_rad) = (1e-4, 2e-4, 3e-5, 4e-5);
    reference.com_position.x += com_m;
    reference.torso_rotation = spatial::so3::about_z(torso_rad) * reference.torso_rotation;
    reference.feet[1].ankle_pose.translation.y -= contact_m;
    reference.feet[1].ankle_pose.rotation = spatial::so3::about_x(contact_rad) * reference.feet[1].ankle_pose.rotation;
    // The load of each foot is planned to be in front and on its left.
    for foot in &mut reference.feet {
        foot.zmp += nalgebra::Vector2::new(0.03, 0.01);
    }
    let report = body.step(&state, &reference, PERIOD_S).clone();
    assert_eq!(report.status, StepStatus::Solved, "{:?}", report.contradiction);
    let found = [
        (report.body_error[0], com_m),
        (report.body_error[5], torso_rad),
        (report.contact_errors[1].position_m, contact_m),
        (report.contact_errors[1].orientation_rad, contact_rad),
        (report.contact_errors[0].position_m, 0.0),
    ];
    found.iter().for_each(|(found, expected)| assert!((found - expected).abs() < 1e-9, "{found} {expected}"));
    for (id, error) in [(TaskId::Com, com_m), (TaskId::Torso, torso_rad)] {
        let task = report.tasks.iter().find(|task| task.id == id).expect("reported");
        assert!((task.tracking_error - error).abs() < 1e-9, "{task:?}");
    }
    // Moments of the corners' forces about the ankle, at the corners of the sole on the ground.
    let sole = body.settings().sole;
    for (foot, (force, target)) in report.feet.iter().zip(&reference.feet).enumerate() {
        let ankle_in_sole = body.settings().feet[foot].ankle_in_sole_m;
        let ankle = body.terms().frames[foot].placement;
        let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)]; // front left, front right, rear right, rear left
        let moment = signs.iter().zip(&force.corners).fold(spatial::Vec3::zeros(), |sum, ((x, y), corner)| {
            let at = spatial::Vec3::new(0.5 * x * sole.length_m, 0.5 * y * sole.width_m, 0.0) - ankle_in_sole;
            let mut lever = ankle.rotation * at;
            lever.z = -ankle.translation.z;
            sum + lever.cross(corner)
        });
        assert!((moment - force.wrench.moment).amax() < 1e-9, "{moment} {}", force.wrench.moment);
        assert!(target.in_contact && force.wrench.force.z > 50.0);
    }
}

#[test]
fn what_is_forgotten_has_to_be_found_again() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings = settings(&robot, &model);
    settings.constraints.torque_factor = 0.16; // so that something has to be found
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let plan = Walk::straight(1);
    let state = crate::support::start(body.model(), body.settings(), &plan.reference(0.0));
    let reference = plan.reference(1.2);
    let first = body.step(&state, &reference, PERIOD_S).iterations;
    assert!(first > 0);
    assert_eq!(body.step(&state, &reference, PERIOD_S).iterations, 0, "the same again is known");
    body.forget();
    assert!(body.last_program().is_none());
    assert_eq!(body.step(&state, &reference, PERIOD_S).iterations, first);
}
