//! The walk as one quadratic program, or two: without turned feet x and y know nothing of each other.

use crate::basis::{
    ANKLE_1, ANKLE_2, Basis, COM_END, COM_START, Row, SLOTS, Transfer, ZMP_1_END, ZMP_1_START, ZMP_END, ZMP_START,
};
use crate::constraint::{Outline, check_prescribed, step_rules};
use crate::cost::Forms;
use crate::label::{RowLabel, ZmpOf};
use crate::layout::{LENGTH_SCALE_M, Layout, Piece, Slot, Stand};
use crate::quadrature::gauss_legendre;
use crate::{GaitError, GaitSettings, Route};
use nalgebra::DVector;
use pattern::{Foothold, PhaseKind};
use qp::{QuadraticProgram, Triplets};
use std::collections::HashMap;
use std::rc::Rc;

/// The assembled problem, ready to be solved.
pub struct PatternProblem {
    pub(crate) settings: GaitSettings,
    pub(crate) layout: Layout,
    pub(crate) shapes: Vec<Rc<Shape>>,
    pub(crate) programs: Vec<Program>,
    pub(crate) start: Foothold,
}

/// One quadratic program with the meaning of its rows.
pub(crate) struct Program {
    pub qp: QuadraticProgram,
    pub equality_labels: Vec<RowLabel>,
    pub labels: Vec<RowLabel>,
    /// Rows to begin with, see [`qp::solve_generating`].
    pub first: Vec<bool>,
}

/// What phases of equal duration and load transfer share.
pub(crate) struct Shape {
    pub basis: Basis,
    pub forms: Forms,
    /// Rows at the evenly spaced samples: ZMP, ZMP of foot 1, ZMP of foot 2.
    samples: Vec<(f64, [Row; 3])>,
    /// COM velocity at both ends.
    com_velocity: [Row; 2],
}

/// A row in the making: one slot row per axis, times a factor.
type Part<'a> = (usize, &'a Row, &'a [Slot; SLOTS], f64);

struct Assembly {
    unknowns: usize,
    hessian: Triplets,
    gradient: Vec<f64>,
    equalities: Triplets,
    rhs: Vec<f64>,
    equality_labels: Vec<RowLabel>,
    inequalities: Triplets,
    lower: Vec<f64>,
    upper: Vec<f64>,
    labels: Vec<RowLabel>,
    first: Vec<bool>,
}

impl PatternProblem {
    /// Checks the request and writes the problem down.
    ///
    /// # Errors
    /// A setting out of range, feet that do not alternate, a prescribed step that breaks a rule.
    pub fn build(settings: &GaitSettings) -> Result<Self, GaitError> {
        settings.validate()?;
        let route = Route::new(settings)?;
        let layout = Layout::new(&route, settings);
        check_prescribed_steps(&layout, settings)?;
        let body = &settings.body;
        let omega = (body.gravity_m_per_s2 / body.com_height_m).sqrt();
        let rule = gauss_legendre(settings.discretisation.quadrature_nodes as usize);
        let mut known: HashMap<(u64, Transfer), Rc<Shape>> = HashMap::new();
        let shapes: Vec<_> = layout
            .pieces
            .iter()
            .map(|piece| {
                let key = (piece.duration_s.to_bits(), piece.transfer);
                let make = || Rc::new(Shape::new(piece, omega, settings, &rule));
                Rc::clone(known.entry(key).or_insert_with(make))
            })
            .collect();
        // One centimetre between ankle and ZMP, for a second, costs about 1.
        let objective_scale = (body.mass_kg() * body.gravity_m_per_s2 * LENGTH_SCALE_M).powi(-2);
        let mut assemblies: Vec<_> = layout.unknowns[..if layout.coupled { 1 } else { 2 }]
            .iter()
            .map(|unknowns| Assembly::new(*unknowns, layout.pieces.len()))
            .collect();
        add_cost(&mut assemblies, &layout, &shapes, settings, objective_scale);
        add_com_continuity(&mut assemblies, &layout, &shapes, omega);
        add_zmp_rows(&mut assemblies, &layout, &shapes, settings);
        add_step_rows(&mut assemblies, &layout, settings);
        let programs = assemblies.into_iter().map(Assembly::finish).collect();
        let start = Foothold { x_m: settings.start.x_m, y_m: settings.start.y_m, yaw_rad: settings.start.yaw_rad };
        Ok(Self { settings: settings.clone(), layout, shapes, programs, start })
    }

