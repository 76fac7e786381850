//! Phases in the order of time, and which unknown stands in which of their slots.
//!
//! | part of the walk | polynomials |
//! |---|---|
//! | start | 2 |
//! | first and last single support | 1 each |
//! | every other single support | `single_support_polynomials` (2) |
//! | every double support | 1 |
//! | stop | 2 |
//!
//! With N swings this is the paper's m = 3 n + 4, n = N - 1 (for N = 1: 5).
//!
//! **Unknowns** per axis: the ZMP's position, velocity and acceleration where polynomials meet; the same of ZMP1 at the end of
//! every double support and inside start and stop; the COM's position where polynomials meet; free footholds. The COM's `V, W`
//! of each phase follow from its two positions, so position is continuous by construction and velocity by one equality per
//! joint. (Unknown `V, W` would span the same motions, but on a phase of 0.05 s they reach kilometres that cancel.)
//!
//! **Scaling.** An unknown is `base + scale * xi`: positions count from a guess in centimetres, velocities and accelerations
//! in what moves a centimetre during the shorter neighbouring phase. So the problem's numbers neither depend on where the
//! walk is nor grow along it.

use crate::basis::{ANKLE_1, ANKLE_2, COM_END, COM_START, SLOTS, Transfer, ZMP_1_END, ZMP_1_START, ZMP_END, ZMP_START};
use crate::{GaitSettings, Route};
use pattern::{Foothold, PhaseKind, Side};

/// Unit of length of the scaled problem (m).
pub const LENGTH_SCALE_M: f64 = 0.01;

/// A number of a phase: `base + scale * xi[index]`, or the constant `base`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Slot {
    /// Guess, or the constant.
    pub base: f64,
    /// 0 for constants.
    pub scale: f64,
    /// Unknown of the axis's problem; meaningless for constants.
    pub index: usize,
}

impl Slot {
    fn constant(base: f64) -> Self {
        Self { base, scale: 0.0, index: 0 }
    }

    /// Whether it is an unknown.
    pub fn is_free(&self) -> bool {
        self.scale != 0.0
    }

    /// Its value for a solution of its axis's problem.
    pub fn value(&self, xi: &[f64]) -> f64 {
        if self.is_free() { self.base + self.scale * xi[self.index] } else { self.base }
    }
}

/// A landing, or the initial stance (step 0).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stand {
    /// The foot.
    pub side: Side,
    /// Landing number, from 1; 0 for the initial stance.
    pub step: u32,
    /// Where it is, or is guessed to be.
    pub guess: Foothold,
    /// Position per axis.
    pub slots: [Slot; 2],
    /// Start of contact (s).
    pub since_s: f64,
}

/// One polynomial piece before it is solved.
#[derive(Debug, Clone)]
pub struct Piece {
    /// Start (s).
    pub start_s: f64,
    /// `T` (s).
    pub duration_s: f64,
    /// Part of the walk.
    pub kind: PhaseKind,
    /// Load transfer.
    pub transfer: Transfer,
    /// Swing that it carries out, prepares or follows.
    pub step: u32,
    /// Whether it is the first piece of its single support, double support, start or stop.
    pub first: bool,
    /// Whether it is the last piece of the walk.
    pub last: bool,
    /// Stand (index) of foot 1; in single support the one it left.
    pub foot_1: usize,
    /// Stand of foot 2.
    pub foot_2: usize,
    /// In single support: the stand on which foot 1 will land, start and end of the flight (s).
    pub flight: Option<(usize, f64, f64)>,
    /// The numbers, per axis.
    pub slots: [[Slot; SLOTS]; 2],
}

/// The whole walk before it is solved.
#[derive(Debug, Clone)]
pub struct Layout {
    /// Pieces in the order of time.
    pub pieces: Vec<Piece>,
    /// Initial stances (left, right), then all landings.
    pub stands: Vec<Stand>,
    /// Number of unknowns per axis, or of both together in the first.
    pub unknowns: [usize; 2],
    /// Whether x and y are one problem, because feet are turned against each other.
    pub coupled: bool,
}

