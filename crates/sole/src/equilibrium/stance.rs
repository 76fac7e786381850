//! Where a stance stands, and what it remembers.

use friction::ContactState;
use nalgebra::Vector2;
use spatial::{Transform, Vec6};

/// Pose, states and history of one stance.
#[derive(Debug, Clone)]
pub(crate) struct Stance {
    /// Pose of the sole, relative to the foothold.
    pub(crate) pose: Transform,
    /// What every point does.
    pub(crate) states: Vec<ContactState>,
    /// Way of the sliding points since the tick before (m).
    pub(super) slips: Vec<Vector2<f64>>,
    /// Tangential references Q of every point; meaningless at the first tick, when they follow from the pose (35).
    pub(super) references: Vec<Vector2<f64>>,
    /// Heading of the foothold (rad) while this is the first tick.
    pub(super) first: Option<f64>,
    /// First and second rates at the end of the last solved tick: of the pose, of the slips of its sliding points.
    pub(super) rate: Option<(Vec6, Vec6)>,
    pub(super) slip_rates: Vec<[Vector2<f64>; 2]>,
}

impl Stance {
    pub(super) fn new(points: usize) -> Self {
        Self {
            pose: Transform::identity(),
            states: vec![ContactState::Open; points],
            slips: vec![Vector2::zeros(); points],
            references: vec![Vector2::zeros(); points],
            first: None,
            rate: None,
            slip_rates: vec![[Vector2::zeros(); 2]; points],
        }
    }
}

/// A state to return to when an attempt fails.
#[derive(Debug, Clone)]
pub(super) struct Saved {
    pub(super) pose: Transform,
    pub(super) states: Vec<ContactState>,
    pub(super) slips: Vec<Vector2<f64>>,
}

impl Saved {
    pub(super) fn new(points: usize) -> Self {
        Self {
            pose: Transform::identity(),
            states: vec![ContactState::Open; points],
            slips: vec![Vector2::zeros(); points],
        }
    }

    pub(super) fn keep(&mut self, stance: &Stance) {
        self.pose = stance.pose;
        self.states.copy_from_slice(&stance.states);
        self.slips.copy_from_slice(&stance.slips);
    }
}
