//! What is a message: names on the wire, and what recordings of former versions hold.

use crate::header::Header;
use crate::older::{self, Gone, Older};
use crate::plain::Plain;
use iceoryx2::prelude::ZeroCopySend;

/// A message: a plain value with a header first.
pub trait Message: Plain + std::fmt::Debug + ZeroCopySend + 'static {
    /// The type's name and version on the wire.
    const WIRE_NAME: &'static str;

    /// Older versions of it that recordings hold, newest first.
    const OLDER: &'static [Older] = &[];

    /// Derives what an older version did not hold from what it did: the fields of the same meaning are filled in already, the others
    /// are zero, and `gone` has the numbers of those that have no place any more.
    fn complete(&mut self, _gone: &Gone) {}

    /// Its header.
    fn header(&self) -> &Header;

    /// Its header, to be filled in.
    fn header_mut(&mut self) -> &mut Header;
}

macro_rules! message {
    ($($type:ty, $wire_name:literal $(, older $older:path, $complete:path)?;)*) => {$(
        impl $crate::Message for $type {
            const WIRE_NAME: &'static str = $wire_name;
            $(
                const OLDER: &'static [$crate::Older] = &$older;
                fn complete(&mut self, gone: &$crate::Gone) {
                    $complete(self, gone);
                }
            )?
            fn header(&self) -> &$crate::Header {
                &self.header
            }
            fn header_mut(&mut self) -> &mut $crate::Header {
                &mut self.header
            }
        }
    )*};
}

message! {
    crate::PatternHeader, "soleus.PatternHeaderV1";
    crate::WalkStart, "soleus.WalkStartV1";
    crate::WalkOrder, "soleus.WalkOrderV1";
    crate::RobotState, "soleus.RobotStateV2", older older::ROBOT_STATE, older::same;
    crate::SoleDeformation, "soleus.SoleDeformationV2", older older::SOLE_DEFORMATION, older::same;
    crate::SoleContact, "soleus.SoleContactV1";
    crate::RobotCommand, "soleus.RobotCommandV2", older older::ROBOT_COMMAND, older::command;
    crate::Truth, "soleus.TruthV2", older older::TRUTH, older::truth;
    crate::Health, "soleus.HealthV2", older older::HEALTH, older::health;
}