struct Counter {
    unknowns: [usize; 2],
    coupled: bool,
}

impl Counter {
    fn new_slot(&mut self, axis: usize, base: f64, scale: f64) -> Slot {
        let space = if self.coupled { 0 } else { axis };
        self.unknowns[space] += 1;
        Slot { base, scale, index: self.unknowns[space] - 1 }
    }

    /// Position, velocity, acceleration at a joint, per axis.
    fn via(&mut self, guess: [f64; 2], time_scale_s: f64) -> [[Slot; 3]; 2] {
        [0, 1].map(|axis| {
            [0, 1, 2].map(|order| {
                let scale = LENGTH_SCALE_M / time_scale_s.powi(order);
                self.new_slot(axis, if order == 0 { guess[axis] } else { 0.0 }, scale)
            })
        })
    }
}

fn at_rest(position: [f64; 2]) -> [[Slot; 3]; 2] {
    position.map(|p| [Slot::constant(p), Slot::constant(0.0), Slot::constant(0.0)])
}

impl Layout {
    /// Lays out the pieces of a route.
    pub fn new(route: &Route, settings: &GaitSettings) -> Self {
        let turned = |foothold: &Foothold| foothold.yaw_rad != 0.0;
        let coupled = route.initial.iter().chain(route.steps.iter().map(|s| &s.landing)).any(turned);
        let mut counter = Counter { unknowns: [0; 2], coupled };
        let mut pieces = pieces(route, settings);
        let mut stands: Vec<_> = Side::BOTH
            .map(|side| {
                let guess = route.initial[side.index()];
                let slots = [guess.x_m, guess.y_m].map(Slot::constant);
                Stand { side, step: 0, guess, slots, since_s: 0.0 }
            })
            .to_vec();
        for (step, footstep) in (1..).zip(&route.steps) {
            let guess = footstep.landing;
            let slots = [guess.x_m, guess.y_m].map(Slot::constant);
            stands.push(Stand { side: footstep.side, step, guess, slots, since_s: 0.0 });
        }
        for (landing, _, touch_down) in pieces.iter().filter_map(|piece| piece.flight) {
            stands[landing].since_s = touch_down;
        }

        let middle = |a: &Stand, b: &Stand| [0.5 * (a.guess.x_m + b.guess.x_m), 0.5 * (a.guess.y_m + b.guess.y_m)];
        let ankle = |stand: &Stand| [stand.guess.x_m, stand.guess.y_m];
        let begin = middle(&stands[0], &stands[1]);
        let mut zmp = at_rest(begin);
        let mut zmp_1 = at_rest(ankle(&stands[pieces[0].foot_1]));
        let mut com = begin.map(Slot::constant);
        for i in 0..pieces.len() {
            let piece = &pieces[i];
            let (foot_1, foot_2) = (piece.foot_1, piece.foot_2);
            // Free landings enter the problem with the flight that leads to them.
            if let Some((landing, _, _)) = piece.flight
                && piece.first
                && route.steps[landing - 2].free
            {
                let guess = ankle(&stands[landing]);
                stands[landing].slots = [0, 1].map(|axis| counter.new_slot(axis, guess[axis], LENGTH_SCALE_M));
            }
            let (one, two) = (stands[foot_1], stands[foot_2]);
            let time_scale = pieces.get(i + 1).map_or(piece.duration_s, |next| next.duration_s.min(piece.duration_s));
            let zmp_end;
            let com_end;
            if piece.last {
                zmp_end = at_rest(middle(&one, &two));
                com_end = middle(&one, &two).map(Slot::constant);
            } else {
                let guess = match piece.kind {
                    PhaseKind::Stop => middle(&one, &two),
                    _ if piece.transfer == Transfer::StartFirst => middle(&one, &two),
                    _ => ankle(&two),
                };
                zmp_end = counter.via(guess, time_scale);
                com_end = [0, 1].map(|axis| counter.new_slot(axis, guess[axis], LENGTH_SCALE_M));
            }
            let double = piece.kind != PhaseKind::SingleSupport;
            if piece.transfer.lands() {
                zmp_1 = zmp;
            }
            let zmp_1_end = match (double, piece.last) {
                (false, _) => zmp_1,
                (true, true) => at_rest(ankle(&one)),
                (true, false) => counter.via(ankle(&one), time_scale),
            };
            for axis in 0..2 {
                let slots = &mut pieces[i].slots[axis];
                slots[ZMP_START..][..3].copy_from_slice(&zmp[axis]);
                slots[ZMP_END..][..3].copy_from_slice(&zmp_end[axis]);
                slots[COM_START] = com[axis];
                slots[COM_END] = com_end[axis];
                if double {
                    slots[ZMP_1_START..][..3].copy_from_slice(&zmp_1[axis]);
                    slots[ZMP_1_END..][..3].copy_from_slice(&zmp_1_end[axis]);
                    slots[ANKLE_1] = one.slots[axis];
                }
                slots[ANKLE_2] = two.slots[axis];
            }
            (zmp, com, zmp_1) = (zmp_end, com_end, zmp_1_end);
        }
        Self { pieces, stands, unknowns: counter.unknowns, coupled }
    }

