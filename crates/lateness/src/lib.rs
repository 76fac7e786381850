//! How late a periodic process is, and how that is judged.
//!
//! Tick *k* has a time `t_k = t_0 + k T`, which the owner of the clock grid stamps on its message; all others measure against that
//! stamp. A cycle has four figures, all in nanoseconds:
//!
//! | figure | meaning | catches |
//! |---|---|---|
//! | woke | from `t_k` to when the thread ran | a late timer, another thread on the core, a stalled machine |
//! | inputs | from `t_k` to when all inputs were there | a late partner |
//! | published | from `t_k` to when the answer was out | all of it: what the others see |
//! | processor | time of the processor in the cycle | work that is too much |
//!
//! The last one alone is what is often called a deadline, and it never fires for what really happens: a thread that is woken 20 ms late
//! and computes for 0.1 ms has missed four ticks. So [`Watch`] judges by *lateness*, and an overrun names the longest step.
//!
//! [`Lateness`] is a histogram of fixed size (HdrHistogram, two significant digits from 0.5 us to 10 s): recording neither allocates nor
//! loops. Percentiles are given only where at least [`histogram::SAMPLES_BEYOND`] samples lie beyond them; the largest always, and it
//! says something only beside the count and the duration.
//!
//! [`reference`] pairs a measurement with a thread that does nothing but wake up beside it on the same core: what stalls both is the
//! machine's. [`judge`] turns paired rounds into verdicts: met, not met, not judged.
//!
//! [`RightsSettings`] is what a process asks of the system in order to be on time; who asks and is granted is `node`.
//!
//! *Not here*: clocks, threads, files. All are told the time.
//!
//! References: G. Tene, *HdrHistogram*; cyclictest and the latency plots of OSADL (largest first, linear time against logarithmic
//! count); ros2_control issue 2529 (two grids beat against each other: so there is one).

pub mod histogram;
pub mod judge;
pub mod reference;
mod rights;
pub mod round;
mod watch;

pub use histogram::{Lateness, Quantiles};
pub use rights::{PolicyWish, RightsSettings};
pub use watch::{Cycle, Deadlines, Figure, Overrun, Watch};
