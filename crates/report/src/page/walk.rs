//! One recorded walk as columns: what the page draws, a value per tick.

use super::body::Body;
use super::geometry::{foot_zmp_m, quaternion, tilt_mrad};
use crate::{Gather, ReportSettings, Said, WalkFigures};
use messages::code::{Mode, Process};
use messages::timing::REACHED_TICKS;
use messages::{
    CONTROL_PERIOD_S, Health, PatternHeader, PatternPhase, RobotCommand, RobotState, SoleDeformation, Truth,
};
use recording::{ReadError, Recording};
use std::collections::BTreeMap;

/// Force below which a foot has no zero-moment point worth drawing (N).
const FORCE_MIN_N: f64 = 5.0;

/// Values by tick, from tick 0; not a number where nothing was said.
#[derive(Debug, Clone, Default)]
pub(super) struct Column(pub Vec<f64>);

impl Column {
    pub fn set(&mut self, tick: i64, value: f64) {
        let Ok(index) = usize::try_from(tick) else { return };
        if index >= TICKS_MAX {
            return;
        }
        if index >= self.0.len() {
            self.0.resize(index + 1, f64::NAN);
        }
        self.0[index] = value;
    }

    pub fn at(&self, index: usize) -> f64 {
        self.0.get(index).copied().unwrap_or(f64::NAN)
    }

    pub fn any(&self) -> bool {
        self.0.iter().any(|value| value.is_finite())
    }
}

/// Ticks that a page may span: a day. What a foreign file says beyond is not drawn.
const TICKS_MAX: usize = 24 * 3600 * 200;

/// Columns by name.
pub(super) type Columns = BTreeMap<String, Column>;

/// Something that happened.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Event {
    pub tick: i64,
    /// `push`, `fall`, `hold`, `start`, `end`, `log`.
    pub kind: &'static str,
    pub text: String,
}

/// A recorded walk.
pub(super) struct Walk {
    pub name: String,
    pub facts: BTreeMap<String, String>,
    pub files: Vec<(String, Vec<u8>)>,
    pub figures: WalkFigures,
    pub body: Body,
    pub columns: Columns,
    pub events: Vec<Event>,
    /// Foot, from and to, in walk time (s).
    pub swings: Vec<(usize, f64, f64)>,
    pub tick_zero: i64,
    /// Whether the simulator's truth is there.
    pub has_truth: bool,
    /// Ticks that are drawn.
    pub ticks: usize,
}

impl Walk {
    pub fn read(recording: &Recording, name: &str) -> Result<Self, ReadError> {
        let files = recording.files()?;
        let body = Body::read(&files);
        let mut gather = Gather::default();
        let mut taking = Taking::new(&body);
        crate::each(recording, |said| {
            gather.take(said);
            taking.take(said);
        })?;
        taking.finish();
        let Taking { columns, mut events, swings, tick_zero, has_truth, .. } = taking;
        events.sort_by_key(|event| event.tick);
        let figures = gather.finish(&ReportSettings::recorded(&files));
        let ticks = columns.values().map(|column| column.0.len()).max().unwrap_or(0);
        Ok(Self {
            name: name.to_string(),
            facts: recording.facts()?,
            files,
            figures,
            columns,
            events,
            swings,
            tick_zero,
            has_truth,
            ticks,
            body,
        })
    }

    /// Walk time of a tick (s).
    pub fn time_s(&self, tick: i64) -> f64 {
        (tick - self.tick_zero) as f64 * CONTROL_PERIOD_S
    }

    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.get(name).filter(|column| column.any())
    }
}

struct Taking<'a> {
    body: &'a Body,
    columns: Columns,
    events: Vec<Event>,
    swings: Vec<(usize, f64, f64)>,
    tick_zero: i64,
    has_truth: bool,
    mode: u32,
    pushed: bool,
    fallen: bool,
    references: BTreeMap<i64, Vec<f64>>,
}

const FEET: [&str; 2] = ["l", "r"];

impl<'a> Taking<'a> {
    fn new(body: &'a Body) -> Self {
        Self {
            body,
            columns: Columns::new(),
            events: Vec::new(),
            swings: Vec::new(),
            tick_zero: 0,
            has_truth: false,
            mode: 0,
            pushed: false,
            fallen: false,
            references: BTreeMap::new(),
        }
    }

    fn put(&mut self, name: &str, tick: i64, value: f64) {
        match self.columns.get_mut(name) {
            Some(column) => column.set(tick, value),
            None => {
                let mut column = Column::default();
                column.set(tick, value);
                self.columns.insert(name.to_string(), column);
            }
        }
    }

    fn put_all(&mut self, prefix: &str, tick: i64, values: &[f64]) {
        for (index, value) in values.iter().enumerate() {
            self.put(&format!("{prefix}{index}"), tick, *value);
        }
    }

