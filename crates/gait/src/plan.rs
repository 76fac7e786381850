//! Solving, and reading the walk out of the solution.

use crate::basis::{ANKLE_1, ANKLE_2, COM_END, COM_START, Row, SLOTS, ZMP_1_END, ZMP_1_START, ZMP_END, ZMP_START};
use crate::cost::CostTerms;
use crate::layout::{LENGTH_SCALE_M, Piece};
use crate::problem::{PatternProblem, Program, local_bases};
use crate::{GaitError, GaitSettings};
use pattern::{
    ComSolution, FootPhase, Foothold, Load, PATTERN_VERSION, Phase, PhaseKind, Quintic, Side, Swing, WalkPattern,
    ZmpShift,
};
use qp::backend::clarabel;
use qp::{Report, Residuals, Row as ProblemRow, Status};

/// A planned walk and how it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The walk.
    pub pattern: WalkPattern,
    /// Landings in world coordinates, under the ankles, in the order of time.
    pub landings: Vec<(Side, Foothold)>,
    /// What it costs and how well it was solved.
    pub report: PlanReport,
}

/// What it costs and how well it was solved.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanReport {
    /// Terms of (4) without their weights.
    pub terms: CostTerms,
    /// Terms of (4) with their weights.
    pub weighted_terms: CostTerms,
    /// J of (4).
    pub objective: f64,
    /// Polynomial pieces.
    pub phases: usize,
    /// The programs that were solved: x and y, or both in one.
    pub programs: Vec<ProgramReport>,
}

/// One quadratic program.
#[derive(Debug, Clone, PartialEq)]
pub struct ProgramReport {
    /// Unknowns.
    pub variables: usize,
    /// Equality rows.
    pub equalities: usize,
    /// Two-sided inequality rows.
    pub inequalities: usize,
    /// Stored entries of the Hessian.
    pub hessian_entries: usize,
    /// Stored entries of the constraint rows.
    pub constraint_entries: usize,
    /// How the solver ended.
    pub status: Status,
    /// Interior-point iterations.
    pub iterations: u32,
    /// Optimality in scaled unknowns.
    pub residuals: Residuals,
}

/// Plans a walk: [`PatternProblem::build`] and [`PatternProblem::solve`].
///
/// # Errors
/// See [`GaitError`].
pub fn plan(settings: &GaitSettings) -> Result<Plan, GaitError> {
    PatternProblem::build(settings)?.solve()
}

/// Residuals up to this are accepted when the solver stops short of its own tolerance, as it may when asked for the last
/// digits: there the checks of a plan still hold (COM equation within 1e-9 m/s^2).
const RESIDUAL_MAX: f64 = 1e-8;
/// Asked for more digits than this, the solver may lose its way where it would reach these (measured: with 1e-12 and mu = 0, 10 of 245
/// walks): then it is asked for these.
const TOLERANCE_REACHED: f64 = 1e-10;

/// The unknowns are scaled already (module `layout`), each by what it means; scaled once more by the solver, one walk in twenty-five ends
/// with numerical failure where mu is large (1176 walks: phases of 0.05 s to 20 s, lambda 0 to 1, mu 0 to 1e6).
const EQUILIBRATE: bool = false;
/// Of long walks at lambda = 1 the objective is nearly flat along speeds that vary slowly, by 1e-11 of its largest curvature for 1000
/// swings: with 1e-8 the last iterations only fight the regularisation, and end two digits earlier. From 1e-11 down the factors lose them.
const REGULARISATION: f64 = 1e-10;

/// A NaN is no residual.
fn is_good(report: &Report) -> bool {
    let residual = report.residuals.max();
    residual <= RESIDUAL_MAX || (report.status == Status::Solved && !residual.is_nan())
}

impl PatternProblem {
    /// Solves the problem and reads out the walk.
    ///
    /// # Errors
    /// If no motion satisfies the constraints (naming those that conflict), or the solver gives up.
    pub fn solve(&self) -> Result<Plan, GaitError> {
        let mut reports = Vec::with_capacity(self.programs.len());
        for program in &self.programs {
            let report = self.solve_program(program);
            if report.status == Status::Infeasible {
                return Err(self.explain(program, &report));
            }
            if !is_good(&report) {
                let residual = report.residuals.max();
                let (status, iterations) = (report.status, report.iterations);
                return Err(GaitError::NotSolved { status, iterations, residual });
            }
            reports.push(report);
        }
        Ok(self.read(&reports))
    }

