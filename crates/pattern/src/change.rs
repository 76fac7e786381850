//! Changes of a walk that has begun.

/// A change of the plan from a stated tick on. None exists yet, and the type has no value: who takes `&[PlanChange]` today takes an
/// empty list, and is where a change must act when there are some.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanChange {}
