//! The paper's own formulation, as literally as it can be computed, against the sparse one.
//!
//! Here `V, W` of `V cosh + W sinh` (9) are eliminated by the linear system (A.7), so that the COM is a dense function of the
//! ZMP's via-points and the only COM equations left are the two end velocities (A.2), (A.6). One axis, SI units without
//! scaling of rows, another quadrature, a dense Hessian. Only the QP solver is the same.

use crate::support::straight;
use gait::{CostSettings, GaitSettings, plan};
use nalgebra::{DMatrix, DVector};
use pattern::Side;
use qp::backend::clarabel;
use qp::{QuadraticProgram, SparseMatrix, Status};

/// Value as an affine function of the unknowns; the last entry is the constant.
type Affine = DVector<f64>;

struct Piece {
    T: f64,
    /// Load share of foot 2 at both ends; `None` in single support.
    k: Option<(f64, f64)>,
    ankle_1: f64,
    ankle_2: f64,
    side_1: Side,
    side_2: Side,
    /// Coefficients of the ZMP and of ZMP1.
    a: [Affine; 6],
    b: [Affine; 6],
}

/// Coefficients of a quintic from its ends by solving the 6 x 6 system, not by formula.
fn quintic(T: f64, ends: [&Affine; 6]) -> [Affine; 6] {
    let mut M = DMatrix::zeros(6, 6);
    for i in 0..6 {
        let falling = |order: usize| (0..order).fold(1.0, |f, j| f * (i as f64 - j as f64));
        for order in 0..3 {
            M[(order, i)] = if i == order { falling(order) } else { 0.0 };
            M[(3 + order, i)] = if i >= order { falling(order) * T.powi((i - order) as i32) } else { 0.0 };
        }
    }
    let inverse = M.try_inverse().expect("Hermite interpolation is unique");
    std::array::from_fn(|i| (0..6).map(|j| ends[j] * inverse[(i, j)]).sum())
}

fn at(a: &[Affine; 6], order: usize, t: f64) -> Affine {
    (order..6).map(|i| &a[i] * ((0..order).fold(1.0, |f, j| f * (i - j) as f64) * t.powi((i - order) as i32))).sum()
}

struct Formulation {
    n: usize,
    pieces: Vec<Piece>,
    V: Vec<Affine>,
    W: Vec<Affine>,
    A: Vec<[Affine; 6]>,
    w: f64,
}

impl Formulation {
    fn new(settings: &GaitSettings, swings: usize, axis: usize) -> Self {
        // Ankles: (side, position) before and after each swing.
        let length = match settings.walk {
            gait::Walk::Straight { step_length_m, .. } => step_length_m,
            _ => unreachable!("straight walks only"),
        };
        let y = settings.start.ankle_distance_m / 2.0;
        let place = |side: Side, x: f64| if axis == 0 { x } else { side.sign() * y };
        let mut feet = [place(Side::Left, 0.0), place(Side::Right, 0.0)];
        let begin = (feet[0] + feet[1]) / 2.0;
        let mut side = settings.start.first_swing;
        type Shape = (f64, Option<(f64, f64)>, Side, [f64; 2]);
        let mut shapes: Vec<Shape> = Vec::new();
        let t = &settings.timing;
        shapes.push((t.start_s / 2.0, Some((0.5, 0.25)), side, feet));
        shapes.push((t.start_s / 2.0, Some((0.25, 1.0)), side, feet));
        for q in 1..=swings {
            let count = if q == 1 || q == swings { 1 } else { 2 };
            for _ in 0..count {
                shapes.push((t.single_support_s / f64::from(count), None, side, feet));
            }
            feet[side.index()] = place(side, length * q.min(swings - 1) as f64);
            if q < swings {
                shapes.push((t.double_support_s, Some((0.0, 1.0)), side.other(), feet));
            } else {
                shapes.push((t.stop_s / 2.0, Some((0.0, 0.75)), side.other(), feet));
                shapes.push((t.stop_s / 2.0, Some((0.75, 0.5)), side.other(), feet));
            }
            side = side.other();
        }
        let end = (feet[0] + feet[1]) / 2.0;
        let m = shapes.len();
        let inner_zmp1 = shapes.iter().take(m - 1).filter(|s| s.1.is_some()).count();
        let n = 3 * (m - 1) + 3 * inner_zmp1;
        let constant = |value: f64| {
            let mut a = Affine::zeros(n + 1);
            a[n] = value;
            a
        };
        let mut next = 0;
        let mut fresh = || {
            [0, 1, 2].map(|_| {
                let mut a = Affine::zeros(n + 1);
                a[next] = 1.0;
                next += 1;
                a
            })
        };
        let rest = |value: f64| [constant(value), constant(0.0), constant(0.0)];
        let mut zmp = rest(begin);
        let mut zmp1 = rest(shapes[0].3[shapes[0].2.index()]);
        let mut pieces = Vec::new();
        for (j, (T, k, side_1, feet)) in shapes.iter().enumerate() {
            let (ankle_1, ankle_2) = (feet[side_1.index()], feet[side_1.other().index()]);
            let zmp_end = if j + 1 == m { rest(end) } else { fresh() };
            let a = quintic(*T, [&zmp[0], &zmp[1], &zmp[2], &zmp_end[0], &zmp_end[1], &zmp_end[2]]);
            let mut b = std::array::from_fn(|_| constant(0.0));
            if let Some((from, _)) = k {
                if *from == 0.0 {
                    zmp1 = zmp.clone();
                }
                let one_end = if j + 1 == m { rest(ankle_1) } else { fresh() };
                b = quintic(*T, [&zmp1[0], &zmp1[1], &zmp1[2], &one_end[0], &one_end[1], &one_end[2]]);
                zmp1 = one_end;
            }
            let (side_1, side_2) = (*side_1, side_1.other());
            pieces.push(Piece { T: *T, k: *k, ankle_1, ankle_2, side_1, side_2, a, b });
            zmp = zmp_end;
        }
        assert_eq!(next, n);
        let w = (settings.body.gravity_m_per_s2 / settings.body.com_height_m).sqrt();
        let mut formulation = Self { n, pieces, V: Vec::new(), W: Vec::new(), A: Vec::new(), w };
        formulation.eliminate(begin, end);
        formulation
    }

