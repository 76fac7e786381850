//! The solver of a step and its backup.

use crate::settings::{Backend, SolverSettings};
use qp::dense::{Active, ActiveSet, ActiveSetSettings, Interior, InteriorSettings, Outcome, Problem, Size, Solver};

type AnySolver = Box<dyn Solver + Send>;

/// First solver and backup for programs of one size.
pub(crate) struct Solvers {
    first: AnySolver,
    backup: Option<AnySolver>,
    /// The backup answers from here on, until the next step.
    backup_answers: bool,
}

impl Solvers {
    pub fn new(size: Size, settings: &SolverSettings) -> Self {
        let make = |backend| make(size, backend, settings);
        Self { first: make(settings.backend), backup: settings.backup.backend().map(make), backup_answers: false }
    }

    /// The next step begins with the first solver again.
    pub fn begin(&mut self) {
        self.backup_answers = false;
    }

    /// Whose turn it is solves.
    pub fn solve(&mut self, problem: &Problem) -> &Outcome {
        self.current().solve(problem)
    }

    /// What was found last.
    pub fn outcome(&self) -> &Outcome {
        match &self.backup {
            Some(backup) if self.backup_answers => backup.outcome(),
            _ => self.first.outcome(),
        }
    }

    /// From now on the backup solves, if there is one and the program has numbers. The first solver forgets what led it
    /// astray.
    pub fn switch_to_backup(&mut self, problem: &Problem) -> bool {
        self.first.forget();
        self.backup_answers = self.backup.is_some() && is_number(problem);
        self.backup_answers
    }

    /// Suggests active rows to the first solver.
    pub fn guess(&mut self, active: &[Active]) {
        self.first.guess(active);
    }

    pub fn forget(&mut self) {
        self.first.forget();
        if let Some(backup) = &mut self.backup {
            backup.forget();
        }
    }

    fn current(&mut self) -> &mut AnySolver {
        match &mut self.backup {
            Some(backup) if self.backup_answers => backup,
            _ => &mut self.first,
        }
    }
}

/// `iterations_max` is the active set's; an interior point needs some tens of steps whatever the program.
fn make(size: Size, backend: Backend, settings: &SolverSettings) -> AnySolver {
    let SolverSettings { iterations_max, interior_tolerance: tolerance, .. } = *settings;
    match backend {
        Backend::ActiveSet => {
            Box::new(ActiveSet::new(size, ActiveSetSettings { iterations_max, ..ActiveSetSettings::default() }))
        }
        Backend::Interior => {
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
