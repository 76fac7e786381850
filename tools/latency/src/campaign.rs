//! The campaign: rounds of walking beside reference threads.

use crate::load::Load;
use crate::machine::{self, ProcessorTimes};
use crate::ticks::{Cycles, LOOP, Ticks};
use crate::wakes::{self, Wakes};
use crate::walk::{Walk, Walked};
use crate::{Campaign, UNUSABLE, criteria, hlog, page, progress, threads};
use anyhow::Context;
use lateness::judge::{self, Verdict};
use lateness::reference::{Excused, Reference};
use lateness::round::Surroundings;
use lateness::{Lateness, Quantiles};
use messages::code::Process;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// How often an invalid round is repeated before the machine counts as unusable.
const REPEATS_MAX: u32 = 2;
/// Seconds that a launch takes beside the walk at most; reference threads run no longer.
const BESIDE_S: u64 = 90;
/// Wake-ups of each kind before a round: two seconds of them.
const WAKES: u64 = 400;
/// Seconds of a swing, of standing before, and after: what makes seconds of swings.
const SWING_S: f64 = 1.2;
const STANDING_S: f64 = 4.0;
/// How much more likely a stalled reference makes a missing command (A3): stalls of this length.
pub const LONG_STALL_NS: u64 = 3_000_000;

/// What one round brought.
#[derive(Debug)]
pub struct Round {
    /// Which, from 1.
    pub number: u32,
    /// Beside what it took place.
    pub surroundings: Surroundings,
    /// Why it does not count; empty: it does.
    pub faults: Vec<String>,
    /// Lateness of each process.
    pub cycles: BTreeMap<u32, Cycles>,
    /// From when a state was out to when the controller woke.
    pub hand_over: Lateness,
    /// The core of each process, read back.
    pub cores: BTreeMap<u32, u32>,
    /// Commands that were not there in time.
    pub missing: Excused,
    /// Commands computed from a deformation one, two, more ticks old.
    pub stale: [u64; 3],
    /// How often the grid moved.
    pub slips: usize,
    /// Minor page faults of each process's thread after the clock began.
    pub faults_minor: BTreeMap<u32, u64>,
    /// Commands that equal lock-step's to the bit, and the first that does not though nothing stale came before it.
    pub compared: crate::ticks::Compared,
    /// The walk.
    pub walked: Walked,
}

/// Everything that was measured.
#[derive(Debug, Default)]
pub struct Measured {
    /// Valid rounds.
    pub valid: Vec<Round>,
    /// Invalid ones.
    pub invalid: Vec<Round>,
    /// Wake-ups beside them.
    pub wakes: Wakes,
    /// Real-time walks for the errors, by scenario, with lock-step's.
    pub walks: Vec<(String, report::WalkFigures, Vec<report::WalkFigures>)>,
    /// Missing commands with and without SCHED_FIFO under load.
    pub control: Option<[Excused; 2]>,
    /// Replay of the last valid round, by process.
    pub replays: Vec<(String, Result<bool, String>)>,
    /// How long the valid rounds walked.
    pub lasted: Duration,
}

impl Measured {
    /// A process's cycles over all valid rounds.
    pub fn pooled(&self, process: Process) -> Cycles {
        let mut pooled = Cycles::default();
        self.valid.iter().filter_map(|round| round.cycles.get(&process.code())).for_each(|cycles| pooled.add(cycles));
        pooled
    }

    /// The reference on a process's core over all valid rounds.
    pub fn pooled_reference(&self, process: Process) -> Lateness {
        let mut pooled = Lateness::default();
        self.valid.iter().filter_map(|round| round.reference(process)).for_each(|seen| pooled.add(&seen.lateness));
        pooled
    }

