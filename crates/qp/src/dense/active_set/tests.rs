//! What the public interface does not show.

use super::*;

#[test]
fn of_rows_violated_together_the_most_violated_comes_first_and_what_it_mends_is_left_alone() {
    // Nearest to zero: x0 >= 0.5 follows from x0 >= 1, which is listed after it; x1 >= 2 is a third row.
    let mut problem = Problem::new(Size { variables: 2, equalities: 0, inequalities: 2 });
    problem.C.copy_from_slice(&[1.0, 1.0, 0.0, 0.0]);
    problem.l.copy_from_slice(&[0.5, 1.0]);
    problem.lb[1] = 2.0;
    let mut solver = ActiveSet::new(problem.size(), ActiveSetSettings::default());
    let outcome = solver.solve(&problem);
    assert_eq!(outcome.report.status, Status::Solved);
    assert_eq!(outcome.report.x.as_slice(), [1.0, 2.0]);
    let active = [Row::Bound(1), Row::Inequality(1)].map(|row| Active { row, side: Side::Lower });
    assert_eq!(outcome.active, active);
    assert_eq!(outcome.report.iterations, 2);
}

#[test]
fn a_violation_that_rounding_hides_at_the_other_measure_ends_the_search_too() {
    // x = 1/3 gives the row 0.1, and the side lies a tolerance above it: one last digit decides, and `a x` and `d
    // y` have not always the same. On a thread, so that a search without end fails the test.
    let (done, ended) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let mut problem = Problem::new(Size { variables: 1, equalities: 0, inequalities: 1 });
        problem.P[(0, 0)] = 3.0;
        problem.c[0] = -1.0;
        problem.C[0] = 0.3;
        let mut solver = ActiveSet::new(problem.size(), ActiveSetSettings::default());
        for k in -2000..2000 {
            problem.l[0] = 0.10000000001000074 + f64::from(k) * 0.1 * f64::EPSILON;
            solver.forget();
            let outcome = solver.solve(&problem);
            assert_eq!(outcome.report.status, Status::Solved, "{k}");
            assert!(outcome.report.iterations <= 1, "{k}: {}", outcome.report.iterations);
        }
        done.send(()).expect("the test waits");
    });
    ended.recv_timeout(std::time::Duration::from_secs(120)).expect("it ends, and well");
}

#[test]
fn rows_that_are_met_by_now_do_not_count_against_the_limit() {
    // As above: two rows are taken up, and the third follows from them.
    let mut problem = Problem::new(Size { variables: 2, equalities: 0, inequalities: 2 });
    problem.C.copy_from_slice(&[1.0, 1.0, 0.0, 0.0]);
    problem.l.copy_from_slice(&[0.5, 1.0]);
    problem.lb[1] = 2.0;
    for (iterations_max, status) in [(1, Status::IterationLimit), (2, Status::Solved)] {
        let settings = ActiveSetSettings { iterations_max, ..ActiveSetSettings::default() };
        assert_eq!(ActiveSet::new(problem.size(), settings).solve(&problem).report.status, status);
    }
}

#[test]
fn a_row_left_half_way_leaves_no_trace() {
    // One step takes up the row while the bounds leave one by one; the limit stops it among them.
    let n = 6;
    let mut problem = Problem::new(Size { variables: n, equalities: 0, inequalities: 1 });
    problem.c.iter_mut().enumerate().for_each(|(i, c)| *c = 1.0 + i as f64);
    problem.lb.fill(0.0);
    problem.C.fill(1.0);
    let settings = ActiveSetSettings { iterations_max: 3, ..ActiveSetSettings::default() };
    let mut solver = ActiveSet::new(problem.size(), settings);
    let all: Vec<Active> = (0..n).map(|i| Active { row: Row::Bound(i), side: Side::Lower }).collect();
    solver.guess(&all);
    problem.l[0] = 1000.0;
    let outcome = solver.solve(&problem);
    assert_eq!((outcome.report.status, outcome.active.len()), (Status::IterationLimit, n - 3));
    assert!(outcome.report.residuals.stationarity < 1e-12, "{:?}", outcome.report.residuals);
}

#[test]
fn the_point_at_which_iterations_run_out_belongs_to_its_multipliers() {
    // All bounds are violated at the start, and each may be taken up but the last.
    let n = 5;
    let mut problem = Problem::new(Size { variables: n, equalities: 0, inequalities: 0 });
    problem.lb.fill(1.0);
    let settings = ActiveSetSettings { iterations_max: n - 1, ..ActiveSetSettings::default() };
    let outcome = ActiveSet::new(problem.size(), settings).solve(&problem).clone();
    assert_eq!(outcome.report.status, Status::IterationLimit);
    assert_eq!(outcome.active.len(), n - 1);
    assert_eq!(outcome.report.residuals.stationarity, 0.0);
    assert_eq!(outcome.violation, 1.0);
}