    /// (9) for A, (A.7) for V and W.
    fn eliminate(&mut self, begin: f64, end: f64) {
        let (w, m, n) = (self.w, self.pieces.len(), self.n);
        self.A = (self.pieces.iter())
            .map(|piece| {
                std::array::from_fn(|i| {
                    let a = |i: usize| piece.a.get(i).cloned().unwrap_or_else(|| Affine::zeros(n + 1));
                    let product = |from: usize, to: usize| (from..=to).map(|f| f as f64).product::<f64>();
                    a(i) + a(i + 2) * (product(i + 1, i + 2) / w.powi(2))
                        + a(i + 4) * (product(i + 1, i + 4) / w.powi(4))
                })
            })
            .collect();
        let mut G = DMatrix::zeros(2 * m, 2 * m);
        let mut right = DMatrix::zeros(2 * m, n + 1);
        let set = |right: &mut DMatrix<f64>, row: usize, value: Affine| right.row_mut(row).tr_copy_from(&value);
        G[(0, 0)] = 1.0;
        let mut first = -&self.A[0][0];
        first[n] += begin;
        set(&mut right, 0, first);
        for j in 0..m {
            let T = self.pieces[j].T;
            let (c, s) = ((w * T).cosh(), (w * T).sinh());
            let (position, velocity) = (at(&self.A[j], 0, T), at(&self.A[j], 1, T));
            if j + 1 == m {
                G[(2 * m - 1, 2 * j)] = c;
                G[(2 * m - 1, 2 * j + 1)] = s;
                let mut last = -position;
                last[n] += end;
                set(&mut right, 2 * m - 1, last);
                continue;
            }
            let row = 2 * j + 1;
            G[(row, 2 * j)] = c;
            G[(row, 2 * j + 1)] = s;
            G[(row, 2 * j + 2)] = -1.0;
            set(&mut right, row, &self.A[j + 1][0] - position);
            G[(row + 1, 2 * j)] = w * s;
            G[(row + 1, 2 * j + 1)] = w * c;
            G[(row + 1, 2 * j + 3)] = -w;
            set(&mut right, row + 1, &self.A[j + 1][1] - velocity);
        }
        let y = G.full_piv_lu().solve(&right).expect("G is regular");
        self.V = (0..m).map(|j| y.row(2 * j).transpose()).collect();
        self.W = (0..m).map(|j| y.row(2 * j + 1).transpose()).collect();
    }

