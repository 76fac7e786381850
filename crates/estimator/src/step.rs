//! The process: messages in, messages out.

use messages::{
    CONTROL_PERIOD_S, Header, OwnSoles, PatternHeader, PatternPhase, PatternRefused, RobotState, SoleContact,
    SoleDeformation, WalkStart, read_pattern,
};
use robot::Robot;
use sole::StanceEstimator;
use soles::Store;
use stance::{EstimatorError, EstimatorSettings, FootEstimate, StanceSettings, WalkOnSoles};

use crate::convert::{contact_message, deformation_message, outcome_code};

/// What one tick says.
#[derive(Debug, Clone)]
pub struct EstimatorOutput {
    /// For the controller.
    pub deformation: SoleDeformation,
    /// For whoever watches.
    pub contact: SoleContact,
    /// For health: the worse of the two feet.
    pub summary: Summary,
}

/// The worse of the two feet, for health.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// [`messages::code::Outcome`].
    pub status: u32,
    /// Iterations of both feet.
    pub iterations: u32,
    /// Larger residual.
    pub residual: f64,
    /// Larger age (ticks).
    pub age_ticks: u32,
}

/// The estimator without clock or bus.
#[derive(Debug)]
pub struct EstimatorProcess {
    robot_fingerprint: u64,
    settings: StanceSettings,
    soles: [Option<StanceEstimator>; 2],
    real_time_multiplications_max: u64,
    own_soles: OwnSoles,
    estimator: Option<(u64, WalkOnSoles)>,
    start: Option<WalkStart>,
}

impl EstimatorProcess {
    /// Builds the soles; everything that may fail or allocate much happens here.
    ///
    /// # Errors
    /// [`EstimatorError`] names file, field and value.
    pub fn new(settings: &EstimatorSettings) -> Result<Self, EstimatorError> {
        Self::with_store(settings, &mut Store::none())
    }

    /// The same with condensed soles that may have been kept.
    ///
    /// # Errors
    /// [`EstimatorError`] names file, field and value.
    pub fn with_store(settings: &EstimatorSettings, store: &mut Store) -> Result<Self, EstimatorError> {
        let robot = Robot::load_on(&settings.robot, settings.sole_file.as_deref())?;
        let soles = settings.soles(&robot, store)?;
        let own_soles = OwnSoles {
            ankle_in_sole_m: [0, 1].map(|foot| robot.sole.foot.ankle_in_sole_m(foot)),
            file: robot.sole_file.clone(),
        };
        let robot_fingerprint = robot.fingerprint;
        let real_time_multiplications_max = (1e6 * settings.solver.real_time_megamultiplications_max) as u64;
        Ok(Self {
            robot_fingerprint,
            settings: settings.stance(),
            soles,
            real_time_multiplications_max,
            own_soles,
            estimator: None,
            start: None,
        })
    }

    /// From the next pattern on no tick does more work than real time has room for, and none allocates.
    pub fn bound_work(&mut self) {
        for sole in self.soles.iter_mut().flatten() {
            sole.bound_work(self.real_time_multiplications_max);
        }
    }

    /// What the soles model, one part a line.
    #[must_use]
    pub fn models(&self) -> Vec<String> {
        let soles = self.soles[0].as_ref().map_or_else(
            || "rigid".to_string(),
            |sole| format!("{} contact points each", sole.model().contact_points().len()),
        );
        vec![format!("soles: {soles}")]
    }

    /// The robot it was built for: messages of another one must not be used.
    #[must_use]
    pub fn robot_fingerprint(&self) -> u64 {
        self.robot_fingerprint
    }

    /// Whether there is a pattern to work on.
    #[must_use]
    pub fn has_pattern(&self) -> bool {
        self.estimator.is_some()
    }

    /// Takes a pattern; one with the hash of the present one changes nothing.
    ///
    /// # Errors
    /// [`PatternRefused`]; the present pattern stays.
    pub fn take_pattern(&mut self, header: &PatternHeader, phases: &[PatternPhase]) -> Result<(), PatternRefused> {
        if self.estimator.as_ref().is_some_and(|(hash, _)| *hash == header.pattern_hash) {
            return Ok(());
        }
        let walk = read_pattern(header, phases)?;
        self.own_soles.check(&walk)?;
        let estimator = WalkOnSoles::new(walk, self.soles.clone(), &self.settings, CONTROL_PERIOD_S);
        self.estimator = Some((header.pattern_hash, estimator));
        Ok(())
    }

    /// Takes time zero; one that belongs to another pattern is not used.
    pub fn take_start(&mut self, start: &WalkStart) {
        if self.estimator.as_ref().is_some_and(|(hash, _)| *hash == start.pattern_hash) {
            self.start = Some(*start);
        }
    }

    /// One tick; `None` before there is a pattern.
    pub fn step(&mut self, state: &RobotState) -> Option<EstimatorOutput> {
        let (pattern_hash, estimator) = self.estimator.as_mut()?;
        let walk_tick = self.start.map_or(-1, |start| state.header.tick - start.tick_zero);
        let walk_time_s = walk_tick as f64 * CONTROL_PERIOD_S;
        let feet = estimator.at_tick(walk_tick, &[]);
        let header = Header {
            clock_monotonic_ns: state.header.clock_monotonic_ns,
            ..Header::new(state.header.tick, self.robot_fingerprint)
        };
        let reference = estimator.pattern().evaluate(walk_time_s);
        Some(EstimatorOutput {
            deformation: deformation_message(header, walk_time_s, *pattern_hash, &reference, &feet),
            contact: contact_message(header, estimator),
            summary: summary(&feet),
        })
    }
}

fn summary(feet: &[FootEstimate; 2]) -> Summary {
    let worse = if feet[1].age_ticks > feet[0].age_ticks { &feet[1] } else { &feet[0] };
    Summary {
        status: outcome_code(worse.outcome).code(),
        iterations: feet[0].iterations + feet[1].iterations,
        residual: feet[0].residual.max(feet[1].residual),
        age_ticks: worse.age_ticks,
    }
}
