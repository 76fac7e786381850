//! Closed loop on an ideal plant.

use crate::support::{Joints, PERIOD_S, Walk, model, robot, settings, walk};
use wholebody::{StepStatus, WholeBody};

#[test]
fn hrp4_follows_a_planned_walk_within_a_millimetre() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let plan = Walk::straight(4);
    let mut worst = 0.0_f64;
    let mut contact = (0.0_f64, 0.0_f64);
    let mut kkt = 0.0_f64;
    let mut other = 0;
    walk(&plan, &mut body, PERIOD_S, |tick, _, reference, report| {
        if report.status != StepStatus::Solved {
            other += 1;
            if other < 20 {
                eprintln!(
                    "{tick} {:?} {:?} {:?} {:?} {:?}",
                    report.status,
                    report.solver_status,
                    report.relaxed,
                    report.contradiction,
                    reference.feet.map(|f| (f.in_contact, f.load_share))
                );
            }
        }
        if tick % 100 == 0 {
            eprintln!(
                "{tick} com {:.2e} it {} active {} {:?} {:?}",
                report.body_error.amax(),
                report.iterations,
                report.active.len(),
                report.feet.map(|f| f.wrench.force.z),
                report.distance_min_m
            );
        }
        worst = worst.max(report.body_error.fixed_rows::<3>(0).norm());
        for e in report.contact_errors {
            contact = (contact.0.max(e.position_m), contact.1.max(e.orientation_rad));
        }
        kkt = kkt.max(report.residuals.max());
    });
    eprintln!("com {worst:e} contact {contact:?} kkt {kkt:e} other {other}");
    assert!(worst < 1e-3);
}
