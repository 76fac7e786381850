//! The estimator's configuration.

use ranges::{OutOfRange, Range};
use serde::Deserialize;
use soles::SoleChoice;
use std::path::PathBuf;

/// `config/estimator.toml`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EstimatorSettings {
    /// Folder of the robot.
    pub robot: PathBuf,
    /// Another sole than that of the robot's folder: a file like its `sole.toml`.
    #[serde(default)]
    pub sole_file: Option<PathBuf>,
    /// Normal force (N) from which a foot counts as loaded: its contact history begins there and ends when the load falls
    /// below. The pose of the sole is continuous across it because the load share grows with the third power of time.
    #[serde(default = "touch_down_force_n")]
    pub touch_down_force_n: f64,
    /// What replaces the robot's `sole.toml`; level `rigid` is the paper's "without estimator".
    #[serde(default)]
    pub sole: SoleChoice,
    /// Tolerances and limits of one tick.
    #[serde(default)]
    pub solver: SolverSettings,
}

fn touch_down_force_n() -> f64 {
    0.05
}

/// Tolerances and limits of one tick.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolverSettings {
    /// Largest residual of the planned force (relative to it) and of the moments about the planned ZMP (relative to 0.1 m
    /// times it) at which a pose is accepted.
    pub tolerance: f64,
    /// Newton iterations per tick.
    pub iterations_max: usize,
    /// Newton iterations, of each of up to three ways, when the direct attempt fails and the load is followed step by step; 0: never.
    pub continuation_iterations_max: usize,
    /// Millions of multiplications per foot and tick in real time, where nothing is followed step by step: a tick that needs more is
    /// held, and the next one tries again. Not a time, so that a restarted estimator agrees to the bit here as well.
    pub real_time_megamultiplications_max: f64,
}

impl Default for SolverSettings {
    fn default() -> Self {
        // Far above what a walk needs (8 and 0). In lock-step a tick may take its time; for what the last bounds see `sole`'s table of times.
        Self {
            tolerance: sole::EstimatorSettings::default().tolerance,
            iterations_max: 30,
            continuation_iterations_max: 400,
            real_time_megamultiplications_max: 8.0,
        }
    }
}

/// Why there is no estimator.
#[derive(Debug, thiserror::Error)]
pub enum EstimatorError {
    /// The robot's folder.
    #[error(transparent)]
    Robot(#[from] robot::RobotError),
    /// Its soles.
    #[error(transparent)]
    Soles(#[from] soles::SolesError),
    /// A setting cannot be.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
}

impl EstimatorSettings {
    /// Checks what the types cannot say.
    ///
    /// # Errors
    /// [`OutOfRange`] with the key.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let force = Range::above_zero_to(100.0);
        force.demand("touch_down_force_n", self.touch_down_force_n, "a ten-thousandth of the weight is usual")?;
        let SolverSettings { tolerance, iterations_max, continuation_iterations_max, .. } = self.solver;
        Range::between(1e-14, 1e-3).demand("solver.tolerance", tolerance, "1e-9 is usual")?;
        Range::between(1.0, 1000.0).demand("solver.iterations_max", iterations_max as f64, "30 is usual")?;
        let continuation = Range::between(0.0, 1e5);
        continuation.demand("solver.continuation_iterations_max", continuation_iterations_max as f64, "0 is never")?;
        let work = self.solver.real_time_megamultiplications_max;
        Range::above_zero_to(1e5).demand("solver.real_time_megamultiplications_max", work, "8 are some 2.5 ms")?;
        self.sole.check()
    }
}
