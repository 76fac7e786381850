//! The solver of a step and the one that stands in for it.

use crate::settings::{Backend, WholeBodySettings};
use qp::dense::{Active, ActiveSet, ActiveSetSettings, Interior, InteriorSettings, Outcome, Problem, Size, Solver};

type AnySolver = Box<dyn Solver + Send>;

/// First solver and reserve for programs of one size.
pub(crate) struct Solvers {
    first: AnySolver,
    reserve: Option<AnySolver>,
    /// The reserve answers from here on, until the next step.
    reserve_answers: bool,
}

impl Solvers {
    pub fn new(size: Size, settings: &WholeBodySettings) -> Self {
        let make = |backend| make(size, backend, settings.iterations_max);
        Self { first: make(settings.backend), reserve: settings.reserve.map(make), reserve_answers: false }
    }

    /// The next step begins with the first solver again.
    pub fn begin(&mut self) {
        self.reserve_answers = false;
    }

    /// Whose turn it is solves.
    pub fn solve(&mut self, problem: &Problem) -> &Outcome {
        self.current().solve(problem)
    }

    /// What was found last.
    pub fn outcome(&self) -> &Outcome {
        match &self.reserve {
            Some(reserve) if self.reserve_answers => reserve.outcome(),
            _ => self.first.outcome(),
        }
    }

    /// From now on the reserve solves, if there is one and the program has numbers. The first solver forgets what led it
    /// astray.
    pub fn switch_to_reserve(&mut self, problem: &Problem) -> bool {
        self.first.forget();
        self.reserve_answers = self.reserve.is_some() && is_number(problem);
        self.reserve_answers
    }

    /// Suggests active rows to the first solver.
    pub fn guess(&mut self, active: &[Active]) {
        self.first.guess(active);
    }

    pub fn forget(&mut self) {
        self.first.forget();
        if let Some(reserve) = &mut self.reserve {
            reserve.forget();
        }
    }

    fn current(&mut self) -> &mut AnySolver {
        match &mut self.reserve {
            Some(reserve) if self.reserve_answers => reserve,
            _ => &mut self.first,
        }
    }
}

/// `iterations_max` is the active set's; an interior point needs some tens of steps whatever the program.
fn make(size: Size, backend: Backend, iterations_max: usize) -> AnySolver {
    match backend {
        Backend::ActiveSet => {
            Box::new(ActiveSet::new(size, ActiveSetSettings { iterations_max, ..ActiveSetSettings::default() }))
        }
        Backend::Interior { tolerance } => {
            Box::new(Interior::new(size, InteriorSettings { tolerance, ..InteriorSettings::default() }))
        }
    }
}

/// Sides may be infinite, nothing may be no number.
fn is_number(problem: &Problem) -> bool {
    let finite = [problem.P.as_slice(), problem.c.as_slice(), problem.A.as_slice(), problem.b.as_slice()];
    let sides = [&problem.l, &problem.u, &problem.lb, &problem.ub];
    finite.into_iter().chain([problem.C.as_slice()]).flatten().all(|x| x.is_finite())
        && sides.into_iter().flat_map(|side| side.iter()).all(|x| !x.is_nan())
}