    /// The problem (0 or 1) that an axis belongs to.
    pub fn problem_of(&self, axis: usize) -> usize {
        if self.coupled { 0 } else { axis }
    }
}

/// Times, kinds and feet.
fn pieces(route: &Route, settings: &GaitSettings) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = Vec::new();
    let mut now = 0.0;
    let mut push = |kind, transfer, step, feet: [usize; 2], duration_s, first, flight| {
        pieces.push(Piece {
            start_s: now,
            duration_s,
            kind,
            transfer,
            step,
            first,
            last: false,
            foot_1: feet[0],
            foot_2: feet[1],
            flight,
            slots: [[Slot::default(); SLOTS]; 2],
        });
        now += duration_s;
        now
    };
    let steps = route.steps.len();
    let mut standing = [0, 1]; // stand of the left and of the right foot
    let feet_for = |standing: &[usize; 2], moving: Side| [standing[moving.index()], standing[moving.other().index()]];
    let feet = feet_for(&standing, route.steps[0].side);
    let half = settings.timing.start_s / 2.0;
    push(PhaseKind::Start, Transfer::StartFirst, 1, feet, half, true, None);
    let mut end_s = push(PhaseKind::Start, Transfer::StartSecond, 1, feet, half, false, None);
    for (i, step) in route.steps.iter().enumerate() {
        let number = i as u32 + 1;
        let landing = i + 2;
        let feet = feet_for(&standing, step.side);
        let outer = i == 0 || i + 1 == steps;
        let count = if outer { 1 } else { settings.discretisation.single_support_polynomials };
        let (take_off, duration) = (end_s, step.single_support_s / f64::from(count));
        // The landing time is the sum that the pieces' start times are made of, to the bit.
        let touch_down = (0..count).fold(take_off, |t, _| t + duration);
        for j in 0..count {
            let flight = Some((landing, take_off, touch_down));
            end_s = push(PhaseKind::SingleSupport, Transfer::Single, number, feet, duration, j == 0, flight);
        }
        standing[step.side.index()] = landing;
        let feet = [standing[step.side.other().index()], landing];
        if i + 1 < steps {
            let duration = step.double_support_s;
            end_s = push(PhaseKind::DoubleSupport, Transfer::Middle, number + 1, feet, duration, true, None);
        } else {
            let half = settings.timing.stop_s / 2.0;
            push(PhaseKind::Stop, Transfer::StopFirst, number, feet, half, true, None);
            push(PhaseKind::Stop, Transfer::StopSecond, number, feet, half, false, None);
        }
    }
    if let Some(last) = pieces.last_mut() {
        last.last = true;
    }
    pieces
}