    /// The quadratic programs in scaled unknowns: one for each axis, or one for both.
    pub fn quadratic_programs(&self) -> impl Iterator<Item = &QuadraticProgram> {
        self.programs.iter().map(|program| &program.qp)
    }

    /// Number of polynomial pieces.
    #[must_use]
    pub fn phases(&self) -> usize {
        self.layout.pieces.len()
    }
}

impl Shape {
    fn new(piece: &Piece, omega: f64, settings: &GaitSettings, rule: &[(f64, f64)]) -> Self {
        let basis = Basis::new(piece.duration_s, omega, piece.transfer);
        let forms = Forms::new(&basis, &settings.body, rule);
        let count = settings.discretisation.samples_per_polynomial;
        let samples = (0..count)
            .map(|i| {
                let t = basis.duration_s * f64::from(i) / f64::from(count - 1);
                (t, [basis.zmp(t)[0], basis.zmp_1(t)[0], basis.zmp_2(t)[0]])
            })
            .collect();
        let com_velocity = [basis.com(0.0)[1], basis.com(basis.duration_s)[1]];
        Self { basis, forms, samples, com_velocity }
    }
}

/// The initial stance and every pair of a landing and its stance foot that are both prescribed.
fn check_prescribed_steps(layout: &Layout, settings: &GaitSettings) -> Result<(), GaitError> {
    check_prescribed(&layout.stands[0], &layout.stands[1], settings)?;
    for (landing, stance) in landings(layout) {
        if !landing.slots[0].is_free() && !stance.slots[0].is_free() {
            check_prescribed(landing, stance, settings)?;
        }
    }
    Ok(())
}

/// Every landing with the foot that stands meanwhile.
fn landings(layout: &Layout) -> impl Iterator<Item = (&Stand, &Stand)> {
    layout.pieces.iter().filter(|piece| piece.first).filter_map(|piece| {
        let (landing, _, _) = piece.flight?;
        Some((&layout.stands[landing], &layout.stands[piece.foot_2]))
    })
}

/// Positions are measured from foot 2, so that large coordinates do not enter the cost.
pub(crate) fn local_bases(slots: &[Slot; SLOTS], origin: f64, transfer: Transfer) -> [f64; SLOTS] {
    let mut bases = slots.map(|slot| slot.base);
    let double = transfer != Transfer::Single;
    for (slot, used) in [
        (ZMP_START, true),
        (ZMP_END, true),
        (COM_START, true),
        (COM_END, true),
        (ZMP_1_START, double),
        (ZMP_1_END, double),
        (ANKLE_1, double),
        (ANKLE_2, true),
    ] {
        if used {
            bases[slot] -= origin;
        }
    }
    bases
}

fn add_cost(
    assemblies: &mut [Assembly],
    layout: &Layout,
    shapes: &[Rc<Shape>],
    settings: &GaitSettings,
    objective_scale: f64,
) {
    let (lambda, mu) = (settings.cost.lambda, settings.cost.mu);
    for (piece, shape) in layout.pieces.iter().zip(shapes) {
        let forms = &shape.forms;
        let form = forms.com_force * lambda + forms.ankle_torque * (1.0 - lambda) + forms.zmp_acceleration * mu;
        // J = u' form u = 1/2 xi' (2 s form s) xi + (2 s form base)' xi + ..
        let form = form * (2.0 * objective_scale);
        for (axis, slots) in piece.slots.iter().enumerate() {
            let assembly = &mut assemblies[layout.problem_of(axis)];
            let bases = Row::from(local_bases(slots, slots[ANKLE_2].base, piece.transfer));
            let gradient = form * bases;
            for (i, a) in slots.iter().enumerate().filter(|(_, slot)| slot.is_free()) {
                assembly.gradient[a.index] += a.scale * gradient[i];
                for (j, b) in slots.iter().enumerate().filter(|(_, slot)| slot.is_free()) {
                    if form[(i, j)] != 0.0 {
                        assembly.hessian.add(a.index, b.index, a.scale * form[(i, j)] * b.scale);
                    }
                }
            }
        }
    }
}

