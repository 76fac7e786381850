//! States that run in circles.

use friction::ContactState;

/// Sets of states that are remembered: as many as an attempt has changes of them in all but hopeless cases.
const SETS: usize = 64;
/// Returns to a set of states seen before that are taken for a circle. On the way to a solution a set returns two or three times.
const RETURNS_MAX: usize = 8;

/// The sets of states that one attempt has gone through.
#[derive(Debug)]
pub(super) struct Circles {
    seen: [u64; SETS],
    count: usize,
    returns: usize,
}

impl Default for Circles {
    fn default() -> Self {
        Self { seen: [0; SETS], count: 0, returns: 0 }
    }
}

impl Circles {
    /// Adds states that have just changed; says whether they keep coming round.
    pub(super) fn come_round(&mut self, states: &[ContactState]) -> bool {
        // FNV-1a: two sets of states with one hash would end one attempt early, once in 10^17.
        let hash = states
            .iter()
            .fold(0xcbf2_9ce4_8422_2325_u64, |hash, state| (hash ^ *state as u64).wrapping_mul(0x0000_0100_0000_01b3));
        if self.seen[..self.count.min(SETS)].contains(&hash) {
            self.returns += 1;
        }
        self.seen[self.count % SETS] = hash;
        self.count += 1;
        self.returns > RETURNS_MAX
    }
}
