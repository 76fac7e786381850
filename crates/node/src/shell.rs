//! What a program sees of the world: messages, health, the wish that it stop.

use crate::arguments::Arguments;
use crate::exit::ExitCode;
use crate::failure::Failure;
use crate::grid::believed_stamp_ns;
use crate::real_time::clock_monotonic_ns;
use crate::rights::Rights;
use crate::stop::{START_PATIENCE, Stop};
use crate::timing::Timing;
use bus::{Domain, Pattern, PatternPublisher, PatternSubscriber, Publisher, Robot, Subscriber};
use lateness::RightsSettings;
use messages::code::{Process, Reason, State};
use messages::{CONTROL_PERIOD_NS, Header, Health, MAX_PHASES, Message, Topic, topic};
use std::time::{Duration, Instant};

/// How long a process started alone waits for the owner of its domain.
const OWNER_PATIENCE: Duration = Duration::from_secs(5);
/// How often one that waits looks whether it was asked to stop, and says that it lives.
const HEARTBEAT: Duration = Duration::from_millis(100);
/// How often one that waits looks whether the owner and the awaited live.
const LOOK_AROUND: Duration = Duration::from_millis(500);
/// How long a process whose work is over waits to be asked to stop.
const LINGER: Duration = Duration::from_secs(10);
/// By the clock: ticks of standing after which a robot is at rest.
const REST_TICKS: u32 = 100;
/// By the clock: ticks within which a walking robot that is asked to stop comes to rest. The longest step that is planned, and standing.
const REST_PATIENCE_TICKS: u32 = 800;
/// Ticks by which the recorder may lag in lock-step.
const RECORDER_LAG_TICKS: i64 = 32;

/// A process's share in its domain.
pub struct Shell {
    process: Process,
    robot_fingerprint: Option<u64>,
    real_time: bool,
    pace: Option<f64>,
    walk: bool,
    wait_for: Vec<Process>,
    stop: Stop,
    health: Publisher<Health>,
    figures: Health,
    recorder: Option<Subscriber<Health>>,
    recorder_tick: i64,
    cycle_start_ns: u64,
    computing_since_ns: Option<u64>,
    compute_time_ns: u64,
    timing: Timing,
    heartbeat: Instant,
    look_around: Instant,
    standing_ticks: u32,
    ticks_since_asked: u32,
    stamps_refused: u64,
    // After all ports.
    domain: Domain,
}

impl Shell {
    pub(crate) fn open(
        process: Process,
        robot_fingerprint: Option<u64>,
        arguments: &Arguments,
        asked: &RightsSettings,
        answer_deadline_ns: u64,
    ) -> Result<Self, Failure> {
        let stop = Stop::on_signals().map_err(Failure::running)?;
        // Before threads and ports are made.
        let mut rights = if arguments.real_time { Rights::lock_memory(asked) } else { Rights::default() };
        let timing = Timing::new(process, answer_deadline_ns, arguments.real_time);
        let joining = format!("joining domain `{}`", arguments.domain);
        let join = || Domain::join(&arguments.domain, process, OWNER_PATIENCE);
        let domain = stop.bound(&joining, START_PATIENCE, ExitCode::Done, join)?;
        tracing::info!("{process} in domain `{}`, runtime folder {}", domain.name(), bus::runtime_folder().display());
        let health = domain.publisher(topic::health(process))?;
        let mut figures = Health::new(process, State::Starting, Reason::None);
        figures.header = Header::new(-1, robot_fingerprint.unwrap_or(0));
        figures.process_id = std::process::id();
        figures.recorder.stored_tick = -1;
        if arguments.real_time {
            crate::diagnostics::hand_over();
            rights.enter(asked);
            figures.real_time_policy = u32::from(rights.fifo_priority > 0);
            figures.real_time_priority = rights.fifo_priority;
            figures.core_plus_one = rights.core.map_or(0, |core| core + 1);
            figures.memory_locked = u32::from(rights.memory_locked);
            tracing::info!("{process} runs by the clock: {rights}");
            if arguments.require_real_time && !rights.refused.is_empty() {
                return Err(Failure::Rights { refused: rights.refused });
            }
            rights.refused.iter().for_each(|refused| tracing::warn!("{refused}"));
        }
        let now = Instant::now();
        let mut shell = Self {
            process,
            robot_fingerprint,
            real_time: arguments.real_time,
            pace: arguments.pace,
            walk: arguments.walk || !arguments.real_time,
            wait_for: arguments.wait_for.clone(),
            stop,
            health,
            figures,
            recorder: None,
            recorder_tick: -1,
            cycle_start_ns: 0,
            computing_since_ns: None,
            compute_time_ns: 0,
            timing,
            heartbeat: now,
            look_around: now,
            standing_ticks: 0,
            ticks_since_asked: 0,
            stamps_refused: 0,
            domain,
        };
        shell.report()?;
        Ok(shell)
    }