fn add_com_continuity(assemblies: &mut [Assembly], layout: &Layout, shapes: &[Rc<Shape>], omega: f64) {
    let pieces = &layout.pieces;
    let factor = 1.0 / (LENGTH_SCALE_M * omega);
    for axis in 0..2 {
        let assembly = &mut assemblies[layout.problem_of(axis)];
        for joint in 0..=pieces.len() {
            let mut parts: Vec<Part<'_>> = Vec::with_capacity(2);
            let mut origin = 0.0;
            if joint > 0 {
                let slots = &pieces[joint - 1].slots[axis];
                parts.push((axis, &shapes[joint - 1].com_velocity[1], slots, factor));
                origin = slots[ZMP_END].base;
            }
            if joint < pieces.len() {
                let slots = &pieces[joint].slots[axis];
                parts.push((axis, &shapes[joint].com_velocity[0], slots, -factor));
                origin = slots[ZMP_START].base;
            }
            let time_s = pieces
                .get(joint)
                .map_or_else(|| pieces[joint - 1].start_s + pieces[joint - 1].duration_s, |p| p.start_s);
            assembly.add_equality(&parts, origin, RowLabel::ComVelocity { time_s });
        }
    }
}

/// Samples that would repeat a row are left out: where two polynomials meet, the earlier one's last sample stays; where foot
/// 2 lands, ZMP1 still is the ZMP. At both ends of the walk everything is given.
fn add_zmp_rows(assemblies: &mut [Assembly], layout: &Layout, shapes: &[Rc<Shape>], settings: &GaitSettings) {
    for (phase, (piece, shape)) in layout.pieces.iter().zip(shapes).enumerate() {
        let (one, two) = (&layout.stands[piece.foot_1], &layout.stands[piece.foot_2]);
        let last = shape.samples.len() - 1;
        for (i, (t, [zmp, zmp_1, zmp_2])) in shape.samples.iter().enumerate() {
            if piece.last && i == last {
                continue;
            }
            let time_s = piece.start_s + t;
            // The solver begins with the ends and the middle of a polynomial.
            let first = i == 0 || i == last / 2 || i == last;
            let mut add = |of, row, stand, ankle| {
                add_polygon(assemblies, layout, piece, (of, phase, time_s, first), row, stand, ankle, settings);
            };
            if piece.kind == PhaseKind::SingleSupport {
                if i > 0 {
                    add(ZmpOf::Robot, zmp, two, ANKLE_2);
                }
                continue;
            }
            if i > 0 {
                add(ZmpOf::Foot1, zmp_1, one, ANKLE_1);
            }
            if i > 0 || piece.transfer.lands() {
                add(ZmpOf::Foot2, zmp_2, two, ANKLE_2);
            }
        }
    }
}

/// The ZMP given by `row`, seen from the ankle in `ankle` and turned into the foot's axes, lies inside its shrunk sole.
#[allow(clippy::too_many_arguments)] // the two neighbours that could be swapped have different types
fn add_polygon(
    assemblies: &mut [Assembly],
    layout: &Layout,
    piece: &Piece,
    (of, phase, time_s, first): (ZmpOf, usize, f64, bool),
    row: &Row,
    stand: &Stand,
    ankle: usize,
    settings: &GaitSettings,
) {
    let outline = Outline::new(settings, stand.side, settings.limits.zmp_margin_m);
    let (sin, cos) = stand.guess.yaw_rad.sin_cos();
    let mut from_ankle = *row;
    from_ankle[ankle] -= 1.0;
    for (direction, (axes, sides)) in [([cos, sin], outline.x), ([-sin, cos], outline.y)].into_iter().enumerate() {
        let parts: Vec<Part<'_>> = (0..2)
            .filter(|axis| axes[*axis] != 0.0)
            .map(|axis| (axis, &from_ankle, &piece.slots[axis], axes[axis] / LENGTH_SCALE_M))
            .collect();
        let origins = [stand.slots[0].base, stand.slots[1].base];
        let bounds = sides.map(|side| side / LENGTH_SCALE_M);
        let foot = stand.side;
        let label = RowLabel::Zmp { of, phase, kind: piece.kind, step: piece.step, foot, time_s, direction };
        let problem = layout.problem_of(parts[0].0);
        assemblies[problem].add_inequality(&parts, origins, piece.transfer, bounds, label, first);
    }
}

