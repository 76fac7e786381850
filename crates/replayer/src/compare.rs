//! Two runs of the same process, number by number.

use messages::{Message, Plain};
use std::collections::BTreeMap;

/// The largest difference of a field.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// The number that differs most, with its indices: `plan.zmp_m[1]`.
    pub number: String,
    /// Tick of the message; of a pattern the index of the phase.
    pub tick: i64,
    /// What was said then.
    pub then: f64,
    /// What is said now.
    pub now: f64,
}

impl Difference {
    /// |then - now|; infinite if only one of them is a number.
    #[must_use]
    pub fn amount(&self) -> f64 {
        let amount = (self.then - self.now).abs();
        if amount.is_nan() { f64::INFINITY } else { amount }
    }

    /// The amount in units of the larger of |then| and 1 (of the field's own unit).
    #[must_use]
    pub fn relative(&self) -> f64 {
        self.amount() / self.then.abs().max(1.0)
    }
}

/// What came of comparing the messages of a topic.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TopicComparison {
    /// How many were compared.
    pub compared: u64,
    /// How many of them were the same to the bit.
    pub identical: u64,
    /// Said then and not now.
    pub missing: u64,
    /// Said now and not then.
    pub new: u64,
    /// First message that was not the same.
    pub first_tick: Option<i64>,
    /// The largest difference of each field that differs, by its name without indices.
    pub fields: BTreeMap<String, Difference>,
}

/// What came of comparing two runs of a process.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Comparison {
    /// By topic.
    pub topics: BTreeMap<&'static str, TopicComparison>,
}

impl Comparison {
    /// Compares a message of a topic; either may be missing.
    pub(crate) fn message<T: Message>(&mut self, topic: &'static str, then: Option<&T>, now: Option<&T>) {
        let Some((then, now)) = self.both(topic, then, now) else { return };
        let mut now = *now;
        // These two are the bus's, not the process's.
        now.header_mut().sequence = then.header().sequence;
        now.header_mut().clock_monotonic_ns = then.header().clock_monotonic_ns;
        self.value(topic, then.header().tick, then, &now);
    }

    /// Compares any two values of a topic, either of which may be missing.
    pub(crate) fn both<T>(&mut self, topic: &'static str, then: Option<T>, now: Option<T>) -> Option<(T, T)> {
        let entry = self.topics.entry(topic).or_default();
        match (then, now) {
            (Some(then), Some(now)) => return Some((then, now)),
            (Some(_), None) => entry.missing += 1,
            (None, Some(_)) => entry.new += 1,
            (None, None) => {}
        }
        None
    }

    /// Compares two values of a topic.
    pub(crate) fn value<T: Plain>(&mut self, topic: &'static str, tick: i64, then: &T, now: &T) {
        let entry = self.topics.entry(topic).or_default();
        entry.compared += 1;
        let bytes = |value: &T| {
            let mut bytes = Vec::with_capacity(T::SHAPE.size());
            value.write_bytes(&mut bytes);
            bytes
        };
        if bytes(then) == bytes(now) {
            entry.identical += 1;
            return;
        }
        entry.first_tick.get_or_insert(tick);
        let mut numbers = Vec::new();
        then.for_each_number("", &mut |_, number| numbers.push(number));
        let mut numbers = numbers.into_iter();
        now.for_each_number("", &mut |name, now| {
            let then = numbers.next().expect("values of one type have equally many numbers");
            if then.to_bits() != now.to_bits() {
                let found = Difference { number: name.to_string(), tick, then, now };
                let largest = entry.fields.entry(without_indices(name)).or_insert_with(|| found.clone());
                if found.amount() > largest.amount() {
                    *largest = found;
                }
            }
        });
    }

    /// Whether there was anything to compare: nothing is not the same as the same.
    fn compared_any(&self) -> bool {
        self.topics.values().any(|topic| topic.compared > 0)
    }