    /// Whether to run by the clock instead of in lock-step.
    pub fn real_time(&self) -> bool {
        self.real_time
    }

    /// In lock-step: how many times as fast as real time simulated time may pass, if that was said.
    pub fn pace(&self) -> Option<f64> {
        self.pace
    }

    /// Whether the robot may walk off without being told to: in lock-step, or because whoever started the process said so.
    pub fn may_walk_off(&self) -> bool {
        self.walk
    }

    /// Whether it was asked to stop.
    pub fn asked_to_stop(&self) -> bool {
        self.stop.asked()
    }

    /// A publisher of a topic.
    ///
    /// # Errors
    /// As [`Domain::publisher`].
    pub fn publisher<T: Message>(&self, topic: Topic<T>) -> Result<Publisher<T>, Failure> {
        Ok(self.domain.publisher(topic)?)
    }

    /// A subscriber to a topic that keeps up to `depth` messages of our robot.
    ///
    /// # Errors
    /// As [`Domain::subscriber`].
    pub fn subscriber<T: Message>(&self, topic: Topic<T>, depth: usize) -> Result<Subscriber<T>, Failure> {
        Ok(self.domain.subscriber(topic, self.robot(), depth)?)
    }

    /// The publisher of a walking pattern of at most `max_phases` phases.
    ///
    /// # Errors
    /// As [`Domain::publisher`].
    pub fn pattern_publisher(&self, max_phases: usize) -> Result<PatternPublisher, Failure> {
        Ok(self.domain.pattern_publisher(max_phases)?)
    }

    /// A subscriber to the walking pattern.
    ///
    /// # Errors
    /// As [`Domain::subscriber`].
    pub fn pattern_subscriber(&self) -> Result<PatternSubscriber, Failure> {
        Ok(self.domain.pattern_subscriber(self.robot(), MAX_PHASES)?)
    }

