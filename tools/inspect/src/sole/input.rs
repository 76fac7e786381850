//! The sequence: what the JSON says, and what it means.

use anyhow::{Context, bail, ensure};
use nalgebra::{Matrix3, Vector2};
use serde::{Deserialize, Serialize};
use sole::{Foothold, StanceReference};
use spatial::{Mat3, Transform, so3};

/// How far a rotation may be from one: three decimals less than what six printed digits keep.
const ROTATION_DEFECT_MAX: f64 = 1e-6;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Input {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    first_tick: Option<Landing>,
    ticks: Vec<Tick>,
}

#[derive(Clone, Copy, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Landing {
    position_xy: [f64; 2],
    yaw: f64,
}

#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Tick {
    #[serde(skip_serializing_if = "Option::is_none")]
    force: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    zmp: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    force_rate: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    force_acceleration: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    zmp_rate: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    zmp_acceleration: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pose: Option<PoseInput>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lift_off: Option<bool>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PoseInput {
    position: [f64; 3],
    rotation: [[f64; 3]; 3],
    /// An output can be an input; the angles must be those of the rotation.
    #[serde(default, skip_serializing)]
    roll_pitch_yaw: Option<[f64; 3]>,
}

/// A sequence has one kind of ticks, for each kind keeps another history; `None` lifts the foot off.
pub(super) enum Sequence {
    /// Loads, on this foothold.
    Loads(Foothold, Vec<Option<StanceReference>>),
    /// Poses of the sole frame.
    Poses(Vec<Option<Transform>>),
}

impl Sequence {
    pub(super) fn is_empty(&self) -> bool {
        match self {
            Self::Loads(_, loads) => loads.is_empty(),
            Self::Poses(poses) => poses.is_empty(),
        }
    }
}

impl TryFrom<Input> for Sequence {
    type Error = anyhow::Error;

    fn try_from(input: Input) -> anyhow::Result<Self> {
        let posed = input.ticks.iter().any(|tick| tick.pose.is_some());
        let loaded = input.ticks.iter().any(Tick::has_load);
        ensure!(!(posed && loaded), "ticks: force-driven and pose-driven ticks may not be mixed");
        let ticks = input.ticks.iter().enumerate();
        if posed {
            ensure!(
                input.first_tick.is_none(),
                "first_tick: a pose-driven sequence has no foothold, its poses say where the foot is"
            );
            let poses = ticks.map(|(k, tick)| tick.pose().with_context(|| format!("ticks[{k}]")));
            let poses: Vec<Option<Transform>> = poses.collect::<anyhow::Result<_>>()?;
            ensure!(poses[0].is_some(), "ticks[0]: lift_off before the first pose: nobody knows where the foot is");
            return Ok(Self::Poses(poses));
        }
        let loads = ticks.map(|(k, tick)| tick.load().with_context(|| format!("ticks[{k}]")));
        let Landing { position_xy: [x_m, y_m], yaw } = input.first_tick.unwrap_or_default();
        Ok(Self::Loads(Foothold { x_m, y_m, yaw_rad: yaw }, loads.collect::<anyhow::Result<_>>()?))
    }
}

impl Tick {
    fn has_load(&self) -> bool {
        self.force.is_some()
            || self.zmp.is_some()
            || self.force_rate.is_some()
            || self.force_acceleration.is_some()
            || self.zmp_rate.is_some()
            || self.zmp_acceleration.is_some()
    }

    fn lifts_off(&self) -> anyhow::Result<bool> {
        let lifts = self.lift_off == Some(true);
        ensure!(
            !(lifts && (self.has_load() || self.pose.is_some())),
            "lift_off beside a load or a pose: one of them expected"
        );
        Ok(lifts)
    }

    fn load(&self) -> anyhow::Result<Option<StanceReference>> {
        if self.lifts_off()? {
            return Ok(None);
        }
        let (Some(force), Some(zmp)) = (self.force, self.zmp) else {
            bail!("force and zmp, or pose, or lift_off expected");
        };
        let flat = |v: Option<[f64; 2]>| Vector2::from(v.unwrap_or_default());
        Ok(Some(StanceReference {
            force: force.into(),
            force_rate: self.force_rate.unwrap_or_default().into(),
            force_acceleration: self.force_acceleration.unwrap_or_default().into(),
            zmp: [Vector2::from(zmp), flat(self.zmp_rate), flat(self.zmp_acceleration)],
        }))
    }

    fn pose(&self) -> anyhow::Result<Option<Transform>> {
        if self.lifts_off()? {
            return Ok(None);
        }
        let pose = self.pose.as_ref().context("pose or lift_off expected")?;
        let rotation = Matrix3::from_fn(|i, j| pose.rotation[i][j]);
        check_rotation(&rotation)?;
        if let Some([roll, pitch, yaw]) = pose.roll_pitch_yaw {
            let defect = (so3::from_roll_pitch_yaw(roll, pitch, yaw) - rotation).norm();
            ensure!(
                defect < ROTATION_DEFECT_MAX,
                "roll_pitch_yaw: not those of the rotation, which differs by {defect:e}: leave them out"
            );
        }
        Ok(Some(Transform::new(so3::orthonormalised(&rotation), pose.position.into())))
    }
}

fn check_rotation(rotation: &Mat3) -> anyhow::Result<()> {
    let defect = (rotation.transpose() * rotation - Matrix3::identity()).norm();
    ensure!(defect < ROTATION_DEFECT_MAX, "rotation: columns are not orthonormal (R'R differs from 1 by {defect:e})");
    ensure!(rotation.determinant() > 0.0, "rotation: a reflection (its determinant is -1)");
    Ok(())
}

/// A flat load, then forward and sideways.
pub(super) fn example() -> Input {
    let tick = |force: [f64; 3], zmp: [f64; 2]| Tick { force: Some(force), zmp: Some(zmp), ..Tick::default() };
    Input {
        first_tick: Some(Landing::default()),
        ticks: vec![
            tick([0.0, 0.0, 50.0], [0.0, 0.0]),
            tick([5.0, 0.0, 383.0], [0.02, 0.005]),
            tick([15.0, -20.0, 383.0], [0.06, 0.01]),
        ],
    }
}