fn add_step_rows(assemblies: &mut [Assembly], layout: &Layout, settings: &GaitSettings) {
    for (landing, stance) in landings(layout) {
        if !landing.slots[0].is_free() && !stance.slots[0].is_free() {
            continue; // checked when the problem was built
        }
        for rule in step_rules(landing, stance, settings) {
            let axes: Vec<_> = (0..2).filter(|axis| rule.direction[*axis] != 0.0).collect();
            let mut bounds = [rule.lower, rule.upper].map(|side| side / LENGTH_SCALE_M);
            let assembly = &mut assemblies[layout.problem_of(axes[0])];
            let row = assembly.labels.len();
            for axis in axes {
                let factor = rule.direction[axis] / LENGTH_SCALE_M;
                let (a, b) = (landing.slots[axis], stance.slots[axis]);
                bounds = bounds.map(|bound| bound - factor * (a.base - b.base));
                for (slot, sign) in [(a, 1.0), (b, -1.0)] {
                    if slot.is_free() {
                        assembly.inequalities.add(row, slot.index, sign * factor * slot.scale);
                    }
                }
            }
            assembly.lower.push(bounds[0]);
            assembly.upper.push(bounds[1]);
            assembly.labels.push(rule.label);
            assembly.first.push(true);
        }
    }
}

impl Assembly {
    fn new(unknowns: usize, pieces: usize) -> Self {
        Self {
            unknowns,
            hessian: Triplets::with_capacity(pieces * SLOTS * SLOTS),
            gradient: vec![0.0; unknowns],
            equalities: Triplets::default(),
            rhs: Vec::new(),
            equality_labels: Vec::new(),
            inequalities: Triplets::with_capacity(pieces * SLOTS * 20),
            lower: Vec::new(),
            upper: Vec::new(),
            labels: Vec::new(),
            first: Vec::new(),
        }
    }

    /// `sum of parts = 0`; `origin` is subtracted from all positions (a COM velocity does not depend on it).
    fn add_equality(&mut self, parts: &[Part<'_>], origin: f64, label: RowLabel) {
        let row = self.rhs.len();
        let mut constant = 0.0;
        for (_, coefficients, slots, factor) in parts {
            // Of a COM row the slots from ZMP_1_START on are zero, whatever stands there.
            let bases = local_bases(slots, origin, Transfer::Single);
            for ((coefficient, slot), base) in coefficients.iter().zip(slots.iter()).zip(bases) {
                if *coefficient != 0.0 {
                    constant += factor * coefficient * base;
                    if slot.is_free() {
                        self.equalities.add(row, slot.index, factor * coefficient * slot.scale);
                    }
                }
            }
        }
        self.rhs.push(-constant);
        self.equality_labels.push(label);
    }

    /// `bounds[0] <= sum of parts <= bounds[1]`; `origins` are subtracted from all positions of the two axes.
    fn add_inequality(
        &mut self,
        parts: &[Part<'_>],
        origins: [f64; 2],
        transfer: Transfer,
        bounds: [f64; 2],
        label: RowLabel,
        first: bool,
    ) {
        let row = self.labels.len();
        let mut constant = 0.0;
        for (axis, coefficients, slots, factor) in parts {
            let bases = local_bases(slots, origins[*axis], transfer);
            for ((coefficient, slot), base) in coefficients.iter().zip(slots.iter()).zip(bases) {
                if *coefficient != 0.0 {
                    constant += factor * coefficient * base;
                    if slot.is_free() {
                        self.inequalities.add(row, slot.index, factor * coefficient * slot.scale);
                    }
                }
            }
        }
        self.lower.push(bounds[0] - constant);
        self.upper.push(bounds[1] - constant);
        self.labels.push(label);
        self.first.push(first);
    }

    fn finish(self) -> Program {
        let n = self.unknowns;
        let mut qp = QuadraticProgram::unconstrained(self.hessian.into_matrix(n, n), DVector::from_vec(self.gradient));
        qp.A = self.equalities.into_matrix(self.rhs.len(), n);
        qp.b = DVector::from_vec(self.rhs);
        qp.C = self.inequalities.into_matrix(self.labels.len(), n);
        qp.l = DVector::from_vec(self.lower);
        qp.u = DVector::from_vec(self.upper);
        Program { qp, equality_labels: self.equality_labels, labels: self.labels, first: self.first }
    }
}
