//! From a described walk to footsteps, in the frame of the starting pose: x along its heading, origin between the ankles.

use crate::{GaitError, GaitSettings, Walk};
use nalgebra::Vector2;
use pattern::{Foothold, Side};

/// One step: a swing, its landing, and the double support after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footstep {
    /// The foot that moves.
    pub side: Side,
    /// Where its ankle's projection lands; a first guess if `free`.
    pub landing: Foothold,
    /// Whether the optimisation chooses the position.
    pub free: bool,
    /// Time in the air (s).
    pub single_support_s: f64,
    /// Double support afterwards (s); of the last step unused.
    pub double_support_s: f64,
}

/// Initial stance (left, right) and all steps, in the frame of the starting pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// Under the ankles before the first step.
    pub initial: [Foothold; 2],
    /// In the order of time.
    pub steps: Vec<Footstep>,
}

impl Route {
    /// The footsteps that the settings describe.
    ///
    /// # Errors
    /// If feet do not alternate or the final stance is not prescribed.
    pub fn new(settings: &GaitSettings) -> Result<Self, GaitError> {
        let half = settings.start.ankle_distance_m / 2.0;
        let beside = |centre: Foothold, side: Side| centre.offset(Vector2::new(0.0, side.sign() * half));
        let initial = Side::BOTH.map(|side| beside(Foothold::default(), side));
        let first = settings.start.first_swing;
        let alternating = |q: u32| if q % 2 == 1 { first } else { first.other() };
        // The foot of swing q stands beside a body that has advanced by q units; the last one closes.
        let along = |swings: u32, centre: &dyn Fn(f64) -> Foothold| {
            (1..=swings)
                .map(|q| {
                    let side = alternating(q);
                    (side, beside(centre(f64::from(q.min(swings - 1))), side), false)
                })
                .collect::<Vec<_>>()
        };
        let landings = match &settings.walk {
            Walk::Straight { swings, step_length_m } => {
                along(*swings, &|q| Foothold { x_m: q * step_length_m, ..Foothold::default() })
            }
            Walk::Free { swings, distance_m } => {
                let length = distance_m / f64::from((swings - 1).max(1));
                let mut landings = along(*swings, &|q| Foothold { x_m: q * length, ..Foothold::default() });
                let count = landings.len();
                landings.iter_mut().take(count.saturating_sub(2)).for_each(|landing| landing.2 = true);
                landings
            }
            Walk::Circle { swings, step_length_m, radius_m } => along(*swings, &|q| {
                let yaw_rad = q * step_length_m / radius_m;
                // r (1 - cos) without cancellation
                let y_m = 2.0 * radius_m * (yaw_rad / 2.0).sin().powi(2);
                Foothold { x_m: radius_m * yaw_rad.sin(), y_m, yaw_rad }
            }),
            Walk::InPlace { swings, turn_per_swing_rad } => {
                along(*swings, &|q| Foothold { yaw_rad: q * turn_per_swing_rad, ..Foothold::default() })
            }
            Walk::Sideways { swings, step_width_m } => sideways(*swings, *step_width_m, &initial, alternating),
            Walk::Path { landings } => landings
                .iter()
                .map(|l| (l.foot, Foothold { x_m: l.x_m, y_m: l.y_m, yaw_rad: l.yaw_rad }, l.free))
                .collect(),
        };
        let timing = &settings.timing;
        let each = |list: &[f64], index: usize, all: f64| list.get(index).copied().unwrap_or(all);
        let steps: Vec<_> = landings
            .into_iter()
            .enumerate()
            .map(|(i, (side, landing, free))| Footstep {
                side,
                landing,
                free,
                single_support_s: each(&timing.single_support_each_s, i, timing.single_support_s),
                double_support_s: each(&timing.double_support_each_s, i, timing.double_support_s),
            })
            .collect();
        for (i, step) in steps.iter().enumerate() {
            let number = u32::try_from(i + 1).unwrap_or(u32::MAX);
            if i > 0 && steps[i - 1].side == step.side {
                return Err(GaitError::SameFootTwice { step: number, foot: step.side });
            }
            if step.free && i + 2 >= steps.len() {
                return Err(GaitError::FreeFinalStance {
                    step: number,
                    steps: u32::try_from(steps.len()).unwrap_or(u32::MAX),
                });
            }
        }
        Ok(Self { initial, steps })
    }
}

/// The foot on the side of the motion opens by `width`, the other one closes. A swing with nothing to do (the trailing foot
/// first, or the leading foot last) stays in place.
fn sideways(
    swings: u32,
    width: f64,
    initial: &[Foothold; 2],
    alternating: impl Fn(u32) -> Side,
) -> Vec<(Side, Foothold, bool)> {
    let leading = if width >= 0.0 { Side::Left } else { Side::Right };
    let mut feet = *initial;
    let distance = initial[0].y_m - initial[1].y_m;
    (1..=swings)
        .map(|q| {
            let side = alternating(q);
            let (moving, standing) = (side.index(), side.other().index());
            let closed = feet[standing].y_m + side.sign() * distance;
            let opens = side == leading && q < swings;
            feet[moving].y_m = if opens { closed + width } else { closed };
            (side, feet[moving], false)
        })
        .collect()
}
