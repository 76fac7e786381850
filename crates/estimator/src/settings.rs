//! The estimator's configuration.

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
    /// A number is not what it should be.
    #[error("{field} = {value}: expected {expected}")]
    Value {
        /// Key in the configuration.
        field: &'static str,
        /// What was found.
        value: f64,
        /// What was expected.
        expected: &'static str,
    },
}

impl EstimatorSettings {
    /// Checks what the types cannot say.
    ///
    /// # Errors
    /// [`EstimatorError::Value`].
    pub fn check(&self) -> Result<(), EstimatorError> {
        let refuse = |field, value, expected| Err(EstimatorError::Value { field, value, expected });
        if !(self.touch_down_force_n > 0.0 && self.touch_down_force_n.is_finite()) {
            return refuse("touch_down_force_n", self.touch_down_force_n, "a positive force in newtons");
        }
        if !(self.solver.tolerance > 0.0 && self.solver.tolerance < 1.0) {
            return refuse("solver.tolerance", self.solver.tolerance, "more than 0 and less than 1");
        }
        if self.solver.iterations_max == 0 {
            return refuse("solver.iterations_max", 0.0, "at least 1");
        }
        let work = self.solver.real_time_megamultiplications_max;
        if !(work > 0.0 && work < 1e6) {
            return refuse("solver.real_time_megamultiplications_max", work, "more than 0 and less than 1e6");
        }
        Ok(())
    }
}