    fn com(&self, j: usize, order: usize, t: f64) -> Affine {
        let (c, s) = ((self.w * t).cosh(), (self.w * t).sinh());
        let (c, s) = if order.is_multiple_of(2) { (c, s) } else { (s, c) };
        at(&self.A[j], order, t) + (&self.V[j] * c + &self.W[j] * s) * self.w.powi(order as i32)
    }

    /// k, ZMP1, ZMP2 and the accelerations of both; (B.4) with t^3 struck from numerator and denominator where k starts at 0.
    fn double(&self, j: usize, t: f64) -> (f64, [Affine; 2], [Affine; 2]) {
        let piece = &self.pieces[j];
        let (from, to) = piece.k.expect("double support");
        let one = |value: f64| Affine::from_element(1, value);
        let (zero, start, end) = (one(0.0), one(from), one(to));
        let mut k = quintic(piece.T, [&start, &zero, &zero, &end, &zero, &zero]).map(|c| c[0]);
        let share = (0..6).map(|i| k[i] * t.powi(i as i32)).sum();
        let mut e: [Affine; 6] = std::array::from_fn(|i| &piece.b[i] - &piece.a[i]);
        if from == 0.0 {
            for i in 0..6 {
                k[i] = if i < 3 { k[i + 3] } else { 0.0 };
                e[i] = if i < 3 { e[i + 3].clone() } else { Affine::zeros(self.n + 1) };
            }
        }
        let kd = [0, 1, 2].map(|order| at(&k.map(one), order, t)[0]);
        let ed = [0, 1, 2].map(|order| at(&e, order, t));
        // (e/k)'' written out.
        let ratio = &ed[0] / kd[0];
        let ratio2 = &ed[2] / kd[0] - &ed[1] * (2.0 * kd[1] / kd[0].powi(2))
            + &ed[0] * (2.0 * kd[1].powi(2) / kd[0].powi(3) - kd[2] / kd[0].powi(2));
        let (x1, x1dd) = (at(&piece.b, 0, t), at(&piece.b, 2, t));
        (share, [x1.clone(), x1 - ratio], [x1dd.clone(), x1dd - ratio2])
    }

