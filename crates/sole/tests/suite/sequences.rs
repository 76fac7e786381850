//! Sequences that no smooth walk has: every tick is found in time, or ended with the reason.

use crate::families::FAMILIES;
use crate::stances::laws_hold;
use sole::{EstimatorSettings, Foothold, StanceEstimator, Status};

#[test]
fn drops_jolts_and_alternations_are_found_in_time() {
    for (number, family) in FAMILIES.iter().enumerate() {
        let model = family.sole();
        let mut estimator = StanceEstimator::new(model.clone(), EstimatorSettings::default());
        let limit = estimator.slow_work_max();
        let (mut solved, mut ticks, mut most) = (0, 0, 0);
        // Another seed for each, of which the long form (`examples/sequences.rs`) runs many.
        for (lands, load) in family.loads(100 + number as u64) {
            if lands {
                estimator.touch_down(Foothold::default());
            }
            let report = estimator.step(&load).clone();
            ticks += 1;
            most = most.max(report.multiplications);
            match report.status {
                status if status.is_solved() => {
                    laws_hold(&model, &report, load.force.norm());
                    solved += 1;
                }
                Status::Fold { .. } | Status::NotFound { .. } | Status::ZmpOutsideSole { .. } => {}
                other => panic!("{}: {other:?}", family.name),
            }
        }
        // One iteration may be begun at the limit.
        assert!(most < limit + limit / 4, "{}: {most} multiplications", family.name);
        if family.is_ordinary() {
            assert_eq!(solved, ticks, "{}", family.name);
        }
    }
}
