#![allow(clippy::print_stdout, missing_docs)]
#[path = "../tests/suite/walking_stance.rs"]
mod walking_stance;
use sole::*;
fn main() {
    let model = SoleModel::build(&SoleSettings::default()).unwrap();
    let settings = EstimatorSettings { tolerance: 1e-6, ..EstimatorSettings::default() };
    let mut e = StanceEstimator::new(model, settings);
    for round in 0..3 {
        e.touch_down(Foothold::default());
        for tick in 0..walking_stance::TICKS {
            let r = walking_stance::reference(tick, false);
            let t = std::time::Instant::now();
            let rep = e.step(&r);
            let us = t.elapsed().as_secs_f64() * 1e6;
            if round == 2 && (us > 250.0 || tick % 20 == 0) {
                println!(
                    "{tick} F {:.1} {us:.0} us it {} land {} lift {} free {} stick {} slide {}",
                    r.force.z, rep.iterations, rep.landings, rep.lift_offs, rep.free, rep.sticking, rep.sliding
                );
            }
        }
    }
}

#[test]
fn lu_time() {}