    /// The domain, for what is not offered here.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    fn robot(&self) -> Robot {
        self.robot_fingerprint.map_or(Robot::Any, Robot::Only)
    }

    /// The figures that the next report will publish: solver, walk, and the process's own.
    pub fn figures(&mut self) -> &mut Health {
        &mut self.figures
    }

    /// Says that everything is there: ports made, pattern received.
    ///
    /// # Errors
    /// If it cannot be published.
    pub fn ready(&mut self) -> Result<(), Failure> {
        self.announce(State::Ready, Reason::None)
    }

    /// Says what the process is doing, and why.
    ///
    /// # Errors
    /// If it cannot be published.
    pub fn announce(&mut self, state: State, reason: Reason) -> Result<(), Failure> {
        self.figures.state = state.code();
        self.figures.reason = reason.code();
        self.timing.look_at_all(&mut self.figures.timing);
        tracing::info!("{}: {state} {reason}", self.process);
        self.report()
    }

    /// To be asked once a tick: whether to end, for it was asked to stop. In lock-step at once. By the clock a robot that `walks` is not left
    /// in the middle of a step: one goes on until it has stood for half a second, or has had the time for it.
    pub fn ends(&mut self, walks: bool) -> bool {
        self.standing_ticks = if walks { 0 } else { self.standing_ticks + 1 };
        if !self.stop.asked() {
            return false;
        }
        self.ticks_since_asked += 1;
        !self.real_time || self.standing_ticks > REST_TICKS || self.ticks_since_asked > REST_PATIENCE_TICKS
    }

    /// Publishes the figures.
    ///
    /// # Errors
    /// If it cannot be published.
    pub fn report(&mut self) -> Result<(), Failure> {
        self.heartbeat = Instant::now();
        self.health.publish(&self.figures)?;
        Ok(())
    }

    /// Waits for the next message; `None`: asked to stop.
    ///
    /// # Errors
    /// If the owner or the one who should publish died, or publishes for another robot.
    pub fn wait<T: Message>(&mut self, subscriber: &mut Subscriber<T>) -> Result<Option<T>, Failure> {
        let row = subscriber.topic().row;
        self.wait_by(row, |patience| subscriber.wait(patience))
    }

    /// Waits for the message of a tick; older ones are dropped. `None`: asked to stop.
    ///
    /// # Errors
    /// As [`Shell::wait`].
    pub fn wait_tick<T: Message>(&mut self, subscriber: &mut Subscriber<T>, tick: i64) -> Result<Option<T>, Failure> {
        while let Some(message) = self.wait(subscriber)? {
            if message.header().tick >= tick {
                return Ok(Some(message));
            }
        }
        Ok(None)
    }

    /// By the clock: the message of a tick, waited for until a time of the monotonic clock (ns). Then the newest one before it, if there is
    /// one that was not taken yet.
    ///
    /// # Errors
    /// If the subscriber is broken.
    pub fn wait_tick_until<T: Message>(
        &mut self,
        subscriber: &mut Subscriber<T>,
        tick: i64,
        deadline_ns: u64,
    ) -> Result<Option<T>, Failure> {
        let mut newest = None;
        while let Some(message) = subscriber.wait_until(deadline_ns)? {
            newest = Some(message);
            if message.header().tick >= tick {
                break;
            }
        }
        Ok(newest)
    }

    /// Waits for a walking pattern; `None`: asked to stop.
    ///
    /// # Errors
    /// As [`Shell::wait`], and if the pattern is too long.
    pub fn wait_pattern(&mut self, subscriber: &mut PatternSubscriber) -> Result<Option<Pattern>, Failure> {
        self.wait_by(topic::WALK_PATTERN.row, |patience| subscriber.wait(patience))
    }

    fn wait_by<T>(
        &mut self,
        row: topic::Row,
        mut wait: impl FnMut(Duration) -> Result<Option<T>, bus::ReceiveError>,
    ) -> Result<Option<T>, Failure> {
        // By the clock one that was asked to stop goes on as long as there is something to answer: see `ends`.
        while self.real_time || !self.stop.asked() {
            if let Some(message) = wait(HEARTBEAT)? {
                return Ok(Some(message));
            }
            if self.stop.asked() {
                break;
            }
            self.live(Some(row))?;
        }
        Ok(None)
    }

    /// Sleeps for a moment while nothing is to be done, alive for the others; `false`: asked to stop.
    ///
    /// # Errors
    /// If the owner died.
    pub fn idle(&mut self, duration: Duration) -> Result<bool, Failure> {
        self.idle_without(None, duration)
    }

    fn idle_without(&mut self, awaited: Option<topic::Row>, duration: Duration) -> Result<bool, Failure> {
        let end = Instant::now() + duration;
        while !self.stop.asked() {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(true);
            }
            std::thread::sleep(left.min(HEARTBEAT));
            self.live(awaited)?;
        }
        Ok(false)
    }

    /// What one that waits does now and then.
    fn live(&mut self, awaited: Option<topic::Row>) -> Result<(), Failure> {
        if self.heartbeat.elapsed() >= HEARTBEAT {
            self.report()?;
        }
        // Whoever was asked to stop while it slept stops in order, even if the owner, or whom it waits for, is gone as well.
        if self.look_around.elapsed() < LOOK_AROUND || self.stop.asked() {
            return Ok(());
        }
        self.look_around = Instant::now();
        if !self.domain.owner_is_alive() {
            return Err(Failure::OwnerGone { domain: self.domain.name().to_string() });
        }
        match awaited {
            Some(row) if self.domain.dead_processes().contains(&row.from) => {
                Err(Failure::PeerDied { process: row.from, topic: row.name })
            }
            _ => Ok(()),
        }
    }

    /// Waits until the others are ready: those of `--wait-for`, or `least` if none are named. `false`: asked to stop.
    ///
    /// # Errors
    /// If one of them stops or dies before it is ready, or the owner dies.
    pub fn wait_for_others(&mut self, least: &[Process]) -> Result<bool, Failure> {
        let awaited = if self.wait_for.is_empty() { least.to_vec() } else { self.wait_for.clone() };
        for process in awaited {
            let topic = topic::health(process);
            let mut health = self.domain.subscriber(topic, Robot::Any, 4)?;
            loop {
                let state = health.latest()?.and_then(|health| State::from_code(health.state));
                match state {
                    Some(State::Ready | State::Running | State::Holding) => break,
                    Some(State::Stopping) => return Err(Failure::PeerDied { process, topic: topic.row.name }),
                    _ if !self.idle_without(Some(topic.row), Duration::from_millis(5))? => return Ok(false),
                    _ => {}
                }
            }
            if process == Process::Recorder {
                self.recorder = Some(health);
            }
        }
        Ok(true)
    }

    /// In lock-step: waits while the recorder, if it was waited for, lags too far behind this tick, so that nothing is lost.
    /// `false`: asked to stop.
    ///
    /// # Errors
    /// If the recorder or the owner died.
    pub fn wait_for_recorder(&mut self, tick: i64) -> Result<bool, Failure> {
        let row = topic::health(Process::Recorder).row;
        let Some(mut recorder) = self.recorder.take() else { return Ok(true) };
        let goes_on = loop {
            while let Some(health) = recorder.try_next()? {
                self.recorder_tick = self.recorder_tick.max(health.recorder.stored_tick);
                if State::from_code(health.state) == Some(State::Stopping) {
                    return Err(Failure::PeerDied { process: Process::Recorder, topic: row.name });
                }
            }
            if self.real_time || tick - self.recorder_tick <= RECORDER_LAG_TICKS {
                break true;
            }
            if self.stop.asked() {
                break false;
            }
            std::thread::sleep(Duration::from_micros(500));
            self.live(Some(row))?;
        };
        self.recorder = Some(recorder);
        Ok(goes_on)
    }

    /// Woken for a tick of this time (`clock_monotonic_ns` of the state's header, or what the grid says); zero: in lock-step. Before
    /// [`Shell::cycle_starts`], which says that all other inputs are there as well.
    pub fn cycle_wakes(&mut self, tick_ns: u64) {
        self.timing.woke(tick_ns, clock_monotonic_ns());
    }

    /// A step of the cycle has ended, for an overrun to name.
    pub fn step_done(&mut self, name: &'static str) {
        self.timing.watch().step_done(name, clock_monotonic_ns());
    }

    /// The answer of this cycle was out then: [`Publisher::sent_ns`].
    pub fn published(&mut self, sent_ns: u64) {
        self.timing.watch().published(sent_ns);
    }

    /// By the clock: woken by the state of a tick. Returns the tick's time (ns, monotonic), by which the others are waited for; `None` in
    /// lock-step, and before the clock begins. A stamp that cannot be is not believed, and the first one is told.
    pub fn woken_by(&mut self, state: &Header) -> Option<u64> {
        if !self.real_time || state.clock_monotonic_ns == 0 {
            self.cycle_wakes(0);
            return None;
        }
        let (due_ns, believed) = believed_stamp_ns(state.clock_monotonic_ns, clock_monotonic_ns());
        if !believed {
            if self.stamps_refused == 0 {
                let Header { tick, clock_monotonic_ns: stamp_ns, .. } = state;
                tracing::warn!(
                    "tick {tick}: the state's stamp {stamp_ns} ns is not of this host's monotonic clock, which is {due_ns} ns; its \
                     time of arrival stands in (only the first one is told)"
                );
            }
            self.stamps_refused += 1;
        }
        self.cycle_wakes(due_ns);
        Some(due_ns)
    }

    /// A cycle begins: its inputs are there.
    pub fn cycle_starts(&mut self) {
        let now_ns = clock_monotonic_ns();
        self.timing.watch().inputs_there(now_ns);
        if self.figures.cycles > 0 {
            self.figures.cycle_time_ns = now_ns - self.cycle_start_ns;
        }
        self.cycle_start_ns = now_ns;
        self.computing_since_ns = Some(now_ns);
        self.compute_time_ns = 0;
        if self.figures.state != State::Holding.code() {
            self.figures.state = State::Running.code();
        }
    }

    /// The cycle waits for others; that is not counted as computing.
    pub fn cycle_waits(&mut self) {
        if let Some(since_ns) = self.computing_since_ns.take() {
            self.compute_time_ns += clock_monotonic_ns() - since_ns;
        }
    }

    /// The cycle goes on computing after it waited.
    pub fn cycle_goes_on(&mut self) {
        self.computing_since_ns = Some(clock_monotonic_ns());
    }

    /// The cycle of a tick has ended: counts its time and publishes health.
    ///
    /// # Errors
    /// If health cannot be published.
    pub fn cycle_ends(&mut self, tick: i64) -> Result<(), Failure> {
        self.cycle_waits();
        let figures = &mut self.figures;
        figures.header.tick = tick;
        figures.cycles += 1;
        figures.compute_time_ns = self.compute_time_ns;
        figures.compute_time_sum_ns += self.compute_time_ns;
        figures.compute_time_max_ns = figures.compute_time_max_ns.max(self.compute_time_ns);
        if self.real_time && !self.timing.has_time() && self.compute_time_ns > CONTROL_PERIOD_NS {
            // Without a stamp lateness is not known; this much is.
            figures.misses += 1;
        }
        self.timing.ended(tick, clock_monotonic_ns(), figures);
        self.report()
    }

    /// Says that the work is over and why, and stays until asked to stop, at most some seconds.
    pub(crate) fn linger(&mut self, reason: Reason) -> Result<(), Failure> {
        self.announce(State::Stopping, reason)?;
        let start = Instant::now();
        while start.elapsed() < LINGER && !self.stop.asked() {
            std::thread::sleep(HEARTBEAT.min(Duration::from_millis(10)));
            if self.heartbeat.elapsed() >= HEARTBEAT {
                self.report()?;
            }
        }
        Ok(())
    }
}
