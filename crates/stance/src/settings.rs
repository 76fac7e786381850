//! The estimator's configuration: read by the estimator, which walks by it, and by the planner, which certifies with it.

use lateness::RightsSettings;
use ranges::{OutOfRange, Range};
use robot::Robot;
use serde::Deserialize;
use sole::StanceEstimator;
use soles::{SoleChoice, Store};
use std::path::PathBuf;

use crate::BodyZmpSettings;

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
    /// Kelvin-Voigt time constant (s) of the foam: how late the sole follows its load. 0.005 to 0.05 is plausible, 0 is elastic.
    #[serde(default = "viscosity_time_s")]
    pub viscosity_time_s: f64,
    /// How the feet carry what the body adds to the plan's ZMP.
    #[serde(default)]
    pub body_zmp: BodyZmpSettings,
    /// What replaces the robot's `sole.toml`; level `rigid` is the paper's "without estimator".
    #[serde(default)]
    pub sole: SoleChoice,
    /// Tolerances and limits of one tick.
    #[serde(default)]
    pub solver: SolverSettings,
    /// What it asks of the system by the clock.
    #[serde(default = "own_rights")]
    pub real_time: RightsSettings,
}

/// What the estimator asks of the system by the clock.
fn own_rights() -> RightsSettings {
    RightsSettings::fifo(60, 1)
}

fn touch_down_force_n() -> f64 {
    StanceSettings::default().touch_down_force_n
}

fn viscosity_time_s() -> f64 {
    StanceSettings::default().viscosity_time_s
}

/// How a foot's load becomes a pose, besides its sole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StanceSettings {
    /// [`EstimatorSettings::touch_down_force_n`].
    pub touch_down_force_n: f64,
    /// [`EstimatorSettings::viscosity_time_s`].
    pub viscosity_time_s: f64,
    /// [`EstimatorSettings::body_zmp`].
    pub body_zmp: BodyZmpSettings,
}

impl Default for StanceSettings {
    fn default() -> Self {
        Self { touch_down_force_n: 0.05, viscosity_time_s: 0.02, body_zmp: BodyZmpSettings::default() }
    }
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
            real_time_megamultiplications_max: 16.0,
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
    /// What [`crate::WalkOnSoles`] takes.
    #[must_use]
    pub fn stance(&self) -> StanceSettings {
        let Self { touch_down_force_n, viscosity_time_s, body_zmp, .. } = *self;
        StanceSettings { touch_down_force_n, viscosity_time_s, body_zmp }
    }

    /// The robot's soles as the estimator believes them to be, left and right; `None` for rigid ones.
    ///
    /// # Errors
    /// [`EstimatorError`] names field and value.
    pub fn soles(&self, robot: &Robot, store: &mut Store) -> Result<[Option<StanceEstimator>; 2], EstimatorError> {
        self.check()?;
        let solver = sole::EstimatorSettings {
            tolerance: self.solver.tolerance,
            iterations_max: self.solver.iterations_max,
            continuation_iterations_max: self.solver.continuation_iterations_max,
            ..sole::EstimatorSettings::default()
        };
        let models = soles::build(robot, &self.sole, store)?;
        Ok(models.map_or([None, None], |models| models.map(|model| Some(StanceEstimator::new(model, solver)))))
    }

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
        Range::between(0.0, 1.0).demand("viscosity_time_s", self.viscosity_time_s, "0.02 is usual, 0 is elastic")?;
        let BodyZmpSettings { from_share, full_share } = self.body_zmp;
        Range::between(0.0, 0.9).demand("body_zmp.from_share", from_share, "0.157 is usual")?;
        // Closer together the shift would come within a few periods.
        let full = Range::between(from_share + 0.05, 1.0);
        full.demand("body_zmp.full_share", full_share, "0.65 is usual")?;
        let work = self.solver.real_time_megamultiplications_max;
        Range::above_zero_to(1e5).demand("solver.real_time_megamultiplications_max", work, "16 are 5 ms at most")?;
        self.sole.check()
    }
}
