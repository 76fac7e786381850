//! Keys that there were once, and what has become of them.

/// Key within a process's configuration, and what to do.
const RETIRED: [(&str, &str); 6] = [
    ("integration.sole_yield", "it is called integration.compliance_feed_forward now"),
    ("integration.sole_yield_time_s", "it is called integration.compliance_time_s now"),
    ("plant.step.control_period_s", "every process has the tick of 5 ms: remove the key"),
    ("sole.rigid.ankle_in_sole_m", "the ankle is the nominal sole's: remove the key"),
    ("sole.rigid.friction", "friction is the nominal sole's, times sole.friction_factor: remove the key"),
    ("solver.reserve", "it is called solver.backup now"),
];

/// What to do with a key that was one, if it was.
pub(crate) fn advice(key: &str) -> Option<&'static str> {
    RETIRED.iter().find(|(retired, _)| *retired == key).map(|(_, advice)| *advice)
}