    fn event(&mut self, tick: i64, kind: &'static str, text: String) {
        self.events.push(Event { tick, kind, text });
    }

    fn take(&mut self, said: Said) {
        match said {
            Said::Pattern(header, phases) => self.pattern(header, phases),
            Said::Start(start) => {
                self.tick_zero = start.tick_zero;
                self.event(start.tick_zero, "start", "time zero".to_string());
            }
            Said::Command(command) => self.command(command),
            Said::Truth(truth) => self.truth(truth),
            Said::Deformation(deformation) => self.deformation(deformation),
            Said::State(state) => self.state(state),
            Said::Health(health) => self.health(health),
        }
    }

    fn pattern(&mut self, _: &PatternHeader, phases: &[PatternPhase]) {
        for phase in phases {
            for (foot, said) in phase.feet.iter().enumerate() {
                if said.in_the_air == 1 && said.swing_end_s > said.swing_start_s {
                    let swing = (foot, said.swing_start_s, said.swing_end_s);
                    if !self.swings.contains(&swing) {
                        self.swings.push(swing);
                    }
                }
            }
        }
    }

    fn command(&mut self, command: &RobotCommand) {
        let tick = command.header.tick;
        let reached = tick + REACHED_TICKS;
        let plan = &command.plan;
        for (axis, value) in ["x", "y", "z"].iter().zip(plan.com_position_m) {
            self.put(&format!("com_plan_{axis}"), reached, 1e3 * value);
        }
        for (axis, value) in ["x", "y"].iter().zip(plan.zmp_m) {
            self.put(&format!("zmp_plan_{axis}"), reached, 1e3 * value);
        }
        if !self.has_truth {
            let [x, y, z, w] = quaternion(&plan.base_rotation);
            let [px, py, pz] = plan.base_position_m;
            self.put_all("plan_base", reached, &[px, py, pz, x, y, z, w]);
        }
        self.put("iterations_controller", tick, f64::from(command.solver_iterations));
        self.put("residual_controller", tick, command.solver_residual);
        self.put("deformation_age", tick, f64::from(command.deformation_age_ticks));
        let count = (command.joint_count as usize).min(command.joint_position_reference_rad.len());
        self.references.insert(reached, command.joint_position_reference_rad[..count].to_vec());
        if command.mode != self.mode {
            if command.mode == Mode::Holding.code() {
                self.event(tick, "hold", "the posture is held: something failed".to_string());
            } else if command.mode == Mode::Finished.code() {
                self.event(tick, "end", "end of the walk".to_string());
            }
            self.mode = command.mode;
        }
    }

    fn truth(&mut self, truth: &Truth) {
        let tick = truth.header.tick;
        self.has_truth = true;
        for (axis, value) in ["x", "y", "z"].iter().zip(truth.com_position_m) {
            self.put(&format!("com_{axis}"), tick, 1e3 * value);
        }
        for (axis, value) in ["x", "y"].iter().zip(truth.zmp_m) {
            self.put(&format!("zmp_{axis}"), tick, 1e3 * value);
        }
        let mut edges = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
        for (foot, side) in FEET.iter().enumerate() {
            let (position, rotation) = (truth.sole_position_m[foot], &truth.sole_rotation[foot]);
            let wrench = &truth.foot_wrench_n_nm[foot];
            self.put(&format!("force_{side}"), tick, wrench[2]);
            let carries = wrench[2] > FORCE_MIN_N;
            if carries {
                if let Some([x, y]) = foot_zmp_m(wrench, &position) {
                    self.put(&format!("zmp_{side}_x"), tick, 1e3 * x);
                    self.put(&format!("zmp_{side}_y"), tick, 1e3 * y);
                }
                let [roll, pitch] = tilt_mrad(rotation);
                self.put(&format!("roll_{side}"), tick, roll);
                self.put(&format!("pitch_{side}"), tick, pitch);
                self.put(&format!("sink_{side}"), tick, -1e3 * position[2]);
                for [x, y] in self.body.sole_corners(&position, rotation) {
                    edges = [edges[0].min(x), edges[1].max(x), edges[2].min(y), edges[3].max(y)];
                }
            }
            let [x, y, z, w] = quaternion(rotation);
            let [px, py, pz] = position;
            self.put_all(&format!("sole_{side}"), tick, &[px, py, pz, x, y, z, w]);
            self.put_all(&format!("force3_{side}"), tick, &wrench[..3]);
        }
        for (name, edge) in ["edge_x_min", "edge_x_max", "edge_y_min", "edge_y_max"].iter().zip(edges) {
            if edge.is_finite() {
                self.put(name, tick, 1e3 * edge);
            }
        }
        let [x, y, z, w] = quaternion(&truth.base_rotation);
        let [px, py, pz] = truth.base_position_m;
        self.put_all("base", tick, &[px, py, pz, x, y, z, w]);
        let count = (truth.joint_count as usize).min(truth.joint_position_rad.len());
        self.put_all("joint", tick, &truth.joint_position_rad[..count]);
        self.torques(tick, &truth.joint_torque_nm[..count]);
        self.joint_errors(tick, &truth.joint_position_rad[..count]);
        let push_n = truth.push_force_n.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (push_n > 0.0) != self.pushed {
            self.pushed = push_n > 0.0;
            let [x, y, z] = truth.push_force_n;
            let text = if self.pushed {
                format!("push of {push_n:.0} N ({x:.0}, {y:.0}, {z:.0})")
            } else {
                "push ends".to_string()
            };
            self.event(tick, "push", text);
        }
        if self.pushed {
            self.put_all("push", tick, &truth.push_force_n);
            self.put_all("push_at", tick, &truth.push_point_m);
        }
        if truth.fallen == 1 && !self.fallen {
            self.fallen = true;
            let cause = messages::code::Fall::from_code(truth.fall_cause).map_or("unknown cause", |fall| fall.word());
            self.event(truth.fall_tick, "fall", format!("the robot falls: {cause}"));
        }
    }

