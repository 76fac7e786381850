//! After construction nothing allocates.

use crate::random_robot::{Random, configuration, coupled_model, model};
use multibody::*;
use nalgebra::{DMatrix, DVector};

fn allocations_of(work: impl FnOnce()) -> u64 {
    allocation_counter::measure(work).count_total
}

#[test]
fn the_guard_sees_an_allocation() {
    assert_eq!(allocations_of(|| drop(std::hint::black_box(vec![0_u8; 100]))), 1);
}

#[test]
fn algorithms_do_not_allocate() {
    let options = |base| ModelOptions { base, ..ModelOptions::default() };
    let robots = [Base::Floating, Base::Fixed].map(|base| [model(3, &options(base)), coupled_model(3, &options(base))]);
    for model in robots.into_iter().flatten() {
        let mut random = Random(9);
        let (q, nv) = (configuration(&model, &mut random), model.nv());
        let (v, a, tau) = (random.list(nv, 1.0), random.list(nv, 1.0), random.list(nv, 1.0));
        let frames = [FrameIndex(1), FrameIndex(model.frames().len() - 1)];
        let external = [(frames[1], spatial::Wrench { force: random.vector(1.0), moment: random.vector(1.0) })];
        let mut ws = Workspace::new(&model);
        let mut terms = WholeBodyTerms::new(&model, &frames);
        let (mut vector, mut matrix) = (DVector::zeros(nv), DMatrix::zeros(nv, nv));
        let (mut jacobian, mut com) = (DMatrix::zeros(6, nv), DMatrix::zeros(3, nv));
        let mut factor = MassFactor::new(&model);
        let mut moved = q.clone();
        let count = allocations_of(|| {
            for _ in 0..2 {
                let mut moving = forward_kinematics_velocity(&model, &mut ws, &q, &v);
                moving.jacobian(frames[1], &mut jacobian);
                moving.com_jacobian(&mut com);
                std::hint::black_box((
                    moving.drift(frames[1]),
                    moving.pose(frames[0]),
                    moving.velocity(frames[0]),
                    moving.center_of_mass(),
                ));
                rnea_with_external(&model, &mut ws, &q, &v, &a, &external, &mut vector);
                bias_forces(&model, &mut ws, &q, &v, &mut vector);
                gravity_forces(&model, &mut ws, &q, &mut vector);
                aba_with_external(&model, &mut ws, &q, &v, &tau, &external, &mut vector);
                std::hint::black_box(aba_refined(&model, &mut ws, &q, &v, &tau, &mut vector));
                crba(&model, &mut ws, &q, &mut matrix);
                factor.factor(&matrix).expect("every joint carries mass");
                factor.solve(&mut vector);
                whole_body_terms(&model, &mut ws, &q, &v, &mut terms);
                model.integrate(&q, &v, &mut moved);
                model.difference(&q, &moved, &mut vector);
            }
        });
        assert_eq!(count, 0);
    }
}
