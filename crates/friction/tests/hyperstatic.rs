//! Rigid bodies on more points than hold them: `W` has rank 6 per body, forces are not unique, and every problem is
//! solved at 1e-8.
#[path = "support/bodies.rs"]
mod bodies;

use bodies::{Scene, arch, slab, stack, wall};
use friction::{ContactProblem, Settings, Status, Workspace, solve};
use nalgebra::Vector3;

fn solved(name: &str, scene: &Scene, mu: f64) -> (ContactProblem, friction::Report) {
    let problem = scene.problem(mu);
    let n = problem.contact_count();
    let report = solve(&problem, &mut Workspace::new(n), &Settings::default());
    assert_eq!(report.status, Status::Solved, "{name}, mu {mu}, {n} contacts: {:?}", report.residual);
    assert!(problem.residual(&report.force).relative <= 1e-8, "{name}, mu {mu}: judged anew");
    (problem, report)
}

#[test]
fn a_slab_on_up_to_144_points_rests_slides_and_tips() {
    for k in [2, 6, 9, 12] {
        // Weight 283 N: rests, slides by friction 0.2, tips.
        for push in [0.0, 120.0, 700.0] {
            for mu in [0.2, 0.8] {
                let scene = slab(k, Vector3::new(push, 0.3 * push, 0.0));
                let (problem, report) = solved(&format!("slab {k}, {push} N"), &scene, mu);
                if push == 0.0 {
                    let lift: f64 = (0..problem.contact_count()).map(|a| report.force[3 * a + 2]).sum();
                    assert!((lift / scene.weight_n() - 1.0).abs() < 1e-6, "{lift} N");
                }
            }
        }
    }
}

#[test]
fn stacks_of_boxes_are_solved() {
    for seed in 1..4 {
        for (count, k) in [(3, 2), (3, 5), (6, 2), (6, 4), (10, 3)] {
            let scene = stack(count, k, seed);
            for mu in [0.2, 0.6, 1.0] {
                solved(&format!("stack {count}, {k}, seed {seed}"), &scene, mu);
            }
        }
    }
}

#[test]
fn arches_are_solved_standing_or_falling() {
    for seed in 1..3 {
        for (count, k) in [(7, 2), (13, 2), (21, 2), (13, 4)] {
            let scene = arch(count, k, seed);
            for mu in [0.1, 0.4, 0.8] {
                solved(&format!("arch {count}, {k}, seed {seed}"), &scene, mu);
            }
        }
    }
}

#[test]
fn walls_of_bricks_are_solved() {
    for seed in 1..3 {
        for (courses, bricks, k) in [(2, 3, 2), (4, 3, 2), (3, 2, 3)] {
            let scene = wall(courses, bricks, k, seed);
            for mu in [0.2, 0.6, 1.0] {
                solved(&format!("wall {courses} x {bricks}, {k}, seed {seed}"), &scene, mu);
            }
        }
    }
}