    fn solve(&self, settings: &GaitSettings, axis: usize) -> (Affine, f64) {
        let n = self.n;
        let (M, g, z_a) = (settings.body.mass_kg(), settings.body.gravity_m_per_s2, settings.body.ankle_height_m());
        let CostSettings { lambda, mu } = settings.cost;
        let mut H = DMatrix::zeros(n + 1, n + 1);
        let mut add = |row: &Affine, weight: f64| H.ger(weight, row, row, 1.0);
        let mut rows: Vec<(Affine, f64, f64)> = Vec::new();
        let constant = |value: f64| {
            let mut a = Affine::zeros(n + 1);
            a[n] = value;
            a
        };
        let half = [settings.sole.length_m() / 2.0, settings.sole.width_m() / 2.0][axis] - settings.limits.zmp_margin_m;
        let mut inside = |x: &Affine, ankle: f64, side: Side| {
            let offset = settings.sole.left_ankle_in_sole_m()[axis] * if axis == 1 { side.sign() } else { 1.0 };
            if x.rows(0, n).amax() > 0.0 {
                rows.push((x.clone(), ankle - offset - half, ankle - offset + half));
            }
        };
        // Five-point Gauss on 8 panels: nodes and weights of Abramowitz and Stegun, table 25.4.
        let gauss = [
            (0.0, 0.568_888_888_888_888_9),
            (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
            (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
            (0.906_179_845_938_664, 0.236_926_885_056_189_1),
            (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
        ];
        for (j, piece) in self.pieces.iter().enumerate() {
            let h = piece.T / 8.0;
            for (panel, (node, weight)) in (0..8).flat_map(|p| gauss.map(|g| (p, g))) {
                let t = h * (f64::from(panel) + 0.5 + 0.5 * node);
                let weight = 0.5 * h * weight;
                let force = self.com(j, 2, t) * M;
                add(&force, lambda * weight);
                if piece.k.is_none() {
                    let torque = &force * z_a - (constant(piece.ankle_2) - at(&piece.a, 0, t)) * (M * g);
                    add(&torque, (1.0 - lambda) * weight);
                    continue;
                }
                let (k, zmp, acceleration) = self.double(j, t);
                for (share, ankle, x) in [(1.0 - k, piece.ankle_1, &zmp[0]), (k, piece.ankle_2, &zmp[1])] {
                    let torque = (&force * z_a - (constant(ankle) - x) * (M * g)) * share;
                    add(&torque, (1.0 - lambda) / 2.0 * weight);
                }
                acceleration.iter().for_each(|a| add(a, mu * weight));
            }
            for i in 0..11 {
                let t = piece.T * f64::from(i) / 10.0;
                if piece.k.is_none() {
                    inside(&at(&piece.a, 0, t), piece.ankle_2, piece.side_2);
                } else {
                    let (_, [one, two], _) = self.double(j, t);
                    inside(&one, piece.ankle_1, piece.side_1);
                    inside(&two, piece.ankle_2, piece.side_2);
                }
            }
        }
        let m = self.pieces.len();
        let ends = [self.com(0, 1, 0.0), self.com(m - 1, 1, self.pieces[m - 1].T)];
        // Scaled as the paper's authors should have: 1 cm, and velocities and accelerations by the phase's duration.
        let scale = DVector::from_fn(n, |i, _| 0.01 * [1.0, 4.0, 16.0][i % 3]);
        let D = DMatrix::from_diagonal(&scale);
        let objective = 1.0 / (M * g * 0.01_f64).powi(2);
        let P = &D * H.view((0, 0), (n, n)) * &D * (2.0 * objective);
        let c = &D * H.view((0, n), (n, 1)) * (2.0 * objective);
        let mut qp = QuadraticProgram::unconstrained(
            SparseMatrix::from_dense(&(0.5 * (&P + P.transpose()))),
            c.column(0).into_owned(),
        );
        let matrix = |list: &[&Affine]| DMatrix::from_fn(list.len(), n, |i, j| list[i][j] * scale[j] * 100.0);
        qp.A = SparseMatrix::from_dense(&matrix(&ends.iter().collect::<Vec<_>>()));
        qp.b = DVector::from_fn(2, |i, _| -100.0 * ends[i][n]);
        qp.C = SparseMatrix::from_dense(&matrix(&rows.iter().map(|r| &r.0).collect::<Vec<_>>()));
        qp.l = DVector::from_fn(rows.len(), |i, _| 100.0 * (rows[i].1 - rows[i].0[n]));
        qp.u = DVector::from_fn(rows.len(), |i, _| 100.0 * (rows[i].2 - rows[i].0[n]));
        let report = clarabel::solve(&qp, &clarabel::Settings::default()).expect("well formed");
        assert_eq!(report.status, Status::Solved, "{:?}", report.residuals);
        let mut solution = Affine::zeros(n + 1);
        solution.rows_mut(0, n).copy_from(&report.x.component_mul(&scale));
        solution[n] = 1.0;
        let value = solution.dot(&(&H * &solution));
        (solution, value)
    }
}

#[test]
fn eliminating_v_and_w_as_in_a7_gives_the_same_walk() {
    const METRES: f64 = 1e-6;
    for (swings, lambda, mu) in [(1, 0.6, 15.0), (2, 0.6, 15.0), (3, 0.5, 15.0), (4, 0.2, 2.0)] {
        let settings = GaitSettings { cost: CostSettings { lambda, mu }, ..straight(swings) };
        let ours = plan(&settings).expect("feasible");
        let mut objective = 0.0;
        for axis in 0..2 {
            let theirs = Formulation::new(&settings, swings as usize, axis);
            let (solution, value) = theirs.solve(&settings, axis);
            objective += value;
            for (j, piece) in theirs.pieces.iter().enumerate() {
                for i in 0..=20 {
                    let t = piece.T * f64::from(i) / 20.0;
                    let r = ours.pattern.evaluate_phase(j, t);
                    let close = |what: &str, a: f64, b: &Affine| {
                        let difference = (a - b.dot(&solution)).abs();
                        assert!(difference < METRES, "{swings} swings: {what} of phase {j} at {t}: {difference:e}");
                    };
                    close("ZMP", r.zmp.position[axis], &at(&piece.a, 0, t));
                    close("COM", r.com.position[axis], &theirs.com(j, 0, t));
                    if piece.k.is_some() {
                        let (_, [one, two], _) = theirs.double(j, t);
                        close("ZMP1", r.feet[piece.side_1.index()].zmp.position[axis], &one);
                        close("ZMP2", r.feet[piece.side_2.index()].zmp.position[axis], &two);
                    }
                }
            }
        }
        let relative = (objective - ours.report.objective) / objective;
        assert!(relative.abs() < 1e-6, "{swings} swings: {relative:e}");
    }
}