    /// What a process took after the beginning of its tick, and the reference on its core, over all valid rounds.
    pub fn figures(&self, process: Process) -> [(&'static str, Lateness); 4] {
        let Cycles { woke, published, processor, .. } = self.pooled(process);
        let reference = self.pooled_reference(process);
        [("woke", woke), ("published", published), ("processor", processor), ("reference on its core", reference)]
    }

    /// Per valid round: a process's wake-ups and those of the reference on its core.
    pub fn paired_wakes(&self, process: Process) -> Vec<(Quantiles, Quantiles)> {
        let pair = |round: &Round| {
            let ours = round.cycles.get(&process.code())?.woke.quantiles();
            Some((ours, round.reference(process)?.lateness.quantiles()))
        };
        self.valid.iter().filter_map(pair).collect()
    }

    /// From states to the controller over all valid rounds.
    pub fn hand_over(&self) -> Lateness {
        let mut pooled = Lateness::default();
        self.valid.iter().for_each(|round| pooled.add(&round.hand_over));
        pooled
    }

    /// Missing commands of all valid rounds.
    pub fn missing(&self) -> Excused {
        let mut all = Excused::default();
        self.valid.iter().for_each(|round| all.add(&round.missing));
        all
    }
}

impl Round {
    /// The reference on the core of a process.
    pub fn reference(&self, process: Process) -> Option<&Reference> {
        let core = *self.cores.get(&process.code())? as usize;
        self.surroundings.references.iter().find(|reference| reference.core == core)
    }
}

/// Runs it; the exit code.
pub fn run(wanted: &Campaign) -> anyhow::Result<u8> {
    let facts = machine::tell();
    let swings = (((f64::from(wanted.seconds) - STANDING_S) / SWING_S) as u32).max(1);
    let flat = Walk::of("flat", &wanted.settings, true).set(&format!("planner.gait.walk.swings={swings}"))?;
    let (cores, priority) = (flat.cores()?, flat.priority()? + 1);
    if !threads::are_granted_here(&cores, priority) {
        return Ok(UNUSABLE);
    }
    std::fs::create_dir_all(&wanted.out).with_context(|| format!("cannot make {}", wanted.out.display()))?;
    progress("the same walk in lock-step, for comparing");
    let lock_step = Walk { real_time: false, ..flat.clone() }.walk(&wanted.out.join("lock-step"))?;
    let mut measured = Measured::default();
    let load = wanted.load.start();
    while (measured.valid.len() as u32) < wanted.rounds {
        if measured.invalid.len() as u32 > REPEATS_MAX {
            break;
        }
        let number = (measured.valid.len() + measured.invalid.len()) as u32 + 1;
        let ends = [cores[0], *cores.last().expect("a process names a core")];
        wakes::measure(ends, priority - 1, WAKES, &mut measured.wakes)?;
        let began = Instant::now();
        let round = walk_round(wanted, &flat, number, &cores, priority, &lock_step.ticks)?;
        progress(&round.line());
        if round.faults.is_empty() {
            measured.lasted += began.elapsed();
            measured.valid.push(round);
        } else {
            measured.invalid.push(round);
        }
    }
    drop(load);
    let unusable = (measured.valid.len() as u32) < wanted.rounds;
    if let Some(last) = measured.valid.last() {
        for process in ["estimator", "controller", "simulator"] {
            measured.replays.push((process.to_string(), last.walked.replays(process)));
        }
    }
    if !unusable {
        errors(wanted, &mut measured)?;
        if !wanted.no_control {
            measured.control = Some(control(wanted, &cores, priority)?);
        }
    }
    let criteria = criteria::judge(&measured, wanted.absolute);
    let text = criteria::table(&criteria, &measured);
    node::say(&text)?;
    write(wanted, &measured, &facts, &criteria, unusable)?;
    if unusable {
        let (valid, invalid) = (measured.valid.len(), measured.invalid.len());
        eprintln!(
            "soleus-latency: MACHINE UNUSABLE: {invalid} invalid rounds beside {valid} valid ones; neither pass nor fail"
        );
        return Ok(UNUSABLE);
    }
    let worst = judge::worst(criteria.iter().map(|criterion| &criterion.verdict));
    Ok(u8::from(worst == Verdict::NotMet))
}

fn walk_round(
    wanted: &Campaign,
    walk: &Walk,
    number: u32,
    cores: &[u32],
    priority: u32,
    lock_step: &Ticks,
) -> anyhow::Result<Round> {
    let (before, references) =
        (ProcessorTimes::now(), threads::References::start(cores, priority, u64::from(wanted.seconds) + BESIDE_S));
    let walked = walk.walk(&wanted.out.join(format!("round-{number}")));
    let (references, mut refused) = references.finish();
    let steal_share = ProcessorTimes::now().steal_share_since(before);
    let walked = walked?;
    let ticks = &walked.ticks;
    refused.extend(not_as_asked(ticks));
    let major_faults = ticks.health.values().map(|health| health.major_faults).sum();
    let surroundings = Surroundings { references, steal_share, refused, major_faults };
    let of_each = |figure: &dyn Fn(&messages::Health) -> u64| {
        ticks.health.iter().map(|(process, health)| (*process, figure(health))).collect::<BTreeMap<_, _>>()
    };
    let core = |(process, health): (&u32, &messages::Health)| Some((*process, health.core_plus_one.checked_sub(1)?));
    Ok(Round {
        number,
        faults: surroundings.faults(),
        cycles: ticks.cycles.clone(),
        hand_over: ticks.hand_over(),
        cores: ticks.health.iter().filter_map(core).collect(),
        missing: ticks.missing(&surroundings.references),
        stale: ticks.stale_deformations(),
        slips: ticks.slips().len(),
        faults_minor: of_each(&|health| health.minor_faults),
        compared: ticks.same_as(lock_step),
        surroundings,
        walked,
    })
}

/// Processes of the loop that do not run as a measurement must have it: read back, not believed.
fn not_as_asked(ticks: &Ticks) -> Vec<String> {
    let wrong = |process: &Process| match ticks.health.get(&process.code()) {
        None => Some(format!("{process}: no health is recorded")),
        Some(health) if health.real_time_priority == 0 => Some(format!("{process}: not under SCHED_FIFO")),
        Some(health) if health.core_plus_one == 0 => Some(format!("{process}: on no core of its own")),
        Some(health) if health.memory_locked == 0 => Some(format!("{process}: memory not locked")),
        _ => None,
    };
    LOOP.iter().filter_map(wrong).collect()
}

impl Round {
    /// One line for people who wait.
    pub fn line(&self) -> String {
        let Excused { all, bad, excused } = self.missing;
        let stalls: usize = self.surroundings.references.iter().map(Reference::stalls).sum();
        let ended = match self.walked.code {
            0 => String::new(),
            code => format!("; the launch ended with code {code}"),
        };
        let state =
            if self.faults.is_empty() { "valid".to_string() } else { format!("INVALID ({})", self.faults.join("; ")) };
        format!(
            "round {}: {state}; {bad} of {all} commands missing, {excused} of them excused; {:?} deformations 1, 2, more ticks old; {} slips; \
             {stalls} stalls of the references; steal {:.1} %{ended}",
            self.number,
            self.stale,
            self.slips,
            100.0 * self.surroundings.steal_share
        )
    }
}

/// Scenarios whose errors by the clock are compared with lock-step's.
const SCENARIOS: [&str; 3] = ["flat", "no-stabiliser", "feedback"];

fn errors(wanted: &Campaign, measured: &mut Measured) -> anyhow::Result<()> {
    for name in SCENARIOS.into_iter().filter(|_| wanted.walks > 0) {
        progress(&format!("{name}: once in lock-step, {} times by the clock", wanted.walks));
        let walk = Walk::of(name, &wanted.settings, true);
        let lock_step =
            Walk { real_time: false, ..walk.clone() }.walk(&wanted.out.join(format!("{name}-lock-step")))?;
        let mut by_the_clock = Vec::new();
        for number in 1..=wanted.walks {
            by_the_clock.push(walk.walk(&wanted.out.join(format!("{name}-{number}")))?.figures);
        }
        measured.walks.push((name.to_string(), lock_step.figures, by_the_clock));
    }
    Ok(())
}

/// The same walk under load with and without SCHED_FIFO: a test that does not tell them apart shows nothing.
fn control(wanted: &Campaign, cores: &[u32], priority: u32) -> anyhow::Result<[Excused; 2]> {
    progress("control experiment: under load, with and without SCHED_FIFO");
    let _load = Load::Stress.start();
    let swings = (((f64::from(wanted.seconds.min(30)) - STANDING_S) / SWING_S) as u32).max(1);
    let with = Walk::of("flat", &wanted.settings, true).set(&format!("planner.gait.walk.swings={swings}"))?;
    let mut without = with.clone();
    for process in ["simulator", "estimator", "controller"] {
        without = without.set(&format!("{process}.real_time.policy=ordinary"))?;
    }
    let mut missing = [Excused::default(); 2];
    for (walk, (name, missing)) in [with, without].iter().zip(["fifo", "ordinary"].into_iter().zip(&mut missing)) {
        let references = threads::References::start(cores, priority, u64::from(wanted.seconds) + BESIDE_S);
        let walked = walk.walk(&wanted.out.join(format!("control-{name}")));
        *missing = walked?.ticks.missing(&references.finish().0);
    }
    Ok(missing)
}

fn write(
    wanted: &Campaign,
    measured: &Measured,
    facts: &[(String, String)],
    criteria: &[judge::Criterion],
    unusable: bool,
) -> anyhow::Result<()> {
    let folder = wanted.out.join("histograms");
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    for process in LOOP {
        let cycles = measured.pooled(process);
        for (figure, lateness) in
            [("woke", &cycles.woke), ("published", &cycles.published), ("processor", &cycles.processor)]
        {
            let name = format!("{process}-{figure}");
            hlog::write(&folder.join(&name).with_extension("hlog"), &name, lateness, measured.lasted)?;
        }
        let name = format!("{process}-reference");
        let reference = measured.pooled_reference(process);
        hlog::write(&folder.join(&name).with_extension("hlog"), &name, &reference, measured.lasted)?;
    }
    hlog::write(
        &folder.join("hand-over.hlog"),
        "state out to controller woken",
        &measured.hand_over(),
        measured.lasted,
    )?;
    hlog::write(&folder.join("wake-message.hlog"), "wake by message", &measured.wakes.event, measured.lasted)?;
    hlog::write(&folder.join("wake-futex.hlog"), "wake by futex", &measured.wakes.futex, measured.lasted)?;
    let path = wanted.out.join("latency.html");
    let html = page::page(measured, facts, criteria, unusable);
    std::fs::write(&path, html).with_context(|| format!("cannot write {}", path.display()))?;
    eprintln!("page                   {}\nhistograms             {}", path.display(), folder.display());
    Ok(())
}
