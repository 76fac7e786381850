//! Forward dynamics with a check of its own accuracy.

use crate::algorithms::{aba, rnea};
use crate::model::{Configuration, Model};
use crate::workspace::Workspace;
use nalgebra::DVector;

/// [`aba`], improved by one step of iterative refinement, `out = vd + M^-1 (tau - rnea(vd))`. Returns what the step changed:
/// the largest difference over the largest acceleration.
///
/// That number estimates the relative error that [`aba`] makes alone. It is near 1e-15 for ordinary robots and grows with
/// the condition number of M: two links folded onto each other, a point mass on three joints. The step itself gains little,
/// for [`rnea`] and [`aba`] round alike; a large number says that the forces hardly determine the accelerations here.
/// Infinite where the result is not finite: the articulated inertia of a joint vanished, or an input was NaN.
/// How good the estimate is: `tools/oracles/dynamics.py --exact`. Takes two [`aba`] and one [`rnea`].
pub fn aba_refined(
    model: &Model,
    ws: &mut Workspace,
    q: &Configuration,
    v: &DVector<f64>,
    tau: &DVector<f64>,
    out: &mut DVector<f64>,
) -> f64 {
    aba(model, ws, q, v, tau, out);
    // Lent out, because the algorithms take the whole workspace; an empty vector has no memory.
    let mut forces = std::mem::replace(&mut ws.forces, DVector::zeros(0));
    rnea(model, ws, q, v, out, &mut forces);
    // tau + (tau - rnea(vd)): the bias forces are subtracted once more inside.
    forces.zip_apply(tau, |found, wanted| *found = wanted + (wanted - *found));
    ws.unrefined.copy_from(out);
    aba(model, ws, q, v, &forces, out);
    ws.forces = forces;
    if !out.iter().all(|x| x.is_finite()) {
        return f64::INFINITY;
    }
    let change = out.iter().zip(&ws.unrefined).map(|(after, before)| (after - before).abs()).fold(0.0, f64::max);
    // The smallest number only keeps 0 / 0 away.
    change / out.amax().max(f64::MIN_POSITIVE)
}
