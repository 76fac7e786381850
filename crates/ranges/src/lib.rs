//! What a number that a person sets may be.
//!
//! Every library checks its own settings before it builds anything from them, and all of them say it in the same way: the key, what was
//! found there, what is allowed, and what to do ([`OutOfRange`]).
//!
//! ```
//! use ranges::Range;
//!
//! const MARGIN_M: Range = Range::between(0.0, 0.5);
//!
//! let error = MARGIN_M.demand("limits.zmp_margin_m", 2.0, "a tenth of the sole's length is usual").unwrap_err();
//! assert_eq!(
//!     error.under("gait").to_string(),
//!     "`gait.limits.zmp_margin_m` is 2, must be at least 0 and at most 0.5: a tenth of the sole's length is usual"
//! );
//! ```
//!
//! A library names the keys of its own settings; whoever embeds them in a larger file puts the table's name in front
//! ([`OutOfRange::under`]). Ranges have two ends. The far one excludes what cannot be meant, so that sums and products of settings keep
//! their digits; it does not say what is good.

use std::fmt::{self, Display};

/// Numbers from a least one, or above it, up to a largest one. What is not a number is in no range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    least: f64,
    least_itself: bool,
    most: f64,
}

impl Range {
    /// Both ends belong to it.
    #[must_use]
    pub const fn between(least: f64, most: f64) -> Self {
        assert!(least <= most, "a range has numbers in it");
        Self { least, least_itself: true, most }
    }

    /// Positive numbers up to the largest one.
    #[must_use]
    pub const fn above_zero_to(most: f64) -> Self {
        assert!(most > 0.0, "a range has numbers in it");
        Self { least: 0.0, least_itself: false, most }
    }

    /// Numbers of either sign up to this size.
    #[must_use]
    pub const fn within(size: f64) -> Self {
        Self::between(-size, size)
    }

    /// Whether the number lies in it.
    #[must_use]
    pub fn contains(&self, x: f64) -> bool {
        x <= self.most && (x > self.least || (self.least_itself && x == self.least))
    }

    /// Refuses a number that lies outside, with what to do.
    ///
    /// # Errors
    /// [`OutOfRange`] with all four.
    pub fn demand(&self, key: impl Into<String>, found: f64, remedy: &'static str) -> Result<(), OutOfRange> {
        if self.contains(found) { Ok(()) } else { Err(OutOfRange::new(key, number(found), self.to_string(), remedy)) }
    }

    /// Refuses the first number of a list that lies outside; the key gets its place: `key[2]`.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn demand_each(&self, key: &str, found: &[f64], remedy: &'static str) -> Result<(), OutOfRange> {
        match found.iter().position(|x| !self.contains(*x)) {
            Some(place) => self.demand(format!("{key}[{place}]"), found[place], remedy),
            None => Ok(()),
        }
    }
}

impl Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let from = if self.least_itself { "at least" } else { "more than" };
        write!(f, "{from} {} and at most {}", number(self.least), number(self.most))
    }
}

/// A number as a person would write it: without three hundred zeros.
#[must_use]
pub fn number(x: f64) -> String {
    let readable = x == 0.0 || (1e-4..1e7).contains(&x.abs());
    if readable { format!("{x}") } else { format!("{x:e}") }
}

/// A setting that cannot be. Change it as the remedy says.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{key}` is {found}, must be {expected}: {remedy}")]
pub struct OutOfRange {
    /// Where it stands, as the file spells it: tables and key with points between them.
    pub key: String,
    /// What was found.
    pub found: String,
    /// What is allowed.
    pub expected: String,
    /// What is usual, or what to do.
    pub remedy: String,
}

impl OutOfRange {
    /// For what no [`Range`] can say: relations between settings, lists, names.
    pub fn new(
        key: impl Into<String>,
        found: impl Display,
        expected: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self { key: key.into(), found: found.to_string(), expected: expected.into(), remedy: remedy.into() }
    }

    /// The same error in a file in which the settings stand below this table.
    #[must_use]
    pub fn under(self, table: &str) -> Self {
        Self { key: format!("{table}.{}", self.key), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_belong_to_a_range_as_it_says() {
        let closed = Range::between(-1.0, 2.0);
        assert!(closed.contains(-1.0) && closed.contains(2.0) && !closed.contains(2.0_f64.next_up()));
        let open = Range::above_zero_to(2.0);
        assert!(!open.contains(0.0) && !open.contains(-0.0) && open.contains(f64::from_bits(1)));
        assert!(Range::within(3.0).contains(-3.0) && !Range::within(3.0).contains(3.1));
        for strange in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(!closed.contains(strange) && !open.contains(strange), "{strange}");
        }
    }

    #[test]
    fn an_error_says_key_value_range_and_remedy() {
        let said = |range: Range, found| range.demand("a.b_m", found, "give metres").unwrap_err().to_string();
        assert_eq!(
            said(Range::above_zero_to(1e9), -1e-9),
            "`a.b_m` is -1e-9, must be more than 0 and at most 1e9: give metres"
        );
        assert_eq!(
            said(Range::between(0.01, 50.0), f64::NAN),
            "`a.b_m` is NaN, must be at least 0.01 and at most 50: give metres"
        );
        Range::between(0.0, 1.0).demand("a.b_m", 1.0, "give metres").expect("it is in range");
        let list = Range::within(1.0).demand_each("bias", &[0.0, 1e300], "less").unwrap_err();
        assert_eq!(list.under("sensors").under("plant").key, "plant.sensors.bias[1]");
    }

    #[test]
    fn numbers_are_short_whatever_their_size() {
        let said = [0.0, 0.65, 1e-4, 1e-5, 1_000_000.0, 1e7, -1e300].map(number);
        assert_eq!(said, ["0", "0.65", "0.0001", "1e-5", "1000000", "1e7", "-1e300"]);
    }
}