    fn torques(&mut self, tick: i64, torques_nm: &[f64]) {
        let limits = &self.body.effort_nm;
        let used = torques_nm.iter().zip(limits).map(|(torque, limit)| 100.0 * torque.abs() / limit).enumerate();
        if let Some((joint, used)) = used.filter(|(_, used)| used.is_finite()).max_by(|a, b| a.1.total_cmp(&b.1)) {
            self.put("torque_use", tick, used);
            self.put("torque_joint", tick, joint as f64);
        }
    }

    fn joint_errors(&mut self, tick: i64, angles_rad: &[f64]) {
        let Some(references) = self.references.get(&tick) else { return };
        let errors = angles_rad.iter().zip(references).map(|(real, wanted)| 1e3 * (real - wanted).abs()).enumerate();
        if let Some((joint, error)) = errors.filter(|(_, error)| error.is_finite()).max_by(|a, b| a.1.total_cmp(&b.1)) {
            self.put("joint_error", tick, error);
            self.put("joint_error_joint", tick, joint as f64);
        }
    }

    /// Where there is no truth, the joints are those that were measured.
    fn state(&mut self, state: &RobotState) {
        if self.has_truth {
            return;
        }
        let tick = state.header.tick;
        let count = (state.joint_count as usize).min(state.joint_position_rad.len());
        self.put_all("joint", tick, &state.joint_position_rad[..count]);
        self.joint_errors(tick, &state.joint_position_rad[..count]);
        for (foot, side) in FEET.iter().enumerate() {
            self.put(&format!("force_{side}"), tick, state.foot_wrench_n_nm[foot][2]);
        }
    }

    fn deformation(&mut self, deformation: &SoleDeformation) {
        let tick = deformation.header.tick;
        let mut iterations = 0;
        for (foot, side) in deformation.feet.iter().zip(FEET) {
            self.put(&format!("force_plan_{side}"), tick, foot.planned_force_n[2]);
            if foot.loaded == 1 {
                let [roll, pitch] = tilt_mrad(&foot.sole_rotation);
                self.put(&format!("roll_est_{side}"), tick, roll);
                self.put(&format!("pitch_est_{side}"), tick, pitch);
                self.put(&format!("sink_est_{side}"), tick, -1e3 * foot.sole_position_m[2]);
                iterations = iterations.max(foot.iterations);
            }
            if !self.has_truth {
                let [x, y, z, w] = quaternion(&foot.sole_rotation);
                let [px, py, pz] = foot.sole_position_m;
                self.put_all(&format!("sole_{side}"), tick, &[px, py, pz, x, y, z, w]);
            }
        }
        self.put("iterations_estimator", tick, f64::from(iterations));
    }

    fn health(&mut self, health: &Health) {
        let Some(process) = Process::from_code(health.process).filter(|_| health.cycles > 0) else { return };
        let tick = health.header.tick;
        self.put(&format!("tick_{}", process.word()), tick, 1e-6 * health.compute_time_ns as f64);
        if process == Process::Controller && health.controller.base_distance_m > 0.0 {
            self.put("base_distance_m", tick, 1e3 * health.controller.base_distance_m);
            self.put("base_distance_rad", tick, 1e3 * health.controller.base_distance_rad);
            self.put("measurements_refused", tick, health.controller.measurements_refused as f64);
        }
        if process == Process::Simulator {
            self.put("iterations_simulator", tick, f64::from(health.solver_iterations));
        }
    }

    fn finish(&mut self) {
        if !self.has_truth {
            // Nobody knows where the base really was; it is drawn where the plan has it.
            for index in 0..7 {
                if let Some(column) = self.columns.remove(&format!("plan_base{index}")) {
                    self.columns.insert(format!("base{index}"), column);
                }
            }
        }
    }
}