    fn solve_program(&self, program: &Program) -> Report {
        let iterations_max = self.settings.solver.iterations_max;
        let solve = |tolerance: f64| {
            let settings = clarabel::Settings {
                tolerance,
                iterations_max,
                equilibrate: EQUILIBRATE,
                regularisation: REGULARISATION,
            };
            qp::solve_generating(&program.qp, &program.first, &settings)
                .expect("the assembly writes finite, matching arrays")
        };
        let asked = self.settings.solver.tolerance;
        let report = solve(asked);
        let lost = matches!(report.status, Status::SolvedInaccurately | Status::NumericalFailure) && !is_good(&report);
        if !lost || asked >= TOLERANCE_REACHED {
            return report;
        }
        let again = solve(TOLERANCE_REACHED);
        // Solved, but not as precisely as was asked for.
        let status = if again.status == Status::Solved { Status::SolvedInaccurately } else { again.status };
        Report { status, iterations: report.iterations + again.iterations, ..again }
    }

    fn explain(&self, program: &Program, report: &Report) -> GaitError {
        let conflict = report
            .conflict(0.05) // lighter rows only balance the certificate's rounding
            .iter()
            .filter_map(|conflict| match conflict.row {
                ProblemRow::Equality(i) => program.equality_labels.get(i).copied(),
                ProblemRow::Inequality(i) => program.labels.get(i).copied(),
                ProblemRow::Bound(_) => None,
            })
            .collect();
        GaitError::Infeasible { conflict, least_violation_m: program.qp.least_violation(report) * LENGTH_SCALE_M }
    }

    fn read(&self, reports: &[Report]) -> Plan {
        let values: Vec<_> = (self.layout.pieces.iter())
            .map(|piece| {
                [0, 1].map(|axis| {
                    let xi = reports[self.layout.problem_of(axis)].x.as_slice();
                    piece.slots[axis].map(|slot| slot.value(xi))
                })
            })
            .collect();
        let footholds: Vec<_> = (self.layout.stands.iter())
            .map(|stand| {
                let [x_m, y_m] =
                    [0, 1].map(|axis| stand.slots[axis].value(reports[self.layout.problem_of(axis)].x.as_slice()));
                self.to_world(Foothold { x_m, y_m, yaw_rad: stand.guess.yaw_rad })
            })
            .collect();
        let phases = (self.layout.pieces.iter().zip(&values))
            .enumerate()
            .map(|(i, (piece, u))| self.phase(i, piece, u, &footholds))
            .collect();
        let body = &self.settings.body;
        let [x, y] = self.settings.sole.left_ankle_in_sole_m();
        let pattern = WalkPattern {
            version: PATTERN_VERSION,
            mass_kg: body.mass_kg(),
            gravity_m_per_s2: body.gravity_m_per_s2,
            com_height_m: body.com_height_m,
            ankle_height_m: body.ankle_height_m(),
            ankle_in_sole_m: [[x, y], [x, -y]],
            phases,
        };
        let landings = self.layout.stands[2..].iter().zip(&footholds[2..]).map(|(s, f)| (s.side, *f)).collect();
        let terms = self.cost_terms(&values);
        let weighted_terms = terms.weighted(&self.settings.cost);
        let programs = (self.programs.iter().zip(reports))
            .map(|(program, report)| ProgramReport {
                variables: program.qp.variables(),
                equalities: program.qp.b.len(),
                inequalities: program.qp.l.len(),
                hessian_entries: program.qp.P.entries(),
                constraint_entries: program.qp.A.entries() + program.qp.C.entries(),
                status: report.status,
                iterations: report.iterations,
                residuals: report.residuals,
            })
            .collect();
        let objective = weighted_terms.sum();
        let report = PlanReport { terms, weighted_terms, objective, phases: self.phases(), programs };
        Plan { pattern, landings, report }
    }

    fn to_world(&self, foothold: Foothold) -> Foothold {
        let world = self.start.offset(foothold.position());
        Foothold { yaw_rad: self.start.yaw_rad + foothold.yaw_rad, ..world }
    }

    /// A pair of quintics in the frame of the starting pose, as points (`moved`) or differences, in world axes.
    fn turned(&self, [x, y]: [Quintic; 2], moved: bool) -> [Quintic; 2] {
        let (sin, cos) = self.start.yaw_rad.sin_cos();
        let mut turned = [
            Quintic(std::array::from_fn(|i| cos * x.0[i] - sin * y.0[i])),
            Quintic(std::array::from_fn(|i| sin * x.0[i] + cos * y.0[i])),
        ];
        if moved {
            turned[0].0[0] += self.start.x_m;
            turned[1].0[0] += self.start.y_m;
        }
        turned
    }

