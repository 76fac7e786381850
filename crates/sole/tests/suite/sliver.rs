//! A sole with elements almost without volume: nothing of it may be seen in the forces.

use crate::finite_elements::{FOAM, dense_compliance};
use crate::stances::laws_hold;
use crate::walking_stance::{self, TICKS};
use sole::{
    ElasticBody, EstimatorSettings, Foothold, Level, Mesh, MeshSource, SoleModel, SoleSettings, StanceEstimator,
};
use spatial::Vec3;

/// HRP-4's sole on few elements; one inner node has been moved almost into the opposite face of one of its elements, a part of the ground
/// face, down to a fraction of the former distance.
fn with_sliver(fraction: f64) -> Mesh {
    let mut mesh = Mesh::kuhn_box([0.23, 0.13, 0.021], [5, 4, 2]).expect("a box");
    let on_the_ground = |i: &usize| mesh.contact.binary_search(i).is_ok();
    let inside = |p: &Vec3| p.x.abs() < 0.1 && p.y.abs() < 0.06;
    let flat = mesh.tetrahedra.iter().position(|t| {
        t.iter().filter(|i| on_the_ground(i)).count() == 3
            && t.iter().all(|i| on_the_ground(i) || inside(&mesh.nodes[*i]))
    });
    let corners = mesh.tetrahedra[flat.expect("Kuhn's first element of each cell")];
    let apex = *corners.iter().find(|i| !on_the_ground(i)).expect("one of four");
    let foot = corners.iter().filter(|i| **i != apex).map(|i| mesh.nodes[*i]).sum::<Vec3>() / 3.0;
    mesh.nodes[apex] = foot + fraction * (mesh.nodes[apex] - foot);
    mesh.checked().expect("thin, but no element is inverted")
}

/// The flattest is a millionth as high as its neighbours, thinner than any mesher leaves one: 10 nm thick.
const FRACTIONS: [f64; 3] = [1e-2, 1e-4, 1e-6];

#[test]
fn the_condensed_compliance_of_a_sole_with_a_sliver_is_the_inverse_of_the_dense_schur_complement() {
    for fraction in FRACTIONS {
        let mesh = with_sliver(fraction);
        let worst = &mesh.quality_report().worst[0];
        assert!(worst.quality < 10.0 * fraction, "flat: {worst:?}");
        let dense = dense_compliance(&mesh, &FOAM);
        let nodal: Vec<Vec<(usize, f64)>> = mesh.contact.iter().map(|i| vec![(*i, 1.0)]).collect();
        let ours = ElasticBody::new(&mesh, &FOAM).expect("a body").compliance(&nodal);
        let difference = (&ours - &dense).amax() / dense.amax();
        assert!(difference < 1e-10, "{fraction}: {difference:e}");
        assert!(ours.symmetric_eigenvalues().min() > 0.0);
    }
}

#[test]
fn a_sole_with_a_sliver_walks_and_the_contact_laws_hold_at_every_tick() {
    // The ground face of the flattest one hardly deforms: the condition of its compliance is a million, and at loads of a newton rounding
    // leaves more than the billionth that is asked for. The compliance of such a sole is checked above; nobody walks on it.
    for fraction in [FRACTIONS[0], FRACTIONS[1]] {
        for level in [Level::Fem, Level::QuadraticFem] {
            let mesh = MeshSource::Mesh(with_sliver(fraction));
            let settings = SoleSettings { mesh, material: FOAM, level, ..SoleSettings::default() };
            let model = SoleModel::build(&settings).expect("a sole");
            let mut estimator = StanceEstimator::new(model.clone(), EstimatorSettings::default());
            estimator.touch_down(Foothold::default());
            for tick in 0..TICKS {
                let reference = walking_stance::reference(tick, false);
                let report = estimator.step(&reference);
                assert!(report.status.is_solved(), "{level:?} {fraction} tick {tick}: {:?}", report.status);
                laws_hold(&model, report, reference.force.norm());
            }
        }
    }
}
