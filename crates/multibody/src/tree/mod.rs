//! The recursions, from body to body, with one coordinate per body: they know nothing of joints that follow others.
//!
//! Each file is one algorithm and writes [`Memory`](memory::Memory); what it needs of another's results it says.

pub(crate) mod aba;
pub(crate) mod crba;
pub(crate) mod jacobian;
pub(crate) mod kinematics;
pub(crate) mod memory;
pub(crate) mod rnea;
pub(crate) mod whole_body;