    fn phase(&self, index: usize, piece: &Piece, u: &[[f64; SLOTS]; 2], footholds: &[Foothold]) -> Phase {
        let (T, omega) = (piece.duration_s, self.shapes[index].basis.omega);
        let three = |u: &[f64; SLOTS], slot: usize| [u[slot], u[slot + 1], u[slot + 2]];
        let zmp = [0, 1].map(|a| Quintic::hermite(T, three(&u[a], ZMP_START), three(&u[a], ZMP_END)));
        let com = [0, 1].map(|a| ComSolution::through(&zmp[a], T, omega, u[a][COM_START], u[a][COM_END]));
        let double = piece.kind != PhaseKind::SingleSupport;
        let (mut zmp_1, mut load) = ([Quintic::default(); 2], Load::single_support());
        if double {
            zmp_1 = [0, 1].map(|a| Quintic::hermite(T, three(&u[a], ZMP_1_START), three(&u[a], ZMP_1_END)));
            let (cancelled_power, share) = piece.transfer.share(T);
            let excess = [0, 1].map(|a| {
                if cancelled_power == 0 {
                    return zmp_1[a].minus(&zmp[a]);
                }
                // Equal starts: only the ends differ, and what they contribute carries t^3.
                let (one, all) = (three(&u[a], ZMP_1_END), three(&u[a], ZMP_END));
                Quintic::hermite(T, [0.0; 3], std::array::from_fn(|i| one[i] - all[i])).divided_by_cube()
            });
            load = Load { cancelled_power, share, excess: self.turned(excess, false) };
        }
        let polynomials = self.turned([com[0].polynomial, com[1].polynomial], true);
        let (sin, cos) = self.start.yaw_rad.sin_cos();
        let turn = |x: f64, y: f64| [cos * x - sin * y, sin * x + cos * y];
        let decaying = turn(com[0].decaying, com[1].decaying);
        let growing = turn(com[0].growing, com[1].growing);
        let com =
            [0, 1].map(|a| ComSolution { polynomial: polynomials[a], decaying: decaying[a], growing: growing[a] });

        let stands = &self.layout.stands;
        let side_1 = stands[piece.foot_1].side;
        let standing = |stand: usize| FootPhase {
            ankle_foothold: footholds[stand],
            contact_since_s: stands[stand].since_s,
            swing: None,
        };
        let foot_1 = match piece.flight {
            None => standing(piece.foot_1),
            Some((landing, t_start_s, t_end_s)) => FootPhase {
                ankle_foothold: footholds[landing],
                contact_since_s: t_end_s,
                swing: Some(Swing {
                    from_foothold: footholds[piece.foot_1],
                    t_start_s,
                    t_end_s,
                    apex_m: self.settings.swing.apex_m,
                }),
            },
        };
        let foot_2 = standing(piece.foot_2);
        Phase {
            start_s: piece.start_s,
            duration_s: T,
            kind: piece.kind,
            step: piece.step,
            foot_1: side_1,
            zmp: self.turned(zmp, true),
            com,
            load,
            zmp_1: if double { self.turned(zmp_1, true) } else { zmp_1 },
            zmp_shift: ZmpShift::default(),
            feet: if side_1 == Side::Left { [foot_1, foot_2] } else { [foot_2, foot_1] },
        }
    }

    fn cost_terms(&self, values: &[[[f64; SLOTS]; 2]]) -> CostTerms {
        let mut terms = CostTerms::default();
        for ((piece, shape), u) in self.layout.pieces.iter().zip(&self.shapes).zip(values) {
            for u in u {
                let slots = u.map(|value| crate::layout::Slot { base: value, ..Default::default() });
                let u = Row::from(local_bases(&slots, u[ANKLE_2], piece.transfer));
                let forms = &shape.forms;
                terms.com_force += u.dot(&(forms.com_force * u));
                let torque = u.dot(&(forms.ankle_torque * u));
                if piece.kind == PhaseKind::SingleSupport {
                    terms.ankle_torque_single += torque;
                } else {
                    debug_assert!(u[ANKLE_1].is_finite());
                    terms.ankle_torque_double += torque;
                    terms.zmp_acceleration += u.dot(&(forms.zmp_acceleration * u));
                }
            }
        }
        terms
    }
}