    /// Whether everything was said again, the same to the bit.
    #[must_use]
    pub fn identical(&self) -> bool {
        self.compared_any()
            && self.topics.values().all(|topic| topic.missing + topic.new == 0 && topic.identical == topic.compared)
    }

    /// Whether everything was said again, no number differing by more than `tolerance` of the larger of its size and 1.
    #[must_use]
    pub fn within(&self, tolerance: f64) -> bool {
        self.compared_any()
            && self.topics.values().all(|topic| {
                topic.missing + topic.new == 0 && topic.fields.values().all(|field| field.relative() <= tolerance)
            })
    }
}

/// `left[3].x_m[0]` without what is in brackets: `left.x_m`.
fn without_indices(name: &str) -> String {
    name.split('[')
        .enumerate()
        .map(|(i, part)| if i == 0 { part } else { part.split_once(']').map_or("", |p| p.1) })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::Comparison;
    use messages::{Header, RobotState, WalkStart};

    const TOPIC: &str = "robot/state";

    fn state(tick: i64) -> RobotState {
        RobotState { header: Header::new(tick, 7), ..RobotState::default() }
    }

    #[test]
    fn what_the_bus_fills_in_is_not_compared_and_everything_else_is_to_the_bit() {
        let mut comparison = Comparison::default();
        let (then, mut now) = (state(3), state(3));
        now.header.sequence = 99;
        comparison.message(TOPIC, Some(&then), Some(&now));
        assert!(comparison.identical());
        // Zero and minus zero are equal numbers and different bits.
        now.joint_position_rad[2] = -0.0;
        comparison.message(TOPIC, Some(&then), Some(&now));
        assert!(!comparison.identical() && comparison.within(0.0));
        assert_eq!((comparison.topics[TOPIC].compared, comparison.topics[TOPIC].identical), (2, 1));
    }

    #[test]
    fn the_largest_difference_of_each_field_is_told_with_its_number_and_tick() {
        let mut comparison = Comparison::default();
        for (tick, joint, by) in [(4, 1, 1e-6), (5, 2, -1e-3), (6, 3, 1e-5)] {
            let (then, mut now) = (state(tick), state(tick));
            now.joint_position_rad[joint] += by;
            comparison.message(TOPIC, Some(&then), Some(&now));
        }
        let topic = &comparison.topics[TOPIC];
        assert_eq!((topic.fields.len(), topic.first_tick), (1, Some(4)));
        let largest = &topic.fields["joint_position_rad"];
        assert_eq!((largest.number.as_str(), largest.tick, largest.now), ("joint_position_rad[2]", 5, -1e-3));
        assert!(comparison.within(1e-3) && !comparison.within(0.9e-3));
    }

    #[test]
    fn no_tolerance_covers_what_is_no_number_or_was_not_said() {
        let (then, mut now) = (state(0), state(0));
        now.joint_position_rad[0] = f64::NAN;
        let mut comparison = Comparison::default();
        comparison.message(TOPIC, Some(&then), Some(&now));
        assert!(!comparison.within(0.99));
        for said in [(Some(WalkStart::default()), None), (None, Some(WalkStart::default()))] {
            let mut comparison = Comparison::default();
            comparison.message(TOPIC, Some(&then), Some(&then));
            assert!(comparison.within(0.0));
            comparison.message("walk/start", said.0.as_ref(), said.1.as_ref());
            assert!(!comparison.within(0.99) && !comparison.identical());
        }
    }

    #[test]
    fn nothing_compared_is_nothing_proven() {
        let comparison = Comparison::default();
        assert!(!comparison.identical() && !comparison.within(0.99));
    }

    #[test]
    fn differences_count_in_units_of_the_number_where_it_is_larger_than_one() {
        let mut comparison = Comparison::default();
        let (mut then, mut now) = (state(0), state(0));
        (then.foot_wrench_n_nm[0][2], now.foot_wrench_n_nm[0][2]) = (400.0, 400.4);
        comparison.message(TOPIC, Some(&then), Some(&now));
        assert!(comparison.within(1.1e-3) && !comparison.within(0.9e-3));
    }
}
